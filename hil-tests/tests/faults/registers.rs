//! Registers of the gyros that are not what was written, or are what another board wrote.

use super::*;

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
