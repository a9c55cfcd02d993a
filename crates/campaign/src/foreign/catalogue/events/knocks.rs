//! Knocks, and what they ring.

use super::super::super::prelude::*;

/// Lorries pass now and then: the ground swells under each, sways at a pitch of its own that the load moves a little, and is
/// still again.
pub(super) fn lorries(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let ground = draw.by_ratio(0.3, 2.0);
    arriving(stand, draw.between(2.0, 25.0), |y, at| {
        let (takes, size) = (draw.by_ratio(1.5, 4.0), draw.between(0.5, 1.5));
        let (pitch, first) = (ground * draw.between(0.85, 1.15), draw.phase());
        let packet = in_time(stand, |t| {
            let since = t - at;
            size * (-0.5 * (since / takes).powi(2)).exp() * (first + TAU * pitch * since).sin()
        });
        add_at(y, 0, packet);
        at + (4.0 * takes + 25.0 * draw.exponential())
    })
}

/// A washer or a ball falls on the bench and bounces: each bounce is as high as the square of the restitution times the one
/// before, so that the blows come ever faster, each weaker by the restitution, and end after a finite time although there
/// are more than can be counted. Each blow turns the part on its mount, which swings back.
pub(super) fn ball(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    const GRAVITY: f64 = 9.81;
    // How much of a turn is left after a sample: the mount's stiffness.
    let back = draw.between(0.3, 0.8);
    arriving(stand, draw.between(2.0, 20.0), |y, at| {
        let (height, restitution) = (draw.by_ratio(0.1, 1.0), draw.between(0.8, 0.95));
        let size = draw.sign() * height.sqrt();
        let (mut flight, mut blow, mut hit) = ((8.0 * height / GRAVITY).sqrt(), size, at);
        while blow.abs() > 0.05 * size.abs() {
            let place = hit * stand.rate_hz;
            // A blow within a sample is shared with the next one.
            let late = place.fract();
            let shares = [1.0 - late, late - back * (1.0 - late), -back * late];
            add_at(y, place as usize, shares.map(|share| blow * share));
            flight *= restitution;
            hit += flight;
            blow *= restitution;
        }
        hit + 3.0 + 30.0 * draw.exponential()
    })
}

/// What passes a chain of all-pass filters of this pole: every pitch as loud as before, each with a delay of its own.
fn dispersed(series: Vec<f64>, stages: usize, pole: f64) -> Vec<f64> {
    let passed = |(last, out): (f64, f64), v: f64| (v, last - pole * v + pole * out);
    (0..stages).fold(series, |series, _| {
        each(&carry((0.0, 0.0), &series, passed), |(_, out)| out)
    })
}

/// Knocks on a long pipe, in which bending waves of high pitch run ahead of low ones, or the other way round: each arrives
/// as a whistle whose pitch slides, and all of them together are as white as a knock.
pub(super) fn pipe(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let apart = draw.by_ratio(6.0, 25.0);
    let (stages, pole) = (8 + draw.of_many(13), draw.signed(0.4, 0.7));
    let knocks = arriving(stand, apart * draw.exponential(), |knocks, at| {
        let size = draw.signed(0.5, 1.5);
        add_at(knocks, (at * stand.rate_hz) as usize, [size]);
        at + apart * (0.1 + draw.exponential())
    });
    dispersed(knocks, stages, pole)
}

/// Knocks at random on a bench that rings: any sense, many small ones and few large ones.
pub(super) fn knocks(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let mode = (draw.by_ratio(0.7, 9.0), draw.by_ratio(0.3, 3.0));
    let apart = draw.by_ratio(6.0, 30.0);
    arriving(stand, apart * draw.exponential(), |y, at| {
        let size = draw.sign() * (0.3 + draw.exponential());
        ring(y, stand.rate_hz, (at, size), mode, 10.0);
        at + apart * draw.exponential()
    })
}

/// People pass by on a floor that rings: steps at a pace that is nearly regular, each a short ring, growing until the
/// walker is next to the bench.
pub(super) fn footsteps(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let mode = (draw.by_ratio(2.5, 8.0), draw.by_ratio(0.08, 0.25));
    let mut y = vec![0.0; stand.samples()];
    let mut nearest = draw.between(3.0, 15.0);
    while nearest < stand.seconds + 5.0 {
        let (pace, takes) = (draw.between(0.45, 0.65), draw.between(1.5, 5.0));
        let heavy = draw.between(0.6, 1.4);
        let mut at = nearest - 3.0 * takes;
        while at < nearest + 3.0 * takes {
            let size = heavy / (1.0 + ((at - nearest) / takes).powi(2));
            ring(&mut y, stand.rate_hz, (at, size), mode, 6.0);
            at += pace * (1.0 + 0.04 * draw.normal());
        }
        nearest += 10.0 + 30.0 * draw.exponential();
    }
    y
}

/// Whoever leans on the bench moves it by every beat of the heart (ballistocardiography): a stroke there, a larger one
/// back and a smaller one there again, at intervals that follow the breath and wander besides.
pub(super) fn heart(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let rate_hz = stand.rate_hz;
    let (beat, breath) = (draw.between(0.7, 1.1), draw.between(3.0, 6.0));
    let (width, depth) = (draw.between(0.06, 0.1), draw.between(0.03, 0.08));
    let (first, mut off) = (draw.between(0.0, 1.0), 0.0);
    arriving(stand, first, |y, at| {
        let breathes = (TAU * at / breath).sin();
        let size = 1.0 + 0.2 * breathes;
        for (after, share) in [(0.10, -0.6), (0.20, 1.0), (0.31, -0.5)] {
            let middle = (at + after) * rate_hz;
            let first = (middle - 4.0 * width * rate_hz).max(0.0) as usize;
            let off = (first..).map(|k| (k as f64 - middle) / width / rate_hz);
            let beat = off.take_while(|x| *x <= 4.0);
            add_at(y, first, beat.map(|x| size * share * (-0.5 * x * x).exp()));
        }
        off = 0.9 * off + 0.02 * draw.normal();
        at + beat * (1.0 + depth * breathes + off)
    })
}

/// Knocks at the stand: the part rings, has another bias after each, and recovers a part of that. The accelerometers feel
/// the knock itself.
pub(super) fn lasting_shocks(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let at = events(draw, stand, 2, 4);
    for knock in &at {
        let i = (knock * stand.rate_hz).ceil() as usize;
        for acc in &mut stand.world.acc {
            add_at(acc, i, [draw.signed(0.3, 0.9)]);
        }
    }
    let (pitch, rings) = (draw.by_ratio(1.0, 8.5), draw.by_ratio(0.5, 2.5));
    let (recovers, stays) = (draw.by_ratio(4.0, 30.0), draw.between(0.2, 0.5));
    let loud = draw.between(2.0, 5.0);
    let size = sizes(draw, &at);
    let after = |k: usize, t: f64| {
        let ring = loud * (-t / rings).exp() * (TAU * pitch * t).sin();
        let bias = stays + (1.0 - stays) * (-t / recovers).exp();
        size[k] * (ring + bias)
    };
    about_mean(&since(stand, &at, after))
}

/// A part on a spring that stiffens as it bends (Duffing 1918): x'' = -2x'/decay - w^2 (x + x^3), knocked a few times in a
/// run. Large swings are faster than small ones, so each knock starts high and its pitch falls while it fades.
pub(super) fn ring_down(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    const PARTS: usize = 16;
    let h = 1.0 / stand.rate_hz / PARTS as f64;
    let (w, decay) = (TAU * draw.by_ratio(0.5, 3.0), draw.by_ratio(8.0, 40.0));
    let apart = draw.between(40.0, 120.0);
    let (mut x, mut speed) = (0.0, 0.0);
    let mut left = draw.between(5.0, 40.0);
    stand.series(|_| {
        left -= 1.0 / stand.rate_hz;
        if left <= 0.0 {
            speed += w * draw.signed(1.0, 2.5);
            left = apart * draw.between(0.5, 1.5);
        }
        // Half a step of speed, a step of place, half a step of speed.
        for _ in 0..PARTS {
            let pull = |x: f64, v: f64| -2.0 * v / decay - w * w * (x + x.powi(3));
            speed += 0.5 * h * pull(x, speed);
            x += h * speed;
            speed += 0.5 * h * pull(x, speed);
        }
        x
    })
}

/// Where the axles of a carriage are, of its length: two pairs, of which each is near an end. Those of a pair are 1.8 to 2.6 m
/// apart, and a carriage is some 15 to 26 m long.
fn axles(draw: &mut Draw) -> [f64; 4] {
    let (from_end, wheelbase) = (draw.between(0.08, 0.15), draw.between(0.08, 0.15));
    let last = 1.0 - from_end;
    [from_end, from_end + wheelbase, last - wheelbase, last]
}

/// Trains pass: each axle is a stroke at the ground, which has a mode of its own. Carriages are alike, and the strokes come
/// by the axles of each, at the pace of the train, which is 30 to 100 km/h, swelling and fading as it goes by.
pub(super) fn trains(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let ground = (draw.by_ratio(1.5, 8.0), draw.by_ratio(0.3, 1.2));
    let strokes = arriving(stand, draw.between(2.0, 30.0), |strokes, at| {
        let (carriage_s, carriages) = (draw.by_ratio(0.7, 2.5), 4 + draw.of_many(14));
        let (axles, heavy) = (axles(draw), draw.between(0.6, 1.4));
        let lasts = carriage_s * carriages as f64;
        for carriage in 0..carriages {
            let load = heavy * draw.between(0.6, 1.0);
            for axle in axles {
                let since = carriage_s * (carriage as f64 + axle);
                let near = 1.0 / (1.0 + (4.0 * (since / lasts - 0.5)).powi(2));
                strike(strokes, (at + since) * stand.rate_hz, load * near);
            }
        }
        at + (lasts + 5.0 + 30.0 * draw.exponential())
    });
    resonating(&strokes, ground, stand.rate_hz)
}

/// Knocks at a mount that rings, each at once with its swing.
pub(super) fn bursts_of_ringing(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let (f, decay) = (draw.between(0.8, 6.0), draw.between(0.5, 3.0));
    arriving(stand, 5.0, |y, at| {
        let first = (at * stand.rate_hz) as usize;
        let since = (first..).map(|i| i as f64 / stand.rate_hz - at);
        add_at(
            y,
            first,
            since.map(|s| (-s / decay).exp() * (TAU * f * s).sin()),
        );
        at + (15.0 * draw.exponential() + 3.0)
    })
}
