//! Small searches for a lowest point.

/// Golden-section search for the lowest point of `f` in [low, high], `steps` steps.
pub fn golden(f: &dyn Fn(f64) -> f64, mut low: f64, mut high: f64, steps: usize) -> f64 {
    let ratio = (5f64.sqrt() - 1.0) / 2.0;
    let (mut a, mut b) = (high - ratio * (high - low), low + ratio * (high - low));
    let (mut fa, mut fb) = (f(a), f(b));
    for _ in 0..steps {
        if fa < fb {
            (high, b, fb) = (b, a, fa);
            a = high - ratio * (high - low);
            fa = f(a);
        } else {
            (low, a, fa) = (a, b, fb);
            b = low + ratio * (high - low);
            fb = f(b);
        }
    }
    if fa < fb { a } else { b }
}

/// Highest value of points (x ascending, y), with a parabola through the best one and its neighbours.
pub fn peak(points: &[(f64, f64)]) -> f64 {
    let Some((i, best)) = points
        .iter()
        .enumerate()
        .max_by(|a, b| a.1.1.total_cmp(&b.1.1))
    else {
        return f64::NEG_INFINITY;
    };
    if i == 0 || i + 1 == points.len() {
        return best.1;
    }
    let (l, r) = (points[i - 1], points[i + 1]);
    let (d1, d2) = (best.0 - l.0, r.0 - best.0);
    let (s1, s2) = ((best.1 - l.1) / d1, (r.1 - best.1) / d2);
    let curvature = (s2 - s1) / (d1 + d2);
    if curvature >= 0.0 {
        return best.1;
    }
    let slope = (s1 * d2 + s2 * d1) / (d1 + d2);
    best.1 + (-slope * slope / (4.0 * curvature)).min(0.5 * (best.1 - l.1).max(best.1 - r.1))
}

/// The size at which a strength, growing with size, reaches `wanted`: halving until it is enclosed, then, as a strength is
/// nearly a straight line on logarithmic scales, by the secant of the enclosing pair (Illinois). Far from what is wanted,
/// where a strength may vanish or overflow, nothing is asked.
#[must_use]
pub fn size_for(wanted: f64, strength: &dyn Fn(f64) -> f64) -> f64 {
    const ENOUGH: f64 = 1e-9;
    let (mut low, mut high) = (-18.0f64, 8.0f64);
    // How far off, as a logarithm, the ends are that were asked.
    let (mut below, mut above): (Option<f64>, Option<f64>) = (None, None);
    let mut last = 0i8;
    for step in 0..60 {
        // Where the line is bent the secant creeps: every fourth step halves.
        let x = match (below, above) {
            (Some(b), Some(a)) if step % 4 != 3 => (low * a - high * b) / (a - b),
            _ => 0.5 * (low + high),
        };
        let d = strength(x.exp());
        let off = if d.is_nan() {
            50.0
        } else {
            (d / wanted).ln().clamp(-50.0, 50.0)
        };
        if off.abs() < ENOUGH || high - low < ENOUGH {
            return x.exp();
        }
        if d < wanted {
            (low, below) = (x, Some(off));
            if last == -1 {
                above = above.map(|a| 0.5 * a);
            }
            last = -1;
        } else {
            (high, above) = (x, Some(off));
            if last == 1 {
                below = below.map(|b| 0.5 * b);
            }
            last = 1;
        }
    }
    (0.5 * (low + high)).exp()
}

/// A Nelder-Mead search that says where it has to know its function next, so that several can go on side by side.
struct Simplex {
    corners: Vec<(f64, Vec<f64>)>,
    /// Evaluations so far, and at most.
    used: usize,
    evaluations: usize,
    /// Mean of all corners but the worst.
    centre: Vec<f64>,
    stage: Stage,
}

/// What a simplex waits for.
enum Stage {
    /// The corners from this one on.
    Corners(usize),
    /// The worst corner, reflected.
    Reflected,
    /// The worst corner moved this many times as far, beside the reflected one's value.
    Moved(f64, f64),
    Ended,
}

/// How far the worst corner may be moved: reflected, farther, outside and inside; times its way to the centre.
const WAYS: [f64; 4] = [1.0, 2.0, 0.5, -0.5];

impl Simplex {
    fn new(start: &[f64], steps: &[f64], evaluations: usize) -> Self {
        let mut corners = vec![(0.0, start.to_vec()); start.len() + 1];
        for (i, by) in steps.iter().enumerate() {
            corners[i + 1].1[i] += by;
        }
        Self {
            corners,
            used: 0,
            evaluations,
            centre: vec![],
            stage: Stage::Corners(0),
        }
    }

    /// The worst corner moved through the centre.
    fn along(&self, t: f64) -> Vec<f64> {
        let worst = &self.corners[self.corners.len() - 1].1;
        let parts = self.centre.iter().zip(worst);
        parts.map(|(c, w)| c + t * (c - w)).collect()
    }

    /// Where the function has to be known next; `ahead`, with all that the same step may ask for.
    fn wanted(&self, ahead: bool) -> Vec<Vec<f64>> {
        match self.stage {
            Stage::Corners(from) => self.corners[from..].iter().map(|c| c.1.clone()).collect(),
            Stage::Reflected if ahead => WAYS.iter().map(|t| self.along(*t)).collect(),
            Stage::Reflected => vec![self.along(1.0)],
            Stage::Moved(t, _) => vec![self.along(t)],
            Stage::Ended => vec![],
        }
    }

    /// The values there.
    fn told(&mut self, values: &[f64]) {
        let n = self.corners.len() - 1;
        match self.stage {
            Stage::Corners(from) => {
                let corners = self.corners[from..].iter_mut().zip(values);
                corners.for_each(|(c, v)| c.0 = *v);
                self.used += values.len();
                self.turn();
            }
            Stage::Reflected => {
                self.used += 1;
                let fr = values[0];
                let way = if fr < self.corners[0].0 {
                    1
                } else if fr < self.corners[n - 1].0 {
                    self.corners[n] = (fr, self.along(1.0));
                    return self.turn();
                } else if fr < self.corners[n].0 {
                    2
                } else {
                    3
                };
                self.stage = Stage::Moved(WAYS[way], fr);
                if let Some(value) = values.get(way) {
                    self.told(&[*value]);
                }
            }
            Stage::Moved(t, fr) => {
                self.used += 1;
                let moved = (values[0], self.along(t));
                if t > 1.0 {
                    let reflected = (fr, self.along(1.0));
                    self.corners[n] = if moved.0 < fr { moved } else { reflected };
                } else if moved.0 < self.corners[n].0.min(fr) {
                    self.corners[n] = moved;
                } else {
                    let (best, others) = self.corners.split_at_mut(1);
                    for (x, b) in others
                        .iter_mut()
                        .flat_map(|s| s.1.iter_mut().zip(&best[0].1))
                    {
                        *x = b + 0.5 * (*x - b);
                    }
                    self.stage = Stage::Corners(1);
                    return;
                }
                self.turn();
            }
            Stage::Ended => {}
        }
    }

    /// Begin a further step, unless it was the last one.
    fn turn(&mut self) {
        self.corners.sort_by(|a, b| a.0.total_cmp(&b.0));
        let n = self.corners.len() - 1;
        let flat = (self.corners[n].0 - self.corners[0].0).abs() < 1e-4;
        if flat || self.used >= self.evaluations {
            self.stage = Stage::Ended;
            return;
        }
        let mean = |j: usize| self.corners[..n].iter().map(|s| s.1[j]).sum::<f64>() / n as f64;
        self.centre = (0..n).map(mean).collect();
        self.stage = Stage::Reflected;
    }
}

/// Nelder-Mead search for the lowest point of `f`, at most `evaluations` evaluations or until the simplex is flat.
///
/// `start` has the point to begin with, one number a parameter, and `steps` the first step along each. `f` must not return NaN.
///
/// ```
/// let f = |x: &[f64]| (x[0] - 3.0).powi(2) + (x[1] + 1.0).powi(2);
/// let lowest = numerics::minimise::nelder_mead(&f, &[0.0, 0.0], &[1.0, 1.0], 300);
/// assert!((lowest[0] - 3.0).abs() < 0.02 && (lowest[1] + 1.0).abs() < 0.02);
/// ```
///
/// # Source
/// J. A. Nelder, R. Mead, "A simplex method for function minimization", Computer J. 7 (1965) 308.
pub fn nelder_mead(
    f: &dyn Fn(&[f64]) -> f64,
    start: &[f64],
    steps: &[f64],
    evaluations: usize,
) -> Vec<f64> {
    let mut simplex = Simplex::new(start, steps, evaluations);
    while !matches!(simplex.stage, Stage::Ended) {
        let values: Vec<f64> = simplex.wanted(false).iter().map(|x| f(x)).collect();
        simplex.told(&values);
    }
    simplex.corners.swap_remove(0).1
}

/// The same from several starts, with the lowest values, of an `f` that takes several points in little more time than one: each
/// search asks what it asks for alone, and the last one what it may ask for too.
pub fn side_by_side<X: AsRef<[f64]>>(
    f: &dyn Fn(&[Vec<f64>]) -> Vec<f64>,
    starts: &[X],
    steps: &[f64],
    evaluations: usize,
) -> Vec<(f64, Vec<f64>)> {
    let new = |start: &X| Simplex::new(start.as_ref(), steps, evaluations);
    let mut all: Vec<Simplex> = starts.iter().map(new).collect();
    loop {
        let going = |s: &&Simplex| !matches!(s.stage, Stage::Ended);
        let alone = all.iter().filter(going).count() == 1;
        let wanted: Vec<Vec<Vec<f64>>> = all.iter().map(|s| s.wanted(alone)).collect();
        let values = f(&wanted.concat());
        if values.is_empty() {
            break;
        }
        let mut rest = &values[..];
        for (simplex, wanted) in all.iter_mut().zip(&wanted) {
            let (own, others) = rest.split_at(wanted.len());
            simplex.told(own);
            rest = others;
        }
    }
    let best = |mut s: Simplex| s.corners.swap_remove(0);
    all.into_iter().map(best).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn searches_side_by_side_find_what_each_finds_alone() {
        let f = |x: &[f64]| (x[0] - 1.0).powi(4) + (x[1] + x[0] * x[0]).powi(2) + x[2].abs();
        let all = |points: &[Vec<f64>]| points.iter().map(|x| f(x)).collect();
        let starts = [[3.0, 1.0, 2.0], [-2.0, 0.5, -1.0], [0.0, 0.0, 9.0]];
        for evaluations in [3, 40, 41, 42, 43, 400] {
            let found = side_by_side(&all, &starts, &[0.5; 3], evaluations);
            let ahead = starts.map(|s| side_by_side(&all, &[s], &[0.5; 3], evaluations).remove(0));
            for (start, (a, b)) in starts.iter().zip(found.into_iter().zip(ahead)) {
                let alone = nelder_mead(&f, start, &[0.5; 3], evaluations);
                assert_eq!((f(&alone), alone), a);
                assert_eq!(a, b);
            }
        }
        assert!(side_by_side(&all, &[[3.0, 1.0, 2.0]], &[0.5; 3], 400)[0].0 < 1e-3);
    }

    #[test]
    fn a_size_is_found_whatever_the_strength_does_far_from_it() {
        let near =
            |found: f64, size: f64| assert!((found / size - 1.0).abs() < 1e-6, "{found} {size}");
        near(size_for(8.0, &|x| 3.0 * x), 8.0 / 3.0);
        near(
            size_for(8.0, &|x| if x < 0.1 { 0.0 } else { x * x }),
            8f64.sqrt(),
        );
        for beyond in [0.0, f64::NAN, f64::INFINITY] {
            let overflows = |x: f64| if x > 200.0 { beyond } else { 4.0 * x };
            near(size_for(8.0, &overflows), 2.0);
        }
        // Saturates below what is wanted: the largest.
        near(size_for(8.0, &|x| x.min(2.0)), 8f64.exp());
    }
}
