//! Lost readings, filled again once it is known what moves the channel.
//!
//! Before the search they are filled by what white noise and a random walk tell, in which there is nothing of a line or of
//! what follows a temperature: as data they would make such effects smaller, by the part that was lost. With what was
//! found they are filled anew and everything is fitted again (the EM algorithm: what is off shrinks each time by that
//! part), and the errors are those of the readings that there are.

use rand_core::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::grid::Target;
use crate::scan::residual;
use crate::search::{Form, Search, State, Term};

/// Share of the readings below which what is lost makes nothing smaller that its error would show.
const LEAST: f64 = 5e-3;
/// Times that it is done: of a hole of a third, 1/81 is left.
const PASSES: usize = 4;

/// The state fitted to the data of the panel with its lost readings filled by what it explains itself.
pub(crate) fn again(search: &Search<'_>, mut state: State, target: &Target) -> State {
    let panel = &search.panel;
    let few = (target.lost.len() as f64) < LEAST * panel.bins.n as f64;
    let columns = state.terms.iter().any(|t| !t.columns.is_empty());
    // What was found by other means than the fit is not fitted again.
    let stated = state.terms.iter().any(|t| t.stated.is_some());
    if few || !columns || stated || target.moving {
        return state;
    }
    for _ in 0..PASSES {
        let before = panel
            .dct
            .inverse(&residual(panel, &state.columns(), &state.solution));
        let mut rest = before.clone();
        target.lost.iter().for_each(|i| rest[*i] = f64::NAN);
        let white = state.solution.white;
        let step = white * state.noise.log_walk.exp();
        // The same draws every time: it is to converge.
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(0x7265_6669_6c6c);
        crate::kalman::fill(&mut rest, white, step, &mut rng);
        // Elsewhere nothing changes.
        rest.iter_mut().zip(before).for_each(|(r, b)| *r -= b);
        let change = panel.dct.forward(&rest);
        let mut data = panel.column(0).to_vec();
        data.iter_mut().zip(change).for_each(|(d, c)| *d += c);
        panel.replace_data(data);
        search.settle(&mut state);
        // What explained the filled readings, as a step where they begin, has nothing left to explain.
        let weakest = |s: &State| {
            let scores = s.terms.iter().map(Term::score).enumerate();
            let weak = scores.filter(|(_, score)| *score < 0.0);
            weak.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(i, _)| i)
        };
        while let Some(i) = weakest(&state) {
            state.terms.remove(i);
            search.settle(&mut state);
        }
    }
    widen(search, &mut state, &target.lost);
    state
}

/// Takes the part of each column's energy that lies in lost readings out of what is known of its coefficient. A step is
/// known by what lies about it.
fn widen(search: &Search<'_>, state: &mut State, lost: &[usize]) {
    let wider: Vec<f64> = state
        .terms
        .iter()
        .flat_map(|t| {
            t.columns
                .iter()
                .map(|c| (matches!(t.form, Form::Step(..)), *c))
        })
        .map(|(step, column)| {
            if step {
                return 1.0;
            }
            let mut c = search.panel.column(column).to_vec();
            c[0] = 0.0;
            let values = search.panel.dct.inverse(&c);
            let energy: f64 = values.iter().map(|v| v * v).sum();
            let gone: f64 = lost.iter().map(|i| values[*i] * values[*i]).sum();
            (1.0 - gone / energy.max(f64::MIN_POSITIVE))
                .max(0.05)
                .sqrt()
                .recip()
        })
        .collect();
    for (row, a) in state.solution.inverse.iter_mut().zip(&wider) {
        row.iter_mut().zip(&wider).for_each(|(v, b)| *v *= a * b);
    }
}
