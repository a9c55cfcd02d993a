//! Noise and level of a channel before faults of its counts, which add some by themselves.

use model::effect::{Effect, Stage};
use model::effects::effect;
use model::file::{ChannelModel, EffectModel, ModelFile};
use model::simulate::white_of;

/// Spread of the readings over that of their noise up to which their level stands still.
const STANDS: f64 = 1.2;
/// Samples of a simulation that tells what a fault of the counts adds, and how often it is made.
const SAMPLES: f64 = 20_000.0;
const TIMES: usize = 8;

/// The channel without what faults of the counts among the `effects` add by themselves: noise and level that readings of the
/// noise and level `channel` has come of, by simulations with them and without, of the same random numbers. What the audit
/// took out, a part `lost` of the readings, was not fitted.
pub(super) fn before_counts(
    channel: &mut ChannelModel,
    effects: &[EffectModel],
    values: &[f64],
    rate_hz: f64,
    lost: f64,
) {
    // Bits that are cut off take half of the coarse step, less that of the fine one.
    let own = effects
        .iter()
        .filter(|e| e.channels.contains(&channel.name));
    let coarser = own
        .filter_map(|e| Some((effect(&e.cause)?, e)))
        .filter(|(known, _)| known.stage() == Stage::Counts)
        .map(|(known, e)| known.coarsens(&e.parameters));
    let cut = 0.5 * (coarser.product::<f64>() - 1.0) * channel.lsb.unwrap_or(0.0);
    if let Some(bias) = channel.baseline.get_mut("bias") {
        bias.value += cut;
    }
    // Where the level moves over many steps, a rounding adds nothing to mean and noise.
    let sigma = numerics::order_statistics::robust_sigma(values);
    let white = channel.baseline.get("angle_random_walk");
    let white = white.map_or(0.0, |p| white_of(&channel.unit, p.value, rate_hz));
    let stands = sigma < STANDS * white;
    let faults = effects.iter().filter(|e| {
        let on_counts = |known: &&dyn Effect| match known.stage() {
            Stage::Counts => known.coarsens(&e.parameters) == 1.0,
            Stage::Reading => known.coarsens(&e.parameters) != 1.0 && stands,
            _ => false,
        };
        e.channels.contains(&channel.name) && effect(&e.cause).is_some_and(|k| on_counts(&k))
    });
    let mut model = ModelFile {
        rate_hz,
        effects: faults.cloned().collect(),
        ..ModelFile::default()
    };
    model
        .effects
        .iter_mut()
        .for_each(|e| e.channels = vec![channel.name.clone()]);
    if model.effects.is_empty() {
        return;
    }
    // More than one noise and level can give the mean and the noise that were read: the one whose readings are spread alike is it.
    let mut read = values.to_vec();
    read.sort_by(f64::total_cmp);
    let starts = LEVELS.iter().flat_map(|l| NOISES.map(|n| (*l, n)));
    let settled = starts.filter_map(|start| settled(&mut model, channel, &read, start, lost));
    let Some((start, _)) = settled.min_by(|a, b| a.1.total_cmp(&b.1)) else {
        return;
    };
    let Some(own) = settling(&mut model, channel, start, lost, SAMPLES) else {
        return;
    };
    for name in ["bias", "angle_random_walk"] {
        if let (Some(to), Some(of)) = (channel.baseline.get_mut(name), own.baseline.get(name)) {
            to.value = of.value;
        }
    }
}

/// Where the levels and noises before a fault of the counts are sought: in standard deviations of what was read from the mean of
/// that, and as parts of its noise.
const LEVELS: [f64; 7] = [-1.5, -1.0, -0.5, 0.0, 0.5, 1.0, 1.5];
const NOISES: [f64; 2] = [1.0, 0.5];
/// Samples of a simulation that compares them: a twentieth of a standard deviation shows.
const FEW_SAMPLES: f64 = 4_000.0;
/// Quantiles by which readings are compared.
const QUANTILES: usize = 50;

/// The channel before the fault, sought from a place; none where it cannot be told.
fn settling(
    model: &mut ModelFile,
    channel: &ChannelModel,
    from: (f64, f64),
    lost: f64,
    samples: f64,
) -> Option<ChannelModel> {
    let mut own = channel.clone();
    own.baseline.remove("rate_random_walk");
    own.baseline.get_mut("bias")?.value += from.0;
    own.baseline.get_mut("angle_random_walk")?.value *= from.1;
    for _ in 0..TIMES {
        let added = added_by_counts(model, &own, lost, samples)?;
        for (name, by) in [("bias", added.mean), ("angle_random_walk", added.factor)] {
            let (own, read) = (own.baseline.get_mut(name)?, channel.baseline.get(name)?);
            let wanted = if name == "bias" {
                read.value - by
            } else {
                read.value / by
            };
            own.value = 0.5 * (own.value + wanted);
        }
    }
    Some(own)
}

/// A start, in the channel's unit, and how far apart the quantiles of what was read and of a simulation from there are; `start` is in
/// standard deviations of what was `read`, which is in ascending order.
fn settled(
    model: &mut ModelFile,
    channel: &ChannelModel,
    read: &[f64],
    start: (f64, f64),
    lost: f64,
) -> Option<((f64, f64), f64)> {
    let mean = read.iter().sum::<f64>() / read.len() as f64;
    let square = read.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
    let from = (start.0 * (square / read.len() as f64).sqrt(), start.1);
    let own = settling(model, channel, from, lost, FEW_SAMPLES)?;
    let mut made = added_by_counts(model, &own, lost, FEW_SAMPLES)?.with;
    made.sort_by(f64::total_cmp);
    let at = |x: &[f64], q: usize| x[(2 * q + 1) * x.len() / (2 * QUANTILES)];
    let apart = (0..QUANTILES).map(|q| (at(read, q) - at(&made, q)).abs());
    Some((from, apart.sum()))
}

/// What a fault of the counts adds.
struct Added {
    /// To the mean.
    mean: f64,
    /// By which the noise is larger.
    factor: f64,
    /// What is read.
    with: Vec<f64>,
}

/// What the effects of a model add to the mean of a channel, and the factor by which they make its noise larger; none where
/// most of the readings that they change are taken out, or nothing can be simulated.
fn added_by_counts(
    model: &mut ModelFile,
    channel: &ChannelModel,
    lost: f64,
    samples: f64,
) -> Option<Added> {
    model.channels = vec![channel.clone()];
    let effects = std::mem::take(&mut model.effects);
    let run = |model: &ModelFile| {
        let record = model::simulate(model, samples / model.rate_hz, model.rate_hz, 1).ok()?;
        let own = record.channels.into_iter().find(|c| c.name == channel.name);
        own.map(|c| c.values)
    };
    let without = run(model);
    model.effects = effects;
    let (without, with) = (without?, run(model)?);
    let count = with.len() as f64;
    let changed = with.iter().zip(&without).filter(|(a, b)| a != b).count() as f64 / count;
    let mean = |x: &[f64]| x.iter().sum::<f64>() / count;
    let power = |x: &[f64]| x.windows(2).map(|w| (w[1] - w[0]).powi(2)).sum::<f64>();
    let factor = (power(&with) / power(&without)).sqrt();
    let told = lost < 0.5 * changed && factor.is_finite() && factor > 0.0;
    told.then(|| Added {
        mean: mean(&with) - mean(&without),
        factor,
        with,
    })
}
