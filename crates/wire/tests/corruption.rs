//! No damaged frame is accepted, and the next intact one always arrives. `examples/corrupt.rs` does the same at length.

#[path = "common/corruption.rs"]
mod corruption;

use corruption::{DAMAGES, board_frames, campaign};
use wire::{Axis, Command, Decoder, Request, RequestDecoder, encode_request};

/// A CRC of 32 bits lets one in 4.3e9 through; in a million, at all, with a probability of 2e-4 at most.
#[test]
fn of_a_million_damaged_frames_none_is_accepted_and_no_intact_one_is_lost() {
    let mut decoder = Decoder::new();
    let tally = campaign(
        &board_frames(1),
        |byte| decoder.push(byte).map(Result::ok),
        1_000_000,
        20_261_121,
        |_| (),
    );
    assert_eq!((tally.accepted, tally.lost), (0, 0), "{tally:?}");
    assert!(tally.intact > 800_000, "{tally:?}");
    for (damage, &count) in DAMAGES.iter().zip(&tally.by_damage) {
        assert!(count > 100_000, "{damage}: {count}");
    }
    let counts = decoder.counts();
    assert_eq!(u64::from(counts.frames), tally.intact);
    assert_eq!(u64::from(counts.rejected()), tally.damaged);
}

#[test]
fn the_board_accepts_no_damaged_request_and_loses_no_intact_one() {
    let mut requests = Vec::new();
    for number in 0..256 {
        let command = match number % 4 {
            0 => Command::KeepAlive,
            1 => Command::MotorDuty {
                duty: number as i16,
            },
            2 => Command::SetBias {
                axis: Axis::X,
                value: -i32::from(number),
            },
            _ => Command::SetRate {
                period_ticks: 12_500,
                periods_per_sample: 1,
            },
        };
        let request = Request { number, command };
        let mut line = [0; Request::FRAME_LEN];
        encode_request(&request, &mut line).unwrap();
        requests.push((request, line.to_vec()));
    }
    let mut decoder = RequestDecoder::new();
    let tally = campaign(
        &requests,
        |byte| decoder.push(byte).map(Result::ok),
        500_000,
        20_261_122,
        |_| (),
    );
    assert_eq!((tally.accepted, tally.lost), (0, 0), "{tally:?}");
}

/// The same campaign convicts a decoder that does not check: it must be able to fail.
#[test]
fn a_decoder_without_crc_is_caught() {
    let frames = board_frames(1);
    let lengths: Vec<usize> = frames.iter().map(|frame| frame.1.len()).collect();
    let pool: Vec<_> = frames
        .iter()
        .map(|frame| (frame.1.clone(), frame.1.clone()))
        .collect();
    let mut segment = Vec::new();
    let by_length_alone = |byte: u8| {
        segment.push(byte);
        if byte != 0 {
            return None;
        }
        let segment = std::mem::take(&mut segment);
        (segment.len() > 1).then(|| lengths.contains(&segment.len()).then_some(segment))
    };
    let tally = campaign(&pool, by_length_alone, 10_000, 3, |_| ());
    assert!(tally.accepted > 2_000, "{tally:?}");
}
