//! The twelfth set's signals that have a structure in time of their own.

use std::f64::consts::{PI, TAU};

use super::super::kept_back_fourth::about_mean;
use super::super::kept_back_tenth::events::{events, since, sizes};
use crate::random::Draw;
use crate::stand::{Stand, held, lagged, wander};

/// A harmonic of the mains, folded to anywhere in the band: the grid's frequency wanders by some 20 mHz, and the harmonic by
/// as much more as its number says.
pub(super) fn hum(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let harmonic = (1 + draw.of_many(7)) as f64;
    let (folded, turns_over) = (draw.between(0.8, 9.2), draw.sign());
    let (sigma, tau) = (draw.by_ratio(0.012, 0.03), draw.by_ratio(20.0, 120.0));
    let grid = wander(draw, stand.samples(), stand.rate_hz, sigma, tau);
    let mut phase = draw.between(0.0, TAU);
    grid.iter()
        .map(|off| {
            phase += TAU * (folded + turns_over * harmonic * off) / stand.rate_hz;
            phase.sin()
        })
        .collect()
}

/// Terms of the series for a film that are followed.
const TERMS: i32 = 40;

/// What a film has taken up whose face has this humidity: Fick's law, each odd term of the series a lag of its own. At first
/// it goes as the square root of time, and after the longest lag it is full.
fn taken_up(face: &[f64], longest_s: f64, rate_hz: f64) -> Vec<f64> {
    let mut all = vec![0.0; face.len()];
    for k in 0..TERMS {
        let odd = f64::from(2 * k + 1).powi(2);
        let term = lagged(face, longest_s / odd, rate_hz);
        let share = 8.0 / (PI * PI * odd);
        all.iter_mut().zip(term).for_each(|(a, t)| *a += share * t);
    }
    all
}

/// Moisture diffuses into the package and swells it, by the square root of time, and out again: the air is damp and dry by
/// turns, which nothing records. A film takes hours and minutes; here it is as thin as it has to be to stand out from a
/// random walk.
pub(super) fn moisture(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let mut damp = draw.chance(0.5);
    let dwell = draw.by_ratio(4.0, 12.0);
    let reach = (0.6 * dwell, 1.4 * dwell);
    let face = held(draw, stand.samples(), stand.rate_hz, reach, |d| {
        damp = !damp;
        f64::from(u8::from(damp)) * d.between(0.6, 1.0)
    });
    let longest = dwell * draw.by_ratio(0.7, 3.0);
    about_mean(&taken_up(&face, longest, stand.rate_hz))
}

/// The loop that holds the drive at its resonance loses it now and then: for a moment its phase slips through whole turns,
/// slower and slower, then it is caught and what is left of the error dies away.
pub(super) fn lock(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let count = 3 + draw.of_many(6);
    let at = events(draw, stand, count);
    let (slips, beat) = (draw.between(0.4, 1.5), draw.between(2.0, 6.0));
    let dies = draw.by_ratio(1.5, 8.0);
    let size = sizes(draw, &at);
    since(stand, &at, |k, t| {
        size[k]
            * if t < slips {
                // Its pitch goes down to 0 evenly, and ends at a crest.
                (PI * beat * slips * (1.0 - t / slips).powi(2)).cos()
            } else {
                (-(t - slips) / dies).exp()
            }
    })
}

/// The air conditioning of the room blows cold until its thermostat is content, then the room warms up again for longer: the
/// draught cools one side of the part, and the part's thermometer, which is inside, sees nothing. Its cycles are of less than
/// a minute, for those of minutes stay weak beside a random walk (d' 20).
pub(super) fn draught(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let (period, blows) = (draw.by_ratio(20.0, 45.0), draw.between(0.02, 0.08));
    let (mut level, mut cools, sign) = (draw.between(0.0, 1.0), draw.chance(0.5), draw.sign());
    let mut pace = 1.0;
    let room: Vec<f64> = (0..stand.samples())
        .map(|_| {
            let takes = period * if cools { -blows } else { 1.0 - blows };
            level += pace / (takes * stand.rate_hz);
            if !(0.0..=1.0).contains(&level) {
                level = level.clamp(0.0, 1.0);
                cools = !cools;
                // The sun, a door: no two of them take quite as long.
                pace = draw.between(0.85, 1.15);
            }
            sign * level
        })
        .collect();
    about_mean(&lagged(&room, draw.by_ratio(0.3, 1.5), stand.rate_hz))
}

#[cfg(test)]
mod tests {
    use super::super::tests::stand;
    use super::*;
    use crate::foreign::kept_back_tenth::tests::largest_change;
    use crate::foreign::swing;

    #[test]
    fn a_hum_keeps_its_size_and_loses_its_phase() {
        let (mut draw, stand) = stand(20);
        for _ in 0..5 {
            let y = hum(&mut draw, &stand);
            let square = |part: &[f64]| part.iter().map(|v| v * v).sum::<f64>() / part.len() as f64;
            for part in y.chunks(1200) {
                assert!((square(part) - 0.5).abs() < 0.1);
            }
            // No one frequency has it from end to end.
            let power = |hz: f64| {
                let at = |i: usize| TAU * hz * i as f64 / stand.rate_hz;
                let (c, s) = y.iter().enumerate().fold((0.0, 0.0), |(c, s), (i, v)| {
                    (c + v * at(i).cos(), s + v * at(i).sin())
                });
                2.0 * (c * c + s * s) / (y.len() as f64).powi(2) / square(&y)
            };
            let most = (0..6000).map(|k| power(f64::from(k) / 600.0));
            let most = most.fold(0.0, f64::max);
            assert!(most < 0.8, "{most}");
        }
    }

    #[test]
    fn a_film_takes_up_by_the_square_root_of_time_and_is_full_at_last() {
        let mut face = vec![1.0; 40_000];
        face[0] = 0.0;
        let y = taken_up(&face, 100.0, 20.0);
        // The longest lag is 4 l^2 / pi^2 D; the root holds until some fifth of it.
        for (early, late) in [(10, 40), (50, 200), (80, 320)] {
            let ratio = y[late] / y[early];
            assert!((ratio - 2.0).abs() < 0.15, "{early}: {ratio}");
        }
        assert!((y[39_999] - 1.0).abs() < 0.02, "{}", y[39_999]);
    }

    #[test]
    fn a_loop_that_loses_its_lock_slips_and_then_dies_away() {
        let (mut draw, stand) = stand(22);
        let y = lock(&mut draw, &stand);
        assert!(y[..1200].iter().all(|v| *v == 0.0));
        let calm = y.windows(2).filter(|w| w[1].abs() > w[0].abs() + 1e-3);
        // It grows while it slips alone: 1.5 s of at most eight events.
        let grows = calm.count();
        assert!((3..8 * 30).contains(&grows), "{grows}");
        let falls = |w: &&[f64]| w[0].abs() > 0.05 && w[1].abs() < w[0].abs();
        assert!(y.windows(2).filter(falls).count() > 3 * 20);
    }

    #[test]
    fn a_room_cools_faster_than_it_warms_and_does_so_again() {
        let (mut draw, stand) = stand(23);
        for _ in 0..5 {
            let y = draught(&mut draw, &stand);
            let up = y.windows(2).filter(|w| w[1] > w[0]).count() as f64 / y.len() as f64;
            assert!(!(0.35..0.65).contains(&up), "{up}");
            let span = swing(&y);
            let turns = y
                .windows(3)
                .filter(|w| (w[1] - w[0]) * (w[2] - w[1]) < 0.0)
                .count();
            // Two a period of 20 to 45 s, some shorter or longer.
            assert!((20..=72).contains(&turns), "{turns}");
            assert!((0.7..=1.0).contains(&span) && largest_change(&y) < 0.2 * span);
        }
    }
}
