//! The motor never turns unasked: it is off at every reset, off without the PC, off when the tick stalls, and never jumps.

use atmega16_sim::{ResetCause, register};
use bench::simavr::{Event, Probe, Simulated};
use bench::{Ending, Scenario, SerialByte, TimedRequest, arming, uniform};
use hil_tests::{Heard, at, generator, image, seed};
use wire::{Command, Fault, reset_cause};

/// The motor's command with its cycles.
#[derive(Default)]
struct Shaft(Vec<(u64, f64)>);

impl Probe for Shaft {
    fn event(&mut self, at: u64, event: Event) {
        if let Event::Motor { duty } = event {
            self.0.push((at, duty));
        }
    }
}

struct Board {
    simulated: Simulated<Shaft>,
    heard: Heard,
}

impl Board {
    fn new() -> Self {
        Board {
            simulated: Simulated::new(&image(), &Scenario::quiet(1), Shaft::default())
                .expect("an image"),
            heard: Heard::default(),
        }
    }

    fn run(&mut self, until_s: f64) {
        let heard = &mut self.heard;
        let ending = self
            .simulated
            .run_until(until_s, &mut |byte: SerialByte| heard.push(byte))
            .expect("it runs");
        assert_eq!(ending, Ending::Complete);
    }

    /// A hello frame that was asked for after a reset.
    fn hello(&mut self, at_s: f64) -> wire::Hello {
        self.simulated
            .request(&[at(at_s, 9_100, Command::GetHello)]);
        self.run(at_s + 0.5);
        let (_, hello) = self.heard.hellos().last().expect("a hello frame");
        hello
    }

    /// Seconds of the last change of the motor's command.
    fn last_change(&self) -> f64 {
        let &(at, _) = self.simulated.probe().0.last().expect("it turned");
        at as f64 / self.simulated.hz()
    }

    /// Whether the motor was on at any time from `from_s` on.
    fn turned_since(&self, from_s: f64) -> bool {
        let hz = self.simulated.hz();
        let events = &self.simulated.probe().0;
        self.simulated.duty() != 0.0
            || events
                .iter()
                .any(|&(at, duty)| at as f64 / hz >= from_s && duty != 0.0)
    }
}

/// A host that arms the motor and keeps it at a duty from `from_s` to `to_s`.
fn drive(duty: i16, from_s: f64, to_s: f64) -> Vec<TimedRequest> {
    let count = ((to_s - from_s) / 0.1) as u16;
    let mut requests = arming(((from_s - 0.18) * 1e6) as u64, 9_900).to_vec();
    requests.extend((0..count).map(|n| at(from_s + 0.1 * f64::from(n), n, Command::KeepAlive)));
    requests.push(at(from_s + 0.03, 9_000, Command::MotorDuty { duty }));
    requests.sort_by_key(|timed| timed.at_us);
    requests
}

/// Turning at `duty`, its host there until `to_s`, run to `until_s`.
fn turning(duty: i16, to_s: f64, until_s: f64) -> Board {
    let mut board = Board::new();
    board.simulated.request(&drive(duty, 1.0, to_s));
    board.run(until_s);
    let full = (f64::from(duty.abs()) + 1.0) / 256.0;
    assert_eq!(
        board.simulated.duty(),
        full.copysign(f64::from(duty)),
        "it turns"
    );
    board
}

#[test]
fn it_is_off_from_power_on_until_it_is_asked_and_refused_without_a_host() {
    let mut board = Board::new();
    let alone = Command::MotorDuty { duty: 200 };
    board
        .simulated
        .request(&[at(1.0, 1, alone), at(1.5, 2, alone)]);
    board.run(3.0);
    assert!(
        board.simulated.probe().0.is_empty(),
        "{:?}",
        board.simulated.probe().0
    );
    assert!(
        board
            .heard
            .replies()
            .all(|(_, reply)| reply.status == wire::Status::NoKeepAlive)
    );
}

#[test]
fn it_stops_200_ms_after_the_last_keep_alive() {
    for duty in [255, -40] {
        let mut board = Board::new();
        board.simulated.request(&drive(duty, 1.0, 3.0));
        board.run(4.0);
        // The last request of the 20 begins at 2.9 s and takes 22 bytes or fewer of 0.26 ms.
        let stopped = board.last_change();
        assert_eq!(board.simulated.duty(), 0.0);
        assert!((3.1..=3.108).contains(&stopped), "stopped at {stopped} s");
        assert_eq!(board.heard.last_health().faults.get(Fault::MotorTimeout), 1);
        assert!(
            board
                .heard
                .samples()
                .last()
                .is_some_and(|(_, sample)| sample.pwm == 0)
        );
    }
}

#[test]
fn every_kind_of_reset_stops_it_at_once_and_it_stays_off() {
    for (cause, flag) in [
        (ResetCause::External, reset_cause::EXTERNAL),
        (ResetCause::BrownOut, reset_cause::BROWN_OUT),
        (ResetCause::Watchdog, reset_cause::WATCHDOG),
    ] {
        let mut board = turning(120, 2.95, 3.0);
        board.simulated.reset(cause);
        let at_s = board.simulated.time_s();
        let hello = board.hello(5.0);
        assert!(board.last_change() - at_s < 1e-6, "{cause:?}");
        assert!(!board.turned_since(at_s + 1e-6), "{cause:?}");
        assert_eq!((hello.reset_cause, hello.restarts), (flag, 1));
    }
}

#[test]
fn a_tick_that_stalls_ends_in_a_watchdog_reset_with_the_motor_off_though_the_host_is_there() {
    let mut board = turning(120, 6.0, 2.5);
    // Timer 1 stands still: no tick comes any more.
    board
        .simulated
        .mcu_mut()
        .write_register(register::TCCR1B, 0);
    board.run(6.0);
    let stopped = board.last_change();
    // The watchdog waits for 1.04 s after the last sample.
    assert!((2.5..3.6).contains(&stopped), "stopped at {stopped} s");
    assert!(
        !board.turned_since(stopped + 1e-6),
        "the keep-alives alone do not start it"
    );
    assert_eq!(
        board.heard.last_health().faults.get(Fault::WatchdogReset),
        1
    );
    assert!(
        board.heard.samples().last().is_some_and(|(t, _)| t > 5.9),
        "it samples again"
    );
}

/// At full duty, the host silent from 2.9 s on; `meddle` is called each half millisecond from 2.8 s on.
fn left_alone(mut meddle: impl FnMut(&mut Simulated<Shaft>, f64)) -> Board {
    let mut board = turning(255, 3.0, 2.8);
    let mut t = 2.8;
    while t < 7.0 {
        meddle(&mut board.simulated, t);
        t += 0.000_5;
        board.run(t);
    }
    board
}

#[test]
fn a_millisecond_clock_that_was_stopped_runs_again_with_the_next_tick_and_the_motor_is_cut_in_time()
{
    for registers in [
        [(register::TCCR0, 0), (register::OCR0, 249)],
        [(register::TCCR0, 0x0d), (register::OCR0, 255)],
        [(register::TIMSK, 1 << 3), (register::OCR0, 249)],
    ] {
        let mut meddled = false;
        let board = left_alone(|simulated, t| {
            if t > 2.95 && !meddled {
                meddled = true;
                for (address, value) in registers {
                    simulated.mcu_mut().write_register(address, value);
                }
            }
        });
        let stopped = board.last_change();
        // It stood for a tick at the most.
        assert!(
            (3.1..=3.16).contains(&stopped),
            "{registers:?}: {stopped} s"
        );
        assert_eq!(board.simulated.duty(), 0.0);
        let health = board.heard.last_health();
        assert_eq!(health.faults.get(Fault::WatchdogReset), 0);
    }
}

/// `rjmp .-2`, which the runtime's exit ends with.
const FOR_EVER: [u8; 2] = 0xcfff_u16.to_le_bytes();

#[test]
fn a_main_loop_that_hangs_delays_neither_the_motors_cut_nor_the_watchdog() {
    let board = Board::new();
    let flash = &board.simulated.mcu().image().flash;
    let place = flash.chunks_exact(2).position(|word| word == FOR_EVER);
    let at = 2 * place.expect("an instruction that jumps to itself") as u32;
    let mut hangs = None;
    let board = left_alone(|simulated, t| {
        // The keep-alive of 2.9 s has come, and the tick of 2.95 s is done.
        if t > 2.975 && hangs.is_none() && simulated.mcu_mut().wake_at(at) {
            hangs = Some(t);
        }
    });
    let hangs = hangs.expect("it sleeps between two ticks");
    assert!(hangs < 2.985, "{hangs}");
    let stopped = board.last_change();
    assert!((3.1..=3.108).contains(&stopped), "stopped at {stopped} s");
    assert_eq!(board.simulated.duty(), 0.0);
    // The watchdog's second, and the gyros' start.
    let silence = (board.heard.samples())
        .map(|(t, _)| t)
        .filter(|t| *t > hangs);
    let first = silence.reduce(f64::min).expect("it samples again");
    assert!((3.9..4.6).contains(&first), "{first}");
    let health = board.heard.last_health();
    assert_eq!(health.faults.get(Fault::WatchdogReset), 1);
}

#[test]
fn a_millisecond_clock_that_never_moves_ends_in_a_watchdog_reset_with_the_motor_off() {
    let board = left_alone(|simulated, _| {
        // It counts, and never gets to the end.
        simulated.mcu_mut().write_register(register::TCNT0, 0);
    });
    let stopped = board.last_change();
    println!("stopped at {stopped} s");
    assert_eq!(board.simulated.duty(), 0.0);
    assert!(!board.turned_since(stopped + 1e-6));
    // The watchdog's second.
    assert!(stopped < 2.8 + 1.2, "stopped at {stopped} s");
}

#[test]
fn recorded_requests_sent_again_do_not_start_it() {
    // What a host sent that drove it, byte for byte, with the nonce of that session.
    let mut first = Board::new();
    first.simulated.request(&drive(120, 1.0, 2.0));
    first.run(1.5);
    assert_ne!(first.simulated.duty(), 0.0);
    let nonce = (first.heard.replies())
        .find(|(_, reply)| reply.command == wire::code::ARM)
        .map(|(_, reply)| reply.value as u16)
        .expect("it told one");
    let recorded: Vec<_> = (drive(120, 1.0, 2.0).into_iter())
        .map(|mut timed| {
            if let Command::Arm { nonce: said } = &mut timed.request.command
                && *said != 0
            {
                *said = nonce;
            }
            timed
        })
        .collect();
    // Later on the same board, and on one whose sensors' noise is another.
    first.run(4.0);
    let later: Vec<_> = (recorded.iter().copied())
        .map(|mut timed| {
            timed.at_us += 4_000_000;
            timed
        })
        .collect();
    first.simulated.request(&later);
    first.run(7.0);
    assert!(!first.turned_since(4.0));
    let mut other = Board {
        simulated: Simulated::new(&image(), &Scenario::quiet(2), Shaft::default())
            .expect("an image"),
        heard: Heard::default(),
    };
    other.simulated.request(&recorded);
    other.run(3.0);
    assert!(other.simulated.probe().0.is_empty());
    for board in [first, other] {
        let refused = (board.heard.replies())
            .filter(|(_, reply)| reply.command == wire::code::ARM)
            .any(|(_, reply)| reply.status == wire::Status::BadArgument);
        assert!(refused, "the nonce is told to be wrong");
    }
}

#[test]
fn it_rests_for_2_ms_before_it_turns_the_other_way_at_the_steepest_ramp() {
    let mut board = Board::new();
    let mut requests = drive(255, 1.0, 3.0);
    let ramp = Command::MotorLimits {
        max_duty: 255,
        ramp_per_s: u16::MAX,
    };
    requests.push(at(0.7, 9_002, ramp));
    for (n, duty) in (0..8).zip([-255, 255].into_iter().cycle()) {
        let t = 1.2 + 0.2 * f64::from(n);
        requests.push(at(t + 0.033, 9_010 + n, Command::MotorDuty { duty }));
    }
    requests.sort_by_key(|timed| timed.at_us);
    board.simulated.request(&requests);
    board.run(3.0);
    let hz = board.simulated.hz();
    let (mut last, mut turns) = ((0.0, 0.0), 0);
    for &(at, duty) in &board.simulated.probe().0 {
        let t = at as f64 / hz;
        if duty == 0.0 {
            continue;
        }
        let (way, until) = last;
        if way * duty < 0.0 {
            turns += 1;
            assert!(t - until >= 0.002, "{} ms", (t - until) * 1e3);
        }
        // It turned this way until the next event.
        let next = board
            .simulated
            .probe()
            .0
            .iter()
            .find(|&&(next, _)| next > at);
        last = (duty, next.map_or(t, |&(next, _)| next as f64 / hz));
    }
    assert_eq!(turns, 8);
}

#[test]
fn with_any_eeprom_it_is_off_until_asked_and_the_board_samples() {
    let rng = &mut generator(seed());
    for draw in 0..6 {
        let mut board = Board::new();
        let bytes: Vec<u8> = (0..512)
            .map(|_| match draw {
                0 => 0,
                _ => uniform(rng, 0.0, 256.0) as u8,
            })
            .collect();
        board.simulated.mcu_mut().set_eeprom(&bytes);
        board.run(2.0);
        assert!(board.simulated.probe().0.is_empty());
        assert!(board.heard.samples().count() > 30);
        let (_, hello) = board.heard.hellos().next().expect("hello");
        assert_eq!((hello.config_source, hello.period_ticks), (0, 12_500));
        assert!(board.heard.last_health().faults.get(Fault::ConfigInvalid) > 0);
    }
}

#[test]
fn it_never_changes_faster_than_its_ramp_and_turns_round_through_zero() {
    let mut board = Board::new();
    let mut requests = drive(255, 1.0, 6.0);
    requests.push(at(3.033, 9_001, Command::MotorDuty { duty: -255 }));
    requests.sort_by_key(|timed| timed.at_us);
    board.simulated.request(&requests);
    board.run(5.9);
    let hz = board.simulated.hz();
    let events: Vec<(f64, f64)> = (board.simulated.probe().0.iter())
        .map(|&(at, duty)| (at as f64 / hz, duty))
        .collect();
    assert!(
        events.iter().any(|&(_, duty)| duty > 0.99) && events.iter().any(|&(_, duty)| duty < -0.99)
    );
    let mut before = (0.0, 0.0);
    for &(t, duty) in &events {
        // A step is 1/256; from off to the first there are two of them, as fast PWM is never quite off.
        assert!(
            (duty - before.1).abs() <= 2.0 / 256.0 + 1e-9,
            "{before:?} to {t}, {duty}"
        );
        assert!(duty * before.1 >= 0.0, "through zero");
        before = (t, duty);
    }
    // 510 steps a second: any tenth of a second has at most 51, and one at its edge.
    for (n, &(t, duty)) in events.iter().enumerate() {
        let later = events[n..].iter().take_while(|&&(s, _)| s <= t + 0.1);
        let most = later.map(|&(_, d)| (d - duty).abs()).fold(0.0, f64::max);
        assert!(most <= 53.0 / 256.0, "{most} within 0.1 s from {t} s");
    }
}

#[test]
fn power_cut_at_random_cycles_stops_it_and_loses_no_stored_set_up() {
    let seed = seed();
    let rng = &mut generator(seed);
    let (mut old, mut new) = (0, 0);
    for draw in 0..20 {
        let mut board = Board::new();
        let mut requests = drive(100, 1.0, 4.0);
        // A first set-up is stored for good, the second one is being stored when power goes.
        requests.push(at(1.05, 9_010, Command::SetBoardId { board_id: 1 }));
        requests.push(at(1.15, 9_011, Command::StoreConfig));
        requests.push(at(2.55, 9_012, Command::SetBoardId { board_id: 2 }));
        requests.push(at(2.65, 9_013, Command::StoreConfig));
        requests.sort_by_key(|timed| timed.at_us);
        board.simulated.request(&requests);
        let cut = uniform(rng, 2.6, 3.4);
        board.run(cut);
        assert_ne!(board.simulated.duty(), 0.0);
        board.simulated.power_cycle();
        let at_s = board.simulated.time_s();
        let hello = board.hello(5.0);
        assert!(
            !board.turned_since(at_s + 1e-6),
            "draw {draw}, cut at {cut} s"
        );
        assert_eq!(
            (hello.reset_cause, hello.restarts),
            (reset_cause::POWER_ON, 0)
        );
        assert_ne!(
            hello.config_source, 0,
            "draw {draw}: a stored set-up was there, cut at {cut} s"
        );
        match hello.board_id {
            1 => old += 1,
            2 => new += 1,
            other => panic!("draw {draw}: board {other}, which nobody stored; cut at {cut} s"),
        }
    }
    println!("20 cuts: {old} came back with the set-up before, {new} with the new one");
}
