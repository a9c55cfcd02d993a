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

fn sample(seq: u16, t_ticks: u32) -> Frame {
    Frame::Sample(Sample {
        seq,
        t_ticks,
        ..Sample::default()
    })
}

#[test]
fn sixty_four_numbers_back_are_a_repetition_and_one_more_is_a_gap() {
    // A repetition does not move what is expected next.
    for (seq, gap, out_of_order, next) in [
        (1_000, 0, 0, 1_001),
        (999, 0, 1, 1_000),
        (936, 0, 1, 1_000),
        (935, 65_471, 0, 936),
        (1_001, 1, 0, 1_002),
    ] {
        let mut link = LinkStats::new();
        link.push(&sample(999, 50));
        assert_eq!(link.push(&sample(seq, 60)), gap, "{seq}");
        let losses = link.losses();
        assert_eq!(losses.out_of_order, out_of_order, "{seq}");
        assert_eq!(losses.unattributed, u64::from(gap), "{seq}");
        assert_eq!(link.push(&sample(next, 70)), 0, "{seq}");
    }
}

#[test]
fn time_that_goes_on_by_less_than_half_its_circle_is_no_start() {
    for (ticks, restarts) in [
        (1, 0),
        (0x7fff_ffff, 0),
        (0x8000_0000, 1),
        (u32::MAX, 1),
        (0, 0),
    ] {
        let mut link = LinkStats::new();
        link.push(&sample(7, 123));
        link.push(&sample(8, 123u32.wrapping_add(ticks)));
        assert_eq!(link.losses().restarts, restarts, "{ticks:#x}");
    }
}

#[test]
fn what_nobody_is_charged_with_adds_up_over_starts_and_interruptions() {
    let mut link = LinkStats::new();
    let lose = |link: &mut LinkStats, from: u16, lost: u16| {
        link.push(&sample(from, u32::from(from)));
        let next = from + lost + 1;
        assert_eq!(link.push(&sample(next, u32::from(next))), lost);
    };
    lose(&mut link, 10, 3);
    link.interrupted();
    lose(&mut link, 100, 4);
    link.interrupted();
    assert_eq!(link.losses().unattributed, 7);
    lose(&mut link, 200, 5);
    // The board starts: the hello frame says so by its count of restarts.
    let hello = |restarts, next_seq| {
        Frame::Hello(Hello {
            restarts,
            next_seq,
            ..Hello::default()
        })
    };
    link.push(&hello(0, 206));
    assert_eq!(link.losses().restarts, 0);
    link.push(&hello(1, 0));
    assert_eq!(
        (link.losses().restarts, link.losses().unattributed),
        (1, 12)
    );
    lose(&mut link, 0, 6);
    assert_eq!(link.losses().unattributed, 18, "not yet bracketed");
    // The same start, told once more on request, is none; a number that falls to 0 is one even where the count stays.
    link.push(&hello(1, 8));
    assert_eq!(link.losses().restarts, 1);
    link.push(&hello(1, 0));
    assert_eq!(
        (link.losses().restarts, link.losses().unattributed),
        (2, 18)
    );
    link.push(&hello(1, 0));
    assert_eq!(link.losses().restarts, 2, "nothing was spent in between");
}

#[test]
fn a_health_frame_charges_no_more_than_is_missing_and_only_between_two_of_one_start() {
    let health = |uptime_s, next_seq, lost| {
        let mut faults = FaultCounts::default();
        (0..lost).for_each(|_| faults.record(Fault::FrameDropped));
        Frame::Health(Health {
            uptime_s,
            next_seq,
            faults,
            ..Health::default()
        })
    };
    let mut link = LinkStats::new();
    // Heard from the middle on: what it lost before is not known.
    link.push(&sample(50, 50));
    assert_eq!(link.push(&health(3, 53, 9)), 2);
    assert_eq!(link.losses().unattributed, 2);
    // Nothing is missing: a counter that has moved all the same charges nobody.
    link.push(&sample(53, 53));
    assert_eq!(link.push(&health(4, 54, 12)), 0);
    // Three are missing, two of them the board's.
    assert_eq!(link.push(&health(5, 57, 14)), 3);
    // In the same second too.
    assert_eq!(link.push(&health(5, 58, 15)), 1);
    let expected = Losses {
        received: 2,
        device: 3,
        line: 1,
        unattributed: 2,
        ..Losses::default()
    };
    assert_eq!(link.losses(), expected);
    // Less time than before is a start; what it lost since nobody knows.
    link.push(&health(1, 20, 4));
    assert_eq!((link.losses().restarts, link.losses().device), (1, 3));
    link.push(&sample(20, 20));
    link.push(&sample(22, 22));
    link.push(&health(2, 23, 5));
    assert_eq!((link.losses().device, link.losses().unattributed), (4, 2));
}
