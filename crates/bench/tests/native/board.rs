//! What the host's board is to the logic: a line with its speed and its queue, an EEPROM that takes time, pins, a watchdog.

use super::*;
use bench::{Motor, TimedRequest};

const HZ: f64 = 16e6;

fn ask(at_s: f64, number: u16, command: Command) -> TimedRequest {
    TimedRequest {
        at_us: (at_s * 1e6) as u64,
        request: Request { number, command },
    }
}

/// A stand whose parts have no errors, so that what is read is what is there.
fn ideal(seconds: f64, requests: Vec<TimedRequest>) -> Run {
    let mut run = run(Scenario::quiet(5), seconds);
    for gyro in &mut run.scenario.gyros {
        (gyro.turn_on_bias_dps, gyro.scale_error) = (0.0, 0.0);
    }
    run.scenario.acc = bench::scenario::AccPart::default();
    run.scenario.base.tilt_deg = [0.0; 2];
    run.requests = requests;
    run
}

/// Bytes with the cycle at which each has ended.
fn bytes(run: &Run, timeline: &Timeline) -> Vec<(u64, u8)> {
    let mut all = Vec::new();
    native(run, timeline, |byte| {
        all.push(((byte.time_s * HZ).round() as u64, byte.byte));
        ControlFlow::Continue(())
    });
    all
}

fn reply_at(heard: &Heard, number: u16) -> f64 {
    let found = heard.frames.iter().find(
        |(_, frame)| matches!(frame, Frame::Reply(reply) if reply.number == number && reply.status == Status::Ok),
    );
    found.expect("an answer").0
}

#[test]
fn bytes_follow_each_other_at_the_lines_speed_and_a_new_one_holds_from_the_reply_on() {
    let set = ask(1.5, 1, Command::SetBaud { divisor: 3 });
    let all = bytes(&ideal(3.0, vec![set]), &Timeline::default());
    let (mut decoder, mut changed) = (Decoder::new(), None);
    for &(at, byte) in &all {
        if let Some(Ok(Frame::Reply(_))) = decoder.push(byte) {
            changed = Some(at);
        }
    }
    let changed = changed.expect("the reply");
    // Ten bits of 16 (divisor + 1) cycles; between frames the line rests.
    for (from, to, cycles) in [(0, changed, 4_160), (changed, u64::MAX, 640)] {
        let steps = all.windows(2).map(|two| (two[0].0, two[1].0));
        let steps: Vec<u64> = (steps.filter(|&(a, b)| a >= from && b <= to))
            .map(|(a, b)| b - a)
            .collect();
        assert!(steps.iter().all(|&step| step >= cycles), "{cycles}");
        let close = steps.iter().filter(|&&step| step == cycles).count();
        assert!(
            close > steps.len() * 9 / 10,
            "{close} of {} at {cycles}",
            steps.len()
        );
    }
}

#[test]
fn a_line_too_slow_for_the_rate_carries_what_it_can_and_the_rest_is_counted() {
    let rate = Command::SetRate {
        period_ticks: 976,
        periods_per_sample: 1,
    };
    let heard = hear(&ideal(11.0, vec![ask(0.9, 1, rate)]));
    let in_ten = (heard.frames.iter())
        .filter(|(t, frame)| (1.0..11.0).contains(t) && matches!(frame, Frame::Sample(_)))
        .count();
    // 3846 bytes a second: a health frame of 90 bytes, the rest in samples of 50, each begun as soon as there is room.
    let fits = 10.0 * (3846.2 - 90.0) / 50.0;
    assert!(
        (in_ten as f64 / fits - 1.0).abs() < 0.02,
        "{in_ten} of {fits}"
    );
    let samples = heard.samples();
    let lost: u32 = (samples.windows(2))
        .map(|two| u32::from(two[1].seq.wrapping_sub(two[0].seq)) - 1)
        .sum();
    let health = heard
        .frames
        .iter()
        .rev()
        .find_map(|(_, frame)| match frame {
            Frame::Health(health) => Some(*health),
            _ => None,
        });
    let counted = health
        .expect("health")
        .faults
        .get(wire::Fault::FrameDropped);
    // Those behind the last health frame are not in it.
    assert!(
        (0..200).contains(&(i64::from(lost) - i64::from(counted))),
        "{lost} {counted}"
    );
}

#[test]
fn a_request_takes_its_time_on_the_line_and_a_store_that_of_45_bytes() {
    let heard = hear(&ideal(
        4.0,
        vec![
            ask(1.0, 1, Command::Ping),
            ask(2.0, 2, Command::StoreConfig),
        ],
    ));
    // 19 bytes there and 28 back, of 0.26 ms each; the sample between takes 13 ms at the most.
    let ping = reply_at(&heard, 1) - 1.0;
    assert!((0.012..0.03).contains(&ping), "{ping} s");
    // 8.5 ms each, looked at by the millisecond: 9 ms.
    let store = reply_at(&heard, 2) - 2.0 - ping;
    assert!((0.38..0.43).contains(&store), "{store} s");
}

#[test]
fn a_reboot_takes_the_watchdogs_time_and_the_start() {
    let heard = hear(&ideal(4.0, vec![ask(1.0, 1, Command::Reboot)]));
    let hellos: Vec<(f64, wire::Hello)> = (heard.frames.iter())
        .filter_map(|(t, frame)| match frame {
            Frame::Hello(hello) => Some((*t, *hello)),
            _ => None,
        })
        .collect();
    assert_eq!(hellos.len(), 2);
    let (first, again) = (hellos[0], hellos[1]);
    assert_eq!((first.1.restarts, again.1.restarts), (0, 1));
    assert_eq!(again.1.reset_cause, wire::reset_cause::WATCHDOG);
    // From the end of the reply: 16.3 ms, and as long as from power-on to the first hello.
    let down = again.0 - reply_at(&heard, 1);
    assert!((down - first.0 - 0.0163).abs() < 0.001, "{down}");
    let after = heard.samples();
    let begun = after.iter().rposition(|sample| sample.seq == 0);
    let begun = begun.expect("it samples again");
    assert!(begun > 10, "it has sampled before");
    assert_eq!(after[begun].t_ticks, 12_500, "its clock began anew");
}

#[test]
fn the_motor_gets_the_pulses_share_either_way_and_is_cut_200_ms_after_the_last_word() {
    let part = bench::scenario::MotorPart {
        table_ratio: 0.004,
        ..Default::default()
    };
    for duty in [128i16, -64] {
        let mut run = ideal(8.0, duty_profile(&[(1.0, duty)], 5.0));
        run.scenario.motor = part.clone();
        let heard = hear(&run);
        let mut motor = Motor::new(part.clone());
        // Fast PWM is high for one count more than it is told, of 256.
        let share = (f64::from(duty.abs()) + 1.0) / 256.0;
        let share = share.copysign(duty.into());
        (0..5_000).for_each(|_| motor.step(share, 1e-3));
        let within = |from: f64, to: f64| -> Vec<Sample> {
            let inside = heard.frames.iter().filter(|(t, _)| (from..to).contains(t));
            inside
                .filter_map(|(_, frame)| match frame {
                    Frame::Sample(sample) => Some(*sample),
                    _ => None,
                })
                .collect()
        };
        let turning = within(2.5, 5.0);
        let rate = |sample: &Sample| f64::from(sample.rate[2]) / 65_536.0;
        let mean = turning.iter().map(rate).sum::<f64>() / turning.len() as f64;
        // 50 samples of 0.4 deg/s each, 0.06; a step of the command is 0.3 deg/s of the table.
        assert!(
            (mean - motor.table_dps()).abs() < 0.15,
            "{mean} of {}",
            motor.table_dps()
        );
        // The last keep-alive begins at 4.9 s: 5 ms on the line, 200 ms, and up to a millisecond.
        let stopped = within(5.0, 5.3).into_iter().find(|sample| sample.pwm == 0);
        let stopped = f64::from(stopped.expect("it stops").t_ticks) * 4e-6 + 0.2268;
        assert!((5.104..5.16).contains(&stopped), "{stopped}");
        let rest = within(7.0, 8.0);
        let mean = rest.iter().map(rate).sum::<f64>() / rest.len() as f64;
        assert!(mean.abs() < 0.5, "{mean} at rest");
    }
}

#[test]
fn each_range_of_the_accelerometer_reaches_its_pins() {
    let requests = (0..4u16).map(|n| {
        let range = n as u8;
        ask(1.0 + f64::from(n), n, Command::SetAccRange { range })
    });
    let heard = hear(&ideal(5.0, requests.collect()));
    // Data sheet: 800, 600, 300 and 200 mV for each g, of 3.3 V in 1024 counts.
    for (n, volts) in [0.8, 0.6, 0.3, 0.2].into_iter().enumerate() {
        let from = 1.2 + n as f64;
        let z: Vec<f64> = (heard.frames.iter())
            .filter(|(t, _)| (from..from + 0.8).contains(t))
            .filter_map(|(_, frame)| match frame {
                Frame::Sample(sample) => Some(f64::from(sample.acc[2])),
                _ => None,
            })
            .collect();
        let mean = z.iter().sum::<f64>() / z.len() as f64;
        // A converter rounds down: half a count.
        let wanted = (1.65 + volts) / 3.3 * 1024.0 - 0.5;
        assert!(
            (mean - wanted).abs() < 1.5,
            "range {n}: {mean}, not {wanted}"
        );
    }
}

#[test]
fn a_queue_takes_what_fits_to_the_byte() {
    let room = wire::fields::room_for(wire::kind::HEALTH, wire::Health::LEN - 2);
    let healths = |queue: usize| {
        let timeline = Timeline {
            queue,
            ..Timeline::default()
        };
        let (mut decoder, mut count) = (Decoder::new(), 0);
        native(&ideal(6.0, vec![]), &timeline, |byte| {
            let frame = decoder.push(byte.byte);
            count += usize::from(matches!(frame, Some(Ok(Frame::Health(_)))));
            ControlFlow::Continue(())
        });
        count
    };
    assert!(healths(room) >= 4);
    assert_eq!(healths(room - 1), 0);
}

/// A health frame that wants all of the queue goes in when what is left of the sample before lies in the transmitter, two
/// bytes, and follows it without a gap. The board looks each millisecond: of the phases of a sample's end to it, 8320 of
/// 16 000 cycles.
#[test]
fn two_bytes_of_a_frame_lie_in_the_transmitter_and_take_no_room() {
    let timeline = Timeline {
        queue: wire::fields::room_for(wire::kind::HEALTH, wire::Health::LEN - 2),
        ..Timeline::default()
    };
    // A sample takes 13.02 ms on the line, one comes each 14.004 ms: the phase goes round.
    let rate = Command::SetRate {
        period_ticks: 3_501,
        periods_per_sample: 1,
    };
    let mut run = ideal(400.0, vec![ask(0.3, 1, rate)]);
    run.scenario.seconds = 400.0;
    let (mut decoder, mut begins, mut last) = (Decoder::new(), None, 0);
    let (mut close, mut apart) = (0, 0);
    for (at, byte) in bytes(&run, &timeline) {
        let (_, before) = *begins.get_or_insert((at, last));
        if let Some(Ok(frame)) = decoder.push(byte) {
            let (first, _) = begins.take().expect("its first byte");
            if matches!(frame, Frame::Health(_)) && at > 16_000_000 {
                match first - before {
                    4_160 => close += 1,
                    _ => apart += 1,
                }
            }
        }
        last = at;
    }
    let all = f64::from(close + apart);
    assert!(all > 350.0, "{all}");
    let share = f64::from(close) / all;
    // 380 of them: 2.6 % rms.
    assert!((share - 0.52).abs() < 0.1, "{share}");
}

/// To the cycle: a sample begins to go out when it is framed, a reply when the last byte of its request is there.
#[test]
fn frames_begin_when_the_timeline_says() {
    let timeline = Timeline::default();
    let all = bytes(&ideal(3.0, vec![ask(1.0, 1, Command::Ping)]), &timeline);
    let (mut decoder, mut begins, mut samples) = (Decoder::new(), None, 0);
    for (at, byte) in all {
        let first = *begins.get_or_insert(at);
        let Some(Ok(frame)) = decoder.push(byte) else {
            continue;
        };
        begins = None;
        match frame {
            Frame::Sample(sample) => {
                let tick = timeline.start + 800_000 * (u64::from(sample.seq) + 1);
                assert_eq!(first, tick + timeline.framed + 4_160, "{}", sample.seq);
                samples += 1;
            }
            Frame::Reply(_) => {
                // 19 bytes of ten bits; the receiver has the last one after ten sixteenths of its stop bit.
                let heard = 16_000_000 + 19 * 4_160 - 416 * 6 / 16;
                assert_eq!(first, heard + 4_160);
            }
            Frame::Health(health) => {
                // The second ends with the tick: behind its sample.
                assert_eq!(u32::from(health.next_seq), 20 * health.uptime_s);
                // Ticks of 64 cycles from the tick to the framed sample.
                assert_eq!(u64::from(health.tick_busy_max), timeline.framed / 64);
            }
            _ => {}
        }
    }
    assert_eq!(samples, 55);
}
