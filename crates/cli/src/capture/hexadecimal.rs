//! Counts in hexadecimal, as a sketch prints registers: `0xFF6F`, `FF6F`, `FFFFFF6F`, `0FF6h`. Their columns are made decimal on
//! the way.

use std::cell::RefCell;
use std::cmp::Ordering;
use std::io::{BufRead, Cursor, Read, Result};
use std::rc::Rc;

use super::CaptureError;
use super::cells::{Cells, is_missing};
use super::error::{brief, brief_list};
use super::made::{Made, decoded};
use super::propose::inertial;
use super::time::is_date;

/// Bytes in which such columns are looked for.
const HEAD: u64 = 1 << 15;
/// Rows that show them.
const SHOWN: usize = 3;
/// What separates cells, in the order in which it is looked for.
const SEPARATORS: [char; 4] = [';', '\t', ',', ' '];
/// Digits of the longest count.
const LONGEST: usize = 8;
/// Digits of a byte, which is half a reading.
const OF_BYTE: usize = 2;
/// Digits beside which others of the same number, with a zero before them, are the same.
const OF_WORD: usize = 4;

/// A cell that may be hexadecimal.
#[derive(Clone, Copy)]
struct Hex<'a> {
    is_negative: bool,
    digits: &'a str,
    /// By `0x` or `h`.
    is_marked: bool,
}

impl<'a> Hex<'a> {
    fn of(cell: &'a str) -> Option<Self> {
        let unsigned = cell.strip_prefix(['-', '+']).unwrap_or(cell);
        let marked = (unsigned.strip_prefix("0x"))
            .or_else(|| unsigned.strip_prefix("0X"))
            .or_else(|| unsigned.strip_suffix(['h', 'H']));
        let digits = marked.unwrap_or(unsigned);
        let is_it = (1..=LONGEST).contains(&digits.len())
            && digits.bytes().all(|b| b.is_ascii_hexdigit())
            && (marked.is_some() || unsigned.len() == cell.len());
        is_it.then(|| Self {
            is_negative: cell.starts_with('-'),
            digits,
            is_marked: marked.is_some(),
        })
    }

    fn value(self) -> i64 {
        i64::from_str_radix(self.digits, 16).unwrap_or(0)
    }

    /// The value, where the digits are all of a number in two's complement.
    fn complement(self) -> i64 {
        let turn = 1i64 << (4 * self.digits.len());
        self.value() - if 2 * self.value() >= turn { turn } else { 0 }
    }

    /// A letter that no decimal number has, in an exponent neither.
    fn has_letter(self) -> bool {
        self.digits
            .contains(|c: char| c.is_ascii_alphabetic() && !c.eq_ignore_ascii_case(&'e'))
    }
}

/// How a column is read.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Reading {
    /// As it is.
    Decimal,
    /// A count without a sign: one that rises, or lies about the middle of what its digits hold.
    Unsigned,
    /// Two's complement of so many digits; where they are fewer, of what has no sign.
    Signed(usize),
}

/// Cells of a column in the first rows.
struct Column<'a>(Vec<Hex<'a>>);

impl Column<'_> {
    /// Digits of all of its cells, where they have the same number.
    fn width(&self) -> Option<usize> {
        let first = self.0.first()?.digits.len();
        let is_one = self.0.iter().all(|hex| hex.digits.len() == first);
        is_one.then_some(first)
    }

    fn is_marked(&self) -> bool {
        self.0.iter().all(|hex| hex.is_marked)
    }

    /// Whether it is in hexadecimal by its own cells.
    fn is_hexadecimal(&self) -> bool {
        let with_letter = self.0.iter().filter(|hex| hex.has_letter()).count();
        let is_digit = |hex: &Hex<'_>| hex.digits.contains(|c: char| c.is_ascii_digit());
        let varies = (self.0.windows(2)).any(|pair| pair[0].digits != pair[1].digits);
        let is_bare = self.0.iter().all(|hex| !hex.is_marked);
        self.is_marked() || is_bare && varies && with_letter > 1 && self.0.iter().any(is_digit)
    }

    /// Whether it is all of bytes, whose words nobody knows.
    fn is_of_bytes(&self) -> bool {
        let is_byte = |hex: &Hex<'_>| hex.digits.len() <= OF_BYTE && !hex.is_negative;
        self.0.iter().all(is_byte)
    }

    /// Whether it goes on as a counter does.
    fn rises(&self) -> bool {
        let steps = || {
            self.0
                .windows(2)
                .map(|pair| pair[1].value() - pair[0].value())
        };
        let rises = steps().filter(|step| *step >= 0).count();
        self.0.len() > SHOWN && 10 * rises > 9 * (self.0.len() - 1) && steps().any(|step| step > 0)
    }

    /// How it is read; the others of the file say whether it has a sign where it does not by itself.
    fn reading(&self, others: Option<bool>) -> Reading {
        match self.own_reading() {
            (reading, true) => reading,
            (Reading::Signed(width), false) => {
                let turn = 1i64 << (4 * width);
                // Nearer to the middle of what its digits hold than to either end.
                let is_middle = |hex: &Hex<'_>| (hex.value() - turn / 2).abs() < turn / 4;
                let has_sign = others.unwrap_or(!self.0.iter().all(is_middle));
                if has_sign {
                    Reading::Signed(width)
                } else {
                    Reading::Unsigned
                }
            }
            (reading, false) => reading,
        }
    }

    /// Whether it has a sign, where it tells by itself: it goes on through zero, or through the middle of what its digits hold.
    fn has_sign(&self) -> Option<bool> {
        let (reading, _) = self.own_reading();
        let halves = self
            .0
            .iter()
            .map(|hex| (2 * hex.value()) >> (4 * hex.digits.len()));
        let mut halves = halves.map(|half| half > 0);
        let first = halves.next();
        let is_in_both = halves.any(|half| Some(half) != first);
        (is_in_both && !self.rises()).then_some(matches!(reading, Reading::Signed(_)))
    }

    /// How it is read by itself, and whether it tells: what lies in the upper half throughout may be either.
    fn own_reading(&self) -> (Reading, bool) {
        if self.rises() {
            return (Reading::Unsigned, true);
        }
        let most = self.0.iter().map(|hex| hex.digits.len()).max();
        let width = match (self.width(), most.unwrap_or(0)) {
            (Some(..=OF_BYTE), _) => return (Reading::Unsigned, true),
            (Some(width), _) => width,
            // `Serial.print(x, HEX)` writes 69 and FFFFFF6F, `%x` of an unsigned 69 and ff6f.
            (None, ..=OF_WORD) => OF_WORD,
            (None, 6) => 6,
            (None, _) => LONGEST,
        };
        let signed = Reading::Signed(width);
        let span = |reading: Reading| {
            let all = || self.0.iter().filter_map(|hex| value(*hex, reading));
            all().max().unwrap_or(0) - all().min().unwrap_or(0)
        };
        let is_upper = |hex: &Hex<'_>| value(*hex, signed).is_some_and(|v| v < 0);
        let all_upper = self.0.iter().all(is_upper);
        match span(Reading::Unsigned).cmp(&span(signed)) {
            Ordering::Less => (Reading::Unsigned, true),
            Ordering::Equal => (signed, !all_upper),
            Ordering::Greater => (signed, true),
        }
    }
}

/// The count in a cell; nothing where its digits fit no number of the column.
fn value(hex: Hex<'_>, reading: Reading) -> Option<i64> {
    match reading {
        Reading::Decimal => None,
        _ if hex.is_negative => Some(-hex.value()),
        Reading::Unsigned => Some(hex.value()),
        Reading::Signed(width) if hex.digits.len() == width => Some(hex.complement()),
        // A negative one may come later than in the first rows.
        Reading::Signed(_) if hex.digits.len() == LONGEST => Some(hex.complement()),
        Reading::Signed(width) => (hex.digits.len() < width).then(|| hex.value()),
    }
}

/// What was found of it.
#[derive(Debug, Default)]
pub(super) struct Hexadecimal {
    /// Names of the columns.
    columns: Vec<String>,
    /// A cell that shows how they are read.
    shown: Option<(String, i64, usize)>,
    /// Bytes of a reading, each in a cell.
    bytes: bool,
}

impl Hexadecimal {
    /// What to tell of it.
    pub fn notes(&self) -> Option<String> {
        if self.columns.is_empty() {
            return None;
        }
        let shown = self.shown.as_ref().map(|(cell, value, width)| {
            let bits = 4 * width;
            format!(": `{cell}` is {value}, by two's complement of {bits} bits")
        });
        Some(format!(
            "cells are hexadecimal in {}{}",
            brief_list(&self.columns).join(", "),
            shown.unwrap_or_default()
        ))
    }

    /// An error that asks for columns or units, with what is known of such cells.
    pub fn mention(&self, error: CaptureError) -> CaptureError {
        let said = match self.notes() {
            Some(note) => note,
            None if self.bytes => "the cells look like single bytes in hexadecimal: put those of a reading together first, \
                                   `FF 6F` to `FF6F`"
                .to_owned(),
            None => return error,
        };
        match error {
            CaptureError::Option { option, why, help } => CaptureError::Option {
                option,
                why,
                help: format!("{help}; {said}"),
            },
            CaptureError::MissingKey { column, .. } => CaptureError::Option {
                option: "--units",
                why: format!("nothing says the unit of {column}"),
                help: format!("say what a count is, `gyro=0.0076deg/s`, `acc=0.000061g`; {said}"),
            },
            error => error.hinting(&said),
        }
    }
}

/// A text, and what is known of its hexadecimal cells.
type Text<'a> = (Box<dyn BufRead + 'a>, Option<Rc<RefCell<Hexadecimal>>>);

/// The text with the cells of its hexadecimal columns in decimal; as it is where it has none.
///
/// # Errors
/// The stream's.
pub(super) fn decimal<'a>(mut input: impl BufRead + 'a) -> Result<Text<'a>> {
    let mut head = Vec::new();
    input.by_ref().take(HEAD).read_to_end(&mut head)?;
    let found = of_head(&decoded(&head), (head.len() as u64) < HEAD);
    let input = Cursor::new(head).chain(input);
    let Some((separator, readings, hexadecimal)) = found else {
        return Ok((Box::new(input), None));
    };
    let told = Rc::new(RefCell::new(hexadecimal));
    let found = Rc::clone(&told);
    let cells = Cells::new(separator);
    let between = separator.to_string();
    let make = move |line: &str, made: &mut String| {
        let mut row = cells.cut(line);
        if row.len() < readings.len() || line.starts_with(['#', '%', '/']) {
            made.push_str(line);
            return;
        }
        for (cell, reading) in row.iter_mut().zip(&readings) {
            let Some(hex) = Hex::of(cell).filter(|_| *reading != Reading::Decimal) else {
                continue;
            };
            let Some(value) = value(hex, *reading) else {
                continue;
            };
            if let (true, Reading::Signed(_)) = (value < 0 && !hex.is_negative, reading) {
                let mut found = found.borrow_mut();
                let shown = || (brief(cell), value, hex.digits.len());
                found.shown.get_or_insert_with(shown);
            }
            *cell = value.to_string().into();
        }
        made.push_str(&row.join(&between));
    };
    Ok((Box::new(Made::new(input, make)), Some(told)))
}

/// What separates the cells, how each column is read, and what is known of it; nothing where no column is hexadecimal.
fn of_head(text: &str, is_whole: bool) -> Option<(char, Vec<Reading>, Hexadecimal)> {
    let mut lines: Vec<&str> = text.lines().map(str::trim).collect();
    if !is_whole {
        // The last one goes on.
        lines.pop();
    }
    lines.retain(|line| !line.is_empty() && !line.starts_with(['#', '%']) && !line.contains('"'));
    let last = lines.last()?;
    let separator = SEPARATORS.into_iter().find(|s| last.contains(*s))?;
    let cells = Cells::new(separator);
    let width = cells.cut(last).len();
    let mut all: Vec<Vec<_>> = lines.iter().map(|line| cells.cut(line)).collect();
    all.retain(|row| row.len() == width);
    let may_be_row = |row: &Vec<std::borrow::Cow<'_, str>>| {
        let mut number = Cells::new(separator);
        row.iter().all(|cell| {
            is_missing(cell)
                || Hex::of(cell).is_some()
                || number.number(cell).is_some()
                || is_date(cell)
        })
    };
    let names = all.first().filter(|row| !may_be_row(row));
    let has_names = names.is_some();
    let names: Vec<String> = match names {
        Some(names) => names.iter().map(ToString::to_string).collect(),
        None => (1..=width).map(|k| format!("column_{k}")).collect(),
    };
    // The first may be of names, `a`, `b`, `c`, all the same.
    let rows: Vec<_> = all.iter().skip(1).filter(|row| may_be_row(row)).collect();
    if rows.len() < SHOWN {
        return None;
    }
    let columns: Vec<Option<Column<'_>>> = (0..width)
        .map(|at| {
            let own = rows.iter().map(|row| row[at].as_ref());
            let own: Option<Vec<Hex<'_>>> =
                own.filter(|cell| !is_missing(cell)).map(Hex::of).collect();
            own.filter(|own| !own.is_empty()).map(Column)
        })
        .collect();
    let by_itself: Vec<bool> = (columns.iter())
        .map(|of| of.as_ref().is_some_and(Column::is_hexadecimal))
        .collect();
    if !by_itself.contains(&true) {
        return None;
    }
    let all_bytes = columns.iter().zip(&by_itself).filter(|(_, is)| **is);
    if all_bytes
        .filter_map(|(c, _)| c.as_ref())
        .all(Column::is_of_bytes)
    {
        let bytes = Hexadecimal {
            bytes: true,
            ..Hexadecimal::default()
        };
        return Some((separator, vec![Reading::Decimal; width], bytes));
    }
    let kinds = inertial(&names);
    let is_hexadecimal = |at: usize| {
        let Some(column) = &columns[at] else {
            return false;
        };
        let is_word = |of: &Column<'_>| {
            of.width() == column.width() && of.width().is_some_and(|width| width >= OF_WORD)
        };
        let has_zero = || column.0.iter().any(|hex| hex.digits.starts_with('0'));
        let others = || (0..width).filter(|other| by_itself[*other]);
        // One that has no letter so far.
        by_itself[at]
            || kinds[at].is_some() && others().any(|other| kinds[other].is_some())
            || has_zero() && others().any(|other| columns[other].as_ref().is_some_and(is_word))
            || !has_names && !column.rises()
    };
    // What goes on through zero or through the middle tells it of all: one part writes one kind of number.
    let told = (0..width).filter(|at| is_hexadecimal(*at));
    let told: Vec<bool> = told
        .filter_map(|at| columns[at].as_ref()?.has_sign())
        .collect();
    let told = told
        .first()
        .copied()
        .filter(|first| told.iter().all(|other| other == first));
    let readings: Vec<Reading> = (0..width)
        .map(|at| match &columns[at] {
            Some(column) if is_hexadecimal(at) => column.reading(told),
            _ => Reading::Decimal,
        })
        .collect();
    let named = names.into_iter().zip(&readings);
    let named = named.filter(|(_, reading)| **reading != Reading::Decimal);
    let found = Hexadecimal {
        columns: named.map(|(name, _)| name).collect(),
        ..Hexadecimal::default()
    };
    Some((separator, readings, found))
}
