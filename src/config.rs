//! What the board is set to, and how it outlives a power cut: two copies in EEPROM, each with a generation and a
//! CRC, of which the older one is overwritten. A cut at any byte leaves the other.

/// Bytes of one stored copy: format, generation, the fields, CRC-32C.
pub const STORED_LEN: usize = 42;
/// Where the two copies begin. Address 0 is left alone: a known weak spot when power sags.
pub const SLOTS: [u16; 2] = [16, 80];
/// Format of a stored copy; another number is not read.
const FORMAT: u8 = 1;

/// The set-up. The order of its fields is the format of a stored copy.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub struct Config {
    /// Bias, Q16.16 deg/s.
    pub bias: [i32; 3],
    /// Scale, Q8.24 deg/s for each count.
    pub scale: [i32; 3],
    /// The board's number.
    pub board_id: u16,
    /// Time from sample to sample, ticks of 4 us.
    pub period_ticks: u16,
    /// UBRR.
    pub baud_divisor: u16,
    /// Motor ramp, steps a second.
    pub ramp_per_s: u16,
    /// Bits 10:8 of SENS/AVG: 4, 2, 1.
    pub gyro_range: u8,
    /// Bits 2:0 of SENS/AVG.
    pub gyro_filter: u8,
    /// g-select2, g-select1.
    pub acc_range: u8,
    /// Largest motor command.
    pub max_duty: u8,
}

/// 0.07326 deg/s for each count at the 320 deg/s range (data sheet), in Q8.24.
pub const SCALE_320: i32 = 1_229_099;
/// Fastest rate: 256 Hz, the gyro's own.
pub const MIN_PERIOD: u16 = 976;
/// Slowest: 4 Hz; a 16-bit timer of 4 us holds no more than 262 ms.
pub const MAX_PERIOD: u16 = 62_500;

impl Default for Config {
    fn default() -> Self {
        Self {
            board_id: 0,
            period_ticks: 12_500,
            baud_divisor: 25,
            gyro_range: 4,
            gyro_filter: 2,
            acc_range: 0,
            max_duty: 255,
            ramp_per_s: crate::motor::DEFAULT_RAMP_PER_S,
            bias: [0; 3],
            scale: [SCALE_320; 3],
        }
    }
}

impl Config {
    /// SENS/AVG of the gyros.
    #[must_use]
    pub fn sens_avg(&self) -> u16 {
        u16::from(self.gyro_range) << 8 | u16::from(self.gyro_filter)
    }

    /// Whether range and filter are ones that the part has, with the taps that a narrow range demands.
    #[must_use]
    #[inline(never)]
    pub fn gyro_is_valid(range: u8, filter: u8) -> bool {
        match range {
            4 => filter <= 6,
            2 => (2..=6).contains(&filter),
            1 => (4..=6).contains(&filter),
            _ => false,
        }
    }

    /// As it is stored.
    #[inline(never)]
    #[must_use]
    pub fn to_bytes(&self, generation: u8) -> [u8; STORED_LEN] {
        // SAFETY: plain integers in C order, largest first, so without padding; the assertion below holds it to that.
        let fields: &[u8; FIELDS_LEN] = unsafe { &*core::ptr::from_ref(self).cast() };
        let mut bytes = [0; STORED_LEN];
        let mut crc = wire::crc::INIT;
        let body = [FORMAT, generation]
            .into_iter()
            .chain(fields.iter().copied());
        let mut places = bytes.iter_mut();
        for (byte, place) in body.zip(places.by_ref()) {
            *place = byte;
            crc = wire::crc::update(crc, byte);
        }
        for (place, byte) in bytes
            .iter_mut()
            .rev()
            .zip(wire::crc::finish(crc).to_be_bytes())
        {
            *place = byte;
        }
        bytes
    }

    /// From what is stored, with its generation; `None` when format, CRC or a field is not in order.
    #[inline(never)]
    #[must_use]
    pub fn from_bytes(bytes: &[u8; STORED_LEN]) -> Option<(Self, u8)> {
        let mut crc = wire::crc::INIT;
        for &byte in bytes {
            crc = wire::crc::update(crc, byte);
        }
        let [format, generation, fields @ .., _, _, _, _] = bytes;
        let mut config = Self::default();
        // SAFETY: as above; every pattern of bits is a value of every field.
        let places: &mut [u8; FIELDS_LEN] =
            unsafe { &mut *core::ptr::from_mut(&mut config).cast() };
        *places = *fields;
        let in_order = crc == wire::crc::RESIDUE
            && *format == FORMAT
            && config.period_ticks >= MIN_PERIOD
            && config.period_ticks <= MAX_PERIOD
            && Self::gyro_is_valid(config.gyro_range, config.gyro_filter)
            && config.acc_range <= 3;
        in_order.then_some((config, *generation))
    }
}

/// Bytes of the fields; stored as they lie in memory, little endian on the board and on every host that it is tested on.
const FIELDS_LEN: usize = STORED_LEN - 6;
const _: () = assert!(
    size_of::<Config>() == FIELDS_LEN,
    "no padding between the fields"
);
const _: () = assert!(cfg!(target_endian = "little"));

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_stored_comes_back_and_one_wrong_bit_does_not() {
        let config = Config {
            bias: [1, -2, 3],
            board_id: 7,
            ..Config::default()
        };
        let bytes = config.to_bytes(9);
        assert_eq!(Config::from_bytes(&bytes), Some((config, 9)));
        for bit in 0..STORED_LEN * 8 {
            let mut bad = bytes;
            bad[bit / 8] ^= 1 << (bit % 8);
            assert_eq!(Config::from_bytes(&bad), None, "bit {bit}");
        }
    }

    #[test]
    fn an_erased_eeprom_is_no_configuration() {
        assert_eq!(Config::from_bytes(&[0xff; STORED_LEN]), None);
        assert_eq!(Config::from_bytes(&[0; STORED_LEN]), None);
    }
}
