//! Effects of the library that are counted, one row each: at sizes that are certain to show.

use super::{LibraryEffect, Values};
use crate::random::Draw;
use crate::series::one_if;
use crate::stand::{LSB, Stand};

/// A fault as drawn.
pub struct Fault {
    /// Parameters.
    pub values: Values,
    /// Whether this one concerns all channels.
    pub everywhere: bool,
}

/// How one is drawn, on an axis of a stand.
pub type How = fn(&mut Draw, &Stand, usize) -> Fault;
type Row = LibraryEffect<How>;

const fn row(id: u16, cause: &'static str, how: How) -> Row {
    Row::new(id, cause, how)
}

/// The rows, by number.
pub const COUNTED: [Row; 12] = [
    row(200, "base_motion", |d, _, _| {
        let peak = d.by_ratio(1.5, 20.0);
        one(vec![("peak", peak), ("frequency", d.between(0.05, 0.5))])
    }),
    row(201, "outliers", |d, s, a| {
        let count = 1.0 + d.of_many(8) as f64;
        let size = s.white(a).sqrt() * d.between(8.5, 30.0);
        one(vec![("count", count), ("size", size)])
    }),
    row(202, "saturation", |d, s, a| {
        // A rail at 2 to 2.6 sigma, where a sound run of the same length leaves 25 to 270 samples beyond.
        let rail = (s.bias[a] + s.white(a).sqrt() * d.between(2.0, 2.6)) / LSB;
        one(vec![("high", rail.round())])
    }),
    row(203, "coarse_lsb", |d, _, _| {
        one(vec![("missing_bits", 1.0 + d.of_many(3) as f64)])
    }),
    row(204, "stuck_bit", |d, _, _| {
        let (bit, value) = (d.of_many(4) as f64, d.of_many(2) as f64);
        let fraction = d.between(0.15, 1.0);
        one(vec![("bit", bit), ("value", value), ("fraction", fraction)])
    }),
    row(205, "stale_samples", stale),
    row(206, "dropped_samples", |d, _, _| {
        one(vec![("count", 5.0 + d.of_many(60) as f64)])
    })
    .on_all_channels(),
    row(207, "timestamp_jitter", |d, _, _| {
        one(vec![("sigma", d.by_ratio(0.4e-3, 5e-3))])
    })
    .on_all_channels(),
    row(208, "clock_rate", |d, _, _| {
        one(vec![("ppm", d.sign() * d.by_ratio(300.0, 3000.0))])
    })
    .on_all_channels(),
    row(209, "double_rounding", |d, _, _| {
        // Near a half, one or two steps of the file, cells of two widths lie farther apart than the noise reaches: near two it is a
        // bit that is missing.
        let ratio = match d.of_many(3) {
            0 => d.between(0.55, 0.9),
            1 => d.between(1.15, 1.9),
            _ => d.between(2.1, 2.6),
        };
        one(vec![("sensor_step", ratio * LSB), ("file_step", LSB)])
    }),
    row(210, "high_pass", |d, _, _| {
        one(vec![("corner_frequency", d.by_ratio(0.05, 0.8))])
    }),
    row(230, "outliers", |d, s, a| {
        let count = d.by_ratio(3.0, 41.0).floor();
        let size = s.white(a).sqrt() * d.by_ratio(6.0, 8.5);
        one(vec![("count", count), ("size", size)])
    })
    .called("outliers, small"),
];

/// A fault of the row's own channels.
fn one(values: Values) -> Fault {
    Fault {
        values,
        everywhere: false,
    }
}

/// Readings that come again: on one channel, or, where the flags say nothing, on all.
fn stale(draw: &mut Draw, _: &Stand, _: usize) -> Fault {
    let silent = draw.chance(0.5);
    let count = 15.0 + draw.of_many(60) as f64;
    Fault {
        values: vec![("count", count), ("silent", one_if(silent))],
        everywhere: silent,
    }
}
