//! One channel: its curves, its noise parameters, and what a reader has to know.

use std::ops::Range;

use super::*;

/// What is known of a channel before it is looked at.
fn unknown(units: &Units, warnings: Vec<String>) -> ChannelAnalysis {
    ChannelAnalysis {
        unit: units.reading.unit.clone(),
        deviations: BTreeMap::new(),
        parameters: NoiseParameters {
            angle_random_walk: Interval::unknown(&units.angle_random_walk),
            bias_instability: Interval::unknown(&units.bias_instability),
            rate_random_walk: Interval::unknown(&units.rate_random_walk),
            rate_ramp: Interval::unknown(&units.rate_ramp),
            quantization_noise: Interval::unknown(&units.quantization_noise),
        },
        paper: Paper {
            angle_random_walk: Interval::unknown(&units.angle_random_walk),
            in_run_bias_stability: Interval::unknown(&units.bias_instability),
            notes: Vec::new(),
        },
        warnings,
        parameters_hold_from_s: None,
        fitted: Vec::new(),
        angle: None,
    }
}

/// Why a channel is no measurement.
fn no_noise(channel: &Channel, runs: &[Range<usize>]) -> Option<String> {
    let mut readings = runs.iter().flat_map(|r| &channel.values[r.clone()]);
    let Some(first) = readings.next() else {
        return Some("the channel has no finite reading".into());
    };
    readings.all(|v| v == first).then(|| {
        format!(
            "the channel reads {first} throughout: a sensor at rest has noise, so this is no measurement"
        )
    })
}

/// A channel as the Allan family sees it.
struct Seen<'a> {
    channel: &'a Channel,
    units: &'a Units,
    tau0: f64,
    runs: Vec<Range<usize>>,
    phase: Phase,
    /// With gaps, the places of the readings.
    gapped: Option<Gapped>,
    /// Readings of the longest run, gaps included where they are bridged.
    longest: usize,
}

impl<'a> Seen<'a> {
    fn new(
        channel: &'a Channel,
        units: &'a Units,
        sampling: &Sampling,
        runs: Vec<Range<usize>>,
    ) -> Self {
        let phase = match (&channel.counts, channel.lsb) {
            (Some(counts), Some(lsb)) if counts.len() == channel.values.len() => {
                Phase::from_counts(counts, lsb, &runs)
            }
            _ => Phase::from_values(&channel.values, &runs),
        };
        let gapped = (runs.len() > 1).then(|| Gapped::new(&channel.values, &runs, &sampling.slots));
        let longest = gapped.as_ref().map_or(phase.longest_run(), |g| {
            g.lengths().into_iter().max().unwrap_or(0)
        });
        Self {
            channel,
            units,
            tau0: sampling.tau0,
            runs,
            phase,
            gapped,
            longest,
        }
    }

    /// The curve of one deviation.
    fn curve(
        &self,
        kind: Deviation,
        taus: TauGrid,
        fitted: Option<&NoiseFit>,
    ) -> Vec<DeviationPoint> {
        let scale = if kind == Deviation::Tdev {
            &self.units.time_deviation
        } else {
            &self.units.reading
        };
        match &self.gapped {
            Some(gapped) => gapped_curve(gapped, kind, &self.phase, fitted, self.tau0, taus, scale),
            None => curve(&self.phase, kind, self.tau0, taus, scale),
        }
    }

    /// Where only slow readings are described: the N that the rest of the curve leaves room for.
    fn room_for_white(&self, out: &ChannelAnalysis, described: &Described) -> Option<String> {
        let from = out
            .parameters_hold_from_s
            .filter(|_| described.from_m > 1)?;
        let n = &out.parameters.angle_random_walk;
        let high = n.high?;
        let units = self.units;
        let per_reading = units.angle_random_walk.factor / units.reading.factor;
        let (least, at) = (out.deviations.get(&Deviation::Oadev).into_iter().flatten())
            .filter(|p| p.tau_s < from)
            .map(|p| (p.high * p.tau_s.sqrt() * per_reading, p.tau_s))
            .min_by(|a, b| a.0.total_cmp(&b.0))?;
        (least < high).then(|| {
            format!(
                "the curve at {} s leaves room for N up to {} {} and no more, unless something filters the readings over such times: \
                 what is above is what the curve from {} s on allows by itself",
                short(at),
                short(least),
                n.unit,
                short(from)
            )
        })
    }

    /// The angle of a gyro, and what a reader has to know of it.
    fn angle(&self, fitted: &NoiseFit, out: &mut ChannelAnalysis) {
        if self.channel.quantity != Quantity::Gyro {
            return;
        }
        out.angle = angle(self.channel, &self.runs, fitted, &self.units.integral);
        if self.runs.len() > 1 && out.angle.is_some() {
            out.warnings.push(format!(
                "the integrated angle is that of the longest run without a gap, {:.6} of {:.6} s: what turned in a gap \
                 nobody measured",
                self.phase.longest_run() as f64 * self.tau0,
                self.phase.samples() as f64 * self.tau0
            ));
        }
    }
}

/// What a reader has to know of slow noise that the record is too short for.
fn slow_noise(fitted: &NoiseFit) -> Option<String> {
    let walk = fitted.term(Term::RandomWalk);
    (walk.value.is_some() && walk.low == 0.0 && fitted.term(Term::Flicker).value.is_none()).then(
        || {
            "slow noise is there, but the record is too short to tell a rate random walk from a bias instability: the \
             interval of each allows for the other. `imu-stand plan` says what to record"
                .into()
        },
    )
}

/// What a reader has to know of noise below half a step of the converter.
fn below_a_step(channel: &Channel, fitted: &NoiseFit, tau0: f64) -> Option<String> {
    let (lsb, n) = channel.lsb.zip(fitted.term(Term::White).value)?;
    (n / tau0.sqrt() < 0.5 * lsb).then(|| {
        format!(
            "the noise of a sample is {:.2} steps of the converter: below half a step the readings stick to codes, and \
             every figure here is in doubt",
            n / tau0.sqrt() / lsb
        )
    })
}

/// The paper's figures in the units of reports.
fn in_units(figures: PaperFigures, units: &Units) -> Paper {
    Paper {
        angle_random_walk: Interval::figure(figures.angle_random_walk, &units.angle_random_walk),
        in_run_bias_stability: Interval::figure(
            figures.in_run_bias_stability,
            &units.bias_instability,
        ),
        notes: figures.notes,
    }
}

pub(super) fn analyze_channel(
    channel: &Channel,
    sampling: &Sampling,
    options: &AnalyzeOptions,
) -> (ChannelAnalysis, Option<NoiseFit>) {
    let units = Units::of(channel.quantity, &channel.unit);
    let tau0 = sampling.tau0;
    let runs = sampling.runs_of(&channel.values);
    let mut out = unknown(&units, sampling.warnings.clone());
    if let Some(why) = no_noise(channel, &runs) {
        out.warnings.push(why);
        return (out, None);
    }
    let seen = Seen::new(channel, &units, sampling, runs);
    let (phase, gapped) = (&seen.phase, seen.gapped.as_ref());
    let spectrum = (phase.samples() >= FIT_NEEDS)
        .then(|| Spectrum::with_gaps(&channel.values, &seen.runs, &sampling.slots, tau0))
        .filter(|s| s.coefficients() >= FIT_NEEDS as f64 / 2.0);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(options.seed);
    let described = spectrum
        .as_ref()
        .map(|s| fit_described(s, seen.longest / 5, &mut rng));
    let fitted = described.as_ref().map(|d| d.fit.clone());
    if let Some(gapped) = gapped {
        out.warnings.push(gaps_note(gapped, phase, tau0));
    }
    for kind in &options.deviations {
        let points = seen.curve(*kind, options.taus, fitted.as_ref());
        out.deviations.insert(*kind, points);
    }
    let (Some(spectrum), Some(fitted), Some(described)) = (spectrum, fitted, described) else {
        out.warnings.push(format!(
            "inconclusive: noise parameters need {FIT_NEEDS} samples, the channel has {}",
            phase.samples()
        ));
        return (out, None);
    };
    out.parameters = NoiseParameters::of(&fitted, &units);
    out.parameters_hold_from_s = described.hold_from_m().map(|m| m as f64 * tau0);
    out.warnings.extend(misfit_warning(&described, tau0));
    let room = seen.room_for_white(&out, &described);
    out.warnings.extend(room);
    out.warnings.extend(slow_noise(&fitted));
    out.fitted = TauGrid::Octave
        .factors(seen.longest / 2)
        .into_iter()
        .filter(|m| *m >= described.from_m)
        .map(|m| [m as f64 * tau0, fitted.deviation(m) * units.reading.factor])
        .collect();
    seen.angle(&fitted, &mut out);
    out.warnings.extend(below_a_step(channel, &fitted, tau0));
    out.paper = in_units(
        paper_figures(phase, gapped, &spectrum, &fitted, &mut rng),
        &units,
    );
    (out, Some(fitted))
}

/// What a reader has to know where the terms do not describe the whole curve.
#[must_use]
pub fn misfit_warning(described: &Described, tau0: f64) -> Option<String> {
    let (refused, found) = described.refused.as_ref()?;
    let cure = if described.from_m > 1 {
        let half_band = 1.0 / (described.from_m as f64 * tau0);
        format!(
            "Below {} Hz they do ({}): parameters and intervals are from there, for cluster times from {} s on",
            short(half_band),
            letters(&described.fit),
            short(described.from_m as f64 * tau0)
        )
    } else {
        "Parameters and intervals presume the terms".to_owned()
    };
    Some(format!(
        "the fitted terms ({}) do not describe the curve: sup |z| = {:.1} at {} s, where the deviation is {:.1} % {} the \
         fit (p = {:.3} over refitted replicates). {cure}; `imu-stand diagnose` looks for the cause",
        letters(refused),
        found.sup_z,
        short(found.worst_m as f64 * tau0),
        100.0 * (found.ratio - 1.0).abs(),
        if found.ratio > 1.0 { "above" } else { "below" },
        found.p_value
    ))
}

/// Four significant digits, without zeros behind them, nor many before them.
fn short(value: f64) -> String {
    /// Sizes that are read as they stand.
    const PLAIN: std::ops::Range<f64> = 1e-4..1e7;
    let rounded: f64 = format!("{value:.3e}").parse().unwrap_or(value);
    if rounded == 0.0 || PLAIN.contains(&rounded.abs()) {
        rounded.to_string()
    } else {
        format!("{rounded:e}")
    }
}

/// The terms in a fit.
fn letters(fitted: &NoiseFit) -> String {
    let names: Vec<&str> = Term::ALL
        .into_iter()
        .filter(|t| fitted.model.terms[*t as usize])
        .map(|t| match t {
            Term::White => "N",
            Term::Flicker => "B",
            Term::RandomWalk => "K",
            Term::Quantization => "Q",
        })
        .chain((fitted.model.ramp != Ramp::Absent).then_some("R"))
        .collect();
    names.join(", ")
}

#[cfg(test)]
mod tests {
    use super::short;

    #[test]
    fn a_number_has_four_digits_and_no_row_of_zeros() {
        let said = [2.587_04e-11, 0.05, 1234.56, 0.0, 3.2e9].map(short);
        assert_eq!(said, ["2.587e-11", "0.05", "1235", "0", "3.2e9"]);
    }
}
