//! HDF5, which MATLAB's .mat of version 7.3 is.

use std::path::Path;

use super::super::units::known;
use super::{Arrays, open};

/// An array of a group or struct is called `GROUP.ARRAY`.
pub(super) fn hdf5(path: &Path) -> Result<Arrays, String> {
    let bad = |error: hdf5_pure::Error| {
        format!(
            "it cannot be read as HDF5: {error}. In MATLAB, `save(FILE, '-v7')` writes a version without HDF5"
        )
    };
    let opened = open(path)?;
    let mut out = Arrays::of(&opened)?;
    // An array of which nothing is stored claims any size, and is read as that many fill values.
    let length = opened.metadata().map_err(|error| error.to_string())?.len();
    out.limit(length.saturating_mul(PACKS));
    // What a chunk claims to take in the file is believed where the file is read piece by piece, up to 4 GiB.
    let file = if length <= WHOLE {
        let bytes = std::fs::read(path).map_err(|error| error.to_string())?;
        hdf5_pure::File::from_bytes(bytes)
    } else {
        hdf5_pure::File::open_streaming(path)
    };
    let file = file.map_err(bad)?;
    let mut too_large = Ok(());
    hdf5_group(&file.root(), "", 0, &mut out, &mut too_large).map_err(bad)?;
    too_large.map(|()| out)
}

/// A byte of deflate stands for 1032 at the most (RFC 1951: 258 by two bits); other filters do no better on readings.
const PACKS: u64 = 1032;

/// Bytes of a file that is read at once.
const WHOLE: u64 = 1 << 30;

/// Attributes in which writers state the unit of an array (`units` in the CF conventions).
const UNITS: [&str; 3] = ["units", "unit", "Units"];

/// Groups within groups that are followed.
const DEEPEST: usize = 16;

fn hdf5_group(
    group: &hdf5_pure::Group,
    within: &str,
    depth: usize,
    out: &mut Arrays,
    too_large: &mut Result<(), String>,
) -> Result<(), hdf5_pure::Error> {
    use hdf5_pure::DType as D;
    for name in group.datasets()? {
        let array = group.dataset(&name)?;
        let attributes = array.attrs()?;
        // MATLAB keeps text as numbers and an empty array as its size.
        let class = attributes.get("MATLAB_class").map(|v| format!("{v:?}"));
        if class.is_some_and(|c| c.contains("char") || c.contains("cell"))
            || attributes.contains_key("MATLAB_empty")
        {
            continue;
        }
        let shape = array.shape()?;
        if let Err(why) = out.reserve(&format!("{within}{name}"), &shape) {
            *too_large = Err(why);
            return Ok(());
        }
        let values = match array.dtype()? {
            D::F64 | D::F32 | D::I8 | D::I16 | D::I32 | D::U8 | D::U16 | D::U32 => {
                array.read_f64()?
            }
            D::I64 => array.read_i64()?.into_iter().map(|v| v as f64).collect(),
            D::U64 => array.read_u64()?.into_iter().map(|v| v as f64).collect(),
            _ => continue,
        };
        let shape: Vec<usize> = shape.iter().map(|n| *n as usize).collect();
        let before = out.columns.len();
        out.add(&format!("{within}{name}"), &shape, values, true);
        let stated = UNITS.iter().find_map(|key| attributes.get(*key)?.as_str());
        // Text that is no unit of this program's says nothing; the unit is asked for then.
        if let Some(unit) = stated.and_then(known) {
            let columns = out.columns[before..].iter();
            let stated = columns.map(|(name, _)| (format!("unit of {name}"), unit.to_owned()));
            out.about.extend(stated);
        }
    }
    for name in group.groups()? {
        // What MATLAB keeps for itself begins so.
        if !name.starts_with('#') && depth < DEEPEST {
            hdf5_group(
                &group.group(&name)?,
                &format!("{within}{name}."),
                depth + 1,
                out,
                too_large,
            )?;
        }
    }
    Ok(())
}
