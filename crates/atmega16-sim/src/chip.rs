//! Everything of the ATmega16 but its instructions: registers, interrupts, and what happens when.

use crate::converter::Converter;
use crate::memory::{Eeprom, Watchdog};
use crate::pins::{Pins, Port, Pwm};
use crate::spi::Spi;
use crate::timer::{
    CAPTURE, COMPARE_A, COMPARE_B, OVERFLOW, Timer, Unmodelled, divider_01, divider_2,
};
use crate::usart::Usart;
use crate::{ResetCause, register as r};

mod events;

const SPM_ENABLE: u8 = 1;
const SLEEP_ENABLE: u8 = 1 << 6;
const SLEEP_MODES: u8 = 0xb0;
/// INT0: its pin on port D, its bit in GICR and GIFR. MCUCR has how it senses in its two lowest bits; those of INT1 and INT2 may
/// be set freely, for they are not modelled unless enabled in GICR.
const INT0_PIN: u8 = 1 << 2;
const INT0: u8 = 1 << 6;
const INT1_INT2: u8 = 0xa0;

/// Vectors, by number.
mod vector {
    pub const INT0: u8 = 1;
    pub const TIMER2_COMP: u8 = 3;
    pub const TIMER2_OVF: u8 = 4;
    pub const TIMER1_CAPT: u8 = 5;
    pub const TIMER1_COMPA: u8 = 6;
    pub const TIMER1_COMPB: u8 = 7;
    pub const TIMER1_OVF: u8 = 8;
    pub const TIMER0_OVF: u8 = 9;
    pub const SPI_STC: u8 = 10;
    pub const USART_RXC: u8 = 11;
    pub const USART_UDRE: u8 = 12;
    pub const USART_TXC: u8 = 13;
    pub const ADC: u8 = 14;
    pub const EE_RDY: u8 = 15;
    pub const TIMER0_COMP: u8 = 19;
}

/// Bits of TIFR and TIMSK: timer, its flag, and the vector; the bit is the place in the table.
const TIMER_FLAGS: [(usize, u8, u8); 8] = [
    (0, OVERFLOW, vector::TIMER0_OVF),
    (0, COMPARE_A, vector::TIMER0_COMP),
    (1, OVERFLOW, vector::TIMER1_OVF),
    (1, COMPARE_B, vector::TIMER1_COMPB),
    (1, COMPARE_A, vector::TIMER1_COMPA),
    (1, CAPTURE, vector::TIMER1_CAPT),
    (2, OVERFLOW, vector::TIMER2_OVF),
    (2, COMPARE_A, vector::TIMER2_COMP),
];

/// What a write of a register asks of the processor.
#[derive(Clone, Copy, Debug, Default)]
pub struct Effect {
    /// Stop running instructions after this one: what comes next may have changed.
    pub look: bool,
    /// The processor halts for so many cycles.
    pub halt: u64,
}

const LOOK: Effect = Effect {
    look: true,
    halt: 0,
};

pub struct Chip {
    pub timers: [Timer; 3],
    tccr0: u8,
    tccr1: [u8; 2],
    tccr2: u8,
    /// Shared by the 16-bit registers of timer 1.
    temp: u8,
    timsk: u8,
    pub usart: Usart,
    pub adc: Converter,
    pub spi: Spi,
    pub eeprom: Eeprom,
    pub watchdog: Watchdog,
    pub pins: Pins,
    /// Levels that the outside drives: mask and value, for each port.
    outside: [(u8, u8); 4],
    mcucr: u8,
    gicr: u8,
    /// The level at INT0, and the flag of its edges.
    int0_high: bool,
    int0: bool,
    pub mcucsr: u8,
    sfior: u8,
    /// Registers that only hold what is written.
    plain: [u8; 64],
    pub unmodelled: Option<Unmodelled>,
    /// What the board was last told of the pins.
    told: Pins,
    pins_changed: bool,
    motor: Pwm,
}

impl Chip {
    pub fn new() -> Self {
        Chip {
            timers: [255, 65_535, 255].map(|max| Timer::new(max, 0)),
            tccr0: 0,
            tccr1: [0; 2],
            tccr2: 0,
            temp: 0,
            timsk: 0,
            usart: Usart::new(),
            adc: Converter::new(),
            spi: Spi::default(),
            eeprom: Eeprom::new(),
            watchdog: Watchdog::default(),
            pins: Pins::default(),
            outside: [(0, 0); 4],
            mcucr: 0,
            gicr: 0,
            int0_high: false,
            int0: false,
            mcucsr: ResetCause::PowerOn.flag(),
            sfior: 0,
            plain: [0; 64],
            unmodelled: None,
            told: Pins::default(),
            pins_changed: false,
            motor: Pwm::default(),
        }
    }

    /// Registers as a reset leaves them.
    pub fn reset(&mut self, cause: ResetCause, now: u64) {
        self.timers = [255, 65_535, 255].map(|max| Timer::new(max, now));
        (self.tccr0, self.tccr1, self.tccr2) = (0, [0; 2], 0);
        (self.temp, self.timsk) = (0, 0);
        self.usart.reset();
        self.adc = Converter::new();
        self.spi = Spi::default();
        self.watchdog = Watchdog::default();
        (self.mcucr, self.sfior, self.plain) = (0, 0, [0; 64]);
        self.mcucsr = match cause {
            ResetCause::PowerOn => cause.flag(),
            _ => self.mcucsr & 0x1f | cause.flag(),
        };
        if cause == ResetCause::PowerOn {
            self.eeprom.power_lost(now);
        } else {
            self.eeprom.reset();
        }
        self.pins = Pins::default();
        self.pins_changed = true;
        self.gicr = 0;
        self.sense();
        self.int0 = false;
    }

    /// The outside drives pins of a port.
    pub fn drive(&mut self, port: Port, mask: u8, levels: u8) {
        let (driven, value) = &mut self.outside[port as usize];
        *driven |= mask;
        *value = *value & !mask | levels & mask;
        self.sense();
        let low = self.select_is_low();
        self.spi.check_select(low);
    }

    /// The outside lets go of pins.
    pub fn release(&mut self, port: Port, mask: u8) {
        self.outside[port as usize].0 &= !mask;
        self.sense();
        let low = self.select_is_low();
        self.spi.check_select(low);
    }

    /// What the program reads of a port's pins. An input that nobody drives reads its pull-up, without one low.
    fn input(&self, port: Port) -> u8 {
        let at = port as usize;
        let (driven, value) = self.outside[at];
        let pulled = if self.sfior & 1 << 2 == 0 {
            self.pins.port[at]
        } else {
            0
        };
        let input = driven & value | !driven & pulled;
        self.pins.port[at] & self.pins.ddr[at] | input & !self.pins.ddr[at]
    }

    /// INT0 senses its pin, whatever drives it. (The real one takes two or three clocks to notice, and none of a pulse between
    /// two of them.)
    fn sense(&mut self) {
        let high = self.input(Port::D) & INT0_PIN != 0;
        let edge = high != self.int0_high;
        self.int0_high = high;
        self.int0 |= match self.mcucr & 3 {
            1 => edge,
            2 => edge && !high,
            3 => edge && high,
            // A level has no flag.
            _ => false,
        };
    }

    /// Whether INT0 asks for its interrupt.
    fn int0_asks(&self) -> bool {
        let asks = match self.mcucr & 3 {
            0 => !self.int0_high,
            _ => self.int0,
        };
        asks && self.gicr & INT0 != 0
    }

    /// SS is an input, and low.
    fn select_is_low(&self) -> bool {
        const SS: u8 = 1 << 4;
        self.pins.ddr[Port::B as usize] & SS == 0
            && self.outside[Port::B as usize].0 & SS != 0
            && self.input(Port::B) & SS == 0
    }

    fn timer(&mut self, which: usize, now: u64) -> &mut Timer {
        let timer = &mut self.timers[which];
        timer.catch_up(now);
        timer
    }

    fn timer_flags(&mut self, now: u64) -> u8 {
        for timer in &mut self.timers {
            timer.catch_up(now);
        }
        (0..8).fold(0, |bits, bit| {
            let (timer, flag, _) = TIMER_FLAGS[bit];
            bits | u8::from(self.timers[timer].flags & flag != 0) << bit
        })
    }

    /// A register is read; `address` as `in` has it.
    pub fn read(&mut self, address: u8, now: u64) -> u8 {
        match address {
            r::ADCL => self.adc.read_low(),
            r::ADCH => self.adc.read_high(),
            r::ADCSRA => self.adc.read_control(),
            r::ADMUX => self.adc.read_mux(),
            r::UBRRL => self.usart.read_ubrrl(),
            r::UCSRB => self.usart.read_b(),
            r::UCSRA => self.usart.status(),
            r::UDR => self.usart.read_data(),
            r::UCSRC => self.usart.read_shared(now),
            r::SPCR => self.spi.read_control(),
            r::SPSR => self.spi.read_status(),
            r::SPDR => self.spi.read_data(),
            r::EECR => self.eeprom.read_control(now),
            r::EEDR => self.eeprom.data(),
            r::EEARL => self.eeprom.address()[0],
            r::EEARH => self.eeprom.address()[1],
            r::WDTCR => self.watchdog.read(now),
            r::PIND..=r::PORTA => {
                let port = Port::of_register(address);
                match (address - r::PIND) % 3 {
                    0 => self.input(port),
                    1 => self.pins.ddr[port as usize],
                    _ => self.pins.port[port as usize],
                }
            }
            r::TCNT0 => self.timer(0, now).count() as u8,
            r::TCNT2 => self.timer(2, now).count() as u8,
            r::TCNT1L => {
                let [low, high] = self.timer(1, now).count().to_le_bytes();
                self.temp = high;
                low
            }
            r::ICR1L => {
                let [low, high] = self.timers[1].capture().to_le_bytes();
                self.temp = high;
                low
            }
            r::TCNT1H | r::ICR1H => self.temp,
            r::OCR0 => self.timers[0].compare(0) as u8,
            r::OCR2 => self.timers[2].compare(0) as u8,
            r::OCR1AL | r::OCR1AH | r::OCR1BL | r::OCR1BH => {
                let which = usize::from(address < r::OCR1AL);
                self.timers[1].compare(which).to_le_bytes()[usize::from(address & 1)]
            }
            r::TCCR0 => self.tccr0,
            r::TCCR2 => self.tccr2,
            r::TCCR1A => self.tccr1[0],
            r::TCCR1B => self.tccr1[1],
            r::TIMSK => self.timsk,
            r::TIFR => self.timer_flags(now),
            r::SFIOR => self.sfior,
            r::MCUCR => self.mcucr,
            r::GICR => self.gicr,
            r::GIFR => u8::from(self.int0) << 6,
            r::MCUCSR => self.mcucsr,
            _ => self.plain[usize::from(address & 63)],
        }
    }

    /// A register is written; `address` as `out` has it.
    pub fn write(&mut self, address: u8, value: u8, now: u64) -> Effect {
        let done = self.try_write(address, value, now);
        if let Err(what) = done {
            self.unmodelled.get_or_insert(what);
        }
        done.unwrap_or(LOOK)
    }

    fn try_write(&mut self, address: u8, value: u8, now: u64) -> Result<Effect, Unmodelled> {
        match address {
            r::ADCSRA => {
                let was_triggered = self.adc.is_triggered();
                self.adc.write_control(value, now)?;
                if self.adc.is_triggered() {
                    self.check_trigger()?;
                    // A flag that is set already has no edge.
                    if !was_triggered && let Some(at) = self.trigger_rise(now) {
                        self.adc.ignore(at);
                    }
                }
            }
            r::ADMUX => self.adc.write_mux(value),
            r::ADCL | r::ADCH => {}
            r::UBRRL => self.usart.write_ubrrl(value, now),
            r::UCSRB => self.usart.write_b(value, now)?,
            r::UCSRA => self.usart.write_a(value),
            r::UDR => self.usart.write_data(value, now),
            r::UCSRC => self.usart.write_shared(value, now)?,
            r::SPCR => {
                let low = self.select_is_low();
                self.spi.write_control(value, low);
            }
            r::SPSR => self.spi.write_status(value),
            r::SPDR => self.spi.write_data(value, now),
            r::EECR => {
                let halt = self.eeprom.write_control(value, now);
                return Ok(Effect { look: true, halt });
            }
            r::EEDR => self.eeprom.set_data(value),
            r::EEARL | r::EEARH => self
                .eeprom
                .set_address(usize::from(address - r::EEARL), value),
            r::WDTCR => self.watchdog.write(value, now),
            r::PIND..=r::PORTA => {
                let port = Port::of_register(address) as usize;
                match (address - r::PIND) % 3 {
                    // Read only on this chip.
                    0 => return Ok(Effect::default()),
                    1 => self.pins.ddr[port] = value,
                    _ => self.pins.port[port] = value,
                }
                self.pins_changed = true;
                self.sense();
                let low = self.select_is_low();
                self.spi.check_select(low);
            }
            _ => return self.write_timer(address, value, now),
        }
        Ok(LOOK)
    }

    fn write_timer(&mut self, address: u8, value: u8, now: u64) -> Result<Effect, Unmodelled> {
        let word = u16::from_le_bytes([value, self.temp]);
        match address {
            r::TCNT0 => self.timer(0, now).set_count(value.into()),
            r::TCNT2 => self.timer(2, now).set_count(value.into()),
            r::OCR0 => self.timer(0, now).set_compare(0, value.into()),
            r::OCR2 => {
                self.timer(2, now).set_compare(0, value.into());
                self.pins_changed = true;
            }
            r::TCNT1H | r::ICR1H | r::OCR1AH | r::OCR1BH => {
                self.temp = value;
                return Ok(Effect::default());
            }
            r::TCNT1L => self.timer(1, now).set_count(word),
            r::ICR1L => self.timer(1, now).set_capture(word),
            r::OCR1AL => self.timer(1, now).set_compare(0, word),
            r::OCR1BL => self.timer(1, now).set_compare(1, word),
            r::TCCR0 => {
                self.tccr0 = value & 0x7f;
                let timer = self.timer(0, now);
                timer.set_divider(divider_01(value)?);
                timer.set_mode_8((value >> 6 & 1) | (value >> 2 & 2))?;
            }
            r::TCCR2 => {
                self.tccr2 = value & 0x7f;
                self.pins_changed = true;
                let timer = self.timer(2, now);
                timer.set_divider(divider_2(value));
                timer.set_mode_8((value >> 6 & 1) | (value >> 2 & 2))?;
            }
            r::TCCR1A | r::TCCR1B => {
                let which = usize::from(address == r::TCCR1B);
                self.tccr1[which] = value & if which == 0 { 0xf3 } else { 0xdf };
                let [a, b] = self.tccr1;
                let timer = self.timer(1, now);
                timer.set_divider(divider_01(b)?);
                timer.set_mode_16(a & 3 | b >> 1 & 0xc)?;
            }
            r::ASSR if value & 8 != 0 => return Err(Unmodelled("timer 2 on a crystal of its own")),
            r::TIMSK => {
                self.timer_flags(now);
                self.timsk = value;
            }
            r::TIFR => {
                self.timer_flags(now);
                for (bit, (timer, flag, _)) in TIMER_FLAGS.into_iter().enumerate() {
                    if value >> bit & 1 != 0 {
                        self.timers[timer].flags &= !flag;
                    }
                }
            }
            r::SFIOR => {
                self.timer_flags(now);
                if value & 1 != 0 {
                    self.timers[0].reset_prescaler(now);
                    self.timers[1].reset_prescaler(now);
                }
                if value & 2 != 0 {
                    self.timers[2].reset_prescaler(now);
                }
                if self.adc.is_triggered() && (value ^ self.sfior) >> 5 != 0 {
                    return Err(Unmodelled("another trigger of the ADC while it is on"));
                }
                self.sfior = value & !3;
                self.sense();
            }
            r::MCUCR => {
                let sensed = self.mcucr & 3 == value & 3;
                self.mcucr = value;
                if value & 3 == 0 {
                    self.int0 = false;
                }
                if value & SLEEP_ENABLE != 0 && value & SLEEP_MODES != 0 {
                    return Err(Unmodelled("a sleep mode other than idle"));
                }
                if sensed {
                    return Ok(Effect::default());
                }
            }
            // Flags are cleared by writing 0.
            r::MCUCSR => self.mcucsr &= value | 0xe0,
            r::GICR if value & INT1_INT2 != 0 => {
                return Err(Unmodelled("the external interrupts but INT0"));
            }
            r::GICR => self.gicr = value,
            // Flags are cleared by writing 1.
            r::GIFR => self.int0 &= value & INT0 == 0,
            r::SPMCR if value & SPM_ENABLE != 0 => {
                return Err(Unmodelled("a program that writes the flash"));
            }
            r::TWCR if value & 1 << 2 != 0 => return Err(Unmodelled("the two-wire interface")),
            r::ACSR if value & 1 << 3 != 0 => return Err(Unmodelled("the comparator's interrupt")),
            _ => {
                self.plain[usize::from(address & 63)] = value;
                return Ok(Effect::default());
            }
        }
        Ok(LOOK)
    }

    /// `sleep`: whether it puts the processor to sleep, and what that sets going.
    pub fn sleep(&mut self, now: u64) -> bool {
        let sleeps = self.mcucr & SLEEP_ENABLE != 0;
        if sleeps && let Err(what) = self.adc.enter_idle(now) {
            self.unmodelled.get_or_insert(what);
        }
        sleeps
    }
}
