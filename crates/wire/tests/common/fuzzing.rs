//! What holds for any bytes on a line. Used by `fuzz/` and, on stable, by `tests/fuzz_corpus.rs`.
#![allow(dead_code, reason = "each fuzz target uses one of the two")]

use wire::{
    Command, Decoder, Frame, MAX_FRAME, Request, RequestDecoder, RequestError, encode,
    encode_request,
};

/// The PC's decoder.
pub fn frames(line: &[u8]) {
    let mut decoder = Decoder::new();
    let (mut accepted, mut rejected) = (0, 0);
    for segment in line.split_inclusive(|&byte| byte == 0) {
        let outcomes: Vec<_> = segment
            .iter()
            .filter_map(|&byte| decoder.push(byte))
            .collect();
        match outcomes[..] {
            [] => assert!(
                segment == [0] || segment.last() != Some(&0),
                "a frame ended without an outcome"
            ),
            [Ok(frame)] => {
                accepted += 1;
                let mut again = [0; MAX_FRAME];
                let len = encode(&frame, &mut again).unwrap();
                assert_eq!(
                    again[..len],
                    *segment,
                    "accepted what is no encoding of {frame:?}"
                );
            }
            [Err(_)] => rejected += 1,
            _ => panic!("more than one outcome at one delimiter"),
        }
    }
    let counts = *decoder.counts();
    assert_eq!((counts.frames, counts.rejected()), (accepted, rejected));

    let next = Frame::Sample(wire::Sample {
        seq: 0x0100,
        flags: 7,
        ..wire::Sample::default()
    });
    let mut bytes = [0; MAX_FRAME];
    let len = encode(&next, &mut bytes).unwrap();
    decoder.push(0);
    let arrived = bytes[..len].iter().find_map(|&byte| decoder.push(byte));
    assert_eq!(arrived, Some(Ok(next)), "the next intact frame");
}

/// The board's decoder.
pub fn requests(line: &[u8]) {
    let mut decoder = RequestDecoder::new();
    for segment in line.split_inclusive(|&byte| byte == 0) {
        let outcomes: Vec<_> = segment
            .iter()
            .filter_map(|&byte| decoder.push(byte))
            .collect();
        match outcomes[..] {
            [] => assert!(
                segment == [0] || segment.last() != Some(&0),
                "a frame ended without an outcome"
            ),
            [Ok(request)] => {
                let mut again = [0; Request::FRAME_LEN];
                let len = encode_request(&request, &mut again).unwrap();
                assert_eq!(
                    again[..len],
                    *segment,
                    "accepted what is no encoding of {request:?}"
                );
            }
            [Err(RequestError::Refused { .. })] => {
                assert_eq!(
                    segment.len(),
                    Request::FRAME_LEN,
                    "only an undamaged request is answered"
                );
            }
            [Err(RequestError::Frame(_))] => {}
            _ => panic!("more than one outcome at one delimiter"),
        }
    }
    let next = Request {
        number: 0x0100,
        command: Command::KeepAlive,
    };
    let mut bytes = [0; Request::FRAME_LEN];
    encode_request(&next, &mut bytes).unwrap();
    decoder.push(0);
    let arrived = bytes.iter().find_map(|&byte| decoder.push(byte));
    assert_eq!(arrived, Some(Ok(next)), "the next intact request");
}
