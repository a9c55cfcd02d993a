//! The SPI as master.

const SPIE: u8 = 1 << 7;
const SPE: u8 = 1 << 6;
const DORD: u8 = 1 << 5;
const MSTR: u8 = 1 << 4;
const SPIF: u8 = 1 << 7;
const WCOL: u8 = 1 << 6;
const SPI2X: u8 = 1;

/// State of the SPI.
#[derive(Clone, Copy, Debug, Default)]
pub struct Spi {
    control: u8,
    status: u8,
    /// Flags that a read of SPSR has shown: the next access of SPDR clears them.
    shown: u8,
    sending: Option<(u8, u64)>,
    received: u8,
}

impl Spi {
    pub fn read_control(&self) -> u8 {
        self.control
    }

    /// Writes SPCR; `select_low`: SS is an input and low.
    pub fn write_control(&mut self, value: u8, select_low: bool) {
        self.control = value;
        if value & SPE == 0 {
            self.sending = None;
        }
        self.check_select(select_low);
    }

    /// SS as an input that is low takes the bus away: slave, and SPIF set.
    pub fn check_select(&mut self, select_low: bool) {
        if select_low && self.control & (SPE | MSTR) == SPE | MSTR {
            self.control &= !MSTR;
            self.status |= SPIF;
            self.sending = None;
        }
    }

    pub fn read_status(&mut self) -> u8 {
        self.shown = self.status & (SPIF | WCOL);
        self.status
    }

    pub fn write_status(&mut self, value: u8) {
        self.status = self.status & !SPI2X | value & SPI2X;
    }

    fn accessed(&mut self) {
        self.status &= !std::mem::take(&mut self.shown);
    }

    pub fn read_data(&mut self) -> u8 {
        self.accessed();
        self.received
    }

    pub fn write_data(&mut self, value: u8, now: u64) {
        self.accessed();
        if self.sending.is_some() {
            self.status |= WCOL;
        } else if self.control & (SPE | MSTR) == SPE | MSTR {
            self.sending = Some((value, now + 8 * u64::from(self.clock())));
        }
    }

    /// Cycles for each bit.
    pub fn clock(&self) -> u8 {
        [4, 16, 64, 128][usize::from(self.control & 3)] >> (self.status & SPI2X)
    }

    /// CPOL and CPHA.
    pub fn mode(&self) -> u8 {
        self.control >> 2 & 3
    }

    pub fn next(&self) -> Option<u64> {
        self.sending.map(|(_, end)| end)
    }

    /// The byte whose last bit has gone out at `now`, in the order of the wire.
    pub fn process(&mut self, now: u64) -> Option<u8> {
        let (byte, _) = self.sending.filter(|&(_, end)| end <= now)?;
        self.sending = None;
        Some(self.order(byte))
    }

    /// What came back for it.
    pub fn reply(&mut self, byte: u8) {
        self.received = self.order(byte);
        self.status |= SPIF;
    }

    fn order(&self, byte: u8) -> u8 {
        if self.control & DORD == 0 {
            byte
        } else {
            byte.reverse_bits()
        }
    }

    pub fn interrupts(&self) -> bool {
        self.control & SPIE != 0 && self.status & SPIF != 0
    }

    /// The interrupt has been taken.
    pub fn clear(&mut self) {
        self.status &= !SPIF;
    }
}
