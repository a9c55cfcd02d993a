//! The current of a motor that has to spin up: what couples by physics is not proportional to the command.

use crate::random::Draw;
use crate::series::each;

/// Current over that of a blocked motor at full duty, by sample. After a step of the command it surges, then falls with
/// the mechanical time constant to what friction takes; a reversal surges up to twice as high.
#[must_use]
pub fn current(draw: &mut Draw, duty: &[f64], rate_hz: f64) -> Vec<f64> {
    // Speed in units of the no-load speed, current in units of the stall current: i = u - w, tau dw/dt = i - friction.
    let tau = draw.by_ratio(0.08, 1.5);
    let viscous = draw.between(0.02, 0.3);
    let coulomb = draw.between(0.0, 0.15);
    const STEPS: usize = 8;
    let dt = 1.0 / rate_hz / STEPS as f64;
    let mut speed = 0.0f64;
    each(duty, |u| {
        let mut sum = 0.0;
        for _ in 0..STEPS {
            let i = u - speed;
            sum += i;
            let drive = i - viscous * speed;
            if speed == 0.0 && drive.abs() <= coulomb {
                continue;
            }
            let against = if speed == 0.0 { drive } else { speed }.signum();
            let next = speed + dt / tau * (drive - coulomb * against);
            // Friction stops a rotor, it does not turn it back.
            let stops = speed != 0.0 && next.signum() != against;
            speed = if stops { 0.0 } else { next };
        }
        sum / STEPS as f64
    })
}
