//! Times within a run, as options give them.

/// Longest part that is traced, s: a hundred megabytes.
const LONGEST_TRACE_S: f64 = 60.0;

/// A part of a run, s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span(pub f64, pub f64);

/// How long the stop is held, from and to, s.
#[derive(Clone, Copy, Debug)]
pub struct Held(pub [f64; 2]);

/// `20,25`.
pub fn held(text: &str) -> std::result::Result<Held, String> {
    match two_times(text) {
        Some((from, to)) if from >= 0.0 && from < to => Ok(Held([from, to])),
        _ => Err("takes two times of which the second is later: 20,25".to_owned()),
    }
}

fn two_times(text: &str) -> Option<(f64, f64)> {
    let (from, to) = text.split_once(',')?;
    Some((from.trim().parse().ok()?, to.trim().parse().ok()?))
}

/// `0,2`.
pub fn span(text: &str) -> std::result::Result<Span, String> {
    match two_times(text) {
        Some((from, to)) if from >= 0.0 && from < to && to - from <= LONGEST_TRACE_S => {
            Ok(Span(from, to))
        }
        _ => Err(format!(
            "takes two times of which the second is later, {LONGEST_TRACE_S} s apart at the most: 0,2"
        )),
    }
}
