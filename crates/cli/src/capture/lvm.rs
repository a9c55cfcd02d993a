//! Measurement files of LabVIEW (`.lvm`): a header, then segments, each with a header of its own or without. Made one table on the
//! way: a line of names, and rows with a time where the file has one.
//!
//! # Source
//! National Instruments, Specification for the LabVIEW Measurement File (.lvm), versions 1 and 2.

use std::cell::RefCell;
use std::io::{BufRead, Cursor, Read, Result};
use std::rc::Rc;

use model::record::Quantity;

use super::CaptureError;
use super::error::brief;
use super::layout::Layout;
use super::made::{Made, decoded};
use super::time::Clock;
use super::units::{What, is_angle, is_unit_of, known};

/// How such a file begins.
const BEGINS: &[u8] = b"LabVIEW Measurement";
/// Ends a header.
const END: &str = "***End_of_Header***";
/// What is no part of the data.
const SPECIAL: &str = "***Start_Special***";
const END_OF_SPECIAL: &str = "***End_Special***";
/// The name of the column of times.
const X: &str = "X_Value";
/// The column behind the channels.
const COMMENT: &str = "Comment";
/// Bytes in which the first rows are looked at.
const HEAD: u64 = 1 << 15;
/// `Delta_X` where LabVIEW knows no timing.
const UNTIMED: f64 = 1.0;

/// Where in the file a line is.
#[derive(Clone, Copy, Debug, PartialEq)]
enum At {
    Header,
    /// Between the header and the first segment, or within a segment's header.
    Segment,
    Special,
    Names,
    Rows,
}

/// The file's header, or a segment's.
#[derive(Clone, Debug, Default)]
struct Head(Vec<(String, Vec<String>)>);

impl Head {
    fn take(&mut self, line: &str, separator: char) {
        let mut cells = line.split(separator).map(|cell| cell.trim().to_owned());
        if let Some(key) = cells.next().filter(|key| !key.is_empty()) {
            self.0.push((key, cells.collect()));
        }
    }

    fn of(&self, key: &str) -> &[String] {
        let found = self.0.iter().find(|(own, _)| own == key);
        found.map_or(&[], |(_, values)| values)
    }

    fn first(&self, key: &str) -> Option<&str> {
        self.of(key).first().map(String::as_str)
    }

    /// Values of the channels, empty cells left out.
    fn each(&self, key: &str) -> impl Iterator<Item = &str> {
        let values = self.of(key).iter().map(String::as_str);
        values.filter(|value| !value.is_empty())
    }

    /// A number that all channels have.
    fn number(&self, key: &str) -> Option<f64> {
        let mut all = self
            .each(key)
            .map(|v| v.replacen(',', ".", 1).parse::<f64>());
        let first = all.next()?.ok()?;
        all.all(|other| other == Ok(first)).then_some(first)
    }

    /// Whether channels begin or go on differently.
    fn differs(&self) -> bool {
        ["X0", "Delta_X"].iter().any(|key| {
            let mut all = self.each(key);
            let first = all.next();
            all.any(|other| Some(other) != first)
        })
    }
}

/// What is known of such a file.
#[derive(Debug, Default)]
pub(super) struct Lvm {
    segments: usize,
    comments: usize,
    comment: Option<(u64, String)>,
    /// Units of channels of rates, accelerations and temperatures.
    units: Vec<(String, String)>,
    /// Units of channels that are none of a rate, an acceleration or a temperature.
    others: Vec<String>,
    /// Channels that nobody has named, and what their units say they are.
    named: Vec<(String, String)>,
    /// Whether nothing says when a row was sampled.
    is_untimed: bool,
    /// Whether each channel has times of its own.
    differs: bool,
    is_computed: bool,
}

impl Lvm {
    /// What to tell of it.
    pub fn notes(&self) -> Vec<String> {
        let of = match self.segments {
            1 => String::new(),
            count => format!(", {count} segments, read one behind the other"),
        };
        let times = match (self.is_untimed, self.is_computed) {
            (true, _) => "; it has no times",
            (false, true) => "; the times are counted by its X0 and Delta_X",
            (false, false) => "",
        };
        let mut notes = vec![format!(
            "the file is a measurement of LabVIEW (LVM){of}{times}"
        )];
        if !self.named.is_empty() {
            let named = self.named.iter();
            let named = named.map(|(old, new)| format!("`{}` as `{new}`", brief(old)));
            notes.push(format!(
                "channels have no names of their own and are taken by their units, in their order: {}; `--columns` says otherwise",
                named.collect::<Vec<_>>().join(", ")
            ));
        }
        if let Some((line, text)) = &self.comment {
            notes.push(format!(
                "comments in rows: {}, which are not read, first in line {line}: `{}`",
                self.comments,
                brief(text)
            ));
        }
        notes
    }

    /// Takes the units of the channels into the layout.
    pub fn take(&self, layout: &mut Layout) {
        for (name, own) in layout.names.iter().zip(&mut layout.units) {
            let unit = self.units.iter().find(|(of, _)| of == name);
            *own = unit.map(|(_, unit)| unit.clone()).or(own.take());
        }
    }

    /// Refuses channels that were not sampled together.
    ///
    /// # Errors
    /// [`CaptureError::Table`] then.
    pub fn together(&self) -> std::result::Result<(), CaptureError> {
        match self.differs {
            false => Ok(()),
            true => Err(CaptureError::NoText {
                what: "a measurement of LabVIEW whose channels have times of their own (X0 or Delta_X differ)".to_owned(),
                help: "write channels of one rate into a file of their own, or resample them".to_owned(),
            }),
        }
    }

    /// An error that asks for columns or units, with what the file says of them.
    pub fn mention(&self, error: CaptureError) -> CaptureError {
        let mut error = error;
        if !self.others.is_empty() {
            error = error.hinting(&format!(
                "the file says {}: write how much of yours one of it is, as `gyro=80deg/s` for 12.5 mV a deg/s in volts",
                self.others.join(", ")
            ));
        }
        if self.is_untimed {
            error =
                error.hinting("its Delta_X is 1, as LabVIEW writes it where it knows no timing");
        }
        error
    }
}

/// A text, and what is known of it where it is such a file.
type Text<'a> = (Box<dyn BufRead + 'a>, Option<Rc<RefCell<Lvm>>>);

/// The text as a table, where it is a measurement of LabVIEW; else as it is.
///
/// # Errors
/// The stream's.
pub(super) fn as_table<'a>(mut input: impl BufRead + 'a) -> Result<Text<'a>> {
    if !input.fill_buf()?.starts_with(BEGINS) {
        return Ok((Box::new(input), None));
    }
    let mut head = Vec::new();
    input.by_ref().take(HEAD).read_to_end(&mut head)?;
    let found = Rc::new(RefCell::new(Lvm::default()));
    let mut table = Table::new(Rc::clone(&found));
    table.is_counted = is_counted(&decoded(&head));
    let input = Cursor::new(head).chain(input);
    let make = move |line: &str, made: &mut String| table.take(line, made);
    Ok((Box::new(Made::new(input, make)), Some(found)))
}

/// Whether the times are numbers of the rows, for which nothing says how far apart they are.
fn is_counted(head: &str) -> bool {
    let rows = head.lines().skip_while(|line| !line.starts_with(X)).skip(1);
    let x = |line: &str| {
        line.split(['\t', ',', ';'])
            .next()?
            .trim()
            .parse::<f64>()
            .ok()
    };
    let x: Vec<f64> = rows.map_while(x).collect();
    // The last line goes on.
    let x = &x[..x.len().saturating_sub(1)];
    x.len() > 2 && x.windows(2).all(|pair| pair[1] - pair[0] == UNTIMED)
}

/// Makes the table.
struct Table {
    found: Rc<RefCell<Lvm>>,
    at: At,
    line: u64,
    separator: char,
    decimal: String,
    file: Head,
    segment: Head,
    /// The names that were made, of which the first is the time's.
    names: Vec<String>,
    /// Cells of a row that are taken.
    taken: Vec<usize>,
    is_counted: bool,
    is_first: bool,
    /// Rows of this segment, and how their times are counted.
    rows: u64,
    x0: f64,
    delta: f64,
    /// Beginning of the first segment, s.
    clock: Clock,
    /// When this segment began after the first one, what is added to its times, and the last of them, s.
    since: Option<f64>,
    offset: f64,
    last: Option<f64>,
}

impl Table {
    fn new(found: Rc<RefCell<Lvm>>) -> Self {
        Self {
            found,
            at: At::Header,
            line: 0,
            separator: '\t',
            decimal: ".".to_owned(),
            file: Head::default(),
            segment: Head::default(),
            names: Vec::new(),
            taken: Vec::new(),
            is_counted: false,
            is_first: true,
            rows: 0,
            x0: 0.0,
            delta: 0.0,
            clock: Clock::new(1.0),
            since: None,
            offset: 0.0,
            last: None,
        }
    }

    fn take(&mut self, line: &str, made: &mut String) {
        self.line += 1;
        if self.at == At::Header && line.starts_with("Separator,") {
            self.separator = ',';
        }
        let first = line.split(self.separator).next().unwrap_or("").trim();
        match (self.at, first) {
            (At::Special, END_OF_SPECIAL) => self.at = At::Segment,
            (At::Special, _) => {}
            (_, SPECIAL) => self.at = At::Special,
            (At::Header, END) => {
                if let Some(sign) = self.file.first("Decimal_Separator") {
                    self.decimal = sign.to_owned();
                }
                self.at = At::Segment;
            }
            (At::Segment, END) => self.at = At::Names,
            (At::Header, _) => self.file.take(line, self.separator),
            (At::Segment | At::Names, X) => self.take_names(line, made),
            (At::Segment, _) => self.segment.take(line, self.separator),
            // A segment that begins with its header.
            (At::Rows, "Channels") => {
                self.segment = Head::default();
                self.segment.take(line, self.separator);
                self.at = At::Segment;
            }
            (At::Rows, _) if line.trim().is_empty() => {}
            _ => self.take_row(line, made),
        }
    }

    /// The names of the columns; lines of headers are empty ones, so that errors tell the lines of the file.
    fn take_names(&mut self, line: &str, made: &mut String) {
        self.at = At::Rows;
        self.rows = 0;
        let mut found = self.found.borrow_mut();
        found.segments += 1;
        found.differs |= self.segment.differs();
        let names: Vec<&str> = line.split(self.separator).map(str::trim).collect();
        let is_channel = |name: &&str| !matches!(*name, X | COMMENT | "");
        let channels = names.iter().filter(|name| is_channel(name));
        let channels: Vec<String> = channels.map(|name| (*name).to_owned()).collect();
        if !self.is_first {
            let is_same = self.names == channels;
            drop(found);
            self.begin_segment();
            if !is_same {
                // No row, and told so by who reads the rows.
                made.push_str(line);
            }
            return;
        }
        self.is_first = false;
        let has_x = self.file.first("X_Columns") != Some("No");
        let delta = self.segment.number("Delta_X").filter(|d| *d > 0.0);
        let is_time = self.segment.each("X_Dimension").all(|x| x == "Time");
        found.is_untimed =
            delta == Some(UNTIMED) && (!has_x || self.is_counted) || !has_x && delta.is_none();
        found.is_computed = !has_x && !found.is_untimed;
        let units: Vec<&str> = self.segment.each("Y_Unit_Label").collect();
        let units = if units.len() == channels.len() {
            units
        } else {
            Vec::new()
        };
        let shown = by_units(&channels, &units);
        let named = channels.iter().zip(&shown).filter(|(old, new)| old != new);
        found.named = named.map(|(old, new)| (old.clone(), new.clone())).collect();
        for (name, unit) in shown.iter().zip(units) {
            let is_of =
                |of: Quantity| known(unit).is_some_and(|unit| is_unit_of(unit, What::Channel(of)));
            let is_taken = [Quantity::Gyro, Quantity::Acc, Quantity::Temp]
                .into_iter()
                .any(is_of);
            if is_taken && !is_angle(unit) {
                found.units.push((name.clone(), unit.to_owned()));
            } else {
                found
                    .others
                    .push(format!("`{}` in {}", brief(name), brief(unit)));
            }
        }
        self.taken = (0..names.len())
            .filter(|at| is_channel(&names[*at]))
            .collect();
        let mut all = shown;
        if !found.is_untimed {
            all.insert(
                0,
                if is_time {
                    format!("{X} [s]")
                } else {
                    X.to_owned()
                },
            );
        }
        made.push_str(&all.join(&self.separator.to_string()));
        self.names = channels;
        drop(found);
        self.begin_segment();
    }

    /// When a segment begins, beside the first one.
    fn begin_segment(&mut self) {
        self.x0 = self.segment.number("X0").unwrap_or(0.0);
        self.delta = self.segment.number("Delta_X").unwrap_or(0.0);
        let (date, time) = (self.segment.first("Date"), self.segment.first("Time"));
        let (Some(date), Some(time)) = (date, time) else {
            return;
        };
        let whole = time.replacen(',', ".", 1);
        // To nanoseconds.
        let end = whole
            .find('.')
            .map_or(whole.len(), |at| whole.len().min(at + 10));
        self.since = (self.clock).seconds(&format!("{date} {}", &whole[..end]), |_| None);
    }

    fn take_row(&mut self, line: &str, made: &mut String) {
        let cells: Vec<&str> = line.split(self.separator).map(str::trim).collect();
        let behind = self.taken.last().map_or(0, |last| last + 1);
        if let Some(comment) = cells.get(behind).filter(|comment| !comment.is_empty()) {
            let mut found = self.found.borrow_mut();
            found.comments += 1;
            let at = (self.line, (*comment).to_owned());
            found.comment.get_or_insert(at);
        }
        let (is_untimed, is_computed) = {
            let found = self.found.borrow();
            (found.is_untimed, found.is_computed)
        };
        let mut row = Vec::with_capacity(self.taken.len() + 1);
        let x;
        if !is_untimed {
            let given = cells.first().copied().unwrap_or("");
            let own = match is_computed {
                true => Some(self.x0 + self.rows as f64 * self.delta),
                false => given.replacen(',', ".", 1).parse::<f64>().ok(),
            };
            // Times that go on need nothing added.
            let goes_back = own.zip(self.last);
            let goes_back = goes_back.is_some_and(|(own, last)| own + self.offset <= last);
            if let (Some(since), 0, true) = (self.since, self.rows, goes_back) {
                self.offset = since;
            }
            let time = own.map(|own: f64| own + self.offset);
            self.last = time.or(self.last);
            row.push(match time {
                Some(time) if is_computed || self.offset != 0.0 => {
                    x = format!("{time:.9}").replacen('.', &self.decimal, 1);
                    x.as_str()
                }
                _ => given,
            });
        }
        self.rows += 1;
        // What is not there stays a row of another width, and is told so.
        row.extend(self.taken.iter().map_while(|at| cells.get(*at)));
        made.push_str(&row.join(&self.separator.to_string()));
    }
}

/// What channels are called: where all have the name that LabVIEW gives, the sensor whose unit each has, along x, y and z.
fn by_units(channels: &[String], units: &[&str]) -> Vec<String> {
    let is_default = |name: &String| {
        let number = name.strip_prefix("Untitled").map(str::trim);
        number.is_some_and(|number| number.bytes().all(|b| b.is_ascii_digit()))
    };
    let mut shown = channels.to_vec();
    if units.len() != channels.len() || !channels.iter().all(is_default) {
        return shown;
    }
    for (of, stem) in [(Quantity::Gyro, "gyro"), (Quantity::Acc, "acc")] {
        let is_of = |at: &usize| {
            known(units[*at])
                .is_some_and(|unit| is_unit_of(unit, What::Channel(of)) && !is_angle(unit))
        };
        let places: Vec<usize> = (0..channels.len()).filter(is_of).collect();
        if places.len() <= 3 {
            for (at, axis) in places.into_iter().zip(["x", "y", "z"]) {
                shown[at] = format!("{stem}_{axis}");
            }
        }
    }
    shown
}
