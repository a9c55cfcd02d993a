//! NPY and NPZ of NumPy.

use std::collections::BTreeMap;
use std::io::{BufReader, Cursor, Read as _};
use std::path::Path;

use super::super::error::brief;
use super::{Arrays, open};

pub(super) fn npy(path: &Path) -> Result<Arrays, String> {
    let file = open(path)?;
    let mut out = Arrays::of(&file)?;
    npy_array(&mut out, "values", BufReader::new(file))?;
    Ok(out)
}

pub(super) fn npz(path: &Path) -> Result<Arrays, String> {
    let bad = |error: zip::result::ZipError| format!("it is no NPZ: {error}");
    let file = open(path)?;
    let mut out = Arrays::of(&file)?;
    let mut archive = zip::ZipArchive::new(BufReader::new(file)).map_err(bad)?;
    for i in 0..archive.len() {
        let mut entry = archive.by_index(i).map_err(bad)?;
        let name = entry.name().map_err(bad)?.into_owned();
        if name == "about.json.npy" {
            out.about.extend(about(&npy_text(&mut entry)?)?);
        } else if let Some(name) = name.strip_suffix(".npy") {
            npy_array(&mut out, name, &mut entry)
                .map_err(|why| format!("array `{name}`: {why}"))?;
        } else if name == "about.json" {
            let mut text = String::new();
            (entry.by_ref().take(LONGEST_TEXT).read_to_string(&mut text))
                .map_err(|error| format!("about.json: {error}"))?;
            out.about.extend(about(&text)?);
        }
    }
    Ok(out)
}

fn about(text: &str) -> Result<BTreeMap<String, String>, String> {
    serde_json::from_str(text).map_err(|error| format!("about.json: {error}"))
}

/// An array that is one text in UTF-32; another one is none.
fn npy_text(mut input: impl std::io::Read) -> Result<String, String> {
    let (header, _) = npy_header(&mut input).map_err(|why| format!("about.json: {why}"))?;
    if !String::from_utf8_lossy(&header).contains("'<U") {
        return Err("about.json: it is no text".to_owned());
    }
    let mut bytes = Vec::new();
    (input.take(4 * LONGEST_TEXT).read_to_end(&mut bytes))
        .map_err(|error| format!("about.json: {error}"))?;
    let letters = bytes.as_chunks().0.iter().map(|b| u32::from_le_bytes(*b));
    Ok(letters.filter_map(char::from_u32).collect())
}

/// Bytes of the text about a file, and of the header of an array, that are read at most.
const LONGEST_TEXT: u64 = 1 << 16;

/// The header of an array of NumPy as it stands, and the shape that it says. Magic, version of the format and length of the text
/// come before it, that in two bytes in version 1 and in four later. The shape is read here, since whoever multiplies it without
/// looking fails.
fn npy_header(mut input: impl std::io::Read) -> Result<(Vec<u8>, Vec<u64>), String> {
    let mut header = vec![0; 10];
    let mut fill = |bytes: &mut [u8]| input.read_exact(bytes).map_err(|error| error.to_string());
    fill(&mut header)?;
    let mut length = [header[8], header[9], 0, 0];
    if header[6] > 1 {
        fill(&mut length[2..])?;
        header.extend(&length[2..]);
    }
    let length = u32::from_le_bytes(length);
    if u64::from(length) > LONGEST_TEXT {
        return Err(format!("its header claims {length} bytes"));
    }
    let from = header.len();
    header.resize(from + length as usize, 0);
    fill(&mut header[from..])?;
    let text = String::from_utf8_lossy(&header[from..]);
    let said = text
        .split_once("shape")
        .and_then(|(_, rest)| rest.split_once('('));
    let said = said.and_then(|(_, rest)| rest.split_once(')'));
    let sizes = said
        .map_or("", |(sizes, _)| sizes)
        .split(',')
        .map(str::trim);
    let sizes = sizes.filter(|size| !size.is_empty()).map(str::parse);
    let shape: Result<Vec<u64>, _> = sizes.collect();
    let shape = shape.map_err(|_| format!("its shape is `{}`", brief(said.map_or("", |s| s.0))))?;
    Ok((header, shape))
}

/// Adds an array; one of text or objects is left out.
fn npy_array(out: &mut Arrays, name: &str, mut input: impl std::io::Read) -> Result<(), String> {
    fn cells<T: npyz::Deserialize>(
        file: npyz::NpyFile<impl std::io::Read>,
        number: fn(T) -> f64,
    ) -> Result<Vec<f64>, String> {
        let cells = file.into_vec::<T>().map_err(|error| error.to_string())?;
        Ok(cells.into_iter().map(number).collect())
    }
    let (header, shape) = npy_header(&mut input)?;
    out.reserve(name, &shape)?;
    let header = npyz::NpyHeader::from_reader(Cursor::new(header));
    let header = header.map_err(|error| {
        // A parser shows the text that it does not understand, however long.
        let why = error.to_string();
        brief(why.lines().next().unwrap_or_default())
    })?;
    let file = npyz::NpyFile::with_header(header, input);
    let shape: Vec<usize> = file.shape().iter().map(|n| *n as usize).collect();
    let by_rows = file.order() == npyz::Order::C;
    let npyz::DType::Plain(kind) = file.dtype() else {
        return Err("a structured array: save its fields as arrays of their own".to_owned());
    };
    let values = match &kind.to_string()[1..] {
        "f8" => cells::<f64>(file, |v| v)?,
        "f4" => cells::<f32>(file, f64::from)?,
        "i8" => cells::<i64>(file, |v| v as f64)?,
        "i4" => cells::<i32>(file, f64::from)?,
        "i2" => cells::<i16>(file, f64::from)?,
        "i1" => cells::<i8>(file, f64::from)?,
        "u8" => cells::<u64>(file, |v| v as f64)?,
        "u4" => cells::<u32>(file, f64::from)?,
        "u2" => cells::<u16>(file, f64::from)?,
        "u1" => cells::<u8>(file, f64::from)?,
        "b1" => cells::<bool>(file, |v| f64::from(u8::from(v)))?,
        _ => return Ok(()),
    };
    out.add(name, &shape, values, by_rows);
    Ok(())
}
