//! Readings behind their names, as sketches of microcontrollers print them: `ax:0.1,ay:0.2`, `AcX = 213 | AcY = -502`,
//! `A: 0.1 0.2 9.8 G: 0.01 0.02 0.03`, `Gyro X: 0.01, Y: 0.02, Z: 0.03 rad/s`.

use super::super::units::known;
use super::{Made, SHOWN, behind_time, write_cells};

/// Lines that a row may have.
const LINES: usize = 6;
/// Lines that may stand before the first row of several.
const BEFORE: usize = 8;
/// Lines in which rows of several are looked for.
const LOOKED_AT: usize = 80;
/// Between the lines of a row.
pub(super) const BETWEEN: &str = " | ";

/// Lines that make a row, and the words of the first.
pub(super) struct Cycle {
    pub count: usize,
    first: Vec<String>,
}

impl Cycle {
    pub fn is_first(&self, line: &str) -> bool {
        Row::of(line).has_words(&self.first)
    }
}

/// Rows whose words are the same in each.
pub(super) struct Labels {
    pub names: Vec<String>,
    /// The words around the numbers, without blanks.
    words: Vec<String>,
    has_time: bool,
}

impl Labels {
    /// Rows of several lines each, and how many: a sketch prints a sensor a line.
    pub fn over_lines(lines: &[&str]) -> Option<(Self, Cycle)> {
        let lines = &lines[..lines.len().min(LOOKED_AT)];
        let is_named = |line: &&&str| {
            let row = Row::of(line);
            !row.numbers.is_empty() && row.names().is_some()
        };
        if lines.iter().filter(is_named).count() < 2 * SHOWN {
            return None;
        }
        let of = |(count, begin): (usize, usize)| {
            let all = lines.get(begin..)?.chunks_exact(count);
            let joined: Vec<String> = all.map(|lines| lines.join(BETWEEN)).collect();
            let form = Self::of(&joined.iter().map(String::as_str).collect::<Vec<_>>())?;
            let first = lines.get(begin).map(|line| Row::of(line).words())?;
            // Else a row would have lines of two samples.
            let is_begin = Row::of(joined.first()?).has_words(&form.words);
            let is_row = |row: &&String| Row::of(row).has_words(&form.words);
            let is_most = 5 * joined.iter().filter(is_row).count() >= 4 * joined.len();
            (is_begin && is_most).then_some((form, Cycle { count, first }))
        };
        let ways = (2..=LINES).flat_map(|count| (0..count + BEFORE).map(move |from| (count, from)));
        ways.into_iter().find_map(of)
    }

    /// The words that most lines have, where each number has a name before it.
    pub fn of(lines: &[&str]) -> Option<Self> {
        let cut: Vec<Row<'_>> = lines.iter().map(|line| Row::of(line)).collect();
        let words: Vec<Vec<String>> = cut.iter().map(Row::words).collect();
        let count = |of: &[String]| words.iter().filter(|own| *own == of).count();
        let is_candidate = |k: &usize| cut[*k].numbers.len() > 1 && cut[*k].names().is_some();
        // Few lines of something else stand before the rows.
        let mut first = (0..cut.len()).filter(is_candidate).take(4 * SHOWN);
        let first = first.find(|k| count(&words[*k]) >= SHOWN)?;
        let of = &words[first];
        let behind = words[first..].iter();
        let has_time = cut[first].time.is_some();
        let names = cut[first].names()?;
        let time = has_time.then(|| "time".to_owned()).into_iter();
        (2 * count(of) > behind.count()).then(|| Self {
            names: time.chain(names).collect(),
            words: of.clone(),
            has_time,
        })
    }

    pub fn row(&self, line: &str, row: &mut String) -> Made {
        let own = Row::of(line);
        if own.time.is_some() != self.has_time || !own.has_words(&self.words) {
            return Made::Other;
        }
        write_cells(own.time.into_iter().chain(own.numbers), row);
        Made::Row
    }
}

/// The numbers of a line, and what stands before each and behind the last.
struct Row<'a> {
    time: Option<&'a str>,
    numbers: Vec<&'a str>,
    between: Vec<&'a str>,
}

impl<'a> Row<'a> {
    fn of(line: &'a str) -> Self {
        let (time, rest) = behind_time(line);
        let (mut numbers, mut between) = (Vec::new(), Vec::new());
        let (mut from, mut at) = (0, 0);
        while at < rest.len() {
            let part = &rest[at..];
            // The power of a unit is none.
            let is_power = rest[..at].ends_with('^');
            let length = number(part);
            if length > 0 && !is_power {
                between.push(&rest[from..at]);
                numbers.push(&part[..length]);
                at += length;
                from = at;
            } else {
                at += word(part);
            }
        }
        between.push(&rest[from..]);
        Self {
            time,
            numbers,
            between,
        }
    }

    fn words(&self) -> Vec<String> {
        self.between
            .iter()
            .map(|text| bare(text).collect())
            .collect()
    }

    fn has_words(&self, words: &[String]) -> bool {
        let is_same = |(own, word): (&&str, &String)| bare(own).eq(word.chars());
        self.between.len() == words.len() && self.between.iter().zip(words).all(is_same)
    }

    /// Names of the numbers, with their units; nothing where one has none.
    fn names(&self) -> Option<Vec<String>> {
        let mut groups: Vec<Group<'_>> = Vec::new();
        for (k, text) in self.between.iter().enumerate() {
            let (unit, label) = unit_and_label(text);
            if let Some(unit) = unit {
                // Of all numbers since the last name that is more than an axis.
                let begin = groups.iter().rposition(|group| !group.is_axis).unwrap_or(0);
                let of = groups[begin..].iter_mut();
                of.for_each(|group| group.unit = group.unit.or(Some(unit)));
            }
            if k == self.numbers.len() {
                break;
            }
            match label {
                Some(label) => groups.push(Group {
                    is_axis: is_axis(label) && !groups.is_empty(),
                    label,
                    unit: None,
                    count: 1,
                }),
                None => groups.last_mut()?.count += 1,
            }
        }
        // Words in a table are no names.
        let has_sign = |text: &&&str| {
            text.contains([':', '='])
                && text.contains(char::is_alphabetic)
                && !text.contains(['"', '{', '<'])
        };
        let signs = self.between.iter().filter(has_sign).count();
        if 2 * signs < groups.len() {
            return None;
        }
        let mut stem = "";
        let mut names = Vec::new();
        for group in &groups {
            if !group.is_axis {
                stem = group.label.trim_end_matches(['x', 'X']).trim_end();
            }
            names.extend(group.names(stem));
        }
        Some(names)
    }
}

/// A name, and the numbers behind it.
struct Group<'a> {
    label: &'a str,
    /// Whether it is one letter, that of an axis of what stands before.
    is_axis: bool,
    unit: Option<&'static str>,
    count: usize,
}

impl Group<'_> {
    fn names(&self, stem: &str) -> Vec<String> {
        let own = match self.is_axis && !stem.is_empty() {
            true => format!("{stem} {}", self.label),
            false => self.label.to_owned(),
        };
        let unit = self.unit.map_or(String::new(), |unit| format!(" [{unit}]"));
        match self.count {
            1 => vec![format!("{own}{unit}")],
            3 => ["x", "y", "z"]
                .map(|axis| format!("{own} {axis}{unit}"))
                .to_vec(),
            n => (0..n).map(|k| format!("{own}[{k}]")).collect(),
        }
    }
}

fn is_axis(label: &str) -> bool {
    matches!(label, "x" | "y" | "z" | "X" | "Y" | "Z")
}

/// What stands between two numbers: the unit of the one before, and the name of the one behind.
fn unit_and_label(text: &str) -> (Option<&'static str>, Option<&str>) {
    let is_around = |c: char| !c.is_alphanumeric() && !matches!(c, '_' | '%' | '°');
    let inner = text.trim_matches(is_around);
    if !inner.contains(char::is_alphabetic) {
        return (None, None);
    }
    let is_named = text.trim_end().ends_with([':', '=', '(', '[']);
    // A unit may have a blank: `deg C`.
    let mut ends = inner
        .match_indices([' ', ',', ';', '|', '\t'])
        .map(|(at, _)| at);
    let first = ends.next().unwrap_or(inner.len());
    let second = ends.next().unwrap_or(inner.len());
    let unit = |end: usize| Some((known(inner[..end].trim_end_matches([')', ']']))?, end));
    let unit = unit(second).or_else(|| unit(first));
    let rest = unit.map_or(inner, |(_, end)| inner[end..].trim_start_matches(is_around));
    match unit {
        Some((unit, _)) if rest.is_empty() && !is_named => (Some(unit), None),
        Some((unit, _)) if !rest.is_empty() => (Some(unit), Some(rest)),
        _ => (None, Some(inner)),
    }
}

/// What is no blank.
fn bare(text: &str) -> impl Iterator<Item = char> + '_ {
    text.chars().filter(|c| !c.is_whitespace())
}

/// The length of the number that a text begins with, where it is a whole one: letters behind it are its unit.
fn number(text: &str) -> usize {
    let bytes = text.as_bytes();
    let digits = |from: usize| {
        let of = bytes.get(from..).unwrap_or_default();
        of.iter().take_while(|b| b.is_ascii_digit()).count()
    };
    let sign = usize::from(matches!(bytes.first(), Some(b'+' | b'-')));
    let word = &text[sign..];
    if word
        .get(..3)
        .is_some_and(|word| word.eq_ignore_ascii_case("nan"))
        && !word[3..].starts_with(|c: char| c.is_alphanumeric())
    {
        return sign + 3;
    }
    let whole = digits(sign);
    let mut end = sign + whole;
    if bytes.get(end) == Some(&b'.') && whole + digits(end + 1) > 0 {
        end += 1 + digits(end + 1);
    } else if whole == 0 {
        return 0;
    }
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
        let power = digits(end + 1 + sign);
        end += if power > 0 { 1 + sign + power } else { 0 };
    }
    let rest = &text[end..];
    let letters = rest.find(|c: char| !c.is_alphanumeric() && !"/^²·°_%".contains(c));
    let letters = &rest[..letters.unwrap_or(rest.len())];
    match !letters.contains(char::is_alphabetic) || known(letters).is_some() {
        true => end,
        false => 0,
    }
}

/// The length of what is no number: a word with all its digits, or one character.
fn word(text: &str) -> usize {
    let is_of_word = |c: char| c.is_alphanumeric() || c == '_';
    match text.find(|c| !is_of_word(c)) {
        Some(0) => text.chars().next().map_or(1, char::len_utf8),
        Some(end) => end,
        None => text.len(),
    }
}
