//! `imu-stand plan`.

use std::path::PathBuf;

use clap::Args;
use imu_stand::report::plot::{number, tidy};
use imu_stand::text;
use miette::Result;
use model::ModelFile;
use model::record::Quantity;
use model::record::sampling::Sampling;
use noise::analyze::misfit_warning;
use noise::fit::{Spectrum, Term, fit, fit_described};
use noise::plan::{KnownNoise, Letter, expected, seconds_for};
use noise::synthetic::Truth;
use rand_core::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::Serialize;

use super::plan_separate::{Told, print_separate, separate};
use super::wish::{WantedAngle, Wish, Z_95, wishes};
use super::{Input, Outputs};

/// Samples that tell anything of the noise.
const LEAST_SAMPLES: usize = 64;
/// Most samples that `--check` simulates in all.
const CHECK_SAMPLES: f64 = 2e8;
/// Records that are simulated without it, of a term and of an angle, and most samples of them: some seconds.
const RECORDS: [usize; 2] = [40, 400];
const SAMPLES: f64 = 1e7;
/// Share of simulated records that have to keep a promise of 95 %: fewer than 36 of 40 have a chance of 5 %.
const KEPT: f64 = 0.9;
/// How much longer a record is tried that does not keep it, and how often.
const LONGER: f64 = 1.4;
const TRIES: usize = 6;

/// What `plan` takes.
#[derive(Args)]
pub struct Arguments {
    /// A capture whose noise is the present knowledge; without it and without --model the paper's figures
    capture: Option<PathBuf>,
    /// A model file instead of a capture
    #[arg(long, value_name = "FILE", conflicts_with = "capture")]
    model: Option<PathBuf>,
    /// How well something is wanted, 95 %: `"K within 20 %"` (of N, B, K, Q, R) or `"angle within 2 deg after 600 s"`;
    /// several separated by commas
    #[arg(long, value_name = "TERM within X %")]
    want: Option<String>,
    /// Two causes to be told apart: `temperature,rate_ramp`
    #[arg(long, value_name = "CAUSE,CAUSE")]
    separate: Option<String>,
    /// The gyro, where there are several
    #[arg(long, value_name = "NAME")]
    channel: Option<String>,
    /// Simulate so many records as long as planned, and count how many keep the promise of --want; without it 40 (400 of an
    /// angle) where that takes seconds; 0 for none
    #[arg(long, value_name = "RECORDS")]
    check: Option<usize>,
    /// Seed of the check
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Write the plan as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    #[command(flatten)]
    input: Input,
}

/// The plan, as `--json` writes it.
#[derive(Debug, Serialize)]
struct Plan {
    format: &'static str,
    noise: Noise,
    want: Vec<Wanted>,
    angle: Vec<WantedAngle>,
    separate: Vec<Told>,
    /// Whether nothing is to be simulated.
    #[serde(skip)]
    is_unchecked: bool,
}

/// What is known of the noise, deg/s and s.
#[derive(Clone, Debug, Serialize)]
struct Noise {
    from: String,
    rate_hz: f64,
    n: f64,
    b: f64,
    k: f64,
    q: f64,
    r: f64,
    notes: Vec<String>,
    /// Upper limits of what is not established, in the order of [`Letter::ALL`]; 0 where there is none.
    #[serde(skip)]
    limits: [f64; 5],
}

impl Noise {
    /// With one term as large as it may be, where it is not established.
    fn at_most(&self, letter: Letter) -> Option<(Self, f64)> {
        let limit = self.limits[letter as usize];
        let mut noise = self.clone();
        *match letter {
            Letter::N => &mut noise.n,
            Letter::B => &mut noise.b,
            Letter::K => &mut noise.k,
            Letter::Q => &mut noise.q,
            Letter::R => &mut noise.r,
        } = limit;
        (limit > 0.0).then_some((noise, limit))
    }

    fn truth(&self) -> Truth {
        Truth {
            n: self.n,
            b: self.b,
            k: self.k,
            q: self.q,
            r: self.r,
        }
    }

    fn known(&self) -> KnownNoise {
        KnownNoise {
            angle_random_walk_n: self.n,
            bias_instability_b: self.b,
            rate_random_walk_k: self.k,
            quantization_noise_q: self.q,
            rate_ramp_r: self.r,
        }
    }
}

#[derive(Debug, Serialize)]
struct Wanted {
    term: &'static str,
    within_percent: f64,
    /// Long enough by the Fisher information, and by the check where there is one.
    seconds: f64,
    /// By the Fisher information alone.
    fisher_seconds: f64,
    /// Where the term is not established: the limit that the plan takes for its size, deg/s and s. A smaller one takes longer.
    if_as_large_as: Option<f64>,
    /// At a quarter of the rate and at four times it.
    seconds_at: [(f64, f64); 2],
    /// Share of simulated records of `seconds` whose estimate is within the wanted part of the truth.
    checked_share: Option<f64>,
    /// The same of `fisher_seconds`.
    fisher_share: Option<f64>,
}

/// Runs it.
pub fn run(arguments: &Arguments) -> Result<()> {
    Outputs::beside(arguments.capture.iter().chain(&arguments.model))
        .result("--json", arguments.json.as_ref())?;
    if arguments.want.is_none() && arguments.separate.is_none() {
        miette::bail!(
            help = "write `--want \"K within 20 %\"` or `--separate temperature,rate_ramp`",
            "nothing to plan for"
        );
    }
    let noise = noise(arguments)?;
    let quiet = arguments.input.quiet;
    if !quiet {
        let or_none = |value: f64, text: String| {
            if value > 0.0 {
                text
            } else {
                "none known".to_owned()
            }
        };
        say!(
            "noise  N {} deg/sqrt(h), B {}, K {}, {} Hz, from {}",
            number(noise.n * 60.0, 4),
            or_none(noise.b, format!("{} deg/h", number(noise.b * 3600.0, 3))),
            or_none(noise.k, format!("{:.2e} deg/s/sqrt(s)", noise.k)),
            tidy(noise.rate_hz, 6),
            noise.from
        );
        for note in &noise.notes {
            say!("{}", text::item("", note));
        }
    }
    let mut plan = Plan {
        format: "imu-stand-plan/1",
        noise,
        want: Vec::new(),
        angle: Vec::new(),
        separate: Vec::new(),
        is_unchecked: arguments.check == Some(0),
    };
    if let Some(text) = &arguments.want {
        for wish in wishes(text)? {
            match wish {
                Wish::Term {
                    letter,
                    within_percent,
                } => {
                    let wanted = want(&plan.noise, letter, within_percent, arguments)?;
                    plan.want.push(wanted);
                }
                Wish::Angle {
                    within_deg,
                    after_s,
                } => {
                    let rate = plan.noise.rate_hz;
                    let mut angle =
                        WantedAngle::plan(&plan.noise.known(), rate, within_deg, after_s);
                    let (records, most) = match arguments.check {
                        Some(records) => (records, CHECK_SAMPLES),
                        None => (RECORDS[1], SAMPLES),
                    };
                    angle.check(plan.noise.truth(), rate, records, most, arguments.seed);
                    plan.angle.push(angle);
                }
            }
        }
        if !quiet {
            for angle in &plan.angle {
                say!("{}", angle.sentence());
            }
            print_want(&plan);
        }
    }
    if let Some(text) = &arguments.separate {
        let causes: Vec<&str> = text.split(',').map(str::trim).collect();
        let [a, b] = causes[..] else {
            miette::bail!(
                help = "write `--separate temperature,rate_ramp`",
                "--separate: `{text}` is not two causes"
            );
        };
        for (cause, rival) in [(a, b), (b, a)] {
            let known = plan.noise.known();
            plan.separate
                .extend(separate(&known, plan.noise.rate_hz, cause, rival)?);
        }
        if !quiet {
            print_separate(&plan.separate);
        }
    }
    super::write_json(arguments.json.as_ref(), &plan)
}

/// What is known of the noise: of a capture, a model file, or the paper's.
fn noise(arguments: &Arguments) -> Result<Noise> {
    if let Some(path) = &arguments.capture {
        return of_capture(arguments, path);
    }
    let (model, from) = match &arguments.model {
        Some(path) => {
            let text = super::read_text(path)?;
            let model = ModelFile::parse(&text)
                .map_err(|error| miette::miette!("{}: {error}", path.display()))?;
            (model, super::name(path))
        }
        None => (ModelFile::paper(), "the paper".to_owned()),
    };
    let wanted = |name: &str| {
        arguments
            .channel
            .as_deref()
            .map_or(name.starts_with("gyro"), |c| c == name)
    };
    let channel = model
        .channels
        .iter()
        .find(|c| wanted(&c.name))
        .ok_or_else(|| {
            let names: Vec<&str> = model.channels.iter().map(|c| c.name.as_str()).collect();
            miette::miette!("no such gyro in {from}; there are {}", names.join(", "))
        })?;
    let baseline = |key: &str| channel.baseline.get(key).map_or(0.0, |p| p.value);
    let b = model
        .effects
        .iter()
        .filter(|e| e.cause == "flicker")
        .filter(|e| e.channels.is_empty() || e.channels.contains(&channel.name))
        .find_map(|e| e.parameters.get("bias_instability"))
        .map_or(0.0, |p| p.value / 3600.0);
    let r = model
        .effects
        .iter()
        .filter(|e| e.cause == "rate_ramp")
        .filter(|e| e.channels.is_empty() || e.channels.contains(&channel.name))
        .find_map(|e| e.parameters.get("slope"))
        .map_or(0.0, |p| p.value);
    Ok(Noise {
        from: format!("{from}, {}", channel.name),
        rate_hz: arguments.input.rate.unwrap_or(model.rate_hz),
        n: baseline("angle_random_walk") / 60.0,
        b,
        k: baseline("rate_random_walk"),
        q: baseline("quantization_noise"),
        r,
        notes: Vec::new(),
        limits: [0.0; 5],
    })
}

fn of_capture(arguments: &Arguments, path: &std::path::Path) -> Result<Noise> {
    let record = arguments.input.read(path)?.record;
    super::tell(path, &record);
    let channel = record
        .channels
        .iter()
        .find(|c| match &arguments.channel {
            Some(name) => c.name == *name,
            None => c.quantity == Quantity::Gyro,
        })
        .ok_or_else(|| {
            let names: Vec<&str> = record.channels.iter().map(|c| c.name.as_str()).collect();
            miette::miette!(
                help = "`--channel NAME` names one, `--columns` maps a foreign file",
                "{} has no such gyro; it has {}",
                path.display(),
                names.join(", ")
            )
        })?;
    let sampling = Sampling::of(&record, arguments.input.rate).map_err(super::explain)?;
    let runs = sampling.runs_of(&channel.values);
    let spectrum = Spectrum::with_gaps(&channel.values, &runs, &sampling.slots, sampling.tau0);
    let samples: usize = runs.iter().map(ExactSizeIterator::len).sum();
    if samples < LEAST_SAMPLES {
        return Err(super::explain(model::record::AnalysisError::Inconclusive {
            what: format!("a plan by the noise of {}", channel.name),
            have: samples as f64,
            need: LEAST_SAMPLES as f64,
            unit: "samples",
        }));
    }
    let longest = runs.iter().map(ExactSizeIterator::len).max().unwrap_or(0);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(arguments.seed);
    let described = fit_described(&spectrum, longest / 5, &mut rng);
    let found = &described.fit;
    let mut notes = Vec::new();
    notes.extend(misfit_warning(&described, sampling.tau0));
    let estimates = [
        found.term(Term::White),
        found.term(Term::Flicker),
        found.term(Term::RandomWalk),
        found.term(Term::Quantization),
        found.rate_ramp,
    ];
    let limits = estimates.map(|e| if e.value.is_none() { e.high } else { 0.0 });
    let mut value = |name: &str, unit: &str, e: noise::fit::Estimated| {
        e.value.unwrap_or_else(|| {
            notes.push(format!(
                "{name} is not established in this capture: planned as absent, it is {} {unit} at the most",
                number(e.high, 3)
            ));
            0.0
        })
    };
    let white = found.term(Term::White);
    // No gyro is without it: of what is not known, the worst.
    let n = white.value.unwrap_or(white.high);
    let b = value("B", "deg/s", found.term(Term::Flicker));
    let k = value("K", "deg/s/sqrt(s)", found.term(Term::RandomWalk));
    let q = value("Q", "deg", found.term(Term::Quantization));
    let r = value("R", "deg/s/s", found.rate_ramp);
    if white.value.is_none() {
        notes.push(format!(
            "N is not established in this capture: planned at its limit, {} deg/s*sqrt(s)",
            number(n, 3)
        ));
    }
    Ok(Noise {
        from: format!("{}, {}", super::name(path), channel.name),
        rate_hz: 1.0 / sampling.tau0,
        n,
        b,
        k,
        q,
        r,
        notes,
        limits,
    })
}

fn want(
    noise: &Noise,
    letter: Letter,
    within_percent: f64,
    arguments: &Arguments,
) -> Result<Wanted> {
    // A term that is not established is planned for as if it were as large as it may be.
    let (noise, if_as_large_as) = match noise.at_most(letter) {
        Some((noise, limit)) => (noise, Some(limit)),
        None => (noise.clone(), None),
    };
    let known = noise.known();
    if !(0.2..=100.0).contains(&within_percent) {
        miette::bail!(
            help = "write for example `--want \"K within 20 %\"`",
            "--want: {} within {within_percent} % is not to be planned for; 0.2 % to 100 % are",
            letter.name()
        );
    }
    if letter.size(&known) <= 0.0 {
        miette::bail!(
            help = "plan from a longer capture, or write a model file with the size you expect and give it by --model",
            "how long it takes to measure {} depends on its size, which {} does not tell",
            letter.name(),
            noise.from
        );
    }
    let relative = within_percent / 100.0 / Z_95;
    let at = |rate: f64| seconds_for(&known, rate, letter, relative).map_err(super::explain);
    let rate = noise.rate_hz;
    let fisher_seconds = at(rate)?;
    let seconds_at = [(rate / 4.0, at(rate / 4.0)?), (rate * 4.0, at(rate * 4.0)?)];
    let records = arguments.check.unwrap_or(RECORDS[0]);
    let samples = |seconds: f64| seconds * rate * records as f64;
    let is_long = samples(fisher_seconds) > SAMPLES;
    let most = arguments.check.map_or(SAMPLES, |_| CHECK_SAMPLES);
    let (mut seconds, mut fisher_share) = (fisher_seconds, None);
    let checked_share = if records == 0 || (arguments.check.is_none() && is_long) {
        None
    } else {
        // The information is what an estimate can reach that knows which terms there are; one that has to find them out
        // takes longer.
        let share = |seconds| check(&noise, letter, within_percent, seconds, records, arguments);
        let mut kept = share(seconds)?;
        fisher_share = Some(kept);
        for _ in 0..TRIES {
            if kept >= KEPT || samples(LONGER * seconds) > most {
                break;
            }
            seconds *= LONGER;
            kept = share(seconds)?;
        }
        Some(kept)
    };
    Ok(Wanted {
        term: letter.name(),
        within_percent,
        seconds,
        fisher_seconds,
        if_as_large_as,
        seconds_at,
        checked_share,
        fisher_share,
    })
}

fn check(
    noise: &Noise,
    letter: Letter,
    within_percent: f64,
    seconds: f64,
    records: usize,
    arguments: &Arguments,
) -> Result<f64> {
    let samples = (seconds * noise.rate_hz).ceil();
    if samples * records as f64 > CHECK_SAMPLES {
        miette::bail!(
            help = "fewer records, or a lower `--rate`",
            "--check {records}: {records} records of {samples} samples take too long"
        );
    }
    let truth = noise.truth();
    let samples = samples as usize;
    let tau0 = 1.0 / noise.rate_hz;
    let size = letter.size(&noise.known());
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(arguments.seed);
    let kept = (0..records)
        .filter(|_| {
            let y = truth.record(samples, tau0, &mut rng);
            let found = fit(&Spectrum::of(&y, std::slice::from_ref(&(0..samples)), tau0));
            let value = match letter {
                Letter::N => found.term(Term::White).value,
                Letter::B => found.term(Term::Flicker).value,
                Letter::K => found.term(Term::RandomWalk).value,
                Letter::Q => found.term(Term::Quantization).value,
                Letter::R => found.rate_ramp.value.map(f64::abs),
            };
            value.is_some_and(|v| (v / size - 1.0).abs() <= within_percent / 100.0)
        })
        .count();
    Ok(kept as f64 / records.max(1) as f64)
}

/// A time for a person.
pub(super) fn duration(seconds: f64) -> String {
    if seconds < 120.0 {
        format!("{seconds:.0} s")
    } else if seconds < 7200.0 {
        format!("{:.0} min", seconds / 60.0)
    } else if seconds < 48.0 * 3600.0 {
        format!("{:.1} h", seconds / 3600.0)
    } else {
        format!("{:.1} days", seconds / 86_400.0)
    }
}

fn print_want(plan: &Plan) {
    for w in &plan.want {
        let [slower, faster] = w.seconds_at;
        if let Some(limit) = w.if_as_large_as {
            say!(
                "{} is not established: were it as large as its limit, {limit:.2e} (deg, s), then",
                w.term
            );
        }
        say!(
            "{} within {} % (95 %)  record {} at {} Hz ({:.0} s); by the information alone {} at {} Hz, {} at {} Hz",
            w.term,
            w.within_percent,
            duration(w.seconds),
            tidy(plan.noise.rate_hz, 6),
            w.seconds.ceil(),
            duration(slower.1),
            tidy(slower.0, 6),
            duration(faster.1),
            tidy(faster.0, 6)
        );
        match w.checked_share {
            Some(share) => say!(
                "    checked: {:.1} % of simulated records of that length are within it{}",
                100.0 * share,
                w.fisher_share
                    .filter(|_| w.seconds > w.fisher_seconds)
                    .map_or_else(String::new, |first| format!(
                        "; of the {} that the Fisher information asks for {:.1} %, for a record has to tell which terms there \
                         are as well",
                        duration(w.fisher_seconds),
                        100.0 * first
                    ))
            ),
            None if plan.is_unchecked => {}
            None => {
                say!(
                    "    not checked: so long a record takes its time to simulate; `--check 20` does"
                );
            }
        }
    }
    say!("what a record of a given length tells (half of the 95 % interval):");
    let mut lengths = vec![600.0, 3600.0, 8.0 * 3600.0, 24.0 * 3600.0];
    lengths.extend(plan.want.iter().map(|w| w.seconds));
    lengths.sort_by(f64::total_cmp);
    for seconds in lengths {
        let e = expected(&plan.noise.known(), plan.noise.rate_hz, seconds);
        let parts = Letter::ALL.into_iter().filter_map(|letter| {
            let relative = e.of(letter)?;
            // Beyond this the symmetric interval means nothing: the term is not established.
            Some(if Z_95 * relative > 1.0 {
                format!("{} not established", letter.name())
            } else {
                format!("{} +- {:.2} %", letter.name(), 100.0 * Z_95 * relative)
            })
        });
        let line: String = parts.map(|part| format!("{part:<20}")).collect();
        say!("    {:>9}  {}", duration(seconds), line.trim_end());
    }
}
