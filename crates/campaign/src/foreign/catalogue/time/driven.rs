//! Signals of what something else drives over a threshold, or starts again.

use super::super::super::prelude::*;

/// A plate that snaps between two shapes. Draughts push it over now and then, and a weak sway of the building, too weak for it
/// alone, tells when that is easy: it snaps about twice a period, misses some, and keeps no dwell of its own. Two states with
/// rates that the sway swings (McNamara and Wiesenfeld 1989); the plate takes a moment to settle.
pub(super) fn snapping(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let period = draw.by_ratio(2.5, 10.0);
    let swing = draw.between(2.0, 3.0);
    // Snaps a second where the sway helps most: of each half period most have theirs.
    let most = draw.between(4.0, 9.0) / period;
    let first = draw.between(0.0, TAU);
    let mut state = draw.sign();
    let shape = in_time(stand, |t| {
        let helps = -state * (first + TAU * t / period).cos();
        let rate = most * (swing * (helps - 1.0)).exp();
        if draw.chance(-(-rate / stand.rate_hz).exp_m1()) {
            state = -state;
        }
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
        let from = (at * stand.rate_hz) as usize;
        y.iter_mut()
            .skip(from)
            .zip(&motif)
            .for_each(|(y, m)| *y += m);
        at += motif.len() as f64 / stand.rate_hz + 0.5 + waits * draw.exponential();
    }
    y
}
