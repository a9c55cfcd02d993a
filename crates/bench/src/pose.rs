//! Which way the stand lies: turned by somebody from one side to another, on a course that is laid down beforehand.
//!
//! An orientation is where up points, in the axes of the base. Heading is of no account: the Earth's rotation is not felt here.

use std::f64::consts::{FRAC_PI_2, PI};

/// From `at_s` on the stand is turned until up points along `up`, and stays so.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// When the turning begins, s since power came on.
    pub at_s: f64,
    /// How long it takes, s.
    pub turn_s: f64,
    /// Where up points then, in the axes of the base; of any length but 0.
    pub up: [f64; 3],
}

/// How the stand lies while nobody has turned it.
const UPRIGHT: [f64; 3] = [0.0, 0.0, 1.0];

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn unit(a: [f64; 3]) -> [f64; 3] {
    let length = dot(a, a).sqrt();
    a.map(|value| value / length)
}

/// The turn from one direction to another: its axis and its angle, rad.
fn turn(from: [f64; 3], to: [f64; 3]) -> ([f64; 3], f64) {
    let normal = cross(from, to);
    let sine = dot(normal, normal).sqrt();
    if sine > 1e-9 {
        return (normal.map(|value| value / sine), sine.atan2(dot(from, to)));
    }
    // Over to the other side, about what lies across: any such axis does.
    let across = if from[0].abs() < 0.5 {
        [1.0, 0.0, 0.0]
    } else {
        [0.0, 1.0, 0.0]
    };
    let angle = if dot(from, to) < 0.0 { PI } else { 0.0 };
    (unit(cross(from, across)), angle)
}

/// A direction turned about a unit axis by an angle, rad (Rodrigues).
fn turned(v: [f64; 3], axis: [f64; 3], angle: f64) -> [f64; 3] {
    let (sin, cos) = angle.sin_cos();
    let (across, along) = (cross(axis, v), dot(axis, v) * (1.0 - cos));
    [0, 1, 2].map(|k| v[k] * cos + across[k] * sin + axis[k] * along)
}

/// Where up points at `t` s in the axes of the base, and how fast the base turns about them, deg/s.
pub(crate) fn at(poses: &[Pose], t: f64) -> ([f64; 3], [f64; 3]) {
    let mut up = UPRIGHT;
    for pose in poses {
        let done = ((t - pose.at_s) / pose.turn_s.max(f64::MIN_POSITIVE)).min(1.0);
        if done < 0.0 {
            break;
        }
        let (axis, angle) = turn(up, unit(pose.up));
        // Up turns this way in the axes of the base, so the base turns the other way. It starts and ends at rest.
        up = turned(up, axis, angle * (1.0 - (PI * done).cos()) / 2.0);
        if done < 1.0 {
            let rate = -angle * FRAC_PI_2 * (PI * done).sin() / pose.turn_s;
            return (up, axis.map(|value| (value * rate).to_degrees()));
        }
    }
    (up, [0.0; 3])
}

/// A direction of the base in the axes of a table that has turned by `azimuth`, rad, about z.
pub(crate) fn on_table(v: [f64; 3], azimuth: f64) -> [f64; 3] {
    let (sin, cos) = azimuth.sin_cos();
    [cos * v[0] + sin * v[1], cos * v[1] - sin * v[0], v[2]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_gyros_feel_of_a_turn_is_what_gravity_makes_of_it() {
        // dv/dt = -w x v for a direction that stands still in space.
        let poses = [
            Pose {
                at_s: 1.0,
                turn_s: 2.0,
                up: [1.0, 0.2, 0.0],
            },
            Pose {
                at_s: 4.0,
                turn_s: 1.5,
                up: [-1.0, -0.2, 0.0],
            },
            Pose {
                at_s: 7.0,
                turn_s: 1.0,
                up: [0.0, 0.0, -3.0],
            },
        ];
        let mut v = UPRIGHT;
        let dt = 1e-5;
        for k in 0..900_000 {
            let (up, rate) = at(&poses, (f64::from(k) + 0.5) * dt);
            let w = rate.map(f64::to_radians);
            let moved = cross(w, v);
            v = [0, 1, 2].map(|k| v[k] - dt * moved[k]);
            assert!((dot(up, up) - 1.0).abs() < 1e-9);
            let apart = [0, 1, 2].map(|k| v[k] - up[k]);
            assert!(dot(apart, apart) < 1e-6, "{k}: {v:?} {up:?}");
        }
        let (up, rate) = at(&poses, 9.0);
        assert!((up[2] + 1.0).abs() < 1e-12 && rate == [0.0; 3], "{up:?}");
    }

    #[test]
    fn each_pose_is_reached_and_one_that_is_there_already_turns_nothing() {
        let sides = [
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, 0.0, 1.0],
            [0.3, -0.8, 0.2],
        ];
        let apart = |a: [f64; 3], b: [f64; 3]| {
            let apart = [0, 1, 2].map(|k| a[k] - b[k]);
            dot(apart, apart).sqrt()
        };
        for side in sides {
            let over = side.map(|value: f64| -value);
            let pose = |at_s, up| Pose {
                at_s,
                turn_s: 1.0,
                up,
            };
            // There, there once more, over to the other side, and back.
            let poses = [
                pose(1.0, side),
                pose(3.0, side),
                pose(5.0, over),
                pose(7.0, side),
            ];
            for (t, wanted) in [
                (2.5, side),
                (3.5, side),
                (4.5, side),
                (6.5, over),
                (8.5, side),
            ] {
                let (up, rate) = at(&poses, t);
                assert!(apart(up, unit(wanted)) < 1e-9, "{t} s: {up:?}");
                assert!(dot(rate, rate).sqrt() < 1e-6, "{t} s: {rate:?}");
            }
            // Half way over it lies across, and turns at its fastest: pi over the second, times pi / 2.
            let (up, rate) = at(&poses, 5.5);
            assert!(dot(up, unit(side)).abs() < 1e-9, "{up:?}");
            assert!(
                (dot(rate, rate).sqrt() / (90.0 * PI) - 1.0).abs() < 1e-9,
                "{rate:?}"
            );
            assert!(dot(rate, up).abs() < 1e-6, "about what lies across");
        }
    }

    #[test]
    fn a_table_that_turns_carries_gravity_round() {
        // 0.5 at 0.6435 rad, seen from 0.4 rad further on.
        let [x, y, z] = on_table([0.4, 0.3, 0.9], 0.4);
        let angle = 0.75f64.atan() - 0.4;
        assert!((x - 0.5 * angle.cos()).abs() < 1e-12, "{x}");
        assert!((y - 0.5 * angle.sin()).abs() < 1e-12 && z == 0.9, "{y} {z}");
        let quarter = on_table([0.1, 0.0, 0.9], FRAC_PI_2);
        assert!(
            (quarter[1] + 0.1).abs() < 1e-12 && quarter[0].abs() < 1e-12,
            "{quarter:?}"
        );
    }
}
