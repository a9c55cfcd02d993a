//! What can be wrong with a stand.

use super::StallFlags;

/// Something wrong with the stand.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Fault {
    /// The bias of a gyro follows its die temperature.
    Tempco {
        /// 0, 1, 2.
        gyro: usize,
        /// deg/s/degC.
        dps_per_c: f64,
        /// deg/s/degC^2 about 25 degC.
        dps_per_c2: f64,
    },
    /// The motor's current couples into a gyro: common ground and magnetic field.
    MotorCoupling {
        /// 0, 1, 2.
        gyro: usize,
        /// deg/s/A.
        dps_per_amp: f64,
    },
    /// Commutation noise of the motor gets into a gyro: white noise whose power grows with the current.
    MotorNoise {
        /// 0, 1, 2.
        gyro: usize,
        /// Relative increase of the noise power for each ampere, 1/A.
        power_per_amp: f64,
    },
    /// A gyro rejects its supply badly, on a supply that sags.
    SupplyCoupling {
        /// 0, 1, 2.
        gyro: usize,
        /// deg/s/V.
        dps_per_volt: f64,
    },
    /// A machine on the base: angular vibration at one frequency.
    Vibration {
        /// Body axis about which it turns.
        axis: usize,
        /// Hz; what lies above half the sample rate folds down.
        frequency_hz: f64,
        /// Peak rate, deg/s.
        amplitude_dps: f64,
        /// Linear vibration that goes with it, g peak on all three axes.
        linear_g: f64,
    },
    /// Somebody knocks the mount: a short transient, then the stressed gyro has another bias, and the board stands
    /// at another angle.
    Knock {
        /// 0, 1, 2.
        gyro: usize,
        /// s.
        time_s: f64,
        /// Lasting change of the bias, deg/s.
        step_dps: f64,
        /// Lasting change of the tilt, deg.
        tilt_deg: f64,
    },
    /// The zero and the sensitivity of an accelerometer axis follow the temperature of its package.
    AccTempco {
        /// 0, 1, 2.
        axis: usize,
        /// g/degC.
        g_per_c: f64,
        /// 1/degC.
        scale_per_c: f64,
    },
    /// The converter's reference is not tied to the accelerometer's supply alone, but takes a share of the 5-V rail's changes:
    /// readings are no longer ratiometric, and go against the rail.
    AccReference {
        /// V of the reference for each V of the rail.
        share: f64,
    },
    /// Somebody knocks the bench: the stand rings about an axis and along all three, and is at rest again. Nothing stays.
    Bump {
        /// Body axis about which it rings.
        axis: usize,
        /// s.
        time_s: f64,
        /// Rate at the blow, deg/s.
        peak_dps: f64,
        /// Acceleration that goes with it, g peak along z, and a part of it along x and y.
        linear_g: f64,
        /// Hz.
        frequency_hz: f64,
        /// Time in which it falls to 1/e, s.
        decay_s: f64,
    },
    /// A gyro's sample clock stalls again and again: the output register is not refreshed.
    Stall {
        /// 0, 1, 2.
        gyro: usize,
        /// How many times.
        count: usize,
        /// Length of each, s.
        length_s: f64,
        /// Whether the part owns up to it.
        flags: StallFlags,
    },
    /// A gyro's bias settles after power-on, without its temperature sensor noticing (mechanical stress, not heat).
    WarmUp {
        /// 0, 1, 2.
        gyro: usize,
        /// deg/s at power-on.
        amplitude_dps: f64,
        /// s.
        tau_s: f64,
    },
    /// A package leak: the bias runs away steadily.
    Leak {
        /// 0, 1, 2.
        gyro: usize,
        /// deg/s^2.
        dps_per_s: f64,
    },
    /// Too large a capacitor at RATE/FILT.
    SlowFilter {
        /// 0, 1, 2.
        gyro: usize,
        /// Corner, Hz.
        pole_hz: f64,
    },
    /// Convection in the package: the bias wanders and returns.
    WanderingBias {
        /// 0, 1, 2.
        gyro: usize,
        /// rms, deg/s.
        sigma_dps: f64,
        /// Correlation time, s.
        tau_s: f64,
    },
    /// A charge trap: the bias jumps between two values.
    Trap {
        /// 0, 1, 2.
        gyro: usize,
        /// Half the jump, deg/s.
        half_height_dps: f64,
        /// Mean time in each state, s.
        dwell_s: f64,
    },
    /// A gyro is mounted askew: it feels a share of the rate about another axis, and the less of its own.
    Misalignment {
        /// 0, 1, 2.
        gyro: usize,
        /// The axis that it leans towards: 0, 1, 2.
        from: usize,
        /// Sine of the angle between its axis and its own, 1.
        share: f64,
    },
    /// The gyro reacts to acceleration, on a shaking floor.
    GSensitivity {
        /// 0, 1, 2.
        gyro: usize,
        /// deg/s/g along each body axis.
        dps_per_g: [f64; 3],
    },
    /// Noise on the common reference: the same on all three gyros.
    CommonNoise {
        /// rms before the gyros' filters, deg/s; it decays within 15 ms, so 20-Hz samples are all but independent.
        sigma_dps: f64,
    },
    /// A gyro gets noisier for a while (a bad contact).
    NoisySpell {
        /// 0, 1, 2.
        gyro: usize,
        /// s.
        start_s: f64,
        /// s.
        end_s: f64,
        /// Relative increase of the noise power, 1.
        power: f64,
    },
    /// Discharges hit a gyro's output latch: the next rate read is wrong, once each.
    Glitches {
        /// 0, 1, 2.
        gyro: usize,
        /// How many.
        count: usize,
        /// Height, deg/s, sign at random.
        height_dps: f64,
    },
    /// A data line of a gyro's output register is stuck.
    StuckBit {
        /// 0, 1, 2.
        gyro: usize,
        /// 0 = least significant.
        bit: u8,
        /// What it reads.
        value: bool,
    },
    /// MISO is dead while this gyro is selected.
    DeadSpi {
        /// 0, 1, 2.
        gyro: usize,
        /// s.
        start_s: f64,
        /// s.
        end_s: f64,
        /// What every bit reads.
        level: bool,
    },
    /// The serial cable loses bytes.
    LossyLine {
        /// How many single bytes are lost.
        count: usize,
    },
    /// A real turn of the base, short, about one axis.
    Shove {
        /// 0, 1, 2.
        axis: usize,
        /// s.
        time_s: f64,
        /// Peak rate, deg/s.
        peak_dps: f64,
        /// Length, s.
        length_s: f64,
    },
}
