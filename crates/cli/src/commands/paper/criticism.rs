//! What the paper's figures say about each other, in numbers.

use diagnosis::{DiagnoseOptions, diagnose};
use miette::Result;
use model::file::EffectModel;
use model::parameter::Parameter;
use model::record::Record;
use noise::allan::Phase;
use noise::analyze::{Analysis, ChannelAnalysis};
use noise::paper_model::{PaperStand, Reading, STATED_FLAT_DEG_H, STATED_SECONDS, Slow};
use serde::Serialize;

/// Slope of the flat part within which a reader calls it flat.
const FLAT_SLOPE: f64 = 0.1;
/// Steepest slope of the line that still is no −1/2.
const LINE_SLOPE: f64 = -0.49;
/// Temperature coefficient that the figure-1 model lacks, deg/s/degC.
const HIDDEN_SLOPE: f64 = 0.07;
/// Swing of the temperature by a heater, degC.
const HEATER_DEGC: f64 = 6.0;

/// Median and the range of the middle 95 % over simulated records.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Range {
    /// 2.5 % of the records are below.
    pub low: f64,
    /// The median.
    pub median: f64,
    /// 2.5 % are above.
    pub high: f64,
}

impl Range {
    fn of(values: impl Iterator<Item = f64>) -> Self {
        let mut sorted: Vec<f64> = values.collect();
        sorted.sort_by(f64::total_cmp);
        let at = |p: f64| {
            sorted
                .get(((sorted.len().max(1) - 1) as f64 * p).round() as usize)
                .copied()
                .unwrap_or(f64::NAN)
        };
        Self {
            low: at(0.025),
            median: at(0.5),
            high: at(0.975),
        }
    }
}

/// A noise that could be behind the paper's figures, and what its procedure reads from 600-s records of it.
#[derive(Clone, Debug, Serialize)]
pub struct Hypothesis {
    /// What it is.
    pub name: String,
    /// N, deg/sqrt(h).
    pub angle_random_walk_deg_sqrt_h: f64,
    /// K, deg/s/sqrt(s).
    pub rate_random_walk_deg_s_sqrt_s: f64,
    /// B of IEEE Std 952, deg/h.
    pub bias_instability_deg_h: f64,
    /// Expected Allan deviation at 0.1, 1, 10, 30 and 100 s, deg/h.
    pub expected_adev_deg_h: Vec<[f64; 2]>,
    /// The line's figure, deg/sqrt(h).
    pub line_deg_sqrt_h: Range,
    /// Slope of a free line from 0.1 to 10 s.
    pub line_slope: Range,
    /// Level from 10 to 100 s, deg/h.
    pub level_deg_h: Range,
    /// Slope of a free line there.
    pub level_slope: Range,
    /// Share of the records whose line is as steep as −0.49 and whose level reaches 150 deg/h.
    pub share_with_both: f64,
    /// Share whose free slope from 10 to 100 s is within ±0.1.
    pub share_that_look_flat: f64,
    /// Records.
    pub runs: u32,
    #[serde(skip)]
    pub(super) stand: PaperStand,
}

/// A claim of the paper, and what it comes to.
#[derive(Clone, Debug, Serialize)]
pub struct Claim {
    /// The claim.
    pub stated: String,
    /// What is the matter with it.
    pub found: String,
}

/// Simulates each noise that could be behind the figures, and reads it by the paper's procedure.
pub fn hypotheses(runs: u32, seed: u64, n: f64, level: f64, tau0: f64) -> Result<Vec<Hypothesis>> {
    let mut stands = vec![(
        "white noise alone, 5.27 deg/sqrt(h)".to_owned(),
        PaperStand::white(n, tau0),
    )];
    for (slow, name) in [
        (Slow::RandomWalk, "white noise and random walk"),
        (Slow::Flicker, "white noise and flicker"),
    ] {
        for (how, stand) in [
            (
                "N as stated, slow term for 150 deg/h",
                PaperStand::with_level(slow, n, level, tau0),
            ),
            (
                "both sized to read as stated",
                PaperStand::with_both(slow, n, level, tau0),
            ),
        ] {
            if let Some(stand) = stand {
                stands.push((format!("{name} ({how})"), stand));
            }
        }
    }
    stands
        .into_iter()
        .enumerate()
        .map(|(i, (name, stand))| simulated(name, stand, runs, seed ^ ((i as u64 + 1) << 32)))
        .collect()
}

fn simulated(name: String, stand: PaperStand, runs: u32, seed: u64) -> Result<Hypothesis> {
    let model = super::model_of(&stand, "gyro_z", Some(super::LSB_DPS));
    let mut readings = Vec::new();
    for run in 0..u64::from(runs) {
        let record = super::simulate(&model, STATED_SECONDS, seed.wrapping_add(run))?;
        let Some(channel) = record.channel("gyro_z") else {
            continue;
        };
        let whole = 0..channel.values.len();
        let phase = Phase::from_values(&channel.values, std::slice::from_ref(&whole));
        readings.extend(Reading::of_record(&phase, stand.tau0));
    }
    let of = |f: fn(&Reading) -> f64| Range::of(readings.iter().map(f));
    let share = |f: &dyn Fn(&&Reading) -> bool| {
        readings.iter().filter(f).count() as f64 / readings.len().max(1) as f64
    };
    Ok(Hypothesis {
        name,
        angle_random_walk_deg_sqrt_h: 60.0 * stand.angle_random_walk_n,
        rate_random_walk_deg_s_sqrt_s: if stand.slow == Slow::RandomWalk {
            stand.size
        } else {
            0.0
        },
        bias_instability_deg_h: if stand.slow == Slow::Flicker {
            3600.0 * stand.size
        } else {
            0.0
        },
        expected_adev_deg_h: [0.1, 1.0, 10.0, 30.0, 100.0]
            .map(|tau: f64| {
                let m = (tau / stand.tau0).round() as usize;
                [tau, 3600.0 * stand.deviation(m)]
            })
            .into(),
        line_deg_sqrt_h: of(|r| 60.0 * r.angle_random_walk),
        line_slope: of(|r| r.line_slope),
        level_deg_h: of(|r| 3600.0 * r.level),
        level_slope: of(|r| r.level_slope),
        share_with_both: share(&|r| {
            r.line_slope <= LINE_SLOPE && 3600.0 * r.level >= STATED_FLAT_DEG_H
        }),
        share_that_look_flat: share(&|r| r.level_slope.abs() <= FLAT_SLOPE),
        runs: readings.len() as u32,
        stand,
    })
}

/// The claims, each with its number.
pub fn claims(
    hypotheses: &[Hypothesis],
    analysis: &Analysis,
    found: &ChannelAnalysis,
    alike: &LooksAlike,
    (n, tau0): (f64, f64),
) -> Vec<Claim> {
    let white = PaperStand::white(n, tau0);
    let at = |tau: f64| 3600.0 * white.deviation((tau / tau0).round() as usize);
    let mut out = vec![Claim {
        stated: "The line of slope -1/2 (5.27 deg/sqrt(h)) holds up to 10 s, and from there the curve is flat at 150 deg/h."
            .to_owned(),
        found: format!(
            "That line is at {:.0} deg/h at 10 s and at {:.0} deg/h at 100 s. For the curve to stand at 150 deg/h at 10 s \
             it takes another {:.0} deg/h there, which bends the line before: slope -1/2 up to 10 s and 150 deg/h from 10 s \
             exclude each other.",
            at(10.0),
            at(100.0),
            (STATED_FLAT_DEG_H.powi(2) - at(10.0).powi(2)).sqrt()
        ),
    }];
    let all: u32 = hypotheses.iter().map(|h| h.runs).sum();
    let both: f64 = hypotheses
        .iter()
        .map(|h| h.share_with_both * f64::from(h.runs))
        .sum();
    let list: Vec<String> = hypotheses
        .iter()
        .map(|h| {
            format!(
                "{}: slope {:.3} [{:.3} .. {:.3}], level {:.0} [{:.0} .. {:.0}] deg/h",
                h.name,
                h.line_slope.median,
                h.line_slope.low,
                h.line_slope.high,
                h.level_deg_h.median,
                h.level_deg_h.low,
                h.level_deg_h.high
            )
        })
        .collect();
    out.push(Claim {
        stated: "Both figures come from one record of one gyro.".to_owned(),
        found: format!(
            "Of {all} simulated 600-s records of {} kinds of noise, {both:.0} have a line as steep as -0.49 and a level of 150 \
             deg/h or more. Medians with the middle 95 %: {}.",
            hypotheses.len(),
            list.join("; ")
        ),
    });
    let walk = hypotheses.iter().find(|h| h.stand.slow == Slow::RandomWalk);
    if let Some(walk) = walk {
        out.push(Claim {
            stated: "The model is white noise and a random walk of the bias; the flat part is the bias stability.".to_owned(),
            found: format!(
                "A random walk has no flat part: the curve of that model, sized for the level, is expected to climb from {:.0} \
                 deg/h at 10 s to {:.0} deg/h at 100 s. Of its 600-s records {:.0} % look flat (slope within 0.1) by chance.",
                walk.expected_adev_deg_h[2][1],
                walk.expected_adev_deg_h[4][1],
                100.0 * walk.share_that_look_flat
            ),
        });
    }
    out.push(Claim {
        stated: "Measured and simulated signal look alike, so the approach can be used (figure 8).".to_owned(),
        found: format!(
            "A stand with {} looks like its simulation as well: over {} pairs the rms differs by a factor of {:.3} [{:.3} .. \
             {:.3}]. The diagnosis names the temperature in {:.0} % of these stands, calls {:.0} % adequate, and finds \
             something in {:.0} % of the simulations without the fault.",
            alike.hidden,
            alike.draws,
            alike.rms_ratio.median,
            alike.rms_ratio.low,
            alike.rms_ratio.high,
            100.0 * alike.named,
            100.0 * alike.called_adequate,
            100.0 * alike.false_alarms
        ),
    });
    let longest = found
        .deviations
        .values()
        .flatten()
        .filter(|p| p.tau_s <= 101.0)
        .max_by(|a, b| a.tau_s.total_cmp(&b.tau_s));
    if let Some(p) = longest {
        out.push(Claim {
            stated: "The level is fitted up to 100 s on a record of 600 s.".to_owned(),
            found: format!(
                "By the paper's own rule (ten times the longest cluster time) {:.0} s carry {:.0} s. At {:.0} s this record \
                 has {:.1} degrees of freedom: {:.0} deg/h, with a 95 % interval from {:.0} to {:.0}, a factor of {:.1}.",
                analysis.input.seconds,
                analysis.input.seconds / 10.0,
                p.tau_s,
                p.edf,
                3600.0 * p.deviation,
                3600.0 * p.low,
                3600.0 * p.high,
                p.high / p.low
            ),
        });
    }
    out
}

/// How well eyes and tests tell a stand with a fault from its figure-1 simulation.
#[derive(Clone, Debug, Serialize)]
pub struct LooksAlike {
    /// What the stand has and the simulation lacks.
    pub hidden: String,
    /// Pairs.
    pub draws: u32,
    /// Ratio of the rms of the two signals of a pair.
    pub rms_ratio: Range,
    /// Ratio of their ranges.
    pub range_ratio: Range,
    /// Share of the faulty stands that the diagnosis names `temperature`.
    pub named: f64,
    /// Share of the faulty stands of which it finds the model adequate.
    pub called_adequate: f64,
    /// Share of the figure-1 simulations in which it finds anything.
    pub false_alarms: f64,
    /// The first pair: time is the index over the rate.
    #[serde(skip)]
    pub(super) pair: [Vec<f64>; 2],
}

/// Standard deviation of some readings, and how far the largest is from the least.
fn rms_and_range(y: &[f64]) -> (f64, f64) {
    let mean = y.iter().sum::<f64>() / y.len() as f64;
    let square = y.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / y.len() as f64;
    let (low, high) = y
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| {
            (l.min(*v), h.max(*v))
        });
    (square.sqrt(), high - low)
}

/// What a diagnosis says of a record: its causes, and what it finds unexplained.
fn told(record: &Record, options: &DiagnoseOptions) -> Result<Vec<String>> {
    let found = diagnose(record, options)
        .map_err(super::super::explain)?
        .diagnosis;
    let other = found.unexplained.iter().map(|_| "unexplained".to_owned());
    let named = found.findings.iter().map(|f| f.cause.clone());
    Ok(named.chain(other).collect())
}

/// Pairs of a stand whose bias follows its temperature, and the simulation by the paper's model.
pub fn looks_alike(draws: u32, seed: u64, stand: &PaperStand) -> Result<LooksAlike> {
    let plain = super::model_of(stand, "gyro_z", Some(super::LSB_DPS));
    let mut faulty = plain.clone();
    faulty
        .excitation
        .insert("heater_degc".to_owned(), HEATER_DEGC);
    let mut clean = faulty.clone();
    clean.effects.clear();
    faulty.effects.push(EffectModel {
        cause: "temperature".to_owned(),
        channels: vec!["gyro_z".to_owned()],
        parameters: [(
            "slope".to_owned(),
            Parameter::exact(HIDDEN_SLOPE, "deg/s/degC"),
        )]
        .into(),
    });
    let (mut rms, mut ranges, mut pair) = (Vec::new(), Vec::new(), None);
    let (mut named, mut adequate, mut alarms) = (0u32, 0u32, 0u32);
    for draw in 0..u64::from(draws) {
        let seed = seed ^ (0x616c_696b_6500_0000 + 2 * draw);
        let real = super::simulate(&faulty, STATED_SECONDS, seed)?;
        let simulation = super::simulate(&clean, STATED_SECONDS, seed + 1)?;
        let readings = [&real, &simulation].map(|r| {
            r.channel("gyro_z")
                .map(|c| c.values.clone())
                .unwrap_or_default()
        });
        let [a, b] = [0, 1].map(|k| rms_and_range(&readings[k]));
        rms.push(a.0 / b.0);
        ranges.push(a.1 / b.1);
        pair.get_or_insert(readings);
        let options = DiagnoseOptions {
            seed,
            ..DiagnoseOptions::default()
        };
        let causes = |record| told(record, &options);
        let found = causes(&real)?;
        named += u32::from(found.iter().any(|c| c == "temperature"));
        adequate += u32::from(found.is_empty());
        alarms += u32::from(!causes(&simulation)?.is_empty());
    }
    let share = |count: u32| f64::from(count) / f64::from(draws);
    Ok(LooksAlike {
        hidden: format!(
            "a bias that follows the temperature by {HIDDEN_SLOPE} deg/s/degC, with a heater swinging {HEATER_DEGC} degC"
        ),
        draws,
        rms_ratio: Range::of(rms.into_iter()),
        range_ratio: Range::of(ranges.into_iter()),
        named: share(named),
        called_adequate: share(adequate),
        false_alarms: share(alarms),
        pair: pair.unwrap_or_default(),
    })
}
