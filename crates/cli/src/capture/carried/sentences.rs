//! Sentences, as instruments send them: `$`, what it is, numbers between commas, `*` and a checksum.

use super::{Made, SHOWN, behind_time, write_cells};

/// Sentences of VectorNav's sensors that have rates (its manuals' registers of measurements): what they are, and what is in
/// them. Accelerations without gravity are none of an accelerometer.
const KNOWN: [(&str, &[&str]); 7] = [
    ("VNYMR", &["Yaw,Pitch,Roll", MAG, ACC, GYRO]),
    ("VNQMR", &["Quat0,Quat1,Quat2,Quat3", MAG, ACC, GYRO]),
    ("VNMAR", &[MAG, ACC, GYRO]),
    ("VNGYR", &[GYRO]),
    ("VNIMU", &[MAG, ACC, GYRO, "Temp [degC],Pressure"]),
    ("VNYBA", &["Yaw,Pitch,Roll", MOTION, GYRO]),
    ("VNYIA", &["Yaw,Pitch,Roll", MOTION, GYRO]),
];
const MAG: &str = "MagX,MagY,MagZ";
const ACC: &str = "AccelX [m/s2],AccelY [m/s2],AccelZ [m/s2]";
const GYRO: &str = "GyroX [rad/s],GyroY [rad/s],GyroZ [rad/s]";
const MOTION: &str = "TrueNorth,TrueEast,TrueDown";

/// Sentences of one kind.
pub(super) struct Sentences {
    pub tag: &'static str,
    pub names: Vec<String>,
    has_time: bool,
}

impl Sentences {
    /// The kind of which most lines are, of those with rates.
    pub fn of(lines: &[&str]) -> Option<Self> {
        let count = |tag: &str| lines.iter().filter(|line| is_of(line, tag)).count();
        let (tag, parts) = (KNOWN.iter()).max_by_key(|(tag, parts)| (count(tag), parts.len()))?;
        let of: Vec<&&str> = lines.iter().filter(|line| is_of(line, tag)).collect();
        if of.len() < SHOWN {
            return None;
        }
        let has_time = of.iter().all(|line| behind_time(line).0.is_some());
        let names = parts.iter().flat_map(|part| part.split(','));
        let time = has_time.then_some("time").into_iter();
        Some(Self {
            tag,
            names: time.chain(names).map(str::to_owned).collect(),
            has_time,
        })
    }

    pub fn row(&self, line: &str, row: &mut String) -> Made {
        if !is_of(line, self.tag) {
            return Made::Other;
        }
        let (time, sentence) = behind_time(line);
        let time = time.filter(|_| self.has_time);
        let Some(body) = checked(sentence) else {
            row.push_str(time.unwrap_or_default());
            return Made::Damaged;
        };
        let cells = time
            .into_iter()
            .chain(body.split(',').skip(1).map(str::trim));
        if cells.clone().count() != self.names.len() {
            row.push_str(time.unwrap_or_default());
            return Made::Damaged;
        }
        write_cells(cells, row);
        Made::Row
    }
}

/// Whether a line has such a sentence, at its begin or behind a time.
fn is_of(line: &str, tag: &str) -> bool {
    let sentence = line.find('$').map(|at| &line[at + 1..]);
    let sentence = sentence.and_then(|sentence| sentence.strip_prefix(tag));
    sentence.is_some_and(|rest| rest.starts_with(','))
}

/// What is between `$` and `*`, where the checksum behind it is that of it: two digits are the XOR of all bytes, four
/// their CRC (CCITT, from 0 on).
fn checked(sentence: &str) -> Option<&str> {
    let (body, sum) = sentence.strip_prefix('$')?.split_once('*')?;
    let sum = sum.trim();
    let stated = u16::from_str_radix(sum, 16).ok()?;
    let own = match sum.len() {
        2 => u16::from(body.bytes().fold(0, |all, byte| all ^ byte)),
        4 => body.bytes().fold(0, crc_of),
        _ => return None,
    };
    (own == stated).then_some(body)
}

fn crc_of(crc: u16, byte: u8) -> u16 {
    (0..8).fold(crc ^ u16::from(byte) << 8, |crc, _| {
        let shifted = crc << 1;
        if crc & 0x8000 == 0 {
            shifted
        } else {
            shifted ^ 0x1021
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_checksum_is_that_of_its_sentence() {
        // The check value of this CRC for "123456789" is published: 0x31C3.
        assert_eq!("123456789".bytes().fold(0, crc_of), 0x31c3);
        assert_eq!(checked("$AB*03"), Some("AB"));
        assert_eq!(checked("$123456789*31C3"), Some("123456789"));
        for text in ["$AB*04", "$AB", "$AB*", "AB*03", "$AB*003", "$AB*zz"] {
            assert_eq!(checked(text), None, "{text}");
        }
    }
}
