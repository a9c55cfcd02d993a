//! What can be wrong with the simulated stand, and how large: drawn from a seed.

use bench::scenario::StallFlags;
use bench::{Fault, Scenario, uniform};
use rand_xoshiro::Xoshiro256PlusPlus;

/// What can be wrong with the simulated stand.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, clap::ValueEnum)]
pub enum Hidden {
    /// One of those below, drawn from the seed.
    Random,
    /// Nothing.
    None,
    /// A gyro's bias follows its temperature.
    Tempco,
    /// A gyro's bias follows its temperature along a parabola.
    TempcoCurved,
    /// The motor's current couples into a gyro.
    MotorCoupling,
    /// The motor's commutation makes a gyro noisier.
    MotorNoise,
    /// A gyro follows a supply that sags.
    SupplyCoupling,
    /// A machine shakes the base.
    Vibration,
    /// The mount is knocked.
    Knock,
    /// A gyro repeats its samples.
    Stall,
    /// A gyro repeats its samples and says that they are new.
    SilentStall,
    /// A gyro's bias settles after power-on.
    WarmUp,
    /// A gyro's package leaks: the bias runs away steadily.
    Leak,
    /// Too large a capacitor at a gyro's filter pin.
    SlowFilter,
    /// A gyro's bias wanders and returns.
    WanderingBias,
    /// A gyro's bias jumps between two values.
    Trap,
    /// A gyro reacts to acceleration, on a shaking floor.
    GSensitivity,
    /// Noise on the reference that the gyros share.
    CommonNoise,
    /// A gyro gets noisier for a while.
    NoisySpell,
    /// Discharges hit a gyro's output latch.
    Glitches,
    /// A data line of a gyro is stuck.
    StuckBit,
    /// MISO is dead for a while when a gyro is selected.
    DeadSpi,
    /// The serial cable loses bytes.
    LossyLine,
    /// Somebody turns the base, and turns it back.
    Shove,
    /// The base sways, and gyro x has the wrong scale.
    ScaleError,
    /// The board's crystal is off.
    WrongCrystal,
    /// The bench is knocked: the stand rings, and nothing stays.
    Bump,
    /// The zero of an accelerometer follows its temperature. Random draws leave it out, for it is in no gyro.
    AccTempco,
    /// The converter's reference follows the supply, and the accelerometers are not ratiometric. Random draws leave it out.
    AccReference,
    /// Three things at once that a correction takes off: one gyro follows its temperature, one the motor's current, and one
    /// is mounted askew on a base that sways after a rest. Random draws leave it out.
    Uncalibrated,
}

impl Hidden {
    /// Everything that can be wrong, one thing at a time.
    pub const ALL: [Hidden; 25] = [
        Hidden::Tempco,
        Hidden::TempcoCurved,
        Hidden::MotorCoupling,
        Hidden::MotorNoise,
        Hidden::SupplyCoupling,
        Hidden::Vibration,
        Hidden::Knock,
        Hidden::Stall,
        Hidden::SilentStall,
        Hidden::WarmUp,
        Hidden::Leak,
        Hidden::SlowFilter,
        Hidden::WanderingBias,
        Hidden::Trap,
        Hidden::GSensitivity,
        Hidden::CommonNoise,
        Hidden::NoisySpell,
        Hidden::Glitches,
        Hidden::StuckBit,
        Hidden::DeadSpi,
        Hidden::LossyLine,
        Hidden::Shove,
        Hidden::ScaleError,
        Hidden::WrongCrystal,
        Hidden::Bump,
    ];
}

/// How large what is hidden may be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sizes {
    /// What a 600-s run shows.
    Visible,
    /// From a third of the smallest of those on, even in the logarithm: some that no run of 600 s can show.
    Any,
}

impl Sizes {
    fn draw(self, rng: &mut Xoshiro256PlusPlus, low: f64, high: f64) -> f64 {
        match self {
            Sizes::Visible => uniform(rng, low, high),
            Sizes::Any => by_ratio(rng, low / 3.0, high),
        }
    }
}

/// Even in the logarithm.
fn by_ratio(rng: &mut Xoshiro256PlusPlus, low: f64, high: f64) -> f64 {
    uniform(rng, low.ln(), high.ln()).exp()
}

fn one_of(rng: &mut Xoshiro256PlusPlus, count: usize) -> usize {
    (uniform(rng, 0.0, count as f64) as usize).min(count - 1)
}

/// Plants it in a scenario whose length is set; returns the gyro it is in, `None` where it is in none, or in all.
pub(super) fn plant(
    hidden: Hidden,
    sizes: Sizes,
    scenario: &mut Scenario,
    rng: &mut Xoshiro256PlusPlus,
) -> Option<usize> {
    let hidden = match hidden {
        Hidden::Random => Hidden::ALL[one_of(rng, Hidden::ALL.len())],
        other => other,
    };
    let gyro = one_of(rng, 3);
    let sign = if uniform(rng, 0.0, 1.0) < 0.5 {
        -1.0
    } else {
        1.0
    };
    match hidden {
        Hidden::ScaleError => {
            plant_scale_error(sizes, sign, scenario, rng);
            return Some(0);
        }
        Hidden::WrongCrystal => {
            scenario.crystal_ppm = sign * by_ratio(rng, 300.0, 3000.0);
            return None;
        }
        Hidden::AccTempco => {
            heat(scenario, rng);
            quiet_floor(scenario);
            scenario.faults.push(Fault::AccTempco {
                axis: gyro,
                g_per_c: sign * sizes.draw(rng, 1e-3, 2e-3),
                scale_per_c: 0.0,
            });
            return None;
        }
        Hidden::AccReference => {
            quiet_floor(scenario);
            let share = sizes.draw(rng, 0.05, 0.2);
            scenario.faults.push(Fault::AccReference { share });
            return None;
        }
        Hidden::Uncalibrated => {
            uncalibrated(sizes, [gyro, one_of(rng, 3)], scenario, rng);
            return None;
        }
        _ => {}
    }
    let fault = fault(hidden, sizes, gyro, sign, scenario, rng);
    let channel = match fault {
        None | Some(Fault::CommonNoise { .. } | Fault::LossyLine { .. }) => None,
        Some(_) => Some(gyro),
    };
    scenario.faults.extend(fault);
    channel
}

/// Only what turns about x tilts, and only a tilt gives a second measure of the angle.
fn plant_scale_error(
    sizes: Sizes,
    sign: f64,
    scenario: &mut Scenario,
    rng: &mut Xoshiro256PlusPlus,
) {
    let base = &mut scenario.base;
    base.sway_deg = uniform(rng, 2.0, 8.0);
    base.sway_period_s = uniform(rng, 5.0, 20.0);
    scenario.gyros[0].scale_error = sign * sizes.draw(rng, 0.06, 0.3);
}

/// When the sway of a stand that is to be calibrated begins, s: behind the rest in which the bias is taken.
pub const SWAY_FROM_S: f64 = 75.0;

/// A gyro that follows its temperature, one that follows the motor, and one that leans towards x, about which the base sways.
fn uncalibrated(
    sizes: Sizes,
    [by_temperature, by_motor]: [usize; 2],
    scenario: &mut Scenario,
    rng: &mut Xoshiro256PlusPlus,
) {
    let sign = |rng: &mut Xoshiro256PlusPlus| if one_of(rng, 2) == 0 { -1.0 } else { 1.0 };
    heat(scenario, rng);
    let base = &mut scenario.base;
    base.sway_deg = uniform(rng, 4.0, 10.0);
    base.sway_period_s = uniform(rng, 4.0, 10.0);
    base.sway_from_s = SWAY_FROM_S;
    scenario.faults.extend([
        Fault::Tempco {
            gyro: by_temperature,
            dps_per_c: sign(rng) * sizes.draw(rng, 0.06, 0.15),
            dps_per_c2: 0.0,
        },
        Fault::MotorCoupling {
            gyro: by_motor,
            dps_per_amp: sign(rng) * sizes.draw(rng, 0.6, 2.0),
        },
        Fault::Misalignment {
            gyro: 1 + one_of(rng, 2),
            from: 0,
            // 1.7 to 5 degrees.
            share: sign(rng) * sizes.draw(rng, 0.03, 0.09),
        },
    ]);
}

fn fault(
    hidden: Hidden,
    sizes: Sizes,
    gyro: usize,
    sign: f64,
    scenario: &mut Scenario,
    rng: &mut Xoshiro256PlusPlus,
) -> Option<Fault> {
    let seconds = scenario.seconds;
    let fault = match hidden {
        Hidden::None
        | Hidden::Random
        | Hidden::ScaleError
        | Hidden::WrongCrystal
        | Hidden::AccTempco
        | Hidden::AccReference
        | Hidden::Uncalibrated => return None,
        Hidden::Tempco => {
            heat(scenario, rng);
            Fault::Tempco {
                gyro,
                dps_per_c: sign * sizes.draw(rng, 0.06, 0.15),
                dps_per_c2: 0.0,
            }
        }
        Hidden::TempcoCurved => {
            heat(scenario, rng);
            Fault::Tempco {
                gyro,
                dps_per_c: uniform(rng, -0.05, 0.05),
                dps_per_c2: sign * sizes.draw(rng, 0.006, 0.02),
            }
        }
        Hidden::MotorCoupling => Fault::MotorCoupling {
            gyro,
            dps_per_amp: sign * sizes.draw(rng, 0.6, 2.0),
        },
        Hidden::MotorNoise => Fault::MotorNoise {
            gyro,
            power_per_amp: sizes.draw(rng, 1.0, 6.0),
        },
        Hidden::SupplyCoupling => Fault::SupplyCoupling {
            gyro,
            dps_per_volt: sign * sizes.draw(rng, 2.0, 5.0),
        },
        Hidden::Vibration => Fault::Vibration {
            axis: gyro,
            // What lies above half the sample rate folds down.
            frequency_hz: match sizes {
                Sizes::Visible => uniform(rng, 0.8, 9.0),
                Sizes::Any => by_ratio(rng, 0.2, 40.0),
            },
            amplitude_dps: sizes.draw(rng, 0.06, 0.2),
            linear_g: uniform(rng, 0.0, 0.05),
        },
        Hidden::Knock => Fault::Knock {
            gyro,
            time_s: seconds * uniform(rng, 0.25, 0.75),
            step_dps: sign * sizes.draw(rng, 0.3, 0.8),
            tilt_deg: uniform(rng, 0.0, 1.0),
        },
        // Slow enough for 20 readings a second, and over within a second.
        Hidden::Bump => Fault::Bump {
            axis: gyro,
            time_s: seconds * uniform(rng, 0.05, 0.95),
            peak_dps: sign * sizes.draw(rng, 3.0, 10.0),
            linear_g: uniform(rng, 0.1, 0.5),
            frequency_hz: uniform(rng, 1.0, 8.0),
            decay_s: by_ratio(rng, 0.1, 0.3),
        },
        Hidden::Stall => Fault::Stall {
            gyro,
            count: 15 + uniform(rng, 0.0, 25.0) as usize,
            length_s: uniform(rng, 0.1, 0.4),
            flags: StallFlags::NewDataClear,
        },
        // Neighbours are alike by chance some 600 times in 12 000.
        Hidden::SilentStall => Fault::Stall {
            gyro,
            count: sizes.draw(rng, 60.0, 240.0) as usize,
            length_s: uniform(rng, 0.1, 0.4),
            flags: StallFlags::Silent,
        },
        Hidden::WarmUp => Fault::WarmUp {
            gyro,
            amplitude_dps: sign * sizes.draw(rng, 0.5, 2.0),
            tau_s: seconds * by_ratio(rng, 1.0 / 60.0, 0.25),
        },
        Hidden::Leak => Fault::Leak {
            gyro,
            dps_per_s: sign * sizes.draw(rng, 1.0, 3.0) / seconds,
        },
        Hidden::SlowFilter => Fault::SlowFilter {
            gyro,
            pole_hz: 1.0 / sizes.draw(rng, 0.2, 1.2),
        },
        // What wanders by more than 0.25 deg/s within seconds is a turn of the base to whoever has the gyro alone.
        Hidden::WanderingBias => Fault::WanderingBias {
            gyro,
            sigma_dps: sizes.draw(rng, 0.12, 0.25),
            tau_s: by_ratio(rng, 0.3, 10.0),
        },
        Hidden::Trap => Fault::Trap {
            gyro,
            half_height_dps: sizes.draw(rng, 0.12, 0.25),
            dwell_s: by_ratio(rng, 3.0, 40.0),
        },
        Hidden::GSensitivity => {
            scenario.base.floor_g_rms = uniform(rng, 0.05, 0.15);
            let size = sizes.draw(rng, 1.5, 6.0);
            let direction: [f64; 3] = std::array::from_fn(|_| bench::standard_normal(rng));
            let length = direction.iter().map(|d| d * d).sum::<f64>().sqrt();
            Fault::GSensitivity {
                gyro,
                dps_per_g: direction.map(|d| size * d / length),
            }
        }
        Hidden::CommonNoise => Fault::CommonNoise {
            sigma_dps: sizes.draw(rng, 0.2, 0.8),
        },
        Hidden::NoisySpell => {
            let length = seconds * uniform(rng, 0.1, 0.4);
            let start_s = uniform(rng, 0.02 * seconds, 0.98 * seconds - length);
            Fault::NoisySpell {
                gyro,
                start_s,
                end_s: start_s + length,
                power: sizes.draw(rng, 0.6, 3.0),
            }
        }
        Hidden::Glitches => {
            // 8.5 .. 30 times the noise of a sample at 20 Hz.
            let sigma = scenario.gyros[gyro].angle_random_walk_deg_sqrt_h / 60.0 * 20f64.sqrt();
            Fault::Glitches {
                gyro,
                count: 1 + one_of(rng, 8),
                height_dps: sigma * uniform(rng, 8.5, 30.0),
            }
        }
        Hidden::StuckBit => Fault::StuckBit {
            gyro,
            bit: one_of(rng, 14) as u8,
            value: sign > 0.0,
        },
        Hidden::DeadSpi => {
            let length = by_ratio(rng, 0.5, 0.1 * seconds);
            let start_s = uniform(rng, 0.02 * seconds, 0.98 * seconds - length);
            Fault::DeadSpi {
                gyro,
                start_s,
                end_s: start_s + length,
                level: sign > 0.0,
            }
        }
        Hidden::LossyLine => Fault::LossyLine {
            count: 20 + one_of(rng, 100),
        },
        Hidden::Shove => {
            let length_s = uniform(rng, 2.0, 20.0);
            Fault::Shove {
                axis: gyro,
                time_s: uniform(rng, 0.02 * seconds, 0.98 * seconds - length_s),
                peak_dps: sign * by_ratio(rng, 1.5, 20.0),
                length_s,
            }
        }
    };
    Some(fault)
}

/// A floor that shakes as elsewhere hides what the part does: by some 40 mg, against 8 mg of its noise.
fn quiet_floor(scenario: &mut Scenario) {
    scenario.base.floor_g_rms = 0.0;
}

/// A slope in temperature needs a swing: the heater cycles.
fn heat(scenario: &mut Scenario, rng: &mut Xoshiro256PlusPlus) {
    scenario.thermal.heater_c = uniform(rng, 8.0, 15.0);
    scenario.thermal.heater_period_s = uniform(rng, 100.0, 250.0);
}
