//! Rows that carry what they are, made rows of a table on the way: sentences (`$VNYMR,...*5C`, `%RAWIMUSA,...*c01b540c`),
//! readings behind their names (`ax:0.1,ay:0.2`, `#A-R=1,2,3`), an object of JSON a line.

use std::borrow::Cow;
use std::cell::RefCell;
use std::io::{BufRead, Cursor, Read, Result};
use std::rc::Rc;

use super::stream::LONGEST_LINE;

mod labels;
mod messages;
mod objects;
pub(super) mod raw_imu;
pub(super) mod razor;
mod received;
mod sentences;

use labels::{BETWEEN, Cycle, Labels};
use messages::Messages;
use objects::Objects;
use raw_imu::RawImu;
use received::Received;
use sentences::Sentences;

/// Bytes in which the form of the rows is looked for.
const HEAD: u64 = 1 << 15;
/// Rows of one form that show it.
const SHOWN: usize = 3;

/// What became of a line.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Made {
    /// A row.
    Row,
    /// A row of which nothing can be read: it keeps its place, by its time where it has one that can be believed.
    Damaged,
    /// A line of something else.
    Other,
}

/// How the rows carry what they are.
enum Form {
    Sentences(Sentences),
    RawImu(RawImu),
    Labels(Labels),
    Objects(Objects),
    Messages(Messages),
    Received(Received),
}

impl Form {
    fn of(lines: &[&str]) -> Option<Self> {
        let sentences = || Sentences::of(lines).map(Self::Sentences);
        let objects = || Objects::of(lines).map(Self::Objects);
        let labels = || Labels::of(lines).map(Self::Labels);
        let messages = || Messages::of(lines).map(Self::Messages);
        let received = || Received::of(lines).map(Self::Received);
        let by_words = sentences().or_else(objects).or_else(labels);
        by_words.or_else(messages).or_else(received)
    }

    fn names(&self) -> &[String] {
        match self {
            Self::Sentences(form) => &form.names,
            Self::RawImu(form) => &form.names,
            Self::Labels(form) => &form.names,
            Self::Objects(form) => &form.names,
            Self::Messages(form) => &form.names,
            Self::Received(_) => &[],
        }
    }

    fn what(&self) -> String {
        match self {
            Self::Sentences(form) => format!("a sentence `${}`", form.tag),
            Self::RawImu(form) => format!("a log `{}` of NovAtel; {}", form.tag, form.told),
            Self::Labels(_) => "readings behind their names".to_owned(),
            Self::Objects(_) => "an object of JSON a line".to_owned(),
            Self::Messages(_) => "a message sensor_msgs/Imu of ROS 2, without names".to_owned(),
            Self::Received(_) => "the time of arrival, `->`, and what was received".to_owned(),
        }
    }

    /// Units of the columns that their names do not say.
    fn units(&self) -> &[Option<String>] {
        match self {
            Self::RawImu(form) => &form.units,
            _ => &[],
        }
    }

    /// What makes a row damaged beside its checksum and length, and what becomes of such rows.
    fn of_damage(&self) -> (&'static str, &'static str) {
        match self {
            Self::RawImu(_) => (raw_imu::OF_DAMAGE, ""),
            _ => ("", "; they keep their places, without readings"),
        }
    }

    /// Whether the first cell of a row is its time.
    fn has_time(&self) -> bool {
        self.names()
            .first()
            .is_some_and(|name| name.starts_with("time"))
    }

    /// Whether lines of something else may stand between the rows: an instrument sends several sentences.
    fn is_mixed(&self) -> bool {
        matches!(self, Self::Sentences(_) | Self::RawImu(_))
    }

    fn row(&self, line: &str, row: &mut String) -> Made {
        match self {
            Self::Sentences(form) => form.row(line, row),
            Self::RawImu(form) => form.row(line, row),
            Self::Labels(form) => form.row(line, row),
            Self::Objects(form) => form.row(line, row),
            Self::Messages(form) => form.row(line, row),
            Self::Received(form) => form.row(line, row),
        }
    }
}

/// What was made of such a text.
#[derive(Debug, Default)]
pub(super) struct Carried {
    /// Names of the columns.
    pub names: Vec<String>,
    /// Their units where the names do not say them.
    pub units: Vec<Option<String>>,
    what: String,
    rows: usize,
    damaged: usize,
    /// What else makes a row damaged, and what becomes of it.
    of_damage: (&'static str, &'static str),
    others: usize,
}

impl Carried {
    /// What to tell of it, the rows being read.
    pub fn notes(&self) -> Vec<String> {
        let mut notes = vec![format!("each line of the file is read so: {}", self.what)];
        if self.others > 0 {
            notes.push(format!(
                "lines of something else, which are not read: {}",
                self.others
            ));
        }
        if self.damaged > 0 {
            notes.push(format!(
                "rows whose checksum or length is wrong{}: {}{}",
                self.of_damage.0, self.damaged, self.of_damage.1
            ));
        }
        notes
    }
}

/// A text, and what is known of its rows where they carry it.
type Text<'a> = (Box<dyn BufRead + 'a>, Option<Rc<RefCell<Carried>>>);

/// The text as a table of numbers between commas, a line for each line, where its rows carry what they are; else as it is.
///
/// # Errors
/// The stream's.
pub(super) fn as_table<'a>(mut input: impl BufRead + 'a) -> Result<Text<'a>> {
    let mut head = Vec::new();
    input.by_ref().take(HEAD).read_to_end(&mut head)?;
    let is_whole = (head.len() as u64) < HEAD;
    let text = String::from_utf8_lossy(&head);
    let mut lines: Vec<&str> = text.lines().map(str::trim).collect();
    if !is_whole {
        // The last one goes on.
        lines.pop();
    }
    let raw_imu = RawImu::of(&lines).map(Form::RawImu);
    let unmarked: Vec<Cow<'_, str>> = lines.iter().map(|line| razor::unmarked(line)).collect();
    let mut lines: Vec<&str> = unmarked.iter().map(AsRef::as_ref).collect();
    lines.retain(|line| !line.is_empty() && !line.starts_with(['#', '%']));
    let (form, cycle) = match raw_imu.or_else(|| Form::of(&lines)) {
        Some(form) => (Some(form), None),
        None => Labels::over_lines(&lines)
            .map(|(labels, cycle)| (Form::Labels(labels), cycle))
            .unzip(),
    };
    drop(lines);
    drop(unmarked);
    drop(text);
    let input = Cursor::new(head).chain(input);
    let Some(form) = form else {
        return Ok((Box::new(input), None));
    };
    let carried = Rc::new(RefCell::new(Carried {
        names: form.names().to_vec(),
        units: form.units().to_vec(),
        what: form.what(),
        of_damage: form.of_damage(),
        ..Carried::default()
    }));
    let told = Rc::clone(&carried);
    let rows = Rows {
        input,
        form,
        cycle,
        held: Vec::new(),
        told,
        line: Vec::new(),
        made: Vec::new(),
        given: 0,
    };
    Ok((Box::new(rows), Some(carried)))
}

struct Rows<R> {
    input: R,
    form: Form,
    /// Where a row has several lines, and those of the next one.
    cycle: Option<Cycle>,
    held: Vec<String>,
    told: Rc<RefCell<Carried>>,
    line: Vec<u8>,
    /// The line that was made, and how much of it was given.
    made: Vec<u8>,
    given: usize,
}

impl<R: BufRead> Rows<R> {
    /// Makes the next line; nothing at the end.
    fn make(&mut self) -> Result<()> {
        self.line.clear();
        self.made.clear();
        self.given = 0;
        let mut input = self.input.by_ref().take(LONGEST_LINE);
        if input.read_until(b'\n', &mut self.line)? == 0 {
            return Ok(());
        }
        let line = String::from_utf8_lossy(&self.line);
        let mut row = String::new();
        let mut told = self.told.borrow_mut();
        let line = razor::unmarked(line.trim());
        let mut line = line.as_ref();
        let joined;
        if let Some(cycle) = &self.cycle {
            if cycle.is_first(line) {
                self.held.clear();
            }
            let is_more = !line.is_empty() && (!self.held.is_empty() || cycle.is_first(line));
            if is_more {
                self.held.push(line.to_owned());
            }
            if is_more && self.held.len() < cycle.count || line.is_empty() {
                self.made.push(b'\n');
                return Ok(());
            }
            if is_more {
                joined = std::mem::take(&mut self.held).join(BETWEEN);
                line = &joined;
            }
        }
        match self.form.row(line, &mut row) {
            Made::Row => {
                told.rows += 1;
                self.made.extend_from_slice(row.as_bytes());
            }
            Made::Damaged => {
                told.damaged += 1;
                if !row.is_empty() || !self.form.has_time() {
                    row.push_str(&",".repeat(told.names.len().saturating_sub(1)));
                    self.made.extend_from_slice(row.as_bytes());
                }
            }
            Made::Other if line.is_empty() || line.starts_with('#') && !self.form.is_mixed() => {
                self.made.extend_from_slice(line.as_bytes());
            }
            Made::Other if told.rows == 0 || self.form.is_mixed() => told.others += 1,
            // No row, and told so by who reads the rows.
            Made::Other => self.made.extend_from_slice(line.as_bytes()),
        }
        self.made.push(b'\n');
        Ok(())
    }
}

impl<R: BufRead> Read for Rows<R> {
    fn read(&mut self, into: &mut [u8]) -> Result<usize> {
        let from = self.fill_buf()?;
        let n = from.len().min(into.len());
        into[..n].copy_from_slice(&from[..n]);
        self.consume(n);
        Ok(n)
    }
}

impl<R: BufRead> BufRead for Rows<R> {
    fn fill_buf(&mut self) -> Result<&[u8]> {
        if self.given == self.made.len() {
            self.make()?;
        }
        Ok(&self.made[self.given..])
    }

    fn consume(&mut self, n: usize) {
        self.given = (self.given + n).min(self.made.len());
    }
}

/// The time that stands before what a program received, as terminals put it there, and the rest: `10:00:01.5 -> ax:1`,
/// `[2026-11-21 10:00:01.5] ax:1`, `1763719201.5,$VNYMR,...`.
fn behind_time(line: &str) -> (Option<&str>, &str) {
    let is_time = |text: &str| super::time::is_date(text) || text.parse::<f64>().is_ok();
    if let Some((time, rest)) = line.split_once("->")
        && is_time(time.trim())
    {
        return (Some(time.trim()), rest.trim());
    }
    if let Some((time, rest)) = line.strip_prefix('[').and_then(|l| l.split_once(']'))
        && is_time(time.trim())
    {
        return (Some(time.trim()), rest.trim());
    }
    let is_between = |c: char| matches!(c, ' ' | ',' | '\t' | ';');
    let ends: Vec<usize> = line
        .match_indices(is_between)
        .map(|(at, _)| at)
        .take(2)
        .collect();
    for end in ends.iter().rev() {
        let time = &line[..*end];
        let is_number = time.parse::<f64>().is_ok() && line[*end..].contains('$');
        if super::time::is_date(time) || is_number {
            return (Some(time), line[*end..].trim_start_matches(is_between));
        }
    }
    (None, line)
}

/// Writes cells between commas.
fn write_cells<'a>(cells: impl Iterator<Item = &'a str>, row: &mut String) {
    for (k, cell) in cells.enumerate() {
        if k > 0 {
            row.push(',');
        }
        if cell.contains([',', '"']) {
            row.push('"');
            row.push_str(&cell.replace('"', "\"\""));
            row.push('"');
        } else {
            row.push_str(cell);
        }
    }
}
