//! Records of another sensor: nothing but three gyros, in deg/s.

use model::record::{Axis, Channel, Header, Quantity, Record};

/// A record of the readings of each axis, deg/s; `readings` is asked for x, y and z in that order.
pub fn gyros(rate_hz: f64, mut readings: impl FnMut(usize) -> Vec<f64>) -> Record {
    let channel = |axis: &Axis| Channel {
        name: format!("gyro_{}", ["x", "y", "z"][axis.index()]),
        quantity: Quantity::Gyro,
        axis: Some(*axis),
        unit: "deg/s".into(),
        lsb: None,
        counts: None,
        values: readings(axis.index()),
    };
    Record {
        header: Header {
            rate_hz: Some(rate_hz),
            ..Header::default()
        },
        channels: Axis::ALL.iter().map(channel).collect(),
        ..Record::default()
    }
}
