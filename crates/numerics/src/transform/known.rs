//! Coefficients that the channels of a record have in common.

use std::cell::{Cell, RefCell};
use std::collections::{HashMap, HashSet};
use std::rc::Rc;

use crate::column::Column;

/// Coefficients of columns that the channels of a record have in common, by a digest of their samples.
#[derive(Default)]
pub struct Known {
    /// Those that go by what they hold.
    pub columns: RefCell<HashMap<[u64; 2], Column>>,
    /// Those that go by a name.
    pub named: RefCell<HashMap<String, Vec<Column>>>,
    /// Whether what the channels have in common is known: those of the first are, and no later one's own are kept.
    pub complete: Cell<bool>,
    /// Sums of products of the columns, by their places in memory, where they stay while they are kept.
    products: RefCell<HashMap<[usize; 2], Rc<Vec<f64>>>>,
    kept: RefCell<HashSet<usize>>,
}

impl Known {
    /// Keeps a column for the channels to come.
    pub fn keep(&self, key: [u64; 2], column: &Column) {
        self.kept.borrow_mut().insert(column.place());
        self.columns.borrow_mut().insert(key, column.clone());
    }

    /// Sums of products of two columns, where they are known.
    pub fn products(&self, two: [&Column; 2]) -> Option<Rc<Vec<f64>>> {
        self.products.borrow().get(&Self::places(two)).cloned()
    }

    /// Keeps them for the next who asks, where both columns are kept.
    pub fn keep_products(&self, two: [&Column; 2], products: &Rc<Vec<f64>>) {
        let (places, kept) = (Self::places(two), self.kept.borrow());
        if places.iter().all(|p| kept.contains(p)) {
            let mut all = self.products.borrow_mut();
            all.insert(places, Rc::clone(products));
        }
    }

    fn places(two: [&Column; 2]) -> [usize; 2] {
        let mut places = two.map(Column::place);
        places.sort_unstable();
        places
    }

    pub(super) fn forget(&self) {
        self.products.borrow_mut().clear();
        self.kept.borrow_mut().clear();
        self.columns.borrow_mut().clear();
        self.named.borrow_mut().clear();
    }
}
