//! Lines of which one motion makes several: a comb of harmonics, side bands, a band or a chirp.

use std::f64::consts::{PI, TAU};

use model::effect::Peak;

use super::{MOST_ALIKE, MOST_TERMS, Search};
use crate::fit::channel::{BAND_REACH, Form, Note, State, Term, whitened};
use crate::fit::{about_line, scan, threshold};

/// Part of its frequency by which a crowd of lines reaches beyond the outermost ones.
const AROUND: f64 = 0.02;
/// Coefficients to either side of a steady line in which what is there is the line's.
const OF_A_LINE: f64 = 3.0;
/// Part of what a steady line explains that may be left about it, as where its name is weighed.
const LEFT_ABOUT: f64 = 0.05;

/// Largest harmonic of one other line that is sought; a higher one would fit too many frequencies.
const HIGHEST_HARMONIC: u32 = 7;

/// A line of the search: its frequency in Hz, and its likelihood ratio.
type Line = (f64, f64);

/// Standard error of the frequency of a line, Hz; `per_record` is 1 / T.
///
/// # Source
/// Rife, Boorstyn (1974), Single-tone parameter estimation from discrete-time observations, IEEE Trans. Inf. Theory 20: 591-598:
/// of a line of likelihood ratio LR, sqrt(3 / LR) / (pi T).
fn error(line: &Line, per_record: f64) -> f64 {
    per_record / PI * (3.0 / line.1.max(3.0)).sqrt()
}

/// Of two lines, the frequency of the lower one and the multiple of it at which the other lies within three standard errors.
/// Two lines with nothing to do with each other meet that by chance only.
fn harmonics(lines: &[Line], per_record: f64) -> Option<(f64, Vec<u32>)> {
    let [a, b] = lines else {
        return None;
    };
    let (low, high) = if a.0 < b.0 { (a, b) } else { (b, a) };
    (2..=HIGHEST_HARMONIC).find_map(|k| {
        let off = (high.0 - f64::from(k) * low.0).abs();
        let limit = 3.0 * (f64::from(k) * error(low, per_record)).hypot(error(high, per_record));
        (off < limit).then_some((low.0, vec![1, k]))
    })
}

/// Highest multiple in a comb of lines, and the largest part of a fundamental that a line may lie beside its multiple:
/// any lines fit a comb that is fine enough.
const HIGHEST_TOOTH: u32 = 64;
const LARGEST_MISS: f64 = 0.1;

/// The fundamental, Hz, of which three or more lines are multiples, within three standard errors, and which ones; the highest
/// that fits.
fn comb(lines: &[Line], per_record: f64) -> Option<(f64, Vec<u32>)> {
    let error = |l: &Line| error(l, per_record);
    let mut sorted = lines.to_vec();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let lowest = sorted.first()?;
    let apart = sorted.windows(2).map(|w| w[1].0 - w[0].0);
    let mut starts: Vec<f64> = (1..=4)
        .map(|k| lowest.0 / f64::from(k))
        .chain(apart)
        .collect();
    starts.sort_by(|a, b| b.total_cmp(a));
    starts.into_iter().find_map(|start| {
        let mut f = start;
        // From the lowest tooth up, each line narrows the fundamental.
        for _ in 0..2 {
            let (mut top, mut bottom) = (0.0, 0.0);
            for l in &sorted {
                let k = (l.0 / f).round().max(1.0);
                let weight = (k / error(l)).powi(2);
                top += weight * l.0 / k;
                bottom += weight;
                f = top / bottom;
            }
        }
        let teeth: Vec<u32> = sorted.iter().map(|l| (l.0 / f).round() as u32).collect();
        let fits = |(l, k): (&Line, &u32)| {
            let miss = (l.0 - f64::from(*k) * f).abs();
            (1..=HIGHEST_TOOTH).contains(k) && miss < (3.0 * error(l)).min(LARGEST_MISS * f)
        };
        let apart = teeth.windows(2).all(|w| w[1] > w[0]);
        (apart && sorted.iter().zip(&teeth).all(fits)).then_some((f, teeth))
    })
}

/// Largest multiple of a line in a relation of three: side bands of a tone whose pitch or size swings, tones of a mixer.
const LARGEST_ORDER: i32 = 3;

/// Whether three of the lines stand in a relation of small whole numbers, or two lie at a multiple: one motion makes them. Of lines with
/// nothing to do with each other that happens by chance only.
fn are_related(lines: &[Line], per_record: f64) -> bool {
    let within = |terms: &[(i32, &Line)]| {
        let sum: f64 = terms.iter().map(|(k, l)| f64::from(*k) * l.0).sum();
        let errors = terms
            .iter()
            .map(|(k, l)| f64::from(*k) * error(l, per_record));
        sum.abs() < 3.0 * errors.map(|e| e * e).sum::<f64>().sqrt()
    };
    let orders = || (-LARGEST_ORDER..=LARGEST_ORDER).filter(|k| *k != 0);
    let three = |a: &Line, b: &Line, c: &Line| {
        (1..=LARGEST_ORDER)
            .any(|k| orders().any(|l| orders().any(|m| within(&[(k, a), (l, b), (m, c)]))))
    };
    lines.iter().enumerate().any(|(i, a)| {
        let beyond = &lines[i + 1..];
        beyond.iter().enumerate().any(|(j, b)| {
            harmonics(&[*a, *b], per_record).is_some()
                || beyond[j + 1..].iter().any(|c| three(a, b, c))
        })
    })
}

impl Search<'_> {
    /// The lines of a state.
    fn lines_of(&self, state: &State) -> Vec<Line> {
        let hz = |w: f64| w * self.view.rate_hz / TAU;
        let of = |t: &Term| match t.form {
            Form::Line(w) | Form::SideBands(w, _) => Some((hz(w), t.lr)),
            _ => None,
        };
        state.terms.iter().filter_map(of).collect()
    }

    /// One over the length of the record, Hz.
    fn per_record(&self) -> f64 {
        self.view.rate_hz / self.panel.bins.n as f64
    }

    /// The state with all terms that pass; beside a comb of lines it has room for as many as without.
    pub(super) fn grown_with_teeth(&self, mut state: State) -> State {
        let mut most = MOST_TERMS;
        loop {
            state = self.grown(state, most);
            let whole = self.with_all_teeth(&state);
            let beside = self.most_terms(whole.as_ref().unwrap_or(&state));
            if whole.is_none() && (beside <= most || state.terms.len() < most) {
                return state;
            }
            state = whole.unwrap_or(state);
            most = most.max(beside);
        }
    }

    /// How many terms there may be beside the state's lines: the teeth of a comb are one motion, and steady lines that have nothing
    /// to do with each other take no room from other causes.
    fn most_terms(&self, state: &State) -> usize {
        let lines = self.lines_of(state);
        let known =
            || comb(&lines, self.per_record()).is_some() || self.are_separate(state, &lines);
        let many = lines.len() > MOST_ALIKE && known();
        MOST_TERMS + if many { lines.len() } else { 0 }
    }

    /// Whether each of the lines is steady, and none has to do with another: as many causes.
    fn are_separate(&self, state: &State, lines: &[Line]) -> bool {
        // A few periods are a piece of any slow course.
        let slowest = lines.iter().map(|l| l.0).fold(f64::INFINITY, f64::min);
        2.0 * slowest >= about_line::BESIDE * self.per_record()
            && !are_related(lines, self.per_record())
            && !lines.iter().any(|line| self.is_in_a_band(state, line))
            && self.are_steady(state)
    }

    /// Whether a line lies within a band of the state: several such are pieces of what has that spectrum.
    fn is_in_a_band(&self, state: &State, line: &Line) -> bool {
        let omega = line.0 * TAU / self.view.rate_hz;
        let mut bands = state.terms.iter().filter_map(Term::peak);
        bands.any(|p| (omega - p.omega).abs() < BAND_REACH * p.half_width)
    }

    /// The state with every tooth of the comb that its lines are of which the record shows; none where it has them all.
    fn with_all_teeth(&self, state: &State) -> Option<State> {
        let lines = self.lines_of(state);
        if lines.len() <= MOST_ALIKE {
            return None;
        }
        let (fundamental, known) = comb(&lines, self.per_record())?;
        let like = (state.terms.iter()).find(|t| matches!(t.form, Form::Line(_)))?;
        let n = self.panel.bins.n;
        let first = fundamental * TAU / self.view.rate_hz;
        // A weak tooth may be in the model as a band.
        let of_comb = |t: &Term| t.peak().is_some_and(|p| is_tooth(&p, first));
        let bare = self.refit(
            (state.terms.iter().filter(|t| !of_comb(t)).cloned()).collect(),
            state.noise.log_walk,
        );
        let g = bare.noise.over(&self.panel.bins);
        let own = bare.columns();
        let tooth = |k: u32| {
            let omega = f64::from(k) * first;
            let inside = omega < PI - OF_A_LINE * PI / n as f64;
            if known.contains(&k) || !inside {
                return None;
            }
            let width = self.panel.width();
            let columns = self.panel.add_all(scan::sinusoid(n, omega));
            let with = self
                .panel
                .solve(&g, &[own.clone(), columns.clone()].concat());
            let lr = 2.0 * (with.log_likelihood - bare.solution.log_likelihood);
            let threshold = threshold::regression(columns.len(), HIGHEST_TOOTH as usize);
            if lr < threshold {
                self.panel.truncate(width);
                return None;
            }
            Some(Term {
                form: Form::Line(omega),
                columns,
                lr,
                threshold,
                alternatives: vec![],
                claims: vec![],
                ..like.clone()
            })
        };
        let more: Vec<Term> = (1..=HIGHEST_TOOTH).filter_map(tooth).collect();
        if more.is_empty() {
            return None;
        }
        let terms = [bare.terms, more].concat();
        let whole = self.refit(terms, state.noise.log_walk);
        let terms = self.each_in_its_place(&whole);
        Some(self.refit(terms, state.noise.log_walk))
    }

    /// The terms of a state, each line at its best frequency beside the others: the first ones were placed while the last ones were
    /// noise.
    fn each_in_its_place(&self, state: &State) -> Vec<Term> {
        let mut beside = state.clone();
        for i in 0..beside.terms.len() {
            if matches!(beside.terms[i].form, Form::Line(_)) {
                let term = beside.terms.remove(i);
                beside = self.refit(beside.terms, state.noise.log_walk);
                let term = self.refine(&beside, term);
                beside.terms.insert(i, term);
            }
        }
        beside.terms
    }

    /// What the lines of a state are, where they are no separate causes.
    pub(super) fn crowd_of_lines(&self, state: &State) -> Option<Note> {
        let lines = self.lines_of(state);
        let many = lines.len() > MOST_ALIKE;
        let repeats = if many {
            comb(&lines, self.per_record())
        } else {
            harmonics(&lines, self.per_record())
        };
        if repeats.is_none() && (!many || self.are_separate(state, &lines)) {
            return None;
        }
        let steady = repeats.is_some() || self.are_steady(state);
        let ends = (lines.iter()).fold((f64::INFINITY, 0.0f64), |(l, h), (f, _)| {
            (l.min(*f), h.max(*f))
        });
        let what = match repeats {
            Some((fundamental, teeth)) => format!(
                "{}: a motion that repeats, and is no sine",
                multiples(fundamental, &teeth)
            ),
            None if steady => format!(
                "{} steady lines from {:.3} to {:.3} Hz, of one motion: some are sums or multiples of others",
                lines.len(),
                ends.0,
                ends.1
            ),
            None => format!(
                "{} lines from {:.3} to {:.3} Hz: no steady line but a band or a chirp",
                lines.len(),
                ends.0,
                ends.1
            ),
        };
        let to_omega = TAU / self.view.rate_hz;
        let at = if steady {
            let half = 0.5 * OF_A_LINE * self.per_record();
            let about = |l: &Line| ((l.0 - half) * to_omega, (l.0 + half) * to_omega);
            lines.iter().map(about).collect()
        } else {
            vec![(
                ends.0 * (1.0 - AROUND) * to_omega,
                ends.1 * (1.0 + AROUND) * to_omega,
            )]
        };
        Some(Note {
            what,
            at,
            held: steady,
        })
    }

    /// Whether nothing is left about each line of a state, and none is beside another: of these several are one tone that wanders.
    fn are_steady(&self, state: &State) -> bool {
        let n = self.panel.bins.n as f64;
        let mut places: Vec<f64> = state.lines().iter().map(|l| l.0 * n / PI).collect();
        places.sort_by(f64::total_cmp);
        if places.windows(2).any(|w| w[1] - w[0] < about_line::BESIDE) {
            return false;
        }
        let (u, _) = whitened(&self.panel, state);
        state.terms.iter().all(|t| match t.form {
            Form::Line(w) | Form::SideBands(w, _) => {
                2.0 * about_line::stands_out(&u, w * n / PI) < LEFT_ABOUT * t.lr
            }
            _ => true,
        })
    }
}

/// Whether a band is narrow, and about a multiple of that angular frequency.
fn is_tooth(band: &Peak, first: f64) -> bool {
    let off = (band.omega / first).round().max(1.0) * first - band.omega;
    band.half_width < LARGEST_MISS * first && off.abs() < band.half_width
}

/// Lines at these multiples of a frequency in Hz, in words.
fn multiples(fundamental: f64, teeth: &[u32]) -> String {
    let told: Vec<String> = teeth.iter().map(u32::to_string).collect();
    match told.as_slice() {
        [one, last] if one == "1" => {
            format!("lines at {fundamental:.4} Hz and {last} times that")
        }
        [first @ .., last] => format!(
            "lines at {} and {last} times {fundamental:.4} Hz",
            first.join(", ")
        ),
        [] => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn multiples_are_told_as_they_are_read() {
        assert_eq!(
            multiples(12.3, &[1, 2]),
            "lines at 12.3000 Hz and 2 times that"
        );
        assert_eq!(
            multiples(0.5, &[1, 3, 4]),
            "lines at 1, 3 and 4 times 0.5000 Hz"
        );
    }

    #[test]
    fn a_comb_is_known_by_its_fundamental_though_teeth_are_missing() {
        let per_record = 1.0 / 600.0;
        let lines: Vec<(f64, f64)> = [3.0, 1.0, 2.0, 5.0]
            .iter()
            .map(|k| (k * 0.7312 + 2e-5 * (k - 2.0), 60.0))
            .collect();
        let (fundamental, teeth) = comb(&lines, per_record).unwrap();
        assert!((fundamental - 0.7312).abs() < 1e-4, "{fundamental}");
        assert_eq!(teeth, vec![1, 2, 3, 5]);
        // Without the fundamental: their distance tells it.
        let odd = [(1.4624, 60.0), (2.1936, 60.0), (5.1184, 60.0)];
        assert_eq!(comb(&odd, per_record).unwrap().1, vec![2, 3, 7]);
    }

    #[test]
    fn side_bands_are_related_and_tones_of_several_machines_are_not() {
        let of = |hz: &[f64]| -> Vec<Line> { hz.iter().map(|f| (*f, 200.0)).collect() };
        let per_record = 1.0 / 600.0;
        assert!(are_related(&of(&[7.31, 7.66, 8.01]), per_record));
        // The carrier, and the second side band of one side, are below the noise.
        assert!(are_related(&of(&[7.31, 8.01, 8.71, 5.0]), per_record));
        assert!(are_related(&of(&[2.137, 4.274, 8.9]), per_record));
        assert!(!are_related(
            &of(&[2.137, 5.0291, 8.914, 9.3377]),
            per_record
        ));
    }

    #[test]
    fn lines_of_a_chirp_are_no_comb() {
        let lines = [(1.013, 40.0), (1.371, 50.0), (1.9107, 45.0), (2.833, 60.0)];
        assert_eq!(comb(&lines, 1.0 / 600.0), None);
    }
}
