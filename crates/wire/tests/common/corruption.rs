//! Damages frames on a line and watches what a decoder makes of it.
//!
//! Which frames are damaged is decided without the decoder: what lies between two delimiters and is not, byte for
//! byte, one of the frames that were sent. Accepting such a thing is the failure that is looked for; so is not
//! accepting one that is.

use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// What came of a campaign.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Damaged frames that the decoder was given.
    pub damaged: u64,
    /// Damaged frames that it accepted.
    pub accepted: u64,
    /// Intact frames that it was given.
    pub intact: u64,
    /// Intact frames that it did not hand on as they were.
    pub lost: u64,
    /// Damaged frames by kind of damage, as [`DAMAGES`].
    pub by_damage: [u64; DAMAGES.len()],
}

/// The kinds of damage, each as often as the others.
pub const DAMAGES: [&str; 7] = [
    "bit errors (1 to 8)",
    "burst (up to 64 bits)",
    "bytes dropped",
    "bytes inserted",
    "two frames spliced",
    "bytes repeated",
    "two neighbouring bytes swapped, one bit flipped",
];

/// A frame and its bytes on the line.
pub type Sent<T> = (T, Vec<u8>);

/// Gives the decoder behind `push` at least `count` damaged frames, each followed by an intact one. `push` returns
/// `Some` at the end of a frame: the frame, or `None` where it was rejected.
pub fn campaign<T: PartialEq>(
    pool: &[Sent<T>],
    mut push: impl FnMut(u8) -> Option<Option<T>>,
    count: u64,
    seed: u64,
    mut progress: impl FnMut(u64),
) -> Tally {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut tally = Tally::default();
    let mut line = Vec::new();
    let mut segment: Vec<u8> = Vec::new();
    while tally.damaged < count {
        let kind = below(&mut rng, DAMAGES.len());
        let first = &pool[below(&mut rng, pool.len())];
        let second = &pool[below(&mut rng, pool.len())];
        let next = &pool[below(&mut rng, pool.len())];
        line.clear();
        line.extend(&first.1);
        damage(&mut rng, kind, &mut line, &second.1);
        line.extend(&next.1);

        for &byte in &line {
            let outcome = push(byte);
            if byte != 0 {
                segment.push(byte);
                assert!(outcome.is_none(), "a frame before its delimiter");
                continue;
            }
            let sent = [first, second, next]
                .into_iter()
                .find(|sent| sent.1[..sent.1.len() - 1] == segment[..]);
            if segment.is_empty() {
                assert!(outcome.is_none(), "an empty frame is idle line");
                continue;
            }
            let frame = outcome.flatten();
            if let Some(sent) = sent {
                tally.intact += 1;
                tally.lost += u64::from(frame.as_ref() != Some(&sent.0));
            } else {
                tally.damaged += 1;
                tally.by_damage[kind] += 1;
                tally.accepted += u64::from(frame.is_some());
            }
            segment.clear();
        }
        if tally.damaged & 0xF_FFFF == 0 {
            progress(tally.damaged);
        }
    }
    tally
}

/// Damage of the given kind. The delimiter takes part in it.
fn damage(rng: &mut impl Rng, kind: usize, line: &mut Vec<u8>, other: &[u8]) {
    match kind {
        0 => {
            for _ in 0..=below(rng, 8) {
                let bit = below(rng, 8 * line.len());
                line[bit / 8] ^= 1 << (bit % 8);
            }
        }
        1 => {
            let start = below(rng, 8 * line.len());
            let end = (start + 2 + below(rng, 63)).min(8 * line.len());
            for bit in start..end {
                let flip = (rng.next_u64() >> 63) as u8;
                line[bit / 8] ^= flip << (bit % 8);
            }
        }
        2 => {
            let start = below(rng, line.len());
            let end = (start + 1 + below(rng, 16)).min(line.len());
            line.drain(start..end);
        }
        3 => {
            let at = below(rng, line.len());
            for _ in 0..=below(rng, 8) {
                line.insert(at, rng.next_u64() as u8);
            }
        }
        4 => {
            let head = below(rng, line.len());
            // Half of the splices keep the length: the hardest, as no length check helps.
            let tail = if rng.next_u64() >> 63 == 0 {
                head.min(other.len() - 1)
            } else {
                below(rng, other.len())
            };
            line.truncate(head);
            line.extend(&other[tail..]);
        }
        5 => {
            let start = below(rng, line.len());
            let end = (start + 1 + below(rng, 16)).min(line.len());
            let again = line[start..end].to_vec();
            line.splice(end..end, again);
        }
        _ => {
            let at = below(rng, line.len() - 1);
            line.swap(at, at + 1);
            let bit = below(rng, 8 * line.len());
            line[bit / 8] ^= 1 << (bit % 8);
        }
    }
}

/// A number below `n`; the bias of the multiplication, below n / 2^32, does not matter here.
fn below(rng: &mut impl Rng, n: usize) -> usize {
    (((rng.next_u64() >> 32) * n as u64) >> 32) as usize
}

/// Frames as a board sends them: mostly samples, with noise around plausible values, and some of the other kinds.
pub fn board_frames(seed: u64) -> Vec<Sent<wire::Frame>> {
    use wire::{Fault, FaultCounts, Frame, Health, Hello, Reply, Sample, Status};
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut frames = Vec::new();
    for step in 0..512_u32 {
        let mut noise = || (below(&mut rng, 41) as i16) - 20;
        let mut faults = FaultCounts::new();
        faults.set(Fault::GyroStaleX, step as u16 / 9);
        let frame = match step % 16 {
            0 => Frame::Hello(Hello {
                firmware: [0, 1, 0],
                restarts: step as u16 / 100,
                tick_ns: 4000,
                period_ticks: 12_500,
                baud_divisor: 25,
                bias: [0; 3].map(|_: i32| i32::from(noise()) * 1000),
                scale: [1_229_099; 3],
                ..Hello::default()
            }),
            1 | 2 => Frame::Health(Health {
                uptime_s: step,
                next_seq: step as u16,
                tick_busy_max: 300,
                stack_free: 250,
                faults,
            }),
            3 => Frame::Reply(Reply {
                number: step as u16,
                command: 1,
                status: Status::Ok,
                value: i32::from(noise()),
                detail: [0; 3],
            }),
            _ => {
                let gyro = [0; 3].map(|_: i16| noise());
                Frame::Sample(Sample {
                    seq: step as u16,
                    t_ticks: step * 12_500,
                    gyro,
                    temp: [0; 3].map(|_: i16| 30 + noise()),
                    supply: 2730,
                    acc: [512, 512, 760].map(|zero: u16| zero.wrapping_add_signed(noise())),
                    pwm: 0,
                    flags: 7,
                    rate: gyro.map(|counts| i32::from(counts) * 4801),
                })
            }
        };
        let mut line = [0; wire::MAX_FRAME];
        let len = wire::encode(&frame, &mut line).unwrap();
        frames.push((frame, line[..len].to_vec()));
    }
    frames
}
