//! The format, byte for byte. `testdata/vectors.hex` was computed by `testdata/vectors.py` from docs/wire-format.md,
//! with its own CRC and its own stuffing; the fields are written out here once more.

use wire::{
    Axis, Command, Corrected, Decoder, Fault, FaultCounts, Frame, Health, Hello, MAX_FRAME, Reply,
    Request, RequestDecoder, Sample, Sensor, Shape, Status, encode, encode_request,
};

fn vector(name: &str) -> Vec<u8> {
    let line = include_str!("../testdata/vectors.hex")
        .lines()
        .find_map(|line| line.strip_prefix(name)?.strip_prefix(": "))
        .unwrap_or_else(|| panic!("no vector {name}"));
    let digits = |at: usize| u8::from_str_radix(&line[at..at + 2], 16).unwrap();
    (0..line.len()).step_by(2).map(digits).collect()
}

#[track_caller]
fn frame_is(name: &str, frame: Frame) {
    let expected = vector(name);
    let mut line = [0; MAX_FRAME];
    let len = encode(&frame, &mut line).unwrap();
    assert_eq!(line[..len], expected, "{name} encoded");
    let mut decoder = Decoder::new();
    let decoded: Vec<_> = expected
        .iter()
        .filter_map(|&byte| decoder.push(byte))
        .collect();
    assert_eq!(decoded, [Ok(frame)], "{name} decoded");
}

#[track_caller]
fn request_is(name: &str, number: u16, command: Command) {
    let expected = vector(name);
    let request = Request { number, command };
    let mut line = [0; Request::FRAME_LEN];
    let len = encode_request(&request, &mut line).unwrap();
    assert_eq!(line[..len], expected, "{name} encoded");
    let mut decoder = RequestDecoder::new();
    let decoded: Vec<_> = expected
        .iter()
        .filter_map(|&byte| decoder.push(byte))
        .collect();
    assert_eq!(decoded, [Ok(request)], "{name} decoded");
}

#[test]
fn ref_samples() {
    frame_is("sample_zero", Frame::Sample(Sample::default()));
    frame_is(
        "sample_in_order",
        Frame::Sample(Sample {
            seq: 0x1234,
            t_ticks: 0x0102_0304,
            gyro: [-1, 4368, -8192],
            temp: [-447, 0, 413],
            supply: 2730,
            acc: [512, 511, 760],
            pwm: -200,
            flags: 7,
            rate: [-4801, 20_971_499, i32::MIN],
        }),
    );
}

#[test]
fn ref_hello() {
    frame_is(
        "hello",
        Frame::Hello(Hello {
            firmware: [1, 2, 3],
            board_id: 0xBEEF,
            reset_cause: wire::reset_cause::POWER_ON | wire::reset_cause::WATCHDOG,
            restarts: 5,
            next_seq: 0,
            tick_ns: 4000,
            period_ticks: 12_500,
            baud_divisor: 25,
            gyro_range: 4,
            gyro_filter: 2,
            gyro_sample_period: 1,
            acc_range: 0,
            config_source: 1,
            bias: [65_536, -32_768, 0],
            scale: [1_229_099, 614_549, 307_275],
            periods_per_sample: 3,
        }),
    );
}

#[test]
fn ref_health() {
    let mut faults = FaultCounts::new();
    for (place, fault) in Fault::all().into_iter().enumerate() {
        faults.set(fault, 1000 * place as u16);
    }
    let health = Health {
        uptime_s: 86_400,
        next_seq: 0xFFFF,
        tick_busy_max: 12_499,
        stack_free: 300,
        faults,
    };
    frame_is("health", Frame::Health(health));
    for fault in Fault::all() {
        faults.set(fault, u16::MAX);
    }
    let health = Health {
        uptime_s: u32::MAX,
        faults,
        ..Health::default()
    };
    frame_is("health_saturated", Frame::Health(health));
}

#[test]
fn ref_replies() {
    let reply = Reply {
        number: 258,
        command: 1,
        status: Status::Ok,
        value: 0,
        detail: [0; 3],
    };
    frame_is("reply_ok", Frame::Reply(reply));
    let reply = Reply {
        number: 65_535,
        command: 32,
        status: Status::Ok,
        value: 120,
        detail: [65_536, -65_536, 1],
    };
    frame_is("reply_bias_null", Frame::Reply(reply));
    let reply = Reply {
        number: 2,
        command: 32,
        status: Status::Moving,
        value: 0,
        detail: [0; 3],
    };
    frame_is("reply_moving", Frame::Reply(reply));
}

#[test]
fn ref_corrected() {
    let corrected = Corrected {
        seq: 0x1234,
        rate: [1 << 20, -1, 0],
        bias: [-(1 << 19), 7, 0],
        known: [256, 65_535, 0],
        correction: 0xBEEF,
        state: 0x27,
        attitude: None,
    };
    // Of a board without an attitude.
    frame_is("corrected", Frame::Corrected(corrected));
    let corrected = Corrected {
        state: 0xA7,
        attitude: Some([1 << 30, -1, 0x0102_0304, i32::MIN]),
        ..corrected
    };
    frame_is("corrected_attitude", Frame::Corrected(corrected));
}

#[test]
fn ref_requests() {
    request_is(
        "request_set_correction",
        29,
        Command::SetCorrection {
            row: 17,
            values: [-32_768, 32_767, 258],
        },
    );
    request_is("request_correction", 30, Command::Correction { on: true });
    request_is(
        "request_get_correction",
        31,
        Command::GetCorrection {
            other: true,
            row: 12,
        },
    );
    request_is("request_ping", 1, Command::Ping);
    request_is("request_keep_alive", 0x0203, Command::KeepAlive);
    request_is(
        "request_set_rate",
        7,
        Command::SetRate {
            period_ticks: 62_500,
            periods_per_sample: 4,
        },
    );
    request_is("request_set_baud", 8, Command::SetBaud { divisor: 3 });
    request_is(
        "request_set_gyro",
        9,
        Command::SetGyro {
            range: 1,
            filter: 4,
        },
    );
    request_is(
        "request_set_acc_range",
        10,
        Command::SetAccRange { range: 3 },
    );
    request_is("request_bias_null", 11, Command::BiasNull { samples: 200 });
    request_is(
        "request_set_bias",
        12,
        Command::SetBias {
            axis: Axis::Z,
            value: -65_536,
        },
    );
    request_is(
        "request_set_scale",
        13,
        Command::SetScale {
            axis: Axis::Y,
            value: 1_229_099,
        },
    );
    request_is("request_motor_duty", 14, Command::MotorDuty { duty: -255 });
    request_is(
        "request_motor_profile",
        15,
        Command::MotorProfile {
            shape: Shape::Sine,
            amplitude: 200,
            offset: -20,
            period_ms: 1500,
            cycles: 4,
        },
    );
    request_is(
        "request_motor_limits",
        16,
        Command::MotorLimits {
            max_duty: 200,
            ramp_per_s: 500,
        },
    );
    request_is("request_arm", 28, Command::Arm { nonce: 0xA55A });
    request_is(
        "request_read_register",
        17,
        Command::ReadRegister {
            gyro: Axis::X,
            address: 0x38,
        },
    );
    request_is(
        "request_write_register",
        18,
        Command::WriteRegister {
            gyro: Axis::Y,
            address: 0x38,
            value: 0x0402,
        },
    );
    request_is(
        "request_self_test",
        19,
        Command::SelfTest {
            sensor: Sensor::Accelerometer,
        },
    );
    request_is(
        "request_set_board_id",
        20,
        Command::SetBoardId { board_id: 0xBEEF },
    );
    request_is("request_get_hello", 21, Command::GetHello);
    request_is("request_counters", 22, Command::Counters);
    request_is("request_clear_counters", 23, Command::ClearCounters);
    request_is("request_reboot", 24, Command::Reboot);
    request_is("request_store_config", 25, Command::StoreConfig);
    request_is("request_load_config", 26, Command::LoadConfig);
    request_is("request_default_config", 27, Command::DefaultConfig);
}

#[test]
fn the_page_and_the_crate_give_the_same_lengths_counters_and_codes() {
    let page = include_str!("../../../docs/wire-format.md");
    for (code, name, len, frame_len) in [
        (1, "hello | board -> PC", Hello::LEN, Hello::FRAME_LEN),
        (2, "sample | board -> PC", Sample::LEN, Sample::FRAME_LEN),
        (3, "health | board -> PC", Health::LEN, Health::FRAME_LEN),
        (4, "reply | board -> PC", Reply::LEN, Reply::FRAME_LEN),
        (
            5,
            "corrected | board -> PC",
            Corrected::LEN,
            Corrected::FRAME_LEN,
        ),
        (
            5,
            "corrected, without an attitude | board -> PC",
            Corrected::SHORT_LEN,
            Corrected::SHORT_LEN + wire::OVERHEAD,
        ),
        (
            0x10,
            "request | PC -> board",
            Request::LEN,
            Request::FRAME_LEN,
        ),
    ] {
        let row = format!("| {code:#04x} | {name} | {len} | {frame_len} |");
        assert!(page.contains(&row), "{row}");
    }
    for fault in Fault::all() {
        let (name, place) = (fault.name(), fault as usize);
        let row = match name.strip_suffix("_x") {
            Some(stem) => format!(
                "| {place}, {}, {} | `{stem}_x, _y, _z` |",
                place + 1,
                place + 2
            ),
            None if name.ends_with("_y") || name.ends_with("_z") => continue,
            None => format!("| {place} | `{name}` |"),
        };
        assert!(page.contains(&row), "{row}");
    }
    for code in 0..=u8::MAX {
        if let Some(status) = Status::from_code(code) {
            let row = format!("| {code} | `{status:?}` |");
            assert!(page.contains(&row), "{row}");
        }
    }
}

#[test]
fn flags_have_the_bits_of_the_page() {
    use wire::{correction_state as state, flags};
    let bits = [
        flags::new_data(0),
        flags::new_data(1),
        flags::new_data(2),
        flags::error(0),
        flags::error(1),
        flags::error(2),
        flags::GYRO_NOT_ANSWERING,
        flags::ACC_AT_RAIL,
        flags::TICK_OVERRUN,
        flags::BIAS_NULL,
        1 << 10,
        flags::SUPPLY_OUT_OF_RANGE,
        flags::ACC_NOT_CONVERTED,
        flags::GYRO_MISCONFIGURED,
    ];
    for (bit, flag) in bits.into_iter().enumerate() {
        assert_eq!(flag, 1 << bit, "{bit}");
    }
    let named = [
        flags::NEW_X,
        flags::NEW_Y,
        flags::NEW_Z,
        flags::ERROR_X,
        flags::ERROR_Y,
        flags::ERROR_Z,
    ];
    assert_eq!(named, bits[..6], "by name as by axis");
    assert_eq!(bits[10], flags::RESERVED_10);
    assert_eq!(flags::IN_ORDER, 7);
    let states = [
        state::APPLIED,
        state::FILTERED,
        state::AT_REST,
        state::REFUSED,
        state::NOISE_OFF,
        state::EXTRAPOLATED,
        state::NOT_IN_ORDER,
        state::YAW_FREE,
    ];
    for (bit, flag) in states.into_iter().enumerate() {
        assert_eq!(flag, 1 << bit, "{bit}");
    }
}
