//! The whole stand: the world moves on its own clocks, the board asks.

use rand_xoshiro::Xoshiro256PlusPlus;

use crate::base::Base;
use crate::gyro::{Gyro, Stimulus};
use crate::random::{Stream, standard_normal};
use crate::scenario::{Fault, STANDARD_GRAVITY};
use crate::{AccSelect, Adis16250, Mma7260Qt, Motor, Scenario, Supply, Thermal};

/// Step of motor, supply, base and accelerometer, s.
pub const MECHANICAL_STEP_S: f64 = 1e-3;
/// Temperatures move every so many mechanical steps.
const THERMAL_STEPS: u64 = 16;
/// The mechanical steps lie between the board's milliseconds, so that a motor command given some cycles earlier or
/// later within a millisecond does the same.
const STEP_OFFSET_S: f64 = 0.5e-3;
/// Correlation time of the noise on the common reference, s.
const COMMON_TAU_S: f64 = 15e-3;
/// The accelerometer's regulator, V.
const VDD_V: f64 = 3.3;
/// The rail that it and the gyros hang on, as it should be, V.
const RAIL_V: f64 = 5.0;

/// Three gyros, an accelerometer and a motor in their world. Times are seconds since power came on; they must not
/// decrease.
#[derive(Clone, Debug)]
pub struct Stand {
    gyros: [Gyro; 3],
    acc: Mma7260Qt,
    motor: Motor,
    supply: Supply,
    thermal: Thermal,
    base: Base,
    /// Gyro, the axis that it leans towards, and the sine of the angle.
    misaligned: Vec<(usize, usize, f64)>,
    /// V of the converter's reference for each V of the 5-V rail.
    reference_share: f64,
    common_sigma: f64,
    common: f64,
    common_rng: Xoshiro256PlusPlus,
    duty: f64,
    /// How far the table has turned, rad.
    azimuth: f64,
    steps: u64,
}

impl Stand {
    /// Power comes on.
    #[must_use]
    pub fn new(scenario: &Scenario) -> Self {
        let base = Base::new(scenario.base.clone(), &scenario.faults, scenario.seed);
        let gyros = std::array::from_fn(|axis| {
            Gyro::new(
                axis,
                &scenario.gyros[axis],
                &scenario.faults,
                base.tones(),
                scenario.seconds,
                scenario.seed,
            )
        });
        let misaligned = (scenario.faults.iter())
            .filter_map(|fault| match *fault {
                Fault::Misalignment { gyro, from, share } => Some((gyro, from, share)),
                _ => None,
            })
            .collect();
        let common_sigma = scenario
            .faults
            .iter()
            .map(|fault| match fault {
                Fault::CommonNoise { sigma_dps } => *sigma_dps,
                _ => 0.0,
            })
            .sum();
        let (mut acc, mut reference_share) = (scenario.acc.clone(), 0.0);
        for fault in &scenario.faults {
            match *fault {
                Fault::AccTempco {
                    axis,
                    g_per_c,
                    scale_per_c,
                } => {
                    acc.zero_g_tempco_g[axis] += g_per_c;
                    acc.scale_tempco[axis] += scale_per_c;
                }
                Fault::AccReference { share } => reference_share += share,
                _ => {}
            }
        }
        Stand {
            gyros,
            acc: Mma7260Qt::new(acc, scenario.seed),
            motor: Motor::new(scenario.motor.clone()),
            supply: Supply::new(scenario.supply.clone(), scenario.seed),
            thermal: Thermal::new(scenario.thermal.clone()),
            base,
            misaligned,
            reference_share,
            common_sigma,
            common: 0.0,
            common_rng: Stream::Common.of(scenario.seed),
            duty: 0.0,
            azimuth: 0.0,
            steps: 0,
        }
    }

    /// Lets the world move on to `t` s.
    pub fn advance(&mut self, t: f64) {
        loop {
            let step = STEP_OFFSET_S + self.steps as f64 * MECHANICAL_STEP_S;
            let (due, gyro) = (0..3)
                .map(|axis| (self.gyros[axis].next_s(), Some(axis)))
                .fold(
                    (step, None),
                    |first, other| if other.0 < first.0 { other } else { first },
                );
            if due > t {
                return;
            }
            match gyro {
                None => self.step(step),
                Some(axis) => {
                    let stimulus = self.stimulus(axis, due);
                    self.gyros[axis].sample(&stimulus);
                }
            }
        }
    }

    fn step(&mut self, t: f64) {
        let dt = MECHANICAL_STEP_S;
        self.motor.step(self.duty, dt);
        self.supply.step(t, dt, self.motor.current_a());
        self.base.step(dt);
        self.azimuth += (dt * self.motor.table_dps()).to_radians();
        self.acc.step(self.base.acceleration(t, self.azimuth), dt);
        if self.steps.is_multiple_of(THERMAL_STEPS) {
            let dt = dt * THERMAL_STEPS as f64;
            self.thermal.step(t, dt);
            self.acc.warm(self.thermal.board_c(), dt);
        }
        if self.common_sigma > 0.0 {
            let keep = (-dt / COMMON_TAU_S).exp();
            self.common = keep * self.common
                + (1.0 - keep * keep).sqrt() * standard_normal(&mut self.common_rng);
        }
        self.steps += 1;
    }

    fn stimulus(&self, axis: usize, t: f64) -> Stimulus {
        let mut rates = self.base.rate_dps(t, self.azimuth);
        rates[2] += self.motor.table_dps();
        let mut rate_dps = rates[axis];
        for &(_, from, share) in self.misaligned.iter().filter(|lean| lean.0 == axis) {
            rate_dps += share * rates[from] - (1.0 - (1.0 - share * share).sqrt()) * rates[axis];
        }
        Stimulus {
            rate_dps,
            die_c: self.thermal.die_c()[axis],
            supply_v: self.supply.volts(),
            motor_a: self.motor.current_a(),
            acc_g: self
                .base
                .acceleration(t, self.azimuth)
                .map(|a| a / STANDARD_GRAVITY),
            common_dps: self.common_sigma * self.common,
        }
    }

    /// The level of a gyro's chip select at `t` s.
    pub fn select(&mut self, axis: usize, selected: bool, t: f64) {
        self.advance(t);
        self.gyros[axis].adis.select(selected, t);
    }

    /// Eight SPI clocks that end at `t` s: what MISO read. Nobody selected: the pull-up, 0xff; two selected: both pull.
    pub fn spi_byte(&mut self, mosi: u8, t: f64) -> u8 {
        self.advance(t);
        self.gyros
            .iter_mut()
            .filter_map(|gyro| gyro.transfer(mosi, t))
            .fold(0xff, |line, byte| line & byte)
    }

    /// A frame of 16 clocks with one gyro, its bytes ending at `first_s` and `second_s`.
    pub fn spi_frame(&mut self, axis: usize, word: u16, first_s: f64, second_s: f64) -> u16 {
        self.select(axis, true, first_s);
        let [high, low] = word.to_be_bytes();
        let reply = [self.spi_byte(high, first_s), self.spi_byte(low, second_s)];
        self.select(axis, false, second_s);
        u16::from_be_bytes(reply)
    }

    /// Output of the accelerometer at `t` s, V.
    pub fn acc_volts(&mut self, axis: usize, t: f64) -> f64 {
        self.advance(t);
        self.acc.volts(axis, VDD_V, t)
    }

    /// The converter's reference, tied to the accelerometer's supply, V.
    #[must_use]
    pub fn aref_volts(&self) -> f64 {
        VDD_V + self.reference_share * (self.supply.volts() - RAIL_V)
    }

    /// What a 10-bit converter reads of an accelerometer axis at `t` s: floor(1024 V / AREF).
    pub fn acc_counts(&mut self, axis: usize, t: f64) -> u16 {
        let volts = self.acc_volts(axis, t);
        (volts / self.aref_volts() * 1024.0)
            .floor()
            .clamp(0.0, 1023.0) as u16
    }

    /// The accelerometer's pins change at `t` s.
    pub fn set_acc_pins(&mut self, select: AccSelect, t: f64) {
        self.advance(t);
        self.acc.set_pins(select, t);
    }

    /// The motor's command, -1..1, from `t` s on.
    pub fn set_motor(&mut self, duty: f64, t: f64) {
        self.advance(t);
        self.duty = duty;
    }

    /// A gyro's registers, for looking only.
    #[must_use]
    pub fn gyro(&self, axis: usize) -> &Adis16250 {
        &self.gyros[axis].adis
    }

    /// A gyro's registers, to meddle with: those of a part that was used elsewhere, or an error that it raises.
    pub fn gyro_mut(&mut self, axis: usize) -> &mut Adis16250 {
        &mut self.gyros[axis].adis
    }

    /// The motor, for looking only.
    #[must_use]
    pub fn motor(&self) -> &Motor {
        &self.motor
    }

    /// The supply, for looking only.
    #[must_use]
    pub fn supply(&self) -> &Supply {
        &self.supply
    }

    /// The temperatures, for looking only.
    #[must_use]
    pub fn thermal(&self) -> &Thermal {
        &self.thermal
    }
}
