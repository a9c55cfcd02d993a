//! The board's arithmetic in double precision.

use super::{
    ACC_ZERO, ADAPT_SHIFT, Correction, GATE_SHIFT, KNOWN_MAX, LONGEST_TICKS, NOISE_SHIFT, REACH,
    REST_DPS,
};

/// Where the attitude begins.
const LEVEL: [f64; 4] = [1.0, 0.0, 0.0, 0.0];
/// What a count of the accelerometer turns by, half of it, across to where up is.
const LEAN: f64 = 1.0 / (1 << 15) as f64;

/// What a sample brings, as the correction sees it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Inputs {
    /// Counts times scale, deg/s.
    pub rate: [f64; 3],
    /// TEMP_OUT.
    pub temp: [i16; 3],
    /// SUPPLY_OUT.
    pub supply: u16,
    /// ADC counts.
    pub acc: [u16; 3],
    /// -255 ..= 255.
    pub duty: i16,
    /// When it was taken, ticks of 4 us.
    pub t_ticks: u32,
    /// Whether the sample is in order.
    pub in_order: bool,
}

/// One axis of the bias filter.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Axis {
    /// deg/s.
    pub bias: f64,
    /// What the filter knows, in blocks: the variance of the bias is that of a block, as it was told, over this.
    pub known: f64,
    /// Variance of a block's mean, as it has shown itself, over that which was told.
    pub noise: f64,
    sum: f64,
    trusted: bool,
}

/// The board's arithmetic in double precision.
#[derive(Clone, Copy, Debug)]
pub struct Twin {
    correction: Correction,
    /// x, y, z.
    pub axes: [Axis; 3],
    /// w, x, y, z: turns the body's axes into those in which it began.
    pub attitude: [f64; 4],
    /// When the sample before was.
    t_ticks: Option<u32>,
    /// What the motor has turned to.
    speed: f64,
    at_rest: bool,
    in_block: u32,
    /// Squares of what is left of all rates in the block.
    squares: f64,
}

impl Twin {
    /// Before the first sample.
    #[must_use]
    pub fn new(correction: &Correction) -> Self {
        let start = Axis {
            noise: 1.0,
            ..Axis::default()
        };
        Self {
            correction: *correction,
            axes: [start; 3],
            attitude: LEVEL,
            t_ticks: None,
            speed: 0.0,
            at_rest: true,
            in_block: 0,
            squares: 0.0,
        }
    }

    /// The rates after the model's terms, before the bias filter.
    fn modelled(&self, inputs: &Inputs) -> [f64; 3] {
        let c = &self.correction;
        let duty = f64::from(inputs.duty);
        let supply = f64::from(inputs.supply);
        let acc = inputs.acc.map(f64::from);
        let mut u = [0.0; 3];
        for (i, u) in u.iter_mut().enumerate() {
            // Ten bits: -49 to 99 degC.
            let t = f64::from((inputs.temp[i] << 6) >> 6);
            *u = inputs.rate[i]
                + c.bias[i]
                + t * (c.temperature[i] + t * c.temperature_squared[i])
                + duty * c.motor[i]
                + duty.abs() * c.motor_magnitude[i]
                + f64::from(inputs.duty.signum()) * c.motor_turning[i]
                + supply * c.supply[i]
                + acc[0] * c.acc[i][0]
                + acc[1] * c.acc[i][1]
                + acc[2] * c.acc[i][2];
        }
        let mut v = u;
        for (i, v) in v.iter_mut().enumerate() {
            *v += u[0] * c.matrix[i][0] + u[1] * c.matrix[i][1] + u[2] * c.matrix[i][2];
        }
        v
    }

    /// The corrected rates of a sample, deg/s.
    pub fn step(&mut self, inputs: &Inputs) -> [f64; 3] {
        let v = self.modelled(inputs);
        let ahead = f64::from(inputs.duty) - self.speed;
        self.speed += self.correction.follow * ahead;
        self.at_rest &= inputs.in_order && inputs.duty == 0;
        let mut out = [0.0; 3];
        let surge = self.correction.surge;
        for (((out, axis), v), surge) in out.iter_mut().zip(&mut self.axes).zip(v).zip(surge) {
            let left = v + surge * ahead - axis.bias;
            self.at_rest &= left.abs() < f64::from(REST_DPS);
            axis.sum += left;
            self.squares += left * left;
            *out = left;
        }
        self.turn(&out, inputs);
        self.in_block += 1;
        if self.in_block == 1 << self.correction.block_shift {
            self.end_block();
        }
        out
    }

    /// The attitude behind a sample of these rates.
    fn turn(&mut self, rate: &[f64; 3], inputs: &Inputs) {
        let before = self.t_ticks.replace(inputs.t_ticks);
        let ticks = before.map(|before| inputs.t_ticks.wrapping_sub(before) as u16);
        let Some(ticks) = ticks.filter(|ticks| *ticks <= LONGEST_TICKS) else {
            self.attitude = LEVEL;
            return;
        };
        let half_s = f64::from(ticks) * 4e-6 / 2.0;
        let mut half = rate.map(|rate| rate.to_radians() * half_s);
        let [w, x, y, z] = self.attitude;
        if self.at_rest {
            let up = [
                2.0 * (x * z - w * y),
                2.0 * (y * z + w * x),
                1.0 - 2.0 * (x * x + y * y),
            ];
            let acc = inputs
                .acc
                .map(|counts| f64::from(counts) - f64::from(ACC_ZERO));
            half[0] += (acc[1] * up[2] - acc[2] * up[1]) * LEAN;
            half[1] += (acc[2] * up[0] - acc[0] * up[2]) * LEAN;
            half[2] += (acc[0] * up[1] - acc[1] * up[0]) * LEAN;
        }
        let square: f64 = half.iter().map(|h| h * h).sum();
        // The cosine, and the sine over its angle, by their series: below half a radian they are exact to 1e-12. (`core` has
        // neither.)
        let (mut c, mut s, mut term) = (0.0, 0.0, 1.0);
        for n in 0..8u32 {
            c += term;
            s += term / f64::from(2 * n + 1);
            term *= -square / f64::from((2 * n + 1) * (2 * n + 2));
        }
        let [a, b, d] = half.map(|h| h * s);
        self.attitude = [
            w * c - x * a - y * b - z * d,
            x * c + w * a + y * d - z * b,
            y * c + w * b + z * a - x * d,
            z * c + w * d + x * b - y * a,
        ];
    }

    fn end_block(&mut self) {
        let len = f64::from(self.in_block);
        // What is left about its own means, against what was told.
        let of_means: f64 = self
            .axes
            .iter()
            .map(|axis| (axis.sum / len) * (axis.sum / len))
            .sum();
        let told: f64 = self.correction.noise.iter().sum();
        let most = f64::from(1u32 << NOISE_SHIFT);
        self.at_rest &= self.squares / len - of_means <= most * len * told;
        self.squares = 0.0;
        for (i, axis) in self.axes.iter_mut().enumerate() {
            let (told, c) = (self.correction.noise[i], &self.correction);
            // P' = P + q with P = R / known.
            axis.known /= 1.0 + axis.known * c.walk[i] / told;
            let mean = axis.sum / len;
            axis.sum = 0.0;
            let square = (mean * mean / told).min(REACH);
            let expected = axis.noise + 1.0 / axis.known;
            let before = axis.trusted;
            axis.trusted = self.at_rest && square / f64::from(1u32 << (2 * GATE_SHIFT)) <= expected;
            if !axis.trusted || !before {
                continue;
            }
            let measured = 1.0 / axis.noise;
            axis.known = (axis.known + measured).min(KNOWN_MAX);
            axis.bias += mean * (measured / axis.known).min(1.0);
            let step = (square - expected) / f64::from(1u32 << ADAPT_SHIFT);
            if expected <= REACH {
                axis.noise = (axis.noise + step).clamp(1.0 / most, most);
            }
        }
        self.at_rest = true;
        self.in_block = 0;
    }
}
