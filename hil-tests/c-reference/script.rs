// What is round the chip in a session: sensors that answer by a script.

use atmega16_sim::{Board, Pins, Port, Pwm};

const SELECTS: [u8; 3] = [2, 3, 4];
const DIRECTION: u8 = 6;
const TICK_VECTOR: u8 = 6;

/// Registers of a gyro that the script knows.
mod register {
    pub const SUPPLY_OUT: u8 = 0x02;
    pub const GYRO_OUT: u8 = 0x04;
    pub const GYRO_SCALE: u8 = 0x16;
    pub const TEMP_OUT: u8 = 0x0C;
    pub const MSC_CTRL: u8 = 0x34;
    pub const SENS_AVG: u8 = 0x38;
    pub const STATUS: u8 = 0x3C;
}

/// Spreads a number over 64 bits (SplitMix64's finalizer).
pub fn spread(number: u64) -> u64 {
    let mut z = number.wrapping_add(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

struct Gyro {
    registers: [u16; 32],
    /// How often GYRO_OUT was asked for.
    asked: u64,
    /// What the next frame will bring.
    reply: u16,
    frame: u16,
    bytes: u8,
}

impl Default for Gyro {
    fn default() -> Self {
        let mut registers = [0; 32];
        registers[usize::from(register::GYRO_SCALE) / 2] = 0x0800;
        Gyro {
            registers,
            asked: 0,
            reply: 0,
            frame: 0,
            bytes: 0,
        }
    }
}

impl Gyro {
    /// A whole frame has come.
    fn take(&mut self, axis: u64, quiet: bool) {
        let [first, value] = self.frame.to_be_bytes();
        let place = usize::from(first & 0x3F) / 2;
        if first & 0x80 != 0 {
            let mut bytes = self.registers[place].to_le_bytes();
            bytes[usize::from(first & 1)] = value;
            self.registers[place] = u16::from_le_bytes(bytes);
            if first & 0x3E == register::MSC_CTRL {
                // The self-test ends at once; y's fails.
                self.registers[place] &= !0x0400;
                if first & 1 == 1 && value & 4 != 0 && axis == 1 {
                    self.registers[usize::from(register::STATUS) / 2] = 0x0020;
                }
            }
            return;
        }
        let asked_for = first & 0x3E;
        self.asked += u64::from(asked_for == register::GYRO_OUT);
        self.reply = match asked_for {
            register::GYRO_OUT => gyro_word(axis, self.asked, quiet),
            register::TEMP_OUT => 0x8000 | (spread(self.asked << 2 | axis) as u16 & 0x0FFF),
            register::SUPPLY_OUT if self.asked % 64 == 7 => 0x8000 | 2_593,
            register::SUPPLY_OUT if self.asked % 64 == 9 => 0x8000 | 2_867,
            register::SUPPLY_OUT => 0x8000 | (2_594 + (spread(self.asked) % 273) as u16),
            register::STATUS => std::mem::take(&mut self.registers[place]),
            // z does not keep its filter.
            register::SENS_AVG if axis == 2 && self.registers[place] == 0x0204 => 0x0203,
            _ => self.registers[place],
        };
        if matches!(asked_for, register::TEMP_OUT | register::SUPPLY_OUT) {
            self.reply = stuck(axis, self.asked, quiet).unwrap_or(self.reply);
        }
    }
}

/// The level of the line, where it is stuck for a sample: now and then, not when `quiet`.
fn stuck(axis: u64, n: u64, quiet: bool) -> Option<u16> {
    match (spread(n << 8 | axis) >> 40) % 97 {
        0 if !quiet => Some(0x0000),
        1 if !quiet => Some(0xFFFF),
        _ => None,
    }
}

/// Any 14 bits, the extremes among them, now and then stale, in error, or as if the line were stuck; at rest when `quiet`.
fn gyro_word(axis: u64, n: u64, quiet: bool) -> u16 {
    if let Some(level) = stuck(axis, n, quiet) {
        return level;
    }
    let bits = spread(n << 8 | axis);
    let counts = if quiet {
        (bits % 23) as u16 & 0x3FFF
    } else {
        match bits >> 60 {
            0 => 0x1FFF,
            1 => 0x2000,
            _ => bits as u16 & 0x3FFF,
        }
    };
    match (bits >> 40) % 97 {
        2 => counts,
        3 => 0xC000 | counts,
        4 if !quiet => 0x0000,
        5 if !quiet => 0xFFFF,
        _ => 0x8000 | counts,
    }
}

/// What is round the chip.
#[derive(Default)]
pub struct Script {
    gyros: [Gyro; 3],
    selected: [bool; 3],
    /// The stand is at rest, and nothing fails.
    pub quiet: bool,
    converted: [u64; 8],
    /// When the chip's first tick was.
    pub first_tick: Option<u64>,
    /// When the first gyro was selected after each tick.
    pub instants: Vec<u64>,
    ticked: bool,
    /// The board resets: its ticks begin anew, and are not compared with those before.
    pub reset: bool,
    /// Every byte that the image sent.
    pub line: Vec<u8>,
    /// Share of the motor's pulse with its direction, at each change.
    pub motor: Vec<(f64, bool)>,
    pub acc_pins: Vec<u8>,
    /// What the EEPROM held at the end.
    pub eeprom: Vec<u8>,
    reverse: bool,
}

impl Board for Script {
    fn spi_byte(&mut self, _at: u64, mosi: u8, _pins: &Pins) -> u8 {
        let mut miso = 0xFF;
        for (gyro, &selected) in self.gyros.iter_mut().zip(&self.selected) {
            if selected {
                let [high, low] = gyro.reply.to_be_bytes();
                miso = if gyro.bytes == 0 { high } else { low };
                gyro.frame = gyro.frame << 8 | u16::from(mosi);
                gyro.bytes += 1;
            }
        }
        miso
    }

    fn adc_volts(&mut self, _at: u64, channel: u8) -> f64 {
        let n = self.converted[usize::from(channel)];
        self.converted[usize::from(channel)] += 1;
        let bits = spread(n << 16 | u64::from(channel) << 8);
        match bits % 53 {
            0 => 0.0,
            1 => 3.3,
            _ => (bits >> 32) as f64 / 2f64.powi(32) * 3.3,
        }
    }

    fn aref_volts(&self) -> f64 {
        3.3
    }

    fn uart_byte(&mut self, _at: u64, byte: u8, _bit: u64) {
        self.line.push(byte);
    }

    fn pins_changed(&mut self, at: u64, pins: &Pins) {
        for (axis, bit) in SELECTS.into_iter().enumerate() {
            let low = pins.is_low(Port::B, bit);
            if low == self.selected[axis] {
                continue;
            }
            self.selected[axis] = low;
            let gyro = &mut self.gyros[axis];
            if low {
                gyro.bytes = 0;
                if std::mem::take(&mut self.ticked) {
                    self.instants.push(at);
                }
            } else if gyro.bytes == 2 {
                gyro.take(axis as u64, self.quiet);
            }
        }
        let acc = pins.ddr[Port::C as usize];
        if self.acc_pins.last() != Some(&acc) {
            self.acc_pins.push(acc);
        }
        self.reverse = pins.is_high(Port::D, DIRECTION);
    }

    fn motor_changed(&mut self, _at: u64, motor: &Pwm) {
        let now = (motor.high, self.reverse && motor.high > 0.0);
        if self.motor.last() != Some(&now) {
            self.motor.push(now);
        }
    }

    fn interrupt(&mut self, at: u64, vector: u8) {
        if vector == TICK_VECTOR {
            self.first_tick.get_or_insert(at);
            self.ticked = !self.reset;
        }
    }
}
