//! Work on two threads.

use std::panic::resume_unwind;
use std::sync::{Mutex, PoisonError};
use std::thread;

/// What `work` makes of each item, in their order. A second thread takes part where there is one for it, and `about` what it
/// does: each takes the next item that nobody has.
pub fn in_order<T: Send, R: Send>(
    items: impl IntoIterator<Item = T, IntoIter: Send>,
    about: impl FnOnce(&mut dyn FnMut()) + Send,
    work: impl Fn(T) -> R + Sync,
) -> Vec<R> {
    let items = Mutex::new(items.into_iter().enumerate());
    let share = || {
        let mut made = vec![];
        loop {
            let next = items.lock().unwrap_or_else(PoisonError::into_inner).next();
            let Some((i, item)) = next else {
                return made;
            };
            made.push((i, work(item)));
        }
    };
    let mut made = thread::scope(|threads| {
        let beside = thread::Builder::new().spawn_scoped(threads, || {
            let mut made = vec![];
            about(&mut || made = share());
            made
        });
        let mut made = share();
        // A browser has no second thread.
        if let Ok(thread) = beside {
            made.extend(thread.join().unwrap_or_else(|panic| resume_unwind(panic)));
        }
        made
    });
    made.sort_by_key(|(i, _)| *i);
    made.into_iter().map(|(_, made)| made).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_made_on_two_threads_comes_in_order() {
        let made = in_order(0..1000, |work| work(), |i| i * i);
        assert!(made.iter().enumerate().all(|(i, m)| *m == i * i) && made.len() == 1000);
        assert!(in_order(0..0, |work| work(), |i| i).is_empty());
    }
}
