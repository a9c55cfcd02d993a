//! Tones, whose pitch, size or phase changes.

use super::super::super::prelude::*;

/// The first coordinate of the Lorenz system (1963) at its usual parameters: a swing about either of two places.
pub(super) fn swing_without_period(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let slope = |[x, y, z]: [f64; 3]| [10.0 * (y - x), x * (28.0 - z) - y, x * y - 8.0 / 3.0 * z];
    let step = |s: [f64; 3], h: f64| {
        let along = |by: f64, k: [f64; 3]| std::array::from_fn(|i| s[i] + by * k[i]);
        let a = slope(s);
        let b = slope(along(h / 2.0, a));
        let c = slope(along(h / 2.0, b));
        let d = slope(along(h, c));
        std::array::from_fn(|i| s[i] + h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]))
    };
    // One swing takes 0.75 of its units of time.
    let pace = 0.75 / draw.by_ratio(0.6, 4.0) / stand.rate_hz;
    let parts = (pace / 0.005).ceil().max(1.0);
    let mut state = [draw.normal(), draw.normal(), 25.0 + draw.normal()];
    for _ in 0..4000 {
        state = step(state, 0.005);
    }
    stand.series(|_| {
        for _ in 0..parts as usize {
            state = step(state, pace / parts);
        }
        state[0]
    })
}

/// A carrier that turns over by the bits of a message: its phase is one of two, its size is always the same.
pub(super) fn keyed(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let (f, bit) = (draw.by_ratio(0.8, 9.5), draw.by_ratio(0.4, 3.0));
    let first = draw.phase();
    let bits = stand.held(draw, (bit, bit), Draw::sign);
    stand.series(|i| bits[i] * (first + TAU * f * i as f64 / stand.rate_hz).sin())
}

/// A tone that the sampling folds into the band: as the oscillator of one of the two warms up it glides to where it stays,
/// by the exponential of the warming.
pub(super) fn gliding(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let (stays, warms) = (draw.between(0.8, 9.2), draw.by_ratio(120.0, 400.0));
    // From the side on which there is room.
    let from = draw.between(0.5, 3.0) * if stays < 5.0 { 1.0 } else { -1.0 };
    let first = draw.phase();
    in_time(stand, |t| {
        let turns = stays * t + from * warms * (1.0 - (-t / warms).exp());
        (first + TAU * turns).sin()
    })
}

/// A loop that is barely unstable: its swing grows by itself out of the noise until its own amplitude shifts the working
/// point and stops it, and it begins again (an oscillator that squegs).
pub(super) fn quenched(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let (f, growth) = (draw.by_ratio(0.4, 8.0), draw.by_ratio(1.5, 8.0));
    let grows = (1.0 / (growth * stand.rate_hz)).exp();
    let mut size = draw.by_ratio(0.02, 1.0);
    let mut phase = draw.phase();
    stand.series(|_| {
        size *= grows;
        phase += TAU * f / stand.rate_hz;
        if size > 1.0 {
            size = draw.by_ratio(0.01, 0.1);
            phase = draw.phase();
        }
        size * phase.sin()
    })
}

/// A loop that locks one clock to another finds two places to lock in and hops between them, keeping its phase: a tone at
/// one pitch or the other, each for a random time.
pub(super) fn hopping(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let first = draw.between(0.5, 9.0);
    let second = loop {
        let f = first + draw.sign() * draw.by_ratio(0.3, 4.0);
        if (0.4..9.5).contains(&f) {
            break f;
        }
    };
    // Each with the time for which it stays there, s.
    let places = [first, second].map(|pitch| (pitch, draw.by_ratio(4.0, 20.0)));
    let (at, phase) = (draw.of_many(2), draw.phase());
    let at = in_spells(stand, (at, 0.0), |at| {
        (1 - at, places[1 - at].1 * draw.exponential())
    });
    tone(phase, &each(&at, |at| places[at].0), stand.rate_hz)
}

/// A fan whose control loop hunts: its pitch sways about the mean with a period, far enough that the tone has many side
/// bands and hardly a carrier.
pub(super) fn swaying(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let (sway, index) = (draw.by_ratio(0.02, 0.15), draw.between(4.0, 12.0));
    let reach = sway * index;
    let pitch = draw.between(reach + 0.5, 9.5 - reach);
    let (first, start) = (draw.phase(), draw.phase());
    in_time(stand, |t| {
        (first + TAU * pitch * t + index * (start + TAU * sway * t).sin()).sin()
    })
}

/// A source that drives past at an even pace: its loudness goes as one over its distance, its pitch falls as it passes
/// (Doppler 1842), and the next one comes at random. The tone itself is far above the samples' rate.
pub(super) fn siren(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let fall = draw.by_ratio(0.2, 2.0);
    let apart = draw.by_ratio(15.0, 50.0);
    arriving(stand, apart * draw.exponential(), |y, at| {
        let pitch = draw.between(fall + 0.5, 9.5 - fall);
        let (pace, first) = (draw.by_ratio(0.6, 3.0), draw.phase());
        let heard = |t: f64| {
            let distance = 1.0f64.hypot((t - at) / pace);
            let turns = pitch * (t - at) - fall * pace * distance;
            (first + TAU * turns).sin() / distance
        };
        add_at(y, 0, in_time(stand, heard));
        at + apart * (0.3 + draw.exponential())
    })
}

/// A rotor that takes the whole record to run up or to run down, evenly in pitch or in its logarithm.
pub(super) fn sweep(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let n = stand.samples() as f64;
    let (low, high) = (draw.between(0.3, 3.0), draw.between(4.0, 9.7));
    let (from, to) = draw.either((high, low), (low, high));
    let even = draw.chance(0.5);
    let pitches = stand.series(|i| match i as f64 / n {
        at if even => from + (to - from) * at,
        at => from * (to / from).powf(at),
    });
    tone(draw.phase(), &pitches, stand.rate_hz)
}

/// An oscillator without a crystal: its pitch wanders about its mean.
pub(super) fn wandering(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let pitch = draw.between(1.0, 9.0);
    let (sigma, tau) = (draw.by_ratio(0.05, 0.4), draw.by_ratio(5.0, 60.0));
    let first = draw.phase();
    let pitches = each(&stand.wander(draw, sigma, tau), |off| pitch + off);
    tone(first, &pitches, stand.rate_hz)
}

/// A machine in the next room that is started and stopped as it is needed: each time with a phase and a load of its own,
/// rising and falling over a second or so.
pub(super) fn starts_and_stops(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let (pitch, slip) = (draw.by_ratio(0.6, 9.5), draw.by_ratio(0.002, 0.02));
    let (runs, rests) = (draw.by_ratio(4.0, 20.0), draw.by_ratio(6.0, 40.0));
    let rise = draw.by_ratio(0.3, 2.0);
    arriving(stand, rests * draw.exponential(), |y, from| {
        let to = from + runs * draw.between(0.5, 1.5);
        let (f, phase) = (pitch * (1.0 + slip * draw.normal()), draw.phase());
        let size = draw.between(0.6, 1.4);
        let runs = |t: f64| {
            let swelling = ((t - from) / rise).min((to - t) / rise).clamp(0.0, 1.0);
            size * swelling * (TAU * f * (t - from) + phase).sin()
        };
        add_at(y, 0, in_time(stand, runs));
        to + rests * draw.exponential() + 0.5
    })
}

/// A machine next door whose rotor is not balanced starts, runs and is left to run down. It shakes the bench only while
/// its speed passes the bench's resonance: a swing up through that pitch within seconds, and later one down through it.
pub(super) fn runs_up(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let rate_hz = stand.rate_hz;
    let (resonance, damping) = (draw.by_ratio(1.2, 5.0), draw.between(0.05, 0.12));
    // Speed at which it runs: far above, where the bench no longer follows.
    let runs = resonance * draw.between(6.0, 9.0);
    let (up, down) = (draw.between(8.0, 20.0), draw.between(4.0, 10.0));
    let first = (true, draw.between(15.0, 40.0));
    let (mut phase, mut speed) = (draw.phase(), 0.0);
    let on = in_spells(stand, first, |on| (!on, draw.between(15.0, 40.0)));
    each(&on, |on| {
        let (goal, takes) = if on { (runs, up) } else { (0.0, down) };
        speed += (goal - speed) / takes / rate_hz;
        phase += TAU * speed / rate_hz;
        // What turns faster than half the sample rate does not pass the part's filter.
        if speed > 0.45 * rate_hz {
            return 0.0;
        }
        let x = speed / resonance;
        let (stiff, lossy) = (1.0 - x * x, 2.0 * damping * x);
        let late = lossy.atan2(stiff);
        x * x / stiff.hypot(lossy) * (phase - late).sin() / (1.0 + x.powi(4))
    })
}

/// A modulator of first order at rest gives out a pattern: what it has summed and not yet given is a sawtooth whose pitch
/// is its input, all its harmonics folded, and the input is the part's own offset, which wanders.
pub(super) fn idle_tones(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let (size, memory) = (draw.by_ratio(0.003, 0.03), draw.by_ratio(10.0, 60.0));
    let off = stand.wander(draw, size, memory);
    let (middle, first) = (draw.between(0.05, 0.45), draw.between(0.0, 1.0));
    let sums = carry(first, &off, |sum, o| (sum + middle + o).rem_euclid(1.0));
    each(&sums, |sum| sum - 0.5)
}

/// Drives of two gyros on one board pull each other (Adler 1946): phase' = detuning - pull sin(phase). Nearly in step, the
/// phase creeps through a narrow place and then slips by a turn; as the detuning wanders it also stays locked for a
/// while. The rate sees sin(phase).
pub(super) fn pulled(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    const PARTS: usize = 8;
    let h = 1.0 / stand.rate_hz / PARTS as f64;
    let pull = TAU * draw.by_ratio(0.15, 1.0);
    let (middle, swing) = (draw.between(1.0, 1.3), draw.between(0.1, 0.3));
    let memory = draw.by_ratio(8.0, 40.0);
    let detuning = stand.wander(draw, swing, memory);
    let phases = carry(draw.phase(), &detuning, |phase, d| {
        let next = |phase: f64, _| phase + h * pull * (middle + d - phase.sin());
        (0..PARTS).fold(phase, next)
    });
    each(&phases, f64::sin)
}

/// A harmonic of the mains, folded to anywhere in the band: the grid's frequency wanders by some 20 mHz, and the harmonic by
/// as much more as its number says.
pub(super) fn hum(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let harmonic = (1 + draw.of_many(7)) as f64;
    let (folded, turns_over) = (draw.between(0.8, 9.2), draw.sign());
    let (sigma, tau) = (draw.by_ratio(0.012, 0.03), draw.by_ratio(20.0, 120.0));
    let grid = stand.wander(draw, sigma, tau);
    let pitches = each(&grid, |off| folded + turns_over * harmonic * off);
    tone(draw.phase(), &pitches, stand.rate_hz)
}

/// A tone that glides from pitch to pitch.
pub(super) fn chirp(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let (from, to) = (draw.between(0.5, 3.0), draw.between(4.0, 9.0));
    in_time(stand, |t| {
        let f = from + (to - from) * t / stand.seconds / 2.0;
        (TAU * f * t).sin()
    })
}

/// A tone with its harmonics.
pub(super) fn comb(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let f = draw.between(0.4, 1.5);
    let phases: [f64; 6] = std::array::from_fn(|_| draw.phase());
    in_time(stand, |t| {
        let term = |(k, p): (usize, &f64)| (TAU * f * (k + 1) as f64 * t + p).sin();
        phases.iter().enumerate().map(term).sum()
    })
}

/// A tone whose pitch swings with a period.
pub(super) fn changing_pitch(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let (f, period) = (draw.between(1.0, 8.0), draw.between(20.0, 120.0));
    let turns = draw.between(0.2, 0.8) * period / 2.0;
    in_time(stand, |t| {
        (TAU * f * t + turns * (TAU * t / period).sin()).sin()
    })
}

/// A tone that is there for a while, and not for another.
pub(super) fn comes_and_goes(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let f = draw.between(0.5, 8.0);
    let first = (draw.chance(0.5), 0.0);
    let on = in_spells(stand, first, |on| (!on, draw.between(10.0, 60.0)));
    let tone = in_time(stand, |t| (TAU * f * t).sin());
    each_pair(&on, &tone, |on, tone| one_if(on) * tone)
}

/// A mass that hangs on a spring twice as fast as it swings: the bounce drives the swing, and the swing the bounce, so that
/// the energy goes to and fro between them (Vitt and Gorelik 1933). Amplitudes by their slow equations; draughts push a little.
pub(super) fn spring_pendulum(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    const DRAUGHT: f64 = 0.004;
    type Complex = (f64, f64);
    let times = |(a, b): Complex, (c, d): Complex| (a * c - b * d, a * d + b * c);
    // Both turn by i times the product: of the bounce with the conjugate of the swing, and of the swing with itself.
    let slope = |swing: Complex, bounce: Complex| {
        let (one, two) = (times(bounce, (swing.0, -swing.1)), times(swing, swing));
        ((-one.1, one.0), (-two.1, two.0))
    };
    let along = |from: Complex, by: f64, to: Complex| (from.0 + by * to.0, from.1 + by * to.1);
    let step = 1.0 / (draw.by_ratio(2.0, 10.0) * stand.rate_hz);
    let turn = TAU * draw.by_ratio(0.3, 3.0) / stand.rate_hz;
    let seen = draw.between(0.2, 0.7);
    let (mut swing, mut bounce) = ((0.2 + 0.3 * draw.normal(), 0.2), (1.0, draw.normal()));
    stand.series(|i| {
        let middle = slope(swing, bounce);
        let half_swing = along(swing, 0.5 * step, middle.0);
        let then = slope(half_swing, along(bounce, 0.5 * step, middle.1));
        let pushed = (DRAUGHT * draw.normal(), DRAUGHT * draw.normal());
        swing = along(along(swing, step, then.0), 1.0, pushed);
        bounce = along(bounce, step, then.1);
        // What the draughts bring the losses take.
        let energy = swing.0.powi(2) + swing.1.powi(2) + bounce.0.powi(2) + bounce.1.powi(2);
        let whole = 1.0 / energy.sqrt();
        [swing, bounce] = [swing, bounce].map(|(re, im)| (whole * re, whole * im));
        let (sin, cos) = (turn * i as f64).sin_cos();
        let real = |(re, im): Complex, sin: f64, cos: f64| re * cos - im * sin;
        real(swing, sin, cos) + seen * real(bounce, 2.0 * sin * cos, cos * cos - sin * sin)
    })
}

/// A transmitter whose waves come over many ways: the input rectifies what they add up to. Somebody walks through the room and
/// stops, and with every half wave the field goes through crests and holes (Clarke 1968); while nobody moves it stands.
pub(super) fn fading(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    const WAYS: usize = 8;
    let fastest = TAU * draw.by_ratio(0.2, 2.0) / stand.rate_hz;
    let speed = stand.held(draw, (2.0, 10.0), |d| {
        d.zero_or(0.3, |d| d.between(0.3, 1.0))
    });
    let mut ways: [(f64, f64); WAYS] = std::array::from_fn(|_| (draw.phase().cos(), draw.phase()));
    let sign = draw.sign();
    let power = each(&speed, |s| {
        let (mut re, mut im) = (0.0, 0.0);
        for (toward, phase) in &mut ways {
            *phase += fastest * s * *toward;
            re += phase.cos();
            im += phase.sin();
        }
        sign * (re * re + im * im) / WAYS as f64
    });
    about_mean(&power)
}
