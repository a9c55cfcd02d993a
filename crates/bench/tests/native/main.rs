//! The firmware's logic on the simulated stand, by its bytes.

mod board;

use std::ops::ControlFlow;
use std::time::Instant;

use bench::scenario::StallFlags;
use bench::{Ending, Fault, Run, Scenario, Timeline, duty_profile, native};
use wire::{Command, Decoder, Frame, Request, Sample, Status, flags};

struct Heard {
    frames: Vec<(f64, Frame)>,
    bad: u32,
}

impl Heard {
    fn samples(&self) -> Vec<Sample> {
        self.frames
            .iter()
            .filter_map(|(_, frame)| match frame {
                Frame::Sample(sample) => Some(*sample),
                _ => None,
            })
            .collect()
    }

    fn replies(&self) -> Vec<wire::Reply> {
        self.frames
            .iter()
            .filter_map(|(_, frame)| match frame {
                Frame::Reply(reply) => Some(*reply),
                _ => None,
            })
            .collect()
    }
}

fn hear(run: &Run) -> Heard {
    let mut decoder = Decoder::new();
    let mut frames = Vec::new();
    let ending = native(run, &Timeline::default(), |byte| {
        if let Some(Ok(frame)) = decoder.push(byte.byte) {
            frames.push((byte.time_s, frame));
        }
        ControlFlow::Continue(())
    });
    assert_eq!(ending, Ending::Complete);
    Heard {
        frames,
        bad: decoder.counts().rejected(),
    }
}

fn run(scenario: Scenario, seconds: f64) -> Run {
    let mut run = Run {
        scenario,
        seconds,
        requests: Vec::new(),
    };
    run.scenario.seconds = seconds;
    run
}

#[test]
fn a_sound_stand_gives_600_s_of_frames_in_order() {
    let begun = Instant::now();
    let heard = hear(&run(Scenario::lively(1), 600.0));
    let wall = begun.elapsed();
    let samples = heard.samples();
    assert_eq!(heard.bad, 0);
    // 0.23 s of start, then one sample each 50 ms.
    assert!(
        (11_990..=12_000).contains(&samples.len()),
        "{}",
        samples.len()
    );
    for (k, sample) in samples.iter().enumerate() {
        assert_eq!(sample.seq, k as u16);
        assert_eq!(sample.t_ticks, (k as u32 + 1) * 12_500);
        assert_eq!(sample.flags, flags::IN_ORDER, "sample {k}");
    }
    assert!(matches!(heard.frames[0].1, Frame::Hello(hello) if hello.next_seq == 0));
    println!("600 s in {:.3} s", wall.as_secs_f64());
}

#[test]
fn the_same_seed_gives_the_same_bytes_and_another_seed_others() {
    let bytes = |seed| {
        let mut bytes = Vec::new();
        native(
            &run(Scenario::lively(seed), 20.0),
            &Timeline::default(),
            |byte| {
                bytes.push(byte.byte);
                ControlFlow::Continue(())
            },
        );
        bytes
    };
    assert_eq!(bytes(5), bytes(5));
    assert_ne!(bytes(5), bytes(6));
}

#[test]
fn spi_bytes_behind_the_timelines_last_follow_each_other() {
    let all = Timeline::default();
    let short = Timeline {
        spi_bytes: all.spi_bytes[..10].to_vec(),
        ..all.clone()
    };
    let heard = |timeline: &Timeline| {
        let mut decoder = Decoder::new();
        let mut samples = Vec::new();
        native(&run(Scenario::quiet(4), 20.0), timeline, |byte| {
            if let Some(Ok(Frame::Sample(sample))) = decoder.push(byte.byte) {
                samples.push(sample);
            }
            ControlFlow::Continue(())
        });
        samples
    };
    let (short, all) = (heard(&short), heard(&all));
    assert_eq!(short.len(), all.len());
    assert!(short.iter().all(|s| s.flags == flags::IN_ORDER));
}

#[test]
fn the_motor_turns_while_the_host_is_there_and_stops_without() {
    let mut run = run(Scenario::quiet(2), 20.0);
    run.requests = duty_profile(&[(2.0, 200), (6.0, -100)], 10.0);
    let heard = hear(&run);
    let samples = heard.samples();
    let pwm = |t: f64| samples[(t * 20.0) as usize].pwm;
    assert_eq!((pwm(1.0), pwm(4.0), pwm(8.0), pwm(12.0)), (0, 200, -100, 0));
    assert_eq!(heard.replies().len(), run.requests.len());
    assert!(
        heard
            .replies()
            .iter()
            .all(|reply| reply.status == Status::Ok)
    );
}

#[test]
fn the_motors_stop_ends_it_until_it_is_armed_anew() {
    // Held for a while, and for less than a millisecond.
    for held in [0.5, 4e-4] {
        let mut run = run(Scenario::quiet(2), 10.0);
        run.scenario.stop_pressed = vec![[4.000_3, 4.000_3 + held]];
        run.requests = duty_profile(&[(2.0, 200)], 6.0);
        let again = bench::arming(6_500_000, 900);
        run.requests.extend(again);
        let heard = hear(&run);
        let samples = heard.samples();
        let pwm = |t: f64| samples[(t * 20.0) as usize].pwm;
        assert_eq!((pwm(3.5), pwm(4.5), pwm(5.9)), (200, 0, 0));
        let (before, after): (Vec<_>, Vec<_>) =
            (heard.replies().into_iter()).partition(|reply| reply.status == Status::Ok);
        assert_eq!(before.last().map(|reply| reply.number), Some(901));
        let stopped = after.iter().all(|reply| reply.status == Status::Stopped);
        assert!(stopped && after.len() == 20, "{}", after.len());
    }
}

#[test]
fn a_stop_that_was_pressed_and_let_go_before_the_motor_is_armed_refuses_nothing() {
    let mut run = run(Scenario::quiet(2), 6.0);
    run.scenario.stop_pressed = vec![[1.0, 1.2]];
    run.requests = duty_profile(&[(2.0, 200)], 5.0);
    let heard = hear(&run);
    let refused = heard.replies().into_iter();
    let refused: Vec<_> = refused.filter(|r| r.status != Status::Ok).collect();
    assert!(refused.is_empty(), "{refused:?}");
    assert_eq!(heard.samples()[80].pwm, 200);
}

#[test]
fn a_bias_null_takes_the_bias_off_the_rates() {
    let mut run = run(Scenario::quiet(3), 40.0);
    run.scenario.gyros[0].turn_on_bias_dps = 2.0;
    run.scenario.gyros[0].rate_random_walk = 0.0;
    run.requests = vec![bench::TimedRequest {
        at_us: 2_000_000,
        request: Request {
            number: 9,
            command: Command::BiasNull { samples: 200 },
        },
    }];
    let heard = hear(&run);
    let replies = heard.replies();
    assert_eq!(
        (replies.len(), replies[0].number, replies[0].status),
        (1, 9, Status::Ok)
    );
    let after: Vec<f64> = heard.samples()[400..]
        .iter()
        .map(|s| f64::from(s.rate[0]) / 65536.0)
        .collect();
    let mean = after.iter().sum::<f64>() / after.len() as f64;
    // 0.393 deg/s a sample: the null's error is 0.028, the mean's 0.02; 5 standard deviations.
    assert!(
        mean.abs() < 5.0 * 0.393 * (1.0 / 200.0 + 1.0 / after.len() as f64).sqrt(),
        "{mean}"
    );
}

#[test]
fn stalls_glitches_dead_lines_and_lost_bytes_show_as_what_they_are() {
    let stalled = run(
        Scenario::quiet(4).with(Fault::Stall {
            gyro: 1,
            count: 3,
            length_s: 0.4,
            flags: StallFlags::NewDataClear,
        }),
        60.0,
    );
    let old = hear(&stalled)
        .samples()
        .iter()
        .filter(|s| s.flags & flags::NEW_Y == 0)
        .count();
    assert!((15..=27).contains(&old), "{old} samples marked old");

    let dead = run(
        Scenario::quiet(4).with(Fault::DeadSpi {
            gyro: 2,
            start_s: 10.0,
            end_s: 11.0,
            level: true,
        }),
        20.0,
    );
    let silent = hear(&dead)
        .samples()
        .iter()
        .filter(|s| s.flags & flags::GYRO_NOT_ANSWERING != 0)
        .count();
    assert!(
        (19..=21).contains(&silent),
        "{silent} samples without gyro z"
    );

    let lossy = run(Scenario::quiet(4).with(Fault::LossyLine { count: 5 }), 60.0);
    let heard = hear(&lossy);
    assert!((1..=5).contains(&heard.bad), "{} damaged frames", heard.bad);
}

#[test]
fn a_request_that_is_due_waits_until_the_one_before_it_has_its_answer() {
    let mut run = run(Scenario::quiet(2), 3.0);
    let [first, mut second] = bench::arming(1_000_000, 1);
    // The first takes 5 ms on the line; the second says the nonce of its answer.
    second.at_us = first.at_us + 1_000;
    run.requests = vec![first, second];
    let replies = hear(&run).replies();
    let told = |of: usize| (replies[of].status, replies[of].value);
    // A question is answered by a nonce, the right nonce by 0.
    assert_eq!(replies.len(), 2);
    assert!(told(0).0 == Status::Ok && told(0).1 != 0);
    assert_eq!(told(1), (Status::Ok, 0));
}

#[test]
fn a_stored_set_up_outlasts_a_reboot() {
    let mut run = run(Scenario::quiet(2), 6.0);
    let commands = [
        Command::SetBoardId { board_id: 4242 },
        Command::StoreConfig,
        Command::SetBoardId { board_id: 17 },
        Command::Reboot,
        Command::GetHello,
    ];
    run.requests = (0u16..)
        .zip(commands)
        .map(|(number, command)| bench::TimedRequest {
            at_us: 1_000_000 + u64::from(number) * 900_000,
            request: Request { number, command },
        })
        .collect();
    let heard = hear(&run);
    let mut hellos = heard.frames.iter().filter_map(|(_, frame)| match frame {
        Frame::Hello(hello) => Some(hello.board_id),
        _ => None,
    });
    assert_eq!(hellos.next_back(), Some(4242));
}

#[test]
fn a_register_that_reads_as_written_is_ok_and_one_that_does_not_is_told() {
    let mut run = run(Scenario::quiet(4), 3.0);
    let write = |number, address, value| bench::TimedRequest {
        at_us: 1_000_000 + u64::from(number) * 300_000,
        request: wire::Request {
            number,
            command: Command::WriteRegister {
                gyro: wire::Axis::Y,
                address,
                value,
            },
        },
    };
    // SENS/AVG as it is, and GYRO_OFF, which has twelve bits.
    run.requests = vec![write(1, 0x38, 0x0402), write(2, 0x14, 0xffff)];
    let replies = hear(&run).replies();
    let told: Vec<_> = replies
        .iter()
        .map(|r| (r.number, r.status, r.value))
        .collect();
    let wanted = [
        (1, wire::Status::Ok, 0x0402),
        (2, wire::Status::ReadBackWrong, 0x0fff),
    ];
    assert_eq!(told, wanted);
}
