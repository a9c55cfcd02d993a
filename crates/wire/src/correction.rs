//! The correction that a board applies to its rates: its numbers as they are stored, and the same arithmetic in double
//! precision.
//!
//! With `w` = counts times scale, the board computes, in this order,
//!
//! ```text
//! u = w + bias + temperature T + squared T^2 + motor d + magnitude |d| + turning sign(d) + supply s + sum acc_k a_k
//! v = u + sum_j matrix_j u_j
//! rate = v + surge (d - m) - b
//! ```
//!
//! T being TEMP_OUT, d the motor command, m what the motor has turned to, m <- m + follow (d - m)
//! after each sample, s SUPPLY_OUT and a the ADC counts; b is what the bias filter has found, a scalar Kalman filter for each axis
//! that measures in blocks of samples in which the stand is at rest. Every coefficient is what is *added*: that of an effect with
//! its sign turned.
//!
//! The rates turn a quaternion q, which turns the body's axes into those in which it began. While the stand is at rest, what the
//! accelerometer reads leads the tilt of q to where that is up, at a 66th of the way for each sample at 1.5 g. Nothing leads its
//! yaw.
//!
//! A stored correction is [`NUMBERS`] 16-bit numbers, little endian, written in rows of three, and the CRC-32C of them. Any
//! numbers are safe: no sum of products wraps, whatever they are.
//!
//! | place | numbers | unit of one |
//! |---|---|---|
//! | 0 | format and, above it, generation; number of the correction; n: 2^n samples in a block of the filter, n <= 7 | |
//! | 3 | SENS/AVG of the gyros that it is for | |
//! | 4 | lowest and, above it, highest temperature that it holds for, signed bytes | 4 counts of TEMP_OUT |
//! | 5 | follow: the part by which the motor comes nearer to its command in a sample | 2^-15 |
//! | 6 | of the gyro x: | |
//! | | temperature | 2^-20 deg/s for each count |
//! | | temperature squared | 2^-26 deg/s for each count squared |
//! | | bias, coarse and fine | 2^-10, 2^-20 deg/s |
//! | | motor, with the command's sign and by its magnitude | 2^-20 deg/s for each step of 255 |
//! | | motor, as soon as it turns, with the command's sign | 2^-13 deg/s |
//! | | supply | 2^-20 deg/s for each count |
//! | | acc x, y, z | 2^-20 deg/s for each count |
//! | 17, 28 | the same of y, of z | |
//! | 39 | shares of the rates about x, y, z in the rate x; then in y, in z | 2^-18 |
//! | 48 | of x: variance of the mean of a block at rest, unsigned | 2^-18 (deg/s)^2 |
//! | | growth of the bias' variance in a block, over that, unsigned | 2^-24 |
//! | | surge | 2^-20 deg/s for each step of 255 |
//! | 51, 54 | the same of y, of z | |

/// Numbers of a stored correction.
pub const NUMBERS: usize = 57;
/// Rows of three in which they are written; the row behind the last one is their CRC-32C and a 0.
pub const ROWS: usize = NUMBERS / 3;
/// Bytes of the numbers; the CRC-32C comes behind.
pub const NUMBERS_LEN: usize = NUMBERS * 2;
/// Bytes of a stored correction.
pub const STORED_LEN: usize = NUMBERS_LEN + 4;
/// Format of a stored correction, the low byte of its first number. Another one is not read.
pub const FORMAT: u8 = 2;
/// Terms of each axis.
pub const TERMS: usize = 11;

/// Counts of TEMP_OUT in a step of the range of temperatures.
pub const RANGE_STEP: i16 = 4;
/// ADC counts of the accelerometer at 0 g, as the attitude takes them: half of AREF.
pub const ACC_ZERO: i16 = 512;
/// The attitude is followed over samples that are this many ticks of 4 us apart at the most: 100 ms, in which a gyro turns by less
/// than the radian that its arithmetic is for.
pub const LONGEST_TICKS: u16 = 25_000;
/// Most samples in a block of the bias filter, as a power of two.
pub const BLOCK_SHIFT_MAX: u8 = 7;
/// A rate further from the filter's bias than this is no bias, deg/s.
pub const REST_DPS: i32 = 4;
/// A block's mean may lie that many standard deviations off what the filter expects, as a power of two: 4 sigma.
pub const GATE_SHIFT: u8 = 2;
/// The measured noise follows over 2^5 blocks.
pub const ADAPT_SHIFT: u8 = 5;
/// The noise may be a fourth to four times what was told, as a variance and as a power of two.
pub const NOISE_SHIFT: u8 = 2;
/// What the filter knows is counted in 1/256 of a block, and is below 2^16 of them: its gain is 1/256 at the least.
pub const KNOWN_MAX: f64 = 65_535.0 / 256.0;

/// The numbers as they are stored.
pub type Numbers = [i16; NUMBERS];

/// Unit of `follow`.
const FOLLOW_STEP: f64 = 1.0 / (1 << 15) as f64;
const OF_AXES: usize = 6;
const MATRIX: usize = OF_AXES + 3 * TERMS;
const FILTER: usize = MATRIX + 9;

/// A correction in physical units. Arrays of three are x, y, z.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Correction {
    /// Its number, which corrected frames tell.
    pub number: u16,
    /// One more than the one before, wrapping.
    pub generation: u8,
    /// 2^n samples in a block of the filter.
    pub block_shift: u8,
    /// SENS/AVG that it is for.
    pub sens_avg: u16,
    /// TEMP_OUT of what it was fitted on, in steps of [`RANGE_STEP`].
    pub temp_range: [i8; 2],
    /// deg/s.
    pub bias: [f64; 3],
    /// deg/s for each count.
    pub temperature: [f64; 3],
    /// deg/s for each count squared.
    pub temperature_squared: [f64; 3],
    /// deg/s for each step of the command.
    pub motor: [f64; 3],
    /// deg/s for each step of the command's magnitude.
    pub motor_magnitude: [f64; 3],
    /// deg/s, with the command's sign, whatever its magnitude: what friction takes.
    pub motor_turning: [f64; 3],
    /// deg/s for each count.
    pub supply: [f64; 3],
    /// deg/s for each count: on the rate x, of acc x, y, z; then on y, on z.
    pub acc: [[f64; 3]; 3],
    /// 1: in the rate x, of the rates about x, y, z; then in y, in z.
    pub matrix: [[f64; 3]; 3],
    /// (deg/s)^2.
    pub noise: [f64; 3],
    /// (deg/s)^2.
    pub walk: [f64; 3],
    /// 1: of what the command is ahead of the motor, in a sample.
    pub follow: f64,
    /// deg/s for each step that the command is ahead.
    pub surge: [f64; 3],
}

/// A number that its 16 bits do not hold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OutOfRange {
    /// Its place.
    pub place: usize,
    /// The value, in physical units.
    pub value: f64,
    /// The largest magnitude that there is room for.
    pub most: f64,
}

impl core::fmt::Display for OutOfRange {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let (axis, name, unit) = name(self.place);
        write!(
            f,
            "{name} of gyro {axis}: {:.6} {unit} is outside what the board holds, {:.6}",
            self.value, self.most
        )
    }
}

impl core::error::Error for OutOfRange {}

/// What a number says, for people: axis, name, unit. Empty for the header's.
#[must_use]
pub fn name(place: usize) -> (char, &'static str, &'static str) {
    const OF_AXIS: [(&str, &str); TERMS] = [
        ("temperature", "deg/s/count"),
        ("temperature squared", "deg/s/count^2"),
        ("bias", "deg/s"),
        ("bias, fine part", "deg/s"),
        ("motor", "deg/s/step"),
        ("motor by magnitude", "deg/s/step"),
        ("motor as it turns", "deg/s"),
        ("supply", "deg/s/count"),
        ("acc x", "deg/s/count"),
        ("acc y", "deg/s/count"),
        ("acc z", "deg/s/count"),
    ];
    const SHARES: [(&str, &str); 3] = [
        ("share of rate x", ""),
        ("share of rate y", ""),
        ("share of rate z", ""),
    ];
    const OF_FILTER: [(&str, &str); 3] = [
        ("noise of a block", "(deg/s)^2"),
        ("walk of the bias in a block, over that", ""),
        ("motor, while it spins up", "deg/s/step"),
    ];
    let (from, of): (usize, &[(&str, &str)]) = match place {
        OF_AXES..MATRIX => (OF_AXES, &OF_AXIS),
        MATRIX..FILTER => (MATRIX, &SHARES),
        FILTER..NUMBERS => (FILTER, &OF_FILTER),
        // The header's, and none.
        _ => return (' ', "", ""),
    };
    let at = place - from;
    let (name, unit) = of[at % of.len()];
    (char::from(b"xyz"[at / of.len()]), name, unit)
}

/// What a number is a multiple of; 0 for the header's.
#[must_use]
pub const fn step(place: usize) -> f64 {
    let bits = match place {
        OF_AXES..MATRIX => match (place - OF_AXES) % TERMS {
            1 => 26,
            2 => 10,
            6 => 13,
            _ => 20,
        },
        MATRIX..FILTER => 18,
        FILTER..NUMBERS => match (place - FILTER) % 3 {
            0 => 18,
            1 => 24,
            _ => 20,
        },
        _ => return 0.0,
    };
    1.0 / (1u64 << bits) as f64
}

/// Whether a number has no sign: the variances.
const fn is_unsigned(place: usize) -> bool {
    place >= FILTER && (place - FILTER) % 3 < 2
}

/// To the nearest, halves away from zero. (`core` has no `round`.)
fn nearest(x: f64) -> i32 {
    (if x < 0.0 { x - 0.5 } else { x + 0.5 }) as i32
}

impl Correction {
    /// The values in the order of their places, from that of the first axis on; the fine bias is what the coarse one leaves.
    fn values(&self) -> [f64; NUMBERS] {
        let mut all = [0.0; NUMBERS];
        for axis in 0..3 {
            let bias = self.bias[axis];
            let coarse_step = step(OF_AXES + 2);
            let coarse = f64::from(nearest(bias / coarse_step)) * coarse_step;
            let of_axis = [
                self.temperature[axis],
                self.temperature_squared[axis],
                coarse,
                bias - coarse,
                self.motor[axis],
                self.motor_magnitude[axis],
                self.motor_turning[axis],
                self.supply[axis],
                self.acc[axis][0],
                self.acc[axis][1],
                self.acc[axis][2],
            ];
            all[OF_AXES + TERMS * axis..][..TERMS].copy_from_slice(&of_axis);
            all[MATRIX + 3 * axis..][..3].copy_from_slice(&self.matrix[axis]);
            let walk = if self.walk[axis] == 0.0 {
                0.0
            } else {
                self.walk[axis] / self.noise[axis]
            };
            let of_filter = [self.noise[axis], walk, self.surge[axis]];
            all[FILTER + 3 * axis..][..3].copy_from_slice(&of_filter);
        }
        all
    }

    /// As it is stored.
    ///
    /// # Errors
    /// [`OutOfRange`] for the first number that its 16 bits do not hold, or that is none.
    pub fn numbers(&self) -> Result<Numbers, OutOfRange> {
        let mut all = [0; NUMBERS];
        all[..OF_AXES].copy_from_slice(&[
            i16::from_le_bytes([FORMAT, self.generation]),
            self.number.cast_signed(),
            self.block_shift.min(BLOCK_SHIFT_MAX).into(),
            self.sens_avg.cast_signed(),
            i16::from_le_bytes(self.temp_range.map(i8::cast_unsigned)),
            nearest(self.follow.clamp(0.0, 1.0) / FOLLOW_STEP).min(i16::MAX.into()) as i16,
        ]);
        for (place, value) in self.values().into_iter().enumerate().skip(OF_AXES) {
            let unsigned = is_unsigned(place);
            let largest = if unsigned {
                u16::MAX.into()
            } else {
                i32::from(i16::MAX)
            };
            let most = f64::from(largest) * step(place);
            let least = if unsigned { 0.0 } else { -most };
            if !(least..=most).contains(&value) {
                return Err(OutOfRange { place, value, most });
            }
            all[place] = nearest(value / step(place)) as u16 as i16;
        }
        Ok(all)
    }

    /// What is stored; `None` for another format.
    #[must_use]
    pub fn from_numbers(all: &Numbers) -> Option<Self> {
        let [format, generation] = all[0].to_le_bytes();
        if format != FORMAT {
            return None;
        }
        let value = |place: usize| {
            let number = all[place];
            let whole = if is_unsigned(place) {
                f64::from(number.cast_unsigned())
            } else {
                f64::from(number)
            };
            whole * step(place)
        };
        let of_axes = |k: usize| [0, 1, 2].map(|axis| value(OF_AXES + TERMS * axis + k));
        let of_filter = |k: usize| [0, 1, 2].map(|axis| value(FILTER + 3 * axis + k));
        let (coarse, fine) = (of_axes(2), of_axes(3));
        Some(Self {
            number: all[1].cast_unsigned(),
            generation,
            block_shift: all[2].to_le_bytes()[0] & BLOCK_SHIFT_MAX,
            sens_avg: all[3].cast_unsigned(),
            temp_range: all[4].to_le_bytes().map(u8::cast_signed),
            bias: [0, 1, 2].map(|axis| coarse[axis] + fine[axis]),
            temperature: of_axes(0),
            temperature_squared: of_axes(1),
            motor: of_axes(4),
            motor_magnitude: of_axes(5),
            motor_turning: of_axes(6),
            supply: of_axes(7),
            acc: [0, 1, 2].map(|axis| [8, 9, 10].map(|k| value(OF_AXES + TERMS * axis + k))),
            matrix: [0, 1, 2].map(|axis| [0, 1, 2].map(|j| value(MATRIX + 3 * axis + j))),
            noise: of_filter(0),
            walk: [0, 1, 2].map(|axis| value(FILTER + 3 * axis) * value(FILTER + 3 * axis + 1)),
            follow: f64::from(all[5]) * FOLLOW_STEP,
            surge: of_filter(2),
        })
    }
}

/// The bytes of the numbers.
#[must_use]
pub fn bytes(all: &Numbers) -> [u8; NUMBERS_LEN] {
    let mut out = [0; NUMBERS_LEN];
    for (pair, n) in out.chunks_exact_mut(2).zip(all) {
        pair.copy_from_slice(&n.to_le_bytes());
    }
    out
}

/// The row that ends a stored correction: its CRC-32C and a 0.
#[must_use]
pub fn crc_row(all: &Numbers) -> [i16; 3] {
    let [a, b, c, d] = crate::crc::crc32c(&bytes(all)).to_le_bytes();
    [i16::from_le_bytes([a, b]), i16::from_le_bytes([c, d]), 0]
}

/// A block that lies this much off, over the variance that was told, says no more of the noise.
pub const REACH: f64 = 127.996;

mod twin;

pub use twin::{Axis, Inputs, Twin};

#[cfg(test)]
mod tests;
