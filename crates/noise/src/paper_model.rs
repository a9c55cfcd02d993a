//! The stand as the paper's figures describe it, and what those figures say about each other.
//!
//! The paper states a line of slope −1/2 up to 10 s (5.27 deg/sqrt(h)) and a flat level of 150 deg/h from 10 to 100 s,
//! for a model of white noise and a random walk (its equation 1). Nothing here is simulated: it is what the stated
//! figures imply for the expected Allan curve.
//!
//! Source: Istomin, Belyaev (2009), sections 2 to 4.

use crate::allan::{Phase, TauGrid};
use crate::fit::{Coefficients, Term, model_allan_variance};
use numerics::minimise::golden;

/// Cluster times of the line, s.
pub(crate) const LINE_S: (f64, f64) = (0.1, 10.0);
/// Cluster times of the flat level, s.
pub(crate) const FLAT_S: (f64, f64) = (10.0, 100.0);
/// Points for each decade in both fits.
pub(crate) const PER_DECADE: u32 = 20;
/// Stated angle random walk, deg/sqrt(h).
pub const STATED_ARW_DEG_SQRT_H: f64 = 5.27;
/// Stated level of the flat part, deg/h.
pub const STATED_FLAT_DEG_H: f64 = 150.0;
/// Stated sample rate, Hz.
pub const STATED_RATE_HZ: f64 = 20.0;
/// Stated length, s.
pub const STATED_SECONDS: f64 = 600.0;

/// What else than white noise holds the curve up between 10 and 100 s.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Slow {
    /// Nothing.
    Nothing,
    /// A random walk of the bias: the paper's equation 1.
    RandomWalk,
    /// Flicker: the only noise whose Allan curve is flat.
    Flicker,
}

impl Slow {
    /// All, the simplest first.
    pub const ALL: [Self; 3] = [Self::Nothing, Self::RandomWalk, Self::Flicker];

    fn term(self) -> Option<Term> {
        match self {
            Self::Nothing => None,
            Self::RandomWalk => Some(Term::RandomWalk),
            Self::Flicker => Some(Term::Flicker),
        }
    }
}

/// White noise and one slow term, in deg/s and s, with what the paper's procedure expects to read from them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PaperStand {
    /// The slow term.
    pub slow: Slow,
    /// N, deg/s·√s.
    pub angle_random_walk_n: f64,
    /// K (random walk, deg/s/√s) or B (flicker, deg/s); 0 for none.
    pub size: f64,
    /// Sample interval, s.
    pub tau0: f64,
}

/// What the expected curve of a stand reads under the paper's procedure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// σ(τ)·√τ of the line, deg/s·√s.
    pub angle_random_walk: f64,
    /// Slope of a free line over the same cluster times.
    pub line_slope: f64,
    /// Level of the flat part, deg/s.
    pub level: f64,
    /// Slope of a free line over the flat part.
    pub level_slope: f64,
}

impl PaperStand {
    /// White noise of `n` alone.
    #[must_use]
    pub fn white(n: f64, tau0: f64) -> Self {
        Self {
            slow: Slow::Nothing,
            angle_random_walk_n: n,
            size: 0.0,
            tau0,
        }
    }

    /// White noise of `n` and a slow term sized so that the expected level of the flat part is `level`; `None` where
    /// white noise alone lies above it already.
    #[must_use]
    pub fn with_level(slow: Slow, n: f64, level: f64, tau0: f64) -> Option<Self> {
        let of = |size: f64| Self {
            slow,
            angle_random_walk_n: n,
            size,
            tau0,
        };
        if of(0.0).reading().level >= level || slow == Slow::Nothing {
            return None;
        }
        let (mut low, mut high) = (0.0, level);
        while of(high).reading().level < level {
            high *= 2.0;
        }
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if of(middle).reading().level < level {
                low = middle;
            } else {
                high = middle;
            }
        }
        Some(of(0.5 * (low + high)))
    }

    /// White noise and a slow term, both sized so that the procedure is expected to read `arw` on its line and `level`
    /// on its flat part.
    #[must_use]
    pub fn with_both(slow: Slow, arw: f64, level: f64, tau0: f64) -> Option<Self> {
        let at = |n: f64| Self::with_level(slow, n, level, tau0);
        let miss = |n: f64| {
            at(n).map_or(f64::INFINITY, |s| {
                (s.reading().angle_random_walk / arw).ln().powi(2)
            })
        };
        let n = golden(&miss, 0.01 * arw, arw, 60);
        at(n).filter(|_| miss(n) < 1e-8)
    }

    /// Variances of the terms.
    #[must_use]
    pub fn coefficients(&self) -> Coefficients {
        let mut c = [0.0; 4];
        c[Term::White as usize] = Term::White.coefficient(self.angle_random_walk_n, self.tau0);
        if let Some(term) = self.slow.term() {
            c[term as usize] = term.coefficient(self.size, self.tau0);
        }
        c
    }

    /// Expected Allan deviation at `m` samples, deg/s.
    #[must_use]
    pub fn deviation(&self, m: usize) -> f64 {
        model_allan_variance(&self.coefficients(), 0.0, self.tau0, m).sqrt()
    }

    /// What the paper's procedure reads from the expected curve.
    #[must_use]
    pub fn reading(&self) -> Reading {
        let ms = TauGrid::Log(PER_DECADE).factors((1.01 * FLAT_S.1 / self.tau0) as usize);
        let curve: Vec<(f64, f64)> = ms
            .into_iter()
            .map(|m| (m as f64 * self.tau0, self.deviation(m)))
            .collect();
        Reading::of(&curve).unwrap_or(Reading {
            angle_random_walk: f64::NAN,
            line_slope: f64::NAN,
            level: f64::NAN,
            level_slope: f64::NAN,
        })
    }
}

impl Reading {
    /// Of a curve of (τ in s, σ); `None` where it does not hold both ranges of cluster times.
    #[must_use]
    pub fn of(curve: &[(f64, f64)]) -> Option<Self> {
        let logs = |(low, high): (f64, f64)| -> Vec<(f64, f64)> {
            curve
                .iter()
                .filter(|(tau, sigma)| (low * 0.999..=high * 1.001).contains(tau) && *sigma > 0.0)
                .map(|(tau, sigma)| (tau.ln(), sigma.ln()))
                .collect()
        };
        let mean = |points: &[(f64, f64)], slope: f64| {
            (points.iter().map(|(x, y)| y - slope * x).sum::<f64>() / points.len() as f64).exp()
        };
        let (line, flat) = (logs(LINE_S), logs(FLAT_S));
        (line.len() >= 3 && flat.len() >= 3).then(|| Self {
            angle_random_walk: mean(&line, -0.5),
            line_slope: slope(&line),
            level: mean(&flat, 0.0),
            level_slope: slope(&flat),
        })
    }

    /// Of a record: overlapping Allan deviation, as many points for each decade as [`crate::paper::paper_figures`] takes.
    #[must_use]
    pub fn of_record(phase: &Phase, tau0: f64) -> Option<Self> {
        let longest = (phase.longest_run() / 2).min((1.01 * FLAT_S.1 / tau0) as usize);
        let curve: Vec<(f64, f64)> = phase
            .overlapping_allan(tau0, &TauGrid::Log(PER_DECADE).factors(longest))
            .into_iter()
            .map(|e| (e.tau_s, e.deviation))
            .collect();
        Self::of(&curve)
    }
}

/// Slope of the least-squares line through points.
#[must_use]
pub fn slope(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let (x, y) = (
        points.iter().map(|p| p.0).sum::<f64>() / n,
        points.iter().map(|p| p.1).sum::<f64>() / n,
    );
    let xy: f64 = points.iter().map(|p| (p.0 - x) * (p.1 - y)).sum();
    let xx: f64 = points.iter().map(|p| (p.0 - x).powi(2)).sum();
    xy / xx
}

#[cfg(test)]
mod tests {
    use super::*;

    const N: f64 = STATED_ARW_DEG_SQRT_H / 60.0;
    const LEVEL: f64 = STATED_FLAT_DEG_H / 3600.0;

    #[test]
    fn a_line_of_5_27_reaches_100_deg_per_h_at_10_s_and_32_at_100_s() {
        let stand = PaperStand::white(N, 0.05);
        assert!((stand.deviation(200) * 3600.0 - 100.0).abs() < 0.1);
        assert!((stand.deviation(2000) * 3600.0 - 31.6).abs() < 0.1);
        let reading = stand.reading();
        assert!((reading.angle_random_walk / N - 1.0).abs() < 1e-12);
        assert!((reading.line_slope + 0.5).abs() < 1e-12);
        // Mean of −½·ln τ over 10..100 s: the geometric middle, 31.6 s.
        assert!((reading.level * 3600.0 - 56.2).abs() < 0.5, "{reading:?}");
    }

    #[test]
    fn no_slow_term_gives_both_of_the_papers_figures_with_their_slopes() {
        for slow in [Slow::RandomWalk, Slow::Flicker] {
            let stand = PaperStand::with_level(slow, N, LEVEL, 0.05).unwrap();
            let reading = stand.reading();
            assert!((reading.level / LEVEL - 1.0).abs() < 1e-9);
            // The line then reads more than 5.27.
            assert!(reading.angle_random_walk > 1.01 * N, "{reading:?}");
            let both = PaperStand::with_both(slow, N, LEVEL, 0.05).unwrap();
            let reading = both.reading();
            assert!((reading.angle_random_walk / N - 1.0).abs() < 1e-3);
            // Either the line bends, or the flat part climbs; flicker bends, the random walk climbs.
            match slow {
                Slow::Flicker => assert!(reading.line_slope > -0.46, "{reading:?}"),
                _ => assert!(reading.level_slope > 0.2, "{reading:?}"),
            }
        }
        assert_eq!(
            PaperStand::with_level(Slow::RandomWalk, N, 0.4 * LEVEL / 1.2, 0.05),
            None
        );
    }
}
