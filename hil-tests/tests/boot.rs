//! The image starts, says who it is, and samples.

use atmega16_sim::{Board, CLOCK_HZ, Image, Mcu, Pins, ResetCause, Stop};
use bench::Scenario;
use bench::simavr::{NoProbe, Simulated};
use hil_tests::{Heard, at, hear, image, run};
use wire::{Command, Fault, Status, flags, reset_cause};

#[test]
fn it_says_hello_and_then_samples_at_20_hz_without_a_gap() {
    let begun = std::time::Instant::now();
    let heard = hear(&run(Scenario::lively(1), 60.0)).expect("it runs");
    let wall = begun.elapsed().as_secs_f64();
    assert_eq!(heard.link().rejected(), 0);
    let (at, hello) = heard.hellos().next().expect("a hello frame");
    assert!(at < 0.3, "hello after {at} s");
    assert_eq!(hello.reset_cause, reset_cause::POWER_ON);
    assert_eq!((hello.restarts, hello.next_seq), (0, 0));
    assert_eq!(
        (hello.tick_ns, hello.period_ticks, hello.baud_divisor),
        (4_000, 12_500, 25)
    );
    let samples: Vec<_> = heard.samples().collect();
    assert!((1190..=1200).contains(&samples.len()), "{}", samples.len());
    for (n, (_, sample)) in samples.iter().enumerate() {
        assert_eq!(usize::from(sample.seq), n);
        assert_eq!(sample.t_ticks, (n as u32 + 1) * 12_500);
        assert_eq!(sample.flags, flags::IN_ORDER, "sample {n}");
    }
    println!("60 simulated s in {wall:.2} s");
}

#[test]
fn a_reboot_by_command_is_answered_and_comes_back_by_the_watchdog_with_its_cause() {
    let mut run = run(Scenario::lively(6), 20.0);
    run.requests = vec![at(5.0, 1, Command::Reboot), at(12.0, 2, Command::GetHello)];
    let heard = hear(&run).expect("it runs");
    let replies: Vec<_> = heard.replies().map(|(_, reply)| reply).collect();
    let answered: Vec<_> = replies
        .iter()
        .map(|reply| (reply.number, reply.status))
        .collect();
    assert_eq!(answered, [(1, Status::Ok), (2, Status::Ok)]);
    let hellos: Vec<_> = heard.hellos().collect();
    let causes: Vec<_> = hellos.iter().map(|(_, hello)| hello.reset_cause).collect();
    assert_eq!(
        causes,
        [
            reset_cause::POWER_ON,
            reset_cause::WATCHDOG,
            reset_cause::WATCHDOG
        ]
    );
    assert_eq!((hellos[1].1.restarts, hellos[1].1.next_seq), (1, 0));
    // Up to 16 ms of watchdog, 220 ms of the sensors' start, and the frame.
    assert!(
        (5.2..5.4).contains(&hellos[1].0),
        "back at {} s",
        hellos[1].0
    );
    let back = hellos[1].0;
    let after: Vec<_> = heard.samples().filter(|&(t, _)| t > back).collect();
    for (n, (_, sample)) in after.iter().enumerate() {
        assert_eq!(
            (usize::from(sample.seq), sample.flags),
            (n, flags::IN_ORDER)
        );
    }
    let health = heard.last_health();
    assert_eq!(health.faults.get(Fault::WatchdogReset), 1);
}

#[test]
fn resets_are_counted_over_resets_until_they_are_cleared_or_power_goes() {
    let mut simulated = Simulated::new(&image(), &Scenario::quiet(7), NoProbe).expect("an image");
    let mut heard = Heard::default();
    let mut counts = |simulated: &mut Simulated<NoProbe>, command: Option<Command>| {
        let from = simulated.time_s();
        if let Some(command) = command {
            simulated.request(&[at(from + 0.5, 1, command)]);
        }
        simulated
            .run_until(from + 2.5, &mut |byte| heard.push(byte))
            .expect("it runs");
        let faults = heard.last_health().faults;
        [Fault::WatchdogReset, Fault::BrownOutReset].map(|fault| faults.get(fault))
    };
    assert_eq!(counts(&mut simulated, None), [0, 0]);
    assert_eq!(counts(&mut simulated, Some(Command::Reboot)), [1, 0]);
    assert_eq!(counts(&mut simulated, Some(Command::Reboot)), [2, 0]);
    simulated.reset(ResetCause::BrownOut);
    assert_eq!(counts(&mut simulated, None), [2, 1]);
    assert_eq!(counts(&mut simulated, Some(Command::ClearCounters)), [0, 0]);
    assert_eq!(counts(&mut simulated, Some(Command::Reboot)), [1, 0]);
    simulated.power_cycle();
    assert_eq!(counts(&mut simulated, None), [0, 0]);
}

#[test]
fn a_power_cut_in_the_middle_of_a_frame_costs_no_hello_of_the_start_behind_it() {
    let mut simulated = Simulated::new(&image(), &Scenario::quiet(7), NoProbe).expect("an image");
    let mut heard = Heard::default();
    let (mut t, mut last) = (5.0, 0);
    simulated
        .run_until(t, &mut |byte| heard.push(byte))
        .expect("it runs");
    while last == 0 {
        t += 0.001;
        simulated
            .run_until(t, &mut |byte| {
                last = byte.byte;
                heard.push(byte)
            })
            .expect("it runs");
    }
    simulated.power_cycle();
    simulated
        .run_until(t + 1.0, &mut |byte| heard.push(byte))
        .expect("it runs");
    let causes: Vec<_> = heard.hellos().map(|(_, hello)| hello.reset_cause).collect();
    assert_eq!(causes, [reset_cause::POWER_ON; 2]);
    assert_eq!(heard.link().rejected(), 1, "what was cut off");
}

/// Parts that answer something, and a host that hears nothing.
struct Deaf;

impl Board for Deaf {
    fn spi_byte(&mut self, _at: u64, _mosi: u8, _pins: &Pins) -> u8 {
        0x80
    }
    fn adc_volts(&mut self, _at: u64, _channel: u8) -> f64 {
        1.65
    }
    fn aref_volts(&self) -> f64 {
        3.3
    }
    fn uart_byte(&mut self, _at: u64, _byte: u8, _bit: u64) {}
    fn pins_changed(&mut self, _at: u64, _pins: &Pins) {}
}

/// At 1 Hz three of four periods of the timer have no sample: they must not keep a board alive whose main loop hangs.
#[test]
fn a_main_loop_that_hangs_ends_in_a_watchdog_reset_at_1_hz_too() {
    let mut simulated = Simulated::new(&image(), &Scenario::quiet(7), NoProbe).expect("an image");
    let slow = Command::SetRate {
        period_ticks: 62_500,
        periods_per_sample: 4,
    };
    simulated.request(&[at(1.0, 1, slow), at(2.0, 2, Command::StoreConfig)]);
    let mut heard = Heard::default();
    simulated
        .run_until(4.0, &mut |byte| heard.push(byte))
        .expect("it runs");
    assert_eq!(
        heard.replies().last().map(|(_, reply)| reply.status),
        Some(Status::Ok)
    );

    let mut hanging = Image::read(&image()).expect("an image");
    let (_, first) = (hanging.symbols.iter())
        .find(|(name, _)| name.contains("5Stand14on_millisecond"))
        .expect("its first instruction is to be replaced");
    // rjmp to itself.
    let place = *first as usize;
    hanging.flash[place..place + 2].copy_from_slice(&[0xff, 0xcf]);
    let mut mcu = Mcu::with_image(hanging);
    mcu.set_eeprom(simulated.mcu().eeprom());
    let stop = mcu.run_until(5 * u64::from(CLOCK_HZ), &mut Deaf);
    assert_eq!(stop, Stop::Reached);
    // A second of watchdog and a quarter of start at a time.
    assert!(mcu.resets().watchdog >= 3, "{:?}", mcu.resets());
}
