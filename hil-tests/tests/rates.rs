//! From 1 Hz to 256 Hz nothing is lost.

#[path = "../../crates/diagnosis/tests/draws/mod.rs"]
mod draws;

use bench::Scenario;
use bench::simavr::{NoProbe, Simulated};
use hil_tests::{Heard, at, image, run};
use wire::{Command, Fault, Sample, Status, correction_state};

/// Ticks of 4 us; a byte at divisor 3 takes 40 us.
const FASTEST: u16 = 976;

/// Runs at a rate; the host sets line and rate, then stays silent.
fn heard_at(period_ticks: u16, periods_per_sample: u8, divisor: u16, seconds: f64) -> Heard {
    let run = run(Scenario::lively(31), seconds);
    let mut simulated = Simulated::new(&image(), &run.scenario, NoProbe).expect("an image");
    simulated.request(&[
        at(1.0, 1, Command::SetBaud { divisor }),
        at(
            1.5,
            2,
            Command::SetRate {
                period_ticks,
                periods_per_sample,
            },
        ),
    ]);
    let mut heard = Heard::default();
    simulated
        .run_until(seconds, &mut |byte| heard.push(byte))
        .expect("it runs");
    assert_eq!(heard.link().rejected(), 0);
    let replies: Vec<_> = heard
        .replies()
        .map(|(_, reply)| (reply.number, reply.status))
        .collect();
    assert_eq!(replies, [(1, Status::Ok), (2, Status::Ok)]);
    heard
}

/// Samples in order from the new rate on: no number is missing, no tick.
fn assert_whole(heard: &Heard, ticks: u32) -> usize {
    let samples: Vec<Sample> = heard.samples().map(|(_, sample)| sample).collect();
    for pair in samples.windows(2) {
        assert_eq!(pair[1].seq, pair[0].seq.wrapping_add(1));
    }
    let from = (samples.windows(2))
        .rposition(|pair| pair[1].t_ticks.wrapping_sub(pair[0].t_ticks) != ticks)
        .map_or(0, |last| last + 1);
    assert!(samples.len() > from + 2, "the rate has been taken");
    // What counts as lost on the way there: one period of the old rate and one of the change.
    assert!(
        f64::from(samples[from].t_ticks) * 4e-6 < 6.0,
        "{} ticks",
        samples[from].t_ticks
    );
    let health = heard.last_health();
    for fault in [
        Fault::TickOverrun,
        Fault::FrameDropped,
        Fault::ReportDropped,
        Fault::SpiStalled,
    ] {
        assert_eq!(health.faults.get(fault), 0, "{}", fault.name());
    }
    samples.len()
}

/// Ten minutes, or of them so many that the numbers of the samples, which have 16 bits, come round.
#[test]
fn at_256_hz_and_250_kbd_nothing_is_lost_while_the_numbers_come_round() {
    let begun = std::time::Instant::now();
    let seconds = draws::of(270.0, 600.0);
    let heard = heard_at(FASTEST, 1, 3, seconds);
    let samples = assert_whole(&heard, FASTEST.into());
    let health = heard.last_health();
    println!(
        "{samples} samples in {seconds} s, the longest tick's work {:.3} ms of {:.3}; {:.1} s of host time",
        f64::from(health.tick_busy_max) * 4e-3,
        f64::from(FASTEST) * 4e-3,
        begun.elapsed().as_secs_f64()
    );
    assert!(samples as f64 > (seconds - 2.0) * 256.0 && samples > 1 << 16);
}

/// The correction, its filter and the attitude at the fastest rate: no tick is lost, nor any sample; of the corrected frames
/// those that the line still carries.
#[test]
fn at_256_hz_a_correction_in_use_costs_no_sample() {
    let seconds = 60.0;
    let run = run(Scenario::lively(6), seconds);
    let mut simulated = Simulated::new(&image(), &run.scenario, NoProbe).expect("an image");
    let correction = wire::correction::Correction {
        block_shift: 7,
        sens_avg: 0x0402,
        temp_range: [-60, 60],
        noise: [0.02; 3],
        walk: [1e-7; 3],
        ..wire::correction::Correction::default()
    };
    let numbers = correction.numbers().expect("they fit");
    let rows = (numbers.chunks_exact(3).map(|row| [row[0], row[1], row[2]]))
        .chain([wire::correction::crc_row(&numbers)]);
    let mut requests: Vec<_> = (0u8..)
        .zip(rows)
        .map(|(row, values)| {
            let when = 0.5 + 0.1 * f64::from(row);
            at(when, row.into(), Command::SetCorrection { row, values })
        })
        .collect();
    let rate = Command::SetRate {
        period_ticks: FASTEST,
        periods_per_sample: 1,
    };
    requests.extend([
        at(2.8, 101, Command::SetBaud { divisor: 3 }),
        at(3.0, 102, rate),
    ]);
    simulated.request(&requests);
    let mut heard = Heard::default();
    simulated
        .run_until(seconds, &mut |byte| heard.push(byte))
        .expect("it runs");
    let samples = assert_whole(&heard, FASTEST.into());
    let corrected: Vec<_> = (heard.frames.iter())
        .filter_map(|(_, frame)| match frame {
            wire::Frame::Corrected(corrected) => Some(*corrected),
            _ => None,
        })
        .collect();
    println!(
        "{samples} samples, {} corrected frames; the longest tick's work {:.3} ms",
        corrected.len(),
        f64::from(heard.last_health().tick_busy_max) * 4e-3
    );
    // Samples take 12.8 of 25 KB/s and a corrected frame 59 B: 206 of 256 have room.
    assert!(corrected.len() * 10 > samples * 7, "{}", corrected.len());
    let last = corrected.last().expect("there are some");
    let wanted =
        correction_state::APPLIED | correction_state::FILTERED | correction_state::YAW_FREE;
    assert_eq!(last.state & wanted, wanted);
}

#[test]
fn at_1_hz_the_watchdog_stays_quiet_and_nothing_is_lost() {
    let heard = heard_at(62_500, 4, 25, 30.0);
    assert_whole(&heard, 250_000);
    assert_eq!(heard.last_health().faults.get(Fault::WatchdogReset), 0);
}

#[test]
fn too_fast_for_the_line_drops_whole_samples_and_says_how_many() {
    let heard = {
        let run = run(Scenario::lively(31), 10.0);
        let mut simulated = Simulated::new(&image(), &run.scenario, NoProbe).expect("an image");
        let rate = |period_ticks| Command::SetRate {
            period_ticks,
            periods_per_sample: 1,
        };
        simulated.request(&[
            at(1.5, 2, rate(FASTEST)),
            at(2.5, 4, Command::Ping),
            at(3.0, 5, Command::GetHello),
            at(3.5, 6, Command::Counters),
            at(6.0, 3, rate(12_500)),
        ]);
        let mut heard = Heard::default();
        simulated
            .run_until(10.0, &mut |byte| heard.push(byte))
            .expect("it runs");
        heard
    };
    assert_eq!(heard.link().rejected(), 0, "no frame is damaged");
    // The full line still carries what is asked for, and the health frame of each second and of the request.
    let replies: Vec<u16> = heard.replies().map(|(_, reply)| reply.number).collect();
    assert_eq!(replies, [2, 4, 5, 6, 3]);
    let during = |t: f64| (2.0..6.0).contains(&t);
    let hellos: Vec<f64> = (heard.hellos().map(|(t, _)| t))
        .filter(|&t| during(t))
        .collect();
    let healths: Vec<f64> = (heard.healths().map(|(t, _)| t))
        .filter(|&t| during(t))
        .collect();
    println!("full line: hello at {hellos:.2?}, health at {healths:.2?} s");
    assert!(matches!(hellos[..], [t] if t < 3.2));
    assert_eq!(healths.len(), 5);
    let samples: Vec<(f64, Sample)> = heard.samples().collect();
    let (at_s, health) = heard.healths().last().expect("a health frame");
    let seen: Vec<Sample> = samples
        .iter()
        .filter(|&&(t, _)| t <= at_s)
        .map(|&(_, s)| s)
        .collect();
    let gaps: u32 = seen
        .windows(2)
        .map(|pair| u32::from(pair[1].seq.wrapping_sub(pair[0].seq)) - 1)
        .sum();
    let counted = u32::from(health.faults.get(Fault::FrameDropped))
        + u32::from(health.faults.get(Fault::TickOverrun));
    println!("{gaps} numbers missing, {counted} counted when the health frame was made");
    assert!(gaps > 500);
    // Between the making of the health frame and its end on the line, what was queued before it goes out.
    assert!(
        counted.abs_diff(gaps) <= 12,
        "{counted} counted, {gaps} missing"
    );
}
