//! Lines of the AHRS firmware for SparkFun's Razor boards, `#A-R=-12.00,3.00,250.00`: a sensor a line, and no comment.

use std::borrow::Cow;

/// How its lines begin, and what is in them: readings as the sensors deliver them (R), and with the board's calibration (C),
/// which are counts as well (the firmware's list of its commands, `#osrt`, `#osct`).
const LINES: [(&str, &str); 6] = [
    ("#A-R=", "Razor acc = "),
    ("#M-R=", "Razor mag = "),
    ("#G-R=", "Razor gyro = "),
    ("#A-C=", "Razor acc calibrated = "),
    ("#M-C=", "Razor mag calibrated = "),
    ("#G-C=", "Razor gyro calibrated = "),
];
/// How the names of its gyros begin.
pub(in crate::capture) const GYRO: &str = "Razor gyro";

/// A line of it as readings behind their name; any other as it is.
pub(super) fn unmarked(line: &str) -> Cow<'_, str> {
    let own = |(mark, name): &(&str, &str)| Some(format!("{name}{}", line.strip_prefix(mark)?));
    let own = line.starts_with('#').then(|| LINES.iter().find_map(own));
    own.flatten().map_or(Cow::Borrowed(line), Cow::Owned)
}
