//! The readings of a gyro with their levels made one, and the motion in them.

use super::*;
use crate::ingest::brief;

/// The readings of a gyro whose levels are made one.
pub(super) struct Still {
    pub(super) given: Vec<f64>,
    pub(super) lost: Vec<usize>,
    /// The lost ones filled, their coefficients, and white noise and a random walk fitted to them.
    pub(super) y: Vec<f64>,
    pub(super) c: Arc<Vec<f64>>,
    pub(super) fit: (Noise, f64),
    pub(super) motion_rms: f64,
}

impl Layout<'_> {
    /// White noise, a random walk and the motion in the readings `given` of a gyro, once their levels are made one.
    fn still(
        &self,
        (given, lost): (&[f64], &[usize]),
        jumps: &Jumps,
        is_rate: bool,
        (guess, rng): (f64, &mut Xoshiro256PlusPlus),
    ) -> Still {
        let lost = [lost, &jumps.on_the_way].concat();
        let given = jumps.levelled(given);
        let (y, c, fit) = self.filled(&given, guess, rng);
        let motion_rms = if is_rate {
            self.motion(&y, &c, &lost, &fit)
        } else {
            0.0
        };
        Still {
            given,
            lost,
            y,
            c,
            fit,
            motion_rms,
        }
    }

    /// The readings of a gyro with their levels made one. Where a few brief events of a base at rest would pass for a motion or for
    /// jumps, they are left out first, and their places are given.
    pub(super) fn levelled(
        &self,
        channel: &Channel,
        (read, lost): (&[f64], &[usize]),
        guess: f64,
        rng: &mut Xoshiro256PlusPlus,
    ) -> (Jumps, Still, Vec<usize>) {
        let (scale, unit) = unit_of(channel);
        let is_rate = unit == "deg/s";
        let step = scale * (channel.lsb).unwrap_or_else(|| smallest_step(few(&channel.values)));
        if self.turns() {
            let still = self.still((read, lost), &Jumps::default(), is_rate, (guess, rng));
            return (Jumps::default(), still, vec![]);
        }
        let jumps = Jumps::of(read, step);
        let still = self.still((read, lost), &jumps, is_rate, (guess, rng));
        let moves = still.motion_rms > MOTION_RMS;
        if self.asks_for_knocks && (moves || jumps.come_back((LONGEST_S * self.rate_hz) as usize)) {
            let events = brief::events(read, self.rate_hz).into_iter().flatten();
            let knocks: Vec<usize> = events.filter(|i| read[*i].is_finite()).collect();
            let mut rest = read.to_vec();
            knocks.iter().for_each(|i| rest[*i] = f64::NAN);
            let jumps = Jumps::of(&rest, step);
            let without = [lost, &knocks].concat();
            let mut still = self.still((&rest, &without), &jumps, is_rate, (guess, rng));
            if !knocks.is_empty() && still.motion_rms <= MOTION_RMS {
                still.lost = [lost, &jumps.on_the_way].concat();
                return (jumps, still, knocks);
            }
        }
        if moves && !jumps.is_empty() {
            // What moves without them moves, and they are part of that.
            let still = self.still((read, lost), &Jumps::default(), is_rate, (guess, rng));
            return (Jumps::default(), still, vec![]);
        }
        (jumps, still, vec![])
    }
}
