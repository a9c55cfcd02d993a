//! Rows cut into cells, and cells read as numbers.

use std::borrow::Cow;

use super::infinite::is_infinite;
use super::time::{is_date, with_unit};

/// The minus of typography, U+2212.
const MINUS: char = '\u{2212}';
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

/// Whether a cell says that there is no reading: nothing, or what tables write for it.
pub(super) fn is_missing(cell: &str) -> bool {
    // The last three are NaN as Microsoft's library wrote it.
    const WORDS: [&str; 13] = [
        "nan",
        "-nan",
        "nan(ind)",
        "-nan(ind)",
        "na",
        "n/a",
        "#n/a",
        "<na>",
        "null",
        "none",
        "1.#qnan",
        "1.#ind",
        "-1.#ind",
    ];
    cell.is_empty() || WORDS.iter().any(|word| cell.eq_ignore_ascii_case(word))
}

/// Cuts lines into cells, and reads numbers.
pub(super) struct Cells {
    separator: char,
    /// The sign before the fraction; a file has one.
    decimal: Option<char>,
    /// Whether its numbers are known to be in groups.
    is_grouped: bool,
    /// The first of them, and what is read of it.
    pub grouped: Option<String>,
}

/// What stands between groups of three digits.
const MARKS: [char; 7] = ['.', ',', '\'', '\u{2019}', '\u{a0}', '\u{202f}', ' '];

/// What separates the groups of a number, the number to its fraction, and the fraction with its sign; nothing where it is not in
/// groups: one to three digits, no zero before others, and then three each.
fn parts(cell: &str) -> Option<(char, &str, Option<&str>)> {
    let mark = cell.chars().find(|c| MARKS.contains(c))?;
    let behind = cell.rfind(mark)? + mark.len_utf8();
    let fraction = cell[behind..].find(['.', ',']).map(|at| behind + at);
    let whole = &cell[..fraction.unwrap_or(cell.len())];
    let fraction = fraction.map(|at| &cell[at..]);
    let is_fraction = |f: &str| f.len() > 1 && f[1..].bytes().all(|b| b.is_ascii_digit());
    (in_groups(whole, mark) && fraction.is_none_or(is_fraction)).then_some((mark, whole, fraction))
}

/// Whether a whole number is in groups.
fn in_groups(whole: &str, mark: char) -> bool {
    let mut groups = whole.trim_start_matches(['-', '+']).split(mark);
    let are_digits = |group: &str| group.bytes().all(|b| b.is_ascii_digit());
    let is_first = |g: &str| (1..=3).contains(&g.len()) && !g.starts_with('0') && are_digits(g);
    let first = groups.next().is_some_and(is_first);
    let mut count = 0;
    let all = groups.all(|group| {
        count += 1;
        group.len() == 3 && are_digits(group)
    });
    first && all && count > 0
}

impl Cells {
    pub fn new(separator: char) -> Self {
        Self {
            separator,
            decimal: None,
            is_grouped: false,
            grouped: None,
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

    /// A number, with a point or, where it separates no cells, a comma before the fraction, and in groups of three digits where
    /// they can be nothing else. A typographic minus, as spreadsheets and word processors put it, is a minus.
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
        let sign = cell.bytes().find(|b| matches!(b, b'.' | b','));
        let sign = sign.map(char::from);
        let is_of_file = sign.is_none() || self.decimal.is_none() || sign == self.decimal;
        let plain = match sign {
            _ if !is_of_file => None,
            // Between commas such a cell stands in quotes, and three digits behind its comma may be either.
            Some(',')
                if self.separator == ',' && self.decimal.is_none() && in_groups(cell, ',') =>
            {
                None
            }
            Some(',') => cell.replacen(',', ".", 1).parse::<f64>().ok(),
            _ => cell.parse().ok(),
        };
        if plain.is_none() {
            return self.grouped_number(cell);
        }
        self.decimal = self.decimal.or(sign);
        plain.filter(|number| number.is_finite())
    }

    /// A number whose whole part is in groups of three digits, where it can be read in no other way: it has a fraction by another
    /// sign, or two groups behind the first, or the file's fractions have another sign.
    fn grouped_number(&mut self, cell: &str) -> Option<f64> {
        if !cell.ends_with(|c: char| c.is_ascii_digit()) {
            return None;
        }
        let (mark, whole, fraction) = parts(cell)?;
        let fraction_sign = fraction.and_then(|f| f.chars().next());
        let is_sure = match (mark, fraction_sign) {
            // No fraction begins so.
            (mark, sign) if !matches!(mark, '.' | ',') => {
                sign.is_none() || self.decimal.is_none() || sign == self.decimal
            }
            (_, Some(sign)) => self.decimal.is_none_or(|of_file| of_file == sign),
            (mark, None) if whole.matches(mark).count() > 1 => self.decimal != Some(mark),
            // A file of commas puts such a cell in quotes; in another one the numbers have to show their groups first.
            (mark, None) => {
                let is_other = self.decimal.is_some_and(|of_file| of_file != mark);
                is_other && (self.separator == ',' || self.is_grouped)
            }
        };
        if !is_sure {
            return None;
        }
        let digits: String = whole.chars().filter(|c| *c != mark).collect();
        let fraction = fraction.unwrap_or_default().replace(',', ".");
        let number: f64 = format!("{digits}{fraction}").parse().ok()?;
        self.is_grouped = true;
        self.decimal = self.decimal.or(fraction_sign).or(match mark {
            '.' => Some(','),
            ',' => Some('.'),
            _ => None,
        });
        let shown = || format!("`{cell}` is {number}");
        self.grouped.get_or_insert_with(shown);
        Some(number)
    }

    /// Why a cell of digits, points and commas is no number here.
    pub fn why_not(&self, cell: &str) -> Option<&'static str> {
        let bare = cell.strip_prefix(['-', '+', MINUS]).unwrap_or(cell);
        let has = |sign| bare.contains(sign);
        let is_of_digits = bare
            .chars()
            .all(|c| c.is_ascii_digit() || matches!(c, '.' | ','))
            && bare.starts_with(|c: char| c.is_ascii_digit());
        let is_one = bare.matches(['.', ',']).count() == 1 || parts(bare).is_some();
        match self.decimal {
            _ if !is_of_digits || !is_one => None,
            None if has(',') => Some("its comma may stand before a fraction or between thousands"),
            Some('.') if has(',') => {
                Some("it has a comma, and numbers before it have a point before their fraction")
            }
            Some(',') if has('.') => {
                Some("it has a point, and numbers before it have a comma before their fraction")
            }
            _ => None,
        }
    }

    /// Whether a line is a row and no header: more than half of what is in it are numbers or dates.
    pub fn is_row(&self, line: &str) -> bool {
        let cells = self.cut(line);
        let mut reader = Self::new(self.separator);
        let (mut numbers, mut all) = (0, 0);
        for cell in cells.iter().filter(|cell| !is_missing(cell)) {
            all += 1;
            let is_number = reader.number(cell).is_some()
                || reader.why_not(cell).is_some()
                || is_infinite(cell);
            numbers += usize::from(is_number || is_date(cell) || with_unit(cell).is_some());
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

    #[test]
    fn groups_of_three_digits_are_read_where_they_can_be_nothing_else() {
        for (separator, cells, numbers) in [
            (
                ',',
                &["2,299.33", "-1,024", "12.5"][..],
                &[Some(2299.33), Some(-1024.0), Some(12.5)][..],
            ),
            (
                ';',
                &["2.299,33", "1.024", "0,5"],
                &[Some(2299.33), Some(1024.0), Some(0.5)],
            ),
            (
                ';',
                &["1,234,567", "1,024"],
                &[Some(1_234_567.0), Some(1024.0)],
            ),
            (
                ';',
                &["2'299.33", "2\u{202f}299.5", "1 024"],
                &[Some(2299.33), Some(2299.5), Some(1024.0)],
            ),
            // A decimal comma, in quotes too.
            (
                ',',
                &["0,024", "1,024", "-12,5"],
                &[Some(0.024), Some(1.024), Some(-12.5)],
            ),
            (';', &["1,024", "2,5"], &[Some(1.024), Some(2.5)]),
            // Nobody knows; and what is no group is none.
            (',', &["1,024"], &[None]),
            (';', &["0.5", "1,024", "1,5"], &[Some(0.5), None, None]),
            (
                ';',
                &["0.5", "12,34.5", "1234,567.5", "1,2,3", "0,123.5", "1,234."],
                &[Some(0.5), None, None, None, None, None],
            ),
        ] {
            let mut reader = Cells::new(separator);
            let read: Vec<Option<f64>> = cells.iter().map(|cell| reader.number(cell)).collect();
            assert_eq!(read, numbers, "{cells:?}");
        }
        assert!(Cells::new(',').is_row("0,\"1,024\",\"2,048\""));
    }
}
