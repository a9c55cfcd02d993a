//! Faults of sensors, wires and line, each planted at a random time: flagged in the frame, counted in health, the others
//! go on, nothing is invented, and the board comes back by itself. `IMU_STAND_SEED` replays a run.

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

#[test]
fn a_register_that_does_not_read_back_is_told_and_set_right_by_itself() {
    let rng = &mut generator(seed());
    for axis in 0..3 {
        let from_s = uniform(rng, 2.0, 3.0);
        let clips = Clips {
            clip: Clip::ReadBack { axis },
            from_s,
            to_s: from_s + 2.0,
        };
        let mut simulated = Simulated::new(&image(), &Scenario::quiet(8), clips).expect("an image");
        simulated.request(&[at(
            from_s + 0.3,
            7,
            Command::SetGyro {
                range: 2,
                filter: 3,
            },
        )]);
        let heard = hear_out(simulated, 10.0);
        let (_, reply) = heard.replies().next().expect("one answer");
        assert_eq!((reply.number, reply.status), (7, Status::ReadBackWrong));
        let health = heard.last_health();
        assert!(health.faults.get(Fault::gyro_register_mismatch(axis as u8)) > 0);
        let flagged = |from: f64, to: f64| {
            heard
                .samples()
                .filter(|&(t, _)| (from..to).contains(&t))
                .filter(|(_, sample)| sample.flags & flags::GYRO_MISCONFIGURED != 0)
                .count()
        };
        assert!(
            flagged(from_s + 0.5, from_s + 1.9) >= 27,
            "every sample says so"
        );
        assert_eq!(flagged(9.0, 10.0), 0, "and no more, once it reads back");
    }
}

/// SENS/AVG of one gyro, written past the set-up: its rates are no longer what the hello frame's scale makes of them.
#[test]
fn a_register_written_by_hand_is_flagged_until_the_gyros_are_set_up_anew() {
    for gyro in [wire::Axis::X, wire::Axis::Y, wire::Axis::Z] {
        let mut simulated = Simulated::new(&image(), &Scenario::quiet(8), bench::simavr::NoProbe)
            .expect("an image");
        let write = Command::WriteRegister {
            gyro,
            address: SENS_AVG as u8,
            value: 0x0104,
        };
        let set = Command::SetGyro {
            range: 4,
            filter: 2,
        };
        simulated.request(&[at(2.0, 1, write), at(5.0, 2, set)]);
        let heard = hear_out(simulated, 8.0);
        assert_answered(&heard, 1);
        assert_answered(&heard, 2);
        for (t, sample) in heard.samples() {
            let flagged = sample.flags & flags::GYRO_MISCONFIGURED != 0;
            if (2.2..5.0).contains(&t) {
                assert!(flagged, "{gyro:?} at {t}");
            } else if !(2.0..5.5).contains(&t) {
                assert_eq!(sample.flags, flags::IN_ORDER, "{gyro:?} at {t}");
            }
        }
    }
}

#[test]
fn an_impossible_scale_of_a_gyro_is_told_and_counted() {
    for axis in 0..3u8 {
        // From the start on: the scale is the part's calibration, which nothing changes while it runs.
        let clip = Clip::Scale { axis: axis.into() };
        let heard = listen(clip, 0.0, 20.0, 12.0);
        assert!(
            heard
                .last_health()
                .faults
                .get(Fault::gyro_scale_impossible(axis))
                > 0
        );
        assert!(
            heard.samples().all(
                |(_, sample)| sample.flags & flags::GYRO_MISCONFIGURED != 0 || sample.seq < 220
            )
        );
    }
}

/// GYRO_OFF and the like of a part that was used elsewhere, as its flash keeps them.
#[test]
fn what_a_used_part_brings_along_is_set_right_before_the_first_sample() {
    let kept = [
        (0x14u8, 0x0123u16), // GYRO_OFF: 5.3 deg/s
        (0x28, 0x0a04),      // ALM_CTRL: gyro above its magnitude
        (0x34, 0x0006),      // MSC_CTRL: data ready
        (0x36, 0x0008),      // SMPL_PRD: slow, 1 MHz at the most
    ];
    let scenario = Scenario::quiet(8);
    let mut simulated = Simulated::new(&image(), &scenario, Pace::default()).expect("an image");
    for axis in 0..3 {
        for (address, value) in kept {
            simulated.stand_mut().gyro_mut(axis).keep(address, value);
        }
    }
    let heard = hear_out(simulated, 3.0);
    let plain = Simulated::new(&image(), &scenario, Pace::default()).expect("an image");
    let of_new_parts = hear_out(plain, 3.0);
    let means = |heard: &Heard| {
        let samples: Vec<_> = heard.samples().map(|(_, sample)| sample).collect();
        [0, 1, 2].map(|axis| {
            let sum: f64 = samples.iter().map(|s| f64::from(s.gyro[axis])).sum();
            sum / samples.len() as f64
        })
    };
    for (used, new) in means(&heard).into_iter().zip(means(&of_new_parts)) {
        // Noise of 55 samples of 3.5 counts rms each, twice; the offset would be 73 counts.
        assert!((used - new).abs() < 4.0, "{used} {new}");
    }
    assert!(heard.samples().all(|(_, s)| s.flags == flags::IN_ORDER));
    assert_all_samples(&heard);
}

/// Looks at the clock of the frames before the sample period has been set.
#[derive(Default)]
struct Pace {
    frames: u32,
}

impl Probe for Pace {
    fn event(&mut self, _at: u64, event: bench::simavr::Event) {
        if let bench::simavr::Event::Spi { cycles, .. } = event {
            self.frames += 1;
            // The first gyro's sample period, written and read back in four frames of two bytes: 1 MHz at the most.
            if self.frames <= 8 {
                assert!(cycles >= 8 * 16, "{cycles} cycles for a byte");
            }
        }
    }
}

#[test]
fn an_error_that_has_passed_is_cleared_and_one_that_stays_is_told_on() {
    let flagged = |heard: &Heard, from: f64, to: f64| {
        let inside = heard.samples().filter(|&(t, _)| (from..to).contains(&t));
        let (mut with, mut all) = (0, 0);
        inside.for_each(|(_, sample)| {
            all += 1;
            with += u32::from(sample.flags & flags::error(1) != 0);
        });
        (with, all)
    };
    // STATUS of gyro y: supply above 5.25 V for once; the part keeps it until STATUS is read.
    let mut simulated =
        Simulated::new(&image(), &Scenario::quiet(8), bench::simavr::NoProbe).expect("an image");
    let mut heard = Heard::default();
    simulated
        .run_until(2.0, &mut |byte| heard.push(byte))
        .expect("it runs");
    simulated.stand_mut().gyro_mut(1).raise(1 << 1);
    simulated
        .run_until(5.0, &mut |byte| heard.push(byte))
        .expect("it runs");
    let (with, _) = flagged(&heard, 2.0, 5.0);
    assert!((1..=3).contains(&with), "{with} samples in error");
    let counted = heard.last_health().faults.get(Fault::gyro_error_alarm(1));
    assert_eq!(u32::from(counted), with);
    assert_all_samples(&heard);
    // One that comes back at once is told by every sample.
    let heard = listen(Clip::Alarm { axis: 1 }, 2.0, 5.0, 6.0);
    let (with, all) = flagged(&heard, 2.1, 4.9);
    assert_eq!(with, all);
}

#[test]
fn a_bias_measurement_with_a_dead_gyro_is_answered_and_the_next_one_too() {
    let clip = Clips {
        clip: Clip::Miso {
            axis: 1,
            level: false,
        },
        from_s: 2.0,
        to_s: 6.0,
    };
    let mut simulated = Simulated::new(&image(), &Scenario::quiet(8), clip).expect("an image");
    let null = Command::BiasNull { samples: 24 };
    simulated.request(&[at(2.5, 1, null), at(4.0, 2, null), at(8.0, 3, null)]);
    let heard = hear_out(simulated, 11.0);
    let answers: Vec<_> = heard.replies().map(|(_, r)| (r.number, r.status)).collect();
    assert_eq!(
        answers,
        [
            (1, Status::NotAnswering),
            (2, Status::NotAnswering),
            (3, Status::Ok)
        ]
    );
}

#[test]
fn a_bias_measurement_takes_only_samples_in_order() {
    for clip in [
        Clip::Alarm { axis: 0 },
        Clip::Supply,
        Clip::Rail {
            axis: 2,
            high: true,
        },
    ] {
        let clips = Clips {
            clip,
            from_s: 2.0,
            to_s: 5.0,
        };
        let mut simulated = Simulated::new(&image(), &Scenario::quiet(8), clips).expect("an image");
        simulated.request(&[at(2.5, 1, Command::BiasNull { samples: 24 })]);
        let heard = hear_out(simulated, 6.0);
        let (_, reply) = heard.replies().next().expect("an answer");
        assert_eq!(reply.status, Status::NotAnswering, "{clip:?}");
    }
}

#[test]
fn a_bias_measurement_ends_with_a_change_of_what_it_measures() {
    for change in [
        Command::SetRate {
            period_ticks: 10_000,
            periods_per_sample: 1,
        },
        Command::SetGyro {
            range: 2,
            filter: 3,
        },
        Command::SetScale {
            axis: wire::Axis::Z,
            value: 1_200_000,
        },
        Command::DefaultConfig,
    ] {
        let mut simulated = Simulated::new(&image(), &Scenario::quiet(8), bench::simavr::NoProbe)
            .expect("an image");
        simulated.request(&[
            at(2.0, 1, Command::BiasNull { samples: 100 }),
            at(3.0, 2, change),
        ]);
        let heard = hear_out(simulated, 5.0);
        let answers: Vec<_> = heard.replies().map(|(_, r)| (r.number, r.status)).collect();
        assert_eq!(
            answers,
            [(1, Status::Aborted), (2, Status::Ok)],
            "{change:?}"
        );
    }
}

#[test]
fn scales_and_biases_that_would_wrap_are_refused_and_a_stored_one_is_not_taken() {
    let axis = wire::Axis::X;
    let mut simulated =
        Simulated::new(&image(), &Scenario::quiet(8), bench::simavr::NoProbe).expect("an image");
    let far = [
        Command::SetScale {
            axis,
            value: i32::MAX,
        },
        Command::SetScale {
            axis,
            value: 1 << 22,
        },
        Command::SetScale { axis, value: 0 },
        Command::SetBias {
            axis,
            value: i32::MIN,
        },
        Command::SetBias {
            axis,
            value: 512 << 16,
        },
    ];
    let requests: Vec<_> = (far.into_iter().zip(1..))
        .map(|(command, n)| at(0.5 + 0.1 * f64::from(n), n, command))
        .collect();
    simulated.request(&requests);
    simulated.request(&[at(1.5, 9, Command::StoreConfig)]);
    let mut heard = Heard::default();
    simulated
        .run_until(3.0, &mut |byte| heard.push(byte))
        .expect("it runs");
    for (_, reply) in heard.replies().filter(|(_, reply)| reply.number < 9) {
        assert_eq!(
            reply.status,
            Status::BadArgument,
            "request {}",
            reply.number
        );
    }
    assert_answered(&heard, 9);
    // A copy whose CRC fits and whose scale does not.
    let mut eeprom = simulated.mcu().eeprom().to_vec();
    let copy = [16, 80]
        .into_iter()
        .find(|&at| eeprom[at] == 2)
        .expect("stored");
    let scale = copy + 2 + 21;
    eeprom[scale + 3] = 0x40;
    let crc = wire::crc::crc32c(&eeprom[copy..copy + 41]);
    eeprom[copy + 41..copy + 45].copy_from_slice(&crc.to_le_bytes());
    simulated.mcu_mut().set_eeprom(&eeprom);
    simulated.power_cycle();
    simulated
        .run_until(5.0, &mut |byte| heard.push(byte))
        .expect("it runs");
    let (_, hello) = heard.hellos().last().expect("a hello");
    assert_eq!(hello.config_source, 0);
    assert!(
        hello
            .scale
            .iter()
            .all(|&scale| scale > 0 && scale < 1 << 22)
    );
    assert_eq!(heard.last_health().faults.get(Fault::ConfigInvalid), 1);
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
