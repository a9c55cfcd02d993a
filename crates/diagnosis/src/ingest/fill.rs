//! Lost readings, filled before the search by the spectrum that the others have.

use std::sync::Arc;

use rand_core::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::fit::likelihood::{Noise, Panel};
use crate::ingest::conditional_draw;
use numerics::tails;

/// Share of the readings below which what is lost makes nothing smaller that its error would show.
pub(crate) const LEAST: f64 = 5e-3;

/// The same by the spectrum: where the noise is filtered, more of what tells of it is lost.
pub(crate) const SPECTRUM_PASSES: usize = 8;

/// Fewest coefficients of a band of the spectrum, and its width over its frequency.
pub(crate) const LEAST_BAND: usize = 32;

pub(crate) const BAND_WIDTH: f64 = 0.2;

/// Whether so many are lost of `n` that they are filled again.
pub(crate) fn many(lost: &[usize], n: usize) -> bool {
    lost.len() as f64 >= LEAST * n as f64
}

/// Draws of a channel: the same ones every time, for it is to converge, and others for each channel.
pub(crate) fn draws(channel: &str) -> Xoshiro256PlusPlus {
    let seed = |s: u64, byte| (s ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
    Xoshiro256PlusPlus::seed_from_u64(channel.bytes().fold(0x7265_6669_6c6c, seed))
}

/// Precision of every coefficient: of the noise, by the median of what the data have of it in bands, which lines hardly
/// move.
pub(crate) fn by_spectrum(panel: &Panel, noise: &Noise, white: f64) -> Vec<f64> {
    let (n, c) = (panel.bins.n, panel.column(0));
    let g = noise.everywhere(&panel.bins);
    let mut bands: Vec<(f64, f64)> = vec![];
    let mut start = 1;
    while start < n {
        let mut end = start + LEAST_BAND.max((BAND_WIDTH * start as f64) as usize);
        if n < end + LEAST_BAND {
            end = n;
        }
        let mut ratios: Vec<f64> = (start..end).map(|k| c[k] * c[k] / (white * g[k])).collect();
        let middle = ratios.len() / 2;
        let (_, median, _) = ratios.select_nth_unstable_by(middle, f64::total_cmp);
        let ratio = (*median / tails::MEDIAN).max(f64::MIN_POSITIVE);
        bands.push(((0.5 * (start + end) as f64).ln(), ratio.ln()));
        start = end;
    }
    let mut at = 0;
    let mut ratio = |k: usize| {
        let x = (k.max(1) as f64).ln();
        while at + 2 < bands.len() && bands[at + 1].0 < x {
            at += 1;
        }
        let (a, b) = (bands[at], bands[(at + 1).min(bands.len() - 1)]);
        let part = ((x - a.0) / (b.0 - a.0).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        (a.1 + part * (b.1 - a.1)).exp()
    };
    (0..n).map(|k| (white * g[k] * ratio(k)).recip()).collect()
}

/// Fills the lost readings of `y`, the data of a panel, by the spectrum of all, and fits white noise and a random walk again.
/// Returns the coefficients.
pub(crate) fn first(
    channel: &str,
    mut panel: Panel,
    y: &mut [f64],
    lost: &[usize],
    fit: &mut (Noise, f64),
) -> Arc<Vec<f64>> {
    if many(lost, y.len()) {
        for _ in 0..SPECTRUM_PASSES {
            let precision = by_spectrum(&panel, &fit.0, fit.1);
            conditional_draw::fill(&panel.dct, &precision, y, lost, &mut draws(channel));
            panel = Panel::new(&panel.dct, &panel.bins, y);
        }
        let (noise, solution) = panel.fit(&Noise::new(-12.0), &[]);
        *fit = (noise, solution.white);
    }
    panel.column(0)
}
