//! What happens by itself, when, and which interrupt it asks for.

use super::{Chip, TIMER_FLAGS, Unmodelled, divider_2, vector};
use crate::Board;
use crate::converter::{Due, Input};
use crate::pins::{Port, Pwm};
use crate::timer::{CAPTURE, COMPARE_A, COMPARE_B, OVERFLOW};

impl Chip {
    /// The next cycle at which something happens by itself.
    pub fn next(&mut self, now: u64) -> Option<u64> {
        let mut next: Option<u64> = None;
        let mut at = |cycle: Option<u64>| {
            if let Some(cycle) = cycle {
                next = Some(next.map_or(cycle, |n: u64| n.min(cycle)));
            }
        };
        at(self.usart.next());
        at(self.adc.next());
        at(self.spi.next());
        at(self.eeprom.next());
        at(self.watchdog.next());
        let mut wanted = [0; 3];
        for (bit, (timer, flag, _)) in TIMER_FLAGS.into_iter().enumerate() {
            if self.timsk >> bit & 1 != 0 {
                wanted[timer] |= flag;
            }
        }
        if let Some((timer, flag)) = self.trigger_source().filter(|_| self.adc.is_triggered()) {
            wanted[timer] |= flag;
        }
        for (timer, wanted) in self.timers.iter_mut().zip(wanted) {
            if wanted != 0 {
                timer.catch_up(now);
                at(timer.next(wanted));
            }
        }
        next
    }

    /// Does what is due at `now`. Returns whether the watchdog bites.
    pub fn process(&mut self, now: u64, board: &mut dyn Board) -> bool {
        while let Some(at) = self.usart.next().filter(|&at| at <= now) {
            if let Some((end, byte)) = self.usart.process(at) {
                board.uart_byte(end, byte, self.usart.bit_cycles());
            }
        }
        if let Err(what) = self.convert(now, board) {
            self.unmodelled.get_or_insert(what);
        }
        if let Some(at) = self.spi.next().filter(|&at| at <= now)
            && let Some(byte) = self.spi.process(at)
        {
            // The ports as they were told to the board: what has just been written comes after this byte.
            self.told.spi_mode = self.spi.mode();
            self.told.spi_clock = self.spi.clock();
            // MOSI and SCK reach the outside only as outputs.
            const MOSI_SCK: u8 = 1 << 5 | 1 << 7;
            let reply = if self.told.ddr[Port::B as usize] & MOSI_SCK == MOSI_SCK {
                board.spi_byte(at, byte, &self.told)
            } else {
                0xff
            };
            self.spi.reply(reply);
        }
        if std::mem::take(&mut self.pins_changed) {
            self.pins.spi_mode = self.spi.mode();
            self.pins.spi_clock = self.spi.clock();
            self.told = self.pins;
            board.pins_changed(now, &self.pins);
            let motor = self.motor_pwm();
            if motor != self.motor {
                self.motor = motor;
                board.motor_changed(now, &motor);
            }
        }
        self.eeprom.process(now);
        self.watchdog.next().is_some_and(|at| at <= now)
    }

    /// What the ADC does up to `now`, and what starts it.
    fn convert(&mut self, now: u64, board: &mut dyn Board) -> Result<(), Unmodelled> {
        let rise = self.trigger_rise(now);
        if let Some(at) = rise {
            self.adc.trigger(at)?;
        }
        let free_running = self.sfior >> 5 == 0;
        while let Some(at) = self.adc.next().filter(|&at| at <= now) {
            if let Due::Sample(input) = self.adc.process(at, free_running)? {
                let (volts, reference) = voltages(input, at, board);
                self.adc.hold(volts, reference);
            }
        }
        rise.map_or(Ok(()), |at| self.adc.trigger(at))
    }

    pub(super) fn check_trigger(&self) -> Result<(), Unmodelled> {
        match self.sfior >> 5 {
            1 | 2 => Err(Unmodelled(
                "the ADC's trigger by comparator or external interrupt",
            )),
            _ => Ok(()),
        }
    }

    /// The timer and the flag that trigger the ADC.
    fn trigger_source(&self) -> Option<(usize, u8)> {
        match self.sfior >> 5 {
            3 => Some((0, COMPARE_A)),
            4 => Some((0, OVERFLOW)),
            5 => Some((1, COMPARE_B)),
            6 => Some((1, OVERFLOW)),
            7 => Some((1, CAPTURE)),
            _ => None,
        }
    }

    /// When the flag that triggers the ADC rose, if it is set.
    pub(super) fn trigger_rise(&mut self, now: u64) -> Option<u64> {
        let (timer, flag) = self.trigger_source()?;
        if !self.adc.is_triggered() {
            return None;
        }
        self.timer(timer, now).set_at(flag)
    }

    /// The interrupt that is next in turn.
    pub fn pending(&mut self, now: u64) -> Option<u8> {
        let flags = if self.timsk == 0 {
            0
        } else {
            self.timer_flags(now) & self.timsk
        };
        let timers = (0..8)
            .filter(|bit| flags >> bit & 1 != 0)
            .map(|bit| TIMER_FLAGS[bit].2);
        let [received, empty, sent] = self.usart.interrupts();
        let others = [
            (self.int0_asks(), vector::INT0),
            (self.spi.interrupts(), vector::SPI_STC),
            (received, vector::USART_RXC),
            (empty, vector::USART_UDRE),
            (sent, vector::USART_TXC),
            (self.adc.interrupts(), vector::ADC),
            (self.eeprom.interrupts(), vector::EE_RDY),
        ];
        let others = others
            .into_iter()
            .filter(|&(is, _)| is)
            .map(|(_, vector)| vector);
        timers.chain(others).min()
    }

    /// The interrupt is taken: its flag falls, where taking it clears it.
    pub fn taken(&mut self, vector: u8) {
        match vector {
            vector::INT0 => self.int0 = false,
            vector::SPI_STC => self.spi.clear(),
            vector::USART_TXC => self.usart.clear_txc(),
            vector::ADC => self.adc.clear(),
            _ => {
                for (timer, flag, own) in TIMER_FLAGS {
                    if own == vector {
                        self.timers[timer].flags &= !flag;
                    }
                }
            }
        }
    }

    /// What OC2 puts out, from the registers.
    pub fn motor_pwm(&self) -> Pwm {
        const OC2: u8 = 1 << 7;
        let port = Port::D as usize;
        let connect = self.tccr2 >> 4 & 3;
        if self.pins.ddr[port] & OC2 == 0 {
            return Pwm::default();
        }
        if connect == 0 {
            let high = f64::from(u8::from(self.pins.port[port] & OC2 != 0));
            return Pwm { high, hz: 0.0 };
        }
        let divider = divider_2(self.tccr2);
        let is_fast = self.tccr2 & 0x48 == 0x48;
        if divider == 0 || !is_fast || connect == 1 {
            // A pin that keeps a level unknown here: taken as on, which is the dangerous one.
            return Pwm { high: 1.0, hz: 0.0 };
        }
        let high = f64::from(self.timers[2].compare(0) + 1) / 256.0;
        Pwm {
            high: if connect == 2 { high } else { 1.0 - high },
            hz: f64::from(crate::CLOCK_HZ) / 256.0 / f64::from(divider),
        }
    }
}

fn voltages(input: Input, at: u64, board: &mut dyn Board) -> (f64, f64) {
    let reference = match input.reference {
        0 => board.aref_volts(),
        1 => board.avcc_volts(),
        _ => 2.56,
    };
    let volts = match input.mux {
        0x1e => 1.22,
        0x1f => 0.0,
        channel => board.adc_volts(at, channel),
    };
    (volts, reference)
}
