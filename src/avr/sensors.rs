//! SPI with three chip selects, and the ADC.

use adis16250::Adis16250;
use avr_device::atmega16::{ADC, PORTA, PORTB, PORTC, SPI};
use embedded_hal::{
    delay::DelayNs,
    spi::{ErrorKind, ErrorType, Operation, SpiDevice},
};
use firmware::Sensors;

/// Chip selects on port B: x PB2, y PB3, z PB4 (which is SS, so it has to be an output anyway).
const SELECTS: [u8; 3] = [1 << 2, 1 << 3, 1 << 4];
const MOSI: u8 = 1 << 5;
const SCK: u8 = 1 << 7;
/// SPE, MSTR, CPOL, CPHA (mode 3), SPR0; with SPI2X: clock / 8 = 2 MHz, below the part's 2.5 MHz.
const SPCR: u8 = 1 << 6 | 1 << 4 | 1 << 3 | 1 << 2 | 1;
const SPI2X: u8 = 1;
const SPIF: u8 = 1 << 7;
/// Polls for the end of a byte: it takes 64 cycles, 128 at the slow clock, a poll about 6.
const SPI_BUDGET: u8 = 60;
/// ADEN, clock / 128 = 125 kHz: the only setting at 16 MHz inside the 50..200 kHz that 10 bits need.
const ADC_ON: u8 = 1 << 7 | 7;
const ADSC: u8 = 1 << 6;
/// Polls for the end of a conversion: it takes 1664 cycles, the first of a tick 3200; a poll about 6.
const ADC_BUDGET: u16 = 1_000;

/// The end of a byte did not come: SS was pulled low, or the clock has stopped.
#[derive(Clone, Copy, Debug)]
pub struct Stalled;

impl embedded_hal::spi::Error for Stalled {
    fn kind(&self) -> ErrorKind {
        ErrorKind::ModeFault
    }
}

/// One gyro's SPI.
pub struct GyroSpi {
    select: u8,
}

fn spi() -> &'static avr_device::atmega16::spi::RegisterBlock {
    // SAFETY: SPI is used by the sensors alone, which exist once (`start`).
    unsafe { &*SPI::ptr() }
}

fn port_b() -> &'static avr_device::atmega16::portb::RegisterBlock {
    // SAFETY: port B is used by the sensors alone.
    unsafe { &*PORTB::ptr() }
}

#[inline(never)]
fn byte(out: u8) -> Result<u8, Stalled> {
    let spi = spi();
    spi.spdr.write(|w| bits!(w, out));
    // In the first round the motor's stop has no interrupt: one that is pressed is felt here.
    super::board::cut_motor_if_pressed();
    for _ in 0..SPI_BUDGET {
        if spi.spsr.read().bits() & SPIF != 0 {
            return Ok(spi.spdr.read().bits());
        }
    }
    // A low level on SS drops the master bit, and the byte never ends: become master again.
    spi.spcr.write(|w| bits!(w, SPCR));
    Err(Stalled)
}

impl GyroSpi {
    fn selected<T>(&mut self, work: impl FnOnce() -> T) -> T {
        let port = port_b();
        port.portb.modify(|r, w| bits!(w, r.bits() & !self.select));
        let result = work();
        port.portb.modify(|r, w| bits!(w, r.bits() | self.select));
        result
    }
}

impl ErrorType for GyroSpi {
    type Error = Stalled;
}

impl SpiDevice for GyroSpi {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), Stalled> {
        self.selected(|| {
            for operation in operations {
                match operation {
                    Operation::Read(into) => {
                        for place in into.iter_mut() {
                            *place = byte(0)?;
                        }
                    }
                    Operation::Write(from) => {
                        for &out in from.iter() {
                            byte(out)?;
                        }
                    }
                    Operation::Transfer(into, from) => {
                        for (place, &out) in into.iter_mut().zip(from.iter()) {
                            *place = byte(out)?;
                        }
                    }
                    Operation::TransferInPlace(both) => {
                        for place in both.iter_mut() {
                            *place = byte(*place)?;
                        }
                    }
                    Operation::DelayNs(ns) => Delay.delay_ns(*ns),
                }
            }
            Ok(())
        })
    }

    #[inline(always)]
    fn transfer_in_place(&mut self, both: &mut [u8]) -> Result<(), Stalled> {
        self.selected(|| {
            // A gyro's frame: without a loop it stays in registers.
            if let [high, low] = both {
                *high = byte(*high)?;
                *low = byte(*low)?;
                return Ok(());
            }
            for place in both.iter_mut() {
                *place = byte(*place)?;
            }
            Ok(())
        })
    }
}

/// Ten cycles.
#[inline(always)]
fn ten_nops() {
    use avr_device::asm::nop;
    (nop(), nop(), nop(), nop(), nop());
    (nop(), nop(), nop(), nop(), nop());
}

/// Waits for so many microseconds. A pass takes 16 cycles: ten nops, the count in 16 bits and its test (4), the branch (2).
#[inline(never)]
fn pause(us: u16) {
    let mut left = us;
    while left != 0 {
        ten_nops();
        left = left.wrapping_sub(1);
    }
}

/// Waits by counting cycles of 62.5 ns.
#[derive(Clone, Copy)]
pub struct Delay;

impl DelayNs for Delay {
    fn delay_ns(&mut self, ns: u32) {
        // 1024 ns for a microsecond, rounded up: never less than asked but by 2.4 %, and no division.
        self.delay_us((ns >> 10).wrapping_add(1));
    }

    /// No caller waits for longer than 16 bits of microseconds hold.
    #[inline(always)]
    fn delay_us(&mut self, us: u32) {
        pause(us as u16);
    }

    fn delay_ms(&mut self, ms: u32) {
        for _ in 0..ms as u16 {
            self.delay_us(1_000);
        }
    }
}

/// The three gyros and the accelerometer.
pub struct AvrSensors {
    /// The one that is spoken to. All that tells it from the others is its chip select.
    gyro: Adis16250<GyroSpi>,
}

/// All zeros: a static that begins otherwise costs flash, and the first of them the routine that copies it at reset as well.
static mut SENSORS: AvrSensors = AvrSensors {
    gyro: Adis16250::new(GyroSpi { select: 0 }),
};

/// The one set of them.
///
/// # Safety
/// One user at a time: the start, and from then on the tick.
pub unsafe fn all() -> &'static mut AvrSensors {
    // SAFETY: the caller's.
    unsafe { &mut *core::ptr::addr_of_mut!(SENSORS) }
}

/// Sets up SPI and ADC and waits until the gyros have started.
///
/// # Safety
/// Once, before interrupts are on.
pub unsafe fn start() -> &'static mut AvrSensors {
    let selects = SELECTS[0] | SELECTS[1] | SELECTS[2];
    let port = port_b();
    port.portb.write(|w| bits!(w, selects | SCK));
    port.ddrb.write(|w| bits!(w, selects | MOSI | SCK));
    spi().spcr.write(|w| bits!(w, SPCR));
    // SAFETY: port A and C are set up here, before anything else uses them.
    unsafe {
        (*PORTA::ptr()).ddra.write(|w| bits!(w, 0));
        (*PORTA::ptr()).porta.write(|w| bits!(w, 0));
        // Sleep pin and g-select: driven low or left to the pull-up to 3.3 V, never driven high: 5 V would harm the part.
        (*PORTC::ptr()).portc.write(|w| bits!(w, 0));
        (*PORTC::ptr()).ddrc.write(|w| bits!(w, 0b11));
    }
    Delay.delay_ms(u32::from(firmware::SENSOR_START_MS));
    // SAFETY: the caller's.
    unsafe { all() }
}

fn adc() -> &'static avr_device::atmega16::adc::RegisterBlock {
    // SAFETY: the ADC is used by the sensors alone.
    unsafe { &*ADC::ptr() }
}

/// Switches the ADC off until the next conversion is asked for. Idle sleep starts one by itself while it is on (2466T, idle
/// mode): the tick would meet it running, `ADSC` would do nothing, and the result would be the input's before.
pub fn adc_off() {
    adc().adcsra.write(|w| bits!(w, 0));
}

impl Sensors for AvrSensors {
    type Spi = GyroSpi;
    type Delay = Delay;

    fn gyro(&mut self, axis: u8) -> Option<&mut Adis16250<GyroSpi>> {
        let select = match axis {
            0 => SELECTS[0],
            1 => SELECTS[1],
            2 => SELECTS[2],
            _ => return None,
        };
        self.gyro = Adis16250::new(GyroSpi { select });
        Some(&mut self.gyro)
    }

    fn delay(&mut self) -> Delay {
        Delay
    }

    fn slow(&mut self, slow: bool) {
        // Without SPI2X: clock / 16.
        spi().spsr.write(|w| bits!(w, if slow { 0 } else { SPI2X }));
    }

    fn sampled(&mut self) {
        super::tick::unmask();
    }

    fn adc_start(&mut self, channel: u8) {
        // REFS = 00: AREF is the sensor's own 3.3 V, so the reading is ratiometric.
        adc().admux.write(|w| bits!(w, channel & 3));
        adc().adcsra.write(|w| bits!(w, ADC_ON | ADSC));
    }

    fn adc_finish(&mut self) -> Option<u16> {
        for _ in 0..ADC_BUDGET {
            if adc().adcsra.read().bits() & ADSC == 0 {
                return Some(adc().adc.read().bits());
            }
        }
        None
    }
}
