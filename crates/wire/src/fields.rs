//! The fields of each payload as they lie on the line.
//!
//! Every number is little endian and has alignment 1, so these structures have no padding on any machine and *are* the
//! bytes of a frame: the board keeps them in place of a second copy, and their layout is checked on the host.

use zerocopy::little_endian::{I16, I32, U16, U32};
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout, Unaligned};

use crate::{Fault, FaultCounts};

/// Sample frame: see [`crate::Sample`].
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable, Unaligned)]
#[repr(C)]
pub struct Sample {
    /// See [`crate::Sample::seq`], and so on.
    pub seq: U16,
    #[allow(missing_docs)]
    pub t_ticks: U32,
    #[allow(missing_docs)]
    pub gyro: [I16; 3],
    #[allow(missing_docs)]
    pub temp: [I16; 3],
    #[allow(missing_docs)]
    pub supply: U16,
    #[allow(missing_docs)]
    pub acc: [U16; 3],
    #[allow(missing_docs)]
    pub pwm: I16,
    #[allow(missing_docs)]
    pub flags: U16,
    #[allow(missing_docs)]
    pub rate: [I32; 3],
}

/// The part of a hello frame that says how the board is set.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, FromBytes, IntoBytes, KnownLayout, Immutable, Unaligned,
)]
#[repr(C)]
#[allow(missing_docs)]
pub struct SetUp {
    pub period_ticks: U16,
    pub baud_divisor: U16,
    pub gyro_range: u8,
    pub gyro_filter: u8,
    pub gyro_sample_period: u8,
    pub acc_range: u8,
    pub config_source: u8,
    pub bias: [I32; 3],
    pub scale: [I32; 3],
    pub periods_per_sample: u8,
}

/// Hello frame: see [`crate::Hello`].
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable, Unaligned)]
#[repr(C)]
#[allow(missing_docs)]
pub struct Hello {
    pub firmware: [u8; 3],
    pub board_id: U16,
    pub reset_cause: u8,
    pub restarts: U16,
    pub next_seq: U16,
    pub tick_ns: U32,
    pub set_up: SetUp,
}

/// Health frame: see [`crate::Health`].
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable, Unaligned)]
#[repr(C)]
#[allow(missing_docs)]
pub struct Health {
    pub uptime_s: U32,
    pub next_seq: U16,
    pub tick_busy_max: U16,
    pub stack_free: U16,
    pub faults: [U16; Fault::COUNT],
}

impl Health {
    /// Counts `times` more of `fault`, or, for a fault that each axis has, of its kin: `fault` is then the one of x.
    #[inline(never)]
    pub fn count(&mut self, fault: Fault, axis: u8, times: u16) {
        // There always is such a counter; asking for it this way keeps a panic out of the image.
        if let Some(count) = self
            .faults
            .get_mut((fault as u8).wrapping_add(axis) as usize)
        {
            count.set(count.get().saturating_add(times));
        }
    }
}

/// Reply frame: see [`crate::Reply`].
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable, Unaligned)]
#[repr(C)]
#[allow(missing_docs)]
pub struct Reply {
    pub number: U16,
    pub command: u8,
    pub status: u8,
    pub value: I32,
    pub detail: [I32; 3],
}

/// Corrected frame: see [`crate::Corrected`].
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable, Unaligned)]
#[repr(C)]
#[allow(missing_docs)]
pub struct Corrected {
    pub seq: U16,
    pub rate: [I32; 3],
    pub bias: [I32; 3],
    pub known: [U16; 3],
    pub correction: U16,
    pub state: u8,
    pub attitude: [I32; 4],
}

impl Corrected {
    /// Bytes of the fields without the attitude: a board of before it ends a frame there.
    pub(crate) const WITHOUT_ATTITUDE: usize = size_of::<Self>() - size_of::<[I32; 4]>();
}

/// Request frame: see [`crate::Request`].
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable, Unaligned)]
#[repr(C)]
#[allow(missing_docs)]
pub struct Request {
    pub number: U16,
    pub command: u8,
    pub arguments: [u8; 8],
}

/// Writes a payload of these fields as it goes on the line; returns the frame's length. `out` has to take it
/// ([`crate::MAX_FRAME`] bytes always do): what does not fit is lost.
pub fn encode(kind: u8, fields: &[u8], out: &mut [u8]) -> usize {
    let len = encode_by(
        kind,
        fields,
        0,
        |at| at.wrapping_add(1),
        |at, byte| {
            if let Some(place) = out.get_mut(usize::from(at)) {
                *place = byte;
            }
        },
    );
    usize::from(len)
}

/// Length on the line of a frame with so many bytes of fields.
#[must_use]
pub const fn frame_len(fields: usize) -> usize {
    2 + fields + crate::OVERHEAD
}

/// Room that a transmit queue must have before a frame with so many bytes of fields goes in. Only a reply may fill it: any
/// other frame leaves room for one, so that a request is answered even where the line is too slow for the rate.
#[must_use]
pub const fn room_for(kind: u8, fields: usize) -> usize {
    if kind == crate::kind::REPLY {
        frame_len(fields)
    } else {
        frame_len(fields) + frame_len(size_of::<Reply>())
    }
}

/// As [`encode`], to places that `after` puts in order, from `first` on; returns the place behind the frame. `put` gets each byte with
/// its place. They come in that order but for the codes of the stuffing, which are written when their block ends.
pub fn encode_by(
    kind: u8,
    fields: &[u8],
    first: u8,
    after: impl Fn(u8) -> u8,
    put: impl FnMut(u8, u8),
) -> u8 {
    crate::cobs::write(kind, fields, first, after, put)
}

impl From<&crate::Sample> for Sample {
    fn from(sample: &crate::Sample) -> Self {
        Sample {
            seq: sample.seq.into(),
            t_ticks: sample.t_ticks.into(),
            gyro: sample.gyro.map(I16::new),
            temp: sample.temp.map(I16::new),
            supply: sample.supply.into(),
            acc: sample.acc.map(U16::new),
            pwm: sample.pwm.into(),
            flags: sample.flags.into(),
            rate: sample.rate.map(I32::new),
        }
    }
}

impl From<&Sample> for crate::Sample {
    fn from(fields: &Sample) -> Self {
        crate::Sample {
            seq: fields.seq.get(),
            t_ticks: fields.t_ticks.get(),
            gyro: fields.gyro.map(I16::get),
            temp: fields.temp.map(I16::get),
            supply: fields.supply.get(),
            acc: fields.acc.map(U16::get),
            pwm: fields.pwm.get(),
            flags: fields.flags.get(),
            rate: fields.rate.map(I32::get),
        }
    }
}

impl From<&crate::Corrected> for Corrected {
    fn from(corrected: &crate::Corrected) -> Self {
        Corrected {
            seq: corrected.seq.into(),
            rate: corrected.rate.map(I32::new),
            bias: corrected.bias.map(I32::new),
            known: corrected.known.map(U16::new),
            correction: corrected.correction.into(),
            state: corrected.state,
            attitude: corrected.attitude.unwrap_or_default().map(I32::new),
        }
    }
}

impl From<&Corrected> for crate::Corrected {
    fn from(fields: &Corrected) -> Self {
        crate::Corrected {
            seq: fields.seq.get(),
            rate: fields.rate.map(I32::get),
            bias: fields.bias.map(I32::get),
            known: fields.known.map(U16::get),
            correction: fields.correction.get(),
            state: fields.state,
            attitude: Some(fields.attitude.map(I32::get)),
        }
    }
}

impl From<&crate::Hello> for Hello {
    fn from(hello: &crate::Hello) -> Self {
        Hello {
            firmware: hello.firmware,
            board_id: hello.board_id.into(),
            reset_cause: hello.reset_cause,
            restarts: hello.restarts.into(),
            next_seq: hello.next_seq.into(),
            tick_ns: hello.tick_ns.into(),
            set_up: SetUp {
                period_ticks: hello.period_ticks.into(),
                baud_divisor: hello.baud_divisor.into(),
                gyro_range: hello.gyro_range,
                gyro_filter: hello.gyro_filter,
                gyro_sample_period: hello.gyro_sample_period,
                acc_range: hello.acc_range,
                config_source: hello.config_source,
                bias: hello.bias.map(I32::new),
                scale: hello.scale.map(I32::new),
                periods_per_sample: hello.periods_per_sample,
            },
        }
    }
}

impl From<&Hello> for crate::Hello {
    fn from(fields: &Hello) -> Self {
        crate::Hello {
            firmware: fields.firmware,
            board_id: fields.board_id.get(),
            reset_cause: fields.reset_cause,
            restarts: fields.restarts.get(),
            next_seq: fields.next_seq.get(),
            tick_ns: fields.tick_ns.get(),
            period_ticks: fields.set_up.period_ticks.get(),
            baud_divisor: fields.set_up.baud_divisor.get(),
            gyro_range: fields.set_up.gyro_range,
            gyro_filter: fields.set_up.gyro_filter,
            gyro_sample_period: fields.set_up.gyro_sample_period,
            acc_range: fields.set_up.acc_range,
            config_source: fields.set_up.config_source,
            bias: fields.set_up.bias.map(I32::get),
            scale: fields.set_up.scale.map(I32::get),
            periods_per_sample: fields.set_up.periods_per_sample,
        }
    }
}

impl From<&crate::Health> for Health {
    fn from(health: &crate::Health) -> Self {
        Health {
            uptime_s: health.uptime_s.into(),
            next_seq: health.next_seq.into(),
            tick_busy_max: health.tick_busy_max.into(),
            stack_free: health.stack_free.into(),
            faults: health.faults.0.map(U16::new),
        }
    }
}

impl From<&Health> for crate::Health {
    fn from(fields: &Health) -> Self {
        crate::Health {
            uptime_s: fields.uptime_s.get(),
            next_seq: fields.next_seq.get(),
            tick_busy_max: fields.tick_busy_max.get(),
            stack_free: fields.stack_free.get(),
            faults: FaultCounts(fields.faults.map(U16::get)),
        }
    }
}

impl From<&crate::Reply> for Reply {
    fn from(reply: &crate::Reply) -> Self {
        Reply {
            number: reply.number.into(),
            command: reply.command,
            status: reply.status as u8,
            value: reply.value.into(),
            detail: reply.detail.map(I32::new),
        }
    }
}

impl Reply {
    /// `None` for a status code that is not in the table.
    pub(crate) fn reply(&self) -> Option<crate::Reply> {
        Some(crate::Reply {
            number: self.number.get(),
            command: self.command,
            status: crate::Status::from_code(self.status)?,
            value: self.value.get(),
            detail: self.detail.map(I32::get),
        })
    }
}
