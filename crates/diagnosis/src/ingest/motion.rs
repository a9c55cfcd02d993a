//! Motion of the base: how much of it an axis sees, and whether it only follows another one.

use std::ops::Range;

use model::effect::Signal;
use model::effects::shock::LONGEST_S;
use model::record::Quantity;

use crate::fit::likelihood::Dct;
use crate::ingest::base_turns::{Excursion, MOTION_RMS, excursions, largest_rate, overlap};
use crate::ingest::handled::handled;
use crate::ingest::types::Target;

/// Largest share of another axis' rate that a gyro sees by its own fault: a mounting off by six degrees.
pub(crate) const LARGEST_SHARE: f64 = 0.1;

pub(crate) const MOTION_BAND_HZ: (f64, f64) = (0.02, 0.6);

/// What the motion of an axis is made of, deg/s rms.
pub(crate) struct Rest {
    /// What follows the axis that turns most; all of it, where that is not known.
    pub follows: f64,
    /// What does not.
    pub own: f64,
    /// Whether a table turns that axis, and no other.
    pub table: bool,
}

/// An axis that only follows the one that turns most, and little of it, is not moved itself: its gyro sees a part of the
/// other axis.
pub(crate) fn followers(targets: &mut [Target], rest: &dyn Fn(&Target, &Target) -> Rest) {
    let Some(strongest) =
        (0..targets.len()).max_by(|a, b| targets[*a].motion_rms.total_cmp(&targets[*b].motion_rms))
    else {
        return;
    };
    let most = LARGEST_SHARE * targets[strongest].motion_rms;
    for i in (0..targets.len()).filter(|i| *i != strongest) {
        let t = &targets[i];
        if !t.moving {
            continue;
        }
        let rest = rest(t, &targets[strongest]);
        let little = rest.follows < most;
        targets[i].moving = !(little && rest.own <= MOTION_RMS);
        targets[i].astray = rest.table && little && targets[i].moving;
    }
}

/// Half cycles of the slowest motion that is looked for where the header says that the base moves.
pub(crate) const SLOWEST_MOTION: usize = 3;

/// Place of a frequency among `n` coefficients.
pub(crate) fn places_of(hz: f64, n: usize, rate_hz: f64) -> usize {
    ((2.0 * hz / rate_hz * n as f64) as usize).clamp(1, n - 1)
}

/// Excess rms in the band of base motion, white noise and what follows the `drivers` taken off. Where the base is known to
/// move (`turns`), slower motion counts too; else that is drift.
pub(crate) fn motion(
    c: &mut [f64],
    drivers: &[Vec<f64>],
    n: usize,
    rate_hz: f64,
    turns: bool,
) -> f64 {
    let k_of = |f: f64| places_of(f, n, rate_hz);
    let (mut low, high) = (k_of(MOTION_BAND_HZ.0), k_of(MOTION_BAND_HZ.1));
    if turns {
        low = low.min(SLOWEST_MOTION);
    }
    let mut above: Vec<f64> = c[high..].iter().map(|v| v * v).collect();
    let middle = above.len() / 2;
    let white = if above.is_empty() {
        0.0
    } else {
        *above.select_nth_unstable_by(middle, f64::total_cmp).1 / numerics::tails::MEDIAN
    };
    take_off(c, drivers, low..high);
    let band = &c[low..high];
    let excess: f64 = band.iter().map(|v| v * v - white).sum();
    (excess.max(0.0) / n as f64).sqrt()
}

/// Takes off coefficients what follows the drivers, by what is in the band.
pub(crate) fn take_off(c: &mut [f64], drivers: &[Vec<f64>], band: Range<usize>) {
    let dot = |a: &[f64], b: &[f64]| {
        let pairs = a[band.clone()].iter().zip(&b[band.clone()]);
        pairs.map(|(a, b)| a * b).sum::<f64>()
    };
    let less = |c: &mut [f64], share: f64, o: &[f64]| {
        c.iter_mut().zip(o).for_each(|(c, o)| *c -= share * o);
    };
    let mut orthogonal: Vec<Vec<f64>> = vec![];
    for driver in drivers {
        let mut x = driver.clone();
        let before = dot(&x, &x);
        for o in &orthogonal {
            let share = dot(&x, o);
            less(&mut x, share, o);
        }
        let length = dot(&x, &x);
        // What is left of a driver that the others make up is rounding.
        if length <= 1e-9 * before.max(f64::MIN_POSITIVE) {
            continue;
        }
        x.iter_mut().for_each(|x| *x /= length.sqrt());
        let share = dot(c, &x);
        less(c, share, &x);
        orthogonal.push(x);
    }
}

/// Turns of a base at rest that a gyro felt, without those of which what drives its bias makes up most.
pub(crate) fn felt(y: &[f64], others: &[Signal], rate_hz: f64, dct: &Dct) -> Vec<Excursion> {
    let mut found = excursions(y, rate_hz);
    // One turn is told best by its shape; where it is but a part of what was done, by all of it.
    for more in handled(y, rate_hz) {
        let holds = |e: &Excursion| {
            let own = e.with_margin(y.len());
            own.start <= more.samples.start && more.samples.end <= own.end
        };
        if !found.iter().any(holds) {
            found.retain(|e| !overlap(&e.samples, &more.samples));
            found.push(more);
        }
    }
    found.sort_by_key(|e| e.samples.start);
    // What is over sooner is a blow; the ends of a half sine may be found a third too far apart.
    found.retain(|e| e.samples.len() as f64 >= 4.0 / 3.0 * LONGEST_S * rate_hz);
    let drivers = others.iter().filter(|s| drives(s.quantity));
    if found.is_empty() || drivers.clone().next().is_none() {
        return found;
    }
    let drivers: Vec<Vec<f64>> = drivers.map(|s| dct.forward(&s.smooth)).collect();
    let mut c = dct.forward(y);
    let [low, high] = [MOTION_BAND_HZ.0, MOTION_BAND_HZ.1].map(|f| places_of(f, y.len(), rate_hz));
    take_off(&mut c, &drivers, low..high);
    let beyond = dct.inverse(&c);
    found.retain(|e| largest_rate(&beyond, &e.samples) > 0.5 * largest_rate(y, &e.samples));
    found
}

/// Whether a quantity can drive a gyro's bias.
pub(crate) fn drives(quantity: Quantity) -> bool {
    use Quantity::{Other, Pwm, Supply, Temp};
    matches!(quantity, Temp | Supply | Pwm | Other)
}
