//! A grid of several counts.

use model::record::Channel;
use model::{Parameter, effects};

use super::{BITS, parameters};
use crate::audit::Audit;
use crate::result::{Alternative, Finding};
use crate::test_level::{CheckId, audit_level};
use numerics::tails;

/// Share of the readings that have to lie on the coarse grid; the rails may lie beside it.
const ON_GRID: f64 = 0.97;

/// Coarse grid that the counts lie on.
pub(super) struct Coarse {
    /// Counts from one reading to the next.
    step: i32,
    residue: i32,
    changes: u64,
    /// Whether all readings between the ends lie on it.
    pub whole: bool,
}

/// The widest grid that all readings lie on, or nearly all; none where they lie on every count.
pub(super) fn grid(counts: &[i32], known: &[bool]) -> Option<Coarse> {
    let known_codes = || {
        counts
            .iter()
            .zip(known)
            .filter(|(_, k)| **k)
            .map(|(c, _)| c)
    };
    let (low, high) = (*known_codes().min()?, *known_codes().max()?);
    let on = |step: i32| -> Option<Coarse> {
        let mut tally = vec![0u64; step as usize];
        let mut all = 0u64;
        for (c, _) in counts.iter().zip(known).filter(|(_, k)| **k) {
            tally[c.rem_euclid(step) as usize] += 1;
            all += 1;
        }
        let (residue, most) = tally
            .iter()
            .enumerate()
            .max_by_key(|(_, t)| **t)
            .map(|(r, t)| (r as i32, *t))?;
        if (most as f64) < ON_GRID * all as f64 {
            return None;
        }
        // Pairs that do not share a reading are independent.
        let changes: Vec<bool> = counts
            .chunks_exact(2)
            .zip(known.chunks_exact(2))
            .filter(|(c, k)| k[0] && k[1] && c[0] != c[1])
            .map(|(c, _)| (c[1] - c[0]).rem_euclid(step) == 0)
            .collect();
        let even = changes.iter().filter(|e| **e).count() as u64;
        let trials = changes.len() as u64;
        if (even as f64) < ON_GRID * trials as f64
            || tails::hits_at_least(even, trials, 0.5) > audit_level()
        {
            return None;
        }
        Some(Coarse {
            step,
            residue,
            changes: trials,
            whole: known_codes().all(|c| [low, high].contains(c) || c.rem_euclid(step) == residue),
        })
    };
    // Of all readings between the ends: what all of their distances are multiples of.
    let mut between = known_codes().filter(|c| ![low, high].contains(c));
    let first = between.next();
    let all = first.map_or(0, |first| {
        between.fold(0, |all, c| greatest_divisor(all, c - first))
    });
    let any = (2..=1 << BITS)
        .contains(&all)
        .then(|| on(all))
        .flatten()
        .filter(|c| c.whole);
    let of_bits = || (1..=BITS).map_while(|bits| on(1 << bits)).last();
    any.or_else(of_bits)
}

/// The greatest common divisor; that of 0 and a number is the number.
fn greatest_divisor(a: i32, b: i32) -> i32 {
    let (mut a, mut b) = (a.unsigned_abs(), b.unsigned_abs());
    while b != 0 {
        (a, b) = (b, a % b);
    }
    i32::try_from(a).unwrap_or(0)
}

/// States the coarse grid of a channel: what it is taken for, and that its noise lacks those bits.
pub(super) fn tell(c: &Coarse, channel: &Channel, sigma: f64, audit: &mut Audit) {
    let name = channel.name.as_str();
    let bits = c.step.trailing_zeros();
    let size = Parameter::exact(
        f64::from(c.step) * channel.lsb.unwrap_or(1.0),
        if channel.lsb.is_some() {
            &channel.unit
        } else {
            "1"
        },
    );
    let chance = 0.5f64.powi(c.changes.min(900) as i32);
    let seen = if c.step == 1 << bits {
        format!("the {bits} lowest bits of {name} never change")
    } else {
        format!("all counts of {name} are multiples of {} apart", c.step)
    };
    let what = format!(
        "{seen}: its step is {} counts, {:.4} {} ({} changes, all of whole steps)",
        c.step, size.value, channel.unit, c.changes
    );
    audit.check(
        CheckId::LowBits,
        name,
        f64::from(bits),
        chance,
        what.clone(),
    );
    let mut finding = Finding {
        cause: effects::coarse_lsb::ID.into(),
        channels: vec![name.into()],
        what,
        ..Finding::default()
    };
    // One bit at 1 throughout is no grid that a converter makes.
    if c.step == 2 && c.residue == 1 {
        finding.cause = effects::stuck_bit::ID.into();
        finding.parameters = parameters(0, 1, 1.0, None);
    } else {
        finding.parameters = [
            ("missing_bits", Parameter::exact(f64::from(bits), "1")),
            ("step_counts", Parameter::exact(f64::from(c.step), "1")),
            ("step_size", size),
        ]
        .map(|(name, p)| (name.to_owned(), p))
        .into();
        if c.step == 2 {
            finding.alternatives.push(Alternative {
                cause: effects::stuck_bit::ID.into(),
                log_odds: 0.0,
            });
            finding.experiment = Some("read a register with known odd contents over the same line: a stuck line shows there too".into());
        }
    }
    audit.findings.push(finding);
    let step = f64::from(c.step);
    audit.lacks_a_bit(name, effects::coarse_lsb::ID, step, sigma);
    audit.suppress(
        &[effects::stuck_bit::ID, effects::stale_samples::ID],
        name,
        effects::coarse_lsb::ID,
    );
}
