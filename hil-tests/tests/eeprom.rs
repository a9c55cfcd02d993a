//! Power that goes while the EEPROM is written: at any byte of a set-up or a correction, what was stored before or what is being
//! stored comes back, whole. The byte that was being written is spoilt.

use bench::simavr::{NoProbe, Simulated};
use bench::{Scenario, TimedRequest};
use hil_tests::{Heard, at, image};
use wire::correction::{self, Correction, Numbers, ROWS};
use wire::{Command, Status};

/// The time that the EEPROM takes for a byte, s.
const BYTE_S: f64 = 8.5e-3;
/// Time from one row of a correction to the next, s: six bytes and the reply.
const ROW_S: f64 = 0.1;
/// Number of the first request after a cut.
const FIRST_ASKED: u16 = 900;

/// The image with these requests, up to the cut, and its answers to `asked` after it.
fn cut(requests: &[TimedRequest], cut_s: f64, asked: &[Command]) -> Heard {
    let mut simulated = Simulated::new(&image(), &Scenario::quiet(5), NoProbe).expect("an image");
    let sent = requests.iter().filter(|r| r.at_us as f64 <= cut_s * 1e6);
    simulated.request(&sent.copied().collect::<Vec<_>>());
    let mut before = Heard::default();
    (simulated.run_until(cut_s, &mut |byte| before.push(byte))).expect("it runs");
    simulated.power_cycle();
    let begin = simulated.time_s();
    let again: Vec<_> = (0u16..)
        .zip(asked)
        .map(|(n, &command)| at(begin + 0.6 + 0.02 * f64::from(n), FIRST_ASKED + n, command))
        .collect();
    simulated.request(&again);
    let mut heard = Heard::default();
    let until = begin + 0.8 + 0.02 * asked.len() as f64;
    (simulated.run_until(until, &mut |byte| heard.push(byte))).expect("it runs");
    heard
}

/// Instants of a span, so close that each byte is cut.
fn instants(from_s: f64, to_s: f64, step_s: f64) -> impl Iterator<Item = f64> {
    let steps = ((to_s - from_s) / step_s) as u32;
    (0..=steps).map(move |n| from_s + step_s * f64::from(n))
}

/// Counts both, and holds that the new one, once whole, stays.
#[derive(Default)]
struct Came {
    old: u32,
    new: u32,
}

impl Came {
    fn back(&mut self, is_new: bool, cut_s: f64) {
        assert!(is_new || self.new == 0, "it was stored before {cut_s} s");
        *if is_new { &mut self.new } else { &mut self.old } += 1;
    }
}

#[test]
fn a_cut_in_any_byte_of_a_set_up_leaves_the_one_before_or_the_new_one() {
    let requests = [
        at(0.9, 1, Command::SetBoardId { board_id: 1 }),
        at(1.0, 2, Command::StoreConfig),
        at(1.6, 3, Command::SetBoardId { board_id: 2 }),
        at(1.65, 4, Command::StoreConfig),
    ];
    let mut came = Came::default();
    for cut_s in instants(1.65, 2.1, BYTE_S / 2.0) {
        let heard = cut(&requests, cut_s, &[Command::GetHello]);
        let (_, hello) = heard.hellos().last().expect("a hello frame");
        assert_ne!(hello.config_source, 0, "one was stored; cut at {cut_s} s");
        assert!([1, 2].contains(&hello.board_id), "cut at {cut_s} s");
        came.back(hello.board_id == 2, cut_s);
    }
    println!(
        "set-up: {} cuts, then the new one {} times",
        came.old, came.new
    );
    assert!(came.old > 80 && came.new > 3, "{} {}", came.old, came.new);
}

/// A correction with something in each row, and the requests that write it.
fn correction(number: u16, generation: u8, from_s: f64) -> (Numbers, Vec<TimedRequest>) {
    let all = f64::from(number) / 1000.0;
    let meant = Correction {
        number,
        generation,
        block_shift: 4,
        sens_avg: 0x0402,
        temp_range: [-60, 60],
        bias: [all; 3],
        temperature: [all / 100.0; 3],
        motor: [all / 1000.0; 3],
        supply: [all / 1000.0; 3],
        acc: [[all / 1000.0; 3]; 3],
        matrix: [[all / 100.0; 3]; 3],
        noise: [0.01; 3],
        walk: [1e-7; 3],
        ..Correction::default()
    };
    let numbers = meant.numbers().expect("in range");
    let rows = numbers.chunks_exact(3).map(|row| [row[0], row[1], row[2]]);
    let requests = (0u8..)
        .zip(rows.chain([correction::crc_row(&numbers)]))
        .map(|(row, values)| {
            let command = Command::SetCorrection { row, values };
            at(from_s + ROW_S * f64::from(row), row.into(), command)
        });
    (numbers, requests.collect())
}

#[test]
fn a_cut_in_any_byte_of_a_correction_leaves_the_one_before_or_the_new_one() {
    let (old, mut requests) = correction(711, 0, 0.9);
    let from_s = 0.9 + ROW_S * (ROWS + 2) as f64;
    let (new, second) = correction(822, 1, from_s);
    requests.extend(second);
    let asked: Vec<Command> = (0..ROWS as u8)
        .map(|row| Command::GetCorrection { other: false, row })
        .collect();
    let mut came = Came::default();
    for cut_s in instants(from_s, from_s + ROW_S * (ROWS + 2) as f64, BYTE_S) {
        let heard = cut(&requests, cut_s, &asked);
        let replies: Vec<_> = heard
            .replies()
            .map(|(_, reply)| reply)
            .filter(|r| r.number >= FIRST_ASKED)
            .collect();
        assert_eq!(replies.len(), ROWS);
        assert!(
            replies
                .iter()
                .all(|r| r.status == Status::Ok && r.value != 0),
            "cut at {cut_s} s: {replies:?}"
        );
        let read: Vec<i16> = (replies.iter())
            .flat_map(|reply| reply.detail.map(|number| number as i16))
            .collect();
        assert!(read == old || read == new, "cut at {cut_s} s: {read:?}");
        came.back(read == new, cut_s);
    }
    println!(
        "correction: {} cuts, then the new one {} times",
        came.old, came.new
    );
    assert!(came.old > 120 && came.new > 3, "{} {}", came.old, came.new);
}
