//! Random streams: one for each part and purpose, all from the scenario's seed.

use rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

/// What a stream is for. The number is part of the seed, so it never changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Stream {
    GyroNoise(u8),
    GyroBias(u8),
    GyroPart(u8),
    GyroFault(u8),
    AccNoise,
    AccPart,
    Thermal,
    Supply,
    Base,
    Motor,
    Draw,
    Link,
    Common,
}

impl Stream {
    /// Generator of this stream in the world of `seed`.
    #[must_use]
    pub fn of(self, seed: u64) -> Xoshiro256PlusPlus {
        let tag = match self {
            Stream::GyroNoise(axis) => 0x10 + u64::from(axis),
            Stream::GyroBias(axis) => 0x20 + u64::from(axis),
            Stream::GyroPart(axis) => 0x30 + u64::from(axis),
            Stream::GyroFault(axis) => 0x40 + u64::from(axis),
            Stream::AccNoise => 0x50,
            Stream::AccPart => 0x51,
            Stream::Thermal => 0x60,
            Stream::Supply => 0x61,
            Stream::Base => 0x62,
            Stream::Motor => 0x63,
            Stream::Draw => 0x70,
            Stream::Link => 0x71,
            Stream::Common => 0x72,
        };
        // An odd multiplier keeps different tags apart for every seed; seed_from_u64 mixes the rest (SplitMix64).
        Xoshiro256PlusPlus::seed_from_u64(seed ^ tag.wrapping_mul(0x9e37_79b9_7f4a_7c15))
    }
}

/// A draw from N(0, 1).
pub fn standard_normal(rng: &mut Xoshiro256PlusPlus) -> f64 {
    StandardNormal.sample(rng)
}

/// A draw from U[low, high).
pub fn uniform(rng: &mut Xoshiro256PlusPlus, low: f64, high: f64) -> f64 {
    use rand_core::Rng;
    // 53 random bits fill the mantissa.
    let unit = (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
    low + (high - low) * unit
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_core::Rng;

    /// A stream's number is part of what a seed means: recorded seeds replay only while it stays.
    #[test]
    fn each_stream_has_its_number_for_ever() {
        let all = [
            (Stream::GyroNoise(0), 0x10),
            (Stream::GyroNoise(2), 0x12),
            (Stream::GyroBias(1), 0x21),
            (Stream::GyroPart(1), 0x31),
            (Stream::GyroFault(1), 0x41),
            (Stream::GyroFault(0x82), 0xc2),
            (Stream::AccNoise, 0x50),
            (Stream::AccPart, 0x51),
            (Stream::Thermal, 0x60),
            (Stream::Supply, 0x61),
            (Stream::Base, 0x62),
            (Stream::Motor, 0x63),
            (Stream::Draw, 0x70),
            (Stream::Link, 0x71),
            (Stream::Common, 0x72),
        ];
        for (stream, tag) in all {
            let seed = 99 ^ 0x9e37_79b9_7f4a_7c15u64.wrapping_mul(tag);
            let mut wanted = Xoshiro256PlusPlus::seed_from_u64(seed);
            assert_eq!(stream.of(99).next_u64(), wanted.next_u64(), "{stream:?}");
        }
    }

    #[test]
    fn uniform_draws_fill_their_range_evenly() {
        let rng = &mut Stream::Draw.of(4);
        let draws: Vec<f64> = (0..10_000).map(|_| uniform(rng, -3.0, 5.0)).collect();
        assert!(draws.iter().all(|x| (-3.0..5.0).contains(x)));
        let mean = draws.iter().sum::<f64>() / 10_000.0;
        let square = draws.iter().map(|x| (x - 1.0).powi(2)).sum::<f64>() / 10_000.0;
        // 8 / sqrt(12) about 1; the mean of 10 000 is known to 0.023.
        assert!((mean - 1.0).abs() < 0.1, "{mean}");
        assert!((square / (64.0 / 12.0) - 1.0).abs() < 0.05, "{square}");
    }
}
