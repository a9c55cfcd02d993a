//! Whether what shakes bends a tone: a crystal that an acceleration pulls, a carrier that leaks over a path which the vibration
//! moves.
//!
//! A tone cos(w t + b a) whose phase follows an acceleration a has its energy all over the spectrum, and is a line where it is
//! turned back by exp(-i b a); one whose size follows a is one in the product with a. White noise stays white whatever it is
//! multiplied with, so that a coefficient over the mean of all is exponential (Fisher 1929), as it is in a periodogram.

use model::effect::View;
use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

use crate::features::{accelerations, centred};
use crate::test_level::{CheckId, Outcome, RECORD};

/// Samples that are turned at once: a free tone keeps its phase for no hour.
const AT_ONCE: usize = 1 << 16;
/// Bends of the phase, rad rms, a factor of two apart: below, the tone stays a line beside a small product; above, it is as
/// good as noise.
const BENDS_RAD: [f64; 3] = [0.75, 1.5, 3.0];
/// Periods in the record below which a product is no tone but a response.
const LEAST_PERIODS: f64 = 8.0;

/// What a reading is multiplied with, by the acceleration over its rms.
#[derive(Clone, Copy)]
enum Way {
    Size,
    Phase(f64),
}

impl Way {
    fn of(self, acceleration: f64) -> Complex<f64> {
        match self {
            Self::Size => acceleration.into(),
            Self::Phase(bend) => Complex::cis(bend * acceleration),
        }
    }

    fn what(self) -> &'static str {
        match self {
            Self::Size => "size",
            Self::Phase(_) => "phase",
        }
    }
}

/// Of the whitened residual of a channel; none where nothing shakes.
pub(crate) fn mixing(view: &View<'_>, e: &[f64]) -> Option<Outcome> {
    let e = &e[..e.len().min(AT_ONCE)];
    let length = e.len().next_power_of_two();
    let fft = FftPlanner::new().plan_fft_forward(length);
    let ways = || std::iter::once(Way::Size).chain(BENDS_RAD.map(Way::Phase));
    let lowest = (LEAST_PERIODS * length as f64 / e.len() as f64) as usize;
    // Of a long record no more is asked than of one of ten minutes: no tone of a real part is as steady as it is counted.
    let as_short = (RECORD / e.len() as f64).min(1.0);
    let mut asked = 0usize;
    let mut most = (0.0, None);
    for acceleration in accelerations(view) {
        let centred = centred(acceleration.values.get(..e.len())?);
        let rms = (centred.iter().map(|a| a * a).sum::<f64>() / e.len() as f64).sqrt();
        for way in ways() {
            let products = e.iter().zip(&centred).map(|(e, a)| e * way.of(a / rms));
            let mut mixed: Vec<Complex<f64>> = products.collect();
            let energy: f64 = mixed.iter().map(Complex::norm_sqr).sum();
            mixed.resize(length, Complex::default());
            fft.process(&mut mixed);
            asked += length;
            for (k, v) in mixed.iter().enumerate().take(length - lowest).skip(lowest) {
                let score = as_short * v.norm_sqr() / energy;
                if score > most.0 {
                    let hz = k.min(length - k) as f64 / length as f64 * view.rate_hz;
                    most = (score, Some((acceleration, way, hz)));
                }
            }
        }
    }
    let (statistic, Some((acceleration, way, hz))) = most else {
        return None;
    };
    let (of, name) = (way.what(), acceleration.name.clone());
    Some(Outcome {
        id: CheckId::Mixing,
        what: format!("the {of} of a tone of {hz:.3} Hz follows {name}"),
        about: vec![name],
        statistic,
        p_value: (asked as f64 * (-statistic).exp()).min(1.0),
    })
}
