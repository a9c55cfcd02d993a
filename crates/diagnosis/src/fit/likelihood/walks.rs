//! Random walks about the fitted one: what a candidate beside a state is weighed with.

use super::{Noise, Panel, least_walk};

impl Panel {
    /// 1/g and sum ln g for random walks about the fitted one: what profiling a candidate needs.
    #[must_use]
    pub fn walks(&self, noise: &Noise) -> Vec<(Noise, Vec<f64>, f64)> {
        let low = least_walk(self.bins.n);
        let step = std::f64::consts::LN_10;
        let mut at: Vec<f64> = [-3.0, -2.0, -1.5, -1.0, -0.7, -0.4, -0.2, 0.0, 0.2, 0.5, 1.0]
            .iter()
            .map(|d| (noise.log_walk + d * step).max(low))
            .collect();
        at.push(low);
        at.sort_by(f64::total_cmp);
        at.dedup();
        let with = noise.with_walks(&self.bins);
        at.into_iter()
            .map(|log_walk| {
                let g = with(log_walk);
                let trial = Noise {
                    log_walk,
                    terms: noise.terms.clone(),
                };
                let log_det = self.bins.log_det(&g);
                (trial, g.iter().map(|g| 1.0 / g).collect(), log_det)
            })
            .collect()
    }

    /// The likeliest of noises as [`Panel::walks`] gives them.
    pub(crate) fn likeliest(
        &self,
        all: impl Iterator<Item = (Noise, Vec<f64>, f64)>,
        columns: &[usize],
    ) -> Option<Noise> {
        let at = |(noise, weight, log_det): (Noise, Vec<f64>, f64)| {
            let solution = self.solve_weighted(&weight, log_det, columns);
            (noise, solution.log_likelihood)
        };
        let best = all.map(at).max_by(|a, b| a.1.total_cmp(&b.1));
        best.map(|b| b.0)
    }

    /// Highest log likelihood over the given random walks, with a parabola through the best three.
    #[must_use]
    pub fn profile(&self, walks: &[(Noise, Vec<f64>, f64)], columns: &[usize]) -> f64 {
        let points: Vec<(f64, f64)> = walks
            .iter()
            .map(|(noise, weight, log_det)| {
                (
                    noise.log_walk,
                    self.solve_weighted(weight, *log_det, columns)
                        .log_likelihood,
                )
            })
            .collect();
        numerics::minimise::peak(&points)
    }
}
