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

/// Nelder-Mead search for the lowest point of `f`, at most `evaluations` evaluations or until the simplex is flat.
pub fn nelder_mead(
    f: &dyn Fn(&[f64]) -> f64,
    start: &[f64],
    steps: &[f64],
    evaluations: usize,
) -> Vec<f64> {
    let n = start.len();
    let mut simplex: Vec<(f64, Vec<f64>)> = vec![(f(start), start.to_vec())];
    for i in 0..n {
        let mut x = start.to_vec();
        x[i] += steps[i];
        simplex.push((f(&x), x));
    }
    let mut used = n + 1;
    while used < evaluations {
        simplex.sort_by(|a, b| a.0.total_cmp(&b.0));
        if (simplex[n].0 - simplex[0].0).abs() < 1e-4 {
            break;
        }
        let centre: Vec<f64> = (0..n)
            .map(|j| simplex[..n].iter().map(|s| s.1[j]).sum::<f64>() / n as f64)
            .collect();
        let along = |t: f64| -> Vec<f64> {
            (0..n)
                .map(|j| centre[j] + t * (centre[j] - simplex[n].1[j]))
                .collect()
        };
        let reflected = along(1.0);
        let fr = f(&reflected);
        used += 1;
        if fr < simplex[0].0 {
            let far = along(2.0);
            let ff = f(&far);
            used += 1;
            simplex[n] = if ff < fr { (ff, far) } else { (fr, reflected) };
        } else if fr < simplex[n - 1].0 {
            simplex[n] = (fr, reflected);
        } else {
            let near = if fr < simplex[n].0 {
                along(0.5)
            } else {
                along(-0.5)
            };
            let fn_ = f(&near);
            used += 1;
            if fn_ < simplex[n].0.min(fr) {
                simplex[n] = (fn_, near);
            } else {
                let best = simplex[0].1.clone();
                for s in simplex.iter_mut().skip(1) {
                    s.1.iter_mut()
                        .zip(&best)
                        .for_each(|(x, b)| *x = b + 0.5 * (*x - b));
                    s.0 = f(&s.1);
                    used += 1;
                }
            }
        }
    }
    simplex.sort_by(|a, b| a.0.total_cmp(&b.0));
    simplex.swap_remove(0).1
}

#[cfg(test)]
mod tests {
    use super::*;

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
