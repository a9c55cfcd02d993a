//! Foreign effects kept back from the engine, twelfth set (2026-11-22): the twenty ideas that the tenth and the eleventh set
//! had left of the sixty that were written down before any file of this project was read. None was left out. Once all was
//! written, each turned out to have a near twin: [`TWINS`]. None was diagnosed while they were written, and the engine's code
//! was not read; the earlier sets were, for their shape, and `report/names.md` came in sight. The tests of `library_share`
//! hold that no effect of the library describes them, nor, where they are signals, a sum of two.
//!
//! Where the table's rate matters, the part turns with the table, and the rate of the table's encoder has been taken off, as
//! in the tenth set.

use std::f64::consts::TAU;

use super::kept_back_eleventh::{changes, ramped};
use super::kept_back_fifth::from_trim;
use super::kept_back_fourth::{about_mean, cycles};
use super::kept_back_ninth::resonating;
use super::kept_back_seventh::{lamp, lit, without_line};
use super::kept_back_sixth::in_steps;
use super::kept_back_tenth::{DWELL, angle_of_table, programme, rate_of_table};
use super::{Foreign, PLAIN, Set, extremes, of_signal};
use crate::random::Draw;
use crate::stand::{Stand, lagged, wander};

pub(super) mod codes;
pub(super) mod noise;
mod periods;

/// Their names, in the order in which they were listed.
pub const NAMES: [&str; 20] = [
    "rotation of the ground by the table's heading",
    "quadrature that leaks as the demodulator warms",
    "structure that rings after each change of the command",
    "chipped ball of the table's bearing",
    "gear that errs once a turn",
    "compensation table whose entries are off",
    "gain of one that cuts toward zero",
    "axis that reads its neighbour for a while",
    "converter whose line is wavy",
    "bias by the pace of the warming",
    "bias by the table's angular acceleration",
    "coupling capacitor in the signal's way",
    "package that softens at one temperature",
    "bursts of a bus every few seconds",
    "mains hum that wanders",
    "die that follows its thermometer late",
    "moisture that diffuses in and out",
    "drive loop that loses its lock",
    "draught of the air conditioning",
    "despiker that takes the median",
];

/// Those of them that have a near twin in an earlier set, with the one that is nearest: the same kind of signal or of law
/// by the same kind of cause, sizes and pace apart. What is in doubt counts as one, and all do. Looked for once all was
/// written.
const TWINS: [(&str, &str); 20] = [
    (
        "rotation of the ground by the table's heading",
        "bias by the heading of the table",
    ),
    (
        "quadrature that leaks as the demodulator warms",
        "tone of a bridge that warmth unbalances",
    ),
    (
        "structure that rings after each change of the command",
        "kick by each change of the motor's current",
    ),
    (
        "chipped ball of the table's bearing",
        "pit in the table's bearing",
    ),
    ("gear that errs once a turn", "wobble of the table"),
    (
        "compensation table whose entries are off",
        "teeth of a table over temperature",
    ),
    (
        "gain of one that cuts toward zero",
        "dead zone of a push-pull stage",
    ),
    (
        "axis that reads its neighbour for a while",
        "frames that hold another axis",
    ),
    (
        "converter whose line is wavy",
        "uneven steps of the converter",
    ),
    ("bias by the pace of the warming", "rate of temperature"),
    (
        "bias by the table's angular acceleration",
        "axis that is converted late",
    ),
    (
        "coupling capacitor in the signal's way",
        "noise that a loop holds down",
    ),
    (
        "package that softens at one temperature",
        "temperature that saturates",
    ),
    ("bursts of a bus every few seconds", "bursts of noise"),
    ("mains hum that wanders", "tone whose pitch wanders"),
    (
        "die that follows its thermometer late",
        "gradient across the part",
    ),
    (
        "moisture that diffuses in and out",
        "pressure behind a valve",
    ),
    ("drive loop that loses its lock", "jumps that relax"),
    (
        "draught of the air conditioning",
        "amplitude loop that hunts",
    ),
    (
        "despiker that takes the median",
        "far readings put between their neighbours",
    ),
];

/// The set.
pub(super) const SET: Set = Set {
    names: &NAMES,
    twins: &TWINS,
    parts,
    on_axis,
    one,
    ..PLAIN
};

/// The axis it acts on where another cannot be: a table that turns about z takes the level axes through the headings.
fn on_axis(name: &str, axis: usize) -> usize {
    if name == NAMES[0] { axis.min(1) } else { axis }
}

/// Causes of the library that are a true part of it: the straight line through a bent or stepped law of temperature,
/// through a late one, and through a product whose other factor is not exactly 0 in the mean; the surge that a change of the
/// rate resembles; another axis's size of noise while it is read; the correlation of neighbours that a median leaves.
fn parts(name: &str) -> &'static [&'static str] {
    match name {
        "quadrature that leaks as the demodulator warms"
        | "compensation table whose entries are off"
        | "package that softens at one temperature"
        | "die that follows its thermometer late" => &["temperature"],
        "bias by the table's angular acceleration" => &["motor_bias"],
        "axis that reads its neighbour for a while" => &["noise_change"],
        "despiker that takes the median" => &["low_pass"],
        _ => &[],
    }
}

/// One of them; `None` for another name. The world of the stand may gain what drives it.
fn one(
    draw: &mut Draw,
    stand: &mut Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
) -> Option<Foreign> {
    let unit = match name {
        "rotation of the ground by the table's heading" => ground(draw, stand),
        "quadrature that leaks as the demodulator warms" => quadrature(draw, stand, axis),
        "structure that rings after each change of the command" => structure(draw, stand),
        "chipped ball of the table's bearing" => chipped(draw, stand),
        "gear that errs once a turn" => gear(draw, stand),
        "compensation table whose entries are off" => entries(draw, stand, axis),
        "bias by the pace of the warming" => warming(draw, stand, axis),
        "bias by the table's angular acceleration" => acceleration(draw, stand),
        "package that softens at one temperature" => softens(draw, stand, axis),
        "mains hum that wanders" => periods::hum(draw, stand),
        "die that follows its thermometer late" => die(draw, stand, axis),
        "moisture that diffuses in and out" => periods::moisture(draw, stand),
        "drive loop that loses its lock" => periods::lock(draw, stand),
        "draught of the air conditioning" => periods::draught(draw, stand),
        _ => {
            return noise::one(draw, stand, name, axis, wanted)
                .or_else(|| codes::one(draw, stand, name, axis, wanted));
        }
    };
    Some(of_signal(stand, name, axis, &unit, wanted))
}

/// How long an indexed table rests at a heading, s.
const RESTS: (f64, f64) = (1.5, 7.0);

/// Commands of a table that is indexed: it rests at a heading, and goes on by a few parts of a turn, either way.
fn indexed(draw: &mut Draw, stand: &mut Stand, full: f64) {
    let part = 1.0 / [4.0, 6.0, 8.0, 12.0][draw.of_many(4)];
    let mut duty = Vec::with_capacity(stand.samples());
    while duty.len() < stand.samples() {
        let rests = (draw.between(RESTS.0, RESTS.1) * stand.rate_hz) as usize;
        duty.extend(std::iter::repeat_n(0.0, rests));
        let (turn, level) = (part * (1 + draw.of_many(3)) as f64, draw.between(0.3, 1.0));
        let takes = (turn / full / level * stand.rate_hz).ceil();
        let command = in_steps(draw.sign() * turn / full / takes * stand.rate_hz);
        duty.extend(std::iter::repeat_n(command, takes as usize));
    }
    duty.truncate(stand.samples());
    stand.world.duty = duty;
}

/// What the ground turns by, seen by a level axis: the sine of the heading, from north. The earth's own 4e-3 deg/s are too
/// little for a part of this class; as strong as asked for, it is a turning platform that carries a leaning table.
fn ground(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let full = draw.by_ratio(0.2, 0.5);
    indexed(draw, stand, full);
    let rate = rate_of_table(draw, stand);
    let north = draw.between(0.0, TAU);
    angle_of_table(&rate, full, stand.rate_hz)
        .iter()
        .map(|angle| (angle - north).sin())
        .collect()
}

/// Quadrature, which wanders, leaks into the rate by the sine of the demodulator's phase error. That was trimmed at one
/// temperature and goes with what the temperature is off it.
fn quadrature(draw: &mut Draw, stand: &mut Stand, axis: usize) -> Vec<f64> {
    cycles(draw, stand);
    let tau = draw.by_ratio(2.0, 20.0);
    let wanders = wander(draw, stand.samples(), stand.rate_hz, 1.0, tau);
    let phase = from_trim(draw, stand, axis);
    wanders.iter().zip(&phase).map(|(q, p)| q * p).collect()
}

/// The structure that carries the motor has a mode, little damped, that each change of its torque strikes.
fn structure(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    programme(draw, stand, DWELL);
    let mode = (draw.by_ratio(0.8, 9.0), draw.by_ratio(0.03, 0.3));
    resonating(&changes(&stand.world.duty), mode, stand.rate_hz)
}

/// How often each reading passes one of so many places of a turn, which lie at equal angles.
pub(super) fn passes(angle: &[f64], per_turn: f64, first: f64) -> Vec<f64> {
    let places: Vec<f64> = angle
        .iter()
        .map(|a| (a / TAU * per_turn + first).floor())
        .collect();
    changes(&places).iter().map(|c| c.abs()).collect()
}

/// A chipped ball of the table's bearing strikes the races at fixed angles, a few times a turn and never a whole number, the
/// harder the faster; each stroke is a short ring of the bearing.
fn chipped(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    programme(draw, stand, DWELL);
    let rate = rate_of_table(draw, stand);
    let (full, per_turn) = (draw.by_ratio(0.4, 1.2), draw.between(2.2, 5.8));
    let angle = angle_of_table(&rate, full, stand.rate_hz);
    let strokes = passes(&angle, per_turn, draw.between(0.0, 1.0));
    let hard: Vec<f64> = strokes.iter().zip(&rate).map(|(s, r)| s * r).collect();
    let mode = (draw.between(2.0, 8.0), draw.by_ratio(0.8, 2.5));
    resonating(&hard, mode, stand.rate_hz)
}

/// A toothed wheel or a pulley out of centre: the table runs ahead and behind by a share of its rate, which the encoder on
/// the motor does not see, once a turn, and by less twice and thrice.
fn gear(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    programme(draw, stand, DWELL);
    let rate = rate_of_table(draw, stand);
    let full = draw.by_ratio(0.1, 0.6);
    let waves: [(f64, f64); 3] = std::array::from_fn(|k| {
        let most = if k == 0 { 1.0 } else { draw.between(0.1, 0.5) };
        (most, draw.between(0.0, TAU))
    });
    let angle = angle_of_table(&rate, full, stand.rate_hz);
    let ahead = |angle: f64| -> f64 {
        let wave = |(k, (size, first)): (f64, &(f64, f64))| size * (k * angle + first).cos();
        [1.0, 2.0, 3.0].into_iter().zip(&waves).map(wave).sum()
    };
    angle
        .iter()
        .zip(&rate)
        .map(|(a, r)| r * ahead(*a))
        .collect()
}

/// A compensation by a table over temperature without interpolation: at each boundary the bias jumps, and each entry has an
/// error of its own beside what the temperature does within its reach. The straight line is right.
fn entries(draw: &mut Draw, stand: &mut Stand, axis: usize) -> Vec<f64> {
    cycles(draw, stand);
    let own = &stand.world.temperature[axis];
    let (low, high) = extremes(own);
    let wide = (high - low).max(1e-9) / draw.between(4.0, 10.0);
    let (first, slope) = (draw.between(0.0, 1.0), draw.between(-1.0, 1.0));
    let errors: [f64; 12] = std::array::from_fn(|_| draw.normal());
    let off = |t: &f64| {
        let place = (t - low) / wide + first;
        errors[(place as usize).min(errors.len() - 1)] + slope * (place.fract() - 0.5)
    };
    without_line(&own.iter().map(off).collect::<Vec<f64>>(), own)
}

/// Heat that flows through the package bends it: by the pace at which the temperature rises, behind two of its layers.
fn warming(draw: &mut Draw, stand: &mut Stand, axis: usize) -> Vec<f64> {
    lamp(draw, stand);
    let pace = changes(&stand.world.temperature[axis]);
    let layer = draw.by_ratio(0.3, 1.0);
    let flows = lagged(&lagged(&pace, layer, stand.rate_hz), layer, stand.rate_hz);
    let sign = draw.sign();
    flows.iter().map(|f| sign * f).collect()
}

/// A mass that is not balanced about the table's axis: the bias goes with the angular acceleration. The table's drive ramps
/// from rate to rate, and its shaft winds up and unwinds, so that the acceleration comes and goes softly.
fn acceleration(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    programme(draw, stand, DWELL);
    let drive = ramped(&stand.world.duty, draw.by_ratio(0.15, 0.6), stand.rate_hz);
    let rate = lagged(&drive, draw.by_ratio(0.2, 0.8), stand.rate_hz);
    let sign = draw.sign();
    changes(&rate).iter().map(|c| sign * c).collect()
}

/// The glass point of a moulding compound: beyond it the package strains the element by another slope. The part was
/// compensated by a straight line.
fn softens(draw: &mut Draw, stand: &mut Stand, axis: usize) -> Vec<f64> {
    cycles(draw, stand);
    let own = &stand.world.temperature[axis];
    let (low, high) = extremes(own);
    // Not in the middle, where a parabola comes near it.
    let from_end = draw.between(0.15, 0.35);
    let share = if draw.chance(0.5) {
        from_end
    } else {
        1.0 - from_end
    };
    let at = low + (high - low) * share;
    let sign = draw.sign();
    let beyond: Vec<f64> = own.iter().map(|t| sign * (t - at).max(0.0)).collect();
    without_line(&beyond, own)
}

/// The thermometer sits at the heater, and the die far behind it. By minutes it would be, but what moves so slowly stays weak
/// beside a random walk (d' 12): a small heater that is switched within seconds, and a die that is as late.
fn die(draw: &mut Draw, stand: &mut Stand, axis: usize) -> Vec<f64> {
    lit(draw, stand, (1.5, 8.0), (1.0, 3.0));
    let own = &stand.world.temperature[axis];
    let late = lagged(own, draw.by_ratio(2.0, 8.0), stand.rate_hz);
    let sign = draw.sign();
    about_mean(&late).iter().map(|t| sign * t).collect()
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::foreign::kept_back_tenth::tests::largest_change;
    use crate::foreign::swing;
    use crate::stand::Needs;

    pub(super) fn stand(index: u64) -> (Draw, Stand) {
        let mut draw = Draw::of(20_261_122, 130, index);
        let stand = Stand::draw(&mut draw, 600.0, 20.0, Needs::default());
        (draw, stand)
    }

    /// Correlation of two series.
    pub(in super::super) fn alike(a: &[f64], b: &[f64]) -> f64 {
        let (a, b) = (about_mean(a), about_mean(b));
        let of = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| x * y).sum::<f64>();
        of(&a, &b) / (of(&a, &a) * of(&b, &b)).sqrt()
    }

    #[test]
    fn a_level_axis_sees_the_sine_of_a_heading_at_which_the_table_rests() {
        let (mut draw, mut stand) = stand(0);
        let y = ground(&mut draw, &mut stand);
        assert!(y.iter().all(|v| v.abs() <= 1.0) && swing(&y) > 1.0);
        // The motor takes 1.5 s at most: 5 s after it was stopped, and 2 s after it was started.
        let (mut rested, mut turned) = (vec![], vec![]);
        for (y, w) in y[99..].windows(2).zip(stand.world.duty.windows(101)) {
            let change = (y[1] - y[0]).abs();
            if w.iter().all(|d| *d == 0.0) {
                rested.push(change);
            } else if w[60..].iter().all(|d| *d != 0.0) {
                turned.push(change);
            }
        }
        let most = |all: &[f64]| all.iter().copied().fold(0.0, f64::max);
        assert!(rested.len() > 50 && turned.len() > 50);
        assert!(most(&rested) < 0.2 * most(&turned));
        assert_eq!([0, 1, 2].map(|axis| on_axis(NAMES[0], axis)), [0, 1, 1]);
        assert_eq!(on_axis(NAMES[1], 2), 2);
    }

    #[test]
    fn quadrature_does_not_leak_at_the_temperature_of_the_trim() {
        let (mut draw, mut stand) = stand(1);
        let y = quadrature(&mut draw, &mut stand, 0);
        let own = about_mean(&stand.world.temperature[0]);
        let span = swing(&own);
        let most = |near: &dyn Fn(f64) -> bool| {
            let pairs = y.iter().zip(&own).filter(|(_, t)| near(**t));
            pairs.map(|(y, _)| y * y).sum::<f64>()
                / own.iter().filter(|t| near(**t)).count().max(1) as f64
        };
        // The trim lies within a tenth of the span of the mean.
        let (at_trim, far) = (
            most(&|t| t.abs() < 0.1 * span),
            most(&|t| t.abs() > 0.3 * span),
        );
        assert!(far > 3.0 * at_trim, "{at_trim} {far}");
    }

    #[test]
    fn a_structure_is_still_until_it_is_struck_and_rings_both_ways() {
        let (mut draw, mut stand) = stand(2);
        let y = structure(&mut draw, &mut stand);
        let first = stand.world.duty.windows(2).position(|w| w[0] != w[1]);
        let first = first.expect("a programme changes");
        assert!(y[..=first].iter().all(|v| *v == 0.0));
        let (low, high) = extremes(&y[first..first + 60]);
        assert!(low < 0.0 && high > 0.0);
        // Without a further stroke it only dies away.
        let calm = stand.world.duty[first + 2..].windows(60);
        let at = calm.enumerate().find(|(_, w)| w.iter().all(|d| *d == w[0]));
        let at = first + 2 + at.expect("a dwell of 3 s").0;
        assert!(swing(&y[at + 40..at + 60]) < swing(&y[at..at + 60]));
    }

    #[test]
    fn a_ball_strikes_at_equal_angles_and_not_at_rest() {
        let angle: Vec<f64> = (0..4000).map(|i| 0.01 * TAU * f64::from(i)).collect();
        let strokes = passes(&angle, 3.7, 0.2);
        let at: Vec<usize> = (0..4000).filter(|i| strokes[*i] > 0.0).collect();
        assert_eq!(at.len(), (0.2 + 3.7 * 39.99f64).floor() as usize);
        for (k, i) in at.iter().enumerate() {
            // The turn at which the place comes, in hundredths.
            let turn = ((k + 1) as f64 - 0.2) / 3.7;
            assert!((*i as f64 - 100.0 * turn).abs() <= 1.01, "{k} {i} {turn}");
        }
        let back: Vec<f64> = angle.iter().rev().copied().collect();
        let again = passes(&back, 3.7, 0.2).iter().sum::<f64>();
        assert_eq!(again, at.len() as f64);
        assert!(passes(&[1.0; 100], 3.7, 0.2).iter().all(|s| *s == 0.0));
    }

    #[test]
    fn a_gear_runs_ahead_as_far_as_it_falls_behind() {
        let (mut draw, mut stand) = stand(4);
        let y = gear(&mut draw, &mut stand);
        // What it is ahead, in angle, does not add up over the turns: it is a function of the angle.
        let mut ahead = 0.0f64;
        let (mut most, mut whole) = (0.0f64, 0.0);
        for v in &y {
            ahead += v / stand.rate_hz;
            most = most.max(ahead.abs());
            whole += v.abs() / stand.rate_hz;
        }
        assert!(most < 0.2 * whole, "{most} {whole}");
        let rests = stand.world.duty.windows(60);
        for (y, w) in y[59..].iter().zip(rests) {
            assert!(w.iter().any(|d| *d != 0.0) || y.abs() < 0.3);
        }
    }

    #[test]
    fn a_compensation_table_jumps_at_few_temperatures() {
        let (mut draw, mut stand) = stand(5);
        let y = entries(&mut draw, &mut stand, 2);
        let own = &stand.world.temperature[2];
        let wide = swing(own);
        let mut at: Vec<f64> = vec![];
        for (y, t) in y.windows(2).zip(own.windows(2)) {
            if (y[1] - y[0]).abs() > 0.3 {
                at.push(0.5 * (t[0] + t[1]));
            }
        }
        at.sort_by(f64::total_cmp);
        let places = at.chunk_by(|a, b| b - a < 0.03 * wide).count();
        assert!(
            at.len() > 20 && (2..11).contains(&places),
            "{} {places}",
            at.len()
        );
    }

    #[test]
    fn a_bias_by_the_pace_of_warming_sums_to_the_temperature() {
        let (mut draw, mut stand) = stand(6);
        let y = warming(&mut draw, &mut stand, 1);
        let own = &stand.world.temperature[1];
        let mut sum = 0.0;
        let summed: Vec<f64> = y
            .iter()
            .map(|v| {
                sum += v;
                sum
            })
            .collect();
        // But for what warms while it comes late, two seconds at most.
        let sign = if alike(&summed, own) > 0.0 { 1.0 } else { -1.0 };
        assert!(sign * alike(&summed, own) > 0.8);
        assert!(alike(&y, own).abs() < 0.5);
    }

    #[test]
    fn an_angular_acceleration_sums_to_the_rate_and_comes_softly() {
        let (mut draw, mut stand) = stand(7);
        let y = acceleration(&mut draw, &mut stand);
        let sum: f64 = y.iter().sum();
        assert!(
            sum.abs() <= 2.0,
            "the table gets no faster than full: {sum}"
        );
        let most = y.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        // The drive's ramp is 0.6 a second at most, and takes some samples to come.
        assert!(most <= 0.6 / stand.rate_hz && largest_change(&y) < 0.5 * most);
    }

    #[test]
    fn a_package_that_softens_has_two_slopes() {
        let (mut draw, mut stand) = stand(8);
        let y = softens(&mut draw, &mut stand, 0);
        let own = &stand.world.temperature[0];
        let mut all: Vec<(f64, f64)> = own.iter().copied().zip(y).collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        let slopes: Vec<f64> = all
            .windows(2)
            .filter(|w| w[1].0 - w[0].0 > 1e-6)
            .map(|w| (w[1].1 - w[0].1) / (w[1].0 - w[0].0))
            .collect();
        let (first, last) = (slopes[0], slopes[slopes.len() - 1]);
        let of_either = |s: &&f64| (**s - first).abs() < 1e-3 || (**s - last).abs() < 1e-3;
        assert!(((first - last).abs() - 1.0).abs() < 1e-3, "{first} {last}");
        // One pair may lie on either side of the point.
        assert!(slopes.iter().filter(of_either).count() + 1 >= slopes.len());
    }

    #[test]
    fn a_die_comes_later_than_its_thermometer() {
        let (mut draw, mut stand) = stand(9);
        let y = die(&mut draw, &mut stand, 0);
        let own = &stand.world.temperature[0];
        // It moves as the thermometer is off it: the slope is one over the lag.
        let pace = changes(&y);
        let level = |sign: f64| -> f64 {
            let off: Vec<f64> = own.iter().zip(&y).map(|(t, y)| sign * t - y).collect();
            alike(&pace, &off)
        };
        assert!(level(1.0).max(level(-1.0)) > 0.99);
        // It goes with what the thermometer told a second ago rather than with what it tells.
        let second = stand.rate_hz as usize;
        let (now, then) = (
            alike(&y, own),
            alike(&y[second..], &own[..own.len() - second]),
        );
        assert!(then.abs() > now.abs() + 0.02, "{now} {then}");
    }
}
