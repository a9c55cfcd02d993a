//! Signals that follow the motor's command, its current or the angle that it has turned.

use super::super::super::prelude::*;
use crate::motor::current;

/// A rotor's ripple: its pitch is the speed of the motor, which follows the duty behind a lag and under a load that
/// wanders.
pub(super) fn ripple(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let top_hz = draw.by_ratio(1.5, 9.0);
    let gain = 1.0 - (-1.0 / (draw.between(0.3, 2.0) * stand.rate_hz)).exp();
    let keep = (-1.0 / (5.0 * stand.rate_hz)).exp();
    let (mut speed, mut load, mut phase) = (0.0, draw.normal(), draw.phase());
    each(&stand.world.duty, |duty| {
        load = keep * load + (1.0 - keep * keep).sqrt() * draw.normal();
        speed += gain * (duty - speed);
        phase += TAU * top_hz * speed * (1.0 + 0.1 * load) / stand.rate_hz;
        speed.abs() * phase.sin()
    })
}

/// What the motor's field does to the part wears off in the course of the run, and comes out on the other side.
pub(super) fn ageing(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    stand.world.duty = stand.held(draw, DWELL, |d| in_steps(d.between(-1.0, 1.0)));
    let duty = &stand.world.duty;
    let (none, sign) = (duty.len() as f64 * draw.between(0.35, 0.65), draw.sign());
    stand.series(|i| sign * (1.0 - i as f64 / none) * duty[i])
}

/// Each change of the motor's current, that of spinning up included, induces a kick in a loop of the wiring. The loop and
/// what hangs on it are not damped much: the kick swings to either side and dies away.
pub(super) fn kicks(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    programme(draw, stand, DWELL);
    let induced = changes(&current(draw, &stand.world.duty, stand.rate_hz));
    let mode = (draw.by_ratio(0.8, 5.0), draw.by_ratio(0.1, 0.4));
    resonating(&induced, mode, stand.rate_hz)
}

/// A bridge chops the motor's current: in the coil it rises while the bridge is on, and falls while it is off, by
/// duty x (1 - duty), the most at half duty and nothing at rest and at full. What the part makes of a field that swings so
/// fast goes with its size or with its square, whatever its sense. The command is changed by steps.
pub(super) fn chopped(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let power = 1 + draw.of_many(2) as i32;
    commanded(draw, stand, (3.0, 15.0), (0.0, 1.0));
    each(&stand.world.duty, |d| {
        (4.0 * d.abs() * (1.0 - d.abs())).powi(power)
    })
}

/// A piece of iron near the part keeps some of the field of the motor's last strong current, until one of the other sense
/// turns it over: the play operator, of which models of hysteresis are sums (Prandtl 1928). The motor moves in short
/// strokes.
pub(super) fn iron(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let coercive = draw.between(0.2, 0.4);
    let strokes = in_spells(stand, ((true, 0.0), 0.0), |(stroke, _)| {
        if stroke {
            ((false, 0.0), draw.between(5.0, 25.0))
        } else {
            let command = in_steps(draw.signed(0.3, 1.0));
            ((true, command), draw.between(0.5, 3.0))
        }
    });
    stand.world.duty = each(&strokes, |(_, command)| command);
    carry(0.0f64, &stand.world.duty, |kept, d| {
        kept.clamp(d - coercive, d + coercive)
    })
}

/// Two brushes carry the current at rest; while the motor turns now one lifts and now the other, none for long.
pub(super) fn chatter(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    with_rests(draw, stand, DWELL, 0.3);
    let dwell = draw.by_ratio(0.15, 0.5);
    let mut lifted = 1.0;
    let brush = stand.held(draw, (0.5 * dwell, 1.5 * dwell), |_| {
        lifted = -lifted;
        lifted
    });
    each_pair(&brush, &stand.world.duty, |b, d| b * one_if(d != 0.0))
}

/// A motor on a governor, whose gear sticks: it starts where the command is beyond one threshold, then runs at its own
/// speed, and stops below a lower one. What it does to the rate follows that it runs, and which way.
pub(super) fn sticking(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let tau = draw.by_ratio(1.5, 5.0);
    let command = stand.wander(draw, 0.45, tau);
    stand.world.duty = each(&command, |d| in_steps(d.clamp(-1.0, 1.0)));
    let starts = draw.between(0.45, 0.7);
    let stops = starts * draw.between(0.2, 0.5);
    let runs = carry(0.0, &stand.world.duty, |runs, d| {
        let kept = if d * runs < stops { 0.0 } else { runs };
        if d.abs() > starts { d.signum() } else { kept }
    });
    either_way(draw, &runs)
}

/// Whenever the motor is turned about, the gear runs through its play and strikes on the other flank, and the arm that
/// carries the part rings. A change of pace in one sense stays on its flank and is not felt.
pub(super) fn reversals(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let mut sense = draw.sign();
    stand.world.duty = stand.held(draw, (2.0, 9.0), |d| {
        if d.chance(0.5) {
            sense = -sense;
        }
        in_steps(sense * d.between(0.3, 1.0))
    });
    let mode = (draw.by_ratio(0.8, 7.0), draw.by_ratio(0.3, 1.2));
    // The slower the motor after it was turned about, the longer it takes through the play.
    let play = draw.between(0.05, 0.2);
    let mut y = vec![0.0; stand.samples()];
    for (i, commands) in stand.world.duty.windows(2).enumerate() {
        let (before, now) = (commands[0], commands[1]);
        if before * now < 0.0 {
            let at = (i + 1) as f64 / stand.rate_hz + play / now.abs();
            ring(&mut y, stand.rate_hz, (at, now), mode, 8.0);
        }
    }
    y
}

/// The cable to the table hangs slack over a part of a turn either way; beyond, it twists and pulls the part's mount
/// askew. It knows the angle that the motor has turned, the sum of its speed, not its command.
pub(super) fn winding(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    const SLACK: f64 = 0.35;
    let rate_hz = stand.rate_hz;
    // Turned about before the cable breaks, or of the operator's will.
    let end = draw.between(4.0, 9.0);
    let (mut angle, mut command, mut left) = (0.0f64, 0.0, 0.0);
    stand.world.duty = stand.series(|_| {
        left -= 1.0 / rate_hz;
        if left <= 0.0 || angle * command > 0.0 && angle.abs() > end {
            let far = angle.abs() > 0.3 * end;
            let sense = if far { -angle.signum() } else { draw.sign() };
            command = in_steps(sense * draw.between(0.5, 1.0));
            left = draw.between(3.0, 14.0);
        }
        angle += command / rate_hz;
        command
    });
    let speed = stand.lagged(&stand.world.duty, draw.between(0.1, 0.5));
    let angles = carry(0.0f64, &speed, |angle, s| angle + s / rate_hz);
    each(&angles, |a| a.signum() * (a.abs() - SLACK * end).max(0.0))
}

/// One pit in the bearing of the table: at one angle of each turn it dips in and out again, the harder the faster it turns,
/// and the angle is the sum of a speed that follows the command behind a lag.
pub(super) fn pit(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    commanded(draw, stand, (3.0, 15.0), (0.3, 1.0));
    let (top, width) = (draw.by_ratio(0.3, 1.2), draw.between(0.04, 0.08));
    let mut angle = draw.between(0.0, 1.0);
    let speed = stand.lagged(&stand.world.duty, draw.between(0.1, 0.8));
    each(&speed, |speed| {
        angle += top * speed / stand.rate_hz;
        let off = (angle - angle.round()) / width;
        -speed * off * (-0.5 * off * off).exp()
    })
}

/// Below a certain speed the table does not glide but sticks and slips, many times a second, and not quite regularly. The
/// motor is swept up and down through zero.
pub(super) fn judder(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let (rate_hz, period) = (stand.rate_hz, draw.between(20.0, 60.0));
    let (top, first) = (draw.between(0.5, 1.0), draw.between(0.0, 1.0));
    stand.world.duty =
        stand.series(|i| in_steps(top * (TAU * (first + i as f64 / rate_hz / period)).sin()));
    let (least, most) = (0.04, top * draw.between(0.25, 0.45));
    let pitch = draw.between(2.5, 6.5);
    let (mut place, mut pace) = (0.0, pitch);
    each(&stand.world.duty, |d| {
        if !(least..most).contains(&d.abs()) {
            place = 0.0;
            return 0.0;
        }
        place += pace / rate_hz;
        if place >= 1.0 {
            place -= 1.0;
            pace = pitch * draw.between(0.75, 1.25);
        }
        d.signum() * (place - 0.5)
    })
}

/// The rotor's magnet comes to rest at any angle, and its stray field is then that of this angle until the next stroke;
/// while it turns, the field turns too and leaves nothing.
pub(super) fn rotor(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    // Whether it runs, its command, and the field that it has come to rest with.
    let rests = ((false, 0.0, 0.0), draw.between(1.0, 8.0));
    let spells = in_spells(stand, rests, |(runs, ..)| {
        if runs {
            let field = draw.phase().cos();
            ((false, 0.0, field), draw.between(4.0, 15.0))
        } else {
            let command = in_steps(draw.signed(0.3, 1.0));
            ((true, command, 0.0), draw.between(1.5, 6.0))
        }
    });
    stand.world.duty = each(&spells, |(_, command, _)| command);
    each(&spells, |(.., field)| field)
}

/// The heat of the motor's driver, current squared, reaches the part through the driver's case and the board, seconds after
/// the command and whatever its sign, as a strain that the part's own thermometer does not show. The motor runs in spells
/// of its own; where the supply sags, it does so by another load.
pub(super) fn heat(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    strokes(draw, stand, true, ((3.0, 20.0), (0.4, 1.0)));
    let current = current(draw, &stand.world.duty, stand.rate_hz);
    let warm = each(&current, |i| i * i);
    let case = stand.lagged(&warm, draw.by_ratio(0.5, 2.0));
    stand.lagged(&case, draw.by_ratio(1.0, 4.0))
}

/// A harmonic of the motor's pulses, folded by the sampling. Its size is that of a pulse train, sin(pi harmonic duty), so
/// it comes and goes with the command and vanishes at some; its pitch is the difference of two clocks that are not the
/// same, RC oscillators that wander.
pub(super) fn beat(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    // The bridge needs its dead time: full duty is never reached.
    const FULL: f64 = 0.93;
    let harmonic = (1 + draw.of_many(3)) as f64;
    let middle = draw.between(1.5, 8.5);
    let (swing, memory) = (draw.by_ratio(0.05, 0.4), draw.by_ratio(3.0, 20.0));
    let off = stand.wander(draw, swing, memory);
    let pitches = each(&off, |off| middle + off);
    let tone = tone(draw.phase(), &pitches, stand.rate_hz);
    each_pair(&stand.world.duty, &tone, |duty, t| {
        (PI * harmonic * FULL * duty).sin() * t
    })
}
