//! Lost samples are charged to whoever lost them. The board and the line here keep books of their own.

use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use wire::link::{LinkStats, Losses};
use wire::{Fault, FaultCounts, Frame, Health, Hello, Sample};

/// A board that sends a health frame every 20 ticks.
#[derive(Default)]
struct Board {
    ticks: u32,
    restarts: u16,
    faults: FaultCounts,
}

impl Board {
    fn hello(&self) -> Frame {
        Frame::Hello(Hello {
            restarts: self.restarts,
            next_seq: self.ticks as u16,
            ..Hello::default()
        })
    }

    /// One tick; `lost` is what the board itself loses the sample by. Returns what it sends.
    fn tick(&mut self, lost: Option<Fault>) -> (Option<Frame>, Option<Frame>) {
        let sample = Sample {
            seq: self.ticks as u16,
            t_ticks: self.ticks.wrapping_mul(12_500),
            ..Sample::default()
        };
        self.ticks += 1;
        if let Some(fault) = lost {
            self.faults.record(fault);
        }
        let sample = lost.is_none().then_some(Frame::Sample(sample));
        (sample, self.ticks.is_multiple_of(20).then(|| self.health()))
    }

    fn health(&self) -> Frame {
        Frame::Health(Health {
            uptime_s: self.ticks / 20,
            next_seq: self.ticks as u16,
            faults: self.faults,
            ..Health::default()
        })
    }
}

#[test]
fn device_loss_and_line_loss_are_told_apart_over_many_wraps() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(7);
    let mut one_in = |n: u64| rng.next_u64().is_multiple_of(n);
    let mut board = Board::default();
    let mut link = LinkStats::new();
    let mut truth = Losses::default();
    link.push(&board.hello());
    for _ in 0..500_000 {
        let lost = if one_in(97) {
            Some(Fault::TickOverrun)
        } else if one_in(101) {
            Some(Fault::FrameDropped)
        } else {
            None
        };
        let (sample, health) = board.tick(lost);
        truth.device += u64::from(lost.is_some());
        if let Some(sample) = sample {
            if one_in(53) {
                truth.line += 1;
            } else {
                truth.received += 1;
                link.push(&sample);
            }
        }
        // The line loses health frames too.
        if let Some(health) = health
            && !one_in(11)
        {
            link.push(&health);
        }
        // The counters would saturate otherwise: as on a board, they are cleared in time.
        assert!(board.faults.get(Fault::FrameDropped) < u16::MAX);
    }
    link.push(&board.health());
    assert_eq!(link.losses(), truth);
    assert!(truth.device > 8_000 && truth.line > 8_000);
}

#[test]
fn a_gap_is_reported_where_it_is_and_stays_open_until_the_next_health_frame() {
    let mut board = Board::default();
    let mut link = LinkStats::new();
    link.push(&board.hello());
    assert_eq!(link.push(&board.tick(None).0.unwrap()), 0);
    board.tick(Some(Fault::FrameDropped));
    board.tick(None);
    assert_eq!(
        link.push(&board.tick(None).0.unwrap()),
        2,
        "one dropped by the board, one by the line"
    );
    assert_eq!(
        link.losses(),
        Losses {
            received: 2,
            unattributed: 2,
            ..Losses::default()
        }
    );
    link.push(&board.health());
    assert_eq!(
        link.losses(),
        Losses {
            received: 2,
            device: 1,
            line: 1,
            ..Losses::default()
        }
    );
}

#[test]
fn a_start_is_no_gap_even_where_its_hello_frame_is_lost() {
    for hello_arrives in [true, false] {
        let mut board = Board::default();
        let mut link = LinkStats::new();
        link.push(&board.hello());
        for _ in 0..5_010 {
            let (sample, health) = board.tick(None);
            link.push(&sample.unwrap());
            health.map(|health| link.push(&health));
        }
        board = Board {
            restarts: 1,
            ..Board::default()
        };
        if hello_arrives {
            link.push(&board.hello());
        }
        for _ in 0..100 {
            let (sample, health) = board.tick(None);
            assert_eq!(link.push(&sample.unwrap()), 0);
            health.map(|health| link.push(&health));
        }
        let expected = Losses {
            received: 5_110,
            restarts: 1,
            ..Losses::default()
        };
        assert_eq!(link.losses(), expected, "hello arrives: {hello_arrives}");
    }
}

#[test]
fn where_the_counter_is_saturated_nobody_is_charged() {
    let mut board = Board::default();
    let mut link = LinkStats::new();
    board.faults.set(Fault::TickOverrun, u16::MAX);
    link.push(&board.health());
    board.tick(Some(Fault::TickOverrun));
    link.push(&board.health());
    assert_eq!(
        link.losses(),
        Losses {
            unattributed: 1,
            ..Losses::default()
        }
    );
}

#[test]
fn a_sample_that_comes_twice_is_not_a_gap_of_65535() {
    let mut board = Board::default();
    let mut link = LinkStats::new();
    let sample = board.tick(None).0.unwrap();
    link.push(&sample);
    assert_eq!(link.push(&sample), 0);
    assert_eq!(
        link.losses(),
        Losses {
            received: 2,
            out_of_order: 1,
            ..Losses::default()
        }
    );
}

#[test]
fn what_was_sent_while_nobody_listened_is_nobodys_loss() {
    let mut board = Board::default();
    let mut link = LinkStats::new();
    let push = |link: &mut LinkStats, (sample, health): (Option<Frame>, Option<Frame>)| {
        [sample, health].iter().flatten().for_each(|frame| {
            link.push(frame);
        });
    };
    link.push(&board.hello());
    (0..40).for_each(|_| push(&mut link, board.tick(None)));
    // One is lost on the line, which no health frame brackets before the port is gone.
    let _lost = board.tick(None);
    push(&mut link, board.tick(None));
    link.interrupted();
    for _ in 0..35 {
        let _unheard = board.tick(None);
    }
    (0..60).for_each(|_| push(&mut link, board.tick(None)));
    let losses = link.losses();
    assert_eq!((losses.line, losses.device), (0, 0), "{losses:?}");
    assert_eq!(losses.unattributed, 1, "{losses:?}");
    assert_eq!(losses.received, 101);
    // From then on losses are charged as ever.
    let _lost = board.tick(None);
    (0..25).for_each(|_| push(&mut link, board.tick(None)));
    assert_eq!(link.losses().line, 1);
}
