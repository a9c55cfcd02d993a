//! Signals of events: what happens now and then, and what it leaves.

use super::super::shape::signal;
use super::Make::{Shaped, Signal};
use super::{ForeignEffect, TM, row};

mod knocks;
mod marks;
mod trains;

/// One row each, unbroken so that columns can be read down.
#[rustfmt::skip]
pub(super) const EFFECTS: &[ForeignEffect] = &[
    row(303, 1, "bursts of ringing", Signal(|d, s, _| knocks::bursts_of_ringing(d, s))).needs(TM),
    row(314, 1, "creep", Signal(|d, s, _| marks::creep(d, s))).needs(TM),
    row(320, 1, "jumps that relax", Signal(|d, s, _| marks::jumps_that_relax(d, s))).needs(TM),
    row(336, 3, "ring-down of a spring that stiffens", Signal(|d, s, _| knocks::ring_down(d, s))).needs(TM),
    row(356, 4, "touches that warm and fade", Signal(|d, s, _| marks::touches(d, s))).needs(TM),
    row(364, 4, "spikes that come in pairs", Shaped(|d, s, a, w| signal(s, a, marks::pairs(d, s, w)))).needs(TM),
    row(372, 5, "ball that bounces until it lies", Signal(|d, s, _| knocks::ball(d, s))).needs(TM),
    row(373, 5, "iron that passes by", Signal(|d, s, _| marks::passing(d, s))).needs(TM),
    row(385, 6, "footsteps that pass", Signal(|d, s, _| knocks::footsteps(d, s))).needs(TM),
    row(386, 6, "heart of whoever leans on the bench", Signal(|d, s, _| knocks::heart(d, s))).needs(TM),
    row(414, 7, "knocks that ring", Signal(|d, s, _| knocks::knocks(d, s))).needs(TM),
    row(415, 7, "pulses of one sign", Signal(|d, s, _| marks::pulses(d, s))).needs(TM),
    row(428, 8, "peaks with long skirts", Signal(|d, s, _| marks::peaks(d, s))).needs(TM),
    row(451, 9, "iron that crackles", Signal(|d, s, _| marks::crackle(d, s))).needs(TM),
    row(452, 9, "knocks that a long pipe draws apart", Signal(|d, s, _| knocks::pipe(d, s))).needs(TM),
    row(478, 10, "charge that jumps and leaks away", Signal(|d, s, _| marks::charge(d, s))).twin(320),
    row(479, 10, "shocks that ring and recover in part", Signal(|d, s, _| knocks::lasting_shocks(d, s))).parts(&["bias_step", "shock"]).twin(414),
    row(480, 10, "creep by the logarithm of time", Signal(|d, s, _| marks::jolts(d, s))).twin(314),
    row(489, 11, "lorries that sway the ground", Signal(|d, s, _| knocks::lorries(d, s))).parts(&["base_motion"]).twin(413),
    row(525, 12, "drive loop that loses its lock", Signal(|d, s, _| marks::lock(d, s))).twin(320),
    row(540, 13, "trains that pass", Signal(|d, s, _| knocks::trains(d, s))).twin(489),
    row(556, 14, "door that is opened and shut", Signal(|d, s, _| marks::door(d, s))).twin(478),
    row(590, 16, "slips that set off others", Signal(|d, s, _| trains::aftershocks(d, s))),
    row(591, 16, "tap that drips without a period", Signal(|d, s, _| trains::dripping(d, s))),
    row(610, 17, "flipped bits of the zero until the scrubber comes by", Signal(|d, s, _| trains::scrubbed(d, s))).parts(&["bias_step"]),
];
