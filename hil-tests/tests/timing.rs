//! When the board samples, to the cycle, with the line as busy as it gets.

#[path = "../../crates/diagnosis/tests/draws/mod.rs"]
mod draws;

use std::collections::BTreeMap;

use bench::simavr::{Event, Probe, Simulated};
use bench::{Scenario, duty_profile};
use hil_tests::{Heard, at, image, run};
use wire::Command;

const COMPARE_A: u8 = 6;
const SELECT_X: usize = 0;

/// Times since the tick, and the ticks themselves.
#[derive(Default)]
struct Stopwatch {
    tick: Option<u64>,
    first_edge: Option<u64>,
    converted: bool,
    periods: BTreeMap<u64, u64>,
    select: BTreeMap<u64, u64>,
    spi: BTreeMap<u64, u64>,
    adc: BTreeMap<u64, u64>,
}

impl Probe for Stopwatch {
    fn event(&mut self, at: u64, event: Event) {
        match event {
            Event::Interrupt { vector: COMPARE_A } => {
                if let Some(last) = self.tick.replace(at) {
                    *self.periods.entry(at - last).or_default() += 1;
                }
                (self.first_edge, self.converted) = (None, false);
            }
            Event::Select {
                axis: SELECT_X,
                selected: true,
            } if self.first_edge.is_none() => {
                if let Some(tick) = self.tick {
                    self.first_edge = Some(at);
                    *self.select.entry(at - tick).or_default() += 1;
                }
            }
            // The end of the first byte: its first clock edge comes eight clocks before.
            Event::Spi { cycles, .. } if self.first_edge.is_some_and(|edge| edge != 0) => {
                if let Some(tick) = self.tick {
                    *self.spi.entry(at - cycles - tick).or_default() += 1;
                }
                self.first_edge = Some(0);
            }
            Event::Adc { channel: 0 } if !self.converted => {
                if let Some(tick) = self.tick {
                    self.converted = true;
                    *self.adc.entry(at - tick).or_default() += 1;
                }
            }
            _ => {}
        }
    }
}

fn print(name: &str, histogram: &BTreeMap<u64, u64>) {
    println!("{name}");
    for (cycles, count) in histogram {
        println!("  {cycles:>8} cycles  {count:>6}");
    }
}

/// Over 600 s, or a quarter of them: the requests drift through the tick's phase in 10 s.
#[test]
fn the_sampling_instant_has_no_jitter_with_line_and_commands_busy() {
    let seconds = draws::of(150.0, 600.0);
    let mut run = run(Scenario::lively(11), seconds);
    // A request whenever the line from the host is free: keep-alives, motor steps, pings, reads of registers.
    run.requests = duty_profile(
        &[(1.0, 100), (seconds / 3.0, -150), (seconds / 1.5, 255)],
        seconds - 2.0,
    );
    for n in 0..((seconds - 4.0) * 40.0) as u16 {
        let command = match n % 3 {
            0 => Command::Ping,
            1 => Command::ReadRegister {
                gyro: wire::Axis::X,
                address: 0x38,
            },
            _ => Command::KeepAlive,
        };
        // 25 ms apart, drifting through the tick's phase.
        run.requests
            .push(at(2.0 + f64::from(n) * 0.024_97, n, command));
    }
    run.requests.sort_by_key(|timed| timed.at_us);
    let mut simulated =
        Simulated::new(&image(), &run.scenario, Stopwatch::default()).expect("an image");
    simulated.request(&run.requests);
    let mut heard = Heard::default();
    simulated
        .run_until(seconds, &mut |byte| heard.push(byte))
        .expect("it runs");
    let watch = simulated.probe();
    print("tick to tick", &watch.periods);
    print("tick to the fall of the first chip select", &watch.select);
    print("tick to the first clock of SPI", &watch.spi);
    print("tick to the instant at which the ADC holds x", &watch.adc);
    assert_eq!(heard.link().rejected(), 0);
    let replies = heard.replies().count();
    println!(
        "{} samples, {replies} replies to {} requests",
        heard.samples().count(),
        run.requests.len()
    );
    let busy = replies as f64 > 33.3 * seconds;
    assert!(busy, "the line was busy: {replies} replies");
    for (name, histogram) in [
        ("period", &watch.periods),
        ("chip select", &watch.select),
        ("SPI", &watch.spi),
        ("ADC", &watch.adc),
    ] {
        assert_eq!(histogram.len(), 1, "{name}: {histogram:?}");
        assert!(histogram.values().sum::<u64>() as f64 > 19.8 * seconds);
    }
    assert_eq!(watch.periods.keys().next(), Some(&800_000));
    let discipline = simulated.discipline();
    // The data sheet's 40 us from frame to frame and 30 us between them, in cycles.
    assert!(
        discipline
            .shortest_period
            .is_some_and(|cycles| cycles >= 640)
    );
    assert!(
        discipline
            .shortest_stall
            .is_some_and(|cycles| cycles >= 480)
    );
    println!("{discipline:?}");
    assert_eq!(
        (
            discipline.broken_frames,
            discipline.unselected_bytes,
            discipline.wrong_clock
        ),
        (0, 0, 0)
    );
}
