//! What a model file says, as the correction that the firmware applies: coefficients in the formats of [`wire::correction`].
//!
//! A correction takes off what the model adds: temperature (a straight line or a parabola), motor, supply, acceleration, the other
//! axes and the scale. What is left of the bias is the filter's on the board, a Kalman filter at rest whose gains follow from N
//! and K. What the board has no term for is said.

use std::fmt::Write as _;

use model::ModelFile;
use model::file::EffectModel;
use model::record::FULL_DUTY;
use wire::correction::{self, BLOCK_SHIFT_MAX, Correction, NUMBERS, RANGE_STEP, name, step};

mod terms;

use terms::Sum;

/// TEMP_OUT, degC for each count, and its zero (ADIS16250 data sheet).
const TEMP_LSB_C: f64 = 0.1453;
const TEMP_ZERO_C: f64 = 25.0;
/// SUPPLY_OUT, V for each count (ADIS16250 data sheet).
const SUPPLY_LSB_V: f64 = 1.8315e-3;
/// ADC counts for each g at 1.5 g: 0.8 V/g at 3.3 V (MMA7260QT data sheet), and for 0 g.
const ACC_COUNTS_PER_G: f64 = 0.8 / 3.3 * 1024.0;
const ACC_ZERO: f64 = 512.0;
/// Over how far each kind of term reaches when its rounding is judged: counts of TEMP_OUT from the middle of the record at least,
/// steps of the motor, 0.25 V of supply, 1 g, 100 deg/s.
const REACH_SUPPLY: f64 = 0.25 / SUPPLY_LSB_V;
const REACH_RATE_DPS: f64 = 100.0;
/// The rounding of a term may be this share of the error that white noise alone makes of a mean over [`JUDGED_OVER_S`].
const SHARE_OF_NOISE: f64 = 0.25;
const JUDGED_OVER_S: f64 = 600.0;
/// Shortest block of the bias filter, samples as a power of two, and how long others may be, s: the first block of a rest and the one
/// that its end cuts are lost, and a rest may be a minute.
const SHORTEST_BLOCK: u8 = 4;
const LONGEST_BLOCK_S: f64 = 1.0;
/// Blocks that the filter may remember: its gain is 1/256 at the least.
const MOST_BLOCKS: f64 = 200.0;
/// Least growth of the variance in a block, over that of a block: a step of what is stored.
const LEAST_WALK: f64 = 1.0 / (1 << 24) as f64;
/// Most of the same that is stored, a step below the last so that no rounding leads beyond it. It is the square of the filter's
/// gain: 1/16.
const MOST_WALK: f64 = (u16::MAX - 1) as f64 / (1 << 24) as f64;
/// A flicker of instability B has, at 100 s, the deviation of a walk K with K^2 = 3 (0.664 B)^2 / 100 s (IEEE Std 952).
const FLICKER_AT_S: f64 = 100.0;
/// Degrees beyond the record's own range that a correction is for.
const MARGIN_C: f64 = 2.0;

/// A model file as a correction.
#[derive(Clone, Debug)]
pub struct BoardCorrection {
    /// In physical units.
    pub correction: Correction,
    /// As it is stored; its generation is set when it is written.
    pub numbers: correction::Numbers,
    /// What of the model the board has no term for, and what else is to be known.
    pub notes: Vec<String>,
}

/// Why a model is no correction.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BoardError {
    /// A gyro is missing, or in another unit.
    #[error("the model has no channel {channel} in deg/s")]
    NoChannel {
        /// gyro_x, ...
        channel: &'static str,
    },
    /// N is what the filter's gains come from.
    #[error("{channel} has no angle_random_walk: the filter's gains follow from it")]
    NoNoise {
        /// gyro_x, ...
        channel: &'static str,
    },
    /// Outside the board's numbers.
    #[error("{0}")]
    OutOfRange(correction::OutOfRange),
    /// Its rounding would be seen.
    #[error(
        "{what} of gyro {axis}: rounded to the board's step it is off by up to {off:.2e} deg/s, more than the {allowed:.2e} deg/s that the noise allows"
    )]
    TooCoarse {
        /// The coefficient.
        what: &'static str,
        /// x, y, z.
        axis: char,
        /// deg/s.
        off: f64,
        /// deg/s.
        allowed: f64,
    },
}

const GYROS: [&str; 3] = ["gyro_x", "gyro_y", "gyro_z"];

impl BoardCorrection {
    /// The correction that a model asks for, on gyros with this SENS/AVG.
    ///
    /// # Errors
    /// [`BoardError`]: a channel or its noise is missing, a number does not fit, or is rounded too coarsely.
    pub fn of(model: &ModelFile, sens_avg: u16) -> Result<Self, BoardError> {
        let [mean_c, reach_c] = temperatures(model);
        let supply_v = *model.excitation.get("supply_v").unwrap_or(&5.0);
        let mut sum = Sum {
            out: Correction {
                sens_avg,
                number: number_of(model),
                temp_range: temp_range(mean_c, reach_c),
                ..Correction::default()
            },
            walks: [0.0; 3],
            mean_c,
            supply_v,
            rate_hz: model.rate_hz,
            surge: 0.0,
        };
        let density = sum.baseline(model)?;
        let mut notes = Vec::new();
        for effect in &model.effects {
            let acts_on = |channel: &str| {
                effect.channels.is_empty() || effect.channels.iter().any(|c| c == channel)
            };
            let axes = (0..3).filter(|axis| acts_on(GYROS[*axis]));
            let known: Vec<bool> = axes.map(|axis| sum.take(effect, axis)).collect();
            if known.contains(&false) {
                notes.push(format!("{}: the board has no term for it", effect.cause));
            }
            notes.extend(provisos(effect));
        }
        let Sum { mut out, walks, .. } = sum;
        notes.extend(filter(&mut out, model.rate_hz, [density, walks]));
        let numbers = rounded(&mut out, supply_v)?;
        let stored = Correction::from_numbers(&numbers).unwrap_or(out);
        judge(&out, &stored, &density, reach_c / TEMP_LSB_C)?;
        Ok(Self {
            correction: out,
            numbers,
            notes,
        })
    }

    /// A table for people: each coefficient that is not zero, as it is meant and as it is stored.
    #[must_use]
    pub fn table(&self) -> String {
        let mut text = format!(
            "correction {:#06x}, for gyros with SENS/AVG {:#06x}, {:.1} to {:.1} degC; blocks of {} samples\n",
            self.correction.number,
            self.correction.sens_avg,
            degc(self.correction.temp_range[0]),
            degc(self.correction.temp_range[1]),
            1u32 << self.correction.block_shift,
        );
        for (place, what, unit, value) in values(&self.numbers) {
            let axis = name(place).0;
            let _ = writeln!(text, "  {axis}  {what:<40} {value:>14.9} {unit}");
        }
        for note in &self.notes {
            let _ = writeln!(text, "note: {note}");
        }
        text
    }
}

/// What is to be known of how an effect is taken off.
fn provisos(effect: &EffectModel) -> Vec<String> {
    let mut notes = Vec::new();
    if effect.cause == "g_sensitivity" {
        notes.push("g_sensitivity: for the accelerometer's 1.5 g range".to_owned());
    }
    notes
}

fn degc(steps: i8) -> f64 {
    TEMP_ZERO_C + f64::from(steps) * f64::from(RANGE_STEP) * TEMP_LSB_C
}

/// The coefficients that are not zero: place, name, unit, value.
pub fn values(
    numbers: &correction::Numbers,
) -> impl Iterator<Item = (usize, &'static str, &'static str, f64)> {
    let numbers = *numbers;
    (0..NUMBERS).filter_map(move |place| {
        let (_, what, unit) = name(place);
        let is_variance = what.starts_with("noise") || what.starts_with("walk");
        let whole = if is_variance {
            f64::from(numbers[place].cast_unsigned())
        } else {
            f64::from(numbers[place])
        };
        let value = whole * step(place);
        (value != 0.0).then_some((place, what, unit, value))
    })
}

/// The middle of the record's temperatures and how far they reach from there, with the margin, degC.
fn temperatures(model: &ModelFile) -> [f64; 2] {
    let setting = |key: &str, default: f64| *model.excitation.get(key).unwrap_or(&default);
    let swings = ["self_heating_degc", "drift_degc", "heater_degc"].map(|key| setting(key, 0.0));
    let mean = setting("ambient_degc", TEMP_ZERO_C) + swings.iter().sum::<f64>() / 2.0;
    let reach = swings.iter().map(|swing| swing.abs()).sum::<f64>() / 2.0 + MARGIN_C;
    [mean, reach]
}

/// As a correction says it.
fn temp_range(mean_c: f64, reach_c: f64) -> [i8; 2] {
    let in_steps = |c: f64| (c - TEMP_ZERO_C) / TEMP_LSB_C / f64::from(RANGE_STEP);
    [
        in_steps(mean_c - reach_c).floor() as i8,
        in_steps(mean_c + reach_c).ceil() as i8,
    ]
}

/// What the filter is told: the shortest block whose memory it can hold, up to a second, and the noise in it. By axis N^2 and K^2 of all
/// that walks.
fn filter(out: &mut Correction, rate_hz: f64, [density, walks]: [[f64; 3]; 2]) -> Vec<String> {
    // Growth of the variance in a block, over that of its mean: a filter at rest remembers the inverse root of it, in blocks.
    let growth = |axis: usize, shift: u8| {
        let block_s = f64::from(1u32 << shift) / rate_hz;
        walks[axis] * block_s / (density[axis] / block_s)
    };
    let all = |shift: u8, is: &dyn Fn(f64) -> bool| (0..3).all(|axis| is(growth(axis, shift)));
    let holds = |shift: &u8| all(*shift, &|g| g == 0.0 || g.sqrt() >= 1.0 / MOST_BLOCKS);
    let follows = |shift: &u8| all(*shift, &|g| g <= MOST_WALK);
    // Axes may walk so differently that no block is right for all: then the fastest can still be followed.
    let is_short = |shift: &u8| f64::from(1u32 << shift) / rate_hz <= LONGEST_BLOCK_S;
    let longest = (SHORTEST_BLOCK..=BLOCK_SHIFT_MAX).rfind(is_short);
    let shifts = SHORTEST_BLOCK..=longest.unwrap_or(SHORTEST_BLOCK);
    out.block_shift = (shifts.clone().filter(follows).find(holds))
        .or_else(|| shifts.rev().find(follows))
        .unwrap_or(SHORTEST_BLOCK);
    let block_s = f64::from(1u32 << out.block_shift) / rate_hz;
    let mut notes = Vec::new();
    for axis in 0..3 {
        out.noise[axis] = density[axis] / block_s;
        let walk = growth(axis, out.block_shift);
        if walk > MOST_WALK {
            notes.push(format!(
                "the bias of {} walks faster than the board's filter can follow",
                GYROS[axis]
            ));
        }
        out.walk[axis] = walk.clamp(LEAST_WALK, MOST_WALK) * out.noise[axis];
    }
    notes
}

/// As it is stored. What a count of supply or acceleration is worth is rounded before the constant that goes with it is.
fn rounded(out: &mut Correction, supply_v: f64) -> Result<correction::Numbers, BoardError> {
    let numbers = out.numbers().map_err(BoardError::OutOfRange)?;
    let stored = Correction::from_numbers(&numbers).unwrap_or(*out);
    for axis in 0..3 {
        let supply_counts = supply_v / SUPPLY_LSB_V;
        out.bias[axis] -= (stored.supply[axis] - out.supply[axis]) * supply_counts;
        for k in 0..3 {
            out.bias[axis] -= (stored.acc[axis][k] - out.acc[axis][k]) * ACC_ZERO;
        }
    }
    out.numbers().map_err(BoardError::OutOfRange)
}

/// Whether the rounding of every term is small against what the noise leaves of a mean.
fn judge(
    meant: &Correction,
    rounded: &Correction,
    density: &[f64; 3],
    reach_temp: f64,
) -> Result<(), BoardError> {
    for (axis, letter) in ['x', 'y', 'z'].into_iter().enumerate() {
        let allowed = SHARE_OF_NOISE * (density[axis] / JUDGED_OVER_S).sqrt();
        let of = |a: &[f64; 3], b: &[f64; 3], reach: f64| (a[axis] - b[axis]).abs() * reach;
        let mut terms = vec![
            ("bias", of(&meant.bias, &rounded.bias, 1.0)),
            (
                "temperature",
                of(&meant.temperature, &rounded.temperature, reach_temp),
            ),
            (
                "temperature squared",
                of(
                    &meant.temperature_squared,
                    &rounded.temperature_squared,
                    reach_temp.powi(2),
                ),
            ),
            ("motor", of(&meant.motor, &rounded.motor, FULL_DUTY)),
            (
                "motor by magnitude",
                of(&meant.motor_magnitude, &rounded.motor_magnitude, FULL_DUTY),
            ),
            (
                "motor as it turns",
                of(&meant.motor_turning, &rounded.motor_turning, 1.0),
            ),
            ("supply", of(&meant.supply, &rounded.supply, REACH_SUPPLY)),
            // It lasts for a small part of the time, and at full duty at the most.
            ("surge", of(&meant.surge, &rounded.surge, FULL_DUTY)),
        ];
        for k in 0..3 {
            let share = (meant.matrix[axis][k] - rounded.matrix[axis][k]).abs();
            terms.push(("share of a rate", share * REACH_RATE_DPS));
            let acc = (meant.acc[axis][k] - rounded.acc[axis][k]).abs();
            terms.push(("acceleration", acc * ACC_COUNTS_PER_G));
        }
        if let Some(&(what, off)) = terms.iter().find(|(_, off)| *off > allowed) {
            return Err(BoardError::TooCoarse {
                what,
                axis: letter,
                off,
                allowed,
            });
        }
    }
    Ok(())
}

/// The number that corrected frames tell: of the model's text, so that another model has another one.
fn number_of(model: &ModelFile) -> u16 {
    let crc = wire::crc::crc32c(model.to_toml().as_bytes());
    ((crc >> 16) as u16) ^ crc as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    fn model(effects: &str) -> ModelFile {
        let mut text = ModelFile::paper().to_toml();
        text.push_str(effects);
        ModelFile::parse(&text).expect("a model")
    }

    const SENS_AVG: u16 = 0x0402;

    #[test]
    fn the_papers_stand_is_the_filter_alone() {
        let board = BoardCorrection::of(&ModelFile::paper(), SENS_AVG).unwrap();
        let c = board.correction;
        assert_eq!(
            (c.temperature, c.motor, c.matrix),
            ([0.0; 3], [0.0; 3], [[0.0; 3]; 3])
        );
        // N^2 over 0.8 s, K^2 times 0.8 s.
        assert!((c.noise[0] - (5.27f64 / 60.0).powi(2) / 0.8).abs() < 1e-9);
        assert!((c.walk[0] - 0.0015f64.powi(2) * 0.8).abs() < 1e-12);
        assert!(board.notes.is_empty());
    }

    #[test]
    fn axes_that_walk_at_different_paces_get_the_block_that_follows_the_fastest() {
        let mut model = ModelFile::paper();
        for (channel, k) in model.channels.iter_mut().zip([0.0032, 1e-6, 0.0]) {
            if let Some(walk) = channel.baseline.get_mut("rate_random_walk") {
                walk.value = k;
            }
        }
        let board = BoardCorrection::of(&model, SENS_AVG).unwrap();
        let c = board.correction;
        let growth = c.walk[0] / c.noise[0];
        let block_s = f64::from(1u32 << c.block_shift) / 20.0;
        assert!((growth.sqrt() - 0.0032 * block_s / (5.27 / 60.0)).abs() < 1e-6);
        assert!(board.notes.is_empty());
        // Beyond what is stored, the fastest that there is.
        for (noise, k) in [(5.27, 0.3), (4.1, 0.02), (5.271, 0.008), (3.777, 0.0071)] {
            for (key, value) in [("angle_random_walk", noise), ("rate_random_walk", k)] {
                if let Some(parameter) = model.channels[0].baseline.get_mut(key) {
                    parameter.value = value;
                }
            }
            let board = BoardCorrection::of(&model, SENS_AVG).unwrap();
            let note = &board.notes[0];
            assert!(note.contains("gyro_x walks faster"), "{note}");
        }
    }

    #[test]
    fn a_walk_too_slow_to_be_told_from_none_takes_no_more_of_a_rest_than_none_does() {
        let block = |k: f64, rate_hz: f64| {
            let mut model = ModelFile {
                rate_hz,
                ..ModelFile::paper()
            };
            for channel in &mut model.channels {
                if let Some(walk) = channel.baseline.get_mut("rate_random_walk") {
                    walk.value = k;
                }
            }
            let board = BoardCorrection::of(&model, SENS_AVG).unwrap();
            board.correction.block_shift
        };
        assert_eq!(
            [block(0.0, 20.0), block(1e-5, 20.0), block(4e-4, 20.0)],
            [4; 3]
        );
        // Up to a second at any rate.
        assert_eq!([block(1e-5, 100.0), block(1e-5, 256.0)], [6, 7]);
    }

    #[test]
    fn what_a_model_adds_is_taken_off_with_its_sign_turned() {
        let board = BoardCorrection::of(
            &model(
                "[[effect]]\ncause = \"temperature\"\nchannels = [\"gyro_y\"]\nslope = { value = 0.2, unit = \"deg/s/degC\" }\n\
                 [[effect]]\ncause = \"cross_axis\"\nchannels = [\"gyro_x\"]\nfrom_gyro_z = { value = 0.03, unit = \"1\" }\n\
                 [[effect]]\ncause = \"line\"\nchannels = [\"gyro_x\"]\nfrequency = { value = 3.0, unit = \"Hz\" }\namplitude = { value = 0.1, unit = \"deg/s\" }\n",
            ),
            SENS_AVG,
        )
        .unwrap();
        let c = board.correction;
        assert!((c.temperature[1] + 0.2 * TEMP_LSB_C).abs() < 1e-12);
        assert!((c.matrix[0][2] + 0.03).abs() < 1e-12);
        assert_eq!(board.notes, ["line: the board has no term for it"]);
        assert!(board.table().contains("temperature"), "{}", board.table());
    }

    #[test]
    fn the_surge_behind_a_step_of_the_motor_is_the_models_sample_by_sample() {
        let board = BoardCorrection::of(
            &model(
                "[[effect]]\ncause = \"motor_bias\"\nchannels = [\"gyro_z\"]\nat_full_duty = { value = 0.5, unit = \"deg/s\" }\n\
                 surge_at_full_duty = { value = 1.5, unit = \"deg/s\" }\nsurge_time = { value = 0.2, unit = \"s\" }\n",
            ),
            SENS_AVG,
        )
        .unwrap();
        // A step to full duty at 20 Hz: the means over each sample of 1.5 exp(-t / 0.2 s).
        let (c, mut speed) = (board.correction, 0.0);
        for n in 0..20 {
            let at = |t: f64| -1.5 * 0.2 / 0.05 * (-t / 0.2).exp();
            let mean = at(0.05 * f64::from(n + 1)) - at(0.05 * f64::from(n));
            let ahead = 255.0 - speed;
            assert!((c.surge[2] * ahead + mean).abs() < 1e-9, "{n}");
            speed += c.follow * ahead;
        }
        assert_eq!((c.surge[0], board.notes.len()), (0.0, 0));
        let stored = Correction::from_numbers(&board.numbers).unwrap();
        assert!((stored.follow - c.follow).abs() < 2e-5);
    }

    #[test]
    fn what_does_not_fit_and_what_has_no_noise_is_refused_by_name() {
        let steep = model(
            "[[effect]]\ncause = \"temperature\"\nchannels = [\"gyro_z\"]\nslope = { value = 3.0, unit = \"deg/s/degC\" }\n",
        );
        let error = BoardCorrection::of(&steep, SENS_AVG).unwrap_err();
        assert!(
            error
                .to_string()
                .starts_with("temperature of gyro z: -0.435900 deg/s/count is outside"),
            "{error}"
        );
        let mut silent = ModelFile::paper();
        silent.channels[1].baseline.remove("angle_random_walk");
        let error = BoardCorrection::of(&silent, SENS_AVG).unwrap_err();
        assert_eq!(error, BoardError::NoNoise { channel: "gyro_y" });
        // A noise of 1e-4 deg/sqrt(h) would show a rounding of 2^-21 deg/s in the bias.
        let mut fine = ModelFile::paper();
        for channel in &mut fine.channels {
            for key in ["angle_random_walk", "bias"] {
                if let Some(value) = channel.baseline.get_mut(key) {
                    value.value = if key == "bias" { 0.123_456_7 } else { 1e-4 };
                }
            }
        }
        let error = BoardCorrection::of(&fine, SENS_AVG).unwrap_err();
        assert!(
            matches!(
                error,
                BoardError::TooCoarse { .. } | BoardError::OutOfRange(_)
            ),
            "{error}"
        );
    }
}
