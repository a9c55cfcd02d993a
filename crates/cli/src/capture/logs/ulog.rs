//! PX4's ULog: messages of a size and a kind; formats of topics as texts, then their data. Rates are in rad/s, accelerations
//! in m/s^2, temperatures in degC by the definitions of the topics.

use std::collections::HashMap;
use std::io::{BufRead, Read as _};

use super::super::table::Table;
use super::{Bytes, LogError, Read, held, since_first};

/// A field of a topic.
#[derive(Clone, Debug, PartialEq)]
struct Field {
    kind: String,
    count: usize,
    name: String,
}

/// What a topic delivers of an IMU.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Source {
    /// `sensor_combined`: the sensors that the filters use, averaged.
    Combined,
    /// `vehicle_imu`: angles and velocities of an interval.
    Integrated,
    /// `sensor_gyro`: one gyro.
    Gyro,
}

/// Where the numbers of a topic stand in its messages.
struct Layout {
    source: Source,
    /// Kind and offset of the time, of three rates, of three accelerations, of a temperature.
    time: (String, usize),
    gyro: [(String, usize); 3],
    acc: Option<[(String, usize); 3]>,
    temp: Option<(String, usize)>,
    /// Lengths of the intervals of angle and velocity, us.
    intervals: Option<[(String, usize); 2]>,
}

/// The rows of one instance of a topic.
#[derive(Default)]
struct Rows {
    times_us: Vec<i64>,
    gyro: [Vec<f64>; 3],
    acc: [Vec<f64>; 3],
    temp: Vec<f64>,
}

#[derive(Default)]
struct Reader {
    formats: HashMap<String, Vec<Field>>,
    /// Name and instance of what a number stands for.
    subscribed: HashMap<u16, (String, u8)>,
    layouts: HashMap<String, Option<Layout>>,
    rows: HashMap<(String, u8), Rows>,
    dropouts: usize,
}

/// Depth to which types within types are followed.
const DEEPEST: usize = 8;
/// Bytes of a message's head: its size and its kind.
const HEAD: u64 = 3;

/// Reads the file behind its magic.
pub(super) fn read(input: &mut dyn BufRead, topic: Option<&str>) -> Read {
    // Version, and the time of the start.
    std::io::copy(&mut input.take(9), &mut std::io::sink())?;
    let mut reader = Reader::default();
    let mut content = Vec::new();
    let is_cut = loop {
        let mut head = Vec::with_capacity(HEAD as usize);
        input.take(HEAD).read_to_end(&mut head)?;
        let mut bytes = Bytes::new(&head);
        let (Some(size), Some(kind)) = (bytes.u16(), bytes.u8()) else {
            break !head.is_empty();
        };
        content.clear();
        input.take(size.into()).read_to_end(&mut content)?;
        if content.len() < usize::from(size) {
            break true;
        }
        reader.message(kind, &content)?;
    };
    Ok((reader.table(topic)?, is_cut))
}

impl Reader {
    fn message(&mut self, kind: u8, content: &[u8]) -> Result<(), LogError> {
        let mut bytes = Bytes::new(content);
        match kind {
            b'B' => {
                // Eight bytes of features that may be ignored, eight of those that may not; of these one is known, data
                // appended after a crash, which are read like the rest.
                let unknown = content.get(8..16).unwrap_or_default();
                let is_known = |(at, bits): (usize, &u8)| *bits == 0 || (at == 0 && *bits == 1);
                if !unknown.iter().enumerate().all(is_known) {
                    let why = "it has features that this program does not know";
                    return Err(LogError::Damaged(why.to_owned()));
                }
            }
            b'F' => {
                let text = String::from_utf8_lossy(content);
                if let Some((name, fields)) = text.split_once(':') {
                    let fields = fields.split(';').filter_map(field).collect();
                    self.formats.insert(name.trim().to_owned(), fields);
                }
            }
            b'A' => {
                if let (Some(instance), Some(number)) = (bytes.u8(), bytes.u16()) {
                    let name = String::from_utf8_lossy(bytes.rest()).into_owned();
                    self.subscribed.insert(number, (name, instance));
                }
            }
            b'D' => {
                if let Some(number) = bytes.u16() {
                    self.data(number, bytes.rest());
                }
            }
            b'O' => self.dropouts += 1,
            _ => {}
        }
        Ok(())
    }

    fn data(&mut self, number: u16, data: &[u8]) {
        let Some((name, instance)) = self.subscribed.get(&number) else {
            return;
        };
        if !self.layouts.contains_key(name) {
            let layout = Layout::of(name, &self.formats);
            self.layouts.insert(name.clone(), layout);
        }
        let Some(Some(layout)) = self.layouts.get(name) else {
            return;
        };
        let rows = self.rows.entry((name.clone(), *instance)).or_default();
        // What is shorter than its format is no reading.
        let _ = layout.row(data, rows);
    }

    /// The topic that is read, the one wanted or the best, and what there is, in words.
    fn chosen(&self, wanted: Option<&str>) -> Result<((String, u8), Vec<String>), LogError> {
        let rank = |(name, instance): &(String, u8)| {
            let source = self
                .layouts
                .get(name)
                .and_then(Option::as_ref)
                .map(|l| l.source);
            let source = [Source::Combined, Source::Integrated, Source::Gyro]
                .iter()
                .position(|s| Some(*s) == source);
            (source, *instance)
        };
        let mut found: Vec<&(String, u8)> = self.rows.keys().collect();
        found.sort_by_key(|key| rank(key));
        let topics: Vec<String> = found
            .iter()
            .map(|key| {
                format!(
                    "{} ({} messages)",
                    called(key),
                    self.rows[*key].times_us.len()
                )
            })
            .collect();
        let chosen = match wanted {
            _ if found.is_empty() => {
                let mut names: Vec<String> =
                    self.subscribed.values().map(|(n, _)| n.clone()).collect();
                names.sort();
                names.dedup();
                return Err(LogError::NoImu(names));
            }
            None => found[0].clone(),
            Some(wanted) => {
                let is_it = |key: &&&(String, u8)| called(key) == wanted;
                let key = found.iter().find(is_it).ok_or_else(|| LogError::Which {
                    why: format!("no IMU in it has the topic `{wanted}`; there is"),
                    topics: topics.clone(),
                })?;
                (*key).clone()
            }
        };
        Ok((chosen, topics))
    }

    /// The columns of the topic that is asked for, or of the one that the flight filters use.
    fn table(mut self, wanted: Option<&str>) -> Result<Table, LogError> {
        let (chosen, topics) = self.chosen(wanted)?;
        let mut notes = vec![format!(
            "topic {}: rates in rad/s and accelerations in m/s^2 by its definition",
            called(&chosen)
        )];
        if wanted.is_none() && topics.len() > 1 {
            notes.push(format!(
                "the log also has {}: `--topic` takes another one",
                topics[1..].join(", ")
            ));
        }
        if self.dropouts > 0 {
            notes.push(format!("dropouts of the logger: {}", self.dropouts));
        }
        let rows = self.rows.remove(&chosen).unwrap_or_default();
        let mut gyros = self
            .rows
            .iter()
            .filter(|((name, _), _)| name == "sensor_gyro");
        let thermometer = gyros.next().filter(|_| gyros.next().is_none());
        let mut table = rows.columns();
        if let ([], Some((key, other))) = (&rows.temp[..], thermometer)
            && !other.temp.is_empty()
            && other.times_us.is_sorted()
        {
            let temp = held(&other.times_us, &other.temp, &rows.times_us);
            table.add("temp", "degC", temp);
            notes.push(format!(
                "temp is that of topic {}, the last reading before each row",
                called(key)
            ));
        }
        table.notes = notes;
        Ok(table)
    }
}

/// A field of a format: `uint64_t timestamp`, `float[3] gyro_rad`.
fn field(text: &str) -> Option<Field> {
    let (kind, name) = text.trim().split_once(' ')?;
    let (kind, count) = match kind.split_once('[') {
        Some((kind, count)) => (kind, count.strip_suffix(']')?.parse().ok()?),
        None => (kind, 1),
    };
    Some(Field {
        kind: kind.to_owned(),
        count,
        name: name.trim().to_owned(),
    })
}

/// Bytes of a type; of one that is a format of its own the sum of its fields.
fn size(kind: &str, formats: &HashMap<String, Vec<Field>>, depth: usize) -> Option<usize> {
    match kind {
        "int8_t" | "uint8_t" | "bool" | "char" => Some(1),
        "int16_t" | "uint16_t" => Some(2),
        "int32_t" | "uint32_t" | "float" => Some(4),
        "int64_t" | "uint64_t" | "double" => Some(8),
        _ if depth < DEEPEST => formats.get(kind)?.iter().try_fold(0usize, |sum, field| {
            let each = size(&field.kind, formats, depth + 1)?;
            sum.checked_add(each.checked_mul(field.count)?)
        }),
        _ => None,
    }
}

impl Layout {
    /// Of a topic that is one of an IMU; nothing of any other.
    fn of(name: &str, formats: &HashMap<String, Vec<Field>>) -> Option<Self> {
        let source = match name {
            "sensor_combined" => Source::Combined,
            "vehicle_imu" => Source::Integrated,
            "sensor_gyro" => Source::Gyro,
            _ => return None,
        };
        let mut places: HashMap<&str, (&str, usize, usize)> = HashMap::new();
        let mut at = 0usize;
        for field in formats.get(name)? {
            places.insert(&field.name, (&field.kind, at, field.count));
            let each = size(&field.kind, formats, 0)?;
            at = at.checked_add(each.checked_mul(field.count)?)?;
        }
        let one = |field: &str| {
            let (kind, at, _) = places.get(field)?;
            Some(((*kind).to_owned(), *at))
        };
        let three = |field: &str| {
            let (kind, at, count) = places.get(field)?;
            let each = size(kind, formats, 0)?;
            (*count == 3).then(|| [0, 1, 2].map(|k| ((*kind).to_owned(), at + k * each)))
        };
        let (gyro, acc, intervals) = match source {
            Source::Combined => (three("gyro_rad")?, three("accelerometer_m_s2"), None),
            Source::Integrated => (
                three("delta_angle")?,
                three("delta_velocity"),
                Some([one("delta_angle_dt")?, one("delta_velocity_dt")?]),
            ),
            Source::Gyro => ([one("x")?, one("y")?, one("z")?], None, None),
        };
        Some(Self {
            source,
            time: one("timestamp_sample").or_else(|| one("timestamp"))?,
            gyro,
            acc,
            temp: one("temperature"),
            intervals,
        })
    }

    /// Adds a message to the rows.
    fn row(&self, data: &[u8], rows: &mut Rows) -> Option<()> {
        let at = |(kind, at): &(String, usize)| number(kind, data.get(*at..)?);
        let each = |of: &[(String, usize); 3], us: Option<f64>| {
            let per = us.map_or(1.0, |us| 1e6 / us);
            let v = [at(&of[0])?, at(&of[1])?, at(&of[2])?];
            Some(v.map(|v| {
                if (v * per).is_finite() {
                    v * per
                } else {
                    f64::NAN
                }
            }))
        };
        let intervals = match &self.intervals {
            Some([angle, velocity]) => [Some(at(angle)?), Some(at(velocity)?)],
            None => [None, None],
        };
        let time = whole(&self.time.0, data.get(self.time.1..)?)?;
        let gyro = each(&self.gyro, intervals[0])?;
        let acc = match &self.acc {
            Some(of) => Some(each(of, intervals[1])?),
            None => None,
        };
        let temp = match &self.temp {
            Some(of) => Some(at(of)?),
            None => None,
        };
        rows.times_us.push(time);
        (rows.gyro.iter_mut().zip(gyro)).for_each(|(column, v)| column.push(v));
        for (column, v) in rows.acc.iter_mut().zip(acc.into_iter().flatten()) {
            column.push(v);
        }
        rows.temp
            .extend(temp.map(|t| if t.is_finite() { t } else { f64::NAN }));
        Some(())
    }
}

impl Rows {
    fn columns(&self) -> Table {
        let mut table = Table::default();
        table.add("time", "s", since_first(&self.times_us, 1e-6));
        for (k, axis) in ["x", "y", "z"].iter().enumerate() {
            table.add(&format!("gyro_{axis}"), "rad/s", self.gyro[k].clone());
        }
        for (k, axis) in ["x", "y", "z"].iter().enumerate() {
            if !self.acc[k].is_empty() {
                table.add(&format!("acc_{axis}"), "m/s^2", self.acc[k].clone());
            }
        }
        if !self.temp.is_empty() && !self.temp.iter().all(|t| t.is_nan()) {
            table.add("temp", "degC", self.temp.clone());
        }
        table
    }
}

/// A number of a type that formats have.
fn number(kind: &str, bytes: &[u8]) -> Option<f64> {
    let mut b = Bytes::new(bytes);
    match kind {
        "float" => b.u32().map(|bits| f64::from(f32::from_bits(bits))),
        "double" => b.f64(),
        _ => whole(kind, bytes).map(|n| n as f64),
    }
}

fn whole(kind: &str, bytes: &[u8]) -> Option<i64> {
    let mut b = Bytes::new(bytes);
    match kind {
        "uint8_t" => b.u8().map(i64::from),
        "int8_t" => b.u8().map(|n| i64::from(n as i8)),
        "uint16_t" => b.u16().map(i64::from),
        "int16_t" => b.u16().map(|n| i64::from(n as i16)),
        "uint32_t" => b.u32().map(i64::from),
        "int32_t" => b.i32().map(i64::from),
        "uint64_t" | "int64_t" => b.u64().map(|n| n as i64),
        _ => None,
    }
}

/// A topic's name, with the number of its instance where there are others before it.
fn called((name, instance): &(String, u8)) -> String {
    match instance {
        0 => name.clone(),
        n => format!("{name}:{n}"),
    }
}
