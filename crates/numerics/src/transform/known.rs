//! Coefficients that the channels of a record have in common.

use std::collections::{HashMap, HashSet};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::column::Column;

/// Coefficients of columns that the channels of a record have in common, by a digest of their samples.
#[derive(Default)]
pub struct Known {
    kept: Mutex<Kept>,
    complete: AtomicBool,
}

#[derive(Default)]
struct Kept {
    /// Those that go by what they hold.
    columns: HashMap<[u64; 2], Column>,
    /// Those that go by a name.
    named: HashMap<String, Vec<Column>>,
    /// Sums of products of the columns, by their places in memory, where they stay while they are kept.
    products: HashMap<[usize; 2], Arc<Vec<f64>>>,
    /// Samples that each channel makes for itself, by their digest.
    samples: HashMap<[u64; 2], Arc<Vec<f64>>>,
    places: HashSet<usize>,
}

impl Known {
    fn kept(&self) -> MutexGuard<'_, Kept> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether what the channels have in common is known: those of the first are, and no later one's own are kept.
    fn is_complete(&self) -> bool {
        self.complete.load(Ordering::Relaxed)
    }

    pub(super) fn complete(&self) {
        self.complete.store(true, Ordering::Relaxed);
    }

    /// The column of a digest, where it is known.
    pub fn column(&self, key: &[u64; 2]) -> Option<Column> {
        self.kept().columns.get(key).cloned()
    }

    /// Keeps a column for the channels to come.
    pub fn keep(&self, key: [u64; 2], column: &Column) {
        if !self.is_complete() {
            let mut kept = self.kept();
            kept.places.insert(column.place());
            kept.columns.insert(key, column.clone());
        }
    }

    /// The columns of a name, where they are known.
    pub fn named(&self, name: &str) -> Option<Vec<Column>> {
        self.kept().named.get(name).cloned()
    }

    /// Keeps the columns of a name for the channels to come.
    pub fn keep_named(&self, name: &str, columns: &[Column]) {
        if !self.is_complete() {
            let mut kept = self.kept();
            kept.named.insert(name.to_owned(), columns.to_vec());
        }
    }

    /// These samples, or the same of another channel, in the place of which they are let go of.
    pub fn same(&self, key: [u64; 2], samples: Arc<Vec<f64>>) -> Arc<Vec<f64>> {
        Arc::clone(self.kept().samples.entry(key).or_insert(samples))
    }

    /// Sums of products of two columns, where they are known.
    pub fn products(&self, two: [&Column; 2]) -> Option<Arc<Vec<f64>>> {
        self.kept().products.get(&places(two)).cloned()
    }

    /// Keeps them for the next who asks, where both columns are kept.
    pub fn keep_products(&self, two: [&Column; 2], products: &Arc<Vec<f64>>) {
        let (places, mut kept) = (places(two), self.kept());
        if places.iter().all(|p| kept.places.contains(p)) {
            kept.products.insert(places, Arc::clone(products));
        }
    }

    pub(super) fn forget(&self) {
        *self.kept() = Kept::default();
    }
}

fn places(two: [&Column; 2]) -> [usize; 2] {
    let mut places = two.map(Column::place);
    places.sort_unstable();
    places
}
