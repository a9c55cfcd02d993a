//! What the mechanics of a rate table do beside what is commanded: bearings, belts, gears and cables.

use super::super::super::prelude::*;

/// The cable to the table drags over an edge and jumps off it at a few angles: a kick, and the table rings. Turned back it
/// slides over without one.
pub(super) fn edge(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let rate = turned(draw, stand, DWELL);
    let angle = angle_of_table(&rate, draw.by_ratio(0.2, 0.8), stand.rate_hz);
    let mut kicks = vec![0.0; rate.len()];
    for _ in 0..1 + draw.of_many(3) {
        let (place, hard) = (draw.between(0.0, 1.0), draw.between(0.4, 1.6));
        let jumps = passes(&angle, 1.0, place);
        let jumped = each_pair(&jumps, &rate, |jumps, r| match r > 0.0 {
            true => hard * jumps * draw.between(0.7, 1.3),
            false => 0.0,
        });
        add_at(&mut kicks, 0, jumped);
    }
    let mode = (draw.between(1.5, 8.0), draw.by_ratio(0.3, 1.5));
    resonating(&kicks, mode, stand.rate_hz)
}

/// The rubber that the part stands on gives way to the centrifugal load, and the more, the softer a load has made it (Payne):
/// it softens at once, and takes its time to harden. The part reads the rate at which it leans.
pub(super) fn rubber(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let rate = turned(draw, stand, DWELL);
    let hardens = 1.0 / (draw.by_ratio(5.0, 40.0) * stand.rate_hz);
    let (softens, sign) = (draw.between(1.0, 4.0), draw.sign());
    let loads = each(&rate, |r| r * r);
    let soft = carry(0.0f64, &loads, |soft, load| load.max(soft - hardens * soft));
    let leans = each_pair(&loads, &soft, |load, soft| {
        sign * load * (1.0 + softens * soft)
    });
    changes(&stand.lagged(&leans, draw.by_ratio(0.3, 2.0)))
}

/// The cages of the table's two bearings, with the balls in them, go round a little differently: two ripples of the angle
/// that beat by the angle, and not by time.
pub(super) fn cages(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let rate = turned(draw, stand, DWELL);
    // Balls that pass in a turn, of eight to twelve in a cage that goes 0.4 turns.
    let (balls, apart) = (draw.between(3.0, 5.0), draw.between(0.02, 0.08));
    let angle = angle_of_table(&rate, balls * draw.by_ratio(0.3, 1.2), stand.rate_hz);
    let second = draw.between(0.5, 1.0);
    let [one, other] = [0, 1].map(|_| draw.phase());
    let ripple = |a: f64| (a + one).cos() + second * ((1.0 + apart) * a + other).cos();
    each_pair(&angle, &rate, |a, r| r * ripple(a))
}

/// Behind the encoder a toothed belt drives the table. Where the motor changes its speed by too much the belt jumps, once or
/// twice running, and the table is left behind by a tooth each time. What it holds differs from place to place of the belt.
pub(super) fn tooth(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    const MOST: f64 = 2.0;
    programme(draw, stand, DWELL);
    let holds = draw.between(0.4, 0.8);
    let apart = (draw.between(0.1, 0.4) * stand.rate_hz).ceil() as usize;
    let mut jumps = vec![0.0; stand.samples()];
    let changes = changes(&stand.world.duty).into_iter().enumerate();
    for (i, change) in changes.filter(|(_, change)| *change != 0.0) {
        let here = holds * draw.between(0.4, 1.6);
        let teeth = (change.abs() / here).floor().min(MOST) as usize;
        for k in 0..teeth {
            add_at(&mut jumps, i + k * apart, [-change.signum()]);
        }
    }
    stand.lagged(&jumps, draw.by_ratio(0.08, 0.3))
}

/// Oil in the two halves of the gear's case sloshes when the table is made to turn faster or slower, and takes the table
/// with it: two pitches, as the halves are not of a length.
pub(super) fn slosh(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    programme(draw, stand, DWELL);
    let pushed = changes(&rate_of_table(draw, stand));
    let (pitch, apart) = (draw.by_ratio(0.5, 2.5), draw.between(1.2, 1.9));
    let (half_width, second) = (draw.by_ratio(0.01, 0.06), draw.between(0.3, 1.0));
    let [one, other] =
        [pitch, apart * pitch].map(|pitch| resonating(&pushed, (pitch, half_width), stand.rate_hz));
    each_pair(&one, &other, |a, b| a + second * b)
}

/// A table that creeps: the bearing sticks until the drive has wound up, then slips on by as much as it stood still. What
/// the rate is off from the one commanded.
pub(super) fn stick_slip(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    const CREEP: (f64, f64) = (0.04, 0.2);
    creeping(draw, stand, CREEP, (15.0, 60.0));
    // The time for which the slowest one sticks, s, and that of a slip.
    let (longest, slip) = (draw.by_ratio(2.0, 8.0), draw.by_ratio(0.1, 0.4));
    let slips = (slip * stand.rate_hz).round().max(1.0) as usize;
    let sum = (slips * (slips + 1)) as f64 / 2.0;
    let holds = |draw: &mut Draw| longest * CREEP.0 * stand.rate_hz * draw.between(0.5, 1.5);
    // How far the drive has wound up, at how much the bearing gives, and readings of the slip that are left.
    let (mut wound, mut gives, mut left) = (0.0, holds(draw), 0);
    let mut sense = 0.0;
    each(&stand.world.duty, |d| {
        // A drive that stands or turns back has to be wound up again.
        if d == 0.0 || d.signum() != sense {
            (wound, left, sense) = (0.0, 0, if d == 0.0 { 0.0 } else { d.signum() });
        }
        if d == 0.0 {
            return 0.0;
        }
        if left == 0 && wound >= gives {
            left = slips;
        }
        if left == 0 {
            wound += d.abs();
            return -d;
        }
        // A slip dies away as it goes.
        let goes = sense * wound * left as f64 / sum;
        left -= 1;
        if left == 0 {
            (wound, gives) = (0.0, holds(draw));
        }
        goes
    })
}

/// Cogging of the motor: so many ripples a turn, so that their pitch is the speed; slow ones are the larger, and none at
/// rest.
pub(super) fn cogging(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let rate = turned(draw, stand, DWELL);
    // Ripples per second at full duty; inertia is what counts beyond a corner.
    let (pitch, corner) = (draw.by_ratio(3.0, 9.5), draw.between(0.1, 0.3));
    let first = draw.phase();
    let angle = angle_of_table(&rate, pitch, stand.rate_hz);
    each_pair(&angle, &rate, |angle, r| {
        2.0 * r * corner / (r * r + corner * corner) * (first + angle).cos()
    })
}

/// A cable to the table that has some slack: wound up further, either way, it pulls the part askew, the more the further.
/// The programme turns to and fro, now further and now less far.
pub(super) fn cable(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    // In turns, and turns per second at full duty.
    let (far, full) = (draw.by_ratio(0.2, 0.5), draw.by_ratio(0.2, 0.5));
    let (mut angle, mut sense) = (0.0, draw.sign());
    let mut duty = Vec::with_capacity(stand.samples());
    while duty.len() < stand.samples() {
        let level = in_steps(draw.between(0.3, 1.0));
        let to = far * draw.between(0.4, 1.0);
        while sense * angle < to {
            duty.push(sense * level);
            angle += full * sense * level / stand.rate_hz;
        }
        sense = -sense;
    }
    duty.truncate(stand.samples());
    stand.world.duty = duty;
    let rate = rate_of_table(draw, stand);
    let angle = about_mean(&angle_of_table(&rate, full, stand.rate_hz));
    let (slack, sign) = (TAU * far * draw.between(0.3, 0.6), draw.sign());
    about_mean(&each(&angle, |a| {
        sign * a.signum() * (a.abs() - slack).max(0.0)
    }))
}

/// A heavy table on a soft belt, by its equation of motion: friction holds it until the belt is tight, and is less once it
/// turns (Stribeck), so that it jerks where it is to turn slowly. What the rate is off the one commanded.
pub(super) fn friction(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    const CREEP: (f64, f64) = (0.03, 0.15);
    // Steps of the reckoning for each reading: many for a belt that swings a few times a second.
    const FINE: usize = 20;
    creeping(draw, stand, CREEP, (8.0, 40.0));
    let stiff = (TAU * draw.by_ratio(0.8, 2.5)).powi(2);
    // What is left of the friction at speed, and how far the belt gives before the table does, in seconds of the least creep.
    let (left, gives) = (draw.between(0.3, 0.7), draw.by_ratio(1.0, 4.0));
    let (holds, fades) = (stiff * CREEP.0 * gives, draw.by_ratio(0.02, 0.08));
    let loss = 2.0 * draw.between(0.05, 0.2) * stiff.sqrt();
    let step = 1.0 / stand.rate_hz / FINE as f64;
    let (mut tight, mut turns, mut rough) = (0.0f64, 0.0f64, 1.0);
    each(&stand.world.duty, |drive| {
        let mut mean = 0.0;
        for _ in 0..FINE {
            tight += (drive - turns) * step;
            let pull = stiff * tight + loss * (drive - turns);
            if turns == 0.0 {
                if pull.abs() > holds * rough {
                    // It has begun to, and no more.
                    turns = pull.signum() * f64::MIN_POSITIVE;
                }
            } else {
                let less = left + (1.0 - left) * (-turns.abs() / fades).exp();
                let next = turns + (pull - turns.signum() * holds * rough * less) * step;
                // It comes to rest where it would turn back; the next place is as rough as it is.
                if next * turns < 0.0 {
                    (turns, rough) = (0.0, draw.between(0.7, 1.3));
                } else {
                    turns = next;
                }
            }
            mean += turns / FINE as f64;
        }
        mean - drive
    })
}

/// A toothed belt between the motor, which has the encoder, and the table: each change of the rate twists it and it swings
/// out, and each tooth that comes on the pulley pushes it, the harder the nearer their pitch is to that of the swing.
pub(super) fn belt(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let rate = turned(draw, stand, DWELL);
    let teeth = angle_of_table(&rate, draw.by_ratio(2.0, 9.0), stand.rate_hz);
    let height = draw.by_ratio(0.005, 0.03);
    let bumps = each(&teeth, |a| height * a.cos());
    let pushed = each_pair(&changes(&rate), &changes(&bumps), |r, b| r + b);
    let mode = (draw.by_ratio(0.6, 3.0), draw.by_ratio(0.04, 0.2));
    resonating(&pushed, mode, stand.rate_hz)
}

/// The cable chain beside the table lays down its links one by one, at equal angles: each is a kick as large as the link is
/// loose, forward when it is laid down and backward when it is taken up, and no harder the faster the table turns.
pub(super) fn chain(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let rate = turned(draw, stand, DWELL);
    // Links a second at full duty.
    let angle = angle_of_table(&rate, draw.by_ratio(0.8, 4.0), stand.rate_hz);
    let links = passes(&angle, 1.0, draw.between(0.0, 1.0));
    let kicks = each_pair(&links, &rate, |link, r| {
        link * r.signum() * draw.between(0.6, 1.4)
    });
    let mode = (draw.between(1.5, 8.0), draw.by_ratio(0.4, 2.0));
    resonating(&kicks, mode, stand.rate_hz)
}

/// A table out of balance whose axis leans: its weight drives it on the one half of the turn and holds it on the other, and
/// a motor that nothing regulates gives way. What the rate is off the one commanded.
pub(super) fn unbalanced(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    programme(draw, stand, DWELL);
    let (takes, full) = (draw.by_ratio(0.3, 1.5), draw.by_ratio(0.15, 0.8));
    let (weight, first) = (draw.by_ratio(0.02, 0.08), draw.phase());
    let even = stand.lagged(&stand.world.duty, takes);
    let gain = 1.0 - (-1.0 / (takes * stand.rate_hz)).exp();
    let (mut rate, mut angle) = (stand.world.duty[0], first);
    each_pair(&stand.world.duty, &even, |drive, even| {
        // A worm gear holds it where the motor rests.
        let falls = if drive == 0.0 { 0.0 } else { angle.sin() };
        rate += gain * (drive + weight * falls - rate);
        angle += TAU * full * rate / stand.rate_hz;
        rate - even
    })
}

/// The structure that carries the motor has a mode, little damped, that each change of its torque strikes.
pub(super) fn structure(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    programme(draw, stand, DWELL);
    let mode = (draw.by_ratio(0.8, 9.0), draw.by_ratio(0.03, 0.3));
    resonating(&changes(&stand.world.duty), mode, stand.rate_hz)
}

/// A chipped ball of the table's bearing strikes the races at fixed angles, a few times a turn and never a whole number, the
/// harder the faster; each stroke is a short ring of the bearing.
pub(super) fn chipped(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let rate = turned(draw, stand, DWELL);
    let (full, per_turn) = (draw.by_ratio(0.4, 1.2), draw.between(2.2, 5.8));
    let angle = angle_of_table(&rate, full, stand.rate_hz);
    let strokes = passes(&angle, per_turn, draw.between(0.0, 1.0));
    let hard = each_pair(&strokes, &rate, |s, r| s * r);
    let mode = (draw.between(2.0, 8.0), draw.by_ratio(0.8, 2.5));
    resonating(&hard, mode, stand.rate_hz)
}

/// A toothed wheel or a pulley out of centre: the table runs ahead and behind by a share of its rate, which the encoder on
/// the motor does not see, once a turn, and by less twice and thrice.
pub(super) fn gear(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let rate = turned(draw, stand, DWELL);
    let full = draw.by_ratio(0.1, 0.6);
    let waves: [(f64, f64); 3] = std::array::from_fn(|k| {
        let most = if k == 0 { 1.0 } else { draw.between(0.1, 0.5) };
        (most, draw.phase())
    });
    let angle = angle_of_table(&rate, full, stand.rate_hz);
    let ahead = |angle: f64| -> f64 {
        let wave = |(k, (size, first)): (f64, &(f64, f64))| size * (k * angle + first).cos();
        [1.0, 2.0, 3.0].into_iter().zip(&waves).map(wave).sum()
    };
    each_pair(&angle, &rate, |a, r| r * ahead(a))
}

/// A mass that is not balanced about the table's axis: the bias goes with the angular acceleration. The table's drive ramps
/// from rate to rate, and its shaft winds up and unwinds, so that the acceleration comes and goes softly.
pub(super) fn acceleration(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let drive = ramped_table(draw, stand);
    let rate = stand.lagged(&drive, draw.by_ratio(0.2, 0.8));
    either_way(draw, &changes(&rate))
}

/// Commands of a table that creeps, which the stand gets, each for a random time, s; it rests now and then.
fn creeping(draw: &mut Draw, stand: &mut Stand, creep: (f64, f64), dwell_s: (f64, f64)) {
    stand.world.duty = stand.held(draw, dwell_s, |d| {
        d.zero_or(0.2, |d| in_steps(d.sign() * d.by_ratio(creep.0, creep.1)))
    });
}
