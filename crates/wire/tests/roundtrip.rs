//! What goes in comes out, whatever the fields hold.

use proptest::prelude::*;
use wire::{
    Axis, Command, Corrected, Decoder, Fault, FaultCounts, Frame, Health, Hello, MAX_FRAME, Reply,
    Request, RequestDecoder, Sample, Sensor, Shape, Status, encode, encode_request,
};

prop_compose! {
    fn sample()(
        (seq, t_ticks, gyro, temp, supply) in any::<(u16, u32, [i16; 3], [i16; 3], u16)>(),
        (acc, pwm, flags, rate) in any::<([u16; 3], i16, u16, [i32; 3])>(),
    ) -> Sample {
        Sample { seq, t_ticks, gyro, temp, supply, acc, pwm, flags, rate }
    }
}

prop_compose! {
    fn hello()(
        (firmware, board_id, reset_cause, restarts, next_seq) in any::<([u8; 3], u16, u8, u16, u16)>(),
        (tick_ns, period_ticks, baud_divisor, bias, scale) in any::<(u32, u16, u16, [i32; 3], [i32; 3])>(),
        [gyro_range, gyro_filter, gyro_sample_period, acc_range, config_source, periods_per_sample] in any::<[u8; 6]>(),
    ) -> Hello {
        Hello {
            firmware, board_id, reset_cause, restarts, next_seq, tick_ns, period_ticks, baud_divisor,
            gyro_range, gyro_filter, gyro_sample_period, acc_range, config_source, bias, scale, periods_per_sample,
        }
    }
}

prop_compose! {
    fn health()(
        (uptime_s, next_seq, tick_busy_max, stack_free) in any::<(u32, u16, u16, u16)>(),
        counts in prop::collection::vec(any::<u16>(), Fault::COUNT),
    ) -> Health {
        let mut faults = FaultCounts::new();
        for (fault, count) in Fault::all().into_iter().zip(counts) {
            faults.set(fault, count);
        }
        Health { uptime_s, next_seq, tick_busy_max, stack_free, faults }
    }
}

fn status() -> impl Strategy<Value = Status> {
    (0..=u8::MAX).prop_filter_map("no status has this code", Status::from_code)
}

prop_compose! {
    fn reply()(
        (number, command, value, detail) in any::<(u16, u8, i32, [i32; 3])>(),
        status in status(),
    ) -> Reply {
        Reply { number, command, status, value, detail }
    }
}

prop_compose! {
    fn corrected()(
        (seq, rate, bias, known) in any::<(u16, [i32; 3], [i32; 3], [u16; 3])>(),
        (correction, state, attitude) in any::<(u16, u8, Option<[i32; 4]>)>(),
    ) -> Corrected {
        Corrected { seq, rate, bias, known, correction, state, attitude }
    }
}

fn frame() -> impl Strategy<Value = Frame> {
    prop_oneof![
        sample().prop_map(Frame::Sample),
        hello().prop_map(Frame::Hello),
        health().prop_map(Frame::Health),
        reply().prop_map(Frame::Reply),
        corrected().prop_map(Frame::Corrected),
    ]
}

fn axis() -> impl Strategy<Value = Axis> {
    prop_oneof![Just(Axis::X), Just(Axis::Y), Just(Axis::Z)]
}

fn command() -> impl Strategy<Value = Command> {
    let sensor = prop_oneof![
        Just(Sensor::GyroX),
        Just(Sensor::GyroY),
        Just(Sensor::GyroZ),
        Just(Sensor::Accelerometer)
    ];
    let shape = prop_oneof![
        Just(Shape::Stop),
        Just(Shape::Steps),
        Just(Shape::Triangle),
        Just(Shape::Sine)
    ];
    prop_oneof![
        prop::sample::select(vec![
            Command::Ping,
            Command::GetHello,
            Command::KeepAlive,
            Command::Counters,
            Command::ClearCounters,
            Command::Reboot,
            Command::StoreConfig,
            Command::LoadConfig,
            Command::DefaultConfig,
        ]),
        any::<(u16, u8)>().prop_map(|(period_ticks, periods_per_sample)| Command::SetRate {
            period_ticks,
            periods_per_sample
        }),
        any::<u16>().prop_map(|divisor| Command::SetBaud { divisor }),
        any::<(u8, u8)>().prop_map(|(range, filter)| Command::SetGyro { range, filter }),
        any::<u8>().prop_map(|range| Command::SetAccRange { range }),
        any::<u16>().prop_map(|samples| Command::BiasNull { samples }),
        (axis(), any::<i32>()).prop_map(|(axis, value)| Command::SetBias { axis, value }),
        (axis(), any::<i32>()).prop_map(|(axis, value)| Command::SetScale { axis, value }),
        any::<i16>().prop_map(|duty| Command::MotorDuty { duty }),
        (shape, any::<(i16, i16, u16, u8)>()).prop_map(
            |(shape, (amplitude, offset, period_ms, cycles))| {
                Command::MotorProfile {
                    shape,
                    amplitude,
                    offset,
                    period_ms,
                    cycles,
                }
            }
        ),
        any::<u16>().prop_map(|nonce| Command::Arm { nonce }),
        any::<(u8, [i16; 3])>().prop_map(|(row, values)| Command::SetCorrection { row, values }),
        any::<bool>().prop_map(|on| Command::Correction { on }),
        any::<(bool, u8)>().prop_map(|(other, row)| Command::GetCorrection { other, row }),
        any::<(u8, u16)>().prop_map(|(max_duty, ramp_per_s)| Command::MotorLimits {
            max_duty,
            ramp_per_s
        }),
        (axis(), any::<u8>()).prop_map(|(gyro, address)| Command::ReadRegister { gyro, address }),
        (axis(), any::<(u8, u16)>()).prop_map(|(gyro, (address, value))| Command::WriteRegister {
            gyro,
            address,
            value
        }),
        sensor.prop_map(|sensor| Command::SelfTest { sensor }),
        any::<u16>().prop_map(|board_id| Command::SetBoardId { board_id }),
    ]
}

fn on_the_line(frame: &Frame) -> Vec<u8> {
    let mut line = [0xAA; MAX_FRAME];
    let len = encode(frame, &mut line).unwrap();
    line[..len].to_vec()
}

fn decoded(line: &[u8]) -> Vec<Result<Frame, wire::DecodeError>> {
    let mut decoder = Decoder::new();
    line.iter().filter_map(|&byte| decoder.push(byte)).collect()
}

proptest! {
    #[test]
    fn every_frame_comes_back(frame in frame()) {
        let line = on_the_line(&frame);
        prop_assert_eq!(decoded(&line), [Ok(frame)]);
        prop_assert_eq!(line.iter().position(|&byte| byte == 0), Some(line.len() - 1), "only the end is zero");
        let len = match frame {
            Frame::Hello(_) => Hello::FRAME_LEN,
            Frame::Sample(_) => Sample::FRAME_LEN,
            Frame::Health(_) => Health::FRAME_LEN,
            Frame::Reply(_) => Reply::FRAME_LEN,
            Frame::Corrected(Corrected { attitude: None, .. }) => Corrected::SHORT_LEN + wire::OVERHEAD,
            Frame::Corrected(_) => Corrected::FRAME_LEN,
        };
        prop_assert_eq!(line.len(), len, "the length does not depend on the fields");
    }

    #[test]
    fn every_request_comes_back(number in any::<u16>(), command in command()) {
        let request = Request { number, command };
        let mut line = [0xAA; Request::FRAME_LEN];
        prop_assert_eq!(encode_request(&request, &mut line), Ok(Request::FRAME_LEN));
        let mut decoder = RequestDecoder::new();
        let requests: Vec<_> = line.iter().filter_map(|&byte| decoder.push(byte)).collect();
        prop_assert_eq!(requests, [Ok(request)]);
    }

    #[test]
    fn after_any_bytes_and_a_delimiter_the_next_frame_arrives(
        garbage in prop::collection::vec(any::<u8>(), 0..400),
        frame in frame(),
    ) {
        let mut line = garbage;
        line.push(0);
        line.extend(on_the_line(&frame));
        prop_assert_eq!(decoded(&line).pop(), Some(Ok(frame)));
    }

    #[test]
    fn two_frames_spliced_are_neither(first in frame(), second in frame(), cut in any::<prop::sample::Index>(), again in any::<prop::sample::Index>()) {
        let (first, second) = (on_the_line(&first), on_the_line(&second));
        let mut line = first[..cut.index(first.len() - 1)].to_vec();
        line.extend(&second[again.index(second.len() - 1)..]);
        let intact = line == first || line == second || line == [0];
        prop_assert!(intact || decoded(&line).iter().all(Result::is_err));
    }
}

#[test]
fn a_buffer_that_is_too_small_says_what_is_needed() {
    let mut line = [0; Sample::FRAME_LEN - 1];
    let error = encode(&Frame::Sample(Sample::default()), &mut line).unwrap_err();
    assert_eq!(
        error.to_string(),
        "the frame has 50 bytes, the buffer takes 49"
    );
    assert_eq!(line, [0; Sample::FRAME_LEN - 1], "and nothing was written");
}
