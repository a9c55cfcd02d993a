//! The ADC: conversions of one pin against its reference, started by the program, by a timer's flag, or by the end of
//! the one before.

use crate::timer::Unmodelled;

const ADEN: u8 = 1 << 7;
const ADSC: u8 = 1 << 6;
const ADATE: u8 = 1 << 5;
const ADIF: u8 = 1 << 4;
const ADIE: u8 = 1 << 3;
const ADLAR: u8 = 1 << 5;

/// Which voltage is converted against which.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Input {
    /// MUX4:0.
    pub mux: u8,
    /// REFS1:0.
    pub reference: u8,
}

#[derive(Clone, Copy, Debug)]
struct Conversion {
    input: Input,
    samples_at: u64,
    ends_at: u64,
    result: Option<u16>,
}

/// State of the ADC.
#[derive(Clone, Copy, Debug)]
pub struct Converter {
    control: u8,
    mux: u8,
    /// Its prescaler runs from here.
    enabled_at: u64,
    /// No conversion since it was switched on.
    first: bool,
    running: Option<Conversion>,
    result: u16,
    /// ADCL has been read: the result waits for ADCH.
    locked: bool,
    /// The conversion that is running was started by this rise of the trigger's flag.
    triggered_by: Option<u64>,
}

/// What the ADC wants.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Due {
    /// Hold this input now.
    Sample(Input),
    /// Nothing more.
    Done,
}

impl Converter {
    pub fn new() -> Self {
        Converter {
            control: 0,
            mux: 0,
            enabled_at: 0,
            first: true,
            running: None,
            result: 0,
            locked: false,
            triggered_by: None,
        }
    }

    fn divider(&self) -> u64 {
        2 << (self.control & 7).saturating_sub(1)
    }

    pub fn read_control(&self) -> u8 {
        self.control & !ADSC | if self.running.is_some() { ADSC } else { 0 }
    }

    pub fn read_mux(&self) -> u8 {
        self.mux
    }

    pub fn write_mux(&mut self, value: u8) {
        self.mux = value;
    }

    pub fn write_control(&mut self, value: u8, now: u64) -> Result<(), Unmodelled> {
        let before = self.control;
        let flag = before & ADIF & !value;
        self.control = value & !(ADIF | ADSC) | flag;
        if value & ADEN == 0 {
            self.running = None;
            return Ok(());
        }
        if before & ADEN == 0 {
            self.enabled_at = now;
            self.first = true;
        }
        if value & ADSC != 0 {
            self.start_at_next_clock(now)?;
        }
        Ok(())
    }

    /// Idle mode is entered: "if the ADC is enabled, a conversion starts automatically when this mode is entered" (2466T,
    /// idle mode).
    pub fn enter_idle(&mut self, now: u64) -> Result<(), Unmodelled> {
        if self.control & ADEN == 0 {
            return Ok(());
        }
        self.start_at_next_clock(now)
    }

    /// A conversion, unless one runs: its input stays the one that it was started with.
    fn start_at_next_clock(&mut self, now: u64) -> Result<(), Unmodelled> {
        if self.running.is_some() {
            return Ok(());
        }
        // It starts with the next edge of its clock; half clocks: 1.5 (13.5) to the sample, 13 (25) to the end.
        let clock = self.divider();
        let start = self.enabled_at + ((now - self.enabled_at) / clock + 1) * clock;
        let (sample, end) = if self.first { (27, 50) } else { (3, 26) };
        self.start(start, sample, end)
    }

    /// A conversion that samples and ends so many half clocks after `start`.
    fn start(&mut self, start: u64, sample: u64, end: u64) -> Result<(), Unmodelled> {
        let input = Input {
            mux: self.mux & 0x1f,
            reference: self.mux >> 6,
        };
        if !matches!(input.mux, 0..=7 | 0x1e | 0x1f) {
            return Err(Unmodelled("a differential input of the ADC"));
        }
        if input.reference == 2 {
            return Err(Unmodelled("the ADC's reserved reference"));
        }
        let clock = self.divider();
        self.first = false;
        self.running = Some(Conversion {
            input,
            samples_at: start + sample * clock / 2,
            ends_at: start + end * clock / 2,
            result: None,
        });
        Ok(())
    }

    /// Whether a flag's rise starts a conversion.
    pub fn is_triggered(&self) -> bool {
        self.control & (ADEN | ADATE) == ADEN | ADATE
    }

    /// The trigger's flag has risen at `at`. Idle: the prescaler starts anew after three cycles of synchronization, the
    /// input is held 2 (13.5) clocks later, and the result is there after 13.5 (25). While a conversion runs: nothing.
    pub fn trigger(&mut self, at: u64) -> Result<(), Unmodelled> {
        if self.triggered_by == Some(at) || self.running.is_some_and(|c| c.ends_at <= at) {
            return Ok(());
        }
        self.triggered_by = Some(at);
        if self.running.is_some() || !self.is_triggered() {
            return Ok(());
        }
        self.enabled_at = at + 3;
        let (sample, end) = if self.first { (27, 50) } else { (4, 27) };
        self.start(at + 3, sample, end)
    }

    /// This rise of the flag was there before the trigger was switched on.
    pub fn ignore(&mut self, at: u64) {
        self.triggered_by = Some(at);
    }

    pub fn read_low(&mut self) -> u8 {
        self.locked = true;
        self.shown() as u8
    }

    pub fn read_high(&mut self) -> u8 {
        self.locked = false;
        (self.shown() >> 8) as u8
    }

    fn shown(&self) -> u16 {
        if self.mux & ADLAR == 0 {
            self.result
        } else {
            self.result << 6
        }
    }

    pub fn next(&self) -> Option<u64> {
        self.running.map(|c| {
            if c.result.is_none() {
                c.samples_at
            } else {
                c.ends_at
            }
        })
    }

    /// What is due at `now`.
    pub fn process(&mut self, now: u64, free_running: bool) -> Result<Due, Unmodelled> {
        let Some(conversion) = self.running else {
            return Ok(Due::Done);
        };
        match conversion.result {
            None if conversion.samples_at <= now => Ok(Due::Sample(conversion.input)),
            Some(result) if conversion.ends_at <= now => {
                if !self.locked {
                    self.result = result;
                }
                self.running = None;
                self.control |= ADIF;
                if free_running && self.control & ADATE != 0 {
                    self.start(conversion.ends_at, 3, 26)?;
                }
                Ok(Due::Done)
            }
            _ => Ok(Due::Done),
        }
    }

    /// The input was held: floor(1024 V / Vref), 0..=1023.
    pub fn hold(&mut self, volts: f64, reference: f64) {
        if let Some(conversion) = &mut self.running {
            let counts = (volts / reference * 1024.0).floor().clamp(0.0, 1023.0);
            conversion.result = Some(counts as u16);
        }
    }

    pub fn interrupts(&self) -> bool {
        self.control & (ADIF | ADIE) == ADIF | ADIE
    }

    /// The interrupt has been taken.
    pub fn clear(&mut self) {
        self.control &= !ADIF;
    }
}
