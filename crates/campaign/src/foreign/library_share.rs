//! How much of what a foreign effect adds to the likelihood the closest effect of the library describes. From 95 % on it
//! would not be foreign.

use std::f64::consts::TAU;

use analysis::likelihood::Dct;
use analysis::optimise::nelder_mead;
use model::effect::{Column, Effect, Hypothesis, Signal, VarianceLaw, View};
use model::effects::EFFECTS;
use model::record::{Axis, Base, Quantity};

use super::kept_back::{self, of_law, shares};
use super::{Change, LARGEST_RMS, foreign, rms};
use crate::random::Draw;
use crate::stand::{LSB, Stand};
use crate::strength::{Meter, of_variance};

mod codes;
mod eighth;
mod eleventh;
mod fifth;
mod fourteenth;
mod fourth;
mod ninth;
mod second;
mod seventh;
mod sixth;
mod tenth;
mod third;
mod thirteenth;
mod twelfth;

/// Share of the gain from which an effect of the library describes it.
const DESCRIBED: f64 = 0.95;
/// Draws of each effect that are looked at.
const DRAWS: u64 = 3;

/// Draws of each signal that is held against the sum of two effects as well, which takes seconds each.
const SIGNAL_DRAWS: u64 = 1;
/// Draws of each by which it is seen how strong it comes.
const STRENGTHS: u64 = 8;

fn stand(draw: &mut Draw, name: &str) -> Stand {
    Stand::draw(draw, 600.0, 20.0, super::needs(name))
}

/// The signals of a stand, as an effect sees them, without reading noise.
fn signals(stand: &Stand) -> Vec<Signal> {
    let signal = |name: &str, quantity, axis: Option<usize>, values: Vec<f64>| Signal {
        name: name.to_owned(),
        quantity,
        axis: axis.map(|i| Axis::ALL[i]),
        unit: String::new(),
        smooth: values.clone().into(),
        values: values.into(),
        lsb: None,
        moving: false,
    };
    let scaled = |v: &[f64], by: f64| v.iter().map(|x| x * by).collect::<Vec<_>>();
    let mut all = vec![
        signal("supply", Quantity::Supply, None, stand.world.supply.clone()),
        signal("pwm", Quantity::Pwm, None, scaled(&stand.world.duty, 255.0)),
    ];
    for (i, letter) in ["x", "y", "z"].iter().enumerate() {
        let own = stand.world.temperature[i].clone();
        all.push(signal(
            &format!("temp_{letter}"),
            Quantity::Temp,
            Some(i),
            own,
        ));
        let force = scaled(&stand.world.acc[i], 9.80665);
        all.push(signal(
            &format!("acc_{letter}"),
            Quantity::Acc,
            Some(i),
            force,
        ));
    }
    all
}

fn hypotheses(effect: &dyn Effect, stand: &Stand, axis: usize) -> Vec<Hypothesis> {
    let all = signals(stand);
    let view = View {
        channel: crate::stand::GYROS[axis],
        axis: Some(Axis::ALL[axis]),
        lsb: Some(LSB),
        white_sigma: stand.white(axis).sqrt(),
        rate_hz: stand.rate_hz,
        samples: stand.samples(),
        base: Some(Base::Static),
        moving: false,
        signals: &all,
    };
    effect.hypotheses(&view).unwrap_or_default()
}

/// Columns of an effect's regressions. What is at most a part of another comes with it, nothing of it or all that it may be
/// either way.
fn within_bounds(effect: &dyn Effect, all: &[Column]) -> Vec<Vec<Vec<f64>>> {
    let (parts, whole): (Vec<&Column>, Vec<&Column>) = all
        .iter()
        .partition(|c| effect.at_most(c.parameter).is_some());
    let signs: &[f64] = if parts.is_empty() {
        &[0.0]
    } else {
        &[-1.0, 0.0, 1.0]
    };
    let with = |c: &Column, sign: f64| {
        let mut values = c.values.clone();
        for p in &parts {
            if let Some((_, most)) = effect.at_most(p.parameter).filter(|a| a.0 == c.parameter) {
                values
                    .iter_mut()
                    .zip(&p.values)
                    .for_each(|(v, p)| *v += sign * most * p);
            }
        }
        values
    };
    let set = |sign: &f64| whole.iter().map(|c| with(c, *sign)).collect();
    signs.iter().map(set).collect()
}

/// Sets of columns by which an effect could describe a signal: all its regressions together, each with each value of a
/// shape, and every step.
fn columns(effect: &dyn Effect, stand: &Stand, axis: usize) -> Vec<Vec<Vec<f64>>> {
    let (mut regressions, mut shaped, mut sets) = (vec![], vec![], vec![]);
    for h in hypotheses(effect, stand, axis) {
        match h {
            Hypothesis::Regression(r) => regressions.extend(r.columns),
            Hypothesis::Shaped(s) => {
                let at = |x: f64| {
                    s.columns(x)
                        .into_iter()
                        .map(|c| c.values)
                        .collect::<Vec<_>>()
                };
                shaped.extend(s.grid().into_iter().map(at));
            }
            Hypothesis::Step => {
                for at in (40..stand.samples()).step_by(40) {
                    let step = |i| f64::from(u8::from(i >= at));
                    sets.push(vec![(0..stand.samples()).map(step).collect()]);
                }
            }
            _ => {}
        }
    }
    for fixed in within_bounds(effect, &regressions) {
        sets.extend(
            shaped
                .iter()
                .map(|s: &Vec<_>| [fixed.clone(), s.clone()].concat()),
        );
        if !fixed.is_empty() {
            sets.push(fixed);
        }
    }
    sets
}

/// Share of a signal's gain that the strongest line takes, and a line with two neighbours wherever they lie, of which one
/// that swings is a case.
fn of_lines(stand: &Stand, axis: usize, signal: &[f64]) -> (f64, f64) {
    let meter = Meter::new(stand, axis);
    let whole = meter.of_signal(&meter.energy(signal)).powi(2);
    let mut rest = signal.to_vec();
    let mut taken = vec![];
    for _ in 0..3 {
        rest = meter.beyond(&rest, &strongest_line(stand, axis, &rest));
        taken.push(1.0 - meter.of_signal(&meter.energy(&rest)).powi(2) / whole);
    }
    (taken[0], taken[2])
}

/// The line, as two columns, that takes most of a signal.
fn strongest_line(stand: &Stand, axis: usize, signal: &[f64]) -> [Vec<f64>; 2] {
    let (n, meter) = (stand.samples(), Meter::new(stand, axis));
    let c = Dct::new(n).forward(signal);
    let weight = |k: usize| {
        let w = std::f64::consts::PI * k as f64 / n as f64;
        c[k] * c[k] / (stand.white(axis) + stand.step(axis) / (2.0 - 2.0 * w.cos()))
    };
    let mut order: Vec<usize> = (2..n).collect();
    order.sort_by(|a, b| weight(*b).total_cmp(&weight(*a)));
    let tries = order
        .iter()
        .take(6)
        .flat_map(|k| [-0.5, 0.0, 0.5].map(|d| *k as f64 + d));
    let left = |line: &[Vec<f64>; 2]| meter.of_signal(&meter.energy(&meter.beyond(signal, line)));
    tries
        .map(|k| {
            let w = std::f64::consts::PI * k / n as f64;
            [0.0, TAU / 4.0].map(|phase| (0..n).map(|i| (w * i as f64 + phase).cos()).collect())
        })
        .min_by(|a, b| left(a).total_cmp(&left(b)))
        .expect("there are tries")
}

/// Share of the gain of an expected spectrum that the best process of an effect describes, random walk and white noise
/// refitted. `truth` is minus twice the log likelihood of what there is.
fn of_process(
    stand: &Stand,
    axis: usize,
    expected: &[f64],
    truth: f64,
    effect: &dyn Effect,
) -> f64 {
    let bins = analysis::likelihood::Bins::new(stand.samples());
    let ones = vec![1.0; stand.samples()];
    let count = bins.products(&ones, &ones);
    let walk: Vec<f64> = bins
        .at
        .omega
        .iter()
        .map(|w| 1.0 / (2.0 - 2.0 * w.cos()))
        .collect();
    let n: f64 = count.iter().sum();
    let minus_two_l = |lambda: f64, density: &dyn Fn(usize) -> f64| {
        let (mut sum, mut logs) = (0.0, 0.0);
        for b in 0..count.len() {
            let g = (density(b) + lambda * walk[b]).max(1e-9);
            sum += expected[b] / g;
            logs += count[b] * g.ln();
        }
        n * (sum / n).ln() + logs + n
    };
    let baseline = (-30..=6)
        .map(|k| minus_two_l(f64::from(k).exp(), &|_| 1.0))
        .fold(minus_two_l(0.0, &|_| 1.0), f64::min);
    let mut best = baseline;
    for h in hypotheses(effect, stand, axis) {
        let Hypothesis::Covariance(process) = h else {
            continue;
        };
        let bounds = process.bounds(stand.samples());
        let white = f64::from(u8::from(!process.filters_white()));
        let value = |x: &[f64]| {
            let inside = |(v, (low, high)): (&f64, &(f64, f64))| v.clamp(*low, *high);
            let theta: Vec<f64> = x[1..].iter().zip(&bounds).map(inside).collect();
            let density = process.density(&theta, &bins.at);
            minus_two_l(x[0].min(6.0).exp(), &|b| white + density[b])
        };
        for start in process.starts(stand.samples()) {
            for log_walk in [-16.0, -8.0] {
                let from = [vec![log_walk], start.clone()].concat();
                let steps = vec![1.0; from.len()];
                let once = nelder_mead(&value, &from, &steps, 300);
                best = best.min(value(&nelder_mead(&value, &once, &steps, 300)));
            }
        }
    }
    (baseline - best) / (baseline - truth)
}

/// Minus twice the log likelihood of a spectrum under itself.
fn saturated(stand: &Stand, expected: &[f64]) -> f64 {
    let ones = vec![1.0; stand.samples()];
    let count = analysis::likelihood::Bins::new(stand.samples()).products(&ones, &ones);
    expected
        .iter()
        .zip(&count)
        .map(|(e, m)| m * (1.0 + (e / m).ln()))
        .sum()
}

/// The spectrum that a channel has: its noise, with the white part shaped, and a process beside it.
fn spectrum(stand: &Stand, axis: usize, shape: &dyn Fn(f64) -> f64, beside: &[f64]) -> Vec<f64> {
    let bins = analysis::likelihood::Bins::new(stand.samples());
    let ones = vec![1.0; stand.samples()];
    let count = bins.products(&ones, &ones);
    (0..count.len())
        .map(|b| {
            let w = bins.at.omega[b];
            let walk = stand.step(axis) / (2.0 - 2.0 * w.cos());
            count[b] * (stand.white(axis) * shape(w) + walk) + beside.get(b).copied().unwrap_or(0.0)
        })
        .collect()
}

/// The largest share of a signal's gain that each effect of the library describes.
fn of_all(stand: &Stand, axis: usize, signal: &[f64]) -> Vec<(&'static str, f64)> {
    let meter = Meter::new(stand, axis);
    let whole = meter.of_signal(&meter.energy(signal)).powi(2);
    let expected = spectrum(stand, axis, &|_| 1.0, &meter.energy(signal));
    let own = saturated(stand, &expected);
    let mut all: Vec<_> = EFFECTS
        .iter()
        .map(|effect| {
            let left = |set: &Vec<Vec<f64>>| meter.energy(&meter.beyond(signal, set));
            let described = columns(*effect, stand, axis)
                .iter()
                .map(|set| 1.0 - meter.of_signal(&left(set)).powi(2) / whole)
                .fold(of_process(stand, axis, &expected, own, *effect), f64::max);
            (effect.id(), described)
        })
        .collect();
    let (line, swinging) = of_lines(stand, axis, signal);
    all.extend([("line", line), ("am_line", swinging)]);
    all
}

fn hold(what: &str, library: &str, share: f64) {
    println!("{what}: {library} describes {:.0} %", 100.0 * share);
    assert!(
        share < DESCRIBED,
        "{what} is a case of {library}: {share:.3} of its gain"
    );
}

/// What the share is worth: an effect of the library is described by itself.
#[test]
fn a_line_a_swinging_line_a_temperature_term_and_a_step_describe_themselves() {
    let draw = &mut Draw::of(20_261_121, 11, 0);
    let stand = stand(draw, "");
    let of = |f: &dyn Fn(f64) -> f64| -> Vec<f64> {
        (0..stand.samples())
            .map(|i| 0.1 * f(i as f64 / stand.rate_hz))
            .collect()
    };
    let swing = |t: f64| 1.0 + 0.7 * (TAU * 0.11 * t).cos();
    for (cause, signal) in [
        ("line", of(&|t| (TAU * 2.371 * t + 0.4).cos())),
        ("am_line", of(&|t| swing(t) * (TAU * 2.371 * t + 0.4).cos())),
        ("bias_step", of(&|t| f64::from(u8::from(t >= 301.7)))),
        ("temperature", stand.world.temperature[1].clone()),
    ] {
        let share = of_all(&stand, 1, &signal)
            .into_iter()
            .filter(|(id, _)| *id == cause)
            .fold(f64::NEG_INFINITY, |most, (_, share)| most.max(share));
        assert!(share > DESCRIBED, "{cause} describes {share:.3} of itself");
    }
    // A process of the library, in its own spectrum.
    let pole = (-1.0 / (2.0 * stand.rate_hz)).exp();
    let one_pole = |w: f64| (1.0 - pole * pole) / (1.0 + pole * pole - 2.0 * pole * w.cos());
    let expected = spectrum(&stand, 1, &|w| 1.0 + 0.1 * one_pole(w), &[]);
    let own = saturated(&stand, &expected);
    let gauss_markov = model::effects::effect("gauss_markov").expect("a cause of the library");
    let share = of_process(&stand, 1, &expected, own, gauss_markov);
    assert!(
        share > DESCRIBED,
        "gauss_markov describes {share:.3} of itself"
    );
}

/// An effect that gives an axis 0 a changing variance, drawn as strong as asked, against what the library has for it; the stand
/// that it was drawn for.
fn hold_variance(draw: &mut Draw, name: &'static str) -> Stand {
    let mut stand = stand(draw, name);
    let f = foreign(draw, &mut stand, name, 0, 25.0);
    let Change::Scale(factor) = &f.change else {
        panic!("{name} has no law of variance")
    };
    let law: Vec<f64> = factor.iter().map(|f| f * f).collect();
    assert!((of_variance(&law) - f.strength).abs() < 1e-9 && (f.strength - 25.0).abs() < 0.1);
    hold_law(name, &stand, &law);
    stand
}

/// A law of variance of an axis 0, known in full, against what the library has for it.
fn hold_law(name: &str, stand: &Stand, law: &[f64]) {
    let whole = of_variance(law).powi(2);
    let n = law.len() as f64;
    let mean = law.iter().sum::<f64>() / n;
    // The level is refitted beside the shape.
    let gain = |shape: &dyn Fn(usize) -> f64| {
        let (mut sum, mut logs) = (0.0, 0.0);
        for (i, v) in law.iter().enumerate() {
            sum += v / shape(i);
            logs += shape(i).ln();
        }
        n * mean.ln() - n * (sum / n).ln() - logs
    };
    for effect in EFFECTS {
        for h in hypotheses(*effect, stand, 0) {
            let Hypothesis::Variance(how) = h else {
                continue;
            };
            let mut best = 0.0f64;
            match how {
                VarianceLaw::Shape { shape, .. } => {
                    for k in -9..20 {
                        let a = if k < 0 {
                            0.1 * f64::from(k)
                        } else {
                            0.1 * 1.3f64.powi(k)
                        };
                        best = best.max(gain(&|i| 1.0 + a * shape[i]));
                    }
                }
                VarianceLaw::Segment => {
                    let step = 100;
                    for from in (0..law.len()).step_by(step) {
                        for to in (from + step..=law.len()).step_by(step) {
                            let inside = law[from..to].iter().sum::<f64>() / (to - from) as f64;
                            let outside = (mean * n - inside * (to - from) as f64)
                                / (n - (to - from) as f64).max(1.0);
                            let share = (to - from) as f64 / n;
                            best = best.max(
                                n * (mean.ln()
                                    - share * inside.ln()
                                    - (1.0 - share) * outside.max(1e-9).ln()),
                            );
                        }
                    }
                }
            }
            hold(name, effect.id(), best / whole);
        }
    }
}

/// Edges between the codes of an axis 0 against bits that stick.
fn hold_edges(name: &str, stand: &Stand, first: i32, edges: &[f64], strength: f64) {
    let own = (stand.bias[0] / LSB, stand.white(0).sqrt() / LSB);
    hold_edges_about(name, stand, first, edges, strength, own);
}

/// The same, against even steps of noise that has this mean and sigma, counts.
fn hold_edges_about(
    name: &str,
    stand: &Stand,
    first: i32,
    edges: &[f64],
    strength: f64,
    (refitted_mean, refitted_sigma): (f64, f64),
) {
    let (mean, sigma) = (stand.bias[0] / LSB, stand.white(0).sqrt() / LSB);
    let straight: Vec<f64> = (0..edges.len())
        .map(|i| f64::from(first) + i as f64 - 0.5)
        .collect();
    let even = shares(&straight, refitted_mean, refitted_sigma);
    let uneven = shares(edges, mean, sigma);
    let whole = of_law(&uneven, &even, stand.samples()).powi(2);
    assert!((whole.sqrt() - strength).abs() < 1e-6);
    let mut best = 0.0f64;
    for bit in 0..6 {
        for one in [false, true] {
            for percent in 1..=100 {
                let f = f64::from(percent) / 100.0;
                let mut law: Vec<f64> = even.iter().map(|p| (1.0 - f) * p).collect();
                for (i, p) in even.iter().enumerate() {
                    let code = first + i as i32;
                    let read = if one {
                        code | (1 << bit)
                    } else {
                        code & !(1 << bit)
                    };
                    if let Some(p_read) = law.get_mut((read - first) as usize) {
                        *p_read += f * p;
                    }
                }
                best = best.max(1.0 - of_law(&uneven, &law, stand.samples()).powi(2) / whole);
            }
        }
    }
    hold(name, "stuck_bit", best);
}

/// Signals of a set against every effect of the library, and against the two that describe most of one together; as many
/// signals as `expected` are among the draws.
fn hold_signals(names: impl IntoIterator<Item = &'static str>, family: u64, expected: u64) {
    let mut signals = 0;
    for name in names {
        for index in 0..SIGNAL_DRAWS {
            let draw = &mut Draw::of(20_261_121, family, index);
            let mut stand = stand(draw, name);
            let axis = draw.of_many(3);
            let f = foreign(draw, &mut stand, name, axis, 25.0);
            let Change::Add(signal) = &f.change else {
                continue;
            };
            signals += 1;
            println!("{name} #{index}: d' {:.1}", f.strength);
            for (library, share) in of_all(&stand, axis, signal) {
                hold(name, library, share);
            }
            let (names, share) = third::of_two(&stand, axis, signal);
            hold(name, &names.join(" and "), share);
        }
    }
    assert_eq!(signals, expected * SIGNAL_DRAWS);
}

/// In the readings: what a straight line of the other two axes has of a coupling.
fn hold_coupling(draw: &mut Draw, name: &'static str) {
    let mut stand = stand(draw, name);
    let f = foreign(draw, &mut stand, name, 0, 25.0);
    assert!((f.strength - 25.0).abs() < 0.1);
    let before = stand.record(&[], 7).expect("a stand can be simulated");
    let mut after = before.clone();
    f.act(&mut after, crate::stand::GYROS[0], &stand, 0, draw);
    let [old, one, other] = super::counts(&before);
    let [new, ..] = super::counts(&after);
    let of = |c: &[i32]| c.iter().map(|c| LSB * f64::from(*c)).collect::<Vec<f64>>();
    let added: Vec<f64> = of(&new).iter().zip(of(&old)).map(|(a, b)| a - b).collect();
    let meter = Meter::new(&stand, 0);
    let gain = |s: &[f64]| meter.of_signal(&meter.energy(s)).powi(2);
    // A little above d', for the converter has rounded once more.
    let whole = gain(&added);
    assert!((whole.sqrt() / 25.0 - 1.0).abs() < 0.25, "{name}: {whole}");
    let left = gain(&meter.beyond(&added, &[of(&one), of(&other)]));
    hold(name, "cross_axis", 1.0 - left / whole);
}

/// White noise of which a share got another density, of 25, against every process of the library.
fn hold_noise(name: &str, stand: &Stand, axis: usize, density: &dyn Fn(f64) -> f64) {
    let by = |share: f64, w: f64| share.min(1.0) * (density(w) - 1.0);
    let strength = |share: f64| kept_back::shaped(stand, axis, &|w| by(share, w));
    let share = crate::strength::size_for(25.0, &strength).min(1.0);
    let expected = spectrum(stand, axis, &|w| 1.0 + by(share, w), &[]);
    let own = saturated(stand, &expected);
    println!("{name}: {share:.2} of the noise");
    for effect in EFFECTS {
        let share = of_process(stand, axis, &expected, own, *effect);
        hold(name, effect.id(), share);
    }
}

/// Every effect of a set, drawn as the campaign draws, is as strong as wanted, or as large as may be, and then not too
/// weak more often than not.
fn are_as_strong_as_wanted(names: &[&'static str], family: u64) {
    for name in names {
        let mut weak = 0;
        for index in 0..STRENGTHS {
            let draw = &mut Draw::of(20_261_121, family, index);
            let mut stand = stand(draw, name);
            let axis = draw.of_many(3);
            let wanted = draw.by_ratio(25.0, 40.0);
            let f = foreign(draw, &mut stand, name, axis, wanted);
            if let Change::Add(signal) = &f.change {
                assert!(signal.iter().all(|v| v.is_finite()), "{name}");
            }
            let large = rms(&f);
            assert!(large <= 1.001 * LARGEST_RMS, "{name}: {large} deg/s");
            if large > 0.999 * LARGEST_RMS {
                weak += u64::from(f.strength < 25.0);
            } else {
                let kept = (f.strength / wanted - 1.0).abs() < 0.01;
                assert!(kept, "{name}: d' {} for {wanted}", f.strength);
            }
        }
        println!("{name}: {weak} of {STRENGTHS} stay below d' 25");
        assert!(2 * weak <= STRENGTHS, "{name} is seldom as strong as asked");
    }
}

/// Each of a set moves more than `least` of the readings of its channel, by less than 5 deg/s, and none of another's.
fn act_on_their_channel_alone(names: &[&'static str], family: u64, least: f64) {
    for name in names {
        let draw = &mut Draw::of(20_261_121, family, 0);
        let mut stand = stand(draw, name);
        let axis = draw.of_many(3);
        let f = foreign(draw, &mut stand, name, axis, 30.0);
        let before = stand.record(&[], 7).expect("a stand can be simulated");
        let mut after = before.clone();
        let own = crate::stand::GYROS[axis];
        f.act(&mut after, own, &stand, axis, draw);
        for (old, new) in before.channels.iter().zip(&after.channels) {
            let pairs = old.values.iter().zip(&new.values);
            let moved: Vec<f64> = pairs.map(|(a, b)| (a - b).abs()).collect();
            let share = moved.iter().filter(|d| **d > 0.0).count() as f64 / moved.len() as f64;
            if old.name != own {
                assert!(share == 0.0, "{name} moves {}", old.name);
                continue;
            }
            let most = moved.iter().copied().fold(0.0, f64::max);
            assert!(share > least && most < 5.0, "{name}: {share}, {most} deg/s");
        }
    }
}
