//! What docs/effects.md prints of an effect: its texts, its figure, the run that shows it.

/// The kinds of figure that show an effect. Each is drawn from a record alone, for any effect that names it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Plot {
    /// Rate in blocks of time.
    RateInTime {
        /// Length of a block, s.
        block_s: f64,
    },
    /// Rate in blocks of time against a slow channel in the same blocks.
    RateAgainst(&'static str),
    /// Rate against a fast channel, in blocks of that channel's values.
    RateByValue(&'static str),
    /// Mean square of the noise in blocks of time.
    PowerInTime,
    /// The same against a slow channel.
    PowerAgainst(&'static str),
    /// Power spectral density of the rate, both axes logarithmic.
    Spectrum,
    /// Amplitude spectrum of the rate.
    Lines {
        /// Lowest frequency, Hz.
        from_hz: f64,
        /// Highest frequency, Hz.
        to_hz: f64,
    },
    /// By how much another gyro changes from reading to reading against by how much this one does, in blocks of that.
    AxisAgainst(&'static str),
    /// Tilt by the accelerometers against tilt by integrating the rate.
    Tilt,
    /// The rate around one of the samples that the effect changed.
    Around,
    /// Histogram of the counts with the normal curve.
    Histogram,
    /// Share of ones in each bit of the counts.
    Bits,
    /// Frames that are missing before each that arrived.
    Gaps,
    /// Device time minus its line.
    DeviceTime,
    /// Host time minus device time.
    HostTime,
}

/// A run that shows an effect, and how it is drawn: docs/effects.md has it beside the same run without the effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Example {
    /// What is drawn.
    pub plot: Plot,
    /// Channels that the effect acts on, the first of which is drawn; empty means all.
    pub channels: &'static [&'static str],
    /// Parameters of the effect, in the units of [`Effect::parameters`].
    pub parameters: &'static [(&'static str, f64)],
    /// Settings of the excitation ([`crate::excitation::SETTINGS`]).
    pub world: &'static [(&'static str, f64)],
}

impl Example {
    /// On gyro x, in a world at rest.
    #[must_use]
    pub const fn new(plot: Plot, parameters: &'static [(&'static str, f64)]) -> Self {
        Self {
            plot,
            channels: &["gyro_x"],
            parameters,
            world: &[],
        }
    }

    /// The same with these settings of the excitation.
    #[must_use]
    pub const fn in_a_world(self, world: &'static [(&'static str, f64)]) -> Self {
        Self { world, ..self }
    }

    /// The same on all channels.
    #[must_use]
    pub const fn on_all(self) -> Self {
        Self {
            channels: &[],
            ..self
        }
    }
}

/// What docs/effects.md prints of an effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Docs {
    /// Headline.
    pub title: &'static str,
    /// Where it comes from and its formula.
    pub physics: &'static str,
    /// What has to happen in a record for it to show.
    pub excitation: &'static str,
    /// How it is tested.
    pub test: &'static str,
    /// What the user changes about the stand, the filter or the model: one sentence.
    pub remedy: &'static str,
    /// The figure that shows it.
    pub figure: &'static str,
    /// A run that shows it in that figure.
    pub example: Example,
}

/// A cause that may look the same, and what to record to tell them apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rival {
    /// Cause id of the other one.
    pub cause: &'static str,
    /// The experiment that decides.
    pub experiment: &'static str,
}
