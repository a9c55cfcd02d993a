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
