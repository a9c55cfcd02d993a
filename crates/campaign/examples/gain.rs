//! What findings claim to gain, held against what they gain on fresh records of the same stands: for each cause the mean of
//! the claims, of that what the planted strength is worth, and the spread of claim less mean over the stated error, which is 1
//! where that is right; the angles before and after; and how many gains have no number.
//!
//! `cargo run -p campaign --example gain -- [stands] [records of each] [seed] [row]`

use campaign::plant::{COUNTED, STRONG, Truth, as_effect, plant, plant_counted};
use campaign::random::Draw;
use campaign::stand::{GYROS, Stand};
use diagnosis::result::Finding;
use diagnosis::{DiagnoseOptions, diagnose};

/// Strengths of what is planted, d'.
const STRENGTHS: (f64, f64) = (12.0, 20.0);

/// What was claimed on the records of some stands.
#[derive(Default)]
struct Claims {
    /// By stand: nats and standard error of each record in which the cause was named.
    of: Vec<Vec<(f64, f64)>>,
    /// Nats that the strengths are worth on three fifths of a record.
    worth: f64,
    /// Sums of the angles over 10 and 100 s, before and after, and their number.
    angles: [[f64; 3]; 4],
    named: usize,
    records: usize,
    /// Findings without a score, of them without a reason.
    without: [usize; 2],
}

impl Claims {
    fn add(&mut self, f: &Finding) {
        self.named += 1;
        let gain = f.gain.as_ref();
        let score = gain.and_then(|g| g.held_out_log_score_nats.zip(g.std_error));
        match score.filter(|s| s.0.is_finite() && s.1.is_finite()) {
            Some(score) => self
                .of
                .last_mut()
                .into_iter()
                .for_each(|own| own.push(score)),
            None => {
                self.without[0] += 1;
                self.without[1] += usize::from(f.no_gain.is_none());
            }
        }
        for (key, at) in [("10s", 0), ("100s", 2)] {
            if let Some(pair) = gain.and_then(|g| g.angle_rms_deg.get(key)) {
                for (i, v) in pair.iter().enumerate() {
                    self.angles[at + i][0] += v;
                    self.angles[at + i][1] += 1.0;
                }
            }
        }
    }

    fn line(&self, label: &str) {
        let (mut square, mut free, mut sum, mut count, mut error) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for own in self.of.iter().filter(|own| own.len() > 1) {
            let n = own.len() as f64;
            let mean = own.iter().map(|c| c.0).sum::<f64>() / n;
            let squares = own.iter().map(|c| ((c.0 - mean) / c.1).powi(2));
            square += squares.sum::<f64>();
            free += n - 1.0;
            sum += mean * n;
            error += own.iter().map(|c| c.1).sum::<f64>();
            count += n;
        }
        let angle = |i: usize| self.angles[i][0] / self.angles[i][1];
        println!(
            "{label:22} named {}/{}, no score {} (no reason {}); claimed {:.1} +- {:.1} nats, worth {:.1}; sd {:.2}; angle {:.2} -> {:.2} deg over 10 s, {:.2} -> {:.2} over 100 s",
            self.named,
            self.records,
            self.without[0],
            self.without[1],
            sum / count,
            error / count,
            self.worth / self.of.len().max(1) as f64,
            f64::sqrt(square / free),
            angle(0),
            angle(1),
            angle(2),
            angle(3),
        );
    }
}

fn stand_of(draw: &mut Draw, needs: campaign::stand::Needs) -> Stand {
    Stand::draw(draw, 600.0, 20.0, needs)
}

fn claimed(claims: &mut Claims, draw: &mut Draw, stand: &Stand, truth: &Truth, records: usize) {
    claims.of.push(vec![]);
    if truth.strength.is_finite() {
        claims.worth += 0.6 * truth.strength.powi(2) / 2.0;
    }
    let effects: Vec<_> = as_effect(truth).into_iter().collect();
    for _ in 0..records {
        let mut record = stand
            .record(&effects, draw.seed())
            .expect("a stand of this crate can be simulated");
        if let Some(signal) = truth.signal.as_deref().filter(|_| effects.is_empty()) {
            campaign::foreign::add(&mut record, &truth.channel, signal, draw);
        }
        let d = diagnose(&record, &DiagnoseOptions::default()).expect("a diagnosis");
        claims.records += 1;
        let own = |f: &&Finding| {
            let here = truth.channel.is_empty() || f.channels.contains(&truth.channel);
            f.cause == truth.cause && here
        };
        if let Some(f) = d.diagnosis.findings.iter().find(own) {
            claims.add(f);
        }
    }
}

fn main() {
    let argument = |i: usize, default: u64| {
        let given = std::env::args().nth(i).and_then(|a| a.parse().ok());
        given.unwrap_or(default)
    };
    let (stands, records, seed) = (argument(1, 4), argument(2, 10), argument(3, 1));
    let only = std::env::args().nth(4);
    let measure = |label: &str, family: u64, planted: &dyn Fn(&mut Draw) -> (Stand, Truth)| {
        if only.as_deref().is_some_and(|only| only != label) {
            return;
        }
        let mut claims = Claims::default();
        for k in 0..stands {
            let draw = &mut Draw::of(seed, family, k);
            let (stand, truth) = planted(draw);
            claimed(&mut claims, draw, &stand, &truth, records as usize);
        }
        claims.line(label);
    };
    for (family, row) in (5000..).zip(&STRONG) {
        measure(row.label, family, &|draw| {
            let mut stand = stand_of(draw, row.needs);
            let axis = draw.of_many(if row.moves { 2 } else { 3 });
            let wanted = draw.by_ratio(STRENGTHS.0, STRENGTHS.1);
            let truth = plant(draw, &mut stand, row.label, axis, wanted);
            (stand, truth)
        });
    }
    for (i, row) in COUNTED.iter().enumerate() {
        measure(row.label, 6000 + i as u64, &|draw| {
            let stand = stand_of(draw, row.needs);
            let axis = draw.of_many(GYROS.len());
            let truth = plant_counted(draw, &stand, i, axis);
            (stand, truth)
        });
    }
}
