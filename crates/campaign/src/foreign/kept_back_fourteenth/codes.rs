//! The fourteenth set's laws that act on what is read.

use super::super::Foreign;
use super::super::kept_back_ninth::codes::by_chance;
use super::super::kept_back_sixth::codes::mean_and_sigma;
use crate::random::Draw;
use crate::stand::Stand;

/// One of them; `None` for another name.
pub(super) fn one(
    draw: &mut Draw,
    stand: &Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
) -> Option<Foreign> {
    Some(match name {
        "output stage that slews softly" => {
            by_chance(stand, name, axis, wanted, slewing(draw, stand, axis))
        }
        "filter that smooths small changes" => {
            by_chance(stand, name, axis, wanted, smoothing(draw, stand, axis))
        }
        _ => return None,
    })
}

/// An output stage whose input pair can steer so much current and no more: small changes come out whole, and large ones
/// the less, by the pair's tanh. So it is in the frames in which something else loads it.
pub(in super::super) fn slewing(
    draw: &mut Draw,
    stand: &Stand,
    axis: usize,
) -> impl Fn(i32, i32) -> i32 + use<> {
    let (_, sigma) = mean_and_sigma(stand, axis);
    let most = sigma * draw.between(0.3, 1.0);
    move |before, code| {
        let change = f64::from(code - before);
        before + (most * (change / most).tanh()).round() as i32
    }
}

/// Firmware that smooths what changes little and lets through what changes by more than a gate; where its time runs short,
/// the reading goes out as it is.
pub(in super::super) fn smoothing(
    draw: &mut Draw,
    stand: &Stand,
    axis: usize,
) -> impl Fn(i32, i32) -> i32 + use<> {
    let (_, sigma) = mean_and_sigma(stand, axis);
    let (gate, share) = (sigma * draw.between(0.8, 2.0), draw.between(0.1, 0.4));
    move |before, code| {
        let change = f64::from(code - before);
        if change.abs() < gate {
            before + (share * change).round() as i32
        } else {
            code
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::stand;
    use super::*;
    use crate::stand::LSB;

    #[test]
    fn a_soft_stage_gives_small_changes_whole_and_large_ones_up_to_its_most() {
        let (mut draw, stand) = stand(40);
        let sigma = stand.white(0).sqrt() / LSB;
        for _ in 0..5 {
            let slews = slewing(&mut draw, &stand, 0);
            let most = slews(0, 1000);
            assert!((1.0..sigma + 1.0).contains(&f64::from(most)), "{most}");
            assert_eq!([slews(3, 3), slews(0, -1000)], [3, -most]);
            let all: Vec<i32> = (0..40).map(|change| slews(0, change)).collect();
            assert!(all.windows(2).all(|w| w[0] <= w[1]));
        }
    }

    #[test]
    fn a_smoothing_filter_takes_large_changes_whole_and_a_part_of_small_ones() {
        let (mut draw, stand) = stand(41);
        for _ in 0..5 {
            let smooths = smoothing(&mut draw, &stand, 0);
            assert_eq!(
                [smooths(5, 5), smooths(0, 30), smooths(0, -30)],
                [5, 30, -30]
            );
            let small = (1..30).take_while(|c| smooths(0, *c) < *c).count();
            // The gate is 0.8 to 2 sigma, of some five counts.
            assert!((2..14).contains(&small), "{small}");
            assert!(
                (1..=small as i32).all(|c| f64::from(smooths(0, c)) <= 0.4 * f64::from(c) + 0.5)
            );
        }
    }
}
