//! The traces that `run --vcd` writes, read as a logic analyser would read them: what its decoders make of SPI, USART, PWM and the
//! sampling instant is what the host received.

use std::collections::BTreeMap;
use std::ops::ControlFlow;

use bench::simavr::{simavr, simavr_traced};
use bench::{Scenario, SerialByte, duty_profile};
use hil_tests::{image, run};
use wire::{Decoder, Frame, Sample};

/// A dump: at each time, ps, which traces change to what.
struct Dump {
    names: BTreeMap<String, usize>,
    /// Levels at the begin, and changes.
    first: Vec<bool>,
    changes: Vec<(u64, usize, bool)>,
    end: u64,
}

/// Reads it by the standard's grammar, without knowing who wrote it.
fn parse(text: &str) -> Dump {
    let (mut codes, mut names, mut first) = (BTreeMap::new(), BTreeMap::new(), BTreeMap::new());
    let (mut changes, mut time, mut dumping, mut defined) = (Vec::new(), 0, false, false);
    for line in text.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words.as_slice() {
            ["$timescale", "1", "ps", "$end"] => {}
            ["$var", "wire", "1", code, name, "$end"] => {
                let k = codes.len();
                assert!(
                    codes.insert((*code).to_owned(), k).is_none(),
                    "{code} twice"
                );
                names.insert((*name).to_owned(), k);
            }
            ["$enddefinitions", "$end"] => defined = true,
            ["$dumpvars"] => dumping = true,
            ["$end"] => dumping = false,
            [word] if word.starts_with('#') => {
                let now = word[1..].parse().expect("a time");
                assert!(now >= time, "time goes back: {line}");
                time = now;
            }
            [word] if defined && word.starts_with(['0', '1']) => {
                let (trace, level) = (codes[&word[1..]], word.starts_with('1'));
                if dumping {
                    first.insert(trace, level);
                } else {
                    changes.push((time, trace, level));
                }
            }
            ["$version" | "$scope" | "$upscope", ..] => {}
            _ => panic!("what is `{line}`?"),
        }
    }
    assert_eq!(
        first.len(),
        codes.len(),
        "every trace has a level at the begin"
    );
    let first = first.into_values().collect();
    Dump {
        names,
        first,
        changes,
        end: time,
    }
}

impl Dump {
    fn trace(&self, name: &str) -> usize {
        self.names[name]
    }

    /// Every change of one trace.
    fn of(&self, name: &str) -> Vec<(u64, bool)> {
        let trace = self.trace(name);
        let all = self.changes.iter().filter(|(_, t, _)| *t == trace);
        all.map(|(time, _, level)| (*time, *level)).collect()
    }

    /// Words of 16 bits both ways while one select is low, taken as the clock rises; with the time of the first fall.
    fn words(&self, select: &str) -> Vec<(u64, u16, u16)> {
        let [select, sck, mosi, miso] =
            [select, "sck", "mosi", "miso"].map(|name| self.trace(name));
        let mut levels = self.first.clone();
        let (mut out, mut word) = (Vec::new(), None);
        for (time, trace, level) in &self.changes {
            levels[*trace] = *level;
            if *trace == select {
                word = (!level).then_some((0u64, 0u16, 0u16, 0));
            }
            if *trace == sck && !levels[select] {
                let Some((start, out_word, in_word, bits)) = &mut word else {
                    continue;
                };
                if !level {
                    if *bits == 0 {
                        *start = *time;
                    }
                    continue;
                }
                *out_word = *out_word << 1 | u16::from(levels[mosi]);
                *in_word = *in_word << 1 | u16::from(levels[miso]);
                *bits += 1;
                if *bits == 16 {
                    out.push((*start, *out_word, *in_word));
                    word = Some((0, 0, 0, 0));
                }
            }
        }
        out
    }

    /// Bytes of 8N1, sampled in the middle of each bit; the last may be cut by the end.
    fn bytes(&self, name: &str, baud: f64) -> Vec<u8> {
        let changes = self.of(name);
        let level = |time: u64| {
            let before = changes.partition_point(|(at, _)| *at <= time);
            before
                .checked_sub(1)
                .map_or(self.first[self.trace(name)], |k| changes[k].1)
        };
        let bit = 1e12 / baud;
        let (mut out, mut free) = (Vec::new(), 0);
        for (start, rises) in &changes {
            if *rises || *start < free {
                continue;
            }
            let middle = |k: f64| start + ((k + 0.5) * bit) as u64;
            if middle(9.5) > self.end {
                break;
            }
            let byte = (0..8).fold(0u8, |byte, k| {
                byte | u8::from(level(middle(1.0 + f64::from(k)))) << k
            });
            assert!(level(middle(9.0)), "a stop bit is high");
            out.push(byte);
            free = middle(9.0);
        }
        out
    }
}

fn samples(bytes: impl IntoIterator<Item = u8>) -> Vec<Sample> {
    let mut decoder = Decoder::new();
    let frames = bytes
        .into_iter()
        .filter_map(|byte| decoder.push(byte)?.ok());
    frames
        .filter_map(|frame| match frame {
            Frame::Sample(sample) => Some(sample),
            _ => None,
        })
        .collect()
}

#[test]
fn what_a_logic_analyser_reads_of_the_traces_is_what_the_host_received() {
    let mut run = run(Scenario::quiet(5), 3.0);
    run.requests = duty_profile(&[(0.9, 100)], 3.0);
    run.scenario.stop_pressed = vec![[2.3, 2.4]];
    let image = image();
    let mut heard = Vec::new();
    let vcd = simavr_traced(&image, &run, [0.0, 2.5], |byte| {
        heard.push(byte);
        ControlFlow::Continue(())
    });
    let dump = parse(&vcd.expect("it runs").text());
    // Watching has changed nothing.
    let mut unwatched: Vec<SerialByte> = Vec::new();
    let _ = simavr(&image, &run, |byte| {
        unwatched.push(byte);
        ControlFlow::Continue(())
    });
    assert_eq!(heard, unwatched);

    // USART: the crystal over 16 times 26.
    let baud = 16e6 / 16.0 / 26.0;
    let bytes = dump.bytes("txd", baud);
    let early = heard.iter().filter(|b| b.time_s < 2.4);
    assert!(bytes.starts_with(&early.map(|b| b.byte).collect::<Vec<_>>()));
    let read = samples(bytes);
    let sent = samples(heard.iter().filter(|b| b.time_s < 2.5).map(|b| b.byte));
    assert_eq!(read, sent);
    assert!(read.len() > 20, "{}", read.len());

    // The host's line: a request of each kind that it sent.
    let mut decoder = wire::RequestDecoder::new();
    let asked = dump.bytes("rxd", baud).into_iter();
    let asked: Vec<wire::Request> = asked.filter_map(|byte| decoder.push(byte)?.ok()).collect();
    let before = run.requests.iter().filter(|r| r.at_us < 2_400_000).count();
    assert!(asked.len() >= before && before > 10, "{before} {asked:?}");

    // The motor's stop.
    let stop: Vec<(u64, bool)> = dump.of("stop");
    let at = |k: usize| stop[k].0 as f64 / 1e12;
    assert!(stop.len() == 2 && !stop[0].1, "{stop:?}");
    assert!(
        (at(0) - 2.3).abs() < 1e-6 && (at(1) - 2.4).abs() < 1e-6,
        "{stop:?}"
    );

    // SPI: the answer to GYRO_OUT (0x04) comes with the frame after it.
    for (axis, select) in ["cs_x", "cs_y", "cs_z"].into_iter().enumerate() {
        let words = dump.words(select);
        let pairs = words.windows(2).filter(|pair| pair[0].1 & 0xff00 == 0x0400);
        let rates: Vec<i16> = pairs.map(|pair| ((pair[1].2 << 2) as i16) >> 2).collect();
        let told: Vec<i16> = sent.iter().map(|sample| sample.gyro[axis]).collect();
        // The frames leave after the words; the last may still be on its way.
        let from = rates.windows(told.len()).position(|window| window == told);
        assert!(from.is_some(), "{select}: {rates:?} {told:?}");
        // A bit is 8 cycles of 62.5 ns.
        let clock = dump.of("sck");
        let shortest = clock.windows(2).map(|pair| pair[1].0 - pair[0].0).min();
        assert_eq!(shortest, Some(250_000), "half a bit at 2 MHz, ps");
    }

    // The sampling instant: every 50 ms, to the cycle, and the first select within 100 us of it.
    let ticks: Vec<u64> = dump
        .of("tick")
        .into_iter()
        .filter(|(_, high)| *high)
        .map(|(at, _)| at)
        .collect();
    assert!(ticks.len() > 30, "{}", ticks.len());
    assert!(
        ticks
            .windows(2)
            .all(|pair| pair[1] - pair[0] == 50_000_000_000),
        "{ticks:?}"
    );
    let falls: Vec<u64> = dump
        .of("cs_x")
        .into_iter()
        .filter(|(_, high)| !high)
        .map(|(at, _)| at)
        .collect();
    for tick in &ticks[..ticks.len() - 1] {
        let next = falls.iter().find(|at| *at >= tick).expect("a select");
        assert!(next - tick < 100_000_000, "{} ps", next - tick);
    }
    assert!(dump.of("adc").len() >= 2 * 3 * (ticks.len() - 2));

    // PWM: nothing before the motor is asked for; 7.8 kHz then, and at last 100 of 255.
    let pwm = dump.of("oc2");
    let rises: Vec<u64> = pwm
        .iter()
        .filter(|(_, high)| *high)
        .map(|(at, _)| *at)
        .collect();
    assert!(rises[0] > 900_000_000_000, "{}", rises[0]);
    let [before, last] = rises[rises.len() - 2..] else {
        panic!("no pulses")
    };
    let period = (last - before) as f64 / 1e12;
    assert!(
        (1.0 / period / 7812.5 - 1.0).abs() < 0.01,
        "{} Hz",
        1.0 / period
    );
    let fall = pwm
        .iter()
        .find(|(at, high)| *at > before && !high)
        .expect("it falls");
    let width = (fall.0 - before) as f64 / 1e12 / period;
    assert!((width - 100.0 / 255.0).abs() < 0.02, "{width}");
}
