//! How a text is laid out: what separates its cells, where its header is, and what that says. This is the one place that
//! recognizes it.

use std::borrow::Cow;
use std::io::BufRead;

use super::CaptureError;
use super::cells::Cells;
use super::header::Lines;
use super::stream::TextLines;
use super::units::{in_brackets, known};

/// What separates cells, in the order in which it is looked for; the last stands for any blanks.
const SEPARATORS: [char; 4] = [';', '\t', ',', ' '];

/// How a comment begins for some.
const SLASHES: &str = "//";

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
    /// What comments and the lines before the table say.
    pub said: Vec<(u64, String)>,
}

impl Layout {
    /// Reads as far as the first row.
    pub fn read(text: &mut TextLines<impl BufRead>) -> Result<Self, CaptureError> {
        let mut lines = Lines::default();
        let mut separator = None;
        let (mut comment, mut comments) = (String::new(), Vec::new());
        let (number, line) = loop {
            let Some((number, line)) = text.next_line()? else {
                return Err(CaptureError::Empty);
            };
            if let Some(said) = line.strip_prefix(['#', '%']) {
                let said = said.trim_start_matches(['#', '%']).trim();
                if comments.len() < PREAMBLE {
                    comments.push((number, line.clone()));
                }
                let list = list_of_names(said);
                if list.len() < said.len() || !lines.take(number as usize, said) && !said.is_empty()
                {
                    comment = list.to_owned();
                }
                text.is_no_row(&line)?;
            } else if let Some(said) = line.strip_prefix(SLASHES) {
                // Their keys are not ours.
                if comments.len() < PREAMBLE {
                    comments.push((number, line.clone()));
                }
                comment = list_of_names(said.trim()).to_owned();
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
        let (number, line) = behind_preamble(text, (number, line), separator, &mut comments)?;
        let preamble = (number > begin).then(|| (begin, number - 1));
        let found = SEPARATORS.into_iter().find(|s| line.contains(*s));
        let mut cells = Cells::new(separator.or(found).unwrap_or(','));
        if cells.is_row(&line) {
            let width = cells.cut(&line).len();
            // A header may stand in the last comment.
            let named = cells.cut(&comment);
            let is_header = named.len() == width && !cells.is_row(&comment);
            let (names, numbered) = match width {
                _ if is_header && width > 1 => (names_of(&named), false),
                1 => (vec!["values".to_owned()], true),
                _ => ((1..=width).map(|k| format!("column_{k}")).collect(), true),
            };
            let mut layout = Self::new(lines, names, numbered, cells, Some((number, line)));
            (layout.preamble, layout.said) = (preamble, comments);
            return Ok(layout);
        }
        let first = next_row(text)?;
        let row = first.as_ref().map_or("", |(_, row)| row.as_str());
        let (of_names, of_rows) = separators(&line, row, separator);
        let mut names = names_of(&Cells::new(of_names).cut(list_of_names(&line)));
        cells = Cells::new(of_rows);
        // A separator at the end of the names is no column where rows have nothing there.
        let behind = cells.cut(row);
        if names.len() > 1
            && names.last().is_some_and(String::is_empty)
            && behind
                .get(names.len() - 1)
                .is_none_or(|cell| cell.is_empty())
        {
            names.pop();
        }
        let mut layout = Self::new(lines, names, false, cells, first);
        (layout.preamble, layout.said) = (preamble, comments);
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
            said: Vec::new(),
        }
    }

    /// Takes the names that the rows carried, and the units of those that do not say them.
    pub fn take_names(&mut self, names: &[String], known: &[Option<String>]) {
        if names.len() == self.names.len() {
            self.names = names.to_vec();
            self.numbered = false;
            let units = names.iter().map(|name| in_brackets(name).1);
            self.units = units.map(|unit| unit.map(str::to_owned)).collect();
            let known = self.units.iter_mut().zip(known);
            known.for_each(|(own, known)| *own = known.clone().or(own.take()));
        }
    }

    /// A row of units under the names.
    fn take_units(&mut self, text: &mut TextLines<impl BufRead>) -> Result<(), CaptureError> {
        let Some((_, line)) = &self.first else {
            return Ok(());
        };
        let mut units = owned(&self.cells.cut(line));
        if units.len() == self.names.len() + 1 && units.last().is_some_and(String::is_empty) {
            units.pop();
        }
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
    known(text).or_else(|| known(text.trim_matches(['(', ')', '[', ']'])))
}

/// Lines before a table in which its names are looked for.
const PREAMBLE: usize = 60;

/// The line of names, where other lines stand before it: the first that has as many cells, two at least, as a row of
/// numbers, or of units and then of numbers, below it. The line given where there is none. What stands before is added to
/// `comments`.
fn behind_preamble(
    text: &mut TextLines<impl BufRead>,
    first: (u64, String),
    said: Option<char>,
    comments: &mut Vec<(u64, String)>,
) -> Result<(u64, String), CaptureError> {
    let begins = |names: &str, row: &str| {
        let (of_names, of_rows) = separators(names, row, said);
        let (mut names_cut, row_cut) = (Cells::new(of_names), Cells::new(of_rows));
        // Words with a number among them that are as many by chance.
        let of_row = |s: &&char| row.contains(**s) && !names.contains(**s);
        if let (' ', Some(other)) = (of_names, SEPARATORS[..3].iter().find(of_row)) {
            let words = owned(&names_cut.cut(names));
            let is_number = |word: &String| Cells::new(' ').number(word).is_some();
            if words.iter().any(is_number) {
                names_cut = Cells::new(*other);
            }
        }
        let width = row_cut.cut(row).len();
        width > 1
            && are_as_wide(&names_cut.cut(names), &row_cut.cut(row))
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
        let of_rows = || behind_remark(&seen, said);
        (0..seen.len()).find(is_table).or_else(of_rows).unwrap_or(0)
    };
    let mut rest = seen.split_off(at).into_iter();
    comments.append(&mut seen);
    let names = rest.next();
    text.put_back(rest);
    names.ok_or(CaptureError::Empty)
}

/// Rows that a table without names has at least behind a remark.
const ROWS: usize = 3;

/// The first row of a table without names behind remarks: lines that nothing cuts as it cuts the rows, of which all have one width.
fn behind_remark(seen: &[(u64, String)], said: Option<char>) -> Option<usize> {
    let (_, last) = seen.last()?;
    let found = || SEPARATORS.into_iter().find(|s| last.contains(*s));
    let separator = said.or_else(found).filter(|s| *s != ' ')?;
    let cells = Cells::new(separator);
    let width = cells.cut(last).len();
    let is_row = |line: &str| cells.cut(line).len() == width && cells.is_row(line);
    let rows = seen.iter().rev().take_while(|(_, line)| is_row(line));
    let at = seen.len() - rows.count();
    let is_remark = |(_, line): &(u64, String)| !line.contains(separator);
    (seen.len() - at >= ROWS && seen[..at].iter().all(is_remark)).then_some(at)
}

/// What separates names, and what separates the cells of rows: the first pair by which both have one width.
fn separators(names: &str, row: &str, said: Option<char>) -> (char, char) {
    let fits = |of_names, of_rows| {
        let columns = Cells::new(of_names).cut(names);
        columns.len() > 1 && are_as_wide(&columns, &Cells::new(of_rows).cut(row))
    };
    let mut pairs = SEPARATORS
        .into_iter()
        .flat_map(|a| [a].into_iter().chain(SEPARATORS).map(move |b| (a, b)));
    let fallback = SEPARATORS[..3].iter().find(|s| names.contains(**s));
    said.map(|s| (s, s))
        .or_else(|| pairs.find(|(a, b)| fits(*a, *b)))
        .unwrap_or_else(|| fallback.map_or((',', ','), |s| (*s, *s)))
}

/// Whether names and the cells of a row are as many, but for nothing behind a last separator.
fn are_as_wide(names: &[Cow<'_, str>], row: &[Cow<'_, str>]) -> bool {
    let is_longer = |long: &[Cow<'_, str>], short: &[Cow<'_, str>]| {
        long.len() == short.len() + 1 && long.last().is_some_and(|cell| cell.is_empty())
    };
    names.len() == row.len() || is_longer(names, row) || is_longer(row, names)
}

/// The list of names in a line that says so before it: `Data format: "..."`, `Fields: ...`.
fn list_of_names(line: &str) -> &str {
    const LABELS: [&str; 5] = ["format", "columns", "fields", "header", "names"];
    let Some((label, list)) = line.split_once(':') else {
        return line;
    };
    let label = label.trim_start_matches(['#', '%', '/']).to_lowercase();
    let mut words = label.split_whitespace().rev();
    let is_label = words.next().is_some_and(|word| LABELS.contains(&word)) && words.count() < 3;
    let list = list.trim();
    let is_list = list.contains(SEPARATORS);
    let bare = list
        .strip_prefix('"')
        .and_then(|list| list.strip_suffix('"'));
    match bare.filter(|bare| !bare.contains('"')) {
        _ if !is_label || !is_list => line,
        Some(bare) => bare,
        None => list,
    }
}

/// Names as they are, and what a format of `printf` has in brackets: `%float(RawGyroX)`.
fn names_of(cells: &[Cow<'_, str>]) -> Vec<String> {
    let bare = |cell: &Cow<'_, str>| {
        let inner = cell
            .strip_prefix('%')
            .and_then(|format| format.strip_suffix(')'));
        let inner = inner.and_then(|format| format.split_once('('));
        inner.map_or_else(|| cell.to_string(), |(_, name)| name.to_owned())
    };
    cells.iter().map(bare).collect()
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
        if !line.trim().is_empty() && !line.starts_with(['#', '%']) && !line.starts_with(SLASHES) {
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
