//! From the unit of a channel to the units of a report. Nothing else converts.
//!
//! Computation is in the channel's own unit U and seconds; the letters are those of IEEE Std 952.

use model::record::Quantity;

/// Unit and factor of one reported quantity.
#[derive(Clone, Debug, PartialEq)]
pub struct Scale {
    /// Reported = computed · factor.
    pub factor: f64,
    /// Unit of the reported number.
    pub unit: String,
}

/// Units of everything that is reported for a channel.
#[derive(Clone, Debug, PartialEq)]
pub struct Units {
    /// Readings and deviations, U.
    pub reading: Scale,
    /// N, U·√s.
    pub angle_random_walk: Scale,
    /// B, U.
    pub bias_instability: Scale,
    /// K, U/√s.
    pub rate_random_walk: Scale,
    /// R, U/s.
    pub rate_ramp: Scale,
    /// Q, U·s.
    pub quantization_noise: Scale,
    /// Integral of the channel, U·s.
    pub integral: Scale,
    /// The time deviation and its kin, U·s.
    pub time_deviation: Scale,
}

impl Units {
    /// For a channel of that quantity and unit. Gyros in deg/s or rad/s report deg/s, deg/sqrt(h), deg/h,
    /// deg/s/sqrt(s), deg/s^2 and deg; accelerometers in m/s^2 or g report m/s^2, m/s/sqrt(h), m/s^2,
    /// m/s^2/sqrt(s), m/s^3 and m/s; anything else keeps its unit and seconds, and a ratio (unit 1) has sqrt(s), 1/sqrt(s),
    /// 1/s and s.
    #[must_use]
    pub fn of(quantity: Quantity, unit: &str) -> Self {
        let scale = |factor: f64, unit: &str| Scale {
            factor,
            unit: unit.to_owned(),
        };
        let squashed: String = unit.chars().filter(|c| !c.is_whitespace()).collect();
        let rate = match (quantity, squashed.as_str()) {
            (Quantity::Gyro, "deg/s" | "dps" | "°/s") => Some(1.0),
            (Quantity::Gyro, "rad/s") => Some(180.0 / std::f64::consts::PI),
            _ => None,
        };
        if let Some(to_deg) = rate {
            return Self {
                reading: scale(to_deg, "deg/s"),
                angle_random_walk: scale(60.0 * to_deg, "deg/sqrt(h)"),
                bias_instability: scale(3600.0 * to_deg, "deg/h"),
                rate_random_walk: scale(to_deg, "deg/s/sqrt(s)"),
                rate_ramp: scale(to_deg, "deg/s^2"),
                quantization_noise: scale(to_deg, "deg"),
                integral: scale(to_deg, "deg"),
                time_deviation: scale(to_deg, "deg"),
            };
        }
        let force = match (quantity, squashed.as_str()) {
            (Quantity::Acc, "m/s^2" | "m/s2" | "m/s²") => Some(1.0),
            (Quantity::Acc, "g") => Some(9.80665),
            _ => None,
        };
        if let Some(to_si) = force {
            return Self {
                reading: scale(to_si, "m/s^2"),
                angle_random_walk: scale(60.0 * to_si, "m/s/sqrt(h)"),
                bias_instability: scale(to_si, "m/s^2"),
                rate_random_walk: scale(to_si, "m/s^2/sqrt(s)"),
                rate_ramp: scale(to_si, "m/s^3"),
                quantization_noise: scale(to_si, "m/s"),
                integral: scale(to_si, "m/s"),
                time_deviation: scale(to_si, "m/s"),
            };
        }
        Self {
            reading: scale(1.0, unit),
            angle_random_walk: scale(1.0, &times(unit, "sqrt(s)")),
            bias_instability: scale(1.0, unit),
            rate_random_walk: scale(1.0, &format!("{unit}/sqrt(s)")),
            rate_ramp: scale(1.0, &format!("{unit}/s")),
            quantization_noise: scale(1.0, &times(unit, "s")),
            integral: scale(1.0, &times(unit, "s")),
            time_deviation: scale(1.0, &times(unit, "s")),
        }
    }
}

/// A product of units. That of a ratio, as fractional frequency is (IEEE Std 1139), with a time is the time.
fn times(unit: &str, other: &str) -> String {
    match unit {
        "1" => other.to_owned(),
        unit => format!("{unit}*{other}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_papers_316_deg_per_h_at_1_s_are_5_27_deg_per_sqrt_h() {
        // 10^2.5 deg/h at 1 s, in deg/s, is N in deg/sqrt(s).
        let n = 10f64.powf(2.5) / 3600.0;
        let units = Units::of(Quantity::Gyro, "deg/s");
        assert!((n * units.angle_random_walk.factor - 5.27).abs() < 0.001);
        let rad = Units::of(Quantity::Gyro, "rad/s");
        assert!((n.to_radians() * rad.bias_instability.factor - 10f64.powf(2.5)).abs() < 1e-9);
    }

    #[test]
    fn a_fractional_frequency_has_units_of_time_alone() {
        let units = Units::of(Quantity::Other, "1");
        let of = [
            units.angle_random_walk,
            units.rate_random_walk,
            units.rate_ramp,
            units.time_deviation,
        ];
        let of = of.map(|scale| scale.unit);
        assert_eq!(of, ["sqrt(s)", "1/sqrt(s)", "1/s", "s"]);
    }

    #[test]
    fn a_foreign_unit_is_kept_with_seconds() {
        let units = Units::of(Quantity::Other, "V");
        assert_eq!(
            units.rate_random_walk,
            Scale {
                factor: 1.0,
                unit: "V/sqrt(s)".into()
            }
        );
    }
}
