//! One run: what is planted, what the diagnosis says, and how that is graded.

use std::time::Instant;

use diagnosis::result::{Diagnosis, Finding};
use diagnosis::{DiagnoseOptions, diagnose};
use model::file::EffectModel;
use model::record::Record;
use serde::{Deserialize, Serialize};

use crate::clean::KINDS;
use crate::company::{self, STRUCTURES};
use crate::foreign::{EFFECTS, Foreign, add, foreign};
use crate::plant::{COUNTED, STRONG, Truth, as_effect, plant, plant_counted};
use crate::random::Draw;
use crate::stand::{GYROS, Needs, Stand};

/// Families of runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Family {
    /// Nothing is wrong; 600 s at 20 Hz.
    Clean,
    /// Nothing is wrong; other rates and lengths.
    Elsewhere,
    /// Nothing is wrong; another kind of record, by its place in [`KINDS`].
    CleanOf(usize),
    /// One effect, by its place in [`STRONG`].
    One(usize),
    /// One effect that is counted, by its place in [`COUNTED`].
    Counted(usize),
    /// Two effects.
    Pair,
    /// Two or three effects on one axis.
    OneAxis,
    /// One effect on an axis with a structure of another kind, by its place in [`STRUCTURES`].
    Beside(usize),
    /// An effect that the library does not have, by its place among those.
    Foreign(usize),
}

impl Family {
    /// Its number and its row of the tables.
    fn row(self) -> (u16, &'static str) {
        match self {
            Self::Clean => (1, "nothing"),
            Self::Elsewhere => (2, "nothing, other rates"),
            Self::Pair => (3, "two"),
            Self::OneAxis => (4, "two or three on one axis"),
            Self::CleanOf(i) => (KINDS[i].id, KINDS[i].label),
            Self::Beside(i) => (STRUCTURES[i].id, STRUCTURES[i].label),
            Self::One(i) => (STRONG[i].id, STRONG[i].label),
            Self::Counted(i) => (COUNTED[i].id, COUNTED[i].label),
            Self::Foreign(i) => (EFFECTS[i].id, EFFECTS[i].name),
        }
    }

    /// A number that no other family has.
    #[must_use]
    pub fn number(self) -> u64 {
        self.row().0.into()
    }

    /// The row of the tables.
    #[must_use]
    pub fn label(self) -> &'static str {
        self.row().1
    }

    /// Whether `only` leaves it: its row of the tables, or for a foreign effect its set.
    #[must_use]
    pub fn is_of(self, only: &str) -> bool {
        let in_set = |i: usize| only == format!("set {}", EFFECTS[i].set);
        self.label() == only || matches!(self, Self::Foreign(i) if in_set(i))
    }
}

/// How an effect was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Hit {
    /// As the cause.
    Named,
    /// Among the alternatives of a cause named.
    InSet,
    /// Not.
    Missed,
}

/// An estimate beside the truth.
#[derive(Clone, Debug)]
pub struct Estimate {
    /// Row of the tables.
    pub label: &'static str,
    /// Parameter.
    pub parameter: String,
    /// Estimate, standard error, truth.
    pub value: f64,
    /// Standard error.
    pub std_error: f64,
    /// Truth.
    pub truth: f64,
}

/// What a run gave.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Family.
    pub family: Family,
    /// Number in it.
    pub index: u64,
    /// Row, strength and result of each effect planted.
    pub truths: Vec<(&'static str, f64, Hit)>,
    /// Causes named that are not true.
    pub wrong: Vec<String>,
    /// What is unexplained.
    pub unexplained: Vec<String>,
    /// The checks that see each of those entries; none where a term of the search without a name is all there is.
    pub checks: Vec<Vec<String>>,
    /// Estimates of what was named.
    pub estimates: Vec<Estimate>,
    /// Rate random walks of the axes.
    pub walks: [f64; 3],
    /// Strength of a foreign effect.
    pub strength: f64,
    /// Seconds that the diagnosis took.
    pub seconds: f64,
}

impl Outcome {
    /// Every effect found, nothing else said.
    #[must_use]
    pub fn right(&self) -> bool {
        self.truths.iter().all(|t| t.2 != Hit::Missed) && self.quiet()
    }

    /// Nothing wrong or unexplained said.
    #[must_use]
    pub fn quiet(&self) -> bool {
        self.wrong.is_empty() && self.unexplained.is_empty()
    }
}

/// A cause that is a part of another: naming it is neither right nor wrong.
fn part_of(named: &str, truth: &str) -> bool {
    matches!(
        (named, truth),
        ("line", "am_line")
            | ("temperature", "temperature_quadratic")
            | ("gauss_markov" | "flicker" | "bias_step", "telegraph")
    )
}

fn holds(f: &Finding, cause: &str) -> bool {
    f.cause == cause || f.alternatives.iter().any(|a| a.cause == cause)
}

fn about(f: &Finding, truth: &Truth) -> bool {
    truth.channel.is_empty() || f.channels.contains(&truth.channel)
}

fn grade(
    d: &Diagnosis,
    truths: &[Truth],
    allowed: &[&str],
) -> (Vec<Hit>, Vec<String>, Vec<Estimate>) {
    let mut estimates = vec![];
    let hit = |t: &Truth| {
        let mut own = d.findings.iter().filter(|f| about(f, t));
        let Some(f) = own.clone().find(|f| f.cause == t.cause) else {
            let in_set = own.any(|f| holds(f, t.cause));
            return if in_set { Hit::InSet } else { Hit::Missed };
        };
        let of_channel = f.per_channel.get(&t.channel).unwrap_or(&f.parameters);
        for (name, p) in of_channel {
            if let (Some(std_error), Some(truth)) = (p.std_error, t.parameters.get(name)) {
                estimates.push(Estimate {
                    label: t.label,
                    parameter: name.clone(),
                    value: p.value,
                    std_error,
                    truth: truth.value,
                });
            }
        }
        Hit::Named
    };
    let hits = truths.iter().map(hit).collect();
    let is_true = |f: &Finding| {
        let is_it = |t: &Truth| holds(f, t.cause) || part_of(&f.cause, t.cause);
        allowed.contains(&f.cause.as_str()) || truths.iter().any(|t| about(f, t) && is_it(t))
    };
    let wrong = d.findings.iter().filter(|f| !is_true(f));
    let told = wrong.map(|f| format!("{} on {}", f.cause, f.channels.join("+")));
    (hits, told.collect(), estimates)
}

/// Rates and lengths of [`Family::Elsewhere`].
pub const ELSEWHERE: [(f64, f64); 6] = [
    (1.0, 7200.0),
    (5.0, 1200.0),
    (20.0, 60.0),
    (20.0, 3600.0),
    (100.0, 300.0),
    (1000.0, 60.0),
];

/// A strength: half of them from `from` on, half below it down to 3.
fn strength(draw: &mut Draw, from: f64) -> f64 {
    if draw.chance(0.5) {
        draw.by_ratio(from, 2.0 * from)
    } else {
        draw.by_ratio(3.0, from)
    }
}

/// A run as planted, before the diagnosis.
struct Planted {
    record: Record,
    truths: Vec<Truth>,
    allowed: Vec<&'static str>,
    walks: [f64; 3],
    /// Strength of a foreign effect.
    strange: f64,
}

/// The environment that a family needs.
fn needed(family: Family) -> Needs {
    match family {
        Family::One(i) => STRONG[i].needs,
        Family::Pair | Family::OneAxis | Family::Beside(_) => Needs::ALL,
        Family::Foreign(i) => EFFECTS[i].needs,
        _ => Needs::default(),
    }
}

fn planted(seed: u64, family: Family, index: u64) -> Planted {
    let draw = &mut Draw::of(seed, family.number(), index);
    let mut truths: Vec<Truth> = vec![];
    let mut allowed: Vec<&'static str> = vec![];
    let (rate_hz, seconds) = match family {
        Family::Elsewhere => ELSEWHERE[index as usize % ELSEWHERE.len()],
        Family::CleanOf(i) => KINDS[i].extent(draw),
        _ => (20.0, 600.0),
    };
    let mut stand = Stand::draw(draw, seconds, rate_hz, needed(family));
    let mut axis = draw.of_many(3);
    let (mut unknown, mut added) = (None, None);
    match family {
        Family::Clean | Family::Elsewhere => {}
        Family::CleanOf(i) => KINDS[i].set_up(draw, &mut stand),
        Family::One(i) => {
            let row = &STRONG[i];
            let axis = if row.moves { axis.min(1) } else { axis };
            let wanted = strength(draw, row.asked_from);
            truths.push(plant(draw, &mut stand, row.label, axis, wanted));
            allowed.extend(row.true_parts);
        }
        Family::Counted(i) => truths.push(plant_counted(draw, &stand, i, axis)),
        Family::Pair => truths = company::two(draw, &mut stand),
        Family::OneAxis => truths = company::on_one_axis(draw, &mut stand),
        Family::Beside(i) => {
            let kind = &STRUCTURES[i];
            allowed.extend(kind.allowed);
            (truths, added) = company::beside_a_structure(draw, &mut stand, kind, axis);
        }
        Family::Foreign(i) => {
            let wanted = draw.by_ratio(25.0, 40.0);
            axis = EFFECTS[i].axis(axis);
            allowed.extend(EFFECTS[i].true_causes());
            unknown = Some(foreign(draw, &mut stand, i, axis, wanted));
        }
    }
    let mut record = recorded(draw, &stand, &truths, unknown.as_ref().map(|f| (axis, f)));
    if let Some(signal) = added {
        add(&mut record, GYROS[axis], &signal, draw);
    }
    if let Family::CleanOf(i) = family {
        KINDS[i].cut(&mut record, axis);
    }
    Planted {
        record,
        truths,
        allowed,
        walks: stand.walk_of_rate,
        strange: unknown.map_or(f64::NAN, |f| f.strength),
    }
}

/// What a stand reads with these effects, and with a foreign one on an axis.
fn recorded(
    draw: &mut Draw,
    stand: &Stand,
    truths: &[Truth],
    unknown: Option<(usize, &Foreign)>,
) -> Record {
    let effects: Vec<EffectModel> = truths.iter().filter_map(as_effect).collect();
    let measured = match unknown.filter(|(_, f)| f.replaces_noise()) {
        Some((axis, _)) => &stand.without_noise(axis),
        None => stand,
    };
    let mut record = measured
        .record(&effects, draw.seed())
        .expect("a stand of this crate can be simulated");
    for t in truths.iter().filter(|t| as_effect(t).is_none()) {
        let signal = t.signal.as_deref().unwrap_or(&[]);
        add(&mut record, &t.channel, signal, draw);
    }
    if let Some((axis, f)) = unknown {
        f.act(&mut record, stand, axis, draw);
    }
    record
}

/// Digest (FNV-1a, 64 bits) of what case `index` of a family plants: counts, flags and times of the record, and what is
/// true of it to nine digits. Builds that draw the same give the same.
#[must_use]
pub fn digest(seed: u64, family: Family, index: u64) -> u64 {
    let p = planted(seed, family, index);
    let mut hash = 0xcbf2_9ce4_8422_2325u64;
    let mut take = |bytes: &[u8]| {
        for byte in bytes {
            hash = (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
        }
    };
    let number = |v: f64| format!("{v:.8e};");
    for c in &p.record.channels {
        take(c.name.as_bytes());
        match &c.counts {
            Some(counts) => counts.iter().for_each(|c| take(&c.to_le_bytes())),
            None => c.values.iter().for_each(|v| take(number(*v).as_bytes())),
        }
    }
    let numbers = p.record.seq.iter().chain(&p.record.t_ticks).flatten();
    numbers.for_each(|n| take(&n.to_le_bytes()));
    let flags = p.record.flags.iter().flatten();
    flags.for_each(|f| take(&f.to_le_bytes()));
    let times = p.record.host_time_s.iter().flatten();
    times.for_each(|t| take(number(*t).as_bytes()));
    for t in &p.truths {
        take(format!("{} {} {};", t.label, t.cause, t.channel).as_bytes());
        take(number(t.strength).as_bytes());
        for (name, parameter) in &t.parameters {
            take(format!("{name} {};", number(parameter.value)).as_bytes());
        }
    }
    p.allowed.iter().for_each(|a| take(a.as_bytes()));
    let own = p.walks.iter().chain([&p.strange]);
    own.for_each(|v| take(number(*v).as_bytes()));
    hash
}

/// The answer to what case `index` plants.
fn answer(p: &Planted, index: u64) -> Diagnosis {
    let options = DiagnoseOptions {
        seed: index,
        ..DiagnoseOptions::default()
    };
    let d = diagnose(&p.record, &options).expect("a simulated run can be diagnosed");
    d.diagnosis
}

/// What case `index` of a family plants, in words, and the whole answer.
///
/// # Panics
/// As [`run`].
#[must_use]
pub fn describe(seed: u64, family: Family, index: u64) -> (String, Diagnosis) {
    let p = planted(seed, family, index);
    let told = |t: &Truth| {
        let values = t.parameters.iter();
        let values: Vec<String> = values.map(|(k, p)| format!("{k} {:.4}", p.value)).collect();
        let (label, channel, values) = (t.label, &t.channel, values.join(", "));
        format!("{label} on {channel} (d' {:.1}): {values}", t.strength)
    };
    let all: Vec<String> = p.truths.iter().map(told).collect();
    (all.join("; "), answer(&p, index))
}

/// Run case `index` of a family.
///
/// # Panics
/// When a simulated run cannot be diagnosed: that is a defect of the diagnosis.
#[must_use]
pub fn run(seed: u64, family: Family, index: u64) -> Outcome {
    let p = planted(seed, family, index);
    let begun = Instant::now();
    let d = answer(&p, index);
    let seconds = begun.elapsed().as_secs_f64();
    let (hits, wrong, estimates) = grade(&d, &p.truths, &p.allowed);
    let truths = p.truths.iter().zip(hits);
    let left = d.unexplained.iter();
    let told = left.clone().map(|u| format!("{}: {}", u.channel, u.what));
    Outcome {
        family,
        index,
        truths: truths.map(|(t, h)| (t.label, t.strength, h)).collect(),
        wrong,
        unexplained: told.collect(),
        checks: left.map(|u| u.checks.clone()).collect(),
        estimates,
        walks: p.walks,
        strength: p.strange,
        seconds,
    }
}
