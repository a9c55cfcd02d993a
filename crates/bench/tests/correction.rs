//! The correction on the board, on the simulated stand: written by requests as a host does, read back, and judged by the angle
//! that the rates integrate to.

use std::ops::ControlFlow;

use bench::{Ending, Fault, Run, Scenario, TimedRequest, Timeline, native};
use wire::correction::{self, Correction, NUMBERS, Numbers, ROWS};
use wire::{Command, Corrected, Decoder, Frame, Reply, Request, Sample, Status, correction_state};

/// SENS/AVG of the built-in set-up.
const SENS_AVG: u16 = 0x0402;
/// TEMP_OUT, degC for each count.
const TEMP_LSB_C: f64 = 0.1453;
const RATE_HZ: f64 = 20.0;
/// What is planted on gyro x and z, deg/s/degC.
const TEMPCO: [f64; 3] = [0.15, 0.0, -0.08];

#[derive(Default)]
struct Heard {
    samples: Vec<Sample>,
    corrected: Vec<Corrected>,
    replies: Vec<Reply>,
}

fn hear(run: &Run) -> Heard {
    let mut decoder = Decoder::new();
    let mut heard = Heard::default();
    let ending = native(run, &Timeline::default(), |byte| {
        match decoder.push(byte.byte) {
            Some(Ok(Frame::Sample(sample))) => heard.samples.push(sample),
            Some(Ok(Frame::Corrected(corrected))) => heard.corrected.push(corrected),
            Some(Ok(Frame::Reply(reply))) => heard.replies.push(reply),
            Some(Err(error)) => panic!("{error}"),
            _ => {}
        }
        ControlFlow::Continue(())
    });
    assert_eq!(ending, Ending::Complete);
    heard
}

/// Requests, 0.15 s apart from `from_s` on: a row takes six bytes of 8.5 ms.
fn requests(commands: impl IntoIterator<Item = Command>, from_s: f64) -> Vec<TimedRequest> {
    (0u16..)
        .zip(commands)
        .map(|(number, command)| TimedRequest {
            at_us: ((from_s + 0.15 * f64::from(number)) * 1e6) as u64,
            request: Request { number, command },
        })
        .collect()
}

fn write(numbers: &Numbers) -> Vec<Command> {
    let mut commands: Vec<Command> = (0u8..)
        .zip(numbers.chunks_exact(3))
        .map(|(row, three)| Command::SetCorrection {
            row,
            values: [three[0], three[1], three[2]],
        })
        .collect();
    commands.push(Command::SetCorrection {
        row: ROWS as u8,
        values: correction::crc_row(numbers),
    });
    commands
}

/// What corrects the planted stand: its temperature terms, and a filter by its noise.
fn planted(scenario: &Scenario) -> Correction {
    let block_s = 16.0 / RATE_HZ;
    let noise = scenario.gyros.each_ref().map(|gyro| {
        let n = gyro.angle_random_walk_deg_sqrt_h / 60.0;
        n * n / block_s
    });
    Correction {
        number: 4711,
        block_shift: 4,
        sens_avg: SENS_AVG,
        temp_range: [-60, 60],
        temperature: TEMPCO.map(|slope| -slope * TEMP_LSB_C),
        noise,
        walk: scenario
            .gyros
            .each_ref()
            .map(|gyro| (gyro.rate_random_walk.powi(2) * block_s).max(1e-8)),
        ..Correction::default()
    }
}

/// A stand at rest in a lively room, with two gyros that follow their temperature.
fn stand(seed: u64, seconds: f64) -> Run {
    let mut scenario = Scenario::lively(seed);
    scenario.seconds = seconds;
    for (gyro, slope) in TEMPCO.into_iter().enumerate().filter(|(_, s)| *s != 0.0) {
        scenario = scenario.with(Fault::Tempco {
            gyro,
            dps_per_c: slope,
            dps_per_c2: 0.0,
        });
    }
    Run {
        scenario,
        seconds,
        requests: Vec::new(),
    }
}

/// Root mean square of what non-overlapping stretches of `seconds` integrate to, deg.
fn angle_rms(rates: &[f64], seconds: f64) -> f64 {
    let len = (seconds * RATE_HZ) as usize;
    let angles: Vec<f64> = (rates.chunks_exact(len))
        .map(|part| part.iter().sum::<f64>() / RATE_HZ)
        .collect();
    (angles.iter().map(|a| a * a).sum::<f64>() / angles.len() as f64).sqrt()
}

#[test]
fn a_correction_is_written_read_back_and_outlives_what_is_half_written() {
    let numbers = planted(&Scenario::quiet(1)).numbers().unwrap();
    let mut other = planted(&Scenario::quiet(2));
    (other.number, other.generation) = (4712, 1);
    let other = other.numbers().unwrap();
    let mut run = stand(1, 30.0);
    let mut commands = write(&numbers);
    let ask = |row| Command::GetCorrection { other: false, row };
    commands.extend((0..ROWS as u8).map(ask));
    // A second one without its CRC, then with a wrong one, then with the right one.
    let second = write(&other);
    commands.extend(&second[..ROWS]);
    commands.push(ask(0));
    commands.push(Command::SetCorrection {
        row: ROWS as u8,
        values: [1, 2, 0],
    });
    commands.push(ask(0));
    commands.push(second[ROWS]);
    commands.push(ask(0));
    commands.push(Command::SetCorrection {
        row: ROWS as u8 + 1,
        values: [0; 3],
    });
    run.requests = requests(commands, 1.0);
    let heard = hear(&run);
    assert_eq!(heard.replies.len(), run.requests.len());
    let status = |at: usize| heard.replies[at].status;
    for at in 0..=2 * ROWS {
        assert_eq!(status(at), Status::Ok, "{at}");
    }
    let read: Vec<i16> = (heard.replies[ROWS + 1..=2 * ROWS].iter())
        .flat_map(|reply| reply.detail.map(|n| n as i16))
        .collect();
    assert_eq!(read, numbers);
    assert_eq!(read.len(), NUMBERS);
    let after = 3 * ROWS + 1;
    let number = |at: usize| heard.replies[at].detail[1];
    assert_eq!((status(after), number(after)), (Status::Ok, 4711));
    assert_eq!(status(after + 1), Status::NotStored, "a wrong CRC");
    assert_eq!(number(after + 2), 4711, "the one before is still in use");
    assert_eq!((status(after + 3), number(after + 4)), (Status::Ok, 4712));
    assert_eq!(
        status(after + 5),
        Status::BadArgument,
        "there is no such row"
    );
    // Frames tell which one it was, and belong to samples.
    assert_eq!(heard.corrected.last().map(|c| c.correction), Some(4712));
    assert_eq!(heard.corrected.first().map(|c| c.correction), Some(4711));
}

#[test]
fn samples_stay_as_they_are_beside_corrected_frames() {
    let alone = hear(&stand(7, 60.0));
    let mut run = stand(7, 60.0);
    run.requests = requests(write(&planted(&run.scenario).numbers().unwrap()), 1.0);
    let beside = hear(&run);
    assert!(alone.corrected.is_empty(), "none without a correction");
    assert_eq!(alone.samples, beside.samples);
    // From the sample after the CRC on, every one.
    let first = beside.corrected.first().map_or(0, |c| usize::from(c.seq));
    assert!(first < 100, "{first}");
    assert!(beside.corrected.len() + 1 >= beside.samples.len() - first);
}

/// Angle errors of the stand at rest over 10, 100 and 600 s: with the rates as they are, corrected, and of the same noise on a
/// stand without temperature terms whose constant bias is known exactly, which no correction can better by its terms.
#[test]
fn the_angle_error_comes_near_what_the_noise_alone_makes() {
    const SPANS: [f64; 3] = [10.0, 100.0, 600.0];
    let (mut near, mut better, mut all) = (0, 0, 0);
    for seed in 1..=12 {
        let seconds = 1300.0;
        let mut run = stand(seed, seconds);
        run.requests = requests(write(&planted(&run.scenario).numbers().unwrap()), 1.0);
        let heard = hear(&run);
        let mut clean = stand(seed, seconds);
        clean.scenario.faults.clear();
        let clean = hear(&clean);
        // The filter's first minute is its own.
        let from = 1_300;
        for axis in [0, 2] {
            let q16 = |s: &Sample| f64::from(s.rate[axis]) / 65_536.0;
            let before: Vec<f64> = heard.samples[from..].iter().map(q16).collect();
            let after: Vec<f64> = (heard.corrected.iter())
                .filter(|c| usize::from(c.seq) >= from)
                .map(|c| f64::from(c.rate[axis]) / 1_048_576.0)
                .collect();
            let limit: Vec<f64> = clean.samples[from..].iter().map(q16).collect();
            let mean = limit.iter().sum::<f64>() / limit.len() as f64;
            let limit: Vec<f64> = limit.iter().map(|rate| rate - mean).collect();
            let states = heard.corrected.iter().skip(from).map(|c| c.state);
            let mostly = states
                .filter(|s| s & correction_state::APPLIED != 0)
                .count();
            assert!(mostly > 10 * after.len() / 11);
            let of = |rates: &[f64]| SPANS.map(|span| angle_rms(rates, span));
            let (before, after, limit) = (of(&before), of(&after), of(&limit));
            println!(
                "seed {seed}, axis {axis}: before {before:.2?}, after {after:.2?}, limit {limit:.2?} deg"
            );
            for k in 0..2 {
                all += 1;
                near += u32::from(after[k] <= 1.15 * limit[k]);
                better += u32::from(after[k] < before[k]);
            }
        }
    }
    println!("of {all}: {near} within 1.15 of the limit, {better} better than before");
    assert!(better * 20 >= all * 19, "{better} of {all}");
    assert!(near * 10 >= all * 9, "{near} of {all}");
}
