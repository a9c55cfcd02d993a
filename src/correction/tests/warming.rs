//! A board that warms while the filter learns.

use super::*;

/// A board that warms while it rests and goes on: what follows the temperature is taken off with the reading of the same sample, so
/// that nothing of the warming gets into the bias. Late by 16 samples it would be 0.004 deg/s.
#[test]
fn a_bias_that_follows_a_warming_board_leaves_nothing_in_the_bias_of_a_rest() {
    let slope = 0.015;
    let meant = correction::Correction {
        temperature: [-slope, 0.0, slope],
        ..plain(0.0096)
    };
    let mut board = OnBoard::with(0, &meant.numbers().unwrap());
    let mut random = Random(29);
    let (mut left, mut bias) = ([0.0; 3], [0.0; 3]);
    const SAMPLES: u32 = 1_200;
    for n in 0..SAMPLES {
        // 20 counts (2.9 degC) in a minute, each code for 60 samples.
        let temp = (n / 60) as i16;
        let noise = [0; 3].map(|_| 0.4 * random.normal());
        let rate = [slope, 0.0, -slope].map(|slope| slope * f64::from(temp));
        let rate = [0, 1, 2].map(|k| in_counts(rate[k] + noise[k]));
        let (got, frame) = board.step(&raw(rate, [temp; 3], 2730, [512; 3]), 0);
        for k in 0..3 {
            bias[k] = f64::from(frame.bias[k].get()) / Q20;
            left[k] += (got[k] + bias[k] - noise[k]) / f64::from(SAMPLES);
        }
    }
    // Rounding to counts of 0.073 deg/s, 1200 times: 0.0006 deg/s.
    assert!(left.iter().all(|left| left.abs() < 0.0025), "{left:?}");
    // And the filter's bias is what the noise makes of it: 0.4 deg/s over the root of 1100 samples.
    assert!(bias.iter().all(|bias| bias.abs() < 0.05), "{bias:?}");
}
