//! Channels as the effects see them: values without gaps, and smoothed.

use super::*;

/// What a gyro reads, to the effects of the others.
pub(super) fn of_gyro(c: &Channel, target: &Target) -> Signal {
    Signal {
        name: c.name.clone(),
        quantity: c.quantity,
        axis: c.axis,
        unit: c.unit.clone(),
        values: Arc::clone(&target.y),
        smooth: Arc::clone(&target.y),
        lsb: c.lsb,
        moving: target.moving,
    }
}

/// A channel that is no gyro, and the coefficients of what can drive a gyro's bias: motor command, supply, temperatures, and
/// what is none of these.
pub(super) fn other(
    c: &Channel,
    places: &[usize],
    n: usize,
    dct: &Dct,
    bins: &Arc<Bins>,
) -> (Signal, Option<Arc<Vec<f64>>>) {
    let read = spread(&c.values, places, n, &[]);
    let values = Arc::new(interpolated(&read));
    let is_noisy = matches!(
        c.quantity,
        Quantity::Temp | Quantity::Supply | Quantity::Other
    );
    let coefficients = drives(c.quantity).then(|| Arc::new(dct.forward(&values)));
    let step = || c.lsb.unwrap_or_else(|| smallest_step(few(&c.values)));
    let smooth = coefficients.as_ref().filter(|_| is_noisy);
    let smooth = smooth
        .and_then(|c| dequantise::smoothed(&read, step()).or_else(|| smoothed(c, dct, bins)))
        .map(Arc::new);
    let signal = Signal {
        name: c.name.clone(),
        quantity: c.quantity,
        axis: c.axis,
        unit: c.unit.clone(),
        smooth: smooth.unwrap_or_else(|| Arc::clone(&values)),
        values,
        lsb: c.lsb,
        moving: false,
    };
    (signal, coefficients)
}

/// The level of a local-level model fitted to readings of these coefficients, every one shrunk by the random walk's share;
/// none where the readings never change.
fn smoothed(coefficients: &Arc<Vec<f64>>, dct: &Dct, bins: &Arc<Bins>) -> Option<Vec<f64>> {
    if coefficients[1..].iter().all(|v| v.abs() < 1e-9) {
        return None;
    }
    let panel = Panel::of(dct, bins, Arc::clone(coefficients));
    let (noise, _) = panel.fit(&Noise::new(-12.0), &[]);
    let mut c = coefficients.to_vec();
    let g = noise.everywhere(bins);
    for (v, g) in c.iter_mut().zip(g).skip(1) {
        *v *= 1.0 - 1.0 / g;
    }
    Some(dct.inverse(&c))
}
