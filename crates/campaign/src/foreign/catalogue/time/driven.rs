//! Signals of what something else drives over a threshold, starts again, or leads to and fro.

use super::super::super::prelude::*;

/// A plate that snaps between two shapes. Draughts push it over now and then, and a weak sway of the building, too weak for it
/// alone, tells when that is easy: it snaps about twice a period, misses some, and keeps no dwell of its own. Two states with
/// rates that the sway swings (McNamara and Wiesenfeld 1989); the plate takes a moment to settle.
pub(super) fn snapping(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let period = draw.by_ratio(2.5, 10.0);
    let swing = draw.between(2.0, 3.0);
    // Snaps a second where the sway helps most: of each half period most have theirs.
    let most = draw.between(4.0, 9.0) / period;
    let first = draw.phase();
    let mut state = draw.sign();
    let shape = in_time(stand, |t| {
        let helps = -state * (first + TAU * t / period).cos();
        let rate = most * (swing * (helps - 1.0)).exp();
        state *= draw.choose(-(-rate / stand.rate_hz).exp_m1(), -1.0, 1.0);
        state
    });
    stand.lagged(&shape, draw.by_ratio(0.05, 0.2))
}

/// An arm at the next bench that is sent through the same moves whenever somebody asks for them: what the floor leans by as the
/// arm speeds up and brakes is the same from time to time, and between there is nothing. It has no period, and any stretch of
/// it might be noise that a mode colours.
pub(super) fn moves(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let length = (draw.by_ratio(5.0, 15.0) * stand.rate_hz) as usize;
    let mut place = 0.0;
    let mut places = stand.held(draw, (0.4, 2.0), |d| {
        place = if d.chance(0.25) { place } else { d.normal() };
        place
    });
    places.truncate(length);
    // It begins where it ends.
    let home = places[0];
    places.extend(vec![home; stand.rate_hz.ceil() as usize]);
    let motif = changes(&stand.lagged(&places, draw.by_ratio(0.15, 0.4)));
    let waits = draw.by_ratio(2.0, 12.0);
    let mut y = vec![0.0; stand.samples()];
    let mut at = draw.exponential() * waits;
    while at < stand.seconds {
        add_at(&mut y, (at * stand.rate_hz) as usize, motif.iter().copied());
        at += motif.len() as f64 / stand.rate_hz + 0.5 + waits * draw.exponential();
    }
    y
}

/// A trolley that goes to and fro over the rails next door, as far as it is needed: the floor leans by whatever is under its
/// wheels, joints and warps that stay where they are. About each turn the lean is a palindrome, and the rate one of the other
/// sign; a trip as a whole never comes again.
pub(super) fn trolley(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let joints: Vec<(f64, f64, f64)> = (0..8 + draw.of_many(7))
        .map(|_| {
            let high = draw.signed(0.3, 1.0);
            (draw.between(0.0, 1.0), high, draw.by_ratio(0.008, 0.02))
        })
        .collect();
    let most = 1.0 / (draw.by_ratio(8.0, 20.0) * stand.rate_hz);
    let (mut place, mut goal) = (draw.between(0.0, 1.0), draw.between(0.0, 1.0));
    let places = stand.series(|_| {
        if place == goal {
            goal = draw.between(0.0, 1.0);
        }
        place += (goal - place).clamp(-most, most);
        place
    });
    let leans = each(&stand.lagged(&places, 0.3), |place| {
        let joint = |(at, high, wide): &(f64, f64, f64)| {
            high * (-0.5 * ((place - at) / wide).powi(2)).exp()
        };
        joints.iter().map(joint).sum()
    });
    changes(&leans)
}

/// A part that trims its zero anew now and then, and searches it by halves: it tries the largest bit of its trim, keeps it or
/// not, then the next. Where the zero lies is different each time, and so is the way there.
pub(super) fn by_halves(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    const BITS: i32 = 7;
    let step_s = draw.by_ratio(0.3, 1.2);
    let waits = draw.by_ratio(3.0, 12.0);
    let first = draw.exponential() * waits;
    arriving(stand, first, |y, at| {
        let (zero, mut trim) = (draw.between(-1.0, 1.0), 0.0);
        for bit in 1..=BITS {
            trim += 0.5f64.powi(bit) * if zero > trim { 1.0 } else { -1.0 };
            let [begins, ends] = [bit - 1, bit]
                .map(|bits| ((at + step_s * f64::from(bits)) * stand.rate_hz) as usize);
            add_at(y, begins, std::iter::repeat_n(trim - zero, ends - begins));
        }
        at + step_s * f64::from(BITS) + 1.0 + waits * draw.exponential()
    })
}
