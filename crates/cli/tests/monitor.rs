//! The screen of `monitor`, drawn on a buffer: what it looks like, that all of it fits, and what its keys do.

use std::path::Path;

use imu_stand::link::Heard;
use imu_stand::monitor::{About, Action, Key, Screen, Snapshot, View};
use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use ratatui::Terminal;
use ratatui::backend::TestBackend;
use wire::{Frame, Hello, Sample, flags};

/// Variable that renews the golden files: read what has changed.
const RENEW: &str = "IMU_STAND_RENEW";

/// Ten minutes of noise of 4 counts, with three samples missing.
fn snapshot() -> (Snapshot, About) {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(7);
    let mut view = View::new();
    let hello = Hello {
        firmware: [0, 1, 0],
        tick_ns: 4_000,
        period_ticks: 12_500,
        periods_per_sample: 1,
        gyro_range: 4,
        ..Hello::default()
    };
    view.push(&Frame::Hello(hello), 0.0);
    for k in (0..8_000_u32).chain(8_003..12_003) {
        // The sum of twelve even draws is normal enough.
        let mut noise = || {
            (0..12)
                .map(|_| f64::from(random.next_u32()) / 2f64.powi(32) - 0.5)
                .sum::<f64>()
        };
        let sample = Sample {
            seq: k as u16,
            t_ticks: 12_500 * k,
            gyro: [0, 1, 2].map(|axis| (4.0 * noise()).round() as i16 + 7 * axis),
            temp: [10, 12, 14],
            supply: 2_730,
            acc: [512, 510, 760],
            flags: flags::IN_ORDER,
            ..Sample::default()
        };
        let late = 2e-4 * noise();
        view.push(&Frame::Sample(sample), f64::from(k) * 0.05 + late);
    }
    let mut heard = Heard::default();
    (heard.losses.line, heard.losses.received) = (3, 12_000);
    let about = About {
        port: "/dev/ttyUSB0".to_owned(),
        board: view.board(),
        ..About::default()
    };
    (view.snapshot(&heard), about)
}

fn drawn(screen: &Screen, s: &Snapshot, about: &About, width: u16, height: u16) -> String {
    let mut terminal = Terminal::new(TestBackend::new(width, height)).expect("a buffer");
    terminal
        .draw(|frame| screen.draw(frame, s, about))
        .expect("it is drawn");
    let buffer = terminal.backend().buffer();
    let rows = buffer.content.chunks(usize::from(width));
    let lines = rows.map(|row| row.iter().map(|cell| cell.symbol()).collect::<String>());
    lines
        .map(|line| line.trim_end().to_owned() + "\n")
        .collect()
}

fn assert_golden(name: &str, text: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/data")
        .join(name);
    if std::env::var_os(RENEW).is_some() {
        std::fs::write(&path, text).expect("it is written");
    }
    let kept = std::fs::read_to_string(&path).unwrap_or_default();
    assert_eq!(text, kept, "{RENEW}=1 renews {name}:\n{text}");
}

#[test]
fn golden_screens_of_two_sizes() {
    let (s, about) = snapshot();
    let mut screen = Screen::default();
    screen.press(Key::Char('y'));
    assert_golden("monitor-80x24.txt", &drawn(&screen, &s, &about, 80, 24));
    screen.press(Key::Char('a'));
    assert_golden("monitor-60x20.txt", &drawn(&screen, &s, &about, 60, 20));
}

#[test]
fn what_matters_is_on_the_smallest_screen() {
    let (mut s, about) = snapshot();
    s.flags = vec!["gyro y repeats itself", "supply out of range"];
    s.counters = Some(vec![("tick_overrun", 3)]);
    let text = drawn(&Screen::default(), &s, &about, 60, 20);
    for what in [
        "/dev/ttyUSB0",
        "3 missing (board 0, line 3), 12000 samples",
        "jitter: sampling 0.0 us",
        "gyro y repeats itself, supply out of range",
        "supply  5.000 V",
        "deg/s",
        "tau, s",
        "tick_overrun 3",
        "q quit",
        "m motor",
        "? help",
    ] {
        assert!(text.contains(what), "no `{what}` in:\n{text}");
    }
    for axis in ["x", "y", "z"] {
        assert!(text.contains(&format!("gyro {axis}")), "{text}");
    }
    // Braille, and no curve of nothing.
    assert!(
        text.chars().any(|c| ('\u{2801}'..='\u{28ff}').contains(&c)),
        "{text}"
    );
    let nothing = View::new().snapshot(&Heard::default());
    let text = drawn(&Screen::default(), &nothing, &about, 60, 20);
    assert!(text.contains("not enough samples yet"), "{text}");
    // A terminal that is too small is drawn as far as it goes.
    for (width, height) in [(1, 1), (20, 5), (59, 19), (200, 60)] {
        drawn(&Screen::default(), &s, &about, width, height);
    }
}

/// Dots of a column, by their height from 0 (top) on.
fn heights(text: &str, rows: std::ops::Range<usize>, column: usize) -> Vec<usize> {
    const DOTS: [[u32; 4]; 2] = [[0x01, 0x02, 0x04, 0x40], [0x08, 0x10, 0x20, 0x80]];
    let mut out = Vec::new();
    for (k, line) in text.lines().skip(rows.start).take(rows.len()).enumerate() {
        let c = line.chars().nth(column / 2).unwrap_or(' ') as u32;
        let bits = c
            .checked_sub(0x2800)
            .filter(|bits| *bits < 256)
            .unwrap_or(0);
        out.extend(
            (0..4)
                .filter(|dot| bits & DOTS[column % 2][*dot] != 0)
                .map(|dot| 4 * k + dot),
        );
    }
    out
}

#[test]
fn the_curve_falls_as_white_noise_does_and_lies_within_its_band() {
    let (s, about) = snapshot();
    let mut screen = Screen::default();
    screen.press(Key::Char('x'));
    let (width, height) = (80, 24);
    let text = drawn(&screen, &s, &about, width, height);
    // Eight rows of figures and the heading above, tau, counters and keys below.
    let (first, last) = (9, usize::from(height) - 3);
    let canvas = usize::from(width) - 8;
    let (x0, x1) = (
        s.allan[0][0].tau_s.log10(),
        s.allan[0].last().unwrap().tau_s.log10(),
    );
    let highs: Vec<f64> = s.allan[0].iter().map(|p| p.high.log10()).collect();
    let lows: Vec<f64> = s.allan[0].iter().map(|p| p.low.log10()).collect();
    let top = highs.iter().copied().fold(f64::MIN, f64::max);
    let bottom = lows.iter().copied().fold(f64::MAX, f64::min);
    let middle = (top + bottom) / 2.0;
    let half = (top - bottom) / 2.0 * 1.05;
    let dots = 4.0 * (last - first) as f64;
    let mut seen = 0;
    for point in &s.allan[0] {
        let part = (point.tau_s.log10() - x0) / (x1 - x0);
        let column = 16 + (part * (2.0 * canvas as f64 - 1.0)).round() as usize;
        let row = |value: f64| (middle + half - value.log10()) / (2.0 * half) * (dots - 1.0);
        // The edges are dotted.
        let near = column - 1..=(column + 1).min(2 * usize::from(width) - 1);
        let there: Vec<usize> = near.flat_map(|c| heights(&text, first..last, c)).collect();
        // Each of the three lines, to a dot of rounding either way.
        for value in [point.low, point.deviation, point.high] {
            let is_there = there
                .iter()
                .any(|dot| (*dot as f64 - row(value)).abs() <= 1.6);
            assert!(
                is_there,
                "{} s: {value} at {:.1}: {there:?}\n{text}",
                point.tau_s,
                row(value)
            );
            seen += 1;
        }
    }
    assert!(seen > 20, "{seen}");
}

#[test]
fn the_motor_turns_after_a_yes_alone_and_stops_at_once() {
    let keys = |text: &str| -> (Screen, Vec<Action>) {
        let mut screen = Screen::default();
        let pressed = text.chars().filter_map(|c| {
            screen.press(match c {
                '\n' => Key::Enter,
                '\x1b' => Key::Escape,
                '\x08' => Key::Backspace,
                c => Key::Char(c),
            })
        });
        let actions = pressed.collect();
        (screen, actions)
    };
    assert_eq!(keys("m60\ny").1, [Action::Motor(60)]);
    assert_eq!(keys("m-2555\ny").1, [Action::Motor(-255)]);
    assert_eq!(keys("m-255\x08\ny").1, [Action::Motor(-25)]);
    for nothing in [
        "m60\nn",
        "m60\n\x1b",
        "m60\x1by",
        "m60\nY",
        "m60y",
        "m999\ny",
        "m\ny",
        "bn",
        "y",
        "?y",
    ] {
        assert_eq!(keys(nothing).1, [], "{nothing:?}");
    }
    assert_eq!(keys("by").1, [Action::BiasNull(600)]);
    assert_eq!(keys("s").1, [Action::Stop]);
    assert_eq!(keys(" ").1, [Action::Stop]);
    assert!(keys("q").0.ends() && !keys("xyza").0.ends());
    assert!(
        !keys("mq").0.ends(),
        "a letter in an input is none of the keys"
    );
    let mut screen = keys("m6").0;
    screen.press(Key::End);
    assert!(screen.ends(), "Ctrl-C ends it wherever it is");
    let (s, about) = snapshot();
    let asked = drawn(&keys("m60\n").0, &s, &about, 60, 20);
    assert!(
        asked.contains("turn the motor at 60 of 255? y/n"),
        "{asked}"
    );
}
