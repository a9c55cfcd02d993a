//! How long to record for an answer that is missing: `imu-stand-plan/1`.

mod record;
mod separate;
mod sequences;
mod wish;

use miette::Result;
use model::ModelFile;
use noise::fit::{Spectrum, Term, fit};
use noise::plan::{KnownNoise, Letter, seconds_for};
use noise::synthetic::Truth;
use rand_core::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::Serialize;

use crate::explain::explain;
pub use record::of_record;
pub use separate::{Told, lengths};
pub use sequences::{SEQUENCES, Sequence, tells_apart};
pub use wish::{WantedAngle, Wish, Z_95, wishes};

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

/// The plan, as `--json` writes it.
#[derive(Debug, Serialize)]
pub struct Plan {
    /// `imu-stand-plan/1`.
    pub format: &'static str,
    /// What is known.
    pub noise: Noise,
    /// For each wish about a term.
    pub want: Vec<Wanted>,
    /// For each wish about an angle.
    pub angle: Vec<WantedAngle>,
    /// Each cause against the other, by excitation.
    pub separate: Vec<Told>,
}

/// What is known of the noise, deg/s and s.
#[derive(Clone, Debug, Serialize)]
pub struct Noise {
    /// Where it is known from.
    pub from: String,
    /// Sample rate, Hz.
    pub rate_hz: f64,
    /// Angle random walk N, deg/s*sqrt(s).
    pub n: f64,
    /// Bias instability B, deg/s.
    pub b: f64,
    /// Rate random walk K, deg/s/sqrt(s).
    pub k: f64,
    /// Quantization noise Q, deg.
    pub q: f64,
    /// Rate ramp R, deg/s^2.
    pub r: f64,
    /// What a reader has to know.
    pub notes: Vec<String>,
    /// Upper limits of what is not established, in the order of [`Letter::ALL`]; 0 where there is none.
    #[serde(skip)]
    pub limits: [f64; 5],
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

    /// As the plans take it.
    #[must_use]
    pub fn known(&self) -> KnownNoise {
        KnownNoise {
            angle_random_walk_n: self.n,
            bias_instability_b: self.b,
            rate_random_walk_k: self.k,
            quantization_noise_q: self.q,
            rate_ramp_r: self.r,
        }
    }
}

/// The answer to [`Wish::Term`].
#[derive(Debug, Serialize)]
pub struct Wanted {
    /// N, B, K, Q or R.
    pub term: &'static str,
    /// Half of the 95 % interval, per cent of the size.
    pub within_percent: f64,
    /// Long enough by the Fisher information, and by the check where there is one.
    pub seconds: f64,
    /// By the Fisher information alone.
    pub fisher_seconds: f64,
    /// Where the term is not established: the limit that the plan takes for its size, deg/s and s. A smaller one takes longer.
    pub if_as_large_as: Option<f64>,
    /// At a quarter of the rate and at four times it.
    pub seconds_at: [(f64, f64); 2],
    /// Share of simulated records of `seconds` whose estimate is within the wanted part of the truth.
    pub checked_share: Option<f64>,
    /// The same of `fisher_seconds`.
    pub fisher_share: Option<f64>,
}

/// What to plan for.
#[derive(Clone, Copy, Debug, Default)]
pub struct Request<'a> {
    /// `K within 20 %`, `angle within 2 deg after 600 s`, several separated by commas.
    pub want: Option<&'a str>,
    /// Two causes to be told apart, separated by a comma.
    pub separate: Option<&'a str>,
    /// Simulated records by which a promise is checked; without it 40 (400 of an angle) where that takes seconds.
    pub check: Option<usize>,
    /// Seed of the check.
    pub seed: u64,
}

/// Plans.
///
/// # Errors
/// What is wanted of nothing, cannot be understood, or cannot be had; each says what to do.
pub fn plan(noise: Noise, request: &Request<'_>) -> Result<Plan> {
    request.check_any()?;
    let mut plan = Plan {
        format: "imu-stand-plan/1",
        noise,
        want: Vec::new(),
        angle: Vec::new(),
        separate: Vec::new(),
    };
    for wish in request.want.map_or(Ok(Vec::new()), wishes)? {
        match wish {
            Wish::Term {
                letter,
                within_percent,
            } => {
                let wanted = want(&plan.noise, letter, within_percent, request)?;
                plan.want.push(wanted);
            }
            Wish::Angle {
                within_deg,
                after_s,
            } => {
                let rate = plan.noise.rate_hz;
                let mut angle = WantedAngle::plan(&plan.noise.known(), rate, within_deg, after_s);
                let (records, most) = match request.check {
                    Some(records) => (records, CHECK_SAMPLES),
                    None => (RECORDS[1], SAMPLES),
                };
                angle.check(plan.noise.truth(), rate, records, most, request.seed);
                plan.angle.push(angle);
            }
        }
    }
    if let Some(text) = request.separate {
        let [a, b] = separate::two_causes(text)?;
        for pair in [[a, b], [b, a]] {
            let known = plan.noise.known();
            let told = separate::separate(&known, plan.noise.rate_hz, pair)?;
            plan.separate.extend(told);
        }
    }
    Ok(plan)
}

impl Request<'_> {
    /// Refuses a request for nothing.
    ///
    /// # Errors
    /// Where neither is asked for.
    pub fn check_any(&self) -> Result<()> {
        if self.want.is_none() && self.separate.is_none() {
            miette::bail!(
                help = "write `--want \"K within 20 %\"` or `--separate temperature,rate_ramp`",
                "nothing to plan for"
            );
        }
        Ok(())
    }

    /// Whether what is asked for is understood, whatever the noise.
    ///
    /// # Errors
    /// What is not, and how it is written.
    pub fn check_words(&self) -> Result<()> {
        self.want.map_or(Ok(Vec::new()), wishes)?;
        self.separate
            .map_or(Ok(()), |text| separate::two_causes(text).map(drop))
    }
}

/// What a model file says of the noise of a gyro: of the one of that name, or of the first.
///
/// # Errors
/// Where it has no such gyro.
pub fn of_model(
    model: &ModelFile,
    from: &str,
    channel: Option<&str>,
    rate_hz: Option<f64>,
) -> Result<Noise> {
    let wanted = |name: &str| channel.map_or(name.starts_with("gyro"), |c| c == name);
    let gyro = model
        .channels
        .iter()
        .find(|c| wanted(&c.name))
        .ok_or_else(|| {
            let names: Vec<&str> = model.channels.iter().map(|c| c.name.as_str()).collect();
            miette::miette!(
                help = "name one of them",
                "no such gyro in {from}; there are {}",
                names.join(", ")
            )
        })?;
    let baseline = |key: &str| gyro.baseline.get(key).map_or(0.0, |p| p.value);
    let b = model
        .effects
        .iter()
        .filter(|e| e.cause == "flicker")
        .filter(|e| e.channels.is_empty() || e.channels.contains(&gyro.name))
        .find_map(|e| e.parameters.get("bias_instability"))
        .map_or(0.0, |p| p.value / 3600.0);
    let r = model
        .effects
        .iter()
        .filter(|e| e.cause == "rate_ramp")
        .filter(|e| e.channels.is_empty() || e.channels.contains(&gyro.name))
        .find_map(|e| e.parameters.get("slope"))
        .map_or(0.0, |p| p.value);
    Ok(Noise {
        from: format!("{from}, {}", gyro.name),
        rate_hz: rate_hz.unwrap_or(model.rate_hz),
        n: baseline("angle_random_walk") / 60.0,
        b,
        k: baseline("rate_random_walk"),
        q: baseline("quantization_noise"),
        r,
        notes: Vec::new(),
        limits: [0.0; 5],
    })
}

/// The length, s, from `seconds` on, in steps, of which enough records keep to what is wanted, or the longest that is not too
/// long; with the share that does at the first length, and at this one. The information is what an estimate can reach that knows
/// which terms there are; one that has to find them out takes longer.
fn long_enough(
    mut seconds: f64,
    is_too_long: impl Fn(f64) -> bool,
    kept: impl Fn(f64) -> Result<f64>,
) -> Result<(f64, [f64; 2])> {
    let first = kept(seconds)?;
    let mut last = first;
    for _ in 0..TRIES {
        if last >= KEPT || is_too_long(LONGER * seconds) {
            break;
        }
        seconds *= LONGER;
        last = kept(seconds)?;
    }
    Ok((seconds, [first, last]))
}

fn want(
    noise: &Noise,
    letter: Letter,
    within_percent: f64,
    request: &Request<'_>,
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
    let at = |rate: f64| seconds_for(&known, rate, letter, relative).map_err(explain);
    let rate = noise.rate_hz;
    let fisher_seconds = at(rate)?;
    let seconds_at = [(rate / 4.0, at(rate / 4.0)?), (rate * 4.0, at(rate * 4.0)?)];
    let records = request.check.unwrap_or(RECORDS[0]);
    let samples = |seconds: f64| seconds * rate * records as f64;
    let is_long = samples(fisher_seconds) > SAMPLES;
    let most = request.check.map_or(SAMPLES, |_| CHECK_SAMPLES);
    let (mut seconds, mut fisher_share) = (fisher_seconds, None);
    let checked_share = if records == 0 || (request.check.is_none() && is_long) {
        None
    } else {
        let kept = |seconds| check(&noise, letter, within_percent, seconds, records, request);
        let [first, last];
        (seconds, [first, last]) = long_enough(seconds, |s| samples(s) > most, kept)?;
        fisher_share = Some(first);
        Some(last)
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
    request: &Request<'_>,
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
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(request.seed);
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
