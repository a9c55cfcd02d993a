//! `sensor_msgs/Imu` and `sensor_msgs/Temperature` as ROS 1 and ROS 2 serialize them, collected by topic. Rates are in
//! rad/s, accelerations in m/s^2 and temperatures in degC by their definitions (REP 103).

use std::collections::BTreeMap;

use super::super::table::Table;
use super::super::unpack::unpack_zstd_up_to;
use super::{Bytes, LogError, held, since_first};

/// How a frame of Zstandard begins.
const ZSTD: [u8; 4] = [0x28, 0xb5, 0x2f, 0xfd];
/// Bytes of a message, unpacked: what is read of it, and the longest name of a frame that anybody gives.
const LONGEST_MESSAGE: u64 = 1 << 12;

/// How a message is written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Encoding {
    /// ROS 1: packed, little-endian.
    Ros1,
    /// ROS 2: CDR, whose first four bytes say its order and alignment.
    Cdr,
}

/// What a topic carries that is read here.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Kind {
    Imu(Encoding),
    Temperature(Encoding),
    Other,
}

impl Kind {
    /// By the name of the message's type and of its encoding.
    pub fn of(message: &str, encoding: &str) -> Self {
        let encoding = match encoding {
            "ros1" => Encoding::Ros1,
            "cdr" => Encoding::Cdr,
            _ => return Kind::Other,
        };
        match message {
            "sensor_msgs/Imu" | "sensor_msgs/msg/Imu" => Kind::Imu(encoding),
            "sensor_msgs/Temperature" | "sensor_msgs/msg/Temperature" => {
                Kind::Temperature(encoding)
            }
            _ => Kind::Other,
        }
    }

    fn is_cdr(self) -> bool {
        matches!(
            self,
            Kind::Imu(Encoding::Cdr) | Kind::Temperature(Encoding::Cdr)
        )
    }
}

/// A topic as far as it was read.
struct Topic {
    message: String,
    kind: Kind,
    messages: usize,
    /// Time of each message, ns: the sensor's, by its header.
    stamps: Vec<i64>,
    /// Time at which each was recorded, ns.
    recorded: Vec<i64>,
    /// Numbers of each message: six of an IMU, one of a temperature.
    values: Vec<Vec<f64>>,
}

/// Topics by name.
#[derive(Default)]
pub(super) struct Topics {
    by_name: BTreeMap<String, Topic>,
    /// Messages that are not what their type says.
    pub broken: usize,
}

impl Topics {
    /// Makes a topic known.
    pub fn add(&mut self, name: &str, message: &str, kind: Kind) {
        self.by_name
            .entry(name.to_owned())
            .or_insert_with(|| Topic {
                message: message.to_owned(),
                kind,
                messages: 0,
                stamps: Vec::new(),
                recorded: Vec::new(),
                values: Vec::new(),
            });
    }

    /// Takes a message of a topic, recorded at a time in ns.
    pub fn take(&mut self, name: &str, recorded: i64, data: &[u8]) {
        let Some(topic) = self.by_name.get_mut(name) else {
            return;
        };
        topic.messages += 1;
        // rosbag2 with `compression_mode: message` packs each; CDR begins with 0.
        let is_packed = topic.kind.is_cdr() && data.starts_with(&ZSTD);
        let unpacked = is_packed.then(|| unpack_zstd_up_to(data, LONGEST_MESSAGE));
        let data = match &unpacked {
            Some(Ok(unpacked)) => unpacked,
            _ => data,
        };
        let (read, width) = match topic.kind {
            Kind::Imu(encoding) => (imu(data, encoding), 6),
            Kind::Temperature(encoding) => (temperature(data, encoding), 1),
            Kind::Other => return,
        };
        let Some((stamp, values)) = read else {
            self.broken += 1;
            return;
        };
        topic.stamps.push(stamp);
        topic.recorded.push(recorded);
        topic.values.resize(width, Vec::new());
        for (column, value) in topic.values.iter_mut().zip(values) {
            column.push(value);
        }
    }

    /// The columns of the IMU that is asked for, or of the only one, with the temperature where one topic has it.
    pub fn table(self, wanted: Option<&str>) -> Result<Table, LogError> {
        let show = |(name, topic): (&String, &Topic)| {
            format!("{name} ({}, {} messages)", topic.message, topic.messages)
        };
        let all = || self.by_name.iter().filter(|(_, t)| t.messages > 0);
        let is_imu =
            |(_, t): &(&String, &Topic)| !t.stamps.is_empty() && matches!(t.kind, Kind::Imu(_));
        let imus: Vec<(&String, &Topic)> = all().filter(is_imu).collect();
        let names = || imus.iter().map(|(n, t)| show((n, t))).collect();
        let chosen = match (wanted, imus.as_slice()) {
            (_, []) => return Err(LogError::NoImu(all().map(show).collect())),
            (Some(wanted), _) => (imus.iter())
                .find(|(name, _)| name.as_str() == wanted)
                .ok_or_else(|| LogError::Which {
                    why: format!("no IMU in it has the topic `{wanted}`; there is"),
                    topics: names(),
                })?,
            (None, [only]) => only,
            (None, _) => {
                return Err(LogError::Which {
                    why: format!("it holds {} IMUs", imus.len()),
                    topics: names(),
                });
            }
        };
        let (name, topic) = *chosen;
        let mut table = columns(topic);
        table.notes.push(format!(
            "topic {name}, {}: rates in rad/s and accelerations in m/s^2 by its definition",
            topic.message
        ));
        let thermometers: Vec<_> = all()
            .filter(|(_, t)| !t.stamps.is_empty() && matches!(t.kind, Kind::Temperature(_)))
            .collect();
        if let [(name, thermometer)] = thermometers[..] {
            let mut order: Vec<usize> = (0..thermometer.stamps.len()).collect();
            order.sort_by_key(|i| thermometer.stamps[*i]);
            let times: Vec<i64> = order.iter().map(|i| thermometer.stamps[*i]).collect();
            let values: Vec<f64> = order.iter().map(|i| thermometer.values[0][*i]).collect();
            table.add("temp", "degC", held(&times, &values, &topic.stamps));
            table.notes.push(format!(
                "temp is that of topic {name}, the last reading before each row"
            ));
        }
        if self.broken > 0 {
            table.notes.push(format!(
                "messages that are not what their type says and are left out: {}",
                self.broken
            ));
        }
        Ok(table)
    }
}

fn columns(topic: &Topic) -> Table {
    let mut table = Table::default();
    // A driver that does not stamp leaves all at one value.
    let is_stamped = topic.stamps.windows(2).any(|t| t[0] != t[1]);
    let stamps = if is_stamped {
        &topic.stamps
    } else {
        table.notes.push(
            "the messages have no stamps of their own: times are those of the recording".to_owned(),
        );
        &topic.recorded
    };
    table.add("time", "s", since_first(stamps, 1e-9));
    let names = ["gyro_x", "gyro_y", "gyro_z", "acc_x", "acc_y", "acc_z"];
    for (k, (name, values)) in names.iter().zip(&topic.values).enumerate() {
        let unit = if k < 3 { "rad/s" } else { "m/s^2" };
        if !values.iter().all(|v| v.is_nan()) {
            table.add(name, unit, values.clone());
        }
    }
    table
}

/// Stamp in ns, and what follows the header; the order of numbers and their alignment.
fn header(data: &[u8], encoding: Encoding) -> Option<(i64, Bytes<'_>, usize)> {
    match encoding {
        Encoding::Ros1 => {
            let mut bytes = Bytes::new(data);
            bytes.u32()?; // sequence number
            let (secs, nanos) = (bytes.u32()?, bytes.u32()?);
            bytes.counted()?;
            let stamp = i64::from(secs) * 1_000_000_000 + i64::from(nanos);
            Some((stamp, bytes, 1))
        }
        Encoding::Cdr => {
            // RTPS 2.3, 10.2: representation and options; an odd one is little-endian. From 6 on it is XCDR 2, which aligns
            // to 4 bytes at most.
            let (start, rest) = data.split_at_checked(4)?;
            let representation = u16::from_be_bytes([start[0], start[1]]);
            let align = match representation {
                0 | 1 => 8,
                6 | 7 => 4,
                _ => return None,
            };
            let mut bytes = Bytes::new(rest).with_order(representation % 2 == 0);
            let (secs, nanos) = (bytes.i32()?, bytes.u32()?);
            bytes.counted()?;
            let stamp = i64::from(secs) * 1_000_000_000 + i64::from(nanos);
            Some((stamp, bytes, align))
        }
    }
}

/// Stamp, rates about x, y, z and accelerations along them, NaN where the covariance begins with -1: "no data".
fn imu(data: &[u8], encoding: Encoding) -> Option<(i64, Vec<f64>)> {
    let (stamp, mut bytes, align) = header(data, encoding)?;
    bytes.align(align)?;
    let mut numbers = |count: usize| {
        (0..count)
            .map(|_| bytes.f64())
            .collect::<Option<Vec<f64>>>()
    };
    numbers(4 + 9)?; // orientation
    let mut six = Vec::with_capacity(6);
    for _ in 0..2 {
        let vector = numbers(3)?;
        let covariance = numbers(9)?;
        let is_missing = covariance[0] == -1.0;
        six.extend(vector.iter().map(|v| {
            if is_missing || v.is_infinite() {
                f64::NAN
            } else {
                *v
            }
        }));
    }
    Some((stamp, six))
}

fn temperature(data: &[u8], encoding: Encoding) -> Option<(i64, Vec<f64>)> {
    let (stamp, mut bytes, align) = header(data, encoding)?;
    bytes.align(align)?;
    let value = bytes.f64()?;
    Some((
        stamp,
        vec![if value.is_finite() { value } else { f64::NAN }],
    ))
}
