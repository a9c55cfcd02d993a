//! Two answers, path by path.

use std::fmt;

use serde_json::Value;

/// Relative difference of two numbers that are the same: nine digits.
const SAME: f64 = 1e-9;
/// Longest value printed, characters.
const PRINTED: usize = 160;

/// What differs at a path.
#[derive(Debug, PartialEq)]
pub struct Difference {
    /// Keys and places, from the root, between slashes.
    pub path: String,
    /// In the first, as JSON; `-` where the path is absent.
    pub before: String,
    /// In the second.
    pub after: String,
}

impl Difference {
    /// The path without the places in lists.
    pub fn kind(&self) -> String {
        let number = |p: &&str| p.parse::<usize>().is_err();
        self.path
            .split('/')
            .filter(number)
            .collect::<Vec<_>>()
            .join("/")
    }
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {} -> {}", self.path, self.before, self.after)
    }
}

/// All differences of two answers.
pub fn differences(before: &Value, after: &Value) -> Vec<Difference> {
    let mut all = vec![];
    walk(String::new(), Some(before), Some(after), &mut all);
    all
}

fn walk(path: String, before: Option<&Value>, after: Option<&Value>, all: &mut Vec<Difference>) {
    match (before, after) {
        (Some(Value::Object(b)), Some(Value::Object(a))) => {
            let new = a.keys().filter(|k| !b.contains_key(*k));
            for key in b.keys().chain(new) {
                walk(format!("{path}/{key}"), b.get(key), a.get(key), all);
            }
        }
        (Some(Value::Array(b)), Some(Value::Array(a))) => {
            for i in 0..b.len().max(a.len()) {
                walk(format!("{path}/{i}"), b.get(i), a.get(i), all);
            }
        }
        (Some(b), Some(a)) if same(b, a) => {}
        (b, a) => all.push(Difference {
            path,
            before: printed(b),
            after: printed(a),
        }),
    }
}

fn same(b: &Value, a: &Value) -> bool {
    match (b.as_f64(), a.as_f64()) {
        (Some(b), Some(a)) => b == a || (b - a).abs() <= SAME * b.abs().max(a.abs()),
        _ => b == a,
    }
}

fn printed(v: Option<&Value>) -> String {
    let text = v.map_or_else(|| "-".to_owned(), Value::to_string);
    match text.char_indices().nth(PRINTED) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text,
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn nine_digits_are_the_same_and_eight_are_not() {
        let at = |x: f64| json!({ "a": [1, { "b": x }] });
        assert_eq!(differences(&at(1.0), &at(1.0 + 1e-10)), vec![]);
        let moved = differences(&at(1.0), &at(1.0 + 1e-8));
        assert_eq!(moved.len(), 1);
        assert_eq!(moved[0].path, "/a/1/b");
        assert_eq!(moved[0].kind(), "/a/b");
    }

    #[test]
    fn what_is_absent_on_one_side_has_moved() {
        let (b, a) = (
            json!({ "x": [1], "y": "t" }),
            json!({ "x": [1, 2], "z": null }),
        );
        let paths: Vec<String> = differences(&b, &a).into_iter().map(|d| d.path).collect();
        assert_eq!(paths, ["/x/1", "/y", "/z"]);
    }
}
