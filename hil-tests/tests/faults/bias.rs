//! Biases and scales: measured beside faults, within what the numbers hold.

use super::*;

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
