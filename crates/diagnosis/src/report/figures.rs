//! The figures that convict, and the Allan curve held against replicates.

use model::effect::{Peak, Signal};
use model::record::Quantity;
use rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::fit::channel::{Form, State, Term};
use crate::fit::likelihood::{Dct, Panel};
use crate::ingest::types::Grid;
use crate::report::{epochs, levels};
use crate::result::{Evidence, Series, SeriesStyle};
use crate::search::searched::Searched;
use numerics::column::dot;

mod without_a_name;

/// Replicates of the Allan misfit, made in pairs.
const REPLICATES: usize = 32;
/// Points of a figure of blocks.
const BLOCKS: usize = 60;

/// ln of the overlapping Allan deviation at `m` samples, from the cumulated sum.
fn log_allan(sum: &[f64], m: usize) -> f64 {
    let apart = sum[2 * m..].iter().zip(&sum[m..]).zip(sum);
    let second: Vec<f64> = apart.map(|((c, b), a)| c - 2.0 * b + a).collect();
    let total = dot(&second, &second);
    0.5 * (total / second.len() as f64 / (2.0 * (m * m) as f64)).ln()
}

fn cumulated(y: &[f64]) -> Vec<f64> {
    let mut sum = Vec::with_capacity(y.len() + 1);
    let mut all = 0.0;
    sum.push(all);
    sum.extend(y.iter().map(|v| {
        all += v;
        all
    }));
    sum
}

/// Octaves from `first` samples up to a tenth of the record.
fn allan(y: &[f64], first: usize) -> Vec<f64> {
    let sum = cumulated(y);
    let octaves = std::iter::successors(Some(first), |m| Some(2 * m));
    octaves
        .take_while(|m| *m <= y.len() / 10)
        .map(|m| log_allan(&sum, m))
        .collect()
}

/// Samples of a record whose replicates are made sample by sample; of a longer one, means of blocks are.
const BY_SAMPLE: usize = 1 << 17;
/// Blocks that the shortest cluster has which is held against replicates of means.
const OVERLAP: usize = 8;

/// Mean and standard deviation of the octaves of ln ADEV below `end` samples, for coefficients of variance `v`: second
/// differences filter the density by 2 sin^4(m w / 2) / (m sin(w / 2))^2; the mean of their squares over a record much
/// longer than them has twice the mean square of that density, over the length, for its variance.
fn short_octaves(v: &[f64], walks: &[f64], end: usize) -> Vec<(f64, f64)> {
    let count = end.ilog2() as usize;
    let mut sums = vec![(0.0, 0.0); count];
    for (v, walk) in v.iter().zip(walks).skip(1) {
        let least = 0.25 / walk;
        let (mut sine, mut m) = (least, 1.0);
        for (first, second) in &mut sums {
            let x = v * 2.0 * sine * sine / (m * m * least);
            *first += x;
            *second += x * x;
            sine *= 4.0 * (1.0 - sine);
            m *= 2.0;
        }
    }
    let n = v.len() as f64;
    sums.iter()
        .map(|(first, second)| {
            let (mean, variance) = (first / n, 2.0 * second / n / n);
            let relative = variance / (mean * mean);
            (0.5 * (mean.ln() - 0.5 * relative), 0.5 * relative.sqrt())
        })
        .collect()
}

/// Variances of the coefficients of means over blocks of `length`, from those of the samples: each keeps
/// sin(length w / 2) / (length sin(w / 2)) of its size, and those that the blocks cannot tell apart add.
fn of_blocks(v: &[f64], walks: &[f64], length: usize, blocks: usize) -> Vec<f64> {
    let mut folded = vec![0.0; blocks];
    for (k, (v, walk)) in v.iter().zip(walks).enumerate().skip(1) {
        let turn = k % (2 * blocks);
        let at = turn.min(2 * blocks - turn);
        if at < blocks {
            let angle = std::f64::consts::PI * k as f64 * length as f64 / (2 * walks.len()) as f64;
            let sine = angle.sin() / length as f64;
            folded[at] += v * sine * sine * 4.0 * walk / length as f64;
        }
    }
    folded[0] = 0.0;
    folded
}

/// sup |z| of ln ADEV against replicates of the model, before and after.
pub(crate) fn allan_misfit(s: &Searched<'_>, seed: u64) -> [f64; 2] {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed ^ 0x616c_6c61_6e21);
    let y = &s.target.y;
    let panel = &s.search.panel;
    let length = y.len().div_ceil(BY_SAMPLE).next_power_of_two();
    let mut against = |state: &State| {
        let white = state.solution.white;
        let mut v = state.noise.everywhere(&panel.bins);
        v.iter_mut().for_each(|v| *v *= white);
        v[0] = 0.0;
        let fitted = modelled(panel, state, &state.terms.iter().collect::<Vec<_>>());
        let mut measured: Vec<f64> = y.iter().zip(&fitted).map(|(y, f)| y - f).collect();
        drop(fitted);
        let mut off = vec![];
        // Octaves of what is replicated, from the first on.
        let (mut dct, mut first) = (panel.dct.clone(), 1);
        if length > 1 {
            let walks = panel.bins.walks();
            let sum = cumulated(&measured);
            for (i, (mean, spread)) in short_octaves(&v, walks, OVERLAP * length)
                .into_iter()
                .enumerate()
            {
                off.push((log_allan(&sum, 1 << i) - mean) / spread);
            }
            let blocks = y.len() / length;
            v = of_blocks(&v, walks, length, blocks);
            measured = (0..blocks)
                .map(|b| (sum[(b + 1) * length] - sum[b * length]) / length as f64)
                .collect();
            (dct, first) = (crate::fit::likelihood::Dct::new(blocks), OVERLAP);
        }
        let target = allan(&measured, first);
        let (mut sum, mut square) = (vec![0.0; target.len()], vec![0.0; target.len()]);
        v.iter_mut().for_each(|v| *v = v.sqrt());
        let mut replicate = || -> Vec<f64> {
            let of = v.iter().map(|v| {
                let e: f64 = StandardNormal.sample(&mut rng);
                v * e
            });
            of.collect()
        };
        for _ in 0..REPLICATES / 2 {
            for y in dct.inverse_all([replicate(), replicate()]) {
                for (i, v) in allan(&y, first).into_iter().enumerate() {
                    sum[i] += v;
                    square[i] += v * v;
                }
            }
        }
        let count = REPLICATES as f64;
        off.extend((0..target.len()).map(|i| {
            let mean = sum[i] / count;
            let spread = ((square[i] - count * mean * mean) / (count - 1.0)).sqrt();
            (target[i] - mean) / spread
        }));
        off.into_iter().map(f64::abs).fold(0.0, f64::max)
    };
    [against(&s.baseline), against(&s.state)]
}

/// What the columns of some terms contribute, in time.
fn modelled(panel: &Panel, state: &State, terms: &[&Term]) -> Vec<f64> {
    let mut sum = vec![0.0; panel.bins.n];
    if terms.iter().all(|t| t.columns.is_empty()) {
        return sum;
    }
    for (t, own) in state.parts() {
        if terms.iter().any(|o| o.columns == t.columns) {
            panel.add_columns(&mut sum, 0, &t.columns, own);
        }
    }
    panel.dct.inverse(&sum)
}

fn blocks(values: &[f64], count: usize) -> Vec<f64> {
    let n = values.len();
    (0..count)
        .map(|b| {
            let part = &values[b * n / count..(b + 1) * n / count];
            part.iter().sum::<f64>() / part.len().max(1) as f64
        })
        .collect()
}

/// The figures of the terms of a channel: one for each, and one for those of an effect that follow the same channel, or of a rotor.
pub(crate) fn of_channel(s: &Searched<'_>, grid: &Grid) -> Vec<Evidence> {
    // A band is shown once, with all that it is made of.
    let named = |t: &&Term| t.effect.id() != crate::fit::channel::ID && !t.is_part();
    let named: Vec<&Term> = s.state.terms.iter().filter(named).collect();
    let over = |t: &Term| {
        let followed = grid.signals.iter();
        followed
            .map(|g| &g.name)
            .find(|g| t.follows.as_ref() == Some(*g))
    };
    let together = |a: &Term, b: &Term| {
        let same = a.effect.id() == b.effect.id() && over(a) == over(b) && over(a).is_some();
        std::ptr::eq(a, b) || a.turns_with(b) || same && is_course(a) && is_course(b)
    };
    let mut all = without_a_name::all(s, grid);
    for (i, term) in named.iter().enumerate() {
        if named[..i].iter().any(|before| together(before, term)) {
            continue;
        }
        let terms: Vec<&Term> = named
            .iter()
            .copied()
            .filter(|t| together(term, t))
            .collect();
        all.push(of_terms(s, grid, &terms));
    }
    let titles: Vec<String> = all.iter().map(|e| e.title.clone()).collect();
    for evidence in &mut all {
        if titles.iter().filter(|t| **t == evidence.title).count() > 1 {
            let by = evidence.x_label.split(',').next().unwrap_or_default();
            evidence.title = format!("{}, by {by}", evidence.title);
        }
    }
    all
}

/// Whether a term is seen in the rate itself, and not in a spectrum.
fn is_course(term: &Term) -> bool {
    !matches!(
        term.form,
        Form::Covariance(..) | Form::Line(_) | Form::SideBands(..)
    )
}

fn series(label: &str, style: SeriesStyle, x: Vec<f64>, y: Vec<f64>) -> Series {
    Series {
        label: label.into(),
        style,
        x,
        y,
    }
}

/// Terms that are seen in one figure, of which the first one says how.
fn of_terms(s: &Searched<'_>, grid: &Grid, terms: &[&Term]) -> Evidence {
    let term = terms[0];
    let own = |t: &Term| terms.iter().any(|o| o.columns == t.columns);
    let others: Vec<&Term> = s.state.terms.iter().filter(|t| !own(t)).collect();
    let unit = &s.target.unit;
    let mut evidence = Evidence {
        cause: term.effect.id().into(),
        title: format!("{}: {}", s.target.name, term.effect.docs().title),
        channel: s.target.name.clone(),
        x_label: "time, s".into(),
        y_label: format!("{}, {unit}", model::integral::reading(unit)),
        log_x: false,
        log_y: false,
        series: vec![],
        caption: term.effect.docs().figure.into(),
    };
    match &term.form {
        Form::Covariance(..) => match levels::of(s, term, &beside(s, &others), grid.rate_hz) {
            Some(drawn) => drawn.onto(&mut evidence),
            None => spectrum(s, grid, term.peak(), &mut evidence),
        },
        Form::Line(omega) => {
            let seen = beside(s, &others);
            peak(s, grid, term, *omega, 0.0, &seen, &mut evidence);
        }
        Form::SideBands(omega, apart) => {
            // The line is in the figure with its side bands.
            let other: Vec<&Term> = others
                .into_iter()
                .filter(|t| !matches!(t.form, Form::Line(o) if (o - omega).abs() < *apart))
                .collect();
            let seen = beside(s, &other);
            peak(s, grid, term, *omega, *apart, &seen, &mut evidence);
        }
        _ => course(s, grid, terms, &beside(s, &others), &mut evidence),
    }
    evidence
}

/// The readings `seen` in blocks, by time or by what the terms follow, and what the terms make of them.
fn course(s: &Searched<'_>, grid: &Grid, terms: &[&Term], seen: &[f64], evidence: &mut Evidence) {
    let fitted = modelled(&s.search.panel, &s.state, terms);
    let is_command =
        |g: &&Signal| g.quantity == Quantity::Pwm && s.search.sources(terms[0]).contains(&g.name);
    // A shape of time behind a command is a surge, a shape of its changes.
    let command = grid.signals.iter().find(is_command);
    let command = command.filter(|_| terms[0].follows.is_none());
    if let Some(drawn) = command.and_then(|c| epochs::of(c, grid.rate_hz, seen, &fitted)) {
        (evidence.x_label, evidence.caption) = (drawn.x_label, drawn.caption);
        evidence.series = drawn.series;
        return;
    }
    let count = BLOCKS.min(seen.len() / 4);
    let followed = terms[0]
        .follows
        .as_ref()
        .and_then(|f| grid.signals.iter().find(|g| g.name == *f));
    let (x, order) = match followed {
        Some(signal) => {
            evidence.x_label = if signal.unit.is_empty() || signal.unit == "1" {
                signal.name.clone()
            } else {
                format!("{}, {}", signal.name, signal.unit)
            };
            let x = blocks(&signal.smooth, count);
            let mut order: Vec<usize> = (0..count).collect();
            order.sort_by(|a, b| x[*a].total_cmp(&x[*b]));
            (x, order)
        }
        None => {
            let time: Vec<f64> = (0..seen.len()).map(|i| i as f64 / grid.rate_hz).collect();
            (blocks(&time, count), (0..count).collect())
        }
    };
    let (mut seen, fitted) = (blocks(seen, count), blocks(&fitted, count));
    // The constant is fitted beside the term: what the term does not say has no mean.
    let left: f64 = seen.iter().zip(&fitted).map(|(y, f)| y - f).sum();
    seen.iter_mut()
        .for_each(|y| *y -= left / count.max(1) as f64);
    let pick = |v: &[f64]| -> Vec<f64> { order.iter().map(|i| v[*i]).collect() };
    evidence.series = vec![
        series(
            "measured, other terms taken out",
            SeriesStyle::Points,
            pick(&x),
            pick(&seen),
        ),
        series("model", SeriesStyle::Line, pick(&x), pick(&fitted)),
    ];
}

/// The readings about their mean, without these terms.
fn beside(s: &Searched<'_>, terms: &[&Term]) -> Vec<f64> {
    let rest = modelled(&s.search.panel, &s.state, terms);
    let mean = s.target.y.iter().sum::<f64>() / s.target.y.len() as f64;
    let readings = s.target.y.iter().zip(&rest);
    readings.map(|(y, r)| y - r - mean).collect()
}

/// Resolutions of the record either side of a line.
const ABOUT: f64 = 40.0;
/// Points of the figure of a line.
const PEAK_POINTS: usize = 640;
/// Swings of a line either side of it.
const SWINGS: f64 = 3.0;

/// Amplitude spectrum around a line, with the term and after it is taken out.
fn peak(
    s: &Searched<'_>,
    grid: &Grid,
    term: &Term,
    omega: f64,
    apart: f64,
    seen: &[f64],
    evidence: &mut Evidence,
) {
    let panel = &s.search.panel;
    let n = seen.len();
    // Two points to a resolution.
    let step = std::f64::consts::PI / n as f64;
    let reach = (2.0 * ABOUT * step).max(SWINGS * apart);
    let from = (((omega - reach) / step) as usize).max(4);
    let to = (((omega + reach) / step).ceil() as usize).min(n - 1);
    let fitted = modelled(panel, &s.state, &[term]);
    let left: Vec<f64> = seen.iter().zip(&fitted).map(|(y, f)| y - f).collect();
    evidence.x_label = "frequency, Hz".into();
    evidence.y_label = format!("amplitude, {}", s.target.unit);
    evidence.series = [
        ("measured, other terms taken out", seen),
        ("after it is taken out", &left),
    ]
    .map(|(label, of)| {
        let all = amplitudes(&panel.dct, of);
        // The largest of each stretch, where there are more than a figure shows.
        let stretch = to.saturating_sub(from) / PEAK_POINTS + 1;
        let at: Vec<usize> = (from..to)
            .step_by(stretch)
            .filter_map(|k| (k..(k + stretch).min(to)).max_by(|i, j| all[*i].total_cmp(&all[*j])))
            .collect();
        let hz = |k: &usize| *k as f64 * step / std::f64::consts::TAU * grid.rate_hz;
        series(
            label,
            SeriesStyle::Line,
            at.iter().map(hz).collect(),
            at.iter().map(|k| all[*k]).collect(),
        )
    })
    .into();
}

/// Amplitudes under a Hann window at the angular frequencies pi k / n.
fn amplitudes(dct: &Dct, values: &[f64]) -> Vec<f64> {
    let n = values.len();
    let cell = std::f64::consts::TAU / n as f64;
    let windowed: Vec<f64> = values
        .iter()
        .enumerate()
        .map(|(i, v)| (1.0 - (cell * (i as f64 + 0.5)).cos()) * v)
        .collect();
    let cosines = dct.forward(&windowed);
    // (-1)^i sin(pi k (i + 1/2) / n) = cos(pi (n - k) (i + 1/2) / n).
    let turned: Vec<f64> = windowed
        .iter()
        .enumerate()
        .map(|(i, v)| if i % 2 == 0 { *v } else { -v })
        .collect();
    let sines = dct.forward(&turned);
    let scale = (2.0 / n as f64).sqrt();
    (0..n)
        .map(|k| {
            let sine = if k == 0 { 0.0 } else { sines[n - k] };
            scale * f64::hypot(cosines[k], sine)
        })
        .collect()
}

/// Fewest coefficients behind a point of a density, and the ratio of its ends.
const LEAST: f64 = 4.0;
const BAND: f64 = 1.1;
/// Half widths of a peak within which points are closer, and those from one to the next.
const NEAR: f64 = 6.0;
const OF_A_PEAK: f64 = 0.5;

/// Amplitude density of the rate with the models before and after.
fn spectrum(s: &Searched<'_>, grid: &Grid, peak: Option<Peak>, evidence: &mut Evidence) {
    let panel = &s.search.panel;
    let n = panel.bins.n;
    let c = panel.column(0);
    let hz: Vec<f64> = panel
        .bins
        .at
        .omega
        .iter()
        .map(|w| w / std::f64::consts::TAU * grid.rate_hz)
        .collect();
    // One-sided density: 2 var / rate.
    let ones: Vec<f64> = vec![1.0; n];
    let counts = panel.bins.products(&ones, &ones);
    let energies = panel.bins.products(&c, &c);
    // A peak narrower than the ratio has points of its own.
    let omega = &panel.bins.at.omega;
    let resolves = |first: usize, last: usize| {
        peak.is_some_and(|p| {
            let near = (omega[last] - p.omega).abs() < NEAR * p.half_width;
            near && omega[last] - omega[first] >= OF_A_PEAK * p.half_width
        })
    };
    let (mut middles, mut density) = (vec![], vec![]);
    let (mut first, mut energy, mut count, mut moment) = (0, 0.0, 0.0, 0.0);
    for (b, (e, m)) in energies.iter().zip(&counts).enumerate() {
        energy += e;
        count += m;
        moment += m * hz[b];
        if count >= LEAST && (hz[b] >= BAND * hz[first] || resolves(first, b)) {
            middles.push(moment / count);
            density.push((2.0 * energy / count / grid.rate_hz).sqrt());
            (first, energy, count, moment) = (b + 1, 0.0, 0.0, 0.0);
        }
    }
    let model = |state: &State| -> Vec<f64> {
        state
            .noise
            .over(&panel.bins)
            .iter()
            .map(|g| (2.0 * state.solution.white * g / grid.rate_hz).sqrt())
            .collect()
    };
    (evidence.log_x, evidence.log_y) = (true, true);
    evidence.x_label = "frequency, Hz".into();
    evidence.y_label = format!("one-sided density, {}/sqrt(Hz)", s.target.unit);
    evidence.series = vec![
        series("measured", SeriesStyle::Points, middles, density),
        series(
            "noise model before",
            SeriesStyle::Line,
            hz.clone(),
            model(&s.baseline),
        ),
        series("noise model after", SeriesStyle::Line, hz, model(&s.state)),
    ];
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_stands_at_its_amplitude_and_beside_it_is_nothing() {
        let n = 4000;
        let omega = std::f64::consts::PI * 501.0 / n as f64;
        let wave: Vec<f64> = (0..n)
            .map(|i| 0.3 * (omega * i as f64 + 0.7).cos())
            .collect();
        let all = amplitudes(&Dct::new(n), &wave);
        assert!((all[501] - 0.3).abs() < 1e-3, "{}", all[501]);
        assert!(all[470] < 1e-3 && all[540] < 1e-3);
    }
}
