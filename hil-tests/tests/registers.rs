//! What only the registers can get wrong: delays, the turn of the line to another speed, a bus that was lost, and registers that no
//! interrupt may come between. `cargo xtask mutants --registers` plants such faults in the image and expects these tests to fail.

use atmega16_sim::{Image, register};
use bench::Scenario;
use bench::simavr::{Event, NoProbe, Probe, Simulated};
use hil_tests::guarded::bare;
use hil_tests::{Heard, at, generator, image, seed};
use wire::{Command, Fault, Status, flags};

/// Cycles of a microsecond.
const US: u64 = 16;
/// The ATmega16 has that many, reset included.
const VECTORS: usize = 21;

/// When gyro x is spoken to, and when the converter holds its inputs.
#[derive(Default)]
struct Frames {
    /// Begins and ends.
    of_x: Vec<(u64, u64)>,
    /// Input and time.
    held: Vec<(u8, u64)>,
    /// Cycles of each byte to or from a gyro.
    bytes: Vec<u64>,
}

impl Probe for Frames {
    fn event(&mut self, at: u64, event: Event) {
        match event {
            Event::Select { axis: 0, selected } if selected => self.of_x.push((at, at)),
            Event::Select { axis: 0, .. } => {
                if let Some((_, end)) = self.of_x.last_mut() {
                    *end = at;
                }
            }
            Event::Spi { cycles, .. } => self.bytes.push(cycles),
            Event::Adc { channel } => self.held.push((channel, at)),
            _ => {}
        }
    }
}

/// The start of the board and its first samples.
fn started() -> Simulated<Frames> {
    let scenario = Scenario::quiet(5);
    let mut simulated = Simulated::new(&image(), &scenario, Frames::default()).expect("an image");
    simulated
        .run_until(2.0, &mut |_| std::ops::ControlFlow::Continue(()))
        .expect("it runs");
    simulated
}

#[test]
fn no_gyro_is_spoken_to_before_it_has_started() {
    let simulated = started();
    let &(first, _) = simulated.probe().of_x.first().expect("it is set up");
    // 220 ms, and no longer than the crystal, the start of the program and the loop's own cycles make of it.
    let (least, most) = (220_000 * US, 226_000 * US);
    assert!(
        (least..most).contains(&first),
        "{first} cycles, {least} at the least"
    );
}

#[test]
fn a_gyro_whose_pace_is_not_known_yet_has_100_us_and_then_what_the_data_sheet_asks() {
    let simulated = started();
    let frames = &simulated.probe().of_x;
    // SMPL_PRD: two frames that write, one that asks, one that reads.
    let gaps: Vec<u64> = frames.windows(2).map(|two| two[1].0 - two[0].1).collect();
    assert!(
        gaps[..4].iter().all(|gap| *gap >= 100 * US),
        "{:?}",
        &gaps[..4]
    );
    assert!(
        gaps[..3].iter().all(|gap| *gap < 120 * US),
        "{:?}",
        &gaps[..4]
    );
    // At 1 MHz, which a gyro of any pace stands; the next register at 2 MHz.
    let bytes = &simulated.probe().bytes;
    assert!(
        bytes[..8].iter().all(|cycles| *cycles == 8 * US),
        "{:?}",
        &bytes[..8]
    );
    assert_eq!(bytes[8], 4 * US);
    // The other registers: 30 us between frames, 40 us from begin to begin.
    let set_up = 22;
    for (gap, two) in gaps[4..set_up - 1].iter().zip(frames[4..].windows(2)) {
        let period = two[1].0 - two[0].0;
        assert!(
            *gap >= 32 * US && period >= 40 * US,
            "{gap} and {period} cycles"
        );
    }
    let discipline = simulated.discipline();
    assert!(discipline.shortest_stall.is_some_and(|gap| gap >= 30 * US));
    assert!(
        discipline
            .shortest_period
            .is_some_and(|period| period >= 40 * US)
    );
}

#[test]
fn the_converters_clock_is_one_that_ten_bits_allow() {
    let simulated = started();
    let held = &simulated.probe().held;
    assert!(held.len() > 30, "{} conversions", held.len());
    for two in held.windows(2).filter(|two| two[1].0 > two[0].0) {
        // 13 clocks of 5 to 20 us (50 to 200 kHz) and the work between them.
        let apart = two[1].1 - two[0].1;
        assert!(
            (13 * 5 * US..13 * 20 * US).contains(&apart),
            "{apart} cycles"
        );
    }
}

#[test]
fn the_line_takes_another_speed_behind_the_last_stop_bit() {
    let scenario = Scenario::quiet(6);
    let mut simulated = Simulated::new(&image(), &scenario, NoProbe).expect("an image");
    let rng = &mut generator(seed());
    let mut heard = Heard::default();
    let (mut t, mut asked) = (1.0, 0u16);
    // From 3 860 to 250 000 Bd; 259 has a high byte.
    let divisors = [25, 12, 3, 259];
    while t < 20.0 {
        simulated
            .run_until(t, &mut |byte| heard.push(byte))
            .expect("it runs");
        if let Some(before) = asked.checked_sub(1) {
            let divisor = divisors[usize::from(before % 4)];
            let bit = 16 * (u64::from(divisor) + 1);
            assert_eq!(simulated.mcu().uart_bit_cycles(), bit, "divisor {divisor}");
        }
        // What goes out then is a reply, or a reply behind a health frame.
        if asked % 2 == 1 {
            simulated.request(&[at(t, 100 + asked, Command::Counters)]);
        }
        let divisor = divisors[usize::from(asked % 4)];
        simulated.request(&[at(t, asked, Command::SetBaud { divisor })]);
        asked += 1;
        // On the slowest line half a second of samples goes out first.
        t += bench::uniform(rng, 0.9, 1.1);
    }
    simulated
        .run_until(t + 1.0, &mut |byte| heard.push(byte))
        .expect("it runs");
    assert_eq!(heard.link().rejected(), 0, "frames that were spoilt");
    for number in 0..asked {
        let replies = heard.replies().filter(|(_, reply)| reply.number == number);
        let statuses: Vec<_> = replies.map(|(_, reply)| reply.status).collect();
        assert_eq!(statuses, [Status::Ok], "request {number}");
    }
}

/// Bursts of eight bytes at 500 kBd: the ring never fills, but a tick keeps the receiver waiting for longer than its two bytes last.
#[test]
fn bytes_that_the_receiver_itself_loses_are_counted() {
    let mut scenario = Scenario::quiet(9);
    scenario.seconds = 4.0;
    let mut simulated = Simulated::new(&image(), &scenario, NoProbe).expect("an image");
    let rate = Command::SetRate {
        period_ticks: 976,
        periods_per_sample: 1,
    };
    simulated.request(&[
        at(1.0, 1, Command::SetBaud { divisor: 1 }),
        at(1.5, 2, rate),
    ]);
    let mut heard = Heard::default();
    let mut t = 2.0;
    while t < 3.5 {
        simulated
            .run_until(t, &mut |byte| heard.push(byte))
            .expect("it runs");
        simulated.send(&[0, 1, 2, 3, 4, 5, 6, 0]);
        // Through all phases of the tick.
        t += 0.003_1;
    }
    simulated
        .run_until(5.0, &mut |byte| heard.push(byte))
        .expect("it runs");
    assert_eq!(heard.replies().count(), 2);
    assert!(heard.last_health().faults.get(Fault::RxOverrun) > 5);
}

/// Requests without a pause, more than there is room for replies: the board stops listening, and the receive ring fills.
#[test]
fn bytes_that_find_the_ring_full_are_counted_and_those_in_it_stay() {
    const RING: u16 = 35;
    const SENT: u16 = 40;
    let scenario = Scenario::quiet(10);
    let mut simulated = Simulated::new(&image(), &scenario, NoProbe).expect("an image");
    let mut heard = Heard::default();
    let mut run = |simulated: &mut Simulated<NoProbe>, until_s: f64| {
        simulated
            .run_until(until_s, &mut |byte| heard.push(byte))
            .expect("it runs");
    };
    run(&mut simulated, 2.0);
    let len = wire::Request::FRAME_LEN as u16;
    for number in 0..SENT {
        let mut line = [0; wire::Request::FRAME_LEN];
        let command = Command::Ping;
        wire::encode_request(&wire::Request { number, command }, &mut line).expect("it fits");
        simulated.send(&line);
    }
    run(&mut simulated, 6.0);
    let replies: Vec<u16> = heard.replies().map(|(_, reply)| reply.number).collect();
    let health = heard.last_health();
    let lost = health.faults.get(Fault::RxOverrun);
    let spoilt = health.faults.get(Fault::RxBadFrame);
    println!("{replies:?}, {lost} bytes lost, {spoilt} frames spoilt");
    let unanswered = SENT - replies.len() as u16;
    assert!(unanswered > 3, "it never filled");
    // The first ones, up to what the ring held as it filled, are all answered.
    let first = replies.iter().zip(0..).take_while(|(a, b)| **a == *b);
    assert!(first.count() as u16 * len >= RING);
    assert!((1..=unanswered).contains(&spoilt), "{spoilt}");
    // A request without an answer has lost a byte at least, and no other has.
    assert!(
        (unanswered..=unanswered * len).contains(&lost),
        "{lost} bytes of {unanswered} requests"
    );
}

#[test]
fn a_bus_that_was_lost_costs_one_frame_is_told_and_is_taken_back() {
    let scenario = Scenario::quiet(7);
    let mut simulated = Simulated::new(&image(), &scenario, NoProbe).expect("an image");
    let mut heard = Heard::default();
    simulated
        .run_until(2.0, &mut |byte| heard.push(byte))
        .expect("it runs");
    // As a low level on SS leaves it: enabled, mode 3, clock / 16, but no master.
    let slave = 1 << 6 | 3 << 2 | 1;
    simulated.mcu_mut().write_register(register::SPCR, slave);
    let before = heard.samples().count();
    simulated
        .run_until(4.5, &mut |byte| heard.push(byte))
        .expect("it runs");
    let samples: Vec<_> = heard
        .samples()
        .skip(before)
        .map(|(_, sample)| sample)
        .collect();
    let struck: Vec<_> = (samples.iter())
        .filter(|sample| sample.flags & flags::GYRO_NOT_ANSWERING != 0)
        .collect();
    assert_eq!(struck.len(), 1, "samples without gyro x");
    assert_eq!(struck[0].flags & flags::new_data(0), 0);
    // The others were behind it in the same round.
    for axis in 1..3 {
        assert_ne!(struck[0].flags & flags::new_data(axis), 0, "gyro {axis}");
    }
    assert!(
        samples[20..]
            .iter()
            .all(|sample| sample.flags == flags::IN_ORDER)
    );
    let faults = heard.last_health().faults;
    assert_eq!(faults.get(Fault::SpiStalled), 1);
    assert_eq!(faults.get(Fault::gyro_not_answering(0)), 1);
    assert_eq!(faults.get(Fault::gyro_recovered(0)), 1);
}

#[test]
fn no_interrupt_comes_between_the_bytes_of_a_16_bit_register_or_before_an_eeprom_write() {
    let image = Image::read(&image()).expect("an image");
    let [guarded, bare] = bare(&image.flash, VECTORS).expect("calls can be followed");
    // Compare values (4), the counter in the guard and in `ticks_since` (2 each) and set to 0, EEMWE and EEWE.
    assert!(guarded.len() >= 10, "{} places are seen", guarded.len());
    let places: Vec<String> = bare.iter().map(|at| format!("{at:#x}")).collect();
    assert!(bare.is_empty(), "interrupts may be on at {places:?}");
}
