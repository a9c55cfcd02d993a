//! The frequencies that the terms describe: where a filter, a line or a band bends the spectrum at its upper end, the slow
//! part is fitted without it.

use rand_core::Rng;

use super::{Misfit, NoiseFit, Spectrum, Term, fit, misfit};
use crate::allan::TauGrid;

/// Replicates behind the check of a fit.
const REPLICATES: usize = 300;
/// Chance below which a fit is said not to describe the curve.
const MISFIT_P: f64 = 0.005;
/// Chance from which on a band counts as described. Once the whole is known not to be, a band refused by chance costs a
/// little precision, and one accepted wrongly biases N.
const DESCRIBED_P: f64 = 0.2;
/// Narrowest band: the frequencies below so many times less than half the sample rate.
const NARROWEST: usize = 128;
/// Coefficients that a band has to hold.
const NEEDED: f64 = 300.0;

/// A fit, with the cluster times that it describes.
#[derive(Clone, Debug)]
pub struct Described {
    /// The fit: to the whole spectrum, or to its lower part.
    pub fit: NoiseFit,
    /// What it was fitted to.
    pub spectrum: Spectrum,
    /// The averaging factor from which on it holds: 1 where it was fitted to the whole spectrum.
    pub from_m: usize,
    /// The fit to the whole spectrum and what is wrong with it, where that does not describe the curve.
    pub refused: Option<(NoiseFit, Misfit)>,
}

impl Described {
    /// The averaging factor from which on the fit describes the curve; `None` where it does not.
    #[must_use]
    pub fn hold_from_m(&self) -> Option<usize> {
        (self.refused.is_none() || self.from_m > 1).then_some(self.from_m)
    }
}

/// Part of the upper end of an interval that is nothing.
const NOTHING: f64 = 1e-3;

/// White noise is in every model; in the lower part of a spectrum it may be there by that alone. Where the other terms can
/// stand for all of it, it is not established.
fn without_unknown_white(mut fit: NoiseFit) -> NoiseFit {
    let white = &mut fit.terms[Term::White as usize];
    if white.low < NOTHING * white.high {
        (white.value, white.std_error, white.low) = (None, None, 0.0);
    }
    fit
}

/// Fits the terms, and where they do not describe the Allan curve up to `longest` samples, fits them to the lower half, quarter,
/// ... of the frequencies until they do, and then to half of that: what just escapes the check at the upper end of a band
/// still pulls N by more than its interval. Dropping high frequencies takes nothing from what is known of
/// slow noise, so a misfit of slow noise stays one; where no band helps, the fit is that of the whole spectrum.
#[must_use]
pub fn fit_described(spectrum: &Spectrum, longest: usize, rng: &mut impl Rng) -> Described {
    let whole = fit(spectrum);
    let factors = TauGrid::Octave.factors(longest);
    let of_whole = |fit: NoiseFit, refused| Described {
        fit,
        spectrum: spectrum.clone(),
        from_m: 1,
        refused,
    };
    let wrong = match misfit(spectrum, &whole, &factors, REPLICATES, rng) {
        Some(found) if found.p_value < MISFIT_P => found,
        _ => return of_whole(whole, None),
    };
    let mut bands = Vec::new();
    let mut part = 2;
    while part <= NARROWEST {
        let narrow = spectrum.below(std::f64::consts::PI / part as f64);
        if narrow.coefficients() < NEEDED {
            break;
        }
        let fit = without_unknown_white(fit(&narrow));
        // Of what is left of the spectrum, the short cluster times look at the upper end.
        let p = misfit(&narrow, &fit, &factors, REPLICATES, rng).map_or(0.0, |m| m.p_value);
        let before = bands.last().map_or(0.0, |(p, _)| *p);
        bands.push((
            p,
            Described {
                fit,
                spectrum: narrow,
                from_m: 2 * part,
                refused: Some((whole.clone(), wrong)),
            },
        ));
        if before >= DESCRIBED_P {
            break;
        }
        part *= 2;
    }
    // The half of the first band that is described well; without one, the band that is described best.
    if let [.., (well, _), (p, half)] = &bands[..]
        && *well >= DESCRIBED_P
        && *p >= MISFIT_P
    {
        return half.clone();
    }
    if let Some((p, best)) = bands.into_iter().max_by(|a, b| a.0.total_cmp(&b.0))
        && p >= MISFIT_P
    {
        return best;
    }
    of_whole(whole.clone(), Some((whole, wrong)))
}

#[cfg(test)]
mod tests {
    use rand_xoshiro::Xoshiro256PlusPlus;
    use rand_xoshiro::rand_core::SeedableRng;

    use super::*;
    use crate::synthetic::Truth;

    #[test]
    fn white_noise_that_other_terms_can_stand_for_has_no_value_but_a_limit() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
        let white = |truth: Truth, rng: &mut Xoshiro256PlusPlus| {
            let y = truth.record(4096, 1.0, rng);
            let spectrum = Spectrum::of(&y, std::slice::from_ref(&(0..y.len())), 1.0);
            without_unknown_white(fit(&spectrum)).term(Term::White)
        };
        let flicker = Truth {
            b: 1.0,
            ..Truth::default()
        };
        let alone = white(flicker, &mut rng);
        assert!(alone.value.is_none() && alone.high > 0.0, "{alone:?}");
        let both = Truth { n: 3.0, ..flicker };
        let there = white(both, &mut rng);
        assert!(there.low < 3.0 && there.value.is_some(), "{there:?}");
    }
}
