//! The calibration sequences of `imu-stand board calibrate`: what each varies, and so which causes it tells apart.

/// What a sequence varies, and what it leaves as it is: what tells two causes apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sequence {
    /// As `board calibrate` calls it.
    pub name: &'static str,
    /// What a person does.
    pub what: &'static str,
    /// Causes whose sizes it tells.
    pub tells: &'static [&'static str],
    /// Causes that move with these all the while, and are not told from them.
    pub confounds: &'static [&'static str],
    /// What it cannot tell.
    pub cannot: &'static [&'static str],
}

/// All of them.
pub const SEQUENCES: [Sequence; 3] = [
    Sequence {
        name: "six-position",
        what: "the stand on each of its six sides",
        tells: &["g_sensitivity"],
        confounds: &[],
        cannot: &[
            "angles between the accelerometers: six sides that lie about right leave them open",
            "the Earth's rotation (up to 0.0042 deg/s) turns with the stand: so much of each g-sensitivity may be its",
            "g-sensitivity to vibration: the gyro's filter takes a part of what is fast",
        ],
    },
    Sequence {
        name: "turns",
        what: "the table turned both ways by the motor, on a stand that is tilted where the scale is wanted",
        tells: &["cross_axis", "scale_error"],
        confounds: &["motor_bias", "supply_sensitivity"],
        cannot: &[
            "what the gyros about x and y feel of each other, and their scale: the table turns about z alone",
            "cross axis and what the motor's current does to a gyro go together: the same turns with the belt off \
             (`capture --shape steps`) tell them apart",
        ],
    },
    Sequence {
        name: "heater",
        what: "the board warmed and cooled again, at rest",
        tells: &["temperature", "temperature_quadratic"],
        confounds: &[],
        cannot: &[
            "what follows the temperature of another place than the gyro's own thermometer, or follows it late",
        ],
    },
];

/// The sequence that tells `cause` from `rival`, if there is one: it moves the one and not the other.
#[must_use]
pub fn tells_apart(cause: &str, rival: &str) -> Option<&'static Sequence> {
    SEQUENCES.iter().find(|sequence| {
        let moves =
            |cause: &str| sequence.tells.contains(&cause) || sequence.confounds.contains(&cause);
        let told = |cause: &str| sequence.tells.contains(&cause);
        (told(cause) && !moves(rival)) || (told(rival) && !moves(cause))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sequence_tells_apart_what_it_moves_from_what_it_does_not() {
        let name = |a, b| tells_apart(a, b).map(|s| s.name);
        assert_eq!(name("temperature", "rate_ramp"), Some("heater"));
        assert_eq!(name("rate_ramp", "temperature"), Some("heater"));
        assert_eq!(name("g_sensitivity", "temperature"), Some("six-position"));
        assert_eq!(
            name("cross_axis", "motor_bias"),
            None,
            "the motor turns for both"
        );
        assert_eq!(name("temperature", "temperature_quadratic"), None);
        assert_eq!(name("flicker", "rate_ramp"), None);
    }

    #[test]
    fn every_cause_of_a_sequence_is_one() {
        for cause in SEQUENCES
            .iter()
            .flat_map(|s| s.tells.iter().chain(s.confounds))
        {
            assert!(model::effects::effect(cause).is_some(), "{cause}");
        }
    }
}
