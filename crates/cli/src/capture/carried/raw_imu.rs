//! Raw readings of an IMU as NovAtel's receivers log them in text: `%RAWIMUSA,week,s;week,s,status,z,-y,x,...*CRC`.
//!
//! A reading is an increment of a velocity or an angle over one sample of the IMU, in counts. What a count is depends on the
//! type of the IMU, which only the extended logs carry.

use super::{Made, SHOWN, write_cells};

/// The logs, and whether they are extended (status of the IMU and its type stand before the week).
const LOGS: [(&str, bool); 4] = [
    ("RAWIMUSXA", true),
    ("RAWIMUXA", true),
    ("RAWIMUSA", false),
    ("RAWIMUA", false),
];
/// Seconds of a week.
const WEEK_S: f64 = 604_800.0;
/// Bits of the IMU's info: it has an error; the readings are encrypted.
const UNREADABLE: u8 = 0b11;
/// A foot, m.
const FOOT: f64 = 0.3048;
/// A second of arc, rad.
const ARCSEC: f64 = std::f64::consts::PI / 180.0 / 3600.0;
/// A degree, rad.
const DEG: f64 = std::f64::consts::PI / 180.0;
/// A thousandth of the standard gravity, m/s^2.
const MG: f64 = 9.806_65e-3;
/// 2^-33 and the like.
const fn power(n: u32) -> f64 {
    1.0 / (1_u64 << n) as f64
}
/// Types of IMU: number, name, a count as an angle in rad and as a velocity in m/s, and samples a second. Scales: NovAtel's own
/// driver for ROS (`novatel_oem7_driver`, `getImuRawScaleFactors`), which takes them from the OEM7 manual, RAWIMUSX. Rates: that
/// page. Types 11 and 41 are checked by the gravity in published logs, in the test below; the others by nothing but `scale`.
const TYPES: [(u8, &str, f64, f64, f64); 11] = [
    (8, "LN200", power(19), power(14), 200.0),
    (11, "HG1700-AG58", power(33), FOOT * power(27), 100.0),
    (12, "HG1700-AG62", power(33), FOOT * power(26), 100.0),
    (13, "FSAS", 0.1 * ARCSEC * power(8), 0.05 * power(15), 200.0),
    (26, "ISA-100C", 1e-9, 2e-8, 200.0),
    (
        31,
        "ADIS16488",
        720.0 * DEG * power(31),
        200.0 * power(31),
        200.0,
    ),
    (32, "STIM300", DEG * power(21), power(22), 125.0),
    // Its scales are those of rates.
    (
        41,
        "EG320N",
        0.008 * DEG * power(16) / 125.0,
        0.2 * MG * power(16) / 125.0,
        125.0,
    ),
    (58, "HG4930", power(33), power(29), 100.0),
    (68, "HG4930-AN04", power(33), power(29), 100.0),
    (69, "HG4930-AN04", power(33), power(29), 400.0),
];
/// Part by which the rate of the rows may differ from that of the type.
const SAME_RATE: f64 = 0.02;
/// What accelerometers at rest read by the right scale, m/s^2: gravity, with the bias and scale error of a poor one.
const GRAVITY: std::ops::RangeInclusive<f64> = 9.0..=10.6;

/// What the columns are called; `say` knows them by the first words.
pub(in crate::capture) const GYRO: &str = "RAWIMU gyro";
const ACC: &str = "RAWIMU acc";
/// What becomes of rows that are damaged, and which other ones are without readings.
pub(super) const OF_DAMAGE: &str = " (they are a gap), or which tell of an error of the IMU or are encrypted (they have no readings)";

/// Rows of one such log.
pub(super) struct RawImu {
    pub tag: &'static str,
    pub names: Vec<String>,
    /// Units of the columns.
    pub units: Vec<Option<String>>,
    /// What is to be told of the scale.
    pub told: String,
    is_extended: bool,
}

impl RawImu {
    pub fn of(lines: &[&str]) -> Option<Self> {
        let count = |tag: &str| {
            lines
                .iter()
                .filter(|line| body(line, tag).is_some())
                .count()
        };
        let most = LOGS.iter().rev().max_by_key(|(tag, _)| count(tag));
        let (tag, is_extended) = *most.filter(|(tag, _)| count(tag) >= SHOWN)?;
        let rows: Vec<Row> = (lines.iter())
            .filter_map(|line| row(checked(body(line, tag)?)?, is_extended))
            .collect();
        let scale = scale(&rows);
        let told = match &scale {
            Ok((name, ..)) => format!("the IMU is of type {name}, whose scale is taken"),
            Err(why) => format!("the scale is not known: {why}"),
        };
        let axes = |stem: &str| ["x", "y", "z"].map(|axis| format!("{stem} {axis}"));
        let scale = scale.ok();
        let unit =
            |size: Option<f64>, unit: &str| vec![size.map(|size| format!("{size}{unit}")); 3];
        Some(Self {
            tag,
            names: [
                vec!["time [s]".to_owned()],
                axes(GYRO).into(),
                axes(ACC).into(),
            ]
            .concat(),
            units: [
                vec![None],
                unit(scale.map(|(_, gyro, _)| gyro), "rad/s"),
                unit(scale.map(|(_, _, acc)| acc), "m/s2"),
            ]
            .concat(),
            told,
            is_extended,
        })
    }

    pub fn row(&self, line: &str, into: &mut String) -> Made {
        let Some(body) = body(line, self.tag) else {
            return Made::Other;
        };
        match checked(body).and_then(|body| row(body, self.is_extended)) {
            Some(row) => {
                let time = format!("{:.9}", row.time_s);
                if !row.is_readable {
                    into.push_str(&time);
                    return Made::Damaged;
                }
                let cells = row.gyro.iter().chain(&row.acc).map(String::as_str);
                write_cells([time.as_str()].into_iter().chain(cells), into);
                Made::Row
            }
            // Nor is its time believed.
            None => Made::Damaged,
        }
    }
}

/// The name of the type, and what a count is in rad/s and m/s^2; else why that is not known.
fn scale(rows: &[Row]) -> Result<(&'static str, f64, f64), String> {
    let own = rows.first().and_then(|row| row.imu);
    let Some(own) = own.filter(|own| rows.iter().all(|row| row.imu == Some(*own))) else {
        return Err("the log does not carry the type of the IMU".to_owned());
    };
    let known = TYPES.iter().find(|(number, ..)| *number == own);
    let Some((_, name, angle, velocity, rate_hz)) = known else {
        return Err(format!("type {own} of the IMU is not known here"));
    };
    let mut steps: Vec<f64> = rows
        .windows(2)
        .map(|pair| pair[1].time_s - pair[0].time_s)
        .collect();
    steps.sort_by(f64::total_cmp);
    let rate = steps
        .get(steps.len() / 2)
        .map_or(f64::NAN, |step| 1.0 / step);
    let is_same = (rate / rate_hz - 1.0).abs() < SAME_RATE;
    if !is_same {
        return Err(format!(
            "type {own} ({name}) has {rate_hz} samples a second, the rows {rate:.1}"
        ));
    }
    let acc = velocity * rate_hz;
    let of = |row: &Row| {
        let square = |cell: &String| cell.parse::<f64>().map_or(0.0, |own| (acc * own).powi(2));
        row.acc.iter().map(square).sum::<f64>().sqrt()
    };
    let mean = rows.iter().map(of).sum::<f64>() / rows.len() as f64;
    if !GRAVITY.contains(&mean) {
        return Err(format!(
            "by type {own} ({name}) the accelerometers would read {mean:.3} m/s^2 together"
        ));
    }
    Ok((name, angle * rate_hz, acc))
}

/// What is between the mark and the end of a line that is such a log.
fn body<'a>(line: &'a str, tag: &str) -> Option<&'a str> {
    let own = line.strip_prefix(['%', '#'])?;
    own.strip_prefix(tag)?.starts_with(',').then_some(own)
}

/// What is before `*`, where the CRC behind it is that of it.
fn checked(body: &str) -> Option<&str> {
    let (body, sum) = body.split_once('*')?;
    let stated = u32::from_str_radix(sum.trim(), 16).ok()?;
    (body.bytes().fold(0, crc_of) == stated).then_some(body)
}

/// NovAtel's CRC: that of Ethernet, from 0 on and not inverted.
fn crc_of(crc: u32, byte: u8) -> u32 {
    (0..8).fold(crc ^ u32::from(byte), |crc, _| {
        let shifted = crc >> 1;
        if crc & 1 == 0 {
            shifted
        } else {
            shifted ^ 0xedb8_8320
        }
    })
}

struct Row {
    imu: Option<u8>,
    is_readable: bool,
    time_s: f64,
    gyro: [String; 3],
    acc: [String; 3],
}

/// The fields behind the header: info and type where it is extended, week, seconds, status, velocities, angles.
fn row(body: &str, is_extended: bool) -> Option<Row> {
    let (_, fields) = body.split_once(';')?;
    let cells: Vec<&str> = fields.split(',').map(str::trim).collect();
    let (before, cells) = cells.split_at_checked(if is_extended { 2 } else { 0 })?;
    let [week, seconds, _status, readings @ ..] = cells else {
        return None;
    };
    let [vz, vy, vx, az, ay, ax] = readings else {
        return None;
    };
    readings
        .iter()
        .all(|cell| cell.parse::<i64>().is_ok())
        .then_some(())?;
    let info = before
        .first()
        .map_or(Some(0), |info| u8::from_str_radix(info, 16).ok())?;
    Some(Row {
        imu: before.get(1).and_then(|imu| imu.parse().ok()),
        is_readable: info & UNREADABLE == 0,
        time_s: week.parse::<f64>().ok()? * WEEK_S + seconds.parse::<f64>().ok()?,
        // The logs hold the y axis turned round.
        gyro: [(*ax).to_owned(), turned(ay), (*az).to_owned()],
        acc: [(*vx).to_owned(), turned(vy), (*vz).to_owned()],
    })
}

/// A whole number with the other sign.
fn turned(cell: &str) -> String {
    cell.strip_prefix('-').map_or_else(
        || format!("-{}", cell.trim_start_matches('+')),
        str::to_owned,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_examples_of_the_manual_and_of_others_have_their_checksums_and_gravity() {
        // RAWIMUSX of the OEM7 manual, and a log of an HG1700: gravity by their types shows the scale and its rate.
        for (line, tag, gravity) in [
            (
                "%RAWIMUSXA,2209,491674.014;04,41,2209,491674.013699,ea59fe00,329308016,-2706935,4508389,196192,417138,-1000837*038422a7",
                "RAWIMUSXA",
                9.8554,
            ),
            (
                "%RAWIMUSXA,1692,484620.664;00,11,1692,484620.664389000,00801503,43110635,-817242,-202184,-215194,-41188,-9895*a5db8c7b",
                "RAWIMUSXA",
                9.7902,
            ),
        ] {
            let own = row(
                checked(body(line, tag).expect("a log")).expect("its sum"),
                true,
            )
            .expect("a row");
            let of = TYPES
                .iter()
                .find(|of| Some(of.0) == own.imu)
                .expect("a type");
            let z: f64 = own.acc[2].parse().expect("a number");
            assert!(
                (z * of.3 * of.4 / gravity - 1.0).abs() < 1e-3,
                "{} {}",
                of.1,
                z * of.3 * of.4
            );
            assert!(
                checked(&line.replace("4508389", "4508388").replace("9895", "9894")[1..]).is_none()
            );
        }
        assert_eq!(
            (turned("-5"), turned("5")),
            ("5".to_owned(), "-5".to_owned())
        );
    }
}
