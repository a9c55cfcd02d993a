//! What a count is, as a file states it in words before its table: `# Gyro scale: 131 LSB/(deg/s)`, `accel 0.061 mg/LSB`.

use std::io::BufRead;

use model::record::{Header, Quantity};

use super::CaptureError;
use super::cells::Cells;
use super::columns::{Column, Columns, Held, Role};
use super::error::brief;
use super::layout::Layout;
use super::propose::inertial;
use super::stream::TextLines;
use super::units::{COUNTS, What, convert, is_angle, is_unit_of, known};

/// The size of a count, and where it stands.
#[derive(Clone, Debug, PartialEq)]
struct Stated {
    quantity: Quantity,
    /// `0.0076deg/s`.
    unit: String,
    line: u64,
    text: String,
}

/// What the lines before a table say of scales.
#[derive(Debug, Default)]
pub(super) struct Scales {
    /// What was taken, for the user.
    pub notes: Vec<String>,
    /// Lines that say something of a scale and were not taken, for who is asked for a unit.
    pub untaken: Vec<String>,
    /// What a count of gyros is, deg/s, that are in a unit of a rate.
    of_rates: Option<f64>,
}

/// Key of a header that says what a count of the gyros is, deg/s.
const GYRO_SCALE: &str = "gyro_lsb_dps";
/// What counts are called.
const COUNT: [&str; 6] = ["lsb", "counts", "count", "digits", "digit", "bit"];
/// Words of a line that says something of a scale.
const OF_SCALE: [&str; 8] = [
    "scale",
    "range",
    "sensitivity",
    "resolution",
    "lsb",
    "counts",
    "fs_sel",
    "full",
];
/// Rows that are looked at, all of whose cells are whole numbers where they are counts.
const ROWS: usize = 50;

impl Scales {
    /// Takes what lines before the table say, once and without another word against it, for columns of whole numbers whose
    /// unit nothing says.
    ///
    /// # Errors
    /// The stream's.
    pub fn take(
        layout: &mut Layout,
        text: &mut TextLines<impl BufRead>,
    ) -> Result<Self, CaptureError> {
        let mut found = Self::default();
        found.notes.extend(of_gcsv(layout));
        let said = layout.said.clone();
        let lines: Vec<&(u64, String)> = said.iter().filter(|(_, line)| is_of(line)).collect();
        if lines.is_empty() || layout.numbered || layout.lines.get("format").is_some() {
            return Ok(found);
        }
        let stated: Vec<Stated> = (lines.iter())
            .flat_map(|(line, text)| scales(*line, text))
            .collect();
        let whole = whole_columns(layout, text)?;
        let quantities = inertial(&layout.names);
        let mut taken = Vec::new();
        for quantity in [Quantity::Gyro, Quantity::Acc] {
            let mut of = stated.iter().filter(|s| s.quantity == quantity);
            let Some(first) = of
                .next()
                .filter(|one| of.all(|other| other.unit == one.unit))
            else {
                continue;
            };
            let is_of = |at: &usize| quantities[*at] == Some(quantity);
            let places: Vec<usize> = (0..layout.names.len()).filter(is_of).collect();
            let is_open = |at: &usize| {
                whole[*at] && (layout.units[*at].as_deref()).is_none_or(|unit| unit == COUNTS)
            };
            let in_unit = |at: &usize| layout.units[*at].as_deref().is_some_and(|u| u != COUNTS);
            if quantity == Quantity::Gyro && !places.is_empty() && places.iter().all(in_unit) {
                found.of_rates = convert(What::Channel(quantity), Some(&first.unit))
                    .ok()
                    .map(|by| by.scale);
            }
            if places.is_empty() || !places.iter().all(is_open) {
                continue;
            }
            for at in places {
                layout.units[at] = Some(first.unit.clone());
            }
            taken.push(first.line);
            found.notes.push(format!(
                "counts of the {} are taken as {} each, as line {} says (`{}`); `--units` says otherwise",
                if quantity == Quantity::Gyro { "gyros" } else { "accelerometers" },
                short(&first.unit),
                first.line,
                brief(&first.text)
            ));
        }
        found.untaken = (lines.iter())
            .filter(|(line, _)| !taken.contains(line))
            .map(|(line, text)| format!("line {line} says `{}`", brief(text.trim())))
            .collect();
        Ok(found)
    }

    /// States in the header what a count is of gyros that were read in deg/s: their readings may be multiples of several.
    pub fn state(&self, header: &mut Header, found: &Columns) {
        let in_values = |c: &Column| match &c.role {
            Role::Measured {
                quantity: Quantity::Gyro,
                held,
                unit,
                ..
            } => *held == Held::Values && unit == "deg/s",
            _ => true,
        };
        let has = header.entries.iter().any(|(key, _)| key == GYRO_SCALE);
        if let Some(lsb) = self.of_rates.filter(|_| !has)
            && found.columns.iter().all(in_values)
        {
            header
                .entries
                .push((GYRO_SCALE.to_owned(), lsb.to_string()));
        }
    }

    /// An error that asks for a unit, with what the file says of it.
    pub fn mention(&self, error: CaptureError) -> CaptureError {
        if self.untaken.is_empty() {
            return error;
        }
        let said = self.untaken.join(", ");
        match error {
            CaptureError::Option {
                option: "--units",
                why,
                help,
            } => CaptureError::Option {
                option: "--units",
                why,
                help: format!("{help}; {said}"),
            },
            CaptureError::MissingKey { column, .. } => CaptureError::Option {
                option: "--units",
                why: format!("nothing says the unit of {column}"),
                help: format!(
                    "say it, `--units gyro=deg/s` or `gyro=rad/s`, `acc=m/s2` or `acc=g`, or what a count is, \
                     `gyro=0.0076deg/s`; {said}"
                ),
            },
            error => error.hinting(&said),
        }
    }
}

/// How a log for stabilizing videos begins (gcsv): its lines `tscale`, `gscale` and `ascale` say what a number of its columns
/// is, in s, rad/s and g.
const GCSV: &str = "GYROFLOW IMU LOG";

/// Takes the scales of such a log, and tells so.
fn of_gcsv(layout: &mut Layout) -> Option<String> {
    let mut lines = layout.said.iter().map(|(_, line)| line.trim());
    lines.find(|line| *line == GCSV)?;
    let scale = |key: &str| {
        let lines = layout.said.iter();
        let mut of = lines.filter_map(|(_, line)| line.trim().strip_prefix(key)?.strip_prefix(','));
        let scale: f64 = of.next()?.trim().parse().ok()?;
        (scale > 0.0 && scale.is_finite()).then_some(scale)
    };
    let mut taken = Vec::new();
    for (key, unit, names) in [
        ("tscale", "s", &["t"][..]),
        ("gscale", "rad/s", &["gx", "gy", "gz"]),
        ("ascale", "g", &["ax", "ay", "az"]),
    ] {
        let Some(scale) = scale(key) else { continue };
        let columns = layout.names.iter().zip(&mut layout.units);
        let of_columns = columns.filter(|(name, _)| names.contains(&name.as_str()));
        for (_, own) in of_columns {
            *own = Some(format!("{scale}{unit}"));
        }
        taken.push(format!("{key} {scale} {unit}"));
    }
    let taken = taken.join(", ");
    (!taken.is_empty()).then(|| format!("the scales are those of the file: {taken}"))
}

/// Whether a line says something of a sensor's scale.
fn is_of(line: &str) -> bool {
    let small = line.to_lowercase();
    sensor(&small).is_some() && OF_SCALE.iter().any(|word| small.contains(word))
}

/// The sensor that a text is of.
fn sensor(small: &str) -> Option<Quantity> {
    match (small.contains("gyr"), small.contains("acc")) {
        (true, false) => Some(Quantity::Gyro),
        (false, true) => Some(Quantity::Acc),
        (true, true) => Some(Quantity::Other),
        (false, false) => None,
    }
}

/// The scales that a line states, one thing after another.
fn scales(line: u64, text: &str) -> Vec<Stated> {
    let of = |part: &str| {
        let quantity = sensor(&part.to_lowercase()).filter(|q| *q != Quantity::Other)?;
        Some(Stated {
            quantity,
            unit: scale(part, What::Channel(quantity))?,
            line,
            text: text.trim().to_owned(),
        })
    };
    let parts = text.split([';', '|']).flat_map(|part| part.split(", "));
    parts.filter_map(of).collect()
}

/// The size of a count that a text states: its one number, with its unit behind it or in brackets before.
fn scale(text: &str, what: What) -> Option<String> {
    let is_part = |c: char| c.is_ascii_digit() || c == '.';
    let (mut found, mut numbers) = (None, 0);
    let mut from = 0;
    while let Some(at) = text[from..]
        .find(|c: char| c.is_ascii_digit())
        .map(|at| from + at)
    {
        let mut end = at + text[at..].find(|c| !is_part(c)).unwrap_or(text.len() - at);
        // 6.1e-5.
        if let Some(exponent) = text[end..].strip_prefix(['e', 'E']) {
            let sign = exponent.len() - exponent.trim_start_matches(['-', '+']).len();
            let digits = exponent[sign..]
                .bytes()
                .take_while(u8::is_ascii_digit)
                .count();
            end += if digits > 0 { 1 + sign + digits } else { 0 };
        }
        let is_own =
            !text[..at].ends_with(|c: char| c.is_alphanumeric() || matches!(c, '^' | '.' | '-'));
        let number = text[at..end].parse::<f64>().ok();
        if let Some(number) = number.filter(|n| is_own && *n > 0.0 && n.is_finite()) {
            let before = text[..at].rfind(['[', '(']).map(|open| &text[open..at]);
            let unit = per_count(&text[end..], what).or_else(|| per_count(before?, what));
            numbers += 1;
            found = unit.map(|(unit, is_inverse)| {
                let size = if is_inverse { 1.0 / number } else { number };
                format!("{size}{unit}")
            });
        }
        from = end;
    }
    found.filter(|_| numbers == 1)
}

/// The unit of which a text says how much a count is, or, inversely, how many counts one is: `mdps/LSB`, `LSB/(deg/s)`.
fn per_count(text: &str, what: What) -> Option<(&'static str, bool)> {
    let small = text.to_lowercase().replace(" per ", "/");
    let small: String = (small.chars())
        .filter(|c| !c.is_whitespace() && !matches!(c, '(' | ')' | '[' | ']' | ':' | '=' | '"'))
        .collect();
    let small = small.trim_end_matches(['.', ',']);
    let is_count = |word: &str| COUNT.contains(&word);
    let unit = |text: &str| known(text).filter(|unit| is_unit_of(unit, what) && !is_angle(unit));
    let (before, behind) = small.split_once('/')?;
    if is_count(before) {
        return Some((unit(behind)?, true));
    }
    let (before, behind) = small.rsplit_once('/')?;
    is_count(behind).then(|| Some((unit(before)?, false)))?
}

/// The unit with as many digits as mean something.
fn short(unit: &str) -> String {
    let end = unit
        .find(|c: char| !(c.is_ascii_digit() || c == '.'))
        .unwrap_or(unit.len());
    let number: f64 = unit[..end].parse().unwrap_or(f64::NAN);
    format!(
        "{} {}",
        crate::report::plot::number(number, 4),
        &unit[end..]
    )
}

/// The columns all of whose first cells are whole numbers.
fn whole_columns(
    layout: &Layout,
    text: &mut TextLines<impl BufRead>,
) -> Result<Vec<bool>, CaptureError> {
    let cells = Cells::new(layout.cells.separator());
    let mut whole = vec![true; layout.names.len()];
    let mut look = |line: &str| {
        for (whole, cell) in whole.iter_mut().zip(cells.cut(line)) {
            let digits = cell.strip_prefix(['-', '+']).unwrap_or(&cell);
            *whole &= cell.is_empty() || digits.bytes().all(|b| b.is_ascii_digit());
        }
    };
    if let Some((_, line)) = &layout.first {
        look(line);
    }
    let mut seen = Vec::new();
    while seen.len() < ROWS
        && let Some((number, line)) = text.next_line()?
    {
        if !line.starts_with(['#', '%', '/']) {
            look(&line);
        }
        seen.push((number, line));
    }
    text.put_back(seen.into_iter());
    Ok(whole)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_count_is_read_in_the_words_of_many_and_a_range_is_none() {
        for (text, gyro, acc) in [
            ("# Gyro scale: 131 LSB/(deg/s)", Some(1.0 / 131.0), None),
            ("gyro sensitivity 16.4 LSB/dps", Some(1.0 / 16.4), None),
            (
                "Gyro sensitivity = 65.5 counts per deg/s",
                Some(1.0 / 65.5),
                None,
            ),
            ("Gyroscope scale [LSB/dps]: 32.8", Some(1.0 / 32.8), None),
            ("% gyr: 8.75 mdps/digit", Some(8.75e-3), None),
            (
                "Gyro LSB: 1.0642e-3 rad/s/LSB",
                Some(1.0642e-3f64.to_degrees()),
                None,
            ),
            ("# accel scale: 16384 LSB/g", None, Some(9.80665 / 16384.0)),
            ("acc 0.061 mg/LSB", None, Some(0.061e-3 * 9.80665)),
            ("accel: 0.000598 m/s^2 per LSB", None, Some(0.000598)),
            (
                "# Gyro: 131 LSB/dps; Accel: 16384 LSB/g",
                Some(1.0 / 131.0),
                Some(9.80665 / 16384.0),
            ),
            ("Gyro range: 250 dps", None, None),
            ("accel range +-2 g", None, None),
            ("Gyro scale: 131", None, None),
            ("gyro 131 LSB/dps or 65.5 LSB/dps", None, None),
            ("Gyro and accel scale: 131 LSB/dps", None, None),
            ("Accel scale: 131 LSB/dps", None, None),
            ("Gyro scale: 0 LSB/dps", None, None),
            ("gyro filter 5 Hz", None, None),
        ] {
            let found = scales(1, text);
            for (quantity, expected) in [(Quantity::Gyro, gyro), (Quantity::Acc, acc)] {
                let of = found.iter().find(|s| s.quantity == quantity);
                let size = of.map(|s| {
                    let what = What::Channel(quantity);
                    super::super::units::convert(what, Some(&s.unit))
                        .expect(text)
                        .scale
                });
                let is_it = match (size, expected) {
                    (Some(size), Some(expected)) => (size / expected - 1.0).abs() < 1e-9,
                    (size, expected) => size == expected,
                };
                assert!(is_it, "{text}: {found:?}");
            }
        }
    }
}
