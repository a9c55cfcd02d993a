//! The accelerometer's three outputs are told apart, on a chip whose idle sleep starts conversions by itself.

use bench::Scenario;
use bench::simavr::{Probe, Simulated};
use hil_tests::{Heard, image};

/// Three voltages in place of the accelerometer's.
struct Volts;

impl Probe for Volts {
    fn volts(&mut self, _t: f64, channel: u8, _volts: f64) -> f64 {
        [1.00, 1.65, 2.45]
            .get(usize::from(channel))
            .copied()
            .unwrap_or(0.0)
    }
}

#[test]
fn each_output_is_read_into_its_own_field() {
    let mut simulated = Simulated::new(&image(), &Scenario::quiet(3), Volts).expect("an image");
    let mut heard = Heard::default();
    simulated
        .run_until(3.0, &mut |byte| heard.push(byte))
        .expect("it runs");
    let samples: Vec<_> = heard.samples().collect();
    assert!(samples.len() > 50);
    for (t, sample) in samples {
        // floor(1024 V / 3.3 V)
        assert_eq!(sample.acc, [310, 512, 760], "at {t} s");
    }
}
