//! EEPROM and watchdog.

const EERIE: u8 = 1 << 3;
const EEMWE: u8 = 1 << 2;
const EEWE: u8 = 1 << 1;
const EERE: u8 = 1;
const WDTOE: u8 = 1 << 4;
const WDE: u8 = 1 << 3;
/// Writing a byte: 8.5 ms of the calibrated oscillator, at 16 MHz.
pub const EEPROM_WRITE: u64 = 136_000;
/// The watchdog's shortest time at 5 V: 16.3 ms, at 16 MHz.
pub const WATCHDOG: u64 = 260_800;
/// Cycles for which a protecting bit holds.
const PROTECTION: u64 = 4;

/// The EEPROM and its registers. Its contents outlive power.
#[derive(Clone, Debug)]
pub struct Eeprom {
    pub bytes: Vec<u8>,
    interrupt: u8,
    address: u16,
    data: u8,
    armed_at: Option<u64>,
    writing: Option<(u16, u8, u64)>,
}

impl Eeprom {
    pub const LEN: usize = 512;

    pub fn new() -> Self {
        Eeprom {
            bytes: vec![0xff; Self::LEN],
            interrupt: 0,
            address: 0,
            data: 0,
            armed_at: None,
            writing: None,
        }
    }

    /// A reset lets a write that has begun end.
    pub fn reset(&mut self) {
        (self.interrupt, self.data, self.armed_at) = (0, 0, None);
    }

    /// Power goes: the byte that was being written holds neither its old value nor, for sure, its new one.
    pub fn power_lost(&mut self, now: u64) {
        if let Some((address, byte, _)) = self.writing.take() {
            // Which bits were erased and programmed by then is as good as random.
            let noise = (now ^ now >> 7).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 56;
            self.bytes[usize::from(address)] = byte ^ noise as u8;
        }
        self.reset();
    }

    pub fn read_control(&self, now: u64) -> u8 {
        let mut value = self.interrupt;
        if self.armed_at.is_some_and(|at| now <= at + PROTECTION) {
            value |= EEMWE;
        }
        if self.writing.is_some() {
            value |= EEWE;
        }
        value
    }

    /// Returns the cycles for which the processor halts.
    pub fn write_control(&mut self, value: u8, now: u64) -> u64 {
        self.interrupt = value & EERIE;
        let armed = self.armed_at.is_some_and(|at| now <= at + PROTECTION);
        if value & EEWE != 0 && armed && self.writing.is_none() {
            self.armed_at = None;
            self.writing = Some((self.address, self.data, now + EEPROM_WRITE));
            return 2;
        }
        if value & EEMWE != 0 && !armed {
            self.armed_at = Some(now);
        }
        if value & EERE != 0 && self.writing.is_none() {
            self.data = self.bytes[usize::from(self.address)];
            return 4;
        }
        0
    }

    pub fn data(&self) -> u8 {
        self.data
    }

    pub fn set_data(&mut self, value: u8) {
        self.data = value;
    }

    pub fn address(&self) -> [u8; 2] {
        self.address.to_le_bytes()
    }

    pub fn set_address(&mut self, which: usize, value: u8) {
        let mut bytes = self.address.to_le_bytes();
        bytes[which] = value;
        self.address = u16::from_le_bytes(bytes) & 0x1ff;
    }

    pub fn next(&self) -> Option<u64> {
        self.writing.map(|(_, _, end)| end)
    }

    pub fn process(&mut self, now: u64) {
        if let Some((address, byte, end)) = self.writing
            && end <= now
        {
            self.bytes[usize::from(address)] = byte;
            self.writing = None;
        }
    }

    pub fn interrupts(&self) -> bool {
        self.interrupt != 0 && self.writing.is_none()
    }
}

/// The watchdog.
#[derive(Clone, Copy, Debug, Default)]
pub struct Watchdog {
    control: u8,
    opened_at: Option<u64>,
    since: u64,
}

impl Watchdog {
    pub fn read(&self, now: u64) -> u8 {
        let open = self.opened_at.is_some_and(|at| now <= at + PROTECTION);
        self.control | if open { WDTOE } else { 0 }
    }

    pub fn write(&mut self, value: u8, now: u64) {
        let was_on = self.control & WDE != 0;
        let open = self.opened_at.is_some_and(|at| now <= at + PROTECTION);
        let may_stop = open || !was_on;
        self.control = value & 7 | if may_stop { value & WDE } else { WDE };
        if value & (WDTOE | WDE) == WDTOE | WDE {
            self.opened_at = Some(now);
        }
        if !was_on {
            self.since = now;
        }
    }

    /// The WDR instruction.
    pub fn fed(&mut self, now: u64) {
        self.since = now;
    }

    pub fn next(&self) -> Option<u64> {
        (self.control & WDE != 0).then(|| self.since + (WATCHDOG << (self.control & 7)))
    }
}
