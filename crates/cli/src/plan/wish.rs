//! What `imu-stand plan --want` understands.

use miette::Result;
use noise::plan::{KnownNoise, Letter, calibration_for};
use noise::synthetic::Truth;
use rand_core::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::Serialize;

/// Half of a 95 % interval in standard errors.
pub const Z_95: f64 = 1.959_964;

/// One wish.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Wish {
    /// `K within 20 %`.
    Term {
        /// The term.
        letter: Letter,
        /// Half of the 95 % interval, in per cent of the size.
        within_percent: f64,
    },
    /// `angle within 2 deg after 600 s`.
    Angle {
        /// Half of the 95 % interval, deg.
        within_deg: f64,
        /// Since the end of the calibration, s.
        after_s: f64,
    },
}

/// Wishes separated by commas.
///
/// # Errors
/// What is not of one of the two forms.
pub fn wishes(text: &str) -> Result<Vec<Wish>> {
    text.split(',')
        .map(|item| {
            wish(item).ok_or_else(|| {
                miette::miette!(
                    help = "write `--want \"K within 20 %\"` for N, B, K, Q or R, or `--want \"angle within 2 deg after 600 s\"`",
                    "--want: `{}` is not of the form `TERM within X %` or `angle within X deg after T s`",
                    item.trim()
                )
            })
        })
        .collect()
}

fn wish(item: &str) -> Option<Wish> {
    let words: Vec<&str> = item.split_whitespace().collect();
    let positive = |text: &str| {
        text.parse()
            .ok()
            .filter(|v: &f64| *v > 0.0 && v.is_finite())
    };
    if let ["angle", "within", deg, "deg", "after", seconds, "s"] = words[..] {
        return Some(Wish::Angle {
            within_deg: positive(deg)?,
            after_s: positive(seconds)?,
        });
    }
    let (letter, percent) = match words[..] {
        [letter, "within", percent] => (letter, percent.trim_end_matches('%')),
        [letter, "within", percent, "%"] => (letter, percent),
        _ => return None,
    };
    Some(Wish::Term {
        letter: Letter::ALL
            .into_iter()
            .find(|l| l.name().eq_ignore_ascii_case(letter))?,
        within_percent: positive(percent).filter(|p| *p <= 100.0)?,
    })
}

/// The answer to [`Wish::Angle`].
#[derive(Debug, Serialize)]
pub struct WantedAngle {
    /// Half of the 95 % interval that is wanted, deg.
    pub within_deg: f64,
    /// So long after the calibration, s.
    pub after_s: f64,
    /// Still calibration that is long enough; absent where none is.
    pub calibration_s: Option<f64>,
    /// The one that serves best, s.
    pub best_calibration_s: f64,
    /// Half of the 95 % interval of the angle with it, deg.
    pub best_within_deg: f64,
    /// Share of simulated stands whose angle is within the promise: the wish, or where no calibration keeps it, the best.
    pub checked_share: Option<f64>,
}

impl WantedAngle {
    /// By the noise, in deg/s and s.
    #[must_use]
    pub fn plan(noise: &KnownNoise, rate_hz: f64, within_deg: f64, after_s: f64) -> Self {
        let plan = calibration_for(noise, rate_hz, after_s, within_deg / Z_95);
        Self {
            within_deg,
            after_s,
            calibration_s: plan.calibration_s,
            best_calibration_s: plan.best_calibration_s,
            best_within_deg: Z_95 * plan.best_sigma,
            checked_share: None,
        }
    }

    /// Simulates so many stands at rest, calibrates and integrates each, and counts; nothing where that is more than
    /// `most` samples.
    pub fn check(&mut self, truth: Truth, rate_hz: f64, records: usize, most: f64, seed: u64) {
        let (calibration_s, within) = match self.calibration_s {
            Some(seconds) => (seconds, self.within_deg),
            None => (self.best_calibration_s, self.best_within_deg),
        };
        let calibration = (calibration_s * rate_hz).round().max(1.0);
        let after = (self.after_s * rate_hz).round().max(1.0);
        if records == 0 || (calibration + after) * records as f64 > most {
            return;
        }
        let (calibration, after) = (calibration as usize, after as usize);
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let kept = (0..records)
            .filter(|_| {
                let y =
                    Truth { r: 0.0, ..truth }.record(calibration + after, 1.0 / rate_hz, &mut rng);
                let (still, rest) = y.split_at(calibration);
                let bias = still.iter().sum::<f64>() / calibration as f64;
                let angle: f64 = rest.iter().map(|v| (v - bias) / rate_hz).sum();
                angle.abs() <= within
            })
            .count();
        self.checked_share = Some(kept as f64 / records as f64);
    }

    /// For a person.
    #[must_use]
    pub fn sentence(&self) -> String {
        let wish = format!(
            "angle within {} deg (95 %) {} s after the calibration",
            self.within_deg, self.after_s
        );
        let best = format!(
            "the best, {:.0} s, gives {} deg",
            self.best_calibration_s,
            crate::report::plot::number(self.best_within_deg, 3)
        );
        let checked = self.checked_share.map_or_else(String::new, |share| {
            format!(
                "\n    checked: {:.1} % of simulated angles are within {}",
                100.0 * share,
                if self.calibration_s.is_some() {
                    "it"
                } else {
                    "the best"
                }
            )
        });
        match self.calibration_s {
            Some(seconds) => {
                format!("{wish}  stand still for {seconds:.1} s first; {best}{checked}")
            }
            None => format!(
                "{wish}  no calibration does it: {best}; a shorter time or less noise would{checked}"
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_angle_is_kept_in_as_many_simulated_stands_as_promised() {
        // White noise, a walk and flicker: the promise is 95 %.
        let noise = KnownNoise {
            angle_random_walk_n: 0.088,
            bias_instability_b: 0.01,
            rate_random_walk_k: 0.002,
            ..KnownNoise::default()
        };
        let truth = Truth {
            n: 0.088,
            b: 0.01,
            k: 0.002,
            ..Truth::default()
        };
        for within in [6.0, 1e-3] {
            let mut wanted = WantedAngle::plan(&noise, 20.0, within, 60.0);
            assert_eq!(wanted.calibration_s.is_some(), within > 1.0, "{wanted:?}");
            wanted.check(truth, 20.0, 400, 1e9, 1);
            // Binomial(400, 0.95): 3.7 standard deviations.
            let share = wanted.checked_share.unwrap();
            assert!((0.91..=0.99).contains(&share), "{within}: {share}");
            assert!(
                wanted.sentence().contains("checked"),
                "{}",
                wanted.sentence()
            );
        }
    }

    #[test]
    fn wishes_are_read_as_people_write_them_and_nothing_else_is() {
        assert_eq!(
            wishes("K within 20 %, q within 5%, angle within 0.5 deg after 60 s").unwrap(),
            [
                Wish::Term {
                    letter: Letter::K,
                    within_percent: 20.0
                },
                Wish::Term {
                    letter: Letter::Q,
                    within_percent: 5.0
                },
                Wish::Angle {
                    within_deg: 0.5,
                    after_s: 60.0
                }
            ]
        );
        for bad in [
            "",
            "K 20",
            "K within x %",
            "K within 0 %",
            "X within 5 %",
            "angle within 2 rad after 5 s",
            "R within 101 %",
        ] {
            assert!(
                wishes(bad).unwrap_err().to_string().contains("--want"),
                "{bad}"
            );
        }
    }
}
