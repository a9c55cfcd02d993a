//! A tone whose pitch wanders, followed block by block.
//!
//! A block of readings, turned back by the tone's mean frequency, is A e^(i phase) in white noise. The phase turns by the pitch, whose
//! departures decay to their mean as those of a motor's speed or a mains frequency do: an Ornstein-Uhlenbeck process of a standard
//! deviation and a correlation time, that of R. Kubo, "Note on the stochastic theory of resonance absorption", J. Phys. Soc. Japan 9
//! (1954) 935. An extended Kalman filter in the frame of the predicted phase follows it; its smoother (Rauch, Tung and Striebel, 1965)
//! tells the phase by all blocks, and the same way back with a draw at each block makes a phase that they leave possible.

/// Ends of the pitch's standard deviation over a block, rad: beyond the upper one it leaves the blocks' band.
const PITCH: [f64; 2] = [1e-6, 0.7];
/// Blocks to a correlation time below which the variances are those of a series: the exact ones cancel.
const SERIES: f64 = 0.02;

/// A product of spreads over that of the noise beyond which its logarithm is taken.
const LARGE: f64 = 1e100;

/// What is foreseen of the next block: the exact integral of an Ornstein-Uhlenbeck process (D. T. Gillespie, Phys. Rev. E 54 (1996)
/// 2084).
pub struct Law {
    amplitude: f64,
    keep: f64,
    /// By how much a departure of the pitch turns the phase until the next block.
    turn: f64,
    /// Covariance of what drives phase and pitch: of the phase, of both, of the pitch.
    drive: [f64; 3],
    spread: f64,
    mean: f64,
}

impl Law {
    /// Of an amplitude, and a pitch of a standard deviation (rad per block, within what blocks can tell), a correlation time (blocks)
    /// and a mean (rad per block).
    #[must_use]
    pub fn new(amplitude: f64, spread: f64, time: f64, mean: f64) -> Self {
        let (per, lost) = (time.recip(), -(-time.recip()).exp_m1());
        let keep = 1.0 - lost;
        let of_phase = if per < SERIES {
            per * (2.0 / 3.0 - 0.5 * per)
        } else {
            time * time * (2.0 * per - 2.0 * lost - lost * lost)
        };
        let most = PITCH[1] / (time * lost).sqrt();
        let spread = spread.clamp(PITCH[0], most);
        let square = spread * spread;
        Self {
            amplitude,
            keep,
            turn: time * lost,
            drive: [of_phase, time * lost * lost, lost * (1.0 + keep)].map(|v| v * square),
            spread,
            mean,
        }
    }

    /// Standard deviation of the pitch, rad per block.
    #[must_use]
    pub fn spread(&self) -> f64 {
        self.spread
    }

    /// Variance by which the pitch turns the phase over a block beside what is foreseen, rad^2.
    #[must_use]
    pub fn unforeseen(&self) -> f64 {
        self.drive[0]
    }
}

/// Phase and departure of the pitch, with their covariance (of the phase, of both, of the pitch).
#[derive(Clone, Copy)]
struct Belief {
    phase: f64,
    pitch: f64,
    covariance: [f64; 3],
}

impl Belief {
    fn next(&self, law: &Law) -> Self {
        let (by, [d, e, f]) = (law.turn, law.drive);
        let [a, b, c] = self.covariance;
        Self {
            phase: self.phase + law.mean + by * self.pitch,
            pitch: law.keep * self.pitch,
            covariance: [
                a + 2.0 * by * b + by * by * c + d,
                law.keep * (b + by * c) + e,
                law.keep * law.keep * c + f,
            ],
        }
    }

    /// What of `now` goes for it once the `next` block is known, of which `now` foresees `foreseen`: by the gain of the smoother.
    fn back(now: &Self, foreseen: &Self, law: &Law) -> [[f64; 2]; 2] {
        let by = law.turn;
        let ([a, b, c], [p, q, r]) = (now.covariance, foreseen.covariance);
        let whole = (p * r - q * q).max(f64::MIN_POSITIVE);
        // Covariance of now and next, times the inverse of that of next.
        let rows = [[a + by * b, law.keep * b], [b + by * c, law.keep * c]];
        rows.map(|[x, y]| [(x * r - y * q) / whole, (y * p - x * q) / whole])
    }

    /// It where the next block is `later`, by a gain: with the covariance that this one then has.
    fn given(&self, foreseen: &Self, later: &Self, gain: &[[f64; 2]; 2]) -> Self {
        let off = [later.phase - foreseen.phase, later.pitch - foreseen.pitch];
        let [a, b, c] = self.covariance;
        let ([l, m, n], [p, q, r]) = (later.covariance, foreseen.covariance);
        let less = [l - p, m - q, n - r];
        let moved = |g: &[f64; 2]| g[0] * off[0] + g[1] * off[1];
        let spread = |g: &[f64; 2], h: &[f64; 2]| {
            g[0] * (less[0] * h[0] + less[1] * h[1]) + g[1] * (less[1] * h[0] + less[2] * h[1])
        };
        Self {
            phase: self.phase + moved(&gain[0]),
            pitch: self.pitch + moved(&gain[1]),
            covariance: [
                a + spread(&gain[0], &gain[0]),
                b + spread(&gain[0], &gain[1]),
                c + spread(&gain[1], &gain[1]),
            ],
        }
    }

    /// A draw of it, of two standard normal values; it is certain then.
    fn drawn(&self, [u, v]: [f64; 2]) -> Self {
        let [a, b, c] = self.covariance.map(|v| v.max(0.0));
        let first = a.sqrt();
        let shared = if first > 0.0 { b / first } else { 0.0 };
        Self {
            phase: self.phase + first * u,
            pitch: self.pitch + shared * u + (c - shared * shared).max(0.0).sqrt() * v,
            covariance: [0.0; 3],
        }
    }
}

/// What is read of a tone, or of a multiple of it whose phase is that of the tone times a `ratio`, negative where sampling turns it
/// back: blocks (re, im), each in noise of a variance in either part.
pub struct Reading<'a> {
    /// The ratio.
    pub ratio: f64,
    /// The variance.
    pub variance: f64,
    /// The blocks.
    pub blocks: &'a [[f64; 2]],
}

impl<'a> Reading<'a> {
    /// Of the tone itself.
    #[must_use]
    pub fn of_tone(blocks: &'a [[f64; 2]], variance: f64) -> Self {
        Self {
            ratio: 1.0,
            variance,
            blocks,
        }
    }

    /// What a block tells of a tone of an amplitude: what is believed then, by how many nats it is ahead of noise, and how far it is from
    /// what was believed. Of the nats half the logarithm of `spread`, which it multiplies, is to be taken off.
    fn told(
        &self,
        block: usize,
        believed: Belief,
        amplitude: f64,
        spread: &mut f64,
    ) -> (Belief, f64, [f64; 2]) {
        let [re, im] = self.blocks[block];
        let (a, k, variance) = (amplitude, self.ratio, self.variance);
        let (sin, cos) = (k * believed.phase).sin_cos();
        let turned = [cos * re + sin * im, cos * im - sin * re];
        let [p, q, r] = believed.covariance;
        let moves = a * k;
        let across = moves * moves * p + variance;
        // A phase in doubt shortens what lies along it, by a variance of half the square of its own.
        let doubt = k * k * p;
        let along = variance + 0.5 * (a * doubt).powi(2);
        let short = turned[0] - a * (-0.5 * doubt).exp();
        let nats = 0.5
            * ((re * re + im * im) / variance - turned[1].powi(2) / across - short * short / along);
        *spread *= (across / variance) * (along / variance);
        let gain = [moves * p / across, moves * q / across];
        let told = Belief {
            phase: believed.phase + gain[0] * turned[1],
            pitch: believed.pitch + gain[1] * turned[1],
            covariance: [
                p - gain[0] * moves * p,
                q - gain[0] * moves * q,
                r - gain[1] * moves * q,
            ],
        };
        (
            told,
            nats,
            [turned[1] / across.sqrt(), short / along.sqrt()],
        )
    }
}

/// What one block told.
#[derive(Clone, Copy)]
pub struct Step {
    foreseen: Belief,
    told: Belief,
    /// Across and along the foreseen phase, over their standard deviations, of the first reading.
    pub surprise: [f64; 2],
}

/// Nats by which a law is ahead of noise in some readings, the first of which is of the tone itself; what each block of them tells, by
/// all of them, goes to `seen`.
pub fn follow(readings: &[Reading<'_>], law: &Law, mut seen: impl FnMut(&Step)) -> f64 {
    let a = law.amplitude;
    let Some((first, [re, im])) = readings.first().and_then(|r| Some((r, r.blocks.first()?)))
    else {
        return 0.0;
    };
    let mut now = Belief {
        phase: im.atan2(*re),
        pitch: 0.0,
        covariance: [first.variance / (a * a), 0.0, law.spread * law.spread],
    };
    seen(&Step {
        foreseen: now,
        told: now,
        surprise: [0.0; 2],
    });
    let (mut nats, mut spread) = (0.0, 1.0f64);
    for block in 1..first.blocks.len() {
        let foreseen = now.next(law);
        let mut surprise = [0.0; 2];
        now = foreseen;
        for (i, reading) in readings.iter().enumerate() {
            let (told, ahead, off) = reading.told(block, now, a, &mut spread);
            if i == 0 {
                surprise = off;
            }
            nats += ahead;
            now = told;
            // One logarithm for many blocks: neither factor is below 1.
            if spread > LARGE {
                nats -= 0.5 * spread.ln();
                spread = 1.0;
            }
        }
        seen(&Step {
            foreseen,
            told: now,
            surprise,
        });
    }
    nats -= 0.5 * spread.ln();
    if nats.is_finite() { nats } else { f64::MIN }
}

/// Goes back through the steps from what the last one told, each block made `of` what is left in doubt of it.
fn back(steps: &[Step], law: &Law, mut of: impl FnMut(Belief) -> Belief) -> Vec<(f64, f64)> {
    let mut all = vec![(0.0, 0.0); steps.len()];
    let Some(last) = steps.last() else {
        return all;
    };
    let mut later = of(last.told);
    all[steps.len() - 1] = (later.phase, later.covariance[0]);
    for (i, pair) in steps.windows(2).enumerate().rev() {
        let (now, foreseen) = (&pair[0].told, &pair[1].foreseen);
        let gain = Belief::back(now, foreseen, law);
        later = of(now.given(foreseen, &later, &gain));
        all[i] = (later.phase, later.covariance[0]);
    }
    all
}

/// Phase in every block by all of them, rad, with its variance.
#[must_use]
pub fn smoothed(steps: &[Step], law: &Law) -> Vec<(f64, f64)> {
    back(steps, law, |told| told)
}

/// A phase in every block that they leave possible, of standard `normal` values.
pub fn drawn(steps: &[Step], law: &Law, mut normal: impl FnMut() -> f64) -> Vec<f64> {
    let all = back(steps, law, |told| told.drawn([normal(), normal()]));
    all.into_iter().map(|(phase, _)| phase).collect()
}

#[cfg(test)]
mod tests {
    use rand_core::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    const BLOCKS: usize = 4000;
    const VARIANCE: f64 = 0.5;

    /// Mean square of what readings of these ratios leave in doubt of a phase, in truth and as they say.
    fn off(ratios: &[f64]) -> (f64, f64) {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let law = Law::new(1.0, 0.05, 30.0, 0.0);
        let (mut pitch, mut turned) = (0.0, 0.0);
        let mut phase = vec![];
        for _ in 0..BLOCKS {
            let next = law.keep * pitch + 0.05 * (1.0 - law.keep * law.keep).sqrt() * normal();
            turned += 0.5 * (pitch + next);
            pitch = next;
            phase.push(turned);
        }
        let each = ratios.iter().map(|ratio| {
            let noisy = phase.iter().map(|p| {
                let (sin, cos) = (ratio * p).sin_cos();
                [cos, sin].map(|v| v + VARIANCE.sqrt() * normal())
            });
            noisy.collect::<Vec<[f64; 2]>>()
        });
        let blocks: Vec<Vec<[f64; 2]>> = each.collect();
        let readings = ratios.iter().zip(&blocks).map(|(ratio, blocks)| Reading {
            ratio: *ratio,
            variance: VARIANCE,
            blocks,
        });
        let mut steps = vec![];
        follow(&readings.collect::<Vec<_>>(), &law, |s| steps.push(*s));
        let told = smoothed(&steps, &law);
        let apart = told
            .iter()
            .zip(&phase)
            .map(|((p, _), truth)| (p - truth).powi(2));
        let count = BLOCKS as f64;
        let said = told.iter().map(|(_, v)| v);
        (apart.sum::<f64>() / count, said.sum::<f64>() / count)
    }

    #[test]
    fn more_readings_tell_a_phase_better_and_say_how_well() {
        let cases: [&[f64]; 4] = [&[1.0], &[1.0, 1.0], &[1.0, 2.0], &[1.0, -2.0]];
        let [one, two, octave, folded] = cases.map(off);
        for (truth, said) in [one, two, octave, folded] {
            // A mean of 4000 squares, some twelve of which are told by one another.
            assert!((truth / said - 1.0).abs() < 0.3, "{truth} {said}");
        }
        assert!(two.0 < one.0 && octave.0 < two.0 && folded.0 < two.0);
    }
}
