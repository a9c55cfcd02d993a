//! Noise of another spectrum, size, memory or law.

use super::Make::{Exponential, More, Shaped};
use super::{ForeignEffect, Strength, T, TM, TMV, row};

mod blocks;
mod laws;
mod maps;
mod memory;
mod processes;
mod spectrum;
mod variance;

/// One row each, unbroken so that columns can be read down.
#[rustfmt::skip]
pub(super) const EFFECTS: &[ForeignEffect] = &[
    row(309, 1, "swinging variance", Shaped(|d, s, _, _| variance::swinging(d, s))).needs(TM),
    row(310, 1, "growing variance", More(|d, s, _| variance::growing(d, s))).needs(TM),
    row(311, 1, "heavy tails", Shaped(|d, s, _, _| laws::laplace(d, s))).needs(TM).strength(Strength::None),
    row(312, 1, "skewed noise", Shaped(|d, s, _, _| laws::skewed(d, s))).needs(TM).strength(Strength::None),
    row(317, 1, "bursts of noise", More(|d, s, _| variance::spells(d, s))).needs(TM),
    row(318, 1, "noise that follows temperature", More(|d, s, a| variance::place_of_temperature(d, s, a))).needs(TM),
    row(329, 2, "noise with a resonance", Shaped(|d, s, a, _| processes::resonance(d, s, a))).needs(TM).later("narrow_band"),
    row(330, 2, "noise of a differenced angle", Shaped(|_, _, a, _| spectrum::differenced(a))).needs(TM).later("quantization_noise"),
    row(331, 2, "echo of earlier samples", Shaped(|d, _, a, _| spectrum::echo(d, a))).needs(TM),
    row(332, 2, "noise whose size wanders", Exponential(|d, s, _| variance::wandering_size(d, s, (5.0, 40.0)))).needs(TM),
    row(333, 2, "every few samples noisier", More(|d, s, _| variance::every_few(d, s))).needs(TM),
    row(334, 2, "noise with a uniform part", Shaped(|d, s, _, _| laws::uniform_part(d, s))).needs(TM),
    row(344, 3, "noise with a hole in its spectrum", Shaped(|d, _, _, _| spectrum::hole(d))).needs(TM),
    row(345, 3, "noise that remembers its last size", Shaped(|d, s, _, _| variance::remembering(d, s))).needs(TM),
    row(346, 3, "swing that leaves its square behind", Shaped(|_, _, _, _| memory::square_behind())).needs(TM),
    row(347, 3, "noise while the temperature moves", More(|d, s, a| variance::slow_pace(d, s, a))).needs(TM),
    row(348, 3, "hump of noise that moves with temperature", Shaped(|d, s, a, _| processes::hump(d, s, a))).needs(TM),
    row(360, 4, "noise that ends at an edge", Shaped(|d, s, a, _| spectrum::edge(d, s, a))).needs(TM),
    row(361, 4, "noise as large as the acceleration", More(|d, s, _| variance::by_acceleration(d, s))).needs(TMV),
    row(362, 4, "noise after each change of the command", More(|d, s, _| variance::after_changes(d, s))).needs(TM),
    row(363, 4, "tone caught at any phase", Shaped(|d, s, _, _| laws::any_phase(d, s))).needs(TM),
    row(375, 5, "noise of a supply near its end", More(|d, s, _| variance::near_end(d, s))).needs(TM),
    row(376, 5, "noise that a loop holds down", Shaped(|d, s, a, _| spectrum::held_down(d, s, a))).needs(TM),
    row(391, 6, "amplifier blocked after a shock", Shaped(|d, s, _, _| variance::silenced(d, s))).needs(TMV),
    row(392, 6, "mean over as many looks as fit", Shaped(|d, s, _, _| variance::averaged(d, s))).needs(TM),
    row(393, 6, "interpolation between two clocks", Shaped(|d, s, _, _| memory::interpolated(d, s))).needs(TM).parts(&["low_pass"]),
    row(394, 6, "memory that is trimmed at one temperature", Shaped(|d, s, a, _| memory::trimmed(d, s, a))).needs(TM),
    row(395, 6, "product of the last two swings", Shaped(|_, _, _, _| memory::product())).needs(TM),
    row(396, 6, "filter that lets large changes through", Shaped(|d, s, _, _| memory::adaptive(d, s))).needs(TM).parts(&["low_pass"]),
    row(397, 6, "filter that is switched in while the motor runs", Shaped(|d, s, _, _| memory::switched(d, s))).needs(TM).parts(&["low_pass"]),
    row(398, 6, "zero taken anew from each block", Shaped(|d, _, _, _| memory::blocks(d))).needs(TM),
    row(418, 7, "mode that noise drives", Shaped(|d, s, a, _| processes::mode(d, s, a))).needs(TM).later("narrow_band"),
    row(419, 7, "reverberation of the noise", Shaped(|d, _, a, _| spectrum::reverberation(d, a))).needs(TM),
    row(420, 7, "angle that is rounded", Shaped(|d, s, a, _| spectrum::rounded(d, s, a, 1.0))).needs(TM).later("quantization_noise"),
    row(421, 7, "noise that swells and ebbs", Exponential(|d, s, _| variance::swell(d, s))).needs(TM),
    row(422, 7, "noise of random size", Exponential(|d, s, _| variance::wandering_size(d, s, (0.5, 30.0)))).needs(TM),
    row(423, 7, "noise of a double-exponential law", Shaped(|_, _, _, _| laws::double_exponential())).needs(TM).parts(&["outliers"]),
    row(424, 7, "colour that turns", Shaped(|d, s, _, _| memory::turning_colour(d, s))).needs(TM),
    row(425, 7, "long memory", Shaped(|d, s, a, _| spectrum::long_memory(d, s, a))).needs(TM).parts(&["flicker"]).strength(Strength::Own),
    row(438, 8, "noise that undoes itself", Shaped(|_, _, a, _| spectrum::undoing(a))).needs(TM),
    row(439, 8, "noise between two edges", Shaped(|d, s, a, _| spectrum::band(d, s, a))).needs(TM),
    row(440, 8, "noise that feeds its own size", Shaped(|d, s, _, _| variance::feeding(d, s))).needs(TM),
    row(441, 8, "swing that pushes one way", Shaped(|_, _, _, _| memory::pushing())).needs(TM),
    row(442, 8, "reference renewed every few readings", Shaped(|d, _, _, _| memory::renewed(d))).needs(TM),
    row(443, 8, "hump of noise that runs through the band", Shaped(|d, s, a, _| processes::running(d, s, a))).needs(TM),
    row(459, 9, "noise that leans the way the motor turns", Shaped(|d, s, _, _| laws::leaning(d, s))).needs(TM).parts(&["outliers"]),
    row(460, 9, "noise that a swing to one side leaves louder", Shaped(|d, s, _, _| variance::one_sided(d, s))).needs(TM),
    row(470, 10, "quantisation of an angle that is differenced", Shaped(|d, s, a, _| spectrum::rounded(d, s, a, 0.95))).twin(330).later("quantization_noise"),
    row(477, 10, "brushes that spark when the command changes", More(|d, s, _| variance::sparks(d, s))).twin(362),
    row(481, 10, "noise by the magnitude of the table's rate", More(|d, s, _| variance::rate_squared(d, s))).parts(&["motor_noise"]),
    row(485, 10, "lower rate filled up by straight lines", Shaped(|d, s, _, _| memory::filled(d, s))).parts(&["low_pass"]).twin(393),
    row(487, 10, "narrow band that a fan drives", Shaped(|d, _, a, _| processes::narrow_band(d, a))).twin(329).later("narrow_band"),
    row(493, 11, "noise that ramps through the record", Exponential(|d, s, _| variance::ramp(d, s))).twin(310),
    row(495, 11, "slip ring that is worn at some angles", More(|d, s, _| variance::worn(d, s))).twin(317),
    row(505, 11, "noise that grows with the warmth", Exponential(|_, s, a| variance::warmth(s, a))).needs(T).twin(318),
    row(506, 11, "ramp of the rate that wanders", Shaped(|d, s, a, _| processes::wandering_ramp(d, s, a))),
    row(519, 12, "coupling capacitor in the signal's way", Shaped(|_, s, a, _| spectrum::behind_corner(s, a))).twin(376).later("high_pass"),
    row(521, 12, "bursts of a bus every few seconds", More(|d, s, _| variance::bursts(d, s))).twin(317),
    row(543, 13, "fan coil that a thermostat switches", More(|d, s, _| variance::fan(d, s))).twin(521),
    row(544, 13, "gas that leaks into the cavity", More(|d, s, _| variance::gas(d, s))).twin(421),
    row(554, 14, "edge that whistles at some speeds", More(|d, s, _| variance::whistle(d, s))).parts(&["motor_noise"]).twin(481),
    row(574, 15, "denoiser that shrinks small differences", Shaped(|d, s, _, _| memory::shrunk(d, s))).parts(&["low_pass"]),
    row(575, 15, "modulator that rings after an overload", Shaped(|d, _, _, _| memory::overloaded(d))).parts(&["low_pass"]),
    row(576, 15, "angle summed in a short float", Shaped(|d, _, a, _| processes::short_float(d, a))).parts(&["quantization_noise"]),
    row(596, 16, "ripple that obeys a cubic map", Shaped(|d, s, _, _| maps::cubic(d, s))),
    row(597, 16, "small swings that go on and large ones that turn back", Shaped(|_, _, _, _| maps::turning_back())),
    row(598, 16, "filter that begins anew with each block", Shaped(|d, _, _, _| maps::anew(d))).parts(&["low_pass"]),
    row(611, 17, "least and largest look of each stretch", Shaped(|d, _, _, _| blocks::extremes_of_stretch(d))),
    row(612, 17, "blocks that are levelled", Shaped(|d, _, _, _| blocks::levelled(d))),
];
