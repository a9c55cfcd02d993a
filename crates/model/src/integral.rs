//! What readings become once a navigation integrates them.

/// Name and unit of the integral of readings of a unit over time: deg/s are an angle in deg, what is no change by the second is an
/// acceleration, whose integral is a velocity (m/s^2: m/s).
#[must_use]
pub fn of(unit: &str) -> (&'static str, String) {
    match (unit, unit.strip_suffix("/s")) {
        ("m/s^2", _) => ("velocity", "m/s".to_owned()),
        (_, Some(angle)) => ("angle", angle.to_owned()),
        (other, None) => ("velocity", format!("{other}*s")),
    }
}

/// What readings of a unit are of: a rate, or an acceleration.
#[must_use]
pub fn reading(unit: &str) -> &'static str {
    match of(unit).0 {
        "angle" => "rate",
        _ => "acceleration",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rate_is_an_angle_and_an_acceleration_a_velocity() {
        let of = |unit| {
            let (name, integral) = of(unit);
            (reading(unit), name, integral)
        };
        assert_eq!(of("deg/s"), ("rate", "angle", "deg".to_owned()));
        assert_eq!(of("m/s^2"), ("acceleration", "velocity", "m/s".to_owned()));
        assert_eq!(of("g"), ("acceleration", "velocity", "g*s".to_owned()));
    }
}
