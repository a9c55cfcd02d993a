//! How a heater beside the board is switched, so that a record tells what the bias does over temperature.
//!
//! A board follows what warms it with a time constant of minutes. A heater that is switched faster hardly moves it; one that is
//! switched slower moves it where the bias walks as far by itself. The least standard error of a slope is that of generalized
//! least squares on N, K and the course of the temperature (the Cramer-Rao bound).

/// On for so long and off for so long in turn, s: twice the time constant of the simulated stand's board. The period that is
/// best goes from 600 s for a K of 0.005 deg/s/sqrt(s) to 3000 s and more for none; this one is within a fifth of the best where K is
/// 0.0003 to 0.005, and within 1.8 times where there is no K.
pub const HEATER_S: f64 = 480.0;

#[cfg(test)]
mod tests {
    use super::*;
    use bench::Thermal;
    use bench::scenario::ThermalPart;

    /// Step of the sums, and length of the record, s.
    const STEP_S: f64 = 4.0;
    const SECONDS: f64 = 7200.0;
    /// Angle random walk of the paper's stand, deg/sqrt(s).
    const N: f64 = 5.27 / 60.0;

    /// A die's temperature beside a heater of that period.
    fn temperature(period_s: f64) -> Vec<f64> {
        let mut thermal = Thermal::new(ThermalPart {
            heater_c: 10.0,
            heater_period_s: period_s,
            ..ThermalPart::default()
        });
        let steps = (SECONDS / STEP_S) as usize;
        (0..steps)
            .map(|n| {
                thermal.step(n as f64 * STEP_S, STEP_S);
                thermal.die_c()[2]
            })
            .collect()
    }

    /// Standard error of a slope over it, deg/s/degC, where the bias at the begin is unknown: differences from step to step have
    /// a tridiagonal covariance C, and the error is (d' C^-1 d)^-1/2.
    fn slope_error(period_s: f64, k: f64) -> f64 {
        let values = temperature(period_s);
        let d: Vec<f64> = values.windows(2).map(|w| w[1] - w[0]).collect();
        let white = N * N / STEP_S;
        let (own, next) = (k * k * STEP_S + 2.0 * white, -white);
        // C = L D L': the sum of (L^-1 d)^2 / D.
        let (mut pivot, mut left, mut sum) = (own, d[0], d[0] * d[0] / own);
        for d in &d[1..] {
            let factor = next / pivot;
            pivot = own - factor * next;
            left = d - factor * left;
            sum += left * left / pivot;
        }
        sum.sqrt().recip()
    }

    #[test]
    fn the_heaters_period_is_near_the_best_for_any_walk_and_far_better_than_a_fast_one() {
        let periods = [250.0, 350.0, 500.0, 700.0, 1000.0, 1400.0, 2000.0, 3000.0];
        for (k, most) in [
            (0.0, 1.8),
            (0.0003, 1.2),
            (0.001, 1.2),
            (0.002, 1.2),
            (0.005, 1.2),
        ] {
            let best = periods
                .map(|period| slope_error(period, k))
                .into_iter()
                .fold(f64::INFINITY, f64::min);
            let (own, fast) = (slope_error(2.0 * HEATER_S, k), slope_error(175.0, k));
            println!(
                "K {k}: {own:.2e} deg/s/degC, {:.2} x the best, a period of 175 s {:.1} x",
                own / best,
                fast / best
            );
            assert!(own <= most * best, "{k}: {own} {best}");
            assert!(fast >= 1.4 * own, "{k}: {fast} {own}");
        }
    }
}
