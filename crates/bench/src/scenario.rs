//! What stands on the table: the parts with their errors, the environment, and what is wrong with them.

mod fault;

pub use fault::Fault;

use crate::pose::Pose;
use crate::random::{Stream, standard_normal, uniform};

/// Standard gravity, m/s^2.
pub const STANDARD_GRAVITY: f64 = 9.806_65;

/// Errors of one ADIS16250.
#[derive(Clone, Debug, PartialEq)]
pub struct GyroPart {
    /// Angle random walk of the 20-Hz output at the part's default filter (4 taps), deg/sqrt(h). The paper's stand: 5.27.
    pub angle_random_walk_deg_sqrt_h: f64,
    /// Rate random walk, deg/s/sqrt(s).
    pub rate_random_walk: f64,
    /// Bias at power-on, deg/s.
    pub turn_on_bias_dps: f64,
    /// Sensitivity error, 1 (data sheet: within 0.01).
    pub scale_error: f64,
    /// Bias per degree from 25 degC, deg/s/degC. 0 on the clean stand: the factory's compensation is taken as perfect.
    pub tempco_dps_c: f64,
    /// Bias per volt from 5 V, deg/s/V. 0 on the clean stand.
    pub supply_dps_v: f64,
    /// Bias per g along the body axes, deg/s/g. 0 on the clean stand.
    pub g_sensitivity_dps_g: [f64; 3],
    /// Rate of the part's 256-SPS clock relative to nominal, parts per million.
    pub clock_ppm: f64,
    /// Time of the first sample after power-on as a fraction of the sample period, 0..1.
    pub clock_phase: f64,
    /// Error of the temperature sensor, degC.
    pub temp_offset_c: f64,
    /// Corner of the analog output filter, Hz (50 by data sheet; a capacitor at RATE/FILT lowers it).
    pub pole_hz: f64,
}

impl Default for GyroPart {
    fn default() -> Self {
        GyroPart {
            angle_random_walk_deg_sqrt_h: 5.27,
            rate_random_walk: 0.0015,
            turn_on_bias_dps: 0.0,
            scale_error: 0.0,
            tempco_dps_c: 0.0,
            supply_dps_v: 0.0,
            g_sensitivity_dps_g: [0.0; 3],
            clock_ppm: 0.0,
            clock_phase: 0.5,
            temp_offset_c: 0.0,
            pole_hz: 50.0,
        }
    }
}

/// Errors of the MMA7260QT.
#[derive(Clone, Debug, PartialEq)]
pub struct AccPart {
    /// Zero-g output relative to VDD/2, V at VDD = 3.3 V.
    pub zero_g_error_v: [f64; 3],
    /// Sensitivity error, 1 (data sheet: within 0.075).
    pub scale_error: [f64; 3],
    /// Noise density, g/sqrt(Hz) (data sheet: 350e-6).
    pub noise_density_g: f64,
    /// Change of the zero, g/degC about 25 degC (data sheet, as remembered and unverified: within 2e-3), and of the
    /// sensitivity, 1/degC (the same: within 3e-4). A sound part has none.
    pub zero_g_tempco_g: [f64; 3],
    /// See there.
    pub scale_tempco: [f64; 3],
}

impl Default for AccPart {
    fn default() -> Self {
        AccPart {
            zero_g_error_v: [0.0; 3],
            scale_error: [0.0; 3],
            noise_density_g: 350e-6,
            zero_g_tempco_g: [0.0; 3],
            scale_tempco: [0.0; 3],
        }
    }
}

/// Room, self-heating and heater.
#[derive(Clone, Debug, PartialEq)]
pub struct ThermalPart {
    /// Room temperature at power-on, degC.
    pub room_c: f64,
    /// Linear drift of the room, degC/h.
    pub drift_c_h: f64,
    /// Swing of the room (draught, air conditioning): half its range, degC.
    pub swing_c: f64,
    /// Period of the swing, s, and its phase, turns.
    pub swing_period_s: f64,
    /// Phase of the swing at power-on, turns.
    pub swing_phase: f64,
    /// What the board warms by when powered, degC.
    pub board_rise_c: f64,
    /// Its time constant, s.
    pub board_tau_s: f64,
    /// What a die warms by above the board, degC.
    pub die_rise_c: f64,
    /// Time constant of each die, s.
    pub die_tau_s: [f64; 3],
    /// A heater beside the board: what it adds at the board when on for ever, degC; 0 for none.
    pub heater_c: f64,
    /// On for half of this period, off for the other half, s.
    pub heater_period_s: f64,
    /// Time for which the stand was powered before the run, s: the self-heating has got that far.
    pub powered_before_s: f64,
}

impl Default for ThermalPart {
    fn default() -> Self {
        ThermalPart {
            room_c: 22.0,
            drift_c_h: 1.0,
            swing_c: 0.3,
            swing_period_s: 400.0,
            swing_phase: 0.0,
            board_rise_c: 4.0,
            board_tau_s: 240.0,
            die_rise_c: 3.0,
            die_tau_s: [25.0, 30.0, 35.0],
            heater_c: 0.0,
            heater_period_s: 200.0,
            powered_before_s: 1800.0,
        }
    }
}

/// The 5-V supply and what loads it.
#[derive(Clone, Debug, PartialEq)]
pub struct SupplyPart {
    /// No-load voltage, V.
    pub open_v: f64,
    /// Source resistance seen by the motor's current, ohm (common wiring).
    pub motor_ohm: f64,
    /// Voltage steps of other loads (relay, lamp), V; 0 for none.
    pub load_step_v: f64,
    /// Mean time between two switchings of that load, s.
    pub load_dwell_s: f64,
    /// Slow wander of the regulator: rms, V, with a correlation time of 60 s.
    pub wander_v: f64,
}

impl Default for SupplyPart {
    fn default() -> Self {
        SupplyPart {
            open_v: 5.0,
            motor_ohm: 0.0,
            load_step_v: 0.0,
            load_dwell_s: 40.0,
            wander_v: 0.001,
        }
    }
}

/// The DC motor of the table, with its own 12-V driver.
#[derive(Clone, Debug, PartialEq)]
pub struct MotorPart {
    /// Driver voltage at full duty, V.
    pub driver_v: f64,
    /// Winding, ohm.
    pub resistance_ohm: f64,
    /// Winding, H.
    pub inductance_h: f64,
    /// Torque constant = back-EMF constant, N m/A = V s/rad.
    pub constant: f64,
    /// Rotor and what it carries, kg m^2.
    pub inertia: f64,
    /// Viscous friction, N m s/rad.
    pub viscous: f64,
    /// Coulomb friction, N m.
    pub coulomb: f64,
    /// Table turns for each turn of the motor; 0 with the belt taken off (the stand at rest).
    pub table_ratio: f64,
}

impl Default for MotorPart {
    fn default() -> Self {
        MotorPart {
            driver_v: 12.0,
            resistance_ohm: 6.0,
            inductance_h: 3e-3,
            constant: 0.03,
            inertia: 4e-5,
            viscous: 6e-5,
            coulomb: 1e-3,
            table_ratio: 0.0,
        }
    }
}

/// What the base does in a sound stand.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BasePart {
    /// Tilt of the sensor about x and y, deg: gravity is not exactly on z.
    pub tilt_deg: [f64; 2],
    /// Linear broadband vibration of the floor, g rms up to 10 Hz; the gyros do not see it (no angular part).
    pub floor_g_rms: f64,
    /// Sway about an axis (0, 1): peak angle in deg and period in s; the base really turns.
    pub sway_deg: f64,
    /// Period of the sway, s.
    pub sway_period_s: f64,
    /// When the sway begins, s since power came on; the base rests until then.
    pub sway_from_s: f64,
    /// How somebody turns the stand over, in order.
    pub poses: Vec<Pose>,
}

/// How a stalled gyro marks its old samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StallFlags {
    /// The ND bit stays clear: the part says so.
    NewDataClear,
    /// The ND bit is set all the same.
    Silent,
}

/// A stand, its environment and what is wrong with it; with the host's requests a whole run.
#[derive(Clone, Debug, PartialEq)]
pub struct Scenario {
    /// All random draws come from here.
    pub seed: u64,
    /// x, y, z.
    pub gyros: [GyroPart; 3],
    /// The accelerometer.
    pub acc: AccPart,
    /// Temperatures.
    pub thermal: ThermalPart,
    /// The 5-V supply.
    pub supply: SupplyPart,
    /// The motor.
    pub motor: MotorPart,
    /// When somebody holds the motor's stop pressed, from and to, s since power came on, in order.
    pub stop_pressed: Vec<[f64; 2]>,
    /// The base.
    pub base: BasePart,
    /// Length of the run, s: faults that strike at random times are spread over it.
    pub seconds: f64,
    /// The board's crystal, parts per million fast.
    pub crystal_ppm: f64,
    /// What is wrong.
    pub faults: Vec<Fault>,
}

impl Scenario {
    /// The paper's stand at rest, with parts as different from each other as parts are (turn-on bias, clock, zero-g),
    /// in a quiet room, and nothing wrong with it.
    #[must_use]
    pub fn quiet(seed: u64) -> Self {
        let mut scenario = Scenario {
            seed,
            gyros: Default::default(),
            acc: AccPart::default(),
            thermal: ThermalPart::default(),
            supply: SupplyPart::default(),
            motor: MotorPart::default(),
            stop_pressed: Vec::new(),
            base: BasePart::default(),
            seconds: 600.0,
            crystal_ppm: 0.0,
            faults: Vec::new(),
        };
        for (axis, gyro) in scenario.gyros.iter_mut().enumerate() {
            let rng = &mut Stream::GyroPart(axis as u8).of(seed);
            gyro.turn_on_bias_dps = 0.3 * standard_normal(rng);
            gyro.scale_error = 0.004 * standard_normal(rng);
            gyro.clock_ppm = 3000.0 * standard_normal(rng);
            gyro.clock_phase = uniform(rng, 0.0, 1.0);
            gyro.temp_offset_c = 0.8 * standard_normal(rng);
        }
        let rng = &mut Stream::AccPart.of(seed);
        for axis in 0..3 {
            scenario.acc.zero_g_error_v[axis] = 0.03 * standard_normal(rng);
            scenario.acc.scale_error[axis] = 0.015 * standard_normal(rng);
        }
        scenario.base.tilt_deg = [0.5 * standard_normal(rng), 0.5 * standard_normal(rng)];
        scenario
    }

    /// A sound stand in a lively environment: noise, room, heater, loads and floor drawn from the seed, wide enough
    /// that a fault driven by any of them has something to follow. Nothing is wrong with it.
    #[must_use]
    pub fn lively(seed: u64) -> Self {
        let mut scenario = Scenario::quiet(seed);
        let rng = &mut Stream::Draw.of(seed);
        for gyro in &mut scenario.gyros {
            gyro.angle_random_walk_deg_sqrt_h = uniform(rng, 3.6, 7.0);
            gyro.rate_random_walk = if uniform(rng, 0.0, 1.0) < 0.15 {
                0.0
            } else {
                (uniform(rng, 3e-4_f64.ln(), 5e-3_f64.ln())).exp()
            };
        }
        let thermal = &mut scenario.thermal;
        thermal.room_c = uniform(rng, 18.0, 27.0);
        thermal.drift_c_h = uniform(rng, -4.0, 4.0);
        thermal.swing_c = uniform(rng, 0.2, 1.0);
        thermal.swing_period_s = uniform(rng, 150.0, 500.0);
        thermal.swing_phase = uniform(rng, 0.0, 1.0);
        if uniform(rng, 0.0, 1.0) < 0.6 {
            thermal.heater_c = uniform(rng, 5.0, 15.0);
            thermal.heater_period_s = uniform(rng, 100.0, 250.0);
        }
        scenario.supply.open_v = 5.0 + 0.03 * standard_normal(rng);
        scenario.supply.load_step_v = uniform(rng, 0.03, 0.06);
        scenario.supply.load_dwell_s = uniform(rng, 15.0, 50.0);
        scenario.supply.motor_ohm = uniform(rng, 0.0, 0.02);
        scenario.base.floor_g_rms = uniform(rng, 0.0, 0.1);
        scenario
    }

    /// The same stand with one more thing wrong.
    #[must_use]
    pub fn with(mut self, fault: Fault) -> Self {
        self.faults.push(fault);
        self
    }
}

#[cfg(test)]
mod tests;
