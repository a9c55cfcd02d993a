//! What simavr's own ATmega16 does with the programs that hold ours to the data sheet: the reason for each part of this
//! crate, measured. It fails when simavr's behaviour changes, or when docs/simulator.md does not say what is measured
//! here.

mod common;

use std::cell::RefCell;
use std::ffi::{c_int, c_void};

use atmega16_sim::{Image, Mcu};
use common::{Recorder, compile};
use simavr_ffi as ffi;

/// Bytes that went out, with their cycles.
struct Heard {
    avr: *mut ffi::avr_t,
    bytes: RefCell<Vec<(u64, u8)>>,
}

/// simavr as it comes, but for a sleep that does not wait in real time.
struct Stock {
    image: Image,
    avr: *mut ffi::avr_t,
    marks: Vec<(u64, u8)>,
    heard: &'static Heard,
}

unsafe extern "C" fn no_sleep(_: *mut ffi::avr_t, _: ffi::avr_cycle_count_t) {}

unsafe extern "C" fn on_byte(irq: *mut ffi::avr_irq_t, value: u32, param: *mut c_void) {
    // SAFETY: registered below with this, which is never freed.
    unsafe {
        let heard = &*param.cast::<Heard>();
        assert!(!irq.is_null());
        let at = (*heard.avr).cycle;
        heard.bytes.borrow_mut().push((at, value as u8));
    }
}

fn uart_irq(avr: *mut ffi::avr_t, which: c_int) -> *mut ffi::avr_irq_t {
    // AVR_IOCTL_UART_GETIRQ('0')
    // SAFETY: a query.
    unsafe { ffi::avr_io_getirq(avr, u32::from_be_bytes(*b"uar0"), which) }
}

impl Stock {
    fn new(name: &str, flags: &[&str]) -> Self {
        let image = Image::read(&compile(name, "atmega16", flags)).expect("it is an image");
        // SAFETY: simavr's own way to make a chip; all pointers live as long as it, which is until the test ends.
        let (avr, heard) = unsafe {
            let avr = ffi::avr_make_mcu_by_name(c"atmega16".as_ptr());
            ffi::avr_init(avr);
            (*avr).set_log(ffi::LOG_NONE as u8);
            (*avr).frequency = 16_000_000;
            (*avr).vcc = 5_000;
            (*avr).avcc = 5_000;
            (*avr).aref = 3_300;
            (*avr).sleep = Some(no_sleep);
            (*avr).codeend = image.flash.len() as u32;
            std::ptr::copy_nonoverlapping(image.flash.as_ptr(), (*avr).flash, image.flash.len());
            let heard: &'static Heard = Box::leak(Box::new(Heard {
                avr,
                bytes: RefCell::default(),
            }));
            let param = std::ptr::from_ref(heard).cast_mut().cast();
            let output = uart_irq(avr, ffi::UART_IRQ_OUTPUT as c_int);
            ffi::avr_irq_register_notify(output, Some(on_byte), param);
            // No usleep while a program polls, nothing on standard output.
            let mut none = 0u32;
            let set = u32::from_be_bytes(*b"uas0");
            ffi::avr_ioctl(avr, set, std::ptr::from_mut(&mut none).cast());
            (avr, heard)
        };
        Stock {
            image,
            avr,
            marks: Vec::new(),
            heard,
        }
    }

    fn run(&mut self, cycles: u64) -> &mut Self {
        // SAFETY: simavr's own loop.
        unsafe {
            let until = (*self.avr).cycle + cycles;
            while (*self.avr).cycle < until {
                let state = ffi::avr_run(self.avr);
                let port = *(*self.avr).data.add(0x38);
                if self.marks.last().map_or(0, |&(_, last)| last) != port {
                    self.marks.push(((*self.avr).cycle, port));
                }
                if state == ffi::cpu_Done as c_int || state == ffi::cpu_Crashed as c_int {
                    break;
                }
            }
        }
        self
    }

    fn byte(&self, name: &str) -> u8 {
        let address = self.image.symbol(name).expect("the program has it") & 0xffff;
        // SAFETY: within SRAM.
        unsafe { *(*self.avr).data.add(address as usize) }
    }

    fn mark(&self, value: u8) -> u64 {
        self.marks
            .iter()
            .find(|&&(_, b)| b == value)
            .expect("marked")
            .0
    }
}

fn ours(name: &str, flags: &[&str], cycles: u64) -> (Mcu, Recorder) {
    let mut mcu = common::load(name, flags);
    let mut board = Recorder::new();
    common::run(&mut mcu, &mut board, cycles);
    (mcu, board)
}

/// What is measured, what the data sheet says, what simavr's own part does, what ours does.
fn rows() -> Vec<(&'static str, String, String, String)> {
    let mut rows = Vec::new();
    let mut row = |what, sheet: &dyn ToString, stock: &dyn ToString, own: &dyn ToString| {
        rows.push((what, sheet.to_string(), stock.to_string(), own.to_string()));
    };

    let flags = ["-DDIVISOR=25", "-DDOUBLE=0", "-DBYTES=4"];
    let mut stock = Stock::new("serial.c", &flags);
    stock.run(2_000_000);
    let apart = |uart: &[(u64, u8)]| uart[2].0 - uart[1].0;
    let (mcu, board) = ours("serial.c", &flags, 2_000_000);
    // simavr looks at its timers between instructions: tens of cycles, rounded.
    let tens = |cycles: u64| (cycles + 32) / 64 * 64;
    row(
        "USART, UBRR 25 and then UCSRC: cycles from byte to byte",
        &4160,
        &tens(apart(&stock.heard.bytes.borrow())),
        &apart(&board.uart),
    );
    row(
        "UBRRH read where UCSRC was written to the address they share",
        &"0x00",
        &format!("{:#04x}", stock.byte("after_ubrrh")),
        &format!("{:#04x}", common::byte(&mcu, "after_ubrrh")),
    );

    let flags = ["-DPRESCALE=7"];
    let mut stock = Stock::new("adc.c", &flags);
    stock.run(400_000);
    let (_, board) = ours("adc.c", &flags, 400_000);
    let took = |marks: &[(u64, u8)]| (marks[3].1 == 2).then(|| (marks[3].0 - marks[2].0) / 128);
    row(
        "ADC at clock / 128: clocks of a conversion, with the wait for its clock",
        &"13 to 14",
        &took(&stock.marks).unwrap(),
        &took(&board.port_b).unwrap(),
    );
    let flags = ["-DPRESCALE=7", "-DTRIGGERED"];
    let mut stock = Stock::new("adc.c", &flags);
    stock.run(400_000);
    let (mcu, _) = ours("adc.c", &flags, 400_000);
    row(
        "ADC triggered by timer 1: conversions in 8 periods",
        &8,
        &stock.byte("taken"),
        &common::byte(&mcu, "taken"),
    );

    let flags = ["-DPRESCALE=7", "-DIDLE"];
    let mut stock = Stock::new("adc.c", &flags);
    stock.run(400_000);
    let (mcu, _) = ours("adc.c", &flags, 400_000);
    row(
        "ADC that is on: ADSC after an idle sleep",
        &64,
        &stock.byte("running"),
        &common::byte(&mcu, "running"),
    );

    let flags = ["-DDIVISOR=25", "-DDOUBLE=0", "-DBYTES=2", "-DFASTER"];
    let mut stock = Stock::new("serial.c", &flags);
    stock.run(400_000);
    let (_, board) = ours("serial.c", &flags, 400_000);
    let first = |uart: &[(u64, u8)]| format!("{:#04x}", uart[0].1);
    row(
        "USART: 0x55 heard at 38400 baud, UBRR set to 3 after three and a half bits",
        &"0xfd",
        &first(&stock.heard.bytes.borrow()),
        &first(&board.uart),
    );

    let mut stock = Stock::new("spi.c", &[]);
    stock.run(100_000);
    let (mcu, _) = ours("spi.c", &[], 100_000);
    row(
        "SPI: WCOL after a write too early",
        &64,
        &stock.byte("collided"),
        &common::byte(&mcu, "collided"),
    );

    let mut stock = Stock::new("eeprom.c", &[]);
    stock.run(400_000);
    let (mcu, board) = ours("eeprom.c", &[], 400_000);
    let thousands = |cycles: u64| format!("{} thousand", (cycles + 500) / 1000);
    row(
        "EEPROM: cycles of a write",
        &"136 thousand",
        &thousands(stock.mark(2) - stock.mark(1)),
        &thousands(board.mark(2) - board.mark(1)),
    );
    row(
        "EEPROM: EEWE while it writes",
        &2,
        &stock.byte("busy"),
        &common::byte(&mcu, "busy"),
    );

    let mut stock = Stock::new("interrupt.c", &[]);
    stock.run(100_000);
    let (mcu, _) = ours("interrupt.c", &[], 100_000);
    row(
        "Cycles from a flag to the first instruction at `jmp`'s end, out of sleep",
        &11,
        &stock.byte("sleep_count"),
        &common::byte(&mcu, "sleep_count"),
    );
    let served = |first: u8, second: u8| format!("{first}, {second}");
    row(
        "Vectors served, their flags set before their enables",
        &"3, 19",
        &served(stock.byte("order"), unsafe {
            // SAFETY: the next byte of the same array.
            *(*stock.avr)
                .data
                .add((stock.image.symbol("order").unwrap() & 0xffff) as usize + 1)
        }),
        &served(
            common::variable(&mcu, "order", 2)[0],
            common::variable(&mcu, "order", 2)[1],
        ),
    );

    let mut stock = Stock::new("timers.c", &[]);
    stock.run(100_000);
    let (mcu, _) = ours("timers.c", &[], 100_000);
    row(
        "Timer 0 in CTC: TOV0 and OCF0",
        &2,
        &stock.byte("tov_in_ctc"),
        &common::byte(&mcu, "tov_in_ctc"),
    );
    row(
        "TCNT0 = 77 written to a timer that stands, read",
        &77,
        &stock.byte("stopped"),
        &common::byte(&mcu, "stopped"),
    );

    let mut stock = Stock::new("ports.c", &[]);
    stock.run(10_000);
    let (mcu, _) = ours("ports.c", &[], 10_000);
    row(
        "PORTC = 0x35 after writes of PINC",
        &"0x35",
        &format!("{:#x}", stock.byte("toggled")),
        &format!("{:#x}", common::byte(&mcu, "toggled")),
    );

    let mut stock = Stock::new("external.c", &[]);
    stock.run(2_000);
    // AVR_IOCTL_IOPORT_GETIRQ('D')
    // SAFETY: a query, and a level for a pin.
    unsafe {
        let port = u32::from_be_bytes(*b"iogD");
        ffi::avr_raise_irq(ffi::avr_io_getirq(stock.avr, port, 2), 0);
    }
    stock.run(2_000);
    let mut mcu = common::load("external.c", &[]);
    let mut board = Recorder::new();
    common::run(&mut mcu, &mut board, 2_000);
    mcu.drive(atmega16_sim::Port::D, 1 << 2, 0);
    common::run(&mut mcu, &mut board, 2_000);
    row(
        "PD2 with its pull-up, driven by nobody, read",
        &4,
        &stock.byte("undriven"),
        &common::byte(&mcu, "undriven"),
    );
    row(
        "INT0 at a falling edge: times taken",
        &1,
        &stock.byte("taken"),
        &common::byte(&mcu, "taken"),
    );
    row(
        "PD2 held low from outside, read behind a write of PORTD",
        &0,
        &stock.byte("pin"),
        &common::byte(&mcu, "pin"),
    );

    let mut stock = Stock::new("receive.c", &["-DDELAY=40"]);
    stock.run(10_000);
    for byte in 1..=10 {
        let input = uart_irq(stock.avr, ffi::UART_IRQ_INPUT as c_int);
        // SAFETY: a byte for its receiver.
        unsafe { ffi::avr_raise_irq(input, byte) };
    }
    stock.run(4_000_000);
    let mut mcu = common::load("receive.c", &["-DDELAY=40"]);
    let mut board = Recorder::new();
    common::run(&mut mcu, &mut board, 10_000);
    (1..=10).for_each(|byte| mcu.send(byte));
    common::run(&mut mcu, &mut board, 4_000_000);
    row(
        "USART: bytes kept of ten that nobody took for 40 ms",
        &3,
        &stock.byte("taken"),
        &common::byte(&mcu, "taken"),
    );
    rows
}

#[test]
fn what_simavr_does_and_what_this_does_are_as_the_page_says() {
    let page = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/simulator.md");
    let page = std::fs::read_to_string(page).expect("docs/simulator.md");
    let mut absent = Vec::new();
    for (what, sheet, stock, own) in rows() {
        let line = format!("| {what} | {sheet} | {stock} | {own} |");
        println!("{line}");
        if !page.contains(&line) {
            absent.push(line);
        }
    }
    assert!(
        absent.is_empty(),
        "docs/simulator.md lacks:\n{}",
        absent.join("\n")
    );
}
