//! What passes or happens now and then, and what it leaves behind.

use super::super::super::prelude::*;

/// Something sweeps past a resonance now and then, and what is absorbed follows the law of Lorentz: 1 / (1 + (t / w)^2),
/// of either sign, whose skirts never quite end.
pub(super) fn peaks(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let (width, apart) = (draw.by_ratio(0.15, 0.9), draw.by_ratio(8.0, 40.0));
    arriving(stand, apart * draw.exponential(), |y, at| {
        let size = draw.signed(0.5, 1.5);
        let peak = |t: f64| size / (1.0 + ((t - at) / width).powi(2));
        add_at(y, 0, in_time(stand, peak));
        at + apart * (0.2 + draw.exponential())
    })
}

/// A lift, a tram or a lorry passes: iron is a dipole, and its field at the part is that of a dipole on a straight line,
/// (3 cos^2 - 1) / r^3 with the angle to where it points. Each passes at its own distance and speed, and is magnetised
/// its own way.
pub(super) fn passing(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    arriving(stand, draw.between(0.0, 20.0), |y, at| {
        // Distance over speed, s.
        let takes = draw.by_ratio(0.5, 4.0);
        let (size, (across, along)) = (draw.between(0.5, 1.5), draw.phase().sin_cos());
        // The component across the way: 3 (m.r) r / r^5 - m / r^3.
        let field = |t: f64| {
            let x = (t - at) / takes;
            let square = 1.0 + x * x;
            size * (3.0 * (across + along * x) / square - across) / square.powf(1.5)
        };
        add_at(y, 0, in_time(stand, field));
        at + (4.0 * takes + 25.0 * draw.exponential())
    })
}

/// The door of the laboratory: drawn open, the pressure falls, and it jumps up when the door falls shut, mostly right after;
/// either leaks away through the gaps. The lid of the package bends by it.
pub(super) fn door(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    const LEFT_OPEN: f64 = 0.2;
    let leaks = draw.by_ratio(0.5, 4.0);
    let sign = draw.sign();
    let kicks = arriving(stand, draw.between(1.0, 15.0), |kicks, at| {
        let open = if draw.chance(LEFT_OPEN) {
            draw.between(10.0, 40.0)
        } else {
            draw.between(1.5, 6.0)
        };
        let [opened, shut] = [at, at + open].map(|t| (t * stand.rate_hz) as usize);
        add_at(kicks, opened, [-sign * draw.between(0.4, 1.0)]);
        add_at(kicks, shut, [sign * draw.between(0.7, 1.5)]);
        at + (open + 2.0 + 12.0 * draw.exponential())
    });
    let pressure = leaking(&kicks, leaks, stand.rate_hz);
    stand.lagged(&pressure, draw.by_ratio(0.05, 0.3))
}

/// Somebody works at the stand and touches it now and then: heat goes in, reaches the part through what it is mounted on, and leaves again;
/// two lags of one time constant answer by t exp(-t). The part's thermometer sits on the other side.
pub(super) fn touches(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let decay = draw.by_ratio(1.0, 6.0);
    let mut y = vec![0.0; stand.samples()];
    for _ in 0..12 + draw.of_many(24) {
        let at = draw.between(0.0, 0.97 * stand.seconds);
        let size = draw.between(0.4, 1.5);
        let heat = |t: f64| {
            let since = (t - at).max(0.0) / decay;
            size * since * (1.0 - since).exp()
        };
        add_at(&mut y, 0, in_time(stand, heat));
    }
    y
}

/// A charge that gets into an integrator and out again at the next reading, a sum that misses a bit and is put right: a
/// spike, and at once its opposite. Each is a few sigma high, so that there are as many as the strength asks.
pub(super) fn pairs(draw: &mut Draw, stand: &Stand, wanted: f64) -> Vec<f64> {
    let n = stand.samples();
    let sigma_high = draw.by_ratio(1.5, 3.0);
    let count = (wanted * wanted / (2.0 * sigma_high * sigma_high)).ceil() as usize;
    let mut y = vec![0.0; n];
    for _ in 0..count {
        let (at, size) = (draw.of_many(n - 1), draw.signed(0.8, 1.2));
        add_at(&mut y, at, [size, -size]);
    }
    y
}

/// Iron that is slowly magnetised gives way in avalanches (Barkhausen 1919): of the mean field, durations by the power -2,
/// each a parabola as high as it is long (Sethna, Dahmen and Myers 2001), in either sense.
pub(super) fn crackle(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    // Shortest and longest avalanche, s.
    let (least, most) = (0.1, 4.0);
    let apart = draw.by_ratio(0.5, 3.0);
    arriving(stand, apart * draw.exponential(), |y, at| {
        let long = 1.0 / draw.between(1.0 / most, 1.0 / least);
        let sign = draw.sign();
        let [from, to] = [at, at + long].map(|t| (t * stand.rate_hz).ceil() as usize);
        let parts = (from..to).map(|i| (i as f64 / stand.rate_hz - at) / long);
        add_at(
            y,
            from,
            parts.map(|part| sign * long * 4.0 * part * (1.0 - part)),
        );
        at + (long + apart * draw.exponential())
    })
}

/// Charges that arrive at random and leak away: shot noise, all of one sign.
pub(super) fn pulses(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let rate_hz = stand.rate_hz;
    let (sign, decay) = (draw.sign(), draw.by_ratio(0.5, 5.0));
    // Few enough that most stand alone.
    let apart = decay * draw.by_ratio(4.0, 12.0);
    let keep = (-1.0 / (decay * rate_hz)).exp();
    let (mut y, mut left) = (0.0, apart * draw.exponential());
    stand.series(|_| {
        y *= keep;
        left -= 1.0 / rate_hz;
        while left <= 0.0 {
            y += sign * (0.3 + draw.exponential());
            left += apart * draw.exponential();
        }
        y
    })
}

/// Discharges that leave charge at the proof mass: each a jump of the bias that leaks away through the oxide.
pub(super) fn charge(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let at = events(draw, stand, 3, 5);
    let leaks = draw.by_ratio(3.0, 25.0);
    let size = sizes(draw, &at);
    about_mean(&since(stand, &at, |k, t| size[k] * (-t / leaks).exp()))
}

/// Jolts that leave stress in the package, which relaxes as the logarithm of the time since.
pub(super) fn jolts(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let at = events(draw, stand, 3, 5);
    let (begins, ends) = (draw.by_ratio(0.1, 1.0), draw.by_ratio(20.0, 120.0));
    let size = sizes(draw, &at);
    let whole = (ends / begins).ln_1p();
    let left = |t: f64| (1.0 - (t / begins).ln_1p() / whole).max(0.0);
    about_mean(&since(stand, &at, |k, t| size[k] * left(t)))
}

/// The loop that holds the drive at its resonance loses it now and then: for a moment its phase slips through whole turns,
/// slower and slower, then it is caught and what is left of the error dies away.
pub(super) fn lock(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let at = events(draw, stand, 3, 6);
    let (slips, beat) = (draw.between(0.4, 1.5), draw.between(2.0, 6.0));
    let dies = draw.by_ratio(1.5, 8.0);
    let size = sizes(draw, &at);
    // Its pitch goes down to 0 evenly, and ends at a crest.
    let slipping = |t: f64| (PI * beat * slips * (1.0 - t / slips).powi(2)).cos();
    let caught = |t: f64| (-(t - slips) / dies).exp();
    since(stand, &at, |k, t| {
        size[k] * if t < slips { slipping(t) } else { caught(t) }
    })
}

/// Jumps of either sign that relax.
pub(super) fn jumps_that_relax(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let decay = draw.between(3.0, 15.0);
    let (mut y, mut left) = (0.0, 5.0);
    stand.series(|_| {
        left -= 1.0 / stand.rate_hz;
        y *= (-1.0 / (decay * stand.rate_hz)).exp();
        if left <= 0.0 {
            y += draw.signed(0.5, 1.5);
            left = 10.0 + 30.0 * draw.exponential();
        }
        y
    })
}

/// After it was handled, a mount settles by the logarithm of time.
pub(super) fn creep(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let at = stand.seconds * draw.between(0.0, 0.5);
    let first = draw.by_ratio(0.5, 5.0);
    in_time(stand, |t| (1.0 + (t - at).max(0.0) / first).ln())
}
