//! Accuracy and coverage of the noise parameters on synthetic records, the same truth for every run of a table.
//!
//! `cargo run -p analysis --example accuracy -- [RUNS] [SEED]`: 20 Hz, N = 0.056 deg/s/sqrt(Hz),
//! K = 3e-4 deg/s/sqrt(s), B = 0.016 deg/s or none; and 600 s of the paper's noise with several K.

use analysis::likelihood::Dct;
use analysis::noise_fit::{Estimated, Spectrum, Term, fit};
use rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

const TAU0: f64 = 0.05;

struct Truth {
    n: f64,
    b: f64,
    k: f64,
    hours: f64,
}

fn record(truth: &Truth, rng: &mut Xoshiro256PlusPlus) -> Vec<f64> {
    let length = (truth.hours * 3600.0 / TAU0).round() as usize;
    let mut gauss = || -> f64 { StandardNormal.sample(rng) };
    // Flicker by its density over twice the length, of which the middle half has nothing of the ends.
    let mut y = if truth.b > 0.0 {
        let long = 2 * length;
        let c: Vec<f64> = (0..long)
            .map(|i| {
                let w = std::f64::consts::PI * i as f64 / long as f64;
                if i == 0 {
                    0.0
                } else {
                    truth.b / w.sqrt() * gauss()
                }
            })
            .collect();
        Dct::new(long).inverse(&c)[length / 2..length / 2 + length].to_vec()
    } else {
        vec![0.0; length]
    };
    let mut bias = 0.0;
    for v in &mut y {
        bias += truth.k * TAU0.sqrt() * gauss();
        *v += bias + truth.n / TAU0.sqrt() * gauss();
    }
    y
}

fn main() {
    let mut arguments = std::env::args().skip(1);
    let runs: usize = arguments.next().and_then(|a| a.parse().ok()).unwrap_or(40);
    let seed: u64 = arguments.next().and_then(|a| a.parse().ok()).unwrap_or(1);
    println!(
        "{runs} runs each, seed {seed}: median (5..95 %) of estimate / truth; share of 95 % intervals that hold the truth"
    );
    let paper = 5.27 / 60.0;
    for (title, truth, times) in [
        (
            "2 h, white + walk",
            Truth {
                n: 0.056,
                b: 0.0,
                k: 3e-4,
                hours: 2.0,
            },
            1,
        ),
        (
            "8 h, white + walk",
            Truth {
                n: 0.056,
                b: 0.0,
                k: 3e-4,
                hours: 8.0,
            },
            1,
        ),
        (
            "8 h, white + walk + flicker",
            Truth {
                n: 0.056,
                b: 0.016,
                k: 3e-4,
                hours: 8.0,
            },
            1,
        ),
        (
            "600 s, paper's N, K = 0.0005",
            Truth {
                n: paper,
                b: 0.0,
                k: 5e-4,
                hours: 1.0 / 6.0,
            },
            10,
        ),
        (
            "600 s, paper's N, K = 0.002",
            Truth {
                n: paper,
                b: 0.0,
                k: 2e-3,
                hours: 1.0 / 6.0,
            },
            10,
        ),
        (
            "600 s, paper's N, K = 0.005",
            Truth {
                n: paper,
                b: 0.0,
                k: 5e-3,
                hours: 1.0 / 6.0,
            },
            10,
        ),
    ] {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let runs = runs * times;
        let mut found: Vec<[Estimated; 4]> = Vec::new();
        for _ in 0..runs {
            let y = record(&truth, &mut rng);
            found.push(fit(&Spectrum::of(&y, std::slice::from_ref(&(0..y.len())), TAU0)).terms);
        }
        println!("{title}");
        for (name, term, value) in [
            ("N", Term::White, truth.n),
            ("B", Term::Flicker, truth.b),
            ("K", Term::RandomWalk, truth.k),
        ] {
            let all: Vec<Estimated> = found.iter().map(|f| f[term as usize]).collect();
            let established: Vec<f64> = all.iter().filter_map(|e| e.value).collect();
            if value == 0.0 {
                println!(
                    "  {name}: absent; claimed in {} of {runs}",
                    established.len()
                );
                continue;
            }
            let covered = all
                .iter()
                .filter(|e| e.low <= value && value <= e.high)
                .count();
            // A term not established counts as 0 in the quantiles.
            let mut ratios: Vec<f64> = all.iter().map(|e| e.value.unwrap_or(0.0) / value).collect();
            ratios.sort_by(f64::total_cmp);
            let at = |p: f64| ratios[((runs - 1) as f64 * p).round() as usize];
            println!(
                "  {name}: {:.3} ({:.3}..{:.3}), coverage {:.3}, established in {} of {runs}",
                at(0.5),
                at(0.05),
                at(0.95),
                covered as f64 / runs as f64,
                established.len()
            );
        }
    }
}
