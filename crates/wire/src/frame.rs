//! What the board says: hello, sample, health, reply.

use zerocopy::{FromBytes, IntoBytes};

use crate::{Health, OVERHEAD, Status, fields, kind};

/// The bits of [`Sample::flags`].
pub mod flags {
    /// Gyro x delivered a sample it had not delivered before (its ND bit).
    pub const NEW_X: u16 = 1 << 0;
    /// Gyro y delivered a new sample.
    pub const NEW_Y: u16 = 1 << 1;
    /// Gyro z delivered a new sample.
    pub const NEW_Z: u16 = 1 << 2;
    /// Gyro x raises its error/alarm bit (EA).
    pub const ERROR_X: u16 = 1 << 3;
    /// Gyro y raises its error/alarm bit.
    pub const ERROR_Y: u16 = 1 << 4;
    /// Gyro z raises its error/alarm bit.
    pub const ERROR_Z: u16 = 1 << 5;
    /// At least one gyro does not answer; its NEW bit is clear, its counts are 0 and mean nothing.
    pub const GYRO_NOT_ANSWERING: u16 = 1 << 6;
    /// At least one accelerometer output reads 0 or 1023.
    pub const ACC_AT_RAIL: u16 = 1 << 7;
    /// At least one tick between the last sample and this one had no sample: the work took too long.
    pub const TICK_OVERRUN: u16 = 1 << 8;
    /// A bias measurement is running; the rates still have the old bias subtracted.
    pub const BIAS_NULL: u16 = 1 << 9;
    /// Reserved, 0: whether the motor turns is in [`Sample::pwm`](crate::Sample::pwm).
    pub const RESERVED_10: u16 = 1 << 10;
    /// A gyro measured its supply outside 4.75 V to 5.25 V.
    pub const SUPPLY_OUT_OF_RANGE: u16 = 1 << 11;
    /// At least one accelerometer channel could not be converted; its counts are 0 and mean nothing.
    pub const ACC_NOT_CONVERTED: u16 = 1 << 12;
    /// At least one gyro is set up differently from what the hello frame says, its set-up is being repaired, or a register of
    /// it was written by hand since.
    pub const GYRO_MISCONFIGURED: u16 = 1 << 13;

    /// What a sample in order reads: three new readings and nothing else.
    pub const IN_ORDER: u16 = NEW_X | NEW_Y | NEW_Z;

    /// [`NEW_X`] and its kin for axis 0, 1, 2.
    #[must_use]
    pub const fn new_data(axis: u8) -> u16 {
        NEW_X.wrapping_shl(axis as u32)
    }

    /// [`ERROR_X`] and its kin for axis 0, 1, 2.
    #[must_use]
    pub const fn error(axis: u8) -> u16 {
        ERROR_X.wrapping_shl(axis as u32)
    }
}

/// The bits of [`Hello::reset_cause`], as the ATmega16 has them in MCUCSR.
pub mod reset_cause {
    /// Power came on.
    pub const POWER_ON: u8 = 1 << 0;
    /// The reset pin was pulled low.
    pub const EXTERNAL: u8 = 1 << 1;
    /// The supply sagged below the brown-out threshold.
    pub const BROWN_OUT: u8 = 1 << 2;
    /// The watchdog ran out. The reboot command ends this way too.
    pub const WATCHDOG: u8 = 1 << 3;
    /// JTAG.
    pub const JTAG: u8 = 1 << 4;
}

/// The bits of [`Corrected::state`].
pub mod correction_state {
    /// The coefficients are applied. Where this bit is clear the gyros are set up otherwise than the correction is for: the rates
    /// mean nothing.
    pub const APPLIED: u8 = 1 << 0;
    /// The bias filter has measured at least once since it was started.
    pub const FILTERED: u8 = 1 << 1;
    /// The stand has been at rest since the present block of the filter began.
    pub const AT_REST: u8 = 1 << 2;
    /// The last block at rest was refused: its mean lay beyond four standard deviations of what the filter expected.
    pub const REFUSED: u8 = 1 << 3;
    /// The noise of an axis has left the range that the model allows, a quarter to four times its variance.
    pub const NOISE_OFF: u8 = 1 << 4;
    /// A gyro's temperature is outside what the model was fitted on.
    pub const EXTRAPOLATED: u8 = 1 << 5;
    /// The sample of this number is not in order, see [`flags`](crate::flags): nor is the corrected rate.
    pub const NOT_IN_ORDER: u8 = 1 << 6;
    /// The attitude is followed. Its tilt is held by the accelerometer at rest; its yaw is from where it began and by the rates
    /// alone: nothing on the board is a reference for it.
    pub const YAW_FREE: u8 = 1 << 7;
}

/// Hello frame: who the board is and how it is set. Sent at start, on request and whenever the set-up has changed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Hello {
    /// Firmware version: major, minor, patch.
    pub firmware: [u8; 3],
    /// Number of the board, from its EEPROM; 0 where none was given.
    pub board_id: u16,
    /// What caused the last reset: bits of [`reset_cause`].
    pub reset_cause: u8,
    /// Resets since power came on, kept over resets; saturates.
    pub restarts: u16,
    /// Sequence number that the next tick's sample will have: 0 in the hello frame of a start.
    pub next_seq: u16,
    /// Length of a timer tick, the unit of [`Sample::t_ticks`], ns.
    pub tick_ns: u32,
    /// Period of the sample timer, timer ticks; a sample is taken at every [`periods_per_sample`](Self::periods_per_sample)-th.
    pub period_ticks: u16,
    /// The USART's UBRR: the line runs at 16 MHz / 16 / (divisor + 1) baud.
    pub baud_divisor: u16,
    /// Gyro range, bits 10:8 of SENS/AVG: 4 for 320 deg/s, 2 for 160 deg/s, 1 for 80 deg/s.
    pub gyro_range: u8,
    /// Gyro filter, bits 2:0 of SENS/AVG: 2^m taps in each of two stages.
    pub gyro_filter: u8,
    /// Gyro sample period, SMPL_PRD.
    pub gyro_sample_period: u8,
    /// Accelerometer range, g-select2 and g-select1 as bits 1 and 0: 0 for 1.5 g, 1 for 2 g, 2 for 4 g, 3 for 6 g.
    pub acc_range: u8,
    /// Where the set-up came from: 0 built in, 1 and 2 the EEPROM's two copies, 3 changed by command since.
    pub config_source: u8,
    /// Bias subtracted from each rate, Q16.16 deg/s.
    pub bias: [i32; 3],
    /// Scale factor of each gyro, Q8.24 deg/s for each count.
    pub scale: [i32; 3],
    /// Periods of the sample timer from sample to sample: 1 but for rates that its 16 bits do not hold.
    pub periods_per_sample: u8,
}

impl Hello {
    /// Bytes of the payload, version and kind included.
    pub const LEN: usize = 2 + size_of::<fields::Hello>();
    /// Bytes on the line.
    pub const FRAME_LEN: usize = Self::LEN + OVERHEAD;
}

/// Sample frame: everything that was measured at one tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sample {
    /// Sequence number: one for every tick since the start, sampled or not; wraps.
    pub seq: u16,
    /// Time of the tick, timer ticks of [`Hello::tick_ns`] since the start; wraps.
    pub t_ticks: u32,
    /// GYRO_OUT of x, y, z, counts.
    pub gyro: [i16; 3],
    /// TEMP_OUT of x, y, z, counts; 0 is 25 degC.
    pub temp: [i16; 3],
    /// SUPPLY_OUT, counts.
    pub supply: u16,
    /// ADC readings of the accelerometer's x, y, z, counts.
    pub acc: [u16; 3],
    /// Motor command at the tick, -255 ..= 255; 0 is off.
    pub pwm: i16,
    /// Bits of [`flags`].
    pub flags: u16,
    /// Rates of x, y, z, scaled and less bias, Q16.16 deg/s.
    pub rate: [i32; 3],
}

impl Sample {
    /// Bytes of the payload, version and kind included.
    pub const LEN: usize = 2 + size_of::<fields::Sample>();
    /// Bytes on the line.
    pub const FRAME_LEN: usize = Self::LEN + OVERHEAD;
}

/// Corrected frame: the rates of the sample of the same number, corrected on the board.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Corrected {
    /// Number of the sample that it belongs to, which comes before it.
    pub seq: u16,
    /// Corrected rates of x, y, z, Q12.20 deg/s.
    pub rate: [i32; 3],
    /// What the bias filter has subtracted in them beside the model's terms, Q12.20 deg/s.
    pub bias: [i32; 3],
    /// How sure the filter is of that bias, in 1/256 of a block: its variance is that of the mean of a block at rest, as the
    /// correction has it, over this; 0: it has measured nothing yet.
    pub known: [u16; 3],
    /// Which correction it is: the number under which it was written.
    pub correction: u16,
    /// Bits of [`correction_state`].
    pub state: u8,
    /// Attitude after this sample, a quaternion w, x, y, z in Q2.30: turns the body's axes into those in which it began, z up.
    /// `None` of a firmware that has none, whose frames are shorter.
    pub attitude: Option<[i32; 4]>,
}

impl Corrected {
    /// Bytes of the payload without an attitude, version and kind included.
    pub const SHORT_LEN: usize = 2 + fields::Corrected::WITHOUT_ATTITUDE;
    /// Bytes of the payload with one.
    pub const LEN: usize = 2 + size_of::<fields::Corrected>();
    /// Bytes on the line.
    pub const FRAME_LEN: usize = Self::LEN + OVERHEAD;
}

/// Reply frame: the one answer to a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reply {
    /// Number of the request.
    pub number: u16,
    /// Code of the command, as the request had it.
    pub command: u8,
    /// What became of it.
    pub status: Status,
    /// What the command returns; 0 where it returns nothing or failed. docs/wire-format.md says which command
    /// returns what.
    pub value: i32,
    /// What the command returns for each axis; 0 where it returns nothing.
    pub detail: [i32; 3],
}

impl Reply {
    /// Bytes of the payload, version and kind included.
    pub const LEN: usize = 2 + size_of::<fields::Reply>();
    /// Bytes on the line.
    pub const FRAME_LEN: usize = Self::LEN + OVERHEAD;
}

/// A frame from the board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Frame {
    /// Who the board is and how it is set.
    Hello(Hello),
    /// What was measured at a tick.
    Sample(Sample),
    /// What went wrong so far.
    Health(Health),
    /// The answer to a request.
    Reply(Reply),
    /// A sample's rates, corrected on the board.
    Corrected(Corrected),
}

impl Frame {
    /// Whether a payload of this kind may be that long; `None` where no frame from the board has the kind.
    pub(crate) const fn is_of_length(kind_byte: u8, len: usize) -> Option<bool> {
        match kind_byte {
            kind::HELLO => Some(len == Hello::LEN),
            kind::SAMPLE => Some(len == Sample::LEN),
            kind::HEALTH => Some(len == Health::LEN),
            kind::REPLY => Some(len == Reply::LEN),
            kind::CORRECTED => Some(len == Corrected::LEN || len == Corrected::SHORT_LEN),
            _ => None,
        }
    }

    /// The fields after version and kind.
    pub(crate) fn read(kind_byte: u8, bytes: &[u8]) -> Option<Self> {
        match kind_byte {
            kind::HELLO => Some(Frame::Hello(Hello::from(
                fields::Hello::ref_from_bytes(bytes).ok()?,
            ))),
            kind::SAMPLE => Some(Frame::Sample(Sample::from(
                fields::Sample::ref_from_bytes(bytes).ok()?,
            ))),
            kind::HEALTH => Some(Frame::Health(Health::from(
                fields::Health::ref_from_bytes(bytes).ok()?,
            ))),
            kind::REPLY => fields::Reply::ref_from_bytes(bytes)
                .ok()?
                .reply()
                .map(Frame::Reply),
            kind::CORRECTED => {
                let mut all = [0; size_of::<fields::Corrected>()];
                all.get_mut(..bytes.len())?.copy_from_slice(bytes);
                let mut corrected = Corrected::from(fields::Corrected::ref_from_bytes(&all).ok()?);
                if bytes.len() == fields::Corrected::WITHOUT_ATTITUDE {
                    corrected.attitude = None;
                }
                Some(Frame::Corrected(corrected))
            }
            _ => None,
        }
    }
}

/// Why a frame was not written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EncodeError {
    /// The buffer takes fewer bytes than the frame has; nothing was written.
    BufferTooSmall {
        /// Bytes the frame has on the line.
        need: usize,
        /// Bytes the buffer takes.
        have: usize,
    },
}

impl core::fmt::Display for EncodeError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            EncodeError::BufferTooSmall { need, have } => {
                write!(f, "the frame has {need} bytes, the buffer takes {have}")
            }
        }
    }
}

impl core::error::Error for EncodeError {}

/// Writes a frame as it goes on the line, delimiter included; returns its length.
///
/// # Errors
/// [`EncodeError::BufferTooSmall`]; [`MAX_FRAME`](crate::MAX_FRAME) bytes are always enough.
pub fn encode(frame: &Frame, out: &mut [u8]) -> Result<usize, EncodeError> {
    match frame {
        Frame::Hello(hello) => write_frame(kind::HELLO, fields::Hello::from(hello).as_bytes(), out),
        Frame::Sample(sample) => {
            write_frame(kind::SAMPLE, fields::Sample::from(sample).as_bytes(), out)
        }
        Frame::Health(health) => {
            write_frame(kind::HEALTH, fields::Health::from(health).as_bytes(), out)
        }
        Frame::Reply(reply) => write_frame(kind::REPLY, fields::Reply::from(reply).as_bytes(), out),
        Frame::Corrected(corrected) => {
            let fields = fields::Corrected::from(corrected);
            let len = match corrected.attitude {
                Some(_) => size_of::<fields::Corrected>(),
                None => fields::Corrected::WITHOUT_ATTITUDE,
            };
            // It is no longer than the fields.
            write_frame(
                kind::CORRECTED,
                fields.as_bytes().get(..len).unwrap_or(&[]),
                out,
            )
        }
    }
}

/// Checks the room, then writes.
pub(crate) fn write_frame(
    kind_byte: u8,
    fields: &[u8],
    out: &mut [u8],
) -> Result<usize, EncodeError> {
    let need = 2 + fields.len() + OVERHEAD;
    if out.len() < need {
        return Err(EncodeError::BufferTooSmall {
            need,
            have: out.len(),
        });
    }
    Ok(fields::encode(kind_byte, fields, out))
}
