//! Units that a column's name says: in brackets, at its end, or by what those who write such names deliver.

use model::record::Quantity;

use super::units::{What, at_the_end, in_brackets, is_unit_of};

/// Parts of names whose writers have one unit for them, by their definitions.
const WRITERS: [(&str, &str); 8] = [
    // sensor_msgs/Imu, which is in SI (REP 103), however its fields are written out.
    ("angular_velocity", "rad/s"),
    ("linear_acceleration", "m/s2"),
    ("field.header.stamp", "ns"),
    // PX4's sensor_combined and vehicle_imu, as ulog2csv writes them.
    ("gyro_rad", "rad/s"),
    ("accelerometer_m_s2", "m/s2"),
    // The time of a logger for phones.
    ("seconds_elapsed", "s"),
    // EuRoC's rates and accelerations of the sensor in its own frame.
    ("w_rs_s", "rad/s"),
    ("a_rs_s", "m/s2"),
];

/// The time of ArduPilot's logs.
pub(super) const DATAFLASH: &str = "TimeUS";

/// Columns by which a file's writer is known, and the units of others in it.
const FILES: [(&str, &str, &str); 16] = [
    // `rostopic echo -p` stamps in nanoseconds.
    ("field.angular_velocity.x", "time", "ns"),
    ("gyro_rad[0]", "timestamp", "us"),
    ("gyro_rad[0]", "timestamp_sample", "us"),
    // ArduPilot's message IMU, as mavlogdump writes it.
    (DATAFLASH, "gyrx", "rad/s"),
    (DATAFLASH, "gyry", "rad/s"),
    (DATAFLASH, "gyrz", "rad/s"),
    (DATAFLASH, "accx", "m/s2"),
    (DATAFLASH, "accy", "m/s2"),
    (DATAFLASH, "accz", "m/s2"),
    (DATAFLASH, "t", "degC"),
    // OpenLog Artemis: what its library for the ICM-20948 delivers.
    ("rtcTime", "gx", "deg/s"),
    ("rtcTime", "gy", "deg/s"),
    ("rtcTime", "gz", "deg/s"),
    ("rtcTime", "ax", "mg"),
    ("rtcTime", "ay", "mg"),
    ("rtcTime", "az", "mg"),
];

/// The unit that a column's name says of what it is mapped to, beside the other columns of its file.
pub(super) fn unit_of(name: &str, what: What, names: &[String]) -> Option<&'static str> {
    let said = in_brackets(name).1.or_else(|| at_the_end(name, what));
    said.or_else(|| {
        let small = name.to_lowercase();
        let by_name = WRITERS
            .iter()
            .find(|(part, unit)| small.contains(part) && is_unit_of(unit, what));
        let by_name = by_name.map(|(_, unit)| *unit);
        by_name.or_else(|| {
            let is_there = |mark: &str| names.iter().any(|name| name.eq_ignore_ascii_case(mark));
            let by_file = FILES.iter().find(|(mark, own, unit)| {
                small == *own && is_unit_of(unit, what) && is_there(mark)
            });
            // Systems of phones deliver rad/s, and the logger that names its seconds so leaves it at that.
            let is_phone = what == What::Channel(Quantity::Gyro) && is_there("seconds_elapsed");
            by_file
                .map(|(_, _, unit)| *unit)
                .or(is_phone.then_some("rad/s"))
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_writes_a_name_says_its_unit() {
        let gyro = What::Channel(Quantity::Gyro);
        let acc = What::Channel(Quantity::Acc);
        let none: [&str; 0] = [];
        let ros = ["field.angular_velocity.x"];
        for (name, what, names, unit) in [
            ("field.angular_velocity.x", gyro, &none[..], Some("rad/s")),
            ("angular_velocity_z", gyro, &none, Some("rad/s")),
            ("linear_acceleration.x", acc, &none, Some("m/s2")),
            ("gyro_rad[0]", gyro, &none, Some("rad/s")),
            ("accelerometer_m_s2[2]", acc, &none, Some("m/s2")),
            ("w_RS_S_x", gyro, &none, Some("rad/s")),
            ("time", What::Time, &ros, Some("ns")),
            ("field.header.stamp", What::Time, &ros, Some("ns")),
            ("timestamp", What::Time, &["gyro_rad[0]"], Some("us")),
            ("x", gyro, &["seconds_elapsed"], Some("rad/s")),
            ("GyrX", gyro, &["TimeUS"], Some("rad/s")),
            ("AccZ", acc, &["TimeUS"], Some("m/s2")),
            ("gX", gyro, &["rtcTime"], Some("deg/s")),
            ("aZ", acc, &["rtcTime"], Some("mg")),
            ("GyrX", gyro, &none, None),
            // What a name does not say nobody knows.
            ("time", What::Time, &none, None),
            ("timestamp", What::Time, &none, None),
            ("x", gyro, &none, None),
            ("gx", gyro, &ros, None),
            ("angular_velocity_deg_s", gyro, &none, Some("deg/s")),
        ] {
            let names: Vec<String> = names.iter().map(|n| (*n).to_owned()).collect();
            assert_eq!(unit_of(name, what, &names), unit, "{name}");
        }
    }
}
