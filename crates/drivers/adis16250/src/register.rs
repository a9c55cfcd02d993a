//! The register map and the command words.

/// What can be done with a register.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// It can only be read.
    Read,
    /// It can be read and written.
    ReadWrite,
    /// It can only be written.
    Write,
}

macro_rules! registers {
    ($($(#[$doc:meta])* $name:ident = $address:literal, $access:ident, $default:expr;)*) => {
        /// Every register, by the address of its low byte.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        #[repr(u8)]
        pub enum Register {
            $($(#[$doc])* $name = $address,)*
        }

        impl Register {
            /// All of them, by address.
            #[must_use]
            pub const fn all() -> [Register; [$($address),*].len()] {
                [$(Register::$name),*]
            }

            /// The register with this address; its low or its high byte's, as either reads all 16 bits.
            #[must_use]
            pub const fn from_address(address: u8) -> Option<Self> {
                match address & !1 {
                    $($address => Some(Register::$name),)*
                    _ => None,
                }
            }

            /// Whether it can be read and written.
            #[must_use]
            pub const fn access(self) -> Access {
                match self {
                    $(Register::$name => Access::$access,)*
                }
            }

            /// What it holds after delivery and power-on; `None` where it holds measurements. Only those of GYRO_SCALE,
            /// SMPL_PRD and SENS/AVG are confirmed; the zeros of the others are *unverified*.
            #[must_use]
            pub const fn default_value(self) -> Option<u16> {
                match self {
                    $(Register::$name => $default,)*
                }
            }
        }
    };
}

registers! {
    /// ENDURANCE: how often the flash was written. Plain 16 bits, without new-data and error bits.
    Endurance = 0x00, Read, None;
    /// SUPPLY_OUT: 12 bits, 1.8315 mV each.
    SupplyOut = 0x02, Read, None;
    /// GYRO_OUT: 14 bits, twos complement, 0.07326 deg/s each at the range of 320 deg/s.
    GyroOut = 0x04, Read, None;
    /// AUX_ADC: 12 bits, 0.6105 mV each.
    AuxAdc = 0x0A, Read, None;
    /// TEMP_OUT: 12 bits, twos complement, 0.1453 degC each, 0 at 25 degC.
    TempOut = 0x0C, Read, None;
    /// ANGL_OUT: 14 bits, 0.03663 deg each. Whether it is signed is *unverified*; here it is not.
    AnglOut = 0x0E, Read, None;
    /// GYRO_OFF: 12 bits, twos complement, 0.018315 deg/s each, added to the output.
    GyroOff = 0x14, ReadWrite, Some(0x0000);
    /// GYRO_SCALE: 12 bits, 1/2048 each; 0x0800 is 1.
    GyroScale = 0x16, ReadWrite, Some(0x0800);
    /// ALM_MAG1: threshold of alarm 1, in the format of its source; bit 15 set for "above" (*unverified*).
    AlmMag1 = 0x20, ReadWrite, Some(0x0000);
    /// ALM_MAG2: threshold of alarm 2.
    AlmMag2 = 0x22, ReadWrite, Some(0x0000);
    /// ALM_SMPL1: samples over which alarm 1 watches a rate of change.
    AlmSmpl1 = 0x24, ReadWrite, Some(0x0000);
    /// ALM_SMPL2: samples over which alarm 2 watches a rate of change.
    AlmSmpl2 = 0x26, ReadWrite, Some(0x0000);
    /// ALM_CTRL: what the alarms watch and where they report.
    AlmCtrl = 0x28, ReadWrite, Some(0x0000);
    /// AUX_DAC: 12 bits, 0.6105 mV each; takes effect with [`control::COMMAND_DAC_LATCH`].
    AuxDac = 0x30, ReadWrite, Some(0x0000);
    /// GPIO_CTRL: direction and level of the two digital lines.
    GpioCtrl = 0x32, ReadWrite, Some(0x0000);
    /// MSC_CTRL: self-test and data-ready line.
    MscCtrl = 0x34, ReadWrite, Some(0x0000);
    /// SMPL_PRD: sample period.
    SmplPrd = 0x36, ReadWrite, Some(0x0001);
    /// SENS/AVG: range and digital filter.
    SensAvg = 0x38, ReadWrite, Some(0x0402);
    /// SLP_CNT: sleeps for the count, 0.5 s each.
    SlpCnt = 0x3A, ReadWrite, Some(0x0000);
    /// STATUS: what is wrong. Reading clears it.
    Status = 0x3C, Read, Some(0x0000);
    /// COMMAND: starts what its set bit names.
    Command = 0x3E, Write, None;
}

impl Register {
    /// Address of the low byte; the high byte's is the next one.
    #[must_use]
    pub const fn address(self) -> u8 {
        self as u8
    }
}

/// The 16 bits of a frame from the master.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Command([u8; 2]);

impl Command {
    /// Asks for a register; the reply comes with the next frame.
    #[must_use]
    #[inline]
    pub const fn read(register: Register) -> Self {
        Command([register.address(), 0])
    }

    /// As [`read`](Self::read), by an address that came from outside: a link, a script. `None` where no register that
    /// can be read has it.
    #[must_use]
    #[inline]
    pub const fn read_at(address: u8) -> Option<Self> {
        if has(READABLE, address) {
            Some(Command([address & !1, 0]))
        } else {
            None
        }
    }

    /// Writes one byte by its address, low bytes even, high bytes odd. `None` where no register that can be written
    /// has it.
    #[must_use]
    #[inline]
    pub const fn write_at(address: u8, value: u8) -> Option<Self> {
        if has(WRITABLE, address) {
            Some(Command([0x80 | address, value]))
        } else {
            None
        }
    }

    /// Writes both bytes of a register by its address, the low one first. `None` where no register that can be written has it.
    #[must_use]
    #[inline]
    pub const fn write_word_at(address: u8, value: u16) -> Option<[Self; 2]> {
        if !has(WRITABLE, address) {
            return None;
        }
        let ([low, high], to) = (value.to_le_bytes(), 0x80 | address & !1);
        Some([Command([to, low]), Command([to | 1, high])])
    }

    /// Writes the low byte of a register.
    #[must_use]
    #[inline]
    pub const fn write_low(register: Register, value: u8) -> Self {
        Command([0x80 | register.address(), value])
    }

    /// Writes the high byte of a register.
    #[must_use]
    #[inline]
    pub const fn write_high(register: Register, value: u8) -> Self {
        Command([0x80 | register.address() | 1, value])
    }

    /// The 16 bits.
    #[must_use]
    #[inline]
    pub const fn bits(self) -> u16 {
        u16::from_be_bytes(self.0)
    }

    /// The two bytes in the order of the bus.
    #[must_use]
    #[inline]
    pub const fn bytes(self) -> [u8; 2] {
        self.0
    }
}

/// Whether the register of `address` is in a set that has a bit for each register.
#[cfg_attr(target_arch = "avr", inline(never))]
const fn has(set: u32, address: u8) -> bool {
    address < 0x40 && set >> (address >> 1) & 1 != 0
}

/// A bit for each register that can be read.
const READABLE: u32 = set_without(Access::Write);
/// A bit for each register that can be written.
const WRITABLE: u32 = set_without(Access::Read);

const fn set_without(access: Access) -> u32 {
    let all = Register::all();
    let (mut set, mut at) = (0, 0);
    while at < all.len() {
        if all[at].access() as u8 != access as u8 {
            set |= 1 << (all[at].address() >> 1);
        }
        at += 1;
    }
    set
}

/// Bits of the control registers.
pub mod control {
    /// COMMAND: software reset.
    pub const COMMAND_RESET: u8 = 1 << 7;
    /// COMMAND: clears STATUS (*unverified*).
    pub const COMMAND_CLEAR_STATUS: u8 = 1 << 4;
    /// COMMAND: writes the registers to flash.
    pub const COMMAND_FLASH_UPDATE: u8 = 1 << 3;
    /// COMMAND: AUX_DAC takes effect.
    pub const COMMAND_DAC_LATCH: u8 = 1 << 2;
    /// COMMAND: GYRO_OFF and GYRO_SCALE as delivered.
    pub const COMMAND_FACTORY_RESTORE: u8 = 1 << 1;
    /// COMMAND: GYRO_OFF so that the present output becomes zero.
    pub const COMMAND_AUTONULL: u8 = 1 << 0;

    /// MSC_CTRL: runs the internal self-test; clears itself.
    pub const MSC_SELF_TEST: u16 = 1 << 10;
    /// MSC_CTRL: holds the negative stimulus.
    pub const MSC_STIMULUS_NEGATIVE: u16 = 1 << 9;
    /// MSC_CTRL: holds the positive stimulus.
    pub const MSC_STIMULUS_POSITIVE: u16 = 1 << 8;
    /// MSC_CTRL: data-ready line on.
    pub const MSC_DATA_READY: u16 = 1 << 2;
    /// MSC_CTRL: data-ready line active high.
    pub const MSC_DATA_READY_HIGH: u16 = 1 << 1;
    /// MSC_CTRL: data-ready on DIO1 instead of DIO0.
    pub const MSC_DATA_READY_DIO1: u16 = 1 << 0;

    /// STATUS: alarm 2 is active.
    pub const STATUS_ALARM_2: u16 = 1 << 9;
    /// STATUS: alarm 1 is active.
    pub const STATUS_ALARM_1: u16 = 1 << 8;
    /// STATUS: the self-test failed.
    pub const STATUS_SELF_TEST_FAILED: u16 = 1 << 5;
    /// STATUS: the sensor is beyond its range.
    pub const STATUS_OVERRANGE: u16 = 1 << 4;
    /// STATUS: a frame had not 16 clocks (the cause is *unverified*).
    pub const STATUS_SPI_FAILED: u16 = 1 << 3;
    /// STATUS: the flash was not written.
    pub const STATUS_FLASH_FAILED: u16 = 1 << 2;
    /// STATUS: supply above 5.25 V.
    pub const STATUS_SUPPLY_HIGH: u16 = 1 << 1;
    /// STATUS: supply below 4.75 V.
    pub const STATUS_SUPPLY_LOW: u16 = 1 << 0;

    /// GPIO_CTRL: level of DIO1 (*unverified*).
    pub const GPIO_DIO1_HIGH: u16 = 1 << 9;
    /// GPIO_CTRL: level of DIO0 (*unverified*).
    pub const GPIO_DIO0_HIGH: u16 = 1 << 8;
    /// GPIO_CTRL: DIO1 is an output (*unverified*).
    pub const GPIO_DIO1_OUTPUT: u16 = 1 << 1;
    /// GPIO_CTRL: DIO0 is an output (*unverified*).
    pub const GPIO_DIO0_OUTPUT: u16 = 1 << 0;
}
