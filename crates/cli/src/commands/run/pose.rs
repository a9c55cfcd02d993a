//! How the simulated stand is turned over, on the command line.

use bench::Pose;

/// How long a hand takes to turn it, s.
const TURN_S: f64 = 2.0;

/// Its course.
#[derive(Clone, Debug, PartialEq)]
pub struct Poses(pub Vec<Pose>);

/// `40:+x,80:-x,120:0.1,0,1`: the commas of a direction are told from those between two times by the colon.
pub fn parse(text: &str) -> Result<Poses, String> {
    let wrong =
        |part: &str| format!("`{part}`: write a time and what points up, `40:+x` or `40:0.1,0,1`");
    let mut all: Vec<(f64, String)> = Vec::new();
    for part in text.split(',') {
        match part.split_once(':') {
            Some((time, up)) => {
                let time = time.trim().parse().map_err(|_| wrong(part))?;
                all.push((time, up.trim().to_owned()));
            }
            None => {
                let (_, up) = all.last_mut().ok_or_else(|| wrong(part))?;
                up.push(',');
                up.push_str(part.trim());
            }
        }
    }
    let mut poses: Vec<Pose> = Vec::new();
    for (at_s, up) in all {
        let up = direction(&up).ok_or_else(|| wrong(&up))?;
        let soonest = poses.last().map_or(0.0, |last| last.at_s + TURN_S);
        if at_s.is_nan() || at_s < soonest {
            return Err(format!("{at_s} s: times go up, by {TURN_S} s at least"));
        }
        poses.push(Pose {
            at_s,
            turn_s: TURN_S,
            up,
        });
    }
    Ok(Poses(poses))
}

fn direction(text: &str) -> Option<[f64; 3]> {
    let axis = |k: usize, sign: f64| {
        let mut up = [0.0; 3];
        up[k] = sign;
        up
    };
    match text {
        "+x" => Some(axis(0, 1.0)),
        "-x" => Some(axis(0, -1.0)),
        "+y" => Some(axis(1, 1.0)),
        "-y" => Some(axis(1, -1.0)),
        "+z" => Some(axis(2, 1.0)),
        "-z" => Some(axis(2, -1.0)),
        _ => {
            let numbers: Vec<f64> = text.split(',').map_while(|n| n.parse().ok()).collect();
            let up: [f64; 3] = numbers.try_into().ok()?;
            let length: f64 = up.iter().map(|v| v * v).sum();
            (length.is_finite() && length > 0.0).then_some(up)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_and_sides_or_directions() {
        let poses = parse("0:+x,40:0.1,0,1,80:-z").unwrap().0;
        let ups: Vec<_> = poses.iter().map(|p| (p.at_s, p.up)).collect();
        assert_eq!(
            ups,
            [
                (0.0, [1.0, 0.0, 0.0]),
                (40.0, [0.1, 0.0, 1.0]),
                (80.0, [0.0, 0.0, -1.0])
            ]
        );
        for wrong in [
            "",
            "x",
            "40",
            "40:w",
            "40:0,0,0",
            "40:1,2",
            "40:+x,41:-x",
            "nan:+x",
            "+x,3:+y",
        ] {
            assert!(parse(wrong).is_err(), "{wrong}");
        }
    }
}
