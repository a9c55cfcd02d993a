//! The stack never meets the statics, whatever is asked while a tick is being served.

use atmega16_sim::Image;
use bench::Scenario;
use bench::simavr::{NoProbe, Simulated};
use hil_tests::calls::{recursion, stack_bound};
use hil_tests::{Heard, at, generator, image, run, seed};
use wire::{Axis, Command, Fault, Sensor, Shape};

/// The ATmega16 has that many, reset included.
const VECTORS: usize = 21;
/// Where its SRAM begins.
const SRAM: usize = 0x60;

/// Where the statics of the image end, an address of SRAM.
fn end_of_statics(simulated: &Simulated<NoProbe>) -> u32 {
    let end = simulated.mcu().image().symbol("_end");
    end.expect("the linker's") & 0xffff
}

#[test]
fn the_deepest_stack_leaves_room_with_every_command_at_any_phase_of_the_tick() {
    let seconds = 60.0;
    let mut run = run(Scenario::lively(21), seconds);
    let asked = [
        Command::Ping,
        Command::KeepAlive,
        Command::Arm { nonce: 0 },
        Command::Arm { nonce: 7 },
        Command::GetHello,
        Command::Counters,
        Command::ReadRegister {
            gyro: Axis::Y,
            address: 0x38,
        },
        Command::WriteRegister {
            gyro: Axis::Z,
            address: 0x36,
            value: 1,
        },
        Command::SetAccRange { range: 0 },
        Command::SetGyro {
            range: 4,
            filter: 2,
        },
        Command::SetBias {
            axis: Axis::X,
            value: 12_345,
        },
        Command::SetScale {
            axis: Axis::Z,
            value: 1_200_000,
        },
        Command::MotorDuty { duty: 10 },
        Command::MotorProfile {
            shape: Shape::Sine,
            amplitude: 50,
            offset: 0,
            period_ms: 700,
            cycles: 0,
        },
        Command::MotorLimits {
            max_duty: 200,
            ramp_per_s: 500,
        },
        Command::BiasNull { samples: 24 },
        Command::SelfTest {
            sensor: Sensor::GyroX,
        },
        Command::SelfTest {
            sensor: Sensor::Accelerometer,
        },
        Command::StoreConfig,
        Command::LoadConfig,
        Command::DefaultConfig,
        Command::SetBoardId { board_id: 3 },
    ];
    let rng = &mut generator(seed());
    let mut t = 1.0;
    let mut number = 0;
    while t < seconds - 2.0 {
        let which = bench::uniform(rng, 0.0, asked.len() as f64) as usize;
        run.requests.push(at(t, number, asked[which]));
        number += 1;
        t += bench::uniform(rng, 0.008, 0.08);
    }
    let mut simulated = Simulated::new(&image(), &run.scenario, NoProbe).expect("an image");
    simulated.request(&run.requests);
    simulated.mcu_mut().watch_stack();
    let mut heard = Heard::default();
    let ended = simulated.run_until(seconds, &mut |byte| heard.push(byte));
    let lowest = simulated.mcu().min_stack_pointer().expect("watched");
    let end = end_of_statics(&simulated);
    println!(
        "{number} requests: deepest stack {} B, {} B between it and the statics, which end at {end:#x}",
        0x45f - u32::from(lowest),
        (u32::from(lowest) + 1).saturating_sub(end)
    );
    assert!(
        u32::from(lowest) >= end,
        "the stack went down to {lowest:#x}, the statics end at {end:#x}"
    );
    ended.expect("it runs");
    assert_eq!(heard.link().rejected(), 0);
    let health = heard.last_health();
    let said = u32::from(health.stack_free);
    let left = u32::from(lowest) + 1 - end;
    // The board looks at what it painted: a frame's bytes that were never written hide some, and so does what has happened
    // since the health frame. It must never claim less than was left, nor much more.
    assert!(
        said + 1 >= left && said <= left + 64,
        "the board says {said} B were left, there were {left}"
    );
}

#[test]
fn a_stack_that_came_near_the_statics_is_told_to_the_byte_and_counted() {
    const LEFT: u16 = 20;
    let mut simulated = Simulated::new(&image(), &Scenario::quiet(2), NoProbe).expect("an image");
    let mut heard = Heard::default();
    let mut run = |simulated: &mut Simulated<NoProbe>, until_s: f64| {
        (simulated.run_until(until_s, &mut |byte| heard.push(byte))).expect("it runs");
        let health = heard.last_health();
        (health.stack_free, health.faults.get(Fault::StackLow))
    };
    let (free, low) = run(&mut simulated, 2.5);
    assert!(free > 64 && low == 0, "{free} B left, {low} times low");
    // What a call that deep would have left there.
    let end = end_of_statics(&simulated);
    let place = end as usize + usize::from(LEFT) - SRAM;
    simulated.mcu_mut().sram_mut()[place] = 0;
    let (free, low) = run(&mut simulated, 5.6);
    assert_eq!(free, LEFT);
    assert_eq!(low, 3, "once in each health frame");
}

#[test]
fn no_function_calls_itself() {
    // The compiler is told so (.cargo/config.toml) and leaves out what a recursion would need; and the stack has a bound.
    let image = Image::read(&image()).expect("an image");
    let recursion = recursion(&image.flash, VECTORS);
    assert_eq!(recursion, Ok(None), "addresses of the functions");
}

/// From the call graph: the main program at its deepest, the guard of the tick on top of it, which runs with interrupts on,
/// and the deepest of the interrupts that may come in there, which do not let each other in.
#[test]
fn the_stacks_bound_from_the_call_graph_leaves_room() {
    const GUARD: usize = 7;
    /// The motor's stop, compare A of timer 1, the USART's two, the millisecond; no other is ever enabled.
    const OTHERS: [usize; 5] = [1, 6, 11, 12, 19];
    /// What has to be left beside the bound, bytes.
    const SPARE: u32 = 64;
    let image = Image::read(&image()).expect("an image");
    let of = |vector: usize| stack_bound(&image.flash, 2 * vector).expect("calls can be followed");
    let deepest = OTHERS.map(of).into_iter().max().unwrap_or(0);
    let bound = of(0) + 2 + of(GUARD) + 2 + deepest;
    let end = image.symbol("_end").expect("the linker's") & 0xffff;
    println!(
        "main {} B, guard {} B, another interrupt {deepest} B: {bound} B of {}",
        of(0),
        of(GUARD),
        0x460 - end
    );
    assert!(
        end + bound + SPARE <= 0x460,
        "{bound} B, the statics end at {end:#x}"
    );
}
