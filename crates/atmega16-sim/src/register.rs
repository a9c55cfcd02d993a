//! I/O addresses (data sheet 2466T, register summary), as `in` and `out` have them.
#![allow(missing_docs)]

pub const TWCR: u8 = 0x36;
pub const ADCL: u8 = 0x04;
pub const ADCH: u8 = 0x05;
pub const ADCSRA: u8 = 0x06;
pub const ADMUX: u8 = 0x07;
pub const ACSR: u8 = 0x08;
pub const UBRRL: u8 = 0x09;
pub const UCSRB: u8 = 0x0a;
pub const UCSRA: u8 = 0x0b;
pub const UDR: u8 = 0x0c;
pub const SPCR: u8 = 0x0d;
pub const SPSR: u8 = 0x0e;
pub const SPDR: u8 = 0x0f;
/// PIND, DDRD, PORTD, then C, B, A in the same order.
pub const PIND: u8 = 0x10;
pub const PORTA: u8 = 0x1b;
pub const EECR: u8 = 0x1c;
pub const EEDR: u8 = 0x1d;
pub const EEARL: u8 = 0x1e;
pub const EEARH: u8 = 0x1f;
/// Shared with UBRRH.
pub const UCSRC: u8 = 0x20;
pub const WDTCR: u8 = 0x21;
pub const ASSR: u8 = 0x22;
pub const OCR2: u8 = 0x23;
pub const TCNT2: u8 = 0x24;
pub const TCCR2: u8 = 0x25;
pub const ICR1L: u8 = 0x26;
pub const ICR1H: u8 = 0x27;
pub const OCR1BL: u8 = 0x28;
pub const OCR1BH: u8 = 0x29;
pub const OCR1AL: u8 = 0x2a;
pub const OCR1AH: u8 = 0x2b;
pub const TCNT1L: u8 = 0x2c;
pub const TCNT1H: u8 = 0x2d;
pub const TCCR1B: u8 = 0x2e;
pub const TCCR1A: u8 = 0x2f;
pub const SFIOR: u8 = 0x30;
pub const TCNT0: u8 = 0x32;
pub const TCCR0: u8 = 0x33;
pub const MCUCSR: u8 = 0x34;
pub const MCUCR: u8 = 0x35;
pub const SPMCR: u8 = 0x37;
pub const TIFR: u8 = 0x38;
pub const TIMSK: u8 = 0x39;
pub const GIFR: u8 = 0x3a;
pub const GICR: u8 = 0x3b;
pub const OCR0: u8 = 0x3c;
/// Stack pointer and status are the processor's.
pub const SPL: u8 = 0x3d;
