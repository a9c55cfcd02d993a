//! The ADIS16250 at its pins: SPI mode 3, 16-bit frames, the reply one frame after its command.
//!
//! Data sheet ADIS16250/ADIS16255 Rev. B (register map, frames, output words); STATUS, COMMAND and MSC_CTRL bits as the
//! Linux staging driver of the sibling ADIS16251 has them. Not modelled: alarms (their registers only store), GPIO,
//! the auxiliary DAC.

/// Even byte addresses of the registers.
#[allow(missing_docs)]
pub mod register {
    pub const ENDURANCE: u8 = 0x00;
    pub const SUPPLY_OUT: u8 = 0x02;
    pub const GYRO_OUT: u8 = 0x04;
    pub const AUX_ADC: u8 = 0x0a;
    pub const TEMP_OUT: u8 = 0x0c;
    pub const ANGL_OUT: u8 = 0x0e;
    pub const GYRO_OFF: u8 = 0x14;
    pub const GYRO_SCALE: u8 = 0x16;
    pub const ALM_MAG1: u8 = 0x20;
    pub const ALM_CTRL: u8 = 0x28;
    pub const AUX_DAC: u8 = 0x30;
    pub const GPIO_CTRL: u8 = 0x32;
    pub const MSC_CTRL: u8 = 0x34;
    pub const SMPL_PRD: u8 = 0x36;
    pub const SENS_AVG: u8 = 0x38;
    pub const SLP_CNT: u8 = 0x3a;
    pub const STATUS: u8 = 0x3c;
    pub const COMMAND: u8 = 0x3e;
}

/// Bits of STATUS.
#[allow(missing_docs)]
pub mod status {
    pub const SUPPLY_LOW: u16 = 1 << 0;
    pub const SUPPLY_HIGH: u16 = 1 << 1;
    pub const UPDATE_FAILED: u16 = 1 << 2;
    pub const SPI_FAILURE: u16 = 1 << 3;
    pub const OVERRANGE: u16 = 1 << 4;
    pub const SELF_TEST_FAILED: u16 = 1 << 5;
}

use register as reg;

const NEW_DATA: u16 = 1 << 15;
const ERROR_ALARM: u16 = 1 << 14;
/// Start-up and reset, s.
const START_UP_S: f64 = 0.165;
const SELF_TEST_S: f64 = 0.025;
const FLASH_S: f64 = 0.05;
/// The registers that flash keeps.
const KEPT: [u8; 11] = [
    0x14, 0x16, 0x20, 0x22, 0x24, 0x26, 0x28, 0x34, 0x36, 0x38, 0x00,
];
/// What a write can reach, and which bits it changes.
const WRITABLE: [(u8, u16); 13] = [
    (reg::GYRO_OFF, 0x0fff),
    (reg::GYRO_SCALE, 0x0fff),
    (0x20, 0xffff),
    (0x22, 0xffff),
    (0x24, 0x00ff),
    (0x26, 0x00ff),
    (0x28, 0xffff),
    (reg::AUX_DAC, 0x0fff),
    (reg::GPIO_CTRL, 0x0303),
    (reg::MSC_CTRL, 0x0707),
    (reg::SMPL_PRD, 0x00ff),
    (reg::SENS_AVG, 0x0707),
    (reg::SLP_CNT, 0x00ff),
];

/// The output registers after a sample, without their flag bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Outputs {
    /// 14-bit two's complement.
    pub gyro: i16,
    /// 12-bit two's complement.
    pub temp: i16,
    /// 12-bit binary.
    pub supply: u16,
    /// 12-bit binary.
    pub aux: u16,
    /// 14-bit binary.
    pub angle: u16,
}

/// Registers and serial port.
#[derive(Clone, Debug)]
pub struct Adis16250 {
    registers: [u16; 32],
    flash: [u16; 32],
    outputs: Outputs,
    /// ND of SUPPLY, GYRO, AUX, TEMP, ANGL.
    fresh: [bool; 5],
    status: u16,
    selected: bool,
    /// Bytes clocked since the select went low.
    bytes: u32,
    command: u16,
    reply: u16,
    busy_until_s: f64,
    self_test_until_s: Option<f64>,
    /// Added to GYRO_OUT at the next read, counts: a discharge in the output latch.
    glitch: i16,
    /// A stuck line of the output latch: mask and level.
    stuck: Option<(u16, bool)>,
    /// ND reads 1 whether there is a new sample or not.
    flags_lie: bool,
}

impl Adis16250 {
    /// Powered on at 0 s.
    #[must_use]
    pub fn new() -> Self {
        let mut flash = [0; 32];
        flash[usize::from(reg::GYRO_SCALE >> 1)] = 0x0800;
        flash[usize::from(reg::SMPL_PRD >> 1)] = 0x0001;
        flash[usize::from(reg::SENS_AVG >> 1)] = 0x0402;
        Adis16250 {
            registers: flash,
            flash,
            outputs: Outputs::default(),
            fresh: [false; 5],
            status: 0,
            selected: false,
            bytes: 0,
            command: 0,
            reply: 0,
            busy_until_s: START_UP_S,
            self_test_until_s: None,
            glitch: 0,
            stuck: None,
            flags_lie: false,
        }
    }

    /// The chip select's level changes at `t` s. A frame that was not a multiple of 16 clocks sets STATUS bit 3.
    pub fn select(&mut self, selected: bool, t: f64) {
        if self.selected && !selected && !self.bytes.is_multiple_of(2) && t >= self.busy_until_s {
            self.status |= status::SPI_FAILURE;
        }
        self.selected = selected;
        self.bytes = 0;
    }

    /// Whether the chip select is low.
    #[must_use]
    pub fn is_selected(&self) -> bool {
        self.selected
    }

    /// Eight clocks that end at `t` s: takes MOSI, gives MISO. Not selected it leaves the line alone: `None`.
    pub fn transfer(&mut self, mosi: u8, t: f64) -> Option<u8> {
        if !self.selected {
            return None;
        }
        let [high, low] = self.reply.to_be_bytes();
        let first = self.bytes.is_multiple_of(2);
        self.bytes += 1;
        if first {
            self.command = u16::from(mosi) << 8;
            Some(high)
        } else {
            self.command |= u16::from(mosi);
            self.reply = self.execute(self.command, t);
            Some(low)
        }
    }

    /// A whole frame: select, 16 clocks, deselect.
    pub fn frame(&mut self, word: u16, t: f64) -> u16 {
        self.select(true, t);
        let [high, low] = word.to_be_bytes();
        let reply = [high, low].map(|byte| self.transfer(byte, t).unwrap_or(0xff));
        self.select(false, t);
        u16::from_be_bytes(reply)
    }

    fn execute(&mut self, word: u16, t: f64) -> u16 {
        if t < self.busy_until_s {
            return 0;
        }
        let address = (word >> 8) as u8 & 0x3f;
        match word >> 14 {
            0b00 => self.read(address & !1),
            0b10 => {
                self.write(address, word as u8, t);
                0
            }
            _ => 0,
        }
    }

    fn read(&mut self, address: u8) -> u16 {
        let error = if self.status != 0 { ERROR_ALARM } else { 0 };
        let mut output = |slot: usize, data: u16| {
            let new = if self.fresh[slot] || self.flags_lie {
                NEW_DATA
            } else {
                0
            };
            self.fresh[slot] = false;
            new | error | data
        };
        // Bits 13:12 of the 12-bit registers are "don't care"; bit 12 is set so that a reader has to mask them.
        match address {
            reg::SUPPLY_OUT => output(0, 0x1000 | (self.outputs.supply & 0x0fff)),
            reg::GYRO_OUT => {
                let mut data = self
                    .outputs
                    .gyro
                    .saturating_add(std::mem::take(&mut self.glitch));
                data = data.clamp(-8192, 8191);
                if let Some((mask, level)) = self.stuck {
                    let mask = mask as i16;
                    data = if level { data | mask } else { data & !mask };
                }
                output(1, data as u16 & 0x3fff)
            }
            reg::AUX_ADC => output(2, 0x1000 | (self.outputs.aux & 0x0fff)),
            reg::TEMP_OUT => output(3, 0x1000 | (self.outputs.temp as u16 & 0x0fff)),
            reg::ANGL_OUT => output(4, self.outputs.angle & 0x3fff),
            reg::STATUS => std::mem::take(&mut self.status),
            reg::COMMAND => 0,
            _ => self.registers[usize::from(address >> 1)],
        }
    }

    fn write(&mut self, address: u8, data: u8, t: f64) {
        let even = address & !1;
        if even == reg::COMMAND {
            if address == even {
                self.command(data, t);
            }
            return;
        }
        let Some(&(_, bits)) = WRITABLE.iter().find(|(writable, _)| *writable == even) else {
            return;
        };
        let shift = if address == even { 0 } else { 8 };
        let mask = (0x00ff << shift) & bits;
        let value = &mut self.registers[usize::from(even >> 1)];
        *value = (*value & !mask) | ((u16::from(data) << shift) & mask);
        match even {
            reg::MSC_CTRL if *value & (1 << 10) != 0 => {
                self.self_test_until_s = Some(t + SELF_TEST_S);
            }
            reg::SLP_CNT if *value != 0 => {
                self.busy_until_s = t + 0.5 * f64::from(*value);
                *value = 0;
            }
            _ => {}
        }
    }

    fn command(&mut self, bits: u8, t: f64) {
        if bits & (1 << 7) != 0 {
            let flash = self.flash;
            let (glitch, stuck, flags_lie) = (self.glitch, self.stuck, self.flags_lie);
            *self = Adis16250 {
                flash,
                registers: flash,
                glitch,
                stuck,
                flags_lie,
                ..Adis16250::new()
            };
            self.selected = true;
            self.busy_until_s = t + START_UP_S;
            return;
        }
        if bits & (1 << 4) != 0 {
            self.status = 0;
        }
        let mut save = bits & (1 << 3) != 0;
        if bits & (1 << 1) != 0 {
            self.set(reg::GYRO_OFF, 0);
            self.set(reg::GYRO_SCALE, 0x0800);
            save = true;
        }
        if bits & 1 != 0 {
            // Autonull: the offset register counts 0.018315 deg/s, a quarter of the output's count at 320 deg/s.
            let lsb = self.lsb_dps() / 0.018_315;
            let offset = (-f64::from(self.outputs.gyro) * lsb)
                .round()
                .clamp(-2048.0, 2047.0);
            let offset = (offset as i16).wrapping_add(self.offset());
            self.set(reg::GYRO_OFF, offset as u16 & 0x0fff);
            save = true;
        }
        if save {
            let endurance = self.get(reg::ENDURANCE).wrapping_add(1);
            self.set(reg::ENDURANCE, endurance);
            for address in KEPT {
                self.flash[usize::from(address >> 1)] = self.get(address);
            }
            self.busy_until_s = t + FLASH_S;
        }
    }

    /// A register as it stands, without the side effects of a read.
    #[must_use]
    pub fn get(&self, address: u8) -> u16 {
        self.registers[usize::from(address >> 1) & 31]
    }

    fn set(&mut self, address: u8, value: u16) {
        self.registers[usize::from(address >> 1) & 31] = value;
    }

    /// A register's content as an earlier user left it in the part's flash.
    pub fn keep(&mut self, address: u8, value: u16) {
        self.set(address, value);
    }

    /// Bits of STATUS rise; they stay until it is read.
    pub fn raise(&mut self, bits: u16) {
        self.status |= bits;
    }

    /// STATUS as it stands.
    #[must_use]
    pub fn status(&self) -> u16 {
        self.status
    }

    /// GYRO_OFF, sign-extended, in 0.018315 deg/s.
    #[must_use]
    pub fn offset(&self) -> i16 {
        ((self.get(reg::GYRO_OFF) << 4) as i16) >> 4
    }

    /// GYRO_SCALE as a factor.
    #[must_use]
    pub fn scale(&self) -> f64 {
        f64::from(self.get(reg::GYRO_SCALE)) / 2048.0
    }

    /// Full scale, deg/s. Undefined range bits count as 320.
    #[must_use]
    pub fn range_dps(&self) -> f64 {
        match self.get(reg::SENS_AVG) >> 8 & 7 {
            0b001 => 80.0,
            0b010 => 160.0,
            _ => 320.0,
        }
    }

    /// deg/s for each count of GYRO_OUT.
    #[must_use]
    pub fn lsb_dps(&self) -> f64 {
        0.073_26 * self.range_dps() / 320.0
    }

    /// M of the filter: 2^M taps in each stage; at most 6.
    #[must_use]
    pub fn filter(&self) -> u32 {
        u32::from(self.get(reg::SENS_AVG) & 7).min(6)
    }

    /// Nominal sample period, s: TB (NS + 1).
    #[must_use]
    pub fn sample_period_s(&self) -> f64 {
        let period = self.get(reg::SMPL_PRD);
        let base = if period & 0x80 != 0 { 31.0 } else { 1.0 } / 512.0;
        base * f64::from((period & 0x7f) + 1)
    }

    /// Counts that the self-test stimulus adds at the 320-deg/s range.
    #[must_use]
    pub fn stimulus_counts(&self) -> f64 {
        let msc = self.get(reg::MSC_CTRL);
        721.0 * (f64::from(msc >> 8 & 1) - f64::from(msc >> 9 & 1))
    }

    /// Whether the part is starting, sleeping or writing its flash at `t` s.
    #[must_use]
    pub fn is_busy(&self, t: f64) -> bool {
        t < self.busy_until_s
    }

    /// The end of a sample period at `t` s.
    pub fn refresh(&mut self, outputs: Outputs, persistent: u16, t: f64) {
        if self.is_busy(t) {
            return;
        }
        if self.self_test_until_s.is_some_and(|until| t >= until) {
            self.self_test_until_s = None;
            let msc = self.get(reg::MSC_CTRL) & !(1 << 10);
            self.set(reg::MSC_CTRL, msc);
        }
        self.outputs = outputs;
        self.fresh = [true; 5];
        self.status |= persistent;
    }

    /// What the output registers hold.
    #[must_use]
    pub fn outputs(&self) -> Outputs {
        self.outputs
    }

    pub(crate) fn disturb(&mut self, counts: i16) {
        self.glitch = counts;
    }

    pub(crate) fn stick(&mut self, bit: u8, level: bool) {
        self.stuck = Some((1 << bit.min(13), level));
    }

    pub(crate) fn lie_about_new_data(&mut self, lie: bool) {
        self.flags_lie = lie;
    }
}

impl Default for Adis16250 {
    fn default() -> Self {
        Adis16250::new()
    }
}
