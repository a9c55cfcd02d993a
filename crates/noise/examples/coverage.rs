//! Coverage of the intervals of N, B, K, Q and R, and accuracy of the values, over synthetic records of known noise.
//!
//! `cargo run --release -p noise --example coverage -- [RUNS] [SEED] [CELL] [whole]`: RUNS records of 600 s a cell, a fourth
//! of them of 2 h and a tenth of 8 h, 20 Hz. Without a seed a fresh one is taken and printed. CELL picks the cells whose
//! title contains it. `whole` fits the whole spectrum without the check that may narrow it, which takes five times less.

use noise::fit::{Estimated, Spectrum, Term, fit, fit_described};
use noise::synthetic::Truth;
use rand_core::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

const TAU0: f64 = 0.05;
/// 5.27 deg/sqrt(h).
const PAPER_N: f64 = 5.27 / 60.0;

/// Title, truth, seconds, and how many times fewer records than asked.
fn cells() -> Vec<(&'static str, Truth, f64, usize)> {
    let none = Truth::default();
    let paper = Truth { n: PAPER_N, ..none };
    let quiet = Truth { n: 0.056, ..none };
    vec![
        ("600 s: N", paper, 600.0, 1),
        ("600 s: N, K 0.0005", Truth { k: 5e-4, ..paper }, 600.0, 1),
        ("600 s: N, K 0.002", Truth { k: 2e-3, ..paper }, 600.0, 1),
        ("600 s: N, K 0.005", Truth { k: 5e-3, ..paper }, 600.0, 1),
        ("600 s: N, K 0.02", Truth { k: 0.02, ..paper }, 600.0, 1),
        ("600 s: N, B 0.016", Truth { b: 0.016, ..paper }, 600.0, 1),
        ("600 s: N, B 0.063", Truth { b: 0.063, ..paper }, 600.0, 1),
        (
            "600 s: N, B 0.03, K 0.002",
            Truth {
                b: 0.03,
                k: 2e-3,
                ..paper
            },
            600.0,
            1,
        ),
        ("600 s: N, Q 0.01", Truth { q: 0.01, ..paper }, 600.0, 1),
        ("600 s: N, Q 0.002", Truth { q: 0.002, ..paper }, 600.0, 1),
        ("600 s: N, R 0.002", Truth { r: 0.002, ..paper }, 600.0, 1),
        (
            "600 s: N, K 0.002, R 0.003",
            Truth {
                k: 2e-3,
                r: 0.003,
                ..paper
            },
            600.0,
            1,
        ),
        (
            "600 s: N, K 0.0005, R 0.002",
            Truth {
                k: 5e-4,
                r: 0.002,
                ..paper
            },
            600.0,
            1,
        ),
        (
            "600 s: N, K 0.001, R 0.002",
            Truth {
                k: 1e-3,
                r: 0.002,
                ..paper
            },
            600.0,
            1,
        ),
        (
            "600 s: N, K 0.005, R 0.005",
            Truth {
                k: 5e-3,
                r: 0.005,
                ..paper
            },
            600.0,
            1,
        ),
        ("2 h: N, K", Truth { k: 3e-4, ..quiet }, 7200.0, 4),
        (
            "2 h: N, B, K",
            Truth {
                b: 0.016,
                k: 3e-4,
                ..quiet
            },
            7200.0,
            4,
        ),
        ("8 h: N, K", Truth { k: 3e-4, ..quiet }, 28_800.0, 10),
        (
            "8 h: N, B, K",
            Truth {
                b: 0.016,
                k: 3e-4,
                ..quiet
            },
            28_800.0,
            10,
        ),
        (
            "8 h: N, B, K, Q, R",
            Truth {
                b: 0.016,
                k: 3e-4,
                q: 0.004,
                r: 4e-6,
                ..quiet
            },
            28_800.0,
            10,
        ),
    ]
}

fn main() {
    let mut arguments = std::env::args().skip(1);
    let runs: usize = arguments.next().and_then(|a| a.parse().ok()).unwrap_or(400);
    let seed: u64 = arguments
        .next()
        .and_then(|a| a.parse().ok())
        .unwrap_or_else(|| {
            std::time::SystemTime::now()
                .duration_since(std::time::UNIX_EPOCH)
                .map_or(1, |d| d.as_nanos() as u64 % 1_000_000_007)
        });
    let only = arguments.next().unwrap_or_default();
    let whole = arguments.next().as_deref() == Some("whole");
    println!("seed {seed}, 20 Hz; truth in deg and s\n");
    println!(
        "| record | term | runs | value given | estimate/truth, median (5 .. 95 %) | 95 % interval holds truth | truth below / above it | where a value is given |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    let chosen = cells().into_iter().enumerate();
    for (cell, (title, truth, seconds, fewer)) in chosen.filter(|c| c.1.0.contains(&only)) {
        let runs = (runs / fewer).max(10);
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed.wrapping_add(cell as u64));
        let mut checks = rng.clone();
        checks.jump();
        let (mut narrowed, mut refused) = (0, 0);
        let samples = (seconds / TAU0).round() as usize;
        let mut found: Vec<[Estimated; 5]> = Vec::new();
        for _ in 0..runs {
            let y = truth.record(samples, TAU0, &mut rng);
            let spectrum = Spectrum::of(&y, std::slice::from_ref(&(0..samples)), TAU0);
            // As `imu-stand analyze` does: the terms are fitted to a part of the spectrum where they do not describe it.
            let fitted = if whole {
                fit(&spectrum)
            } else {
                let described = fit_described(&spectrum, samples / 5, &mut checks);
                narrowed += usize::from(described.from_m > 1);
                refused += usize::from(described.hold_from_m().is_none());
                described.fit
            };
            let t = fitted.terms;
            found.push([t[0], t[1], t[2], t[3], fitted.rate_ramp]);
        }
        for (name, index, value) in [
            ("N", Term::White as usize, truth.n),
            ("B", Term::Flicker as usize, truth.b),
            ("K", Term::RandomWalk as usize, truth.k),
            ("Q", Term::Quantization as usize, truth.q),
            ("R", 4, truth.r),
        ] {
            let all: Vec<Estimated> = found.iter().map(|f| f[index]).collect();
            let given: Vec<Estimated> = all.iter().copied().filter(|e| e.value.is_some()).collect();
            let share = |n: usize, of: usize| {
                if of == 0 {
                    "-".to_owned()
                } else {
                    format!("{:.3}", n as f64 / of as f64)
                }
            };
            // An upper limit of a ramp is one of its magnitude.
            let holds = |e: &Estimated| e.low <= value && value <= e.high;
            let mut ratios: Vec<f64> = all.iter().map(|e| e.value.unwrap_or(0.0) / value).collect();
            ratios.sort_by(f64::total_cmp);
            let at = |p: f64| ratios[((runs - 1) as f64 * p).round() as usize];
            let ratio = if value == 0.0 {
                "absent".to_owned()
            } else {
                format!("{:.3} ({:.3} .. {:.3})", at(0.5), at(0.05), at(0.95))
            };
            println!(
                "| {title} | {name} | {runs} | {} | {ratio} | {} | {} / {} | {} |",
                share(given.len(), runs),
                share(all.iter().filter(|e| holds(e)).count(), runs),
                share(all.iter().filter(|e| value < e.low).count(), runs),
                share(all.iter().filter(|e| value > e.high).count(), runs),
                share(given.iter().filter(|e| holds(e)).count(), given.len()),
            );
        }
        eprintln!(
            "{title}: fitted to a part of the spectrum in {narrowed}, not described in {refused} of {runs}"
        );
    }
}
