//! Signals that follow an acceleration.

use super::super::super::prelude::*;

/// Vibration along a slant in spells: the anisoelastic error goes with the mean square over a sample, while the
/// accelerometers see single aliased values.
pub(super) fn rectified(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let (rms, slant) = (draw.between(0.05, 0.25), draw.between(0.3, 1.2));
    let gain = 1.0 - (-1.0 / (draw.between(0.2, 1.0) * stand.rate_hz)).exp();
    let rests = (0.0, draw.between(0.0, 12.0));
    let spells = in_spells(stand, rests, |was| {
        let is = if was == 0.0 {
            draw.between(0.4, 1.0)
        } else {
            0.0
        };
        (is, draw.between(2.0, 12.0))
    });
    let size = carry(0.0, &spells, |now, goal| now + gain * (goal - now));
    for (i, s) in size.iter().enumerate() {
        let shake = rms * s * draw.normal();
        stand.world.acc[0][i] = shake * slant.cos();
        stand.world.acc[1][i] = shake * slant.sin();
    }
    each(&size, |s| s * s)
}

/// A capacitor lets through how fast the acceleration changes, and nothing of what it is.
pub(super) fn change(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let shake = shaken(draw, stand, (0.3, 3.0));
    pace(&shake, 1)
}

/// A mass between stops that are close: what it does follows the acceleration for a little and is then the same however
/// hard it is pushed.
pub(super) fn stop(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let shake = shaken(draw, stand, (0.3, 4.0));
    let free = draw.by_ratio(0.05, 0.3);
    each(&shake, |s| (s / free).tanh())
}

/// Vibration rectification: what the part makes of a vibration far above its band follows the running mean square, which
/// the accelerometer shows; its read-out takes a second or more over that mean.
pub(super) fn vibration_level(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let level = swelling(draw, stand);
    let square = each(&stand.world.acc[level], |a| a * a);
    let runs = stand.lagged(&square, draw.by_ratio(0.3, 2.0));
    either_way(draw, &about_mean(&runs))
}

/// A mount that was aligned at one temperature and leans as it warms up: a level axis sees the turning of the table about
/// z, which the gyro of that axis reads, times what the temperature is off that one.
pub(super) fn misaligned(draw: &mut Draw, stand: &mut Stand, axis: usize) -> Vec<f64> {
    cycles(draw, stand);
    let (period, turn) = (draw.by_ratio(5.0, 15.0), draw.between(7.0, 28.0));
    stand.excitation = vec![("turn_dps", turn), ("turn_period_s", period)];
    let leans = from_trim(draw, stand, axis);
    let sign = draw.sign();
    let turns = stand.series(|i| (TAU * i as f64 / stand.rate_hz / period).sin());
    each_pair(&leans, &turns, |lean, turn| sign * lean * turn)
}

/// A multiplexer that comes to this gyro first in each frame, from the accelerometer that was last in the frame before: a
/// share of that sample is still on the capacitor.
pub(super) fn rest_of_sample(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let force = shaking(draw, stand);
    let sign = draw.sign();
    stand.series(|i| sign * force[i.saturating_sub(1)])
}

/// A gyro's sensitivity to acceleration is trimmed away at one temperature, near the middle of its range; what the springs
/// lose in stiffness by a degree brings it back, with one sign above and the other below.
pub(super) fn weighed(draw: &mut Draw, stand: &Stand, axis: usize) -> Vec<f64> {
    let temperature = from_trim(draw, stand, axis);
    each_pair(&temperature, &shaking(draw, stand), |t, a| t * a)
}

/// A hard shock, which the accelerometers show, throws the proof mass at its stop, where it sticks for a while. When it comes
/// free, the charge that the stop has left on it leaks away.
pub(super) fn stuck(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let (hard, sticks) = (draw.between(0.5, 0.8), draw.by_ratio(0.3, 2.5));
    let (left, leaks) = (draw.between(0.2, 0.8), draw.by_ratio(0.5, 4.0));
    let mut y = vec![0.0; stand.samples()];
    for (at, force) in shocks(draw, stand) {
        if force.abs() < hard {
            continue;
        }
        let free = sticks * draw.between(0.3, 1.7);
        for (k, v) in y.iter_mut().skip(at + 1).enumerate() {
            let since = k as f64 / stand.rate_hz - free;
            let freed = left * (-since / leaks).exp();
            *v = force.signum() * if since < 0.0 { 1.0 } else { freed };
        }
    }
    y
}

/// Anisoelasticity (IEEE Std 528): along its two principal axes a suspension yields unequally, and the mass that has moved
/// along one is turned by the acceleration along the other. Its axes lie at a slant to the board's.
pub(super) fn anisoelastic(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let (sin, cos) = draw.phase().sin_cos();
    let [x, y, _] = &stand.world.acc;
    each_pair(x, y, |x, y| sin * x * y + 0.5 * cos * (x * x - y * y))
}

/// A part with play in its mount is held by friction: only what an acceleration has beyond that moves it, and turns it.
pub(super) fn play(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let force = shaking(draw, stand);
    let holds = mean_square(&force).sqrt() * draw.between(0.8, 1.6);
    each(&force, |a| a.signum() * (a.abs() - holds).max(0.0))
}

/// A part on a spring that the accelerometer does not have: what the acceleration does to it rings on at a pitch of its
/// own.
pub(super) fn driven(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let mode = (draw.by_ratio(0.8, 8.5), draw.by_ratio(0.05, 0.3));
    resonating(&shaking(draw, stand), mode, stand.rate_hz)
}

/// A contact under a spring: closed until the acceleration is beyond a limit in one sense, then open, however far it goes.
pub(super) fn opens(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let shake = shaking(draw, stand);
    let rms = mean_square(&shake).sqrt();
    let (limit, sign) = (draw.between(0.7, 1.4) * rms, draw.sign());
    about_mean(&each(&shake, |a| one_if(sign * a > limit)))
}

/// Many small contacts, each of which follows the acceleration only after its own play (Prandtl and Ishlinskii): the way
/// there is another than the way back. The straight line through the loop is taken off, for the part is calibrated.
pub(super) fn slips(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    const CONTACTS: usize = 5;
    let (along, rms) = (draw.of_many(3), draw.between(0.08, 0.3));
    let sway = Turning::any(draw, stand, (0.15, 1.5), (0.02, 0.2));
    let force = each(&sway.of(draw, stand.samples()), |s| rms * s);
    let contacts: [(f64, f64); CONTACTS] =
        std::array::from_fn(|_| (rms * draw.between(0.3, 1.5), draw.between(0.5, 1.5)));
    let y = behind_plays(&force, &contacts);
    felt(draw, stand, along, &force);
    without_line(&y, &force)
}

/// A shaking that the accelerometers follow from sample to sample, strong and weak by turns, and a rate that answers to
/// its square alone.
pub(super) fn squared(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let (along, rms) = (draw.of_many(3), draw.between(0.08, 0.3));
    let shake = Turning::any(draw, stand, (0.4, 6.0), (0.02, 0.3)).of(draw, stand.samples());
    let depth = draw.between(0.3, 0.9);
    let swell = TAU / (draw.by_ratio(10.0, 80.0) * stand.rate_hz);
    let first = draw.phase();
    let swell = |i: usize| 1.0 + depth * (first + swell * i as f64).sin();
    let force = stand.series(|i| rms * shake[i] * swell(i));
    felt(draw, stand, along, &force);
    each(&force, |a| a * a)
}

/// A shock drives the loop that holds the part's amplitude to its stop. It comes back from there over seconds, and the rate
/// is off meanwhile: nothing at the shock itself, most of it when the accelerometer has long been still.
pub(super) fn recovery(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let shocks = shocks(draw, stand);
    let (rises, falls) = (draw.by_ratio(0.2, 0.6), draw.by_ratio(0.8, 3.0));
    let mut y = vec![0.0; stand.samples()];
    for (at, hard) in shocks {
        let since = (0..).map(|k| f64::from(k) / stand.rate_hz);
        let off = since.map(|t| hard * ((-t / falls).exp() - (-t / rises).exp()));
        add_at(&mut y, at + 1, off);
    }
    y
}

/// Rectification (g^2 of IEEE Std 528): the square of the acceleration along a level axis, whose vibration swells and fades.
pub(super) fn squared_acceleration(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let level = swelling(draw, stand);
    let square = each(&stand.world.acc[level], |a| a * a);
    either_way(draw, &about_mean(&square))
}

/// Sensitivity to an acceleration that the frames show earlier: the rate passes the part's digital filter, which delays
/// it by some samples and smooths it, the accelerometer is read at once. Of a vibration the value of now tells nothing
/// about that of then.
pub(super) fn late(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let (after, from) = (1 + draw.of_many(5), draw.of_many(3));
    let smoothed = stand.lagged(&stand.world.acc[from], draw.by_ratio(0.02, 0.15));
    stand.series(|i| smoothed[i.saturating_sub(after)])
}

/// Rectification behind a mount of rubber: not the acceleration that is told, but what the mount's own mode makes of it, is
/// squared.
pub(super) fn mount(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let level = swelling(draw, stand);
    let mode = (draw.by_ratio(1.0, 8.0), draw.by_ratio(0.1, 0.8));
    let moves = resonating(&stand.world.acc[level], mode, stand.rate_hz);
    either_way(draw, &about_mean(&each(&moves, |m| m * m)))
}
