//! Columns without names, by their places and values.

use model::record::Quantity;

use super::super::units::What;
use super::seen::Seen;
use super::{AXES, Guess};

/// As such files usually are: a time, three gyros, three accelerometers. The time rises, and accelerometers read gravity; where
/// no value is seen, the time is first where the number of columns is odd.
pub(super) fn guess_by_number(names: &[String], seen: &Seen, guess: &mut Guess) {
    let all = || (0..names.len()).filter(|at| !seen.is_text(*at));
    let time = match seen.has_rows() {
        true => all().find(|at| seen.is_time(*at)),
        false => (names.len() > 3 && names.len() != 6).then_some(0),
    };
    if let Some(at) = time {
        guess.add(names, "time", at, What::Time);
    }
    let is_reading = |at: &usize| Some(*at) != time && !seen.rises(*at) && !seen.is_constant(*at);
    let mut readings: Vec<usize> = all().filter(is_reading).collect();
    if readings.is_empty() {
        readings = all().filter(|at| Some(*at) != time).collect();
    }
    let (gyros, accs) = sensors(&readings, seen);
    for (stem, of, quantity) in [
        ("gyro", gyros, Quantity::Gyro),
        ("acc", accs, Quantity::Acc),
    ] {
        for (axis, at) in AXES.iter().zip(of) {
            let name = format!("{stem}_{axis}");
            match at {
                Some(at) => guess.add(names, &name, at, What::Channel(quantity)),
                None => guess.leave_open(&name, stem),
            }
        }
    }
}

/// The places of three gyros and of three accelerometers, `None` where nothing says which columns they are: the order of the
/// sensors is each writer's own, and what was seen has to show gravity.
fn sensors(readings: &[usize], seen: &Seen) -> (Vec<Option<usize>>, Vec<Option<usize>>) {
    let known = |of: &[usize]| of.iter().copied().map(Some).collect::<Vec<_>>();
    let unknown = || vec![None; AXES.len()];
    let is_gravity = |of: &&[usize]| seen.reads_gravity(of).is_some();
    if readings.len() < 2 * AXES.len() {
        let of = &readings[..readings.len().min(AXES.len())];
        return match of.len() == AXES.len() && is_gravity(&of) {
            true => (Vec::new(), known(of)),
            false => (known(of), Vec::new()),
        };
    }
    if !seen.has_rows() {
        let (gyros, accs) = readings.split_at(AXES.len());
        return (known(gyros), known(&accs[..AXES.len()]));
    }
    // Three by three; or anywhere, where a thermometer stands between.
    let in_threes = only(readings.chunks_exact(AXES.len()).filter(is_gravity));
    let anywhere = || only(readings.windows(AXES.len()).filter(is_gravity));
    match in_threes.or_else(anywhere) {
        Some(accs) => {
            let others = readings.iter().copied().filter(|at| !accs.contains(at));
            let others: Vec<usize> = others.collect();
            let is_one = others.len() == AXES.len();
            let gyros = if is_one { known(&others) } else { unknown() };
            (gyros, known(accs))
        }
        None => (unknown(), unknown()),
    }
}

/// The one of its kind.
fn only<T>(mut all: impl Iterator<Item = T>) -> Option<T> {
    all.next().filter(|_| all.next().is_none())
}
