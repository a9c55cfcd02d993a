//! What can be wrong with a capture, and what to do about it.

use std::path::PathBuf;

use crate::report::plot::number;

/// A capture that cannot be read or written.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
#[non_exhaustive]
pub enum CaptureError {
    /// The file system says no.
    #[error("{} cannot be read or written", path.display())]
    #[diagnostic(
        code(capture::io),
        help("is the path right, may you read or write there, is the disk full?")
    )]
    Io {
        /// Which file.
        path: PathBuf,
        /// What it said.
        source: std::io::Error,
    },
    /// A compressed file that ends in the middle.
    #[error("{} ends in the middle: it was cut off, or not copied whole", path.display())]
    #[diagnostic(
        code(capture::cut_off),
        help(
            "`zcat FILE > whole.csv` gets out what is there, `--skip-bad` leaves out its last row; `capture --resume` goes on \
             with it, `capture --replay RUN.raw` decodes its raw bytes again"
        )
    )]
    CutOff {
        /// Which file.
        path: PathBuf,
    },
    /// A format line that names another format.
    #[error("line {line}: the format is `{found}`, this program reads `imu-stand-capture/1`")]
    #[diagnostic(
        code(capture::format),
        help("a newer program wrote it: update imu-stand, or export the file again")
    )]
    Format {
        /// Where.
        line: usize,
        /// What it says.
        found: String,
    },
    /// A key that is needed for a column is not there.
    #[error("the header lacks the key `{key}`, which the column `{column}` needs")]
    #[diagnostic(
        code(capture::missing_key),
        help(
            "where the cells are measured values, say their unit: `--units gyro=deg/s` or `gyro=rad/s`, `acc=m/s2` or `acc=g`; \
             where they are counts, add a line `# {key}: VALUE` before the column names"
        )
    )]
    MissingKey {
        /// The key.
        key: String,
        /// Who needs it.
        column: String,
    },
    /// A key whose value makes no sense.
    #[error("line {line}: `{key}` is `{found}`, expected {expected}")]
    #[diagnostic(code(capture::bad_key), help("correct the line"))]
    BadKey {
        /// Where.
        line: usize,
        /// The key.
        key: String,
        /// What it says.
        found: String,
        /// What it may say.
        expected: String,
    },
    /// No column names, or none that mean anything here.
    #[error("{why}; the columns are: {}", columns.join(", "))]
    #[diagnostic(code(capture::columns), help("map them{hint}: {example}"))]
    Columns {
        /// What is wrong.
        why: String,
        /// What there is.
        columns: Vec<String>,
        /// What to see to.
        hint: String,
        /// A mapping made of them.
        example: String,
    },
    /// Two columns of one name.
    #[error("two columns are called `{name}`")]
    #[diagnostic(
        code(capture::twice),
        help("rename one of them, or map the column by its number: `--columns {ours}={number}`")
    )]
    Twice {
        /// Their name.
        name: String,
        /// What it is here.
        ours: String,
        /// The number of the first one, from 1 on.
        number: usize,
    },
    /// A file that is no text.
    #[error("this is {what}, and no table in plain text")]
    #[diagnostic(code(capture::no_text), help("{help}"))]
    NoText {
        /// What it is.
        what: String,
        /// What to do.
        help: String,
    },
    /// Compressed data that cannot be unpacked.
    #[error("{} is damaged: {why}", path.display())]
    #[diagnostic(
        code(capture::damaged),
        help("copy it again; `zcat FILE > whole.csv` gets out what is there before the damage")
    )]
    Damaged {
        /// Which file.
        path: PathBuf,
        /// What the unpacking says.
        why: String,
    },
    /// A time column that is none.
    #[error("{why}")]
    #[diagnostic(code(capture::time), help("{help}"))]
    Time {
        /// What is wrong with it.
        why: String,
        /// What to do.
        help: String,
    },
    /// An option that cannot be understood.
    #[error("{option}: {why}")]
    #[diagnostic(code(capture::option), help("{help}"))]
    Option {
        /// `--columns`, `--units`.
        option: &'static str,
        /// What is wrong.
        why: String,
        /// What to write.
        help: String,
    },
    /// A row that is no measurement.
    #[error("line {line}, column `{column}`: `{found}` is {expected}")]
    #[diagnostic(
        code(capture::bad_row),
        help(
            "`--skip-bad` leaves such rows out and counts them; nothing is lost, the file stays as it is"
        )
    )]
    BadRow {
        /// Where.
        line: u64,
        /// Which column.
        column: String,
        /// What stands there.
        found: String,
        /// What is wrong with it.
        expected: String,
    },
    /// A number that may be read in two ways.
    #[error("line {line}, column `{column}`: `{found}` is no number for sure: {why}")]
    #[diagnostic(
        code(capture::ambiguous_number),
        help(
            "write the table without separators of thousands, and with one sign before all fractions"
        )
    )]
    Ambiguous {
        /// Where.
        line: u64,
        /// Which column.
        column: String,
        /// What stands there.
        found: String,
        /// What it may be.
        why: &'static str,
    },
    /// A row of another width than its table.
    #[error("line {line} has {found} cells, and the table has {expected} columns")]
    #[diagnostic(
        code(capture::bad_row),
        help("{hint}`--skip-bad` leaves such rows out and counts them; the file stays as it is")
    )]
    Cells {
        /// Where.
        line: u64,
        /// How many there are.
        found: usize,
        /// How many there should be.
        expected: usize,
        /// What it may come from.
        hint: &'static str,
    },
    /// A capture would overwrite a file.
    #[error("{} is there already", path.display())]
    #[diagnostic(
        code(capture::exists),
        help("`--resume` goes on with it; or name another file with `--out`")
    )]
    Exists {
        /// Which file.
        path: PathBuf,
    },
    /// A file that a capture cannot go on in.
    #[error("cannot go on in {}: {why}", path.display())]
    #[diagnostic(
        code(capture::resume),
        help("leave the file as it is and name another one with `--out`")
    )]
    Resume {
        /// Which file.
        path: PathBuf,
        /// Why.
        why: String,
    },
    /// A column says that the rows are of several sensors.
    #[error(
        "the rows are of several sensors: column `{column}` has `{first}`, and `{other}` in line {line}"
    )]
    #[diagnostic(
        code(capture::several_sensors),
        help(
            "no noise figure holds for all of them: write a file for each; if the column means something else, give it another name"
        )
    )]
    Several {
        /// Which column.
        column: String,
        /// The first sensor.
        first: String,
        /// The next one.
        other: String,
        /// Where that begins, from 1 on.
        line: u64,
    },
    /// A folder whose captures are not the parts of one.
    #[error("{}: {why}", path.display())]
    #[diagnostic(
        code(capture::parts),
        help(
            "name one of its captures; of a folder the parts of one capture are joined (`capture --rotate`), and `diagnose` and \
             `representative` take any captures in it one by one"
        )
    )]
    Parts {
        /// The folder.
        path: PathBuf,
        /// Why not.
        why: String,
    },
    /// A file of arrays that cannot be read.
    #[error("{}: {why}", path.display())]
    #[diagnostic(
        code(capture::table),
        help(
            "NPZ, NPY, Parquet, .mat (version 5 to 7.3) and HDF5 (.h5) are read, logs (MCAP, ROS 1 bags, ULog), everything else as text"
        )
    )]
    Table {
        /// Which file.
        path: PathBuf,
        /// What is wrong with it.
        why: String,
    },
    /// A log of a robot that yields no IMU.
    #[error("{kind}: {why}")]
    #[diagnostic(code(capture::log), help("{help}"))]
    Log {
        /// What kind of log.
        kind: &'static str,
        /// What is wrong with it.
        why: String,
        /// What to do.
        help: String,
    },
    /// Two records behind one another.
    #[error(
        "the file has two sample rates: {} Hz before row {row}, {} Hz from there on ({at_s:.6} s after the first row)",
        number(*before_hz, 6), number(*after_hz, 6)
    )]
    #[diagnostic(
        code(capture::two_rates),
        help(
            "no noise figure holds for both: take one part, `--span ,{at_s:.6}` or `--span {at_s:.6},` (or cut the file there)"
        )
    )]
    TwoRates {
        /// Sample rates, Hz.
        before_hz: f64,
        /// The later one.
        after_hz: f64,
        /// First row of the second part, from 1 on.
        row: usize,
        /// Its time, s from the first row.
        at_s: f64,
    },
    /// Columns of several lengths.
    #[error("the columns have different lengths: {lengths}")]
    #[diagnostic(
        code(capture::lengths),
        help("give each column one number a sample, NaN where there is none")
    )]
    Lengths {
        /// Name and length of each.
        lengths: String,
    },
    /// No reading is one that a sensor has.
    #[error(
        "{channel}: all {count} readings are out of range, up to {largest:e} {unit}: no sensor reads that"
    )]
    #[diagnostic(
        code(capture::out_of_range),
        help(
            "is the column {channel} the right one, and in the unit that the file or `--units` says? `--columns {channel}=COLUMN` takes another"
        )
    )]
    OutOfRange {
        /// The channel.
        channel: String,
        /// Its readings.
        count: usize,
        /// The farthest of them.
        largest: f64,
        /// In this unit.
        unit: String,
    },
    /// No rows at all.
    #[error("there is no row of data")]
    #[diagnostic(
        code(capture::empty),
        help("the file is empty or ends after its column names: was it copied whole?")
    )]
    Empty,
}

impl CaptureError {
    /// The same; one that asks for columns also with what is known of them.
    pub(super) fn hinting(self, said: &str) -> Self {
        match self {
            Self::Columns {
                why,
                columns,
                hint,
                example,
            } => Self::Columns {
                hint: format!("{hint}; {said}"),
                why,
                columns,
                example,
            },
            error => error,
        }
    }
}

/// Characters of a name or a cell that a message shows.
const SHOWN: usize = 30;
/// Names that a message lists.
const LISTED: usize = 20;

/// As much of a text as fits into a sentence.
pub(super) fn brief(text: &str) -> String {
    // What a terminal would obey is shown as a blank.
    let shown = |c: char| if c.is_control() { ' ' } else { c };
    let start: String = text.chars().take(SHOWN).map(shown).collect();
    if text.chars().count() <= SHOWN {
        return start;
    }
    format!("{start}...")
}

/// As many names as fit into a message, each in brief.
pub(super) fn brief_list(names: &[String]) -> Vec<String> {
    let mut list: Vec<String> = names.iter().take(LISTED).map(|name| brief(name)).collect();
    if names.len() > LISTED {
        list.push(format!("and {} more", names.len() - LISTED));
    }
    list
}
