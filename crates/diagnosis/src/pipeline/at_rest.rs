//! Axes that read more than a bias of this class of part wanders, on a base that is at rest by its operator's word
//! (`base: static`).
//!
//! Their size alone does not tell a sensor's error from a turn of the base, but its course does. What turns a base pushes at
//! its inertia, so its rate has a slope; a bias that jumps, switches or wanders has none. Where noise, jumps and processes of
//! one pole describe the axis to the last test, the word is believed and the sensor did it. Else the base moved.

use model::effects::{
    am_line, base_motion, bias_step, flicker, gauss_markov, line, narrow_band, telegraph,
    wandering_line,
};
use model::record::Base;

use super::channel;
use crate::ingest::base_turns::MOTION_RMS;
use crate::ingest::types::{Grid, Target};
use crate::result::{Alternative, Finding};

/// What a bias may do and a base does not.
const WITHOUT_A_SLOPE: [&str; 4] = [bias_step::ID, telegraph::ID, gauss_markov::ID, flicker::ID];
/// What a base that swings does.
const TONES: [&str; 4] = [line::ID, am_line::ID, narrow_band::ID, wandering_line::ID];
/// What tells.
const EXPERIMENT: &str = "clamp the stand to a wall or a floor of stone and record again: what comes again is the sensor's";

/// Takes axes for being at rest that are described by that, and gives their names with those that read as much by their jumps
/// alone.
pub(super) fn believed(grid: &mut Grid) -> Vec<String> {
    let by_jumps = |t: &&Target| !t.moving && t.jumps.spread(t.y.len()) > MOTION_RMS;
    let jumping = grid.targets.iter().filter(by_jumps);
    let mut names: Vec<String> = jumping.map(|t| t.name.clone()).collect();
    if grid.base != Some(Base::Static) {
        return names;
    }
    for i in 0..grid.targets.len() {
        if !grid.targets[i].moving {
            continue;
        }
        take_for(grid, i, false);
        if described(grid, i) {
            names.push(grid.targets[i].name.clone());
        } else {
            take_for(grid, i, true);
        }
    }
    names
}

fn take_for(grid: &mut Grid, i: usize, moving: bool) {
    grid.targets[i].moving = moving;
    let name = &grid.targets[i].name;
    let mut signals = grid.signals.iter_mut();
    if let Some(signal) = signals.find(|s| s.name == *name) {
        signal.moving = moving;
    }
}

/// Whether noise, and what no base does, leave nothing of an axis: no tone either, which a base may swing by.
fn described(grid: &Grid, i: usize) -> bool {
    let s = channel::searched(grid, &grid.targets[i]);
    let mut causes = s.state.terms.iter().map(|t| t.effect.id());
    !causes.any(|id| TONES.contains(&id)) && s.checks.iter().all(|c| !c.fails_after)
}

/// Adds to causes on those axes what their size alone would say.
pub(super) fn with_motion(findings: &mut [Finding], at_rest: &[String]) {
    let on_one = |f: &&mut Finding| {
        WITHOUT_A_SLOPE.contains(&f.cause.as_str())
            && f.channels.iter().any(|c| at_rest.contains(c))
    };
    for f in findings.iter_mut().filter(on_one) {
        f.alternatives.push(Alternative {
            cause: base_motion::ID.into(),
            log_odds: 0.0,
        });
        f.experiment.get_or_insert_with(|| EXPERIMENT.to_owned());
    }
}
