//! The words of a column's name, and the axis in them.

use super::AXES;

/// The axes' names as angles: about x, y and z.
pub(super) const TURNS: [&str; 3] = ["roll", "pitch", "yaw"];

/// 0, 1, 2 for a word that is or ends in an axis; its number, up to 3, where it ends in one.
pub(super) fn axis_of(word: &str) -> Option<usize> {
    if let Some(axis) = TURNS.iter().position(|turn| *turn == word) {
        return Some(axis);
    }
    // The number of a sensor stands behind an axis: `gx1`, `acc_z2`.
    let bare = word.trim_end_matches(|c: char| c.is_ascii_digit());
    let is_numbered = bare.len() < word.len() && bare.ends_with(['x', 'y', 'z']);
    let word = if is_numbered { bare } else { word };
    let stem = word.trim_end_matches(['x', 'y', 'z', '0', '1', '2', '3']);
    let known = [
        "",
        "g",
        "w",
        "a",
        "gyro",
        "gyr",
        "acc",
        "accel",
        "omega",
        "angvel",
        "rate",
        "rot",
        "角速度",
        "加速度",
        "ジャイロ",
    ];
    let last = word.strip_prefix(stem)?;
    if !known.contains(&stem) {
        return None;
    }
    match last {
        "x" | "0" => Some(0),
        "y" | "1" => Some(1),
        "z" | "2" => Some(2),
        "3" => Some(3),
        _ => None,
    }
}

/// A word that begins with its axis, in two: `xgyro`, `rollrate`.
fn axis_first(word: &str) -> Option<(&str, &str)> {
    let known = ["gyro", "gyr", "acc", "accel", "rate", "speed"];
    let split = |axis: &&str| Some(word.split_at(word.strip_prefix(*axis).map(|_| axis.len())?));
    (AXES.iter().chain(&TURNS).filter_map(split)).find(|(_, rest)| known.contains(rest))
}

/// The words of a name, in small letters: `GyroX`, `gyr[0]`, `w_RS_S_x`.
pub(super) fn words(name: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut was_small = false;
    for c in name.chars() {
        if !c.is_alphanumeric() || (c.is_uppercase() && was_small) {
            words.push(String::new());
        }
        was_small = c.is_lowercase();
        if let (true, Some(word)) = (c.is_alphanumeric(), words.last_mut()) {
            word.extend(c.to_lowercase());
        }
    }
    words.retain(|word| !word.is_empty());
    let split = |word: String| match axis_first(&word) {
        Some((axis, rest)) => vec![axis.to_owned(), rest.to_owned()],
        None => vec![word],
    };
    words.into_iter().flat_map(split).collect()
}

/// The words of a name without its axis: the same for all axes of one sensor, and another for another one.
pub(super) fn without_axis(name: &str) -> Vec<String> {
    let mut words = words(name);
    let is_number = |word: &String| word.ends_with(|c: char| c.is_ascii_digit());
    let has_axis = |word: &String| axis_of(word).is_some();
    let at = (words.iter().rposition(|w| has_axis(w) && !is_number(w)))
        .or_else(|| words.iter().rposition(has_axis));
    if let Some(at) = at {
        let word = words[at].clone();
        let number = word.trim_start_matches(|c: char| !c.is_ascii_digit());
        let letters = &word[..word.len() - number.len()];
        let stem = match letters.strip_suffix(['x', 'y', 'z']) {
            Some(stem) => format!("{stem}{number}"),
            None if TURNS.contains(&letters) => String::new(),
            None => letters.to_owned(),
        };
        words[at] = stem;
    }
    words.retain(|word| !word.is_empty());
    words
}
