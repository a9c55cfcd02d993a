//! A sample of the campaign with a fresh seed. Each limit is the worst count that an engine as good as the bar asks
//! would reach once in a thousand runs of this test, by the binomial distribution: it fails when the engine is worse,
//! not when the draw is unlucky. `IMU_STAND_SEED=N` repeats a draw.

#[path = "../../diagnosis/tests/draws/mod.rs"]
mod draws;

use std::sync::atomic::AtomicBool;

use campaign::plant::asked_from;
use campaign::tally::Rate;
use campaign::{Family, Hit, Outcome, Size, cases, fresh_seed, report, run_all, threads};

/// Runs of each kind: of a sample, and where all draws are asked for. How few are too few follows from how many were drawn. An
/// engine that names 8 in 10 effects where 98 in 100 are asked fails the sample, of some 50, in 95 of 100 runs, one that names 9
/// in 10 in 38 of 100 (in 80 where all are drawn).
const SAMPLE: Size = Size::Of(|family| {
    let [sample, all] = match family {
        Family::Clean => [40, 60],
        Family::Elsewhere => [3, 6],
        Family::CleanOf(_) => [4, 8],
        Family::One(_) => [3, 6],
        Family::Counted(_) => [1, 2],
        Family::Pair => [10, 12],
        Family::OneAxis => [4, 8],
        Family::Beside(_) => [2, 4],
        Family::Foreign(_) => [1, 1],
    };
    draws::of(sample, all)
});
/// Of the foreign effects, whose rates `cargo xtask campaign` grades and this test does not: one in so many is drawn, others
/// with each seed, to see that they can be made and are answered.
const ONE_IN: [u64; 2] = [20, 10];
/// Chance that an engine that just meets a bar fails the test on it.
const UNLUCKY: f64 = 1e-3;

/// A bar that is missed by more than the draw explains: `unlucky` is the chance of the rate where the bar is just met.
fn short(what: &str, rate: Rate, asked: &str, unlucky: f64) -> Option<String> {
    let told = format!("{what}: {rate}, asked {asked}");
    println!("{told}");
    (unlucky < UNLUCKY).then_some(told)
}

fn at_least(what: &str, rate: Rate, least: f64) -> Option<String> {
    let asked = format!("at least {least}");
    short(what, rate, &asked, rate.at_most(least))
}

fn at_most(what: &str, rate: Rate, most: f64) -> Option<String> {
    let asked = format!("at most {most}");
    short(what, rate, &asked, rate.at_least(most))
}

#[test]
fn a_fresh_sample_of_the_campaign_is_not_worse_than_its_bars() {
    let given = std::env::var("IMU_STAND_SEED").ok();
    let seed = given
        .and_then(|s| s.parse().ok())
        .unwrap_or_else(fresh_seed);
    println!("IMU_STAND_SEED={seed}");
    let never = AtomicBool::new(false);
    let one_in = draws::of(ONE_IN[0], ONE_IN[1]);
    let mut drawn = cases(SAMPLE, None);
    drawn.retain(|(family, _)| match family {
        Family::Foreign(number) => *number as u64 % one_in == seed % one_in,
        _ => true,
    });
    let all = run_all(seed, &drawn, threads(), &never, &|o| {
        if report::worth_a_line(o) {
            println!("{}", report::line(o));
        }
    });
    let of = |keep: &dyn Fn(&Outcome) -> bool, hit: &dyn Fn(&Outcome) -> bool| {
        Rate::of(all.iter().filter(|o| keep(o)).map(hit))
    };
    let strong = |o: &Outcome| {
        matches!(o.family, Family::One(_)) && o.truths.iter().all(|t| t.1 >= asked_from(t.0))
    };
    let planted = |o: &Outcome| !o.truths.is_empty();
    let counted = |o: &Outcome| matches!(o.family, Family::Counted(_));
    let found = |o: &Outcome| o.truths.iter().all(|t| t.2 != Hit::Missed);
    let pairs = all.iter().filter(|o| o.family == Family::Pair);
    let of_pairs = pairs.flat_map(|o| &o.truths).map(|t| t.2 != Hit::Missed);
    let alarms = of(&|o| o.family == Family::Clean, &|o| !o.quiet());
    let alone = of(&strong, &Outcome::right);
    let worse = [
        at_most("alarms on clean runs", alarms, 0.005),
        at_least("one effect, named alone", alone, 0.98),
        at_least("counted faults, found", of(&counted, &found), 0.98),
        at_least("two effects, each found", Rate::of(of_pairs), 0.98),
        at_most("wrong names", of(&planted, &|o| !o.wrong.is_empty()), 0.02),
    ];
    let worse: Vec<String> = worse.into_iter().flatten().collect();
    assert!(worse.is_empty(), "seed {seed}: {}", worse.join("; "));
}
