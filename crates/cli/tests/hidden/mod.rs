//! What is hidden in the stand, how strong it is, and whether the diagnosis names it: for the tests that hide something,
//! through the firmware's logic and through its image.

mod strength;

use std::collections::BTreeMap;

use campaign::tally::Rate;
use diagnosis::DiagnoseOptions;
use diagnosis::result::{Diagnosis, Finding};
use imu_stand::ReadOptions;
use imu_stand::capture::{read_from, write_to};
use imu_stand::stand::{Hidden, Plan, Sizes, plan};
use model::record::Record;

/// What is asked of what is strong enough: named at least; of everything: wrong names and false alarms at most.
pub const NAMED: f64 = 0.90;
const WRONG: f64 = 0.10;
const FALSE_ALARM: f64 = 0.02;
/// Chance of failing an engine that just meets them.
const CHANCE: f64 = 1e-3;
/// Length of a run, s.
const SECONDS: f64 = 600.0;

/// The causes that name it, and those that name a part of it: neither right nor wrong.
fn causes(hidden: Hidden) -> (&'static [&'static str], &'static [&'static str]) {
    match hidden {
        Hidden::None | Hidden::Random => (&[], &[]),
        Hidden::Tempco => (&["temperature"], &[]),
        Hidden::TempcoCurved => (&["temperature_quadratic"], &["temperature"]),
        Hidden::MotorCoupling => (&["motor_bias"], &[]),
        Hidden::MotorNoise => (&["motor_noise"], &[]),
        Hidden::SupplyCoupling => (&["supply_sensitivity"], &[]),
        Hidden::Vibration => (&["line"], &[]),
        // The blow itself, two samples of it, is one that the base moved.
        Hidden::Knock => (&["bias_step"], &["shock", "outliers", "base_motion"]),
        Hidden::Stall | Hidden::SilentStall | Hidden::DeadSpi => (&["stale_samples"], &[]),
        Hidden::WarmUp => (&["warm_up"], &[]),
        Hidden::Leak => (&["rate_ramp"], &[]),
        Hidden::SlowFilter => (&["low_pass"], &[]),
        Hidden::WanderingBias => (&["gauss_markov"], &[]),
        Hidden::Trap => (&["telegraph"], &["gauss_markov", "flicker", "bias_step"]),
        Hidden::GSensitivity => (&["g_sensitivity"], &[]),
        // Noise that decays within 15 ms, behind the part's filter, is still a little alike 50 ms later.
        Hidden::CommonNoise => (&["common_noise"], &["low_pass"]),
        Hidden::NoisySpell => (&["noise_change"], &[]),
        Hidden::Glitches => (&["outliers"], &[]),
        // The lowest bit held is a coarser unit as well.
        Hidden::StuckBit => (&["stuck_bit"], &["coarse_lsb"]),
        Hidden::LossyLine => (&["dropped_samples"], &[]),
        Hidden::Shove => (&["base_motion"], &[]),
        Hidden::ScaleError => (&["scale_error"], &["base_motion"]),
        Hidden::WrongCrystal => (&["clock_rate"], &[]),
        Hidden::Bump => (&["shock"], &[]),
        Hidden::AccTempco => (&["temperature"], &[]),
        Hidden::AccReference => (&["supply_sensitivity"], &[]),
        Hidden::Uncalibrated => (&["temperature", "motor_bias", "cross_axis"], &[]),
    }
}

/// A run with something hidden in it.
pub struct Draw {
    /// Its number.
    pub number: u64,
    /// What.
    pub hidden: Hidden,
    /// The run.
    pub plan: Plan,
    /// Its own seed.
    pub seed: u64,
}

impl Draw {
    /// Draw `number` of a seed: what is hidden goes round, or at random where `any` is set, everything else by chance.
    pub fn of(seed: u64, number: u64, any: bool) -> Self {
        let own = seed.wrapping_add(0x9e37_79b9_7f4a_7c15u64.wrapping_mul(number + 1));
        let kinds = Hidden::ALL.len() as u64 + 1;
        let which = if any { mixed(own) } else { number } % kinds;
        let hidden = match which {
            0 => Hidden::None,
            which => Hidden::ALL[which as usize - 1],
        };
        Draw {
            number,
            hidden,
            plan: plan(hidden, Sizes::Any, SECONDS, own),
            seed: own,
        }
    }

    /// Grades what the diagnosis says of the record of this run.
    pub fn graded(&self, record: &Record) -> Graded {
        let found = diagnosed(record, self.seed);
        let (names, parts) = causes(self.hidden);
        let channel = (self.plan.channel).map(|axis| ["gyro_x", "gyro_y", "gyro_z"][axis]);
        let here = |finding: &Finding| {
            channel.is_none_or(|channel| finding.channels.iter().any(|c| c == channel))
        };
        let says = |finding: &Finding, names: &[&str]| {
            here(finding)
                && std::iter::once(&finding.cause)
                    .chain(finding.alternatives.iter().map(|rival| &rival.cause))
                    .any(|name| names.contains(&name.as_str()))
        };
        Graded {
            hidden: self.hidden,
            strength: strength::strength(&self.plan, self.hidden),
            named: found.findings.iter().any(|finding| says(finding, names)),
            wrong: (found.findings.iter())
                .any(|finding| !says(finding, names) && !says(finding, parts)),
            unexplained: !found.unexplained.is_empty(),
            said: words(&found),
        }
    }
}

/// An even spread of a number's bits (SplitMix64's last step).
fn mixed(number: u64) -> u64 {
    let a = (number ^ number >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let b = (a ^ a >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    b ^ b >> 31
}

/// What the diagnosis says of the capture file of a record, and of nothing else.
pub fn diagnosed(record: &Record, seed: u64) -> Diagnosis {
    let mut file = Vec::new();
    write_to(&mut file, record).expect("memory takes it");
    let read = read_from(file.as_slice(), &ReadOptions::default()).expect("it is a capture");
    let options = DiagnoseOptions {
        seed,
        file: "hidden.csv".into(),
        hash: None,
        no_evidence: true,
        ..DiagnoseOptions::default()
    };
    diagnosis::diagnose(&read.record, &options)
        .expect("600 s are enough")
        .diagnosis
}

/// Causes and their channels; what is unexplained.
pub fn words(diagnosis: &Diagnosis) -> Vec<String> {
    let named =
        (diagnosis.findings.iter()).map(|f| format!("{} on {}", f.cause, f.channels.join("+")));
    let left =
        (diagnosis.unexplained.iter()).map(|u| format!("unexplained on {}: {}", u.channel, u.what));
    named.chain(left).collect()
}

/// How a draw was answered.
#[derive(Debug)]
pub struct Graded {
    /// What was hidden.
    pub hidden: Hidden,
    /// d', or how many samples or frames it touched.
    pub strength: strength::Strength,
    /// Named, on its channel.
    pub named: bool,
    /// Something else was named.
    pub wrong: bool,
    /// Something was unexplained.
    pub unexplained: bool,
    /// What was said.
    pub said: Vec<String>,
}

impl Graded {
    /// A draw and its answer.
    pub fn line(&self, draw: &Draw) -> String {
        format!(
            "draw {}: {} on {:?} ({}); said {}",
            draw.number,
            draw.plan.hidden,
            draw.plan.channel,
            self.strength,
            self.said.join(", ")
        )
    }

    /// Whether the answer is not wholly right.
    pub fn is_worth_a_line(&self) -> bool {
        let missed = !self.named && self.hidden != Hidden::None && self.strength.asks();
        self.wrong || self.unexplained || missed
    }
}

/// Rates by what was hidden, as a table.
pub fn table(all: &[Graded]) -> String {
    let mut rows: BTreeMap<Hidden, Vec<&Graded>> = BTreeMap::new();
    all.iter()
        .for_each(|g| rows.entry(g.hidden).or_default().push(g));
    let share = |rate: Rate| {
        let (low, high) = rate.interval();
        match rate.trials {
            0 => "-".to_owned(),
            n => format!(
                "{} of {n} ({:.0}..{:.0} %)",
                rate.hits,
                100.0 * low,
                100.0 * high
            ),
        }
    };
    let mut text = String::from(
        "| hidden | draws | named, where asked | named, weaker | a wrong name | unexplained |\n|---|---|---|---|---|---|\n",
    );
    for (hidden, row) in rows {
        let of = |keep: &dyn Fn(&Graded) -> bool, hit: &dyn Fn(&Graded) -> bool| {
            share(Rate::of(row.iter().filter(|g| keep(g)).map(|g| hit(g))))
        };
        let is_none = hidden == Hidden::None;
        text += &format!(
            "| {hidden:?} | {} | {} | {} | {} | {} |\n",
            row.len(),
            of(&|g| !is_none && g.strength.asks(), &|g| g.named),
            of(&|g| !is_none && !g.strength.asks(), &|g| g.named),
            of(&|_| true, &|g| g.wrong),
            of(&|_| true, &|g| g.unexplained),
        );
    }
    text
}

/// Fails where what was seen has a chance below 1e-3 under the rates that are asked for.
pub fn assert_rates(all: &[Graded]) {
    let hidden = || all.iter().filter(|g| g.hidden != Hidden::None);
    let named = Rate::of(hidden().filter(|g| g.strength.asks()).map(|g| g.named));
    let right = Rate::of(hidden().map(|g| !g.wrong));
    let silent = Rate::of(
        all.iter()
            .filter(|g| g.hidden == Hidden::None)
            .map(|g| !g.wrong && !g.unexplained),
    );
    for (what, rate, asked) in [
        ("named where it is strong enough", named, NAMED),
        ("without a wrong name", right, 1.0 - WRONG),
        ("silent where nothing is wrong", silent, 1.0 - FALSE_ALARM),
    ] {
        println!("{what}: {} of {}", rate.hits, rate.trials);
        assert!(
            rate.trials == 0 || rate.at_most(asked) > CHANCE,
            "{what}: {} of {}, less than {asked}",
            rate.hits,
            rate.trials
        );
    }
}
