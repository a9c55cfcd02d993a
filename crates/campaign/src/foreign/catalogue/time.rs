//! Signals that have a structure in time of their own.

use super::Make::Signal;
use super::{ForeignEffect, TM, row};

mod driven;
mod levels;
mod tones;

/// One row each, unbroken so that columns can be read down.
#[rustfmt::skip]
pub(super) const EFFECTS: &[ForeignEffect] = &[
    row(300, 1, "chirp", Signal(|d, s, _| tones::chirp(d, s))).needs(TM),
    row(301, 1, "square wave", Signal(|d, s, _| levels::square_wave(d, s))).needs(TM),
    row(302, 1, "comb of harmonics", Signal(|d, s, _| tones::comb(d, s))).needs(TM),
    row(307, 1, "sawtooth", Signal(|d, s, _| levels::sawtooth(d, s))).needs(TM),
    row(308, 1, "jumps at random", Signal(|d, s, _| levels::jumps(d, s))).needs(TM),
    row(315, 1, "line that changes its pitch", Signal(|d, s, _| tones::changing_pitch(d, s))).needs(TM),
    row(316, 1, "line that comes and goes", Signal(|d, s, _| tones::comes_and_goes(d, s))).needs(TM).parts(&["line"]),
    row(321, 1, "random walk for a while", Signal(|d, s, _| levels::walk_for_a_while(d, s))).needs(TM),
    row(322, 2, "stick and slip", Signal(|d, s, _| levels::stick_and_slip(d, s))).needs(TM),
    row(328, 2, "swing without a period", Signal(|d, s, _| tones::swing_without_period(d, s))).needs(TM),
    row(341, 3, "two oscillators that pull each other", Signal(|d, s, _| tones::pulled(d, s))).needs(TM),
    row(343, 3, "dither that repeats itself", Signal(|d, s, _| levels::dither(d, s))).needs(TM),
    row(357, 4, "swing that builds up and is quenched", Signal(|d, s, _| tones::quenched(d, s))).needs(TM).later("narrow_band"),
    row(358, 4, "pulse of another clock", Signal(|d, s, _| levels::pulse(d, s))).needs(TM),
    row(359, 4, "tone that hops between two pitches", Signal(|d, s, _| tones::hopping(d, s))).needs(TM),
    row(374, 5, "elements that take turns", Signal(|d, s, _| levels::in_turn(d, s))).needs(TM),
    row(387, 6, "machine that runs up through a resonance", Signal(|d, s, _| tones::runs_up(d, s))).needs(TM),
    row(388, 6, "idle tones of a modulator", Signal(|d, s, _| tones::idle_tones(d, s))).needs(TM),
    row(389, 6, "parity of the frame's number", Signal(|d, s, _| levels::parity(d, s))).needs(TM),
    row(390, 6, "amplifiers that take turns and slip", Signal(|d, s, _| levels::slipping(d, s))).needs(TM),
    row(411, 7, "rotor that runs up or down", Signal(|d, s, _| tones::sweep(d, s))).needs(TM),
    row(412, 7, "tone whose pitch wanders", Signal(|d, s, _| tones::wandering(d, s))).needs(TM).later("wandering_line"),
    row(413, 7, "machine that starts and stops", Signal(|d, s, _| tones::starts_and_stops(d, s))).needs(TM),
    row(416, 7, "charge and reset", Signal(|d, s, _| levels::charge(d, s))).needs(TM),
    row(417, 7, "one short pulse each period", Signal(|d, s, _| levels::train(d, s))).needs(TM),
    row(429, 8, "pressure behind a valve", Signal(|d, s, _| levels::pressure(d, s))).needs(TM),
    row(430, 8, "two switches on one lamp", Signal(|d, s, _| levels::two_switches(d, s))).needs(TM),
    row(431, 8, "tone keyed by bits", Signal(|d, s, _| tones::keyed(d, s))).needs(TM),
    row(432, 8, "loop that never settles", Signal(|d, s, _| levels::unsettled(d, s))).needs(TM),
    row(448, 9, "tone whose pitch sways", Signal(|d, s, _| tones::swaying(d, s))).needs(TM),
    row(449, 9, "siren that drives past", Signal(|d, s, _| tones::siren(d, s))).needs(TM),
    row(450, 9, "message in two-phase code", Signal(|d, s, _| levels::message(d, s))).needs(TM),
    row(491, 11, "alias that glides while its clock warms up", Signal(|d, s, _| tones::gliding(d, s))).twin(300),
    row(496, 11, "amplitude loop that hunts", Signal(|d, s, _| levels::hunting(d, s))).twin(416),
    row(503, 11, "transmitter that pulls the reference while it sends", Signal(|d, s, _| levels::sending(d, s))).twin(417),
    row(507, 11, "self-test at a fixed period", Signal(|d, s, _| levels::self_test(d, s))).twin(417),
    row(522, 12, "mains hum that wanders", Signal(|d, s, _| tones::hum(d, s))).twin(412).later("wandering_line"),
    row(524, 12, "moisture that diffuses in and out", Signal(|d, s, _| levels::moisture(d, s))).twin(429),
    row(526, 12, "draught of the air conditioning", Signal(|d, s, _| levels::draught(d, s))).twin(496),
    row(537, 13, "sun through clouds on one side", Signal(|d, s, _| levels::sun(d, s))).twin(350),
    row(577, 15, "spring pendulum", Signal(|d, s, _| tones::spring_pendulum(d, s))),
    row(578, 15, "radio field that fades as somebody walks", Signal(|d, s, _| tones::fading(d, s))),
    row(588, 16, "plate that a sway helps over", Signal(|d, s, _| driven::snapping(d, s))),
    row(589, 16, "arm that repeats its moves whenever it is asked", Signal(|d, s, _| driven::moves(d, s))),
    row(608, 17, "trolley that comes back over the same joints", Signal(|d, s, _| driven::trolley(d, s))),
    row(609, 17, "trim that is searched by halves", Signal(|d, s, _| driven::by_halves(d, s))),
];
