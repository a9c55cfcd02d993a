//! What `imu-stand plan --want` understands.

use analysis::plan::{KnownNoise, Letter, calibration_for};
use miette::Result;
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
    within_deg: f64,
    after_s: f64,
    /// Still calibration that is long enough; absent where none is.
    calibration_s: Option<f64>,
    /// The one that serves best, and half of the 95 % interval of the angle with it, deg.
    best_calibration_s: f64,
    best_within_deg: f64,
}

impl WantedAngle {
    /// By the noise, in deg/s and s.
    pub fn plan(noise: &KnownNoise, rate_hz: f64, within_deg: f64, after_s: f64) -> Self {
        let plan = calibration_for(noise, rate_hz, after_s, within_deg / Z_95);
        Self {
            within_deg,
            after_s,
            calibration_s: plan.calibration_s,
            best_calibration_s: plan.best_calibration_s,
            best_within_deg: Z_95 * plan.best_sigma,
        }
    }

    /// For a person.
    pub fn sentence(&self) -> String {
        let wish = format!(
            "angle within {} deg (95 %) {} s after the calibration",
            self.within_deg, self.after_s
        );
        let best = format!(
            "the best, {:.0} s, gives {:.3} deg",
            self.best_calibration_s, self.best_within_deg
        );
        match self.calibration_s {
            Some(seconds) => format!("{wish}  stand still for {seconds:.1} s first; {best}"),
            None => format!(
                "{wish}  no calibration does it: {best}; a shorter time or less noise would"
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
