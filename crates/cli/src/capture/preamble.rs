//! The sample rate that a file states in words before its table: `// Sample rate: 50.0Hz`, `# fs = 128`, `Sampling rate [Hz];256`.

use model::record::Record;
use model::record::sampling::Sampling;

use super::columns::Columns;
use super::error::brief;
use super::header::Lines;
use super::order::CONTRADICTS;

/// A rate, and where it stands.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Stated {
    pub hz: f64,
    /// `line 2`, or `the file`.
    place: String,
    /// As it stands there.
    text: String,
}

/// What a rate is called, in small letters without what is between words.
const RATES: [&str; 22] = [
    "samplerate",
    "samplingrate",
    "samplefrequency",
    "samplingfrequency",
    "samplefreq",
    "samplingfreq",
    "samplespersecond",
    "updaterate",
    "outputrate",
    "outputdatarate",
    "datarate",
    "lograte",
    "loggingrate",
    "recordingrate",
    "acquisitionrate",
    "odr",
    "fs",
    "abtastrate",
    "abtastfrequenz",
    "fréquencedéchantillonnage",
    "frequencedechantillonnage",
    "サンプリング周波数",
];
/// What may be the rate of anything, and is one of samples where its unit stands beside it.
const BARE: [&str; 3] = ["rate", "frequency", "freq"];
/// What an interval between samples is called.
const INTERVALS: [&str; 9] = [
    "sampleinterval",
    "samplinginterval",
    "sampleperiod",
    "samplingperiod",
    "sampletime",
    "samplingtime",
    "updateinterval",
    "abtastintervall",
    "dt",
];
/// Words that may stand before: of a sensor of rates, and no more than that.
const BEFORE: [&str; 16] = [
    "imu",
    "gyro",
    "gyroscope",
    "acc",
    "accel",
    "accelerometer",
    "inertial",
    "sensor",
    "device",
    "data",
    "output",
    "nominal",
    "mean",
    "average",
    "effective",
    "actual",
];
/// Units of a rate and what they are in Hz; of an interval, in s.
const PER_S: [(&str, f64); 7] = [
    ("hz", 1.0),
    ("khz", 1e3),
    ("sps", 1.0),
    ("s/s", 1.0),
    ("1/s", 1.0),
    ("/s", 1.0),
    ("samples/s", 1.0),
];
const SECONDS: [(&str, f64); 7] = [
    ("s", 1.0),
    ("sec", 1.0),
    ("seconds", 1.0),
    ("ms", 1e-3),
    ("msec", 1e-3),
    ("us", 1e-6),
    ("µs", 1e-6),
];
/// The longest interval that is in seconds where nobody says so: in ms it would be less than any sensor of rates has.
const SHORT_S: f64 = 0.1;
/// Rates of a sensor, Hz.
const BELIEVED: std::ops::RangeInclusive<f64> = 1e-3..=1e6;
/// Statements that differ by less are one.
const SAME: f64 = 1e-3;

/// The rate that lines before a table state, with their numbers; where several state different ones, what to say of it.
pub(super) fn stated(lines: &[(u64, String)]) -> Result<Option<Stated>, String> {
    let said = lines.iter().filter_map(|(at, text)| {
        Some(Stated {
            hz: rate(text)?,
            place: format!("line {at}"),
            text: brief(text.trim()),
        })
    });
    one(said.collect())
}

/// The same of the keys of a file of arrays: `fs`, `sample_rate`.
pub(super) fn stated_by(lines: &Lines) -> Result<Option<Stated>, String> {
    let said = lines.entries.iter().filter_map(|(_, key, value)| {
        let text = format!("{key}: {value}");
        Some(Stated {
            hz: rate(&text)?,
            place: "the file".to_owned(),
            text: brief(&text),
        })
    });
    one(said.collect())
}

fn one(said: Vec<Stated>) -> Result<Option<Stated>, String> {
    let differs = |a: &Stated, b: &Stated| (a.hz / b.hz - 1.0).abs() > SAME;
    let other = said.iter().find(|b| differs(&said[0], b));
    if let Some(other) = other {
        let first = &said[0];
        return Err(format!(
            "several sample rates are stated, by {} (`{}`) and {} (`{}`): none of them is taken",
            first.place, first.text, other.place, other.text
        ));
    }
    Ok(said.into_iter().next())
}

/// The rate that a text states, Hz.
fn rate(text: &str) -> Option<f64> {
    let text = text.trim_start_matches(['#', '%', '/', '*', ';', '!', '-', '"', '\'', ' ']);
    let of_part = |part: &str| {
        let (key, value) = part.split_once([':', '=', '\t', ';', ','])?;
        of(key, value)
    };
    // A line may state one thing after another; a comma within a number separates none.
    let parts = || {
        text.split([';', '|', '\t'])
            .flat_map(|part| part.split(", "))
    };
    of_part(text).or_else(|| parts().find_map(of_part))
}

/// The rate that a key and its value state.
fn of(key: &str, value: &str) -> Option<f64> {
    let mut words = words(key);
    let is_unit = |word: &String| (PER_S.iter().chain(&SECONDS)).any(|(unit, _)| word == unit);
    let mut unit = match words.last() {
        Some(last) if words.len() > 1 && is_unit(last) => words.pop(),
        _ => None,
    };
    let before = words.iter().take_while(|w| BEFORE.contains(&w.as_str()));
    let most = before.count();
    let name = (0..=most).map(|from| words[from..].concat()).find(|name| {
        let name = name.as_str();
        RATES.contains(&name) || BARE.contains(&name) || INTERVALS.contains(&name)
    })?;
    let value = value.trim_matches(|c: char| !c.is_alphanumeric() && c != '/');
    let end = value.find(|c: char| !matches!(c, '0'..='9' | '.' | ','));
    let (digits, rest) = value.split_at(end.unwrap_or(value.len()));
    let rest = rest.trim_start_matches([' ', ',', ';', '\t', '"', '[', '(']);
    let after: String = rest
        .chars()
        .take_while(|c| c.is_alphanumeric() || *c == '/')
        .flat_map(char::to_lowercase)
        .collect();
    if !after.is_empty() {
        unit = Some(after);
    }
    let size = size(digits.trim_end_matches([',', '.']))?;
    let of_unit = |units: &[(&str, f64)]| {
        let unit = unit.as_deref()?;
        units
            .iter()
            .find(|(name, _)| *name == unit)
            .map(|(_, f)| *f)
    };
    let is_interval = INTERVALS.contains(&name.as_str());
    let hz = match (&unit, is_interval) {
        (None, false) if !BARE.contains(&name.as_str()) => size,
        (None, true) if size <= SHORT_S => 1.0 / size,
        (None, _) => return None,
        (Some(_), false) => size * of_unit(&PER_S)?,
        (Some(_), true) => 1.0 / (size * of_unit(&SECONDS)?),
    };
    BELIEVED.contains(&hz).then_some(hz)
}

/// A number with a point or a comma before its fraction; nothing where a comma may stand between thousands.
fn size(digits: &str) -> Option<f64> {
    let is_thousands = |(_, behind): (&str, &str)| behind.len() == 3;
    if digits.contains('.') && digits.contains(',')
        || digits.split_once(',').is_some_and(is_thousands)
    {
        return None;
    }
    digits.replace(',', ".").parse().ok()
}

/// The words of a key, in small letters.
fn words(key: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut was_small = false;
    for c in key.chars() {
        // What is 1/s or S/s in brackets is a unit.
        let is_part = c.is_alphanumeric() || c == '/';
        if !is_part || (c.is_uppercase() && was_small) {
            words.push(String::new());
        }
        was_small = c.is_lowercase();
        if let (true, Some(word)) = (is_part, words.last_mut()) {
            word.extend(c.to_lowercase());
        }
    }
    words.retain(|word| !word.is_empty());
    words
}

impl Columns {
    /// Keeps what the file states in words.
    pub fn keep_rate(&mut self, stated: Result<Option<Stated>, String>, given: Option<f64>) {
        match stated {
            Ok(stated) => self.stated_rate = stated,
            Err(note) => self.notes.extend(given.is_none().then_some(note)),
        }
    }
}

impl Stated {
    /// Takes the rate for rows that have no times; `--rate` overrules it, and is told where they differ.
    pub fn take(&self, record: &mut Record, given: Option<f64>) {
        let Stated { hz, place, text } = self;
        let note = match given {
            Some(given) if !self.differs(given) => return,
            Some(given) => format!(
                "the sample rate is {} Hz, as --rate says, although {place} says {} Hz (`{text}`)",
                short(given),
                short(*hz)
            ),
            None => {
                record.header.rate_hz = Some(*hz);
                format!(
                    "the sample rate is {} Hz, as {place} says (`{text}`); `--rate` says otherwise",
                    short(*hz)
                )
            }
        };
        record.notes.push(note);
    }

    /// Holds the rate against the times of the rows, which overrule it.
    pub fn hold_against(&self, record: &mut Record) {
        let by_times = Sampling::of(record, None).map(|sampling| 1.0 / sampling.tau0);
        if let Ok(by_times) = by_times
            && self.differs(by_times)
        {
            record.notes.push(format!(
                "by their times the rows come at {} Hz, although {} says {} Hz (`{}`): the times are taken",
                short(by_times),
                self.place,
                short(self.hz),
                self.text
            ));
        }
    }

    /// The unit in which times that nobody gave one make this rate, and its length, s; `None` where seconds do.
    pub fn unit_of(&self, times: &[f64]) -> Option<(&'static str, f64)> {
        let mut steps: Vec<f64> = times.windows(2).map(|t| (t[1] - t[0]).abs()).collect();
        steps.retain(|step| *step > 0.0);
        let middle = steps.len() / 2;
        if steps.is_empty() {
            return None;
        }
        let step = *steps.select_nth_unstable_by(middle, f64::total_cmp).1;
        let units = [
            ("s", 1.0),
            ("ms", 1e-3),
            ("0.1ms", 1e-4),
            ("us", 1e-6),
            ("ns", 1e-9),
        ];
        let found = units
            .into_iter()
            .find(|(_, s)| !self.differs(1.0 / (step * s)));
        found.filter(|(unit, _)| *unit != "s")
    }

    /// Says that times are taken in this unit.
    pub fn gives(&self, unit: &str) -> String {
        format!(
            "time is taken in {unit}, in which the rows come at the {} Hz that {} says (`{}`); `--units time=...` says otherwise",
            short(self.hz),
            self.place,
            self.text
        )
    }

    fn differs(&self, from: f64) -> bool {
        (from / self.hz - 1.0).abs() > CONTRADICTS
    }
}

/// To a tenth of a millihertz.
fn short(hz: f64) -> f64 {
    (hz * 1e4).round() / 1e4
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rate_is_read_in_the_words_of_many_and_no_other_number_is_one() {
        for (text, hz) in [
            ("// Sample rate: 50.0Hz", Some(50.0)),
            ("Sample rate: 100 Hz", Some(100.0)),
            ("Sampling rate [Hz]: 256", Some(256.0)),
            ("Sampling rate (Hz);256;;", Some(256.0)),
            ("Update Rate: 100.0Hz", Some(100.0)),
            ("# fs = 128", Some(128.0)),
            ("OutputRate: 60Hz", Some(60.0)),
            ("sample_rate_hz: 104", Some(104.0)),
            ("\"Sample Rate\",1.6,kHz", Some(1600.0)),
            ("IMU output data rate = 200 samples/s", Some(200.0)),
            ("Abtastrate: 50,5 Hz", Some(50.5)),
            ("Fréquence d'échantillonnage : 100 Hz", Some(100.0)),
            ("Sampling interval: 10 ms", Some(100.0)),
            ("dt: 0.005", Some(200.0)),
            ("Device: A7, Sample rate: 100 Hz, range: 500", Some(100.0)),
            ("Rate: 100 Hz", Some(100.0)),
            ("Rate: 100", None),
            ("dt: 10", None),
            ("Sample rate divider: 9", None),
            ("GPS update rate: 10 Hz", None),
            ("Magnetometer sample rate: 20 Hz", None),
            ("Baud rate: 115200", None),
            ("Data rate: 115200 bps", None),
            ("Sample rate: 1,000 Hz", None),
            ("Sample rate: fast", None),
            ("Sample rate: 0 Hz", None),
            ("time: 100", None),
            ("The rate of this sensor: 100 Hz", None),
        ] {
            let found = rate(text);
            let is_it = match (found, hz) {
                (Some(found), Some(hz)) => (found / hz - 1.0f64).abs() < 1e-12,
                (found, hz) => found == hz,
            };
            assert!(is_it, "{text}: {found:?}");
        }
    }

    #[test]
    fn of_two_rates_none_is_taken() {
        let line = |at, text: &str| (at, text.to_owned());
        let one = [line(1, "fs = 100"), line(2, "Sample rate: 100.0 Hz")];
        assert_eq!(stated(&one).map(|s| s.map(|s| s.hz)), Ok(Some(100.0)));
        let two = [line(1, "Gyro rate: 1 kHz"), line(2, "Accel rate: 500 Hz")];
        let told = stated(&two).expect_err("two");
        assert!(told.contains("line 2") && told.contains("none"), "{told}");
    }
}
