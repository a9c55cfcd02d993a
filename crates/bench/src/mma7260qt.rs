//! The MMA7260QT at its pins: V = clamp(VDD/3.3 (1.65 + e0 + S (1 + es + ks dT) (a + kz dT + n)), 0.25, VDD - 0.25). Zero and
//! sensitivity go with the supply; a converter whose reference is that supply does not see it.

use rand_xoshiro::Xoshiro256PlusPlus;

use crate::random::{Stream, standard_normal};
use crate::scenario::{AccPart, STANDARD_GRAVITY};

/// Levels of the g-select and sleep pins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AccSelect {
    /// g-Select1.
    pub select1: bool,
    /// g-Select2.
    pub select2: bool,
    /// The sleep pin, which is active low: `true` when the part is awake.
    pub awake: bool,
}

/// Output filter, X, Y and Z, Hz.
const POLES_HZ: [f64; 3] = [350.0, 350.0, 150.0];
/// Time in which the package follows the board, s: a small one like the gyros'.
const PACKAGE_S: f64 = 30.0;
/// Temperature at which the part is what it is stated to be, degC.
const STATED_C: f64 = 25.0;
/// Sleep to 90 % of the output, s.
const ENABLE_S: f64 = 0.5e-3;

/// The accelerometer.
#[derive(Clone, Debug)]
pub struct Mma7260Qt {
    part: AccPart,
    rng: Xoshiro256PlusPlus,
    select: AccSelect,
    awake_since_s: f64,
    noise_g: [f64; 3],
    filtered: [f64; 3],
    package_c: Option<f64>,
}

impl Mma7260Qt {
    /// Awake with open g-select pins: 1.5 g.
    #[must_use]
    pub fn new(part: AccPart, seed: u64) -> Self {
        Mma7260Qt {
            part,
            rng: Stream::AccNoise.of(seed),
            select: AccSelect {
                select1: false,
                select2: false,
                awake: true,
            },
            awake_since_s: 0.0,
            noise_g: [0.0; 3],
            filtered: [0.0; 3],
            package_c: None,
        }
    }

    /// The board beneath it has this temperature, degC, for `dt` s.
    pub fn warm(&mut self, board_c: f64, dt: f64) {
        let before = self.package_c.unwrap_or(board_c);
        self.package_c = Some(board_c + (before - board_c) * (-dt / PACKAGE_S).exp());
    }

    /// Typical sensitivity at 3.3 V for g-Select2, g-Select1 as bits 1 and 0, V/g.
    #[must_use]
    pub fn sensitivity_v_g(range: u8) -> f64 {
        match range & 3 {
            0 => 0.8,
            1 => 0.6,
            2 => 0.3,
            _ => 0.2,
        }
    }

    /// The pins change at `t` s.
    pub fn set_pins(&mut self, select: AccSelect, t: f64) {
        if select.awake && !self.select.awake {
            self.awake_since_s = t;
        }
        self.select = select;
    }

    /// Moves on by `dt` s under the specific force `acceleration`, m/s^2 along x, y, z.
    pub fn step(&mut self, acceleration: [f64; 3], dt: f64) {
        for axis in 0..3 {
            // White noise behind a pole: variance = density^2 (pi/2) pole.
            let pole = POLES_HZ[axis];
            let keep = (-std::f64::consts::TAU * pole * dt).exp();
            let sigma = self.part.noise_density_g * (std::f64::consts::FRAC_PI_2 * pole).sqrt();
            self.noise_g[axis] = keep * self.noise_g[axis]
                + sigma * (1.0 - keep * keep).sqrt() * standard_normal(&mut self.rng);
            let g = acceleration[axis] / STANDARD_GRAVITY;
            self.filtered[axis] = g + (self.filtered[axis] - g) * keep;
        }
    }

    /// Output voltage of an axis at `t` s and the supply `vdd`, V. Asleep: 0.
    #[must_use]
    pub fn volts(&self, axis: usize, vdd: f64, t: f64) -> f64 {
        if !self.select.awake || t < self.awake_since_s + ENABLE_S {
            return 0.0;
        }
        let ratio = vdd / 3.3;
        let range = u8::from(self.select.select2) << 1 | u8::from(self.select.select1);
        let warm = self.package_c.map_or(0.0, |c| c - STATED_C);
        let error = self.part.scale_error[axis] + self.part.scale_tempco[axis] * warm;
        let sensitivity = Self::sensitivity_v_g(range) * (1.0 + error);
        let shift = self.part.zero_g_tempco_g[axis] * warm;
        let g = self.filtered[axis] + self.noise_g[axis] + shift;
        let volts = (1.65 + self.part.zero_g_error_v[axis] + sensitivity * g) * ratio;
        volts.clamp(0.25, vdd - 0.25)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn silent() -> AccPart {
        AccPart {
            noise_density_g: 0.0,
            ..AccPart::default()
        }
    }

    /// Under a specific force, g, for long enough.
    fn under(part: AccPart, g: [f64; 3]) -> Mma7260Qt {
        let mut acc = Mma7260Qt::new(part, 3);
        (0..100).for_each(|_| acc.step(g.map(|g| g * STANDARD_GRAVITY), 1e-3));
        acc
    }

    fn near(got: f64, wanted: f64) {
        assert!((got - wanted).abs() < 1e-9, "{got}, not {wanted}");
    }

    #[test]
    fn zero_sensitivity_supply_and_temperature_are_in_the_volts() {
        let part = AccPart {
            zero_g_error_v: [0.05, -0.02, 0.0],
            scale_error: [0.03, 0.0, -0.05],
            zero_g_tempco_g: [2e-3, 0.0, -1e-3],
            scale_tempco: [1e-4, -2e-4, 0.0],
            ..silent()
        };
        let mut acc = under(part, [0.5, -0.25, 1.0]);
        // At 25 degC.
        near(acc.volts(0, 3.3, 1.0), 1.65 + 0.05 + 0.8 * 1.03 * 0.5);
        near(acc.volts(1, 3.3, 1.0), 1.65 - 0.02 - 0.8 * 0.25);
        near(acc.volts(2, 3.3, 1.0), 1.65 + 0.8 * 0.95);
        // In proportion to the supply.
        near(acc.volts(1, 3.0, 1.0), (1.65 - 0.02 - 0.2) * 3.0 / 3.3);
        // Warm.
        acc.warm(45.0, 1.0);
        near(
            acc.volts(0, 3.3, 1.0),
            1.65 + 0.05 + 0.8 * (1.03 + 1e-4 * 20.0) * (0.5 + 2e-3 * 20.0),
        );
        near(
            acc.volts(1, 3.3, 1.0),
            1.65 - 0.02 - 0.8 * (1.0 - 2e-4 * 20.0) * 0.25,
        );
        near(
            acc.volts(2, 3.3, 1.0),
            1.65 + 0.8 * 0.95 * (1.0 - 1e-3 * 20.0),
        );
    }

    #[test]
    fn the_package_follows_the_board_within_30_s() {
        let part = AccPart {
            zero_g_tempco_g: [1e-2, 0.0, 0.0],
            ..silent()
        };
        let mut acc = under(part, [0.0; 3]);
        acc.warm(25.0, 1.0);
        (0..60).for_each(|_| acc.warm(35.0, 0.5));
        let expected = 10.0 * (1.0 - (-1f64).exp());
        near((acc.volts(0, 3.3, 1.0) - 1.65) / 0.8 / 1e-2, expected);
    }

    #[test]
    fn outputs_end_a_quarter_volt_from_either_rail_and_ranges_have_their_sensitivity() {
        let mut acc = under(silent(), [5.0, -5.0, 0.4]);
        near(acc.volts(0, 3.3, 1.0), 3.05);
        near(acc.volts(1, 3.3, 1.0), 0.25);
        for (range, sensitivity) in [(0u8, 0.8), (1, 0.6), (2, 0.3), (3, 0.2)] {
            let pins = AccSelect {
                select1: range & 1 != 0,
                select2: range & 2 != 0,
                awake: true,
            };
            acc.set_pins(pins, 2.0);
            near(acc.volts(2, 3.3, 2.0), 1.65 + 0.4 * sensitivity);
        }
    }

    #[test]
    fn asleep_it_puts_out_nothing_and_wakes_within_half_a_millisecond() {
        let mut acc = under(silent(), [0.0; 3]);
        let pins = |awake| AccSelect {
            select1: false,
            select2: false,
            awake,
        };
        acc.set_pins(pins(false), 2.0);
        near(acc.volts(0, 3.3, 2.1), 0.0);
        acc.set_pins(pins(true), 3.0);
        near(acc.volts(0, 3.3, 3.0 + 0.4e-3), 0.0);
        near(acc.volts(0, 3.3, 3.0 + 0.6e-3), 1.65);
        // Awake already: no pause.
        acc.set_pins(pins(true), 4.0);
        near(acc.volts(0, 3.3, 4.0), 1.65);
    }

    #[test]
    fn each_output_has_its_pole_and_its_noise() {
        let mut acc = Mma7260Qt::new(silent(), 3);
        acc.step([STANDARD_GRAVITY; 3], 1e-3);
        for (axis, pole) in [350.0, 350.0, 150.0].into_iter().enumerate() {
            let rise = 1.0 - (-std::f64::consts::TAU * pole * 1e-3f64).exp();
            near((acc.volts(axis, 3.3, 1.0) - 1.65) / 0.8, rise);
        }
        let mut acc = Mma7260Qt::new(AccPart::default(), 3);
        let n = 20_000;
        let (mut squares, mut products, mut before) = ([0.0; 3], 0.0, 0.0);
        for _ in 0..n {
            acc.step([0.0; 3], 1e-3);
            let g = [0, 1, 2].map(|axis| (acc.volts(axis, 3.3, 1.0) - 1.65) / 0.8);
            for (sum, g) in squares.iter_mut().zip(g) {
                *sum += g * g / f64::from(n);
            }
            products += g[2] * before / f64::from(n);
            before = g[2];
        }
        // 350e-6 g/sqrt(Hz) over (pi / 2) of the pole.
        for (square, pole) in squares.into_iter().zip([350.0f64, 350.0, 150.0]) {
            let rms = 350e-6 * (std::f64::consts::FRAC_PI_2 * pole).sqrt();
            assert!(
                (square.sqrt() / rms - 1.0).abs() < 0.04,
                "{} {rms}",
                square.sqrt()
            );
        }
        let alike = (-std::f64::consts::TAU * 150.0 * 1e-3f64).exp();
        assert!((products / squares[2] - alike).abs() < 0.03, "{products}");
    }
}
