//! What knowing of events gains on readings that their rate was not taken from: each block of the held-out part under the
//! rate, and the sizes, of all that lies before it.

use super::{BEFORE, ends};

/// Chances that no reading is closer to 0 or 1 than.
const LEAST: f64 = 1e-12;

/// Parts of a record whose events tell whether they come in crowds.
const PARTS: usize = 20;

/// Log of the normal density of variance `v`, but for a constant.
fn log_normal(x: f64, v: f64) -> f64 {
    -0.5 * (v.ln() + x * x / v)
}

/// What it gains to know that an event has a chance of its own, where a model gives it the chance `before`: nats, and the
/// standard error. `events` are those of the readings that there are; the chance is that of Krichevsky and Trofimov (1981,
/// IEEE Trans. Inf. Theory 27: 199-207), (hits + 1/2) / (readings + 1).
pub(crate) fn of_events(events: &[Option<bool>], before: f64) -> (f64, f64) {
    let before = before.clamp(LEAST, 1.0 - LEAST);
    let count = |part: &[Option<bool>]| {
        let known = part.iter().flatten();
        known.fold((0.0, 0.0), |(hits, all), hit| {
            (hits + f64::from(u8::from(*hit)), all + 1.0)
        })
    };
    let (mut nats, mut variance) = (0.0, 0.0);
    for w in ends(events.len()).windows(2) {
        let (hits, all) = count(&events[..w[0]]);
        let own = (hits + 0.5) / (all + 1.0);
        let (hit, miss) = ((own / before).ln(), ((1.0 - own) / (1.0 - before)).ln());
        let (hits, all) = count(&events[w[0]..w[1]]);
        nats += hits * hit + (all - hits) * miss;
        variance += all * own * (1.0 - own) * (hit - miss).powi(2);
    }
    // Events that come in crowds scatter by more than independent ones: by the spread of their number over parts.
    let parts = events
        .chunks(events.len().div_ceil(PARTS).max(1))
        .map(count);
    let (hits, all) = count(events);
    let share = (hits / all).clamp(LEAST, 1.0 - LEAST);
    let off = parts
        .filter(|p| p.1 > 0.0)
        .map(|(hits, all)| (hits - share * all).powi(2) / (share * (1.0 - share) * all));
    let off: Vec<f64> = off.collect();
    let crowded = off.iter().sum::<f64>() / (off.len() as f64 - 1.0).max(1.0);
    (nats, (1.0 - BEFORE + variance * crowded.max(1.0)).sqrt())
}

/// Readings that a record has of wild ones before any was read, and their size, standard deviations.
const PRIOR: (f64, f64) = (0.5, 6.0);

/// What it gains to know that some readings are wild, nats, and the standard error: normal noise with a share of wild readings
/// of a size, against normal noise that holds them all. `e` are readings about the model, `wild` the places of the wild ones.
pub(crate) fn of_outliers(e: &[f64], wild: &[usize]) -> (f64, f64) {
    let mut is_wild = vec![false; e.len()];
    wild.iter().for_each(|i| is_wild[*i] = true);
    let ends = ends(e.len());
    let (mut nats, mut variance) = (0.0, 1.0 - BEFORE);
    for w in ends.windows(2) {
        let law = Contaminated::of(&e[..w[0]], &is_wild[..w[0]]);
        let next = e[w[0]..w[1]].iter();
        nats += next.map(|v| law.gained(*v)).sum::<f64>();
        variance += 0.5 * (w[1] - w[0]) as f64 * (law.own / law.plain - 1.0).powi(2);
    }
    // How many of them fall into the part that is held out is chance.
    let law = Contaminated::of(e, &is_wild);
    let each = wild.iter().map(|i| law.gained(e[*i]).powi(2));
    variance += (1.0 - BEFORE) * each.sum::<f64>();
    (nats, variance.sqrt())
}

/// Normal noise with a share of wild readings, and the normal noise that holds them all.
struct Contaminated {
    share: f64,
    own: f64,
    far: f64,
    plain: f64,
}

impl Contaminated {
    fn of(e: &[f64], is_wild: &[bool]) -> Self {
        let sum = |of: bool| -> (f64, f64) {
            let own = e.iter().zip(is_wild).filter(|(_, wild)| **wild == of);
            own.fold((0.0, 0.0), |(s, n), (v, _)| (s + v * v, n + 1.0))
        };
        let ((quiet, tame), (loud, count)) = (sum(false), sum(true));
        let own = quiet / tame.max(1.0);
        Self {
            share: (count + PRIOR.0) / (e.len() as f64 + 1.0),
            own,
            far: own + (loud + PRIOR.0 * PRIOR.1.powi(2) * own) / (count + PRIOR.0),
            plain: (quiet + loud) / (tame + count).max(1.0),
        }
    }

    /// Nats by which a reading is likelier under it.
    fn gained(&self, v: f64) -> f64 {
        let near = (1.0 - self.share).ln() + log_normal(v, self.own);
        let off = self.share.ln() + log_normal(v, self.far);
        let top = near.max(off);
        top + ((near - top).exp() + (off - top).exp()).ln() - log_normal(v, self.plain)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_event_gains_what_its_chance_is_worth() {
        // Every second reading, where one in four is expected: ln 2 / 2 + ln (2 / 3) / 2 nats of each of 6000.
        let events: Vec<Option<bool>> = (0..10_000).map(|i| Some(i % 2 == 0)).collect();
        let (nats, error) = of_events(&events, 0.25);
        let worth = 6000.0 * 0.5 * (2f64.ln() + (2.0f64 / 3.0).ln());
        assert!((nats - worth).abs() < 2.0, "{nats} {worth}");
        // sqrt(6000 / 4) of ln 3.
        assert!(
            (error / (1500f64.sqrt() * 3f64.ln()) - 1.0).abs() < 0.01,
            "{error}"
        );
        // What is as often as expected gains nothing.
        assert!(of_events(&events, 0.5).0.abs() < 0.5);
    }

    #[test]
    fn wild_readings_gain_and_none_cost_next_to_nothing() {
        let tame: Vec<f64> = (0..10_000).map(|i| f64::from(i % 7 - 3) / 2.0).collect();
        let (nats, _) = of_outliers(&tame, &[]);
        assert!((-2.0..0.1).contains(&nats), "{nats}");
        let mut e = tame;
        let wild: Vec<usize> = (0..20).map(|i| 500 * i + 7).collect();
        wild.iter().for_each(|i| e[*i] = 12.0);
        let (nats, error) = of_outliers(&e, &wild);
        assert!(
            nats > 200.0 && error > 0.1 * nats && error < nats,
            "{nats} {error}"
        );
    }
}
