//! What is no frame, and why: each reason has its name, its counter and its words, on either side of the line.

use wire::{
    Asked, Command, DecodeError, Decoder, Frame, Health, Reply, Request, RequestDecoder,
    RequestError, Sample, Status, kind,
};

/// A payload with its CRC and a delimiter, stuffed: written from docs/wire-format.md, for contents that no encoder makes.
fn on_the_line(payload: &[u8]) -> Vec<u8> {
    let mut body = payload.to_vec();
    body.extend(wire::crc::crc32c(payload).to_le_bytes());
    let mut line = Vec::new();
    for block in body.split(|&byte| byte == 0) {
        line.push(block.len() as u8 + 1);
        line.extend(block);
    }
    line.push(0);
    line
}

/// Version and kind, then so many fields of this value.
fn payload(version: u8, kind: u8, fields: usize, value: u8) -> Vec<u8> {
    [vec![version, kind], vec![value; fields]].concat()
}

const SAMPLE: usize = Sample::LEN - 2;
const HEALTH: usize = Health::LEN - 2;
const REQUEST: usize = Request::LEN - 2;

fn wrong() -> Vec<(DecodeError, Vec<u8>)> {
    let line = |version, kind, fields| on_the_line(&payload(version, kind, fields, 7));
    let sample = line(1, kind::SAMPLE, SAMPLE);
    let changed = |at: usize, value: u8| {
        let mut line = sample.clone();
        line[at] = value;
        line
    };
    let damaged = |fields| {
        let mut line = line(1, kind::HEALTH, fields);
        line[9] ^= 1;
        line
    };
    // A status that nobody has: the fourth byte of the fields.
    let mut reply = payload(1, kind::REPLY, Reply::LEN - 2, 0);
    reply[5] = 200;
    vec![
        (DecodeError::BadCobs, changed(0, 0xff)),
        (DecodeError::BadCobs, changed(0, sample[0] + 1)),
        (DecodeError::BadCrc, changed(9, 6)),
        (DecodeError::BadLength, line(1, kind::SAMPLE, SAMPLE - 1)),
        (DecodeError::BadLength, line(1, kind::SAMPLE, SAMPLE + 1)),
        (DecodeError::BadLength, line(1, kind::HELLO, SAMPLE)),
        (DecodeError::BadLength, line(1, kind::HEALTH, SAMPLE)),
        (DecodeError::BadLength, line(1, kind::REPLY, SAMPLE)),
        (DecodeError::BadLength, line(1, kind::CORRECTED, SAMPLE)),
        // Longer than any by a byte, which nobody looks into, and as long as the longest, which has its CRC to fit.
        (DecodeError::BadLength, damaged(HEALTH + 1)),
        (DecodeError::BadCrc, damaged(HEALTH)),
        // Longer than any; version and CRC alone; the CRC alone; not even that.
        (DecodeError::BadLength, line(1, kind::SAMPLE, 240)),
        (DecodeError::BadLength, on_the_line(&[1])),
        (DecodeError::BadLength, on_the_line(&[])),
        (DecodeError::BadLength, vec![2, 7, 0]),
        (
            DecodeError::UnknownVersion(2),
            line(2, kind::SAMPLE, SAMPLE),
        ),
        (
            DecodeError::UnknownKind(kind::REQUEST),
            line(1, kind::REQUEST, REQUEST),
        ),
        (DecodeError::UnknownKind(0x77), line(1, 0x77, 0)),
        (DecodeError::UnknownValue, on_the_line(&reply)),
    ]
}

#[test]
fn each_reason_is_told_and_the_frame_behind_it_arrives() {
    let good = on_the_line(&payload(1, kind::SAMPLE, SAMPLE, 7));
    for (reason, line) in wrong() {
        let mut decoder = Decoder::new();
        let told: Vec<_> = ([&line[..], &good, &[0, 0, 0]].concat().into_iter())
            .filter_map(|byte| decoder.push(byte))
            .collect();
        assert_eq!(told.len(), 2, "{reason:?}: {told:?}");
        assert_eq!(told[0], Err(reason));
        let Ok(Frame::Sample(sample)) = told[1] else {
            panic!("{told:?}");
        };
        assert_eq!(sample.seq, 0x0707);
    }
}

#[test]
fn each_reason_has_its_counter_and_all_of_them_are_rejected() {
    let mut decoder = Decoder::new();
    let mut expected = wire::LinkCounts::default();
    // Each reason another number of times.
    for (n, (reason, line)) in (1u32..).zip(wrong()) {
        for _ in 0..n {
            line.iter().for_each(|&byte| {
                decoder.push(byte);
            });
        }
        *match reason {
            DecodeError::BadCobs => &mut expected.bad_cobs,
            DecodeError::BadCrc => &mut expected.bad_crc,
            DecodeError::BadLength => &mut expected.bad_length,
            DecodeError::UnknownVersion(_) => &mut expected.unknown_version,
            DecodeError::UnknownKind(_) => &mut expected.unknown_kind,
            _ => &mut expected.unknown_value,
        } += n;
    }
    assert_eq!(
        decoder.counts().rejected(),
        (1..=wrong().len() as u32).sum()
    );
    on_the_line(&payload(1, kind::SAMPLE, SAMPLE, 7))
        .into_iter()
        .for_each(|byte| {
            decoder.push(byte);
        });
    expected.frames = 1;
    assert_eq!(*decoder.counts(), expected);
}

#[test]
fn reasons_are_told_in_words() {
    let words = [
        (
            DecodeError::BadCobs,
            "bytes lost or added (stuffing broken)",
        ),
        (DecodeError::BadCrc, "bytes damaged (CRC does not fit)"),
        (DecodeError::BadLength, "no frame has this length"),
        (
            DecodeError::UnknownVersion(2),
            "format version 2, this program speaks version 1",
        ),
        (
            DecodeError::UnknownKind(0x77),
            "frame kind 0x77 does not travel in this direction",
        ),
        (
            DecodeError::UnknownValue,
            "a field has a value that the format does not define",
        ),
    ];
    for (reason, text) in words {
        assert_eq!(reason.to_string(), text);
    }
}

fn asked(line: &[u8]) -> Option<Result<Request, RequestError>> {
    let mut decoder = RequestDecoder::new();
    line.iter().find_map(|&byte| decoder.push(byte))
}

#[test]
fn a_board_tells_what_is_no_request_from_what_it_refuses() {
    let line = |version, kind, fields| on_the_line(&payload(version, kind, fields, 0));
    for (reason, line) in [
        (
            DecodeError::UnknownVersion(9),
            line(9, kind::REQUEST, REQUEST),
        ),
        (
            DecodeError::UnknownKind(kind::SAMPLE),
            line(1, kind::SAMPLE, REQUEST),
        ),
        (DecodeError::BadLength, line(1, kind::REQUEST, REQUEST - 1)),
        (DecodeError::BadLength, line(1, kind::REQUEST, REQUEST + 1)),
        (DecodeError::BadLength, on_the_line(&[1])),
    ] {
        assert_eq!(asked(&line), Some(Err(RequestError::Frame(reason))));
    }
    let request = |code: u8, argument: u8| {
        let mut payload = payload(1, kind::REQUEST, REQUEST, 0);
        (payload[2], payload[3], payload[4], payload[5]) = (0x34, 0x12, code, argument);
        asked(&on_the_line(&payload))
    };
    let refused = |command, status| {
        let number = 0x1234;
        Some(Err(RequestError::Refused {
            number,
            command,
            status,
        }))
    };
    assert_eq!(request(200, 0), refused(200, Status::UnknownCommand));
    assert_eq!(request(1, 1), refused(1, Status::BadArgument));
    assert_eq!(request(36, 2), refused(36, Status::BadArgument));
    assert_eq!(request(37, 2), refused(37, Status::BadArgument));
    assert_eq!(request(64, 3), refused(64, Status::BadArgument));
    assert_eq!(request(66, 4), refused(66, Status::BadArgument));
    assert_eq!(request(49, 4), refused(49, Status::BadArgument));
    for (code, argument, command) in [
        (1, 0, Command::Ping),
        (36, 1, Command::Correction { on: true }),
        (36, 0, Command::Correction { on: false }),
    ] {
        let number = 0x1234;
        assert_eq!(
            request(code, argument),
            Some(Ok(Request { number, command }))
        );
    }
}

/// Only a reply may fill a queue: any other frame leaves room for one.
#[test]
fn room_is_asked_for_the_frame_and_for_a_reply_beside_it() {
    use wire::fields::room_for;
    assert_eq!(room_for(kind::REPLY, Reply::LEN - 2), Reply::FRAME_LEN);
    let with_reply = |len: usize| len + Reply::FRAME_LEN;
    assert_eq!(
        room_for(kind::SAMPLE, SAMPLE),
        with_reply(Sample::FRAME_LEN)
    );
    // Whatever the fields are: what goes out has the length that was asked for.
    for fields in 0..=240 {
        let mut line = [0; 300];
        let len = wire::fields::encode(kind::SAMPLE, &vec![7; fields], &mut line);
        assert_eq!(room_for(kind::SAMPLE, fields), with_reply(len), "{fields}");
    }
}

/// Bytes of arguments that a command has, by docs/wire-format.md.
fn used(code: u8) -> Option<usize> {
    Some(match code {
        1..=6 | 80..=82 => 0,
        19 | 36 | 66 => 1,
        17 | 18 | 32 | 37 | 48 | 51 | 64 | 83 => 2,
        16 | 50 => 3,
        65 => 4,
        33 | 34 => 5,
        35 => 7,
        49 => 8,
        _ => return None,
    })
}

#[test]
fn a_byte_that_a_command_does_not_use_is_refused_and_one_that_it_uses_is_not() {
    for code in 0..=u8::MAX {
        for place in 0..8 {
            let mut arguments = [0; 8];
            arguments[place] = 1;
            let asked = Asked {
                number: 1,
                code,
                arguments,
            };
            let refusal = match used(code) {
                None => Some(Status::UnknownCommand),
                Some(used) => (place >= used).then_some(Status::BadArgument),
            };
            assert_eq!(asked.refusal(), refusal, "command {code}, byte {place}");
        }
    }
}
