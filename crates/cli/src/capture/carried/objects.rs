//! An object of JSON a line: `{"t":1,"gyro":{"x":0.1}}`.

use serde_json::Value;

use super::{Made, SHOWN, write_cells};

/// Deeper objects are no rows.
const DEEP: usize = 4;
/// More cells are no row.
const WIDE: usize = 1000;

/// Objects with the keys of the first one.
pub(super) struct Objects {
    pub names: Vec<String>,
}

impl Objects {
    /// Objects that all have the keys of the first one, one of them a number at least.
    pub fn of(lines: &[&str]) -> Option<Self> {
        let first = cells(lines.first()?)?;
        let has_number = first.iter().any(|(_, cell)| cell.parse::<f64>().is_ok());
        let names: Vec<String> = first.into_iter().map(|(name, _)| name).collect();
        let is_like = |line: &&&str| {
            let own = cells(line);
            own.is_some_and(|own| own.iter().map(|(name, _)| name).eq(&names))
        };
        let count = lines.iter().filter(is_like).count();
        (has_number && count >= SHOWN && 2 * count > lines.len()).then_some(Self { names })
    }

    pub fn row(&self, line: &str, row: &mut String) -> Made {
        let Some(own) = cells(line) else {
            return Made::Other;
        };
        let is_same = own.iter().map(|(name, _)| name).eq(&self.names);
        let cell = |(k, name): (usize, &String)| {
            if is_same {
                return own[k].1.as_str();
            }
            let found = own.iter().find(|(own, _)| own == name);
            found.map_or("", |(_, cell)| cell.as_str())
        };
        write_cells(self.names.iter().enumerate().map(cell), row);
        Made::Row
    }
}

/// The names and cells of an object; nothing where the line is none.
fn cells(line: &str) -> Option<Vec<(String, String)>> {
    if !line.starts_with('{') {
        return None;
    }
    let value: Value = serde_json::from_str(line).ok()?;
    let mut all = Vec::new();
    flatten(String::new(), &value, 0, &mut all)?;
    (!all.is_empty()).then_some(all)
}

fn flatten(
    name: String,
    value: &Value,
    depth: usize,
    all: &mut Vec<(String, String)>,
) -> Option<()> {
    if depth > DEEP || all.len() >= WIDE {
        return None;
    }
    match value {
        Value::Object(object) => {
            for (key, value) in object {
                let of = match name.is_empty() {
                    true => key.clone(),
                    false => format!("{name}.{key}"),
                };
                flatten(of, value, depth + 1, all)?;
            }
        }
        Value::Array(array) => {
            for (k, value) in array.iter().enumerate() {
                flatten(format!("{name}[{k}]"), value, depth + 1, all)?;
            }
        }
        Value::Null => all.push((name, String::new())),
        Value::String(text) => all.push((name, text.replace(['\r', '\n'], " "))),
        Value::Bool(is) => all.push((name, u8::from(*is).to_string())),
        Value::Number(number) => all.push((name, number.to_string())),
    }
    Some(())
}
