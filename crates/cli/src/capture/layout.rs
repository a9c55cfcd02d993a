//! How a text is laid out: what separates its cells, where its header is, and what that says. This is the one place that
//! recognizes it.

use std::borrow::Cow;
use std::io::BufRead;

use super::CaptureError;
use super::header::Lines;
use super::stream::TextLines;
use super::time::is_date;
use super::units::{in_brackets, known};

/// The minus of typography, U+2212.
const MINUS: char = '\u{2212}';
/// What separates cells, in the order in which it is looked for; the last stands for any blanks.
const SEPARATORS: [char; 4] = [';', '\t', ',', ' '];

/// A text up to its first row.
pub(super) struct Layout {
    /// The `# key: value` lines.
    pub lines: Lines,
    /// Names of the columns.
    pub names: Vec<String>,
    /// Whether the names are made up, because the file has none.
    pub numbered: bool,
    /// Units of the columns, where brackets or a row of units say them.
    pub units: Vec<Option<String>>,
    /// How rows are cut into cells.
    pub cells: Cells,
    /// The first row, with its line; it is read already.
    pub first: Option<(u64, String)>,
    /// First and last line before the table that are none of it.
    pub preamble: Option<(u64, u64)>,
}

impl Layout {
    /// Reads as far as the first row.
    pub fn read(text: &mut TextLines<impl BufRead>) -> Result<Self, CaptureError> {
        let mut lines = Lines::default();
        let mut separator = None;
        let mut comment = String::new();
        let (number, line) = loop {
            let Some((number, line)) = text.next_line()? else {
                return Err(CaptureError::Empty);
            };
            if let Some(said) = line.strip_prefix(['#', '%']) {
                let said = said.trim_start_matches(['#', '%']).trim();
                if !lines.take(number as usize, said) && !said.is_empty() {
                    comment = said.to_owned();
                }
                text.is_no_row(&line)?;
            } else if let Some(said) = line.strip_prefix("sep=") {
                // A spreadsheet's own line.
                separator = said.chars().next();
            } else if !line.trim().is_empty() {
                break (number, line);
            } else {
                text.is_no_row(&line)?;
            }
        };
        let begin = number;
        let (number, line) = behind_preamble(text, (number, line), separator)?;
        let preamble = (number > begin).then(|| (begin, number - 1));
        let found = SEPARATORS.into_iter().find(|s| line.contains(*s));
        let mut cells = Cells::new(separator.or(found).unwrap_or(','));
        if cells.is_row(&line) {
            let width = cells.cut(&line).len();
            // A header may stand in the last comment.
            let named = cells.cut(&comment);
            let is_header = named.len() == width && !cells.is_row(&comment);
            let (names, numbered) = match width {
                _ if is_header && width > 1 => (owned(&named), false),
                1 => (vec!["values".to_owned()], true),
                _ => ((1..=width).map(|k| format!("column_{k}")).collect(), true),
            };
            return Ok(Self::new(
                lines,
                names,
                numbered,
                cells,
                Some((number, line)),
            ));
        }
        let first = next_row(text)?;
        let row = first.as_ref().map_or("", |(_, row)| row.as_str());
        let (of_names, of_rows) = separators(&line, row, separator);
        let names = owned(&Cells::new(of_names).cut(&line));
        cells = Cells::new(of_rows);
        let mut layout = Self::new(lines, names, false, cells, first);
        layout.preamble = preamble;
        layout.take_units(text)?;
        Ok(layout)
    }

    fn new(
        lines: Lines,
        names: Vec<String>,
        numbered: bool,
        cells: Cells,
        first: Option<(u64, String)>,
    ) -> Self {
        let unit = |name: &String| {
            let stated = lines.unit_of(name).or(in_brackets(name).1);
            stated.map(str::to_owned)
        };
        Self {
            units: names.iter().map(unit).collect(),
            lines,
            names,
            numbered,
            cells,
            first,
            preamble: None,
        }
    }

    /// A row of units under the names.
    fn take_units(&mut self, text: &mut TextLines<impl BufRead>) -> Result<(), CaptureError> {
        let Some((_, line)) = &self.first else {
            return Ok(());
        };
        let units = owned(&self.cells.cut(line));
        let bare = |unit: &str| bare_unit(unit).map(str::to_owned);
        let are_units = units.len() == self.names.len()
            && units
                .iter()
                .all(|unit| Cells::new(';').number(unit).is_none())
            && units.iter().any(|unit| bare(unit).is_some());
        if are_units {
            for (said, unit) in self.units.iter_mut().zip(&units) {
                *said = bare(unit).or(said.take());
            }
            self.first = next_row(text)?;
        }
        Ok(())
    }
}

/// A unit in brackets or without.
fn bare_unit(text: &str) -> Option<&'static str> {
    known(text.trim_matches(['(', ')', '[', ']']))
}

/// Lines before a table in which its names are looked for.
const PREAMBLE: usize = 60;

/// The line of names, where other lines stand before it: the first that has as many cells, two at least, as a row of
/// numbers, or of units and then of numbers, below it. The line given where there is none.
fn behind_preamble(
    text: &mut TextLines<impl BufRead>,
    first: (u64, String),
    said: Option<char>,
) -> Result<(u64, String), CaptureError> {
    let begins = |names: &str, row: &str| {
        let (of_names, of_rows) = separators(names, row, said);
        let (names_cut, row_cut) = (Cells::new(of_names), Cells::new(of_rows));
        let width = row_cut.cut(row).len();
        width > 1
            && names_cut.cut(names).len() == width
            && !names_cut.is_row(names)
            && row_cut.is_row(row)
    };
    let mut seen = vec![first];
    while seen.len() < PREAMBLE + 2 {
        let Some(line) = next_row(text)? else { break };
        seen.push(line);
        // As most files are.
        if let [(_, names), (_, row)] = &seen[..]
            && begins(names, row)
        {
            break;
        }
    }
    let line = |k: usize| seen.get(k).map_or("", |(_, line)| line.as_str());
    let are_units = |line: &str| {
        let separator = SEPARATORS.into_iter().find(|s| line.contains(*s));
        let cells = owned(&Cells::new(said.or(separator).unwrap_or(',')).cut(line));
        cells.iter().any(|cell| bare_unit(cell).is_some())
    };
    let is_table = |k: &usize| {
        begins(line(*k), line(k + 1)) || (are_units(line(k + 1)) && begins(line(*k), line(k + 2)))
    };
    let separator = SEPARATORS.into_iter().find(|s| line(0).contains(*s));
    let at = if Cells::new(said.or(separator).unwrap_or(',')).is_row(line(0)) {
        0
    } else {
        (0..seen.len()).find(is_table).unwrap_or(0)
    };
    let mut rest = seen.split_off(at).into_iter();
    let names = rest.next();
    text.put_back(rest);
    names.ok_or(CaptureError::Empty)
}

/// What separates names, and what separates the cells of rows: the first pair by which both have one width.
fn separators(names: &str, row: &str, said: Option<char>) -> (char, char) {
    let width = |line: &str, separator| Cells::new(separator).cut(line).len();
    let fits = |of_names, of_rows| {
        let columns = width(names, of_names);
        columns > 1 && columns == width(row, of_rows)
    };
    let mut pairs = SEPARATORS
        .into_iter()
        .flat_map(|a| [a].into_iter().chain(SEPARATORS).map(move |b| (a, b)));
    let fallback = SEPARATORS[..3].iter().find(|s| names.contains(**s));
    said.map(|s| (s, s))
        .or_else(|| pairs.find(|(a, b)| fits(*a, *b)))
        .unwrap_or_else(|| fallback.map_or((',', ','), |s| (*s, *s)))
}

/// The next line that is neither empty nor a comment.
pub(super) fn next_row(
    text: &mut TextLines<impl BufRead>,
) -> Result<Option<(u64, String)>, CaptureError> {
    let mut line = String::new();
    let number = next_row_into(text, &mut line)?;
    Ok(number.map(|number| (number, line)))
}

/// The same into a `line` that was used before, its number returned.
pub(super) fn next_row_into(
    text: &mut TextLines<impl BufRead>,
    line: &mut String,
) -> Result<Option<u64>, CaptureError> {
    while let Some(number) = text.next_line_into(line)? {
        if !line.trim().is_empty() && !line.starts_with(['#', '%']) {
            text.is_row();
            return Ok(Some(number));
        }
        text.is_no_row(line)?;
    }
    Ok(None)
}

fn owned(cells: &[Cow<'_, str>]) -> Vec<String> {
    cells.iter().map(|cell| cell.to_string()).collect()
}

/// Cells that a row has at least room for.
const USUAL_WIDTH: usize = 16;

/// A whole number of so few digits that its value is exact on the way: what counts are, without the work that any other number
/// takes. A zero with a sign is left to that.
fn short_whole(cell: &str) -> Option<f64> {
    const DIGITS: usize = 15;
    let (is_negative, digits) = match cell.as_bytes() {
        [b'-', digits @ ..] => (true, digits),
        digits => (false, digits),
    };
    if digits.is_empty() || digits.len() > DIGITS || !digits.iter().all(u8::is_ascii_digit) {
        return None;
    }
    let size = digits
        .iter()
        .fold(0i64, |n, d| 10 * n + i64::from(d - b'0'));
    match (is_negative, size) {
        (true, 0) => None,
        (true, _) => Some(-size as f64),
        (false, _) => Some(size as f64),
    }
}

/// 10^k, which an f64 holds.
const TENS: [f64; 16] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15,
];

/// The number that a text begins with, its length, and whether it has a point. Of so few digits whole number and power of ten
/// are exact, and their ratio is rounded once: the nearest number, as it is read in any other way.
fn short_decimal(text: &[u8]) -> Option<(f64, usize, bool)> {
    const DIGITS: usize = 15;
    let from = usize::from(text.first() == Some(&b'-'));
    let (mut whole, mut point) = (0i64, None);
    let mut at = from;
    while let Some(byte) = text.get(at) {
        match byte {
            // Too many digits for an i64 are too many for what follows.
            b'0'..=b'9' => whole = whole.wrapping_mul(10).wrapping_add(i64::from(byte - b'0')),
            b'.' if point.is_none() => point = Some(at),
            _ => break,
        }
        at += 1;
    }
    let digits = at - from - usize::from(point.is_some());
    if digits == 0 || digits > DIGITS {
        return None;
    }
    let size = whole as f64;
    let size = point.map_or(size, |point| size / TENS[at - point - 1]);
    let number = if from == 1 { -size } else { size };
    Some((number, at, point.is_some()))
}

/// Cuts lines into cells, and reads numbers.
pub(super) struct Cells {
    separator: char,
    /// The sign before the fraction; a file has one.
    decimal: Option<char>,
}

impl Cells {
    pub fn new(separator: char) -> Self {
        Self {
            separator,
            decimal: None,
        }
    }

    /// What stands between cells.
    pub fn separator(&self) -> char {
        self.separator
    }

    /// The cells of a line.
    pub fn cut<'a>(&self, line: &'a str) -> Vec<Cow<'a, str>> {
        if line.contains('"') {
            let mut csv = csv::ReaderBuilder::new()
                .has_headers(false)
                .flexible(true)
                .delimiter(u8::try_from(self.separator).unwrap_or(b','))
                .trim(csv::Trim::All)
                .from_reader(line.as_bytes());
            if let Some(Ok(record)) = csv.records().next() {
                return record.iter().map(|cell| cell.to_owned().into()).collect();
            }
        }
        if self.separator == ' ' {
            return line.split_whitespace().map(Cow::from).collect();
        }
        let mut cells = Vec::with_capacity(USUAL_WIDTH);
        match u8::try_from(self.separator) {
            // A byte of ASCII is no part of another character. `str::split` takes 1.5 to 1.9 times as long over the short
            // cells of a capture, and the reading of its rows 1.3 to 1.8 times.
            Ok(separator) if separator.is_ascii() => {
                let mut from = 0;
                for (at, byte) in line.bytes().enumerate() {
                    if byte == separator {
                        cells.push(line[from..at].trim().into());
                        from = at + 1;
                    }
                }
                cells.push(line[from..].trim().into());
            }
            _ => cells.extend(
                line.split(self.separator)
                    .map(|cell| Cow::from(cell.trim())),
            ),
        }
        cells
    }

    /// The numbers of a row as programs write them, in digits, signs and points alone and with no cell empty; nothing where
    /// any cell is something else. The same as by [`Cells::cut`] and [`Cells::number`], in one pass.
    pub fn plain(&self, line: &str, numbers: &mut Vec<f64>) -> Option<()> {
        let separator = u8::try_from(self.separator).ok().filter(u8::is_ascii)?;
        numbers.clear();
        let mut rest = line.as_bytes();
        loop {
            let (number, length, has_point) = short_decimal(rest)?;
            // The sign of the fraction is the file's once a number has shown it.
            if has_point && self.decimal != Some('.') {
                return None;
            }
            numbers.push(number);
            match rest.get(length) {
                None => return Some(()),
                Some(end) if *end == separator => rest = &rest[length + 1..],
                Some(_) => return None,
            }
        }
    }

    /// A number, with a point or, where commas do not separate cells, a comma before the fraction. A typographic minus, as
    /// spreadsheets and word processors put it, is a minus.
    pub fn number(&mut self, cell: &str) -> Option<f64> {
        self.ascii_number(cell).or_else(|| {
            let is_typographic = cell.contains(MINUS);
            is_typographic.then(|| self.ascii_number(&cell.replace(MINUS, "-")))?
        })
    }

    fn ascii_number(&mut self, cell: &str) -> Option<f64> {
        if let Some(count) = short_whole(cell) {
            return Some(count);
        }
        let sign = cell
            .bytes()
            .find(|b| matches!(b, b'.' | b','))
            .map(char::from);
        if sign.is_some() && self.decimal.is_some() && sign != self.decimal {
            return None;
        }
        let number: f64 = if sign == Some(',') && self.separator != ',' {
            cell.replacen(',', ".", 1).parse().ok()?
        } else {
            cell.parse().ok()?
        };
        self.decimal = self.decimal.or(sign);
        number.is_finite().then_some(number)
    }

    /// Whether a line is a row and no header: more than half of what is in it are numbers or dates.
    fn is_row(&self, line: &str) -> bool {
        let cells = self.cut(line);
        let mut reader = Self::new(self.separator);
        let (mut numbers, mut all) = (0, 0);
        for cell in cells.iter().filter(|cell| !cell.is_empty()) {
            all += 1;
            numbers += usize::from(reader.number(cell).is_some() || is_date(cell));
        }
        2 * numbers > all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_short_whole_number_is_what_the_slow_way_reads() {
        let bits = |n: f64| n.to_bits();
        for cell in [
            "0",
            "7",
            "-7",
            "007",
            "-0",
            "+3",
            "65535",
            "-123456789012345",
            "999999999999999",
            "1234567890123456789",
        ] {
            let slow: f64 = cell.parse().unwrap();
            assert_eq!(
                Cells::new(',').number(cell).map(bits),
                Some(bits(slow)),
                "{cell}"
            );
        }
        for cell in ["", "-", "--1", "1-", "0x1", "1 2", "-a", "\u{661}"] {
            assert_eq!(Cells::new(',').number(cell), None, "{cell}");
        }
    }

    #[test]
    fn a_plain_row_is_what_the_slow_way_reads() {
        let row = "0,-0,7,-12,0.018028,-1.5,.5,3.,123456789012345,0.00000000000001,-98765.4321";
        let mut cells = Cells::new(',');
        let cut: Vec<String> = cells.cut(row).iter().map(ToString::to_string).collect();
        let mut numbers = vec![];
        // The point is not yet the file's.
        assert_eq!(cells.plain(row, &mut numbers), None);
        let slow: Vec<u64> = (cut.iter().filter_map(|cell| cells.number(cell)))
            .map(f64::to_bits)
            .collect();
        assert_eq!(cells.plain(row, &mut numbers), Some(()));
        let plain: Vec<u64> = numbers.iter().map(|n| n.to_bits()).collect();
        assert_eq!(plain, slow);
        for row in [
            "",
            "1,",
            ",1",
            "1,,2",
            "1, 2",
            "+1",
            "-",
            ".",
            "1.2.3",
            "1e3",
            "--1",
            "nan",
            "1;2",
            "1234567890123456",
            "99999999999999999999999999999999999999",
            "0.99999999999999999999999999999999999999",
            "\u{661}",
        ] {
            assert_eq!(cells.plain(row, &mut numbers), None, "{row}");
        }
    }

    #[test]
    fn cells_are_cut_at_every_separator_and_trimmed() {
        assert_eq!(
            Cells::new(',').cut(" 1 ,,\u{a0}2\u{a0}, é,"),
            ["1", "", "2", "é", ""]
        );
        assert_eq!(Cells::new(';').cut(""), [""]);
        assert_eq!(Cells::new('§').cut("1§2"), ["1", "2"]);
    }
}
