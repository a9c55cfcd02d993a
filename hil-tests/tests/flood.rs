//! No traffic on the line, valid or not, delays the motor's cut or costs more than one sample in four.

use bench::simavr::{Event, Probe, Simulated};
use bench::{Scenario, duty_profile};
use hil_tests::{Heard, at, image};
use wire::{Axis, Command, Fault, Request, encode_request};

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

/// The flood begins at 3 s.
const END_S: f64 = 5.5;

/// What a host sends without a pause.
type Traffic = Box<dyn FnMut(u16) -> Vec<u8>>;

fn frame(number: u16, command: Command) -> Vec<u8> {
    let mut line = [0; Request::FRAME_LEN];
    let len = encode_request(&Request { number, command }, &mut line).expect("a request fits");
    line[..len].to_vec()
}

fn traffics() -> Vec<(&'static str, Traffic)> {
    let of = |command: Command| -> Traffic { Box::new(move |number| frame(number, command)) };
    vec![
        ("pings", of(Command::Ping)),
        ("counters", of(Command::Counters)),
        ("hellos", of(Command::GetHello)),
        (
            "set bias",
            of(Command::SetBias {
                axis: Axis::X,
                value: 0,
            }),
        ),
        (
            "reads of registers",
            of(Command::ReadRegister {
                gyro: Axis::X,
                address: 0x38,
            }),
        ),
        (
            "reads of a correction",
            of(Command::GetCorrection {
                other: false,
                row: 5,
            }),
        ),
        ("stores of the set-up", of(Command::StoreConfig)),
        (
            "motor duty, without keep-alive",
            of(Command::MotorDuty { duty: 255 }),
        ),
        (
            "damaged requests",
            Box::new(|number| {
                let mut bytes = frame(number, Command::Ping);
                bytes[3] ^= 0x40;
                bytes
            }),
        ),
        (
            "bytes by chance",
            Box::new(|number| {
                let spread = |n: u32| (n.wrapping_mul(2_654_435_761) >> 13) as u8;
                (0..19)
                    .map(|k| spread(u32::from(number) * 19 + k))
                    .collect()
            }),
        ),
        ("zeros", Box::new(|_| vec![0; 19])),
        ("one endless frame", Box::new(|_| vec![7; 19])),
    ]
}

/// An EEPROM whose first copy of a correction is in order.
fn with_a_correction() -> Vec<u8> {
    let correction = wire::correction::Correction {
        block_shift: 7,
        sens_avg: 0x0402,
        temp_range: [-60, 60],
        noise: [0.02; 3],
        walk: [1e-7; 3],
        ..wire::correction::Correction::default()
    };
    let numbers = correction.numbers().expect("they fit");
    let mut copy: Vec<u8> = numbers.iter().flat_map(|n| n.to_le_bytes()).collect();
    copy.extend(wire::crc::crc32c(&copy).to_le_bytes());
    let mut eeprom = vec![0xff; 512];
    eeprom[144..144 + copy.len()].copy_from_slice(&copy);
    eeprom
}

/// From 3 s on nothing but this traffic, at a rate and a speed of the line, with a correction in use or without.
fn flooded(
    mut traffic: Traffic,
    (period_ticks, divisor, corrected): (u16, u16, bool),
) -> (Simulated<Shaft>, Heard) {
    let mut simulated =
        Simulated::new(&image(), &Scenario::quiet(8), Shaft::default()).expect("an image");
    if corrected {
        simulated.mcu_mut().set_eeprom(&with_a_correction());
    }
    let mut requests = vec![
        at(0.5, 900, Command::SetBaud { divisor }),
        at(
            0.7,
            901,
            Command::SetRate {
                period_ticks,
                periods_per_sample: 1,
            },
        ),
    ];
    requests.extend(duty_profile(&[(1.0, 255)], 2.95));
    simulated.request(&requests);
    let mut heard = Heard::default();
    let (mut t, mut number) = (3.0, 0);
    let mut run = |simulated: &mut Simulated<Shaft>, t: f64| {
        simulated
            .run_until(t, &mut |byte| heard.push(byte))
            .expect("it runs");
    };
    run(&mut simulated, t);
    while t < END_S {
        while simulated.mcu().host_queue() < 60 {
            number += 1;
            simulated.send(&traffic(number));
        }
        t += 0.000_5;
        run(&mut simulated, t);
    }
    (simulated, heard)
}

#[test]
fn no_traffic_delays_the_motors_cut_or_costs_more_than_one_sample_in_four() {
    for setting in [
        (12_500, 25, false),
        (12_500, 3, false),
        (976, 3, false),
        (976, 3, true),
    ] {
        let (period_ticks, _, corrected) = setting;
        for (name, traffic) in traffics() {
            let (simulated, heard) = flooded(traffic, setting);
            let is_corrected =
                |(_, frame): &(f64, wire::Frame)| matches!(frame, wire::Frame::Corrected(_));
            assert_eq!(heard.frames.iter().any(is_corrected), corrected);
            let hz = simulated.hz();
            let &(last, duty) = simulated.probe().0.last().expect("it turned");
            let stopped = last as f64 / hz;
            let expected = (END_S - 3.0) / (f64::from(period_ticks) * 4e-6);
            let got = heard
                .samples()
                .filter(|&(t, _)| (3.0..END_S).contains(&t))
                .count();
            let health = heard.last_health();
            println!(
                "{setting:?}, {name}: stopped at {stopped:.4} s, {got} of {expected:.0} samples, \
                 {} replies, {} bytes lost, {} replies dropped",
                heard.replies().filter(|&(t, _)| t > 3.0).count(),
                health.faults.get(Fault::RxOverrun),
                health.faults.get(Fault::ReportDropped)
            );
            assert_eq!(duty, 0.0);
            // The last keep-alive of duty_profile begins at 2.9 s and takes 19 bytes, 5 ms at most.
            assert!(
                (3.1..=2.905 + 0.202).contains(&stopped),
                "{name}: stopped at {stopped} s"
            );
            assert!(
                got as f64 >= 0.75 * expected,
                "{name}: {got} of {expected:.0} samples"
            );
            assert_eq!(health.faults.get(Fault::WatchdogReset), 0);
        }
    }
}
