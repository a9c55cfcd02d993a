//! Faults of sensors, wires and line, each planted at a random time: flagged in the frame, counted in health, the others
//! go on, nothing is invented, and the board comes back by itself. `IMU_STAND_SEED` replays a run.

#[path = "faults/bias.rs"]
mod bias;
#[path = "faults/registers.rs"]
mod registers;

use atmega16_sim::register;
use bench::simavr::{Answer, Probe, Simulated};
use bench::{Scenario, uniform};
use hil_tests::{Heard, at, generator, image, seed};
use wire::{Command, Fault, Sample, Status, flags};

/// What is clipped to the board's lines.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Clip {
    /// MISO is held while this gyro is selected.
    Miso { axis: usize, level: bool },
    /// A chip select's wire has come off.
    Select { axis: usize },
    /// GYRO_OUT never says that it is new.
    Stale { axis: usize },
    /// GYRO_OUT raises its error/alarm bit.
    Alarm { axis: usize },
    /// SENS/AVG reads otherwise than written.
    ReadBack { axis: usize },
    /// GYRO_SCALE is not what the part was calibrated to.
    Scale { axis: usize },
    /// SUPPLY_OUT of gyro x reads 4.69 V.
    Supply,
    /// An accelerometer output is at a rail.
    Rail { axis: usize, high: bool },
}

const SUPPLY_OUT: u16 = 0x02;
const GYRO_OUT: u16 = 0x04;
const GYRO_SCALE: u16 = 0x16;
const SENS_AVG: u16 = 0x38;

/// A clip, from a time to another.
struct Clips {
    clip: Clip,
    from_s: f64,
    to_s: f64,
}

impl Clips {
    fn active(&self, t: f64) -> Option<Clip> {
        (self.from_s..self.to_s).contains(&t).then_some(self.clip)
    }
}

impl Probe for Clips {
    fn miso(&mut self, t: f64, answer: Answer) -> u8 {
        let Answer {
            axis: own,
            asked,
            is_high,
            byte,
        } = answer;
        // A read command has the register's address in its high byte.
        let read = asked >> 8;
        match self.active(t) {
            Some(Clip::Miso { axis, level }) if axis == own => {
                if level {
                    0xff
                } else {
                    0
                }
            }
            Some(Clip::Stale { axis }) if axis == own && read == GYRO_OUT && is_high => byte & 0x7f,
            Some(Clip::Alarm { axis }) if axis == own && read == GYRO_OUT && is_high => byte | 0x40,
            Some(Clip::ReadBack { axis }) if axis == own && read == SENS_AVG && !is_high => {
                byte ^ 1
            }
            Some(Clip::Scale { axis }) if axis == own && read == GYRO_SCALE && is_high => byte ^ 2,
            Some(Clip::Supply) if own == 0 && read == SUPPLY_OUT => {
                if is_high {
                    0x8a
                } else {
                    0
                }
            }
            _ => byte,
        }
    }

    fn volts(&mut self, t: f64, channel: u8, volts: f64) -> f64 {
        match self.active(t) {
            Some(Clip::Rail { axis, high }) if axis == usize::from(channel) => {
                if high {
                    3.4
                } else {
                    -0.1
                }
            }
            _ => volts,
        }
    }

    fn select_arrives(&mut self, t: f64, own: usize) -> bool {
        !matches!(self.active(t), Some(Clip::Select { axis }) if axis == own)
    }
}

/// What is to be seen of a clip while it is there.
struct Expected {
    /// Flags that are set, and others that are clear.
    set: u16,
    clear: u16,
    /// Counted once for each sample that shows it.
    each_sample: Option<Fault>,
    /// Counted once.
    once: Option<Fault>,
}

fn expected(clip: Clip) -> Expected {
    let of = |set, clear, each_sample, once| Expected {
        set,
        clear,
        each_sample,
        once,
    };
    match clip {
        Clip::Miso { axis, .. } | Clip::Select { axis } => {
            let axis = axis as u8;
            of(
                flags::GYRO_NOT_ANSWERING,
                flags::new_data(axis),
                Some(Fault::gyro_not_answering(axis)),
                Some(Fault::gyro_recovered(axis)),
            )
        }
        Clip::Stale { axis } => {
            let axis = axis as u8;
            of(
                0,
                flags::new_data(axis),
                Some(Fault::gyro_stale(axis)),
                None,
            )
        }
        Clip::Alarm { axis } => {
            let axis = axis as u8;
            of(
                flags::error(axis),
                0,
                Some(Fault::gyro_error_alarm(axis)),
                None,
            )
        }
        Clip::ReadBack { .. } | Clip::Scale { .. } => of(flags::GYRO_MISCONFIGURED, 0, None, None),
        Clip::Supply => of(
            flags::SUPPLY_OUT_OF_RANGE,
            0,
            Some(Fault::SupplyOutOfRange),
            None,
        ),
        Clip::Rail { axis, .. } => of(
            flags::ACC_AT_RAIL,
            0,
            Some(Fault::acc_at_rail(axis as u8)),
            None,
        ),
    }
}

/// Time of a sample's tick: its frame ends some 15 ms later.
fn shows(sample: &Sample, expected: &Expected) -> bool {
    sample.flags & expected.set == expected.set && sample.flags & expected.clear == 0
}

fn listen(clip: Clip, from_s: f64, to_s: f64, end_s: f64) -> Heard {
    let clips = Clips { clip, from_s, to_s };
    let simulated = Simulated::new(&image(), &Scenario::quiet(8), clips).expect("an image");
    let heard = hear_out(simulated, end_s);
    assert_eq!(heard.link().rejected(), 0);
    heard
}

/// No sample is missing, whatever happens.
fn assert_all_samples(heard: &Heard) {
    for (n, (_, sample)) in heard.samples().enumerate() {
        assert_eq!(usize::from(sample.seq), n);
        assert_eq!(sample.t_ticks, 12_500 * (n as u32 + 1));
    }
}

/// The request of this number has been carried out.
fn assert_answered(heard: &Heard, number: u16) {
    assert!(
        heard
            .replies()
            .any(|(_, reply)| (reply.number, reply.status) == (number, Status::Ok)),
        "request {number} is answered"
    );
}

/// Runs to the end and hears it out.
fn hear_out<P: Probe>(mut simulated: Simulated<P>, end_s: f64) -> Heard {
    let mut heard = Heard::default();
    simulated
        .run_until(end_s, &mut |byte| heard.push(byte))
        .expect("it runs");
    heard
}

#[test]
fn each_fault_of_a_sensor_is_flagged_counted_survived_and_left_behind() {
    let rng = &mut generator(seed());
    let mut clips = vec![Clip::Supply];
    for axis in 0..3 {
        let level = uniform(rng, 0.0, 1.0) < 0.5;
        clips.extend([
            Clip::Miso { axis, level: false },
            Clip::Miso { axis, level: true },
            Clip::Select { axis },
            Clip::Stale { axis },
            Clip::Alarm { axis },
            Clip::Rail { axis, high: level },
        ]);
    }
    for clip in clips {
        let from_s = uniform(rng, 2.0, 4.0);
        let to_s = from_s + uniform(rng, 0.3, 1.5);
        let heard = listen(clip, from_s, to_s, 8.0);
        assert_all_samples(&heard);
        let expected = expected(clip);
        let mut shown = 0;
        for (end, sample) in heard.samples() {
            let t = end - 0.015;
            if (from_s + 0.05..to_s - 0.05).contains(&t) {
                assert!(
                    shows(&sample, &expected),
                    "{clip:?} at {t}: {:#06x}",
                    sample.flags
                );
            } else if !(from_s - 0.05..to_s + 0.5).contains(&t) {
                assert_eq!(sample.flags, flags::IN_ORDER, "{clip:?} at {t}");
            }
            shown += u16::from(shows(&sample, &expected));
            for axis in 0..3usize {
                let is_its = matches!(clip, Clip::Miso { axis: a, .. } | Clip::Select { axis: a } | Clip::Stale { axis: a } if a == axis);
                let is_new = sample.flags & flags::new_data(axis as u8) != 0;
                if is_its && sample.flags & flags::GYRO_NOT_ANSWERING != 0 {
                    assert!(!is_new);
                    assert_eq!(
                        (sample.gyro[axis], sample.rate[axis]),
                        (0, 0),
                        "nothing invented"
                    );
                } else if !is_its {
                    assert!(is_new, "{clip:?}: gyro {axis} goes on");
                }
            }
        }
        let health = heard.last_health();
        let on_the_line = matches!(clip, Clip::Miso { .. } | Clip::Select { .. });
        let mut partial = vec![Fault::SupplyOutOfRange];
        for axis in 0..3 {
            partial.extend([Fault::gyro_stale(axis), Fault::gyro_error_alarm(axis)]);
        }
        for fault in Fault::all() {
            let count = health.faults.get(fault);
            if expected.each_sample == Some(fault) {
                // The last health frame may lie some samples before the end, never within the fault.
                assert_eq!(count, shown, "{clip:?}: {}", fault.name());
            } else if expected.once == Some(fault) {
                assert_eq!(count, 1, "{clip:?}: {}", fault.name());
            } else {
                // A line that fails or comes back within the millisecond of a sample spoils a part of it.
                let edges = if on_the_line && partial.contains(&fault) {
                    2
                } else {
                    0
                };
                assert!(count <= edges, "{clip:?}: {}, {count}", fault.name());
            }
        }
        println!("{clip:?} from {from_s:.3} to {to_s:.3} s: {shown} samples say so");
    }
}

/// A sound stand, to which a host does something.
fn meddle(
    seconds: f64,
    mut host: impl FnMut(&mut Simulated<bench::simavr::NoProbe>, f64),
) -> Heard {
    let mut simulated =
        Simulated::new(&image(), &Scenario::quiet(8), bench::simavr::NoProbe).expect("an image");
    let mut heard = Heard::default();
    let mut t = 0.0;
    while t < seconds {
        t += 0.01;
        simulated
            .run_until(t, &mut |byte| heard.push(byte))
            .expect("it runs");
        host(&mut simulated, t);
    }
    heard
}

#[test]
fn bytes_without_a_stop_bit_are_counted_and_the_next_request_is_answered() {
    let rng = &mut generator(seed());
    let from_s = uniform(rng, 2.0, 4.0);
    let mut left = 5;
    let heard = meddle(6.0, |simulated, t| {
        if t > from_s && left > 0 {
            left -= 1;
            simulated.mcu_mut().send_without_stop_bit(0x41);
        } else if left == 0 {
            left = -1;
            simulated.send(&[0]);
            simulated.request(&[at(t + 0.1, 3, Command::Ping)]);
        }
    });
    assert_eq!(heard.last_health().faults.get(Fault::RxFraming), 5);
    assert_answered(&heard, 3);
    assert_all_samples(&heard);
}

#[test]
fn a_flood_at_500_kbd_overruns_the_receiver_is_counted_and_moves_no_sample() {
    let rng = &mut generator(seed());
    let from_s = uniform(rng, 2.0, 4.0);
    let heard = meddle(7.0, |simulated, t| {
        if (t - 1.0).abs() < 0.005 {
            simulated.request(&[at(t, 1, Command::SetBaud { divisor: 1 })]);
        }
        if (from_s..from_s + 1.0).contains(&t) && simulated.mcu().host_queue() < 600 {
            simulated.send(&[0x55; 520]);
        }
        if (from_s + 1.5..from_s + 1.51).contains(&t) {
            simulated.send(&[0]);
            simulated.request(&[at(t + 0.05, 3, Command::Ping)]);
        }
    });
    let overruns = heard.last_health().faults.get(Fault::RxOverrun);
    println!("{overruns} receiver overruns in 1 s");
    assert!(overruns > 0);
    assert_answered(&heard, 3);
    assert_all_samples(&heard);
}

#[test]
fn ticks_faster_than_the_work_are_flagged_and_counted_and_none_is_told_twice() {
    let rng = &mut generator(seed());
    let from_s = uniform(rng, 2.0, 4.0);
    let mut meddled = 0;
    let heard = meddle(8.0, |simulated, t| {
        if t > from_s && meddled == 0 {
            // A disturbed compare register: ticks of 700 us, less than acquisition and framing take.
            meddled = 1;
            for (address, value) in [
                (register::OCR1AH, 0),
                (register::OCR1AL, 174),
                (register::OCR1BH, 0),
                (register::OCR1BL, 158),
            ] {
                simulated.mcu_mut().write_register(address, value);
            }
        } else if t > from_s + 0.5 && meddled == 1 {
            meddled = 2;
            let rate = Command::SetRate {
                period_ticks: 12_500,
                periods_per_sample: 1,
            };
            simulated.request(&[
                at(
                    t,
                    5,
                    Command::SetRate {
                        period_ticks: 12_000,
                        periods_per_sample: 1,
                    },
                ),
                at(t + 0.5, 6, rate),
            ]);
        }
    });
    let health = heard.last_health();
    let overruns = health.faults.get(Fault::TickOverrun);
    let dropped = health.faults.get(Fault::FrameDropped);
    println!("{overruns} ticks without a sample, {dropped} samples that did not fit the line");
    assert!(overruns > 0 && dropped > 0);
    let samples: Vec<Sample> = heard.samples().map(|(_, sample)| sample).collect();
    assert!(
        samples
            .iter()
            .any(|sample| sample.flags & flags::TICK_OVERRUN != 0)
    );
    let gaps: u64 = samples
        .windows(2)
        .map(|pair| u64::from(pair[1].seq.wrapping_sub(pair[0].seq)) - 1)
        .sum();
    assert_eq!(
        gaps,
        u64::from(overruns) + u64::from(dropped),
        "each lost number has its reason"
    );
    let last = samples.last().expect("samples");
    assert_eq!(last.flags, flags::IN_ORDER, "and it is over");
}

#[test]
fn ticks_lost_behind_a_waiting_sample_are_numbered_behind_it() {
    let rng = &mut generator(seed());
    let from_s = uniform(rng, 2.0, 4.0);
    let mut asked = 0;
    let heard = meddle(8.0, |simulated, t| {
        if t > from_s && asked == 0 {
            // A disturbed compare register: ticks of 2 ms, which the set-up of the gyros takes longer than. It ends with a
            // sample waiting and the guard of the next tick gone by.
            for (address, value) in [
                (register::OCR1AH, 1),
                (register::OCR1AL, 243),
                (register::OCR1BH, 1),
                (register::OCR1BL, 227),
            ] {
                simulated.mcu_mut().write_register(address, value);
            }
        }
        if (from_s..from_s + 1.0).contains(&t) {
            let set = Command::SetGyro {
                range: 4,
                filter: 2,
            };
            simulated.request(&[at(t, asked, set)]);
            asked += 1;
        }
    });
    let health = heard.last_health();
    let overruns = health.faults.get(Fault::TickOverrun);
    println!("{asked} set-ups, {overruns} ticks without a sample");
    assert!(overruns > 10);
    // The clock counts 12 500 for each tick, whatever its length became: each sample bears the number of its own tick.
    let samples: Vec<Sample> = heard.samples().map(|(_, sample)| sample).collect();
    for sample in &samples {
        assert_eq!(sample.t_ticks, 12_500 * (u32::from(sample.seq) + 1));
    }
}
