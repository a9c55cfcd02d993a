//! Power in bands, correlations and slopes, from one cosine transform.

use model::record::{Quantity, Record};
use rustfft::num_complex::Complex;

use super::deviations::short;
use super::{Statistic, Subject};
use crate::replicates::world::Parts;
use numerics::column::dot;
use numerics::transform::{Dct, RealFft};

/// Bands in an octave, and fewest coefficients in one.
const BANDS: i32 = 3;
const LEAST: usize = 4;
/// Lags that are compared one by one; of all others the largest.
const LAGS: usize = 5;
/// Part of the band, from below, in which axes are held against each other once more: what is shared may be slow.
const SLOW: usize = 16;

/// White noise and a random walk are independent in the coefficients of the DCT-II, of variances 1 and
/// walk / (2 - 2 cos w): divided by their root, what is left is white.
pub(super) struct Spectrum {
    length: usize,
    rate_hz: f64,
    /// First coefficients of the bands, and the end of the last.
    edges: Vec<usize>,
}

/// The transforms, each with room of its own.
pub(super) struct Transforms {
    dct: Dct,
    fft: RealFft,
}

/// What the transform gave of one channel.
pub(super) struct Whitened {
    /// Coefficients over their baseline's standard deviation in units of the white one, of all stretches.
    coefficients: Vec<f64>,
    /// Mean square of the coefficients themselves in each band times its width over the length.
    bands: Vec<f64>,
}

impl Spectrum {
    pub fn new(length: usize, rate_hz: f64) -> Self {
        let mut edges = vec![length];
        for j in 1.. {
            let edge =
                (length as f64 * 2f64.powf(-f64::from(j) / f64::from(BANDS))).round() as usize;
            if edges[edges.len() - 1] < edge + LEAST || edge < LEAST {
                break;
            }
            edges.push(edge);
        }
        edges.push(1);
        edges.reverse();
        Self {
            length,
            rate_hz,
            edges,
        }
    }

    pub fn transforms(&self) -> Transforms {
        Transforms {
            dct: Dct::new(self.length),
            fft: RealFft::new(self.length),
        }
    }

    /// One over the root of the baseline's density at each coefficient, in units of the white one.
    pub fn whitener(&self, walk: f64) -> Vec<f64> {
        let turn = std::f64::consts::PI / self.length as f64;
        let density = |k: usize| 1.0 + walk / (2.0 - 2.0 * (turn * k as f64).cos());
        let each = (0..self.length).map(|k| {
            if k == 0 {
                0.0
            } else {
                density(k).sqrt().recip()
            }
        });
        each.collect()
    }

    pub fn of(&self, x: &[f64], white: &[f64], by: &Transforms) -> Whitened {
        let mut coefficients = Vec::with_capacity(x.len());
        let mut bands = vec![0.0; self.edges.len() - 1];
        for c in by.dct.forward_all(x.chunks_exact(self.length)) {
            for (band, edge) in bands.iter_mut().zip(self.edges.windows(2)) {
                let some = &c[edge[0]..edge[1]];
                *band += dot(some, some);
            }
            coefficients.extend(c.iter().zip(white).map(|(c, w)| c * w));
        }
        bands.iter_mut().for_each(|b| *b /= x.len() as f64);
        Whitened {
            coefficients,
            bands,
        }
    }

    pub fn name(&self, unit: &str, all: &mut Vec<Statistic>) {
        let hz = |k: usize| short(0.5 * self.rate_hz * k as f64 / self.length as f64);
        for edge in self.edges.windows(2) {
            let from = if edge[0] > 1 { hz(edge[0]) } else { "0".into() };
            let top = 0.5 * self.rate_hz * edge[1] as f64 / self.length as f64;
            let what = format!("rms from {from} to {} Hz", hz(edge[1]));
            all.push(Statistic::new(what, unit).below(top));
        }
        all.push(Statistic::new("amplitude of the strongest line", unit));
        for lag in 1..=LAGS {
            let plural = if lag > 1 { "s" } else { "" };
            all.push(Statistic::new(
                format!("correlation at a lag of {lag} sample{plural}"),
                "1",
            ));
        }
        all.push(Statistic::new(
            format!("largest correlation beyond {LAGS} samples"),
            "1",
        ));
    }

    pub fn take(&self, of: &Whitened, by: &Transforms, all: &mut Vec<f64>) {
        all.extend(of.bands.iter().map(|b| b.sqrt()));
        all.push(self.strongest_line(of));
        let (single, largest) = self.correlations(of, &by.fft);
        all.extend(single);
        all.push(largest);
    }

    /// A tone has its energy, a quarter of N A^2 in each, in two neighbouring coefficients; below the random walk's corner it
    /// is whitened with that.
    fn strongest_line(&self, of: &Whitened) -> f64 {
        let mut energies = vec![0.0; self.length];
        for u in of.coefficients.chunks_exact(self.length) {
            energies.iter_mut().zip(u).for_each(|(e, u)| *e += u * u);
        }
        let pairs = energies.windows(2).map(|e| e[0] + e[1]);
        let most = pairs.fold(0.0, f64::max);
        (2.0 * most / of.coefficients.len() as f64).sqrt()
    }

    /// Correlation of the whitened record with itself, mirrored at its ends, at the single lags, and the largest beyond.
    ///
    /// The energies u[k]^2 at even k, smoothed over their neighbours, are those of a circular record of the same length:
    /// their transform is the correlation at each lag l, tapered by (1 + cos(pi l / n)) / 2, up to half the length.
    fn correlations(&self, of: &Whitened, fft: &RealFft) -> ([f64; LAGS], f64) {
        let (n, half) = (self.length, self.length / 2);
        let mut energies = vec![0.0; half + 1];
        for u in of.coefficients.chunks_exact(n) {
            let square = |k: usize| u.get(k).map_or(0.0, |u| u * u);
            for (j, e) in energies.iter_mut().enumerate().skip(1) {
                *e += square(2 * j - 1) + 2.0 * square(2 * j) + square(2 * j + 1);
            }
            energies[0] += 2.0 * square(1);
        }
        // Twice what is inside, and the end once.
        let at = |j: usize| energies[j.min(n - j)];
        let (mut power, mut single, mut largest) = (1.0, [0.0; LAGS], 0.0f64);
        let mut rest = Vec::with_capacity(half);
        fft.run(
            |j| Complex::new(at(2 * j), at(2 * j + 1)),
            |lag, f| match lag {
                0 => power = f.re,
                1..=LAGS => single[lag - 1] = f.re,
                _ => rest.push(f.re),
            },
        );
        for r in rest {
            largest = largest.max(r.abs());
        }
        (single.map(|r| r / power), largest / power)
    }

    /// Weighted slopes on what was recorded beside the gyros.
    pub fn slopes(&self, subject: &Subject, record: &Record, parts: &Parts) -> Slopes {
        let dct = Dct::new(self.length);
        let white = self.whitener(subject.walk);
        let axis = record.channel(&subject.name).and_then(|c| c.axis);
        let mut slopes = Slopes {
            names: vec![],
            columns: vec![],
        };
        let own = |c: &&model::record::Channel| match c.quantity {
            Quantity::Temp => c.axis.is_none() || c.axis == axis,
            other => other != Quantity::Gyro,
        };
        for channel in record.channels.iter().filter(own) {
            let values = parts.pick(&channel.values);
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            let linear: Vec<f64> = values.iter().map(|v| v - mean).collect();
            let what = format!("slope over {}", channel.name);
            self.add(&mut slopes, (what, &channel.unit), &linear, &white, &dct);
            if channel.quantity != Quantity::Acc {
                let square: Vec<f64> = linear.iter().map(|v| v * v).collect();
                let (what, unit) = (
                    format!("curvature over {}", channel.name),
                    format!("{}^2", channel.unit),
                );
                self.add(&mut slopes, (what, &unit), &square, &white, &dct);
            }
        }
        slopes
    }

    /// Adds a column, where it changes.
    fn add(
        &self,
        slopes: &mut Slopes,
        (what, unit): (String, &str),
        values: &[f64],
        white: &[f64],
        dct: &Dct,
    ) {
        let mut column = vec![];
        for c in dct.forward_all(values.chunks_exact(self.length)) {
            column.extend(c.iter().zip(white).map(|(c, w)| c * w));
        }
        let square = dot(&column, &column);
        let raw: f64 = values.iter().map(|v| v * v).sum();
        // Beyond rounding.
        if square > 1e-12 * raw && raw > 0.0 {
            column.iter_mut().for_each(|c| *c /= square);
            slopes.names.push((what, unit.to_owned()));
            slopes.columns.push(column);
        }
    }

    pub fn name_with(&self, other: &str, all: &mut Vec<Statistic>) {
        let top = short(0.5 * self.rate_hz / SLOW as f64);
        let both = format!("correlation with {other}");
        all.push(Statistic::new(both.as_str(), "1").with(other));
        all.push(Statistic::new(format!("{both} below {top} Hz"), "1").with(other));
    }

    /// Correlations of each pair, by the place of the one and then of the other: of the whole band, and of its slow part.
    pub fn correlated(&self, all: &[Whitened]) -> Vec<Vec<[f64; 2]>> {
        let tops = [self.length, self.length / SLOW];
        let product = |one: &Whitened, other: &Whitened| {
            tops.map(|top| {
                let pairs = one.coefficients.chunks_exact(self.length);
                let pairs = pairs.zip(other.coefficients.chunks_exact(self.length));
                pairs.fold(0.0, |sum, (a, b)| sum + dot(&a[..top], &b[..top]))
            })
        };
        let own: Vec<[f64; 2]> = match all {
            // Nothing to correlate with.
            [_] => vec![[0.0; 2]],
            _ => all.iter().map(|one| product(one, one)).collect(),
        };
        let mut table = vec![vec![[0.0; 2]; all.len()]; all.len()];
        for (j, other) in all.iter().enumerate() {
            for (i, one) in all[..j].iter().enumerate() {
                let both = product(one, other);
                // A channel that says one thing all the time says nothing of another.
                let of = |k: usize| match (own[i][k] * own[j][k]).sqrt() {
                    size if size > 0.0 => both[k] / size,
                    _ => f64::NAN,
                };
                table[i][j] = [of(0), of(1)];
                table[j][i] = table[i][j];
            }
        }
        table
    }
}

/// Slopes of the readings over recorded channels, by least squares weighted by the baseline's noise.
pub(super) struct Slopes {
    /// What each is of, and the unit of the channel.
    names: Vec<(String, String)>,
    /// Whitened coefficients over their sum of squares.
    columns: Vec<Vec<f64>>,
}

impl Slopes {
    pub fn name(&self, unit: &str, all: &mut Vec<Statistic>) {
        for (what, of) in &self.names {
            all.push(Statistic::new(what.clone(), &format!("{unit}/({of})")));
        }
    }

    pub fn take(&self, of: &Whitened, all: &mut Vec<f64>) {
        all.extend(self.columns.iter().map(|c| dot(c, &of.coefficients)));
    }
}
