//! What a combination without a name has beyond the names beside it.

use model::record::Quantity;

use super::{Search, State, Term};
use crate::fit::likelihood;

impl<'a> Search<'a> {
    /// Which columns of a term lie beyond those of a state.
    fn beyond<'b>(
        &'b self,
        state: &State,
        term: &'b Term,
    ) -> impl Iterator<Item = usize> + use<'b, 'a> {
        let own = state.columns();
        let flat = vec![1.0; self.panel.bins.n];
        (0..term.columns.len()).filter(move |i| {
            let columns = [own.as_slice(), &[term.columns[*i]]].concat();
            let (inverse, _) = likelihood::invert(&self.panel.normal(&flat, &columns).matrix);
            inverse.last().and_then(|row| row.last()) != Some(&0.0)
        })
    }

    /// Whether a term without a name has columns that may have one: a signal beside the same behind a lag, or in other laws. A
    /// response to vibration over some samples is one law, which the library has with the gyro's filter, and is not divided.
    fn is_divided(&self, term: &Term) -> bool {
        let of_vibration = |name: &String| {
            let mut signals = self.view.all(Quantity::Acc);
            signals.any(|s| s.name == *name)
        };
        term.has_no_name() && term.columns.len() > 1 && !term.of.iter().any(of_vibration)
    }

    /// Whether a state has some of the columns of a term without a name, and not all.
    pub(super) fn spans_part(&self, state: &State, term: &Term) -> bool {
        self.is_divided(term) && {
            let beyond = self.beyond(state, term).count();
            beyond > 0 && beyond < term.columns.len()
        }
    }

    /// A term without a name with the columns that it has beyond those of a state; another one as it is.
    pub(super) fn stripped(&self, state: &State, term: Term) -> Term {
        if !self.spans_part(state, &term) {
            return term;
        }
        let new: Vec<usize> = self.beyond(state, &term).collect();
        Term {
            columns: new.iter().map(|i| term.columns[*i]).collect(),
            names: new
                .iter()
                .filter_map(|i| term.names.get(*i).copied())
                .collect(),
            ..term
        }
    }
}
