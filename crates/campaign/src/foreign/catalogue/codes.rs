//! What acts on the codes that are read, one by one or from reading to reading.

use super::super::shape::{by_chance, map};
use super::Make::Shaped;
use super::{ForeignEffect, Strength, TM, row};

mod blocks;
mod edges;
mod gaps;
mod maps;
mod protocol;
mod steps;

/// One row each, unbroken so that columns can be read down.
#[rustfmt::skip]
pub(super) const EFFECTS: &[ForeignEffect] = &[
    row(313, 1, "dead band", Shaped(|d, s, a, _| edges::still_band(d, s, a))).needs(TM).strength(Strength::None),
    row(319, 1, "codes that are missing", Shaped(|d, _, a, _| edges::missing(d, a))).needs(TM).strength(Strength::None),
    row(335, 2, "uneven steps of the converter", Shaped(|d, s, a, _| edges::uneven_steps(d, s, a))).needs(TM),
    row(349, 3, "two codes of the part in one", Shaped(|d, s, a, _| edges::two_in_one(d, s, a))).needs(TM).strength(Strength::Own).later("double_rounding"),
    row(365, 4, "reading that is renewed beyond a threshold", Shaped(|_, _, a, _| steps::threshold(a))).needs(TM),
    row(377, 5, "dead zone of a push-pull stage", Shaped(|d, s, a, _| edges::push_pull(d, s, a))).needs(TM),
    row(399, 6, "gain that differs with the sense", Shaped(|d, s, a, _| edges::two_gains(d, s, a))).needs(TM),
    row(400, 6, "step that grows with the reading", Shaped(|d, s, a, w| edges::growing_steps(d, s, a, w))).needs(TM).strength(Strength::Whole),
    row(401, 6, "two lines of the word exchanged", Shaped(|d, s, a, w| maps::exchanged(d, s, a, w))).needs(TM),
    row(402, 6, "lowest bit that carries the parity", Shaped(|_, _, a, _| map(a, maps::with_parity))).needs(TM),
    row(403, 6, "far readings put between their neighbours", Shaped(|_, s, a, w| maps::gated(s, a, w))).needs(TM).strength(Strength::Whole),
    row(404, 6, "reading that may change by so much at most", Shaped(|_, s, a, w| steps::limited(s, a, w))).needs(TM).strength(Strength::Whole),
    row(427, 7, "dead band at zero", Shaped(|d, s, a, _| edges::dead_band(d, s, a))).needs(TM),
    row(446, 8, "amplifier that bends to a logarithm", Shaped(|d, s, a, _| edges::bent(d, s, a))).needs(TM),
    row(447, 8, "play in the reading", Shaped(|_, _, a, _| steps::play(a))).needs(TM),
    row(464, 9, "low bits that a latch keeps", Shaped(|d, _, a, _| by_chance(a, steps::latched(1 + d.of_many(2))))).needs(TM),
    row(465, 9, "differences sent in few levels", Shaped(|_, _, a, _| by_chance(a, steps::in_levels))).needs(TM),
    row(466, 9, "code taken for a fault", Shaped(|d, s, a, _| by_chance(a, steps::repeated(edges::zero_code(d, s, a))))).needs(TM).parts(&["stale_samples"]),
    row(467, 9, "gaps bridged by straight lines", Shaped(|d, s, a, w| gaps::bridged(d, s, a, w))).needs(TM),
    row(471, 10, "dead zone about zero rate", Shaped(|d, s, a, _| edges::dead_zone(d, s, a))).twin(377),
    row(483, 10, "slew limit of the output stage", Shaped(|_, _, a, _| steps::slew(a))).twin(404),
    row(484, 10, "other gain and offset beyond a rate", Shaped(|d, s, a, _| edges::ranges(d, s, a))),
    row(490, 11, "code step at mid-scale", Shaped(|d, s, a, _| edges::mid_scale(d, s, a))).twin(484),
    row(494, 11, "high byte of the reading before", Shaped(|d, _, a, _| by_chance(a, steps::torn(d)))).parts(&["outliers"]).twin(464),
    row(514, 12, "gain of one that cuts toward zero", Shaped(|d, s, a, _| maps::cut(d, s, a))).twin(377),
    row(516, 12, "converter whose line is wavy", Shaped(|d, s, a, _| edges::wavy(d, s, a))).twin(335),
    row(527, 12, "despiker that takes the median", Shaped(|_, s, a, w| steps::despiked(s, a, w))).parts(&["low_pass"]).twin(403),
    row(529, 13, "low nibble of the reading after", Shaped(|_, _, a, _| steps::nibble(a))).twin(494),
    row(534, 13, "lines printed with few digits", Shaped(|d, s, a, w| maps::printed(d, s, a, w))).twin(400),
    row(535, 13, "output that falls slower than it rises", Shaped(|d, s, a, _| steps::falling(d, s, a))).twin(483),
    row(541, 13, "bit of the converter that weighs wrong", Shaped(|d, s, a, w| edges::weighs_wrong(d, s, a, w))).twin(490),
    row(545, 13, "filter whose register wraps round", Shaped(|d, s, a, _| maps::wrapped(d, s, a))).twin(501),
    row(547, 13, "half-precision number about a power of two", Shaped(|d, s, a, _| maps::halved(d, s, a))).twin(400),
    row(565, 14, "output stage that slews softly", Shaped(|d, s, a, _| steps::slewing(d, s, a))).parts(&["low_pass"]).twin(483),
    row(566, 14, "filter that smooths small changes", Shaped(|d, s, a, _| steps::smoothing(d, s, a))).parts(&["low_pass"]).twin(396),
    row(568, 15, "bits that toggle pull at the ground", Shaped(|d, s, a, _| blocks::pulling(d, s, a))),
    row(569, 15, "blocks that come out sorted", Shaped(|d, s, a, _| blocks::sorted(d, s, a))),
    row(570, 15, "lost readings mirrored from those before", Shaped(|d, s, a, w| blocks::mirrored(d, s, a, w))).twin(467),
    row(571, 15, "fraction printed without its zero", Shaped(|_, _, a, _| map(a, maps::without_zero))),
    row(572, 15, "reading held while the part calibrates", Shaped(|d, s, a, w| blocks::held(d, s, a, w))).parts(&["stale_samples"]).strength(Strength::Whole),
    row(573, 15, "block of readings with one exponent", Shaped(|d, s, a, _| blocks::exponents(d, s, a))).parts(&["stuck_bit"]),
    row(599, 16, "reading moved on where it would repeat", Shaped(|d, _, a, _| by_chance(a, protocol::moved_on(d)))),
    row(600, 16, "coarse range kept after a large swing", Shaped(|d, s, a, _| protocol::coarse_for_a_while(d, s, a))).parts(&["stuck_bit"]),
    row(601, 16, "alive counter in the lowest bits", Shaped(|d, _, a, _| protocol::alive(d, a))),
    row(613, 17, "blocks packed by a cosine transform", Shaped(|d, s, a, _| blocks::packed(d, s, a))).strength(Strength::Own),
];
