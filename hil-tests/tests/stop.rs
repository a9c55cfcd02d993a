//! The motor's stop, a contact from PD2 to ground: it cuts the motor at once whatever hangs, nothing drives through it, it moves no
//! sample, and the motor stays off until it is armed anew.

use std::collections::BTreeSet;

use atmega16_sim::{ResetCause, register};
use bench::simavr::{Event, Probe, Simulated};
use bench::{Ending, Scenario, SerialByte, TOLD_NONCE, uniform};
use hil_tests::{Heard, at, generator, image, seed};
use wire::{Command, Fault, Shape, Status};

/// Cycles of a microsecond.
const US: u64 = 16;
/// Compare A of timer 1: the tick.
const TICK: u8 = 6;
/// The longest stretch with interrupts off or interrupt, and its own; from the guard of a tick to the end of its first round over
/// the sensors its interrupt is masked, or it would move the sample, and the edge is looked for: 4 us of sleep before the tick and
/// the way to the first bit to a gyro are the longest.
const AT_ONCE_US: u64 = 12;

/// Cycles of what the stop concerns.
#[derive(Default)]
struct Seen {
    motor: Vec<(u64, f64)>,
    ticks: Vec<u64>,
    /// From a tick to the first bit to a gyro, and from tick to tick.
    first_bit: BTreeSet<u64>,
    periods: BTreeSet<u64>,
    waits_for_bit: bool,
}

impl Probe for Seen {
    fn event(&mut self, at: u64, event: Event) {
        match event {
            Event::Motor { duty } => self.motor.push((at, duty)),
            Event::Interrupt { vector: TICK } => {
                if let Some(last) = self.ticks.last() {
                    self.periods.insert(at - last);
                }
                self.ticks.push(at);
                self.waits_for_bit = true;
            }
            Event::Spi { cycles, .. } if std::mem::take(&mut self.waits_for_bit) => {
                let tick = self.ticks.last().copied().unwrap_or_default();
                self.first_bit.insert(at - cycles - tick);
            }
            _ => {}
        }
    }
}

struct Board {
    simulated: Simulated<Seen>,
    heard: Heard,
    number: u16,
}

impl Board {
    fn new(scenario: &Scenario) -> Self {
        let mut board = Board {
            simulated: Simulated::new(&image(), scenario, Seen::default()).expect("an image"),
            heard: Heard::default(),
            number: 0,
        };
        board.run(1.0);
        board
    }

    fn run(&mut self, seconds: f64) {
        let heard = &mut self.heard;
        let until = self.simulated.time_s() + seconds;
        let ending = (self.simulated)
            .run_until(until, &mut |byte: SerialByte| heard.push(byte))
            .expect("it runs");
        assert_eq!(ending, Ending::Complete);
    }

    /// Asks, and what the board replies.
    fn ask(&mut self, command: Command) -> wire::Reply {
        self.number += 1;
        self.simulated
            .request(&[at(self.simulated.time_s(), self.number, command)]);
        // A reply waits for the line and for what is being sampled.
        let replied = |board: &Self| board.heard.replies().last().map(|(_, reply)| reply);
        for _ in 0..30 {
            self.run(0.003);
            if let Some(reply) = replied(self).filter(|reply| reply.number == self.number) {
                return reply;
            }
        }
        panic!("no reply to {command:?}");
    }

    /// Arms the motor and has it at full duty, or what was refused.
    fn start(&mut self) -> Result<(), Status> {
        let limits = Command::MotorLimits {
            max_duty: 255,
            ramp_per_s: u16::MAX,
        };
        for command in [
            limits,
            Command::Arm { nonce: 0 },
            Command::Arm { nonce: TOLD_NONCE },
            Command::MotorDuty { duty: 255 },
            Command::KeepAlive,
        ] {
            match self.ask(command).status {
                Status::Ok => {}
                refused => return Err(refused),
            }
        }
        self.run(0.01);
        assert_eq!(self.simulated.duty(), 1.0, "it turns");
        Ok(())
    }

    /// Runs until the motor is cut, 3 ms at the most; how long that took.
    fn cut_after_us(&mut self) -> f64 {
        let began = self.simulated.mcu().cycle();
        self.run(0.003);
        let motor = &self.simulated.probe().motor;
        let &(at, duty) = motor.last().expect("it turned");
        assert_eq!(duty, 0.0, "it is not cut");
        at.saturating_sub(began) as f64 / US as f64
    }

    fn timeouts(&mut self) -> u16 {
        self.ask(Command::Counters);
        self.run(0.1);
        self.heard.last_health().faults.get(Fault::MotorTimeout)
    }

    fn turned_since(&self, cycle: u64) -> bool {
        let motor = &self.simulated.probe().motor;
        self.simulated.duty() != 0.0 || motor.iter().any(|&(at, duty)| at > cycle && duty != 0.0)
    }
}

/// Runs on to so many microseconds before or behind the next tick but one.
fn run_to_phase(board: &mut Board, us: f64) {
    let last = board.simulated.probe().ticks.last().copied();
    let cycle = last.expect("it samples") as f64 + 2.0 * 800_000.0 + us * US as f64;
    let seconds = cycle / board.simulated.hz() - board.simulated.time_s();
    board.run(seconds);
}

#[test]
fn a_press_cuts_full_duty_within_microseconds_at_any_phase_of_the_tick() {
    let rng = &mut generator(seed());
    let mut board = Board::new(&Scenario::quiet(1));
    // About the tick in steps, and anywhere.
    let mut phases: Vec<f64> = (-35..35).map(|n| f64::from(n) * 2.5).collect();
    phases.extend((0..40).map(|_| uniform(rng, -40_000.0, -200.0)));
    let (mut longest, mut elsewhere) = (0.0f64, 0.0f64);
    for (n, phase) in phases.into_iter().enumerate() {
        board.start().expect("nothing is pressed");
        run_to_phase(&mut board, phase);
        board.simulated.press_stop(true);
        // Half of them are let go before anybody could have looked.
        if n % 2 == 0 {
            board.run(2e-6);
            board.simulated.press_stop(false);
        }
        let took = board.cut_after_us();
        longest = longest.max(took);
        if !(-80.0..40.0).contains(&phase) {
            elsewhere = elsewhere.max(took);
        }
        let since = board.simulated.mcu().cycle();
        board.run(0.03);
        board.simulated.press_stop(false);
        board.run(0.1);
        let still = board.ask(Command::KeepAlive).status;
        let refused = board.ask(Command::MotorDuty { duty: 255 }).status;
        assert_eq!((still, refused), (Status::Stopped, Status::Stopped));
        board.run(0.3);
        assert!(!board.turned_since(since), "phase {phase} us");
    }
    println!("{longest:.1} us at the longest, {elsewhere:.1} us where no sample is being taken");
    assert!(longest < AT_ONCE_US as f64, "{longest} us");
    assert_eq!(board.timeouts(), 0, "a stop is no fault");
}

/// `rjmp .-2`, which the runtime's exit ends with.
const FOR_EVER: [u8; 2] = 0xcfff_u16.to_le_bytes();

#[test]
fn it_cuts_the_motor_with_the_main_loop_hung_and_the_millisecond_clock_stopped() {
    let mut board = Board::new(&Scenario::quiet(1));
    board.start().expect("nothing is pressed");
    let flash = &board.simulated.mcu().image().flash;
    let place = flash.chunks_exact(2).position(|word| word == FOR_EVER);
    let forever = 2 * place.expect("an instruction that jumps to itself") as u32;
    // Between two ticks it sleeps.
    run_to_phase(&mut board, -20_000.0);
    while !board.simulated.mcu_mut().wake_at(forever) {
        board.run(1e-5);
    }
    let mcu = board.simulated.mcu_mut();
    mcu.write_register(register::TCCR0, 0);
    board.run(0.002);
    assert_eq!(board.simulated.duty(), 1.0, "nothing else stops it");
    board.simulated.press_stop(true);
    let took = board.cut_after_us();
    println!("{took} us");
    assert!(took < 5.0, "{took} us");
    let since = board.simulated.mcu().cycle();
    board.simulated.press_stop(false);
    // The watchdog's reset is among that.
    board.run(3.0);
    assert!(!board.turned_since(since));
}

/// Everything that would drive it, and the return of a nonce.
fn driving(nonce: u16) -> [Command; 4] {
    [
        Command::MotorDuty { duty: 1 },
        Command::MotorProfile {
            shape: Shape::Sine,
            amplitude: 100,
            offset: 0,
            period_ms: 500,
            cycles: 0,
        },
        Command::KeepAlive,
        Command::Arm { nonce },
    ]
}

#[test]
fn a_stop_that_is_held_refuses_to_arm_and_to_drive_and_one_let_go_asks_for_a_new_nonce() {
    let mut board = Board::new(&Scenario::quiet(1));
    board.simulated.press_stop(true);
    assert_eq!(board.ask(Command::Arm { nonce: 0 }).status, Status::Stopped);
    for command in driving(7) {
        assert_eq!(board.ask(command).status, Status::Stopped, "{command:?}");
    }
    assert_eq!(board.ask(Command::MotorDuty { duty: 0 }).status, Status::Ok);
    board.simulated.press_stop(false);
    for command in driving(7) {
        assert_eq!(board.ask(command).status, Status::Stopped, "{command:?}");
    }
    // One that is pressed between the nonce and its return.
    assert_eq!(board.ask(Command::Arm { nonce: 0 }).status, Status::Ok);
    board.simulated.press_stop(true);
    board.run(1e-5);
    board.simulated.press_stop(false);
    for command in driving(TOLD_NONCE).into_iter().rev() {
        assert_eq!(board.ask(command).status, Status::Stopped, "{command:?}");
    }
    assert!(board.simulated.probe().motor.is_empty());
    // With a nonce of its own it turns; without arming it is only not armed.
    assert_eq!(board.ask(Command::Arm { nonce: 0 }).status, Status::Ok);
    let duty = Command::MotorDuty { duty: 9 };
    assert_eq!(board.ask(duty).status, Status::NoKeepAlive);
    board.start().expect("it is let go");
    board.run(0.3);
    assert_eq!(board.timeouts(), 1, "a host that fell silent still is one");
    // Nor does a keep-alive from before the stop arm it.
    board.start().expect("nothing is pressed");
    let armed = board.simulated.time_s();
    board.simulated.press_stop(true);
    board.run(1e-5);
    board.simulated.press_stop(false);
    assert_eq!(board.ask(Command::Arm { nonce: 0 }).status, Status::Ok);
    assert_eq!(board.ask(duty).status, Status::NoKeepAlive);
    assert!(board.simulated.time_s() - armed < 0.15);
}

#[test]
fn a_stop_whose_edge_was_missed_cuts_the_motor_with_the_next_millisecond_and_stays() {
    let mut board = Board::new(&Scenario::quiet(1));
    board.start().expect("nothing is pressed");
    run_to_phase(&mut board, -20_000.0);
    // As if the interrupt had never been: its enable off over the edge, and its flag cleared.
    let mcu = board.simulated.mcu_mut();
    mcu.write_register(register::GICR, 0);
    board.simulated.press_stop(true);
    let mcu = board.simulated.mcu_mut();
    mcu.write_register(register::GIFR, 1 << 6);
    mcu.write_register(register::GICR, 1 << 6);
    let took = board.cut_after_us();
    println!("{took} us");
    assert!(took < 1_200.0, "{took} us");
    let since = board.simulated.mcu().cycle();
    board.simulated.press_stop(false);
    for command in driving(7) {
        assert_eq!(board.ask(command).status, Status::Stopped, "{command:?}");
    }
    assert!(!board.turned_since(since));
}

#[test]
fn one_that_is_held_over_a_reset_is_found_though_it_has_no_edge() {
    for cause in [ResetCause::PowerOn, ResetCause::Watchdog] {
        let mut board = Board::new(&Scenario::quiet(1));
        board.simulated.press_stop(true);
        board.run(0.01);
        board.simulated.reset(cause);
        board.run(1.0);
        assert_eq!(board.start(), Err(Status::Stopped), "{cause:?}");
        assert!(board.simulated.probe().motor.is_empty());
        board.simulated.press_stop(false);
        board.start().expect("it is let go");
    }
}

#[test]
fn presses_at_any_phase_move_no_sample() {
    let rng = &mut generator(seed());
    let mut board = Board::new(&Scenario::quiet(1));
    // Close round the tick, where one would: to the cycle, with bounces; and anywhere else.
    for n in 0..400 {
        let phase = match n % 4 {
            0 => uniform(rng, -49_000.0, 0.0),
            1 => uniform(rng, -66.0, 45.0),
            _ => uniform(rng, -5.0, 1.0),
        };
        run_to_phase(&mut board, phase);
        for _ in 0..3 {
            board.simulated.press_stop(true);
            board.run(uniform(rng, 0.2e-6, 4e-6));
            board.simulated.press_stop(false);
            board.run(0.4e-6);
        }
    }
    let seen = board.simulated.probe();
    println!("{:?} {:?}", seen.periods, seen.first_bit);
    assert!(seen.ticks.len() > 400, "{}", seen.ticks.len());
    assert_eq!(seen.periods.iter().copied().collect::<Vec<_>>(), [800_000]);
    assert_eq!(seen.first_bit.len(), 1, "{:?}", seen.first_bit);
}

#[test]
fn a_press_that_the_scenario_holds_is_one() {
    let mut scenario = Scenario::quiet(1);
    scenario.stop_pressed = vec![[2.0, 2.5]];
    let mut board = Board::new(&scenario);
    board.run(2.2 - board.simulated.time_s());
    assert_eq!(board.start(), Err(Status::Stopped));
    board.run(2.6 - board.simulated.time_s());
    board.start().expect("it is let go");
}
