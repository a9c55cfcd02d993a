//! The `# key: value` lines.

use model::record::{Base, Header};

use super::CaptureError;

/// How the key begins that states the unit of a column.
const UNIT_OF: &str = "unit of ";

/// Rates, Hz, and ticks, s, that a stand can have; beyond them nothing has digits that mean anything.
pub(crate) const BELIEVED: std::ops::RangeInclusive<f64> = 1e-12..=1e12;

/// The header with where each key stands.
#[derive(Debug, Default)]
pub(crate) struct Lines {
    pub entries: Vec<(usize, String, String)>,
}

impl Lines {
    /// Takes what stands after a `#`, if it is `key: value` or `unit of COLUMN: UNIT`; free text is kept out.
    pub fn take(&mut self, number: usize, text: &str) -> bool {
        let Some((key, value)) = text.split_once(':') else {
            return false;
        };
        let key = key.trim();
        let word = |b: u8| b.is_ascii_alphanumeric() || b == b'_' || b == b'-';
        let is_key = !key.is_empty() && key.bytes().all(word) || key.starts_with(UNIT_OF);
        if is_key {
            self.entries
                .push((number, key.to_owned(), value.trim().to_owned()));
        }
        is_key
    }

    /// The unit that the header states for a column.
    pub fn unit_of(&self, column: &str) -> Option<&str> {
        self.get(&format!("{UNIT_OF}{column}"))
            .map(|(_, unit)| unit)
    }

    pub fn get(&self, key: &str) -> Option<(usize, &str)> {
        self.entries
            .iter()
            .rev()
            .find(|(_, k, _)| k == key)
            .map(|(line, _, value)| (*line, value.as_str()))
    }

    /// A number, if the key is there.
    pub fn number(&self, key: &str) -> Result<Option<f64>, CaptureError> {
        let Some((line, text)) = self.get(key) else {
            return Ok(None);
        };
        match text.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(Some(value)),
            _ => Err(bad(line, key, text, "a finite number")),
        }
    }

    /// A number that has to be there for `column`.
    pub fn needed(&self, key: &str, column: &str) -> Result<f64, CaptureError> {
        self.number(key)?.ok_or_else(|| CaptureError::MissingKey {
            key: key.to_owned(),
            column: column.to_owned(),
        })
    }

    /// As [`needed`](Self::needed), and not 0.
    pub fn scale(&self, key: &str, column: &str) -> Result<f64, CaptureError> {
        let value = self.needed(key, column)?;
        if value > 0.0 {
            return Ok(value);
        }
        let (line, text) = self.get(key).unwrap_or_default();
        Err(bad(line, key, text, "a number above 0"))
    }

    /// The parsed header.
    pub fn header(&self) -> Result<Header, CaptureError> {
        if let Some((line, found)) = self.get("format")
            && found != "imu-stand-capture/1"
        {
            return Err(CaptureError::Format {
                line,
                found: found.to_owned(),
            });
        }
        let positive = |key: &str| match self.number(key)? {
            Some(value) if !BELIEVED.contains(&value) => {
                let (line, text) = self.get(key).unwrap_or_default();
                Err(bad(line, key, text, "a number above 0, from 1e-12 to 1e12"))
            }
            value => Ok(value),
        };
        let base = match self.get("base") {
            None => None,
            Some((_, "static")) => Some(Base::Static),
            Some((_, "moving")) => Some(Base::Moving),
            Some((_, "turntable")) => Some(Base::Turntable),
            Some((line, other)) => {
                return Err(bad(
                    line,
                    "base",
                    other,
                    "`static`, `moving` or `turntable`",
                ));
            }
        };
        Ok(Header {
            rate_hz: positive("rate_hz")?,
            tick_s: positive("tick_s")?,
            tick_tolerance_ppm: self.number("tick_tolerance_ppm")?,
            base,
            entries: self
                .entries
                .iter()
                .filter(|(_, key, _)| !key.starts_with(UNIT_OF))
                .map(|(_, key, value)| (key.clone(), value.clone()))
                .collect(),
        })
    }
}

fn bad(line: usize, key: &str, found: &str, expected: &str) -> CaptureError {
    CaptureError::BadKey {
        line,
        key: key.to_owned(),
        found: found.to_owned(),
        expected: expected.to_owned(),
    }
}
