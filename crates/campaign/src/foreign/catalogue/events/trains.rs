//! Events that bring each other about, or that one clock ends.

use super::super::super::prelude::*;

/// A mount that settles: a slip loads its neighbours, so that each slip sets off others, sooner rather than later (Omori 1894),
/// and these again others (Hawkes 1971): minutes of quiet, and swarms. Sizes by a power law, as those of earthquakes; the part
/// turns by each slip, and back.
pub(super) fn aftershocks(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    const MOST: usize = 2000;
    let brings = draw.between(0.75, 0.92);
    let quiet = draw.by_ratio(8.0, 25.0);
    let mut slips = vec![];
    let mut at = quiet * draw.exponential();
    while at < stand.seconds {
        slips.push(at);
        at += quiet * draw.exponential();
    }
    let mut next = 0;
    while next < slips.len().min(MOST) {
        // As many as a process of Poisson has.
        let mut left = brings - draw.exponential();
        while left > 0.0 {
            // By one over the time, s.
            let then = slips[next] + draw.by_ratio(0.1, 30.0);
            if then < stand.seconds {
                slips.push(then);
            }
            left -= draw.exponential();
        }
        next += 1;
    }
    let back = draw.by_ratio(0.05, 0.25);
    let mut kicks = vec![0.0; stand.samples()];
    for at in slips {
        let size = draw.sign() * draw.between(0.05, 1.0).powf(-0.6);
        add_at(&mut kicks, (at * stand.rate_hz) as usize, [size]);
    }
    leaking(&kicks, back, stand.rate_hz)
}

/// A tap that drips: how long a drop takes to fall hangs on how far the one before has sprung back, by a law that has no period
/// (Shaw 1984): a short wait tells how long the next one is, and nothing tells the tenth. Each drop is the same blow.
pub(super) fn dripping(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let mean = draw.by_ratio(0.8, 2.5);
    let (bend, wide) = (draw.between(1.75, 1.95), draw.between(0.35, 0.6));
    let fades = draw.by_ratio(0.06, 0.2);
    let mut place = draw.between(-0.5, 0.5);
    let mut blows = vec![0.0; stand.samples()];
    let mut at = draw.between(0.0, 2.0);
    while at < stand.seconds {
        strike(&mut blows, at * stand.rate_hz, 1.0);
        // The air moves the drops a little.
        place = (1.0 - bend * place * place + 0.003 * draw.normal()).clamp(-1.0, 1.0);
        at += mean * (1.0 + wide * place);
    }
    let blows = either_way(draw, &blows);
    about_mean(&leaking(&blows, fades, stand.rate_hz))
}

/// A register of the zero whose bits particles flip at random, and a scrubber that comes by at a fixed period and puts right what
/// it finds: each flip is a step by one weight of a bit, up where a 0 stood and down where a 1 did, and all of them end on the
/// same clock.
pub(super) fn scrubbed(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    const BITS: usize = 4;
    let stored: [f64; BITS] = std::array::from_fn(|_| draw.sign());
    let period = draw.by_ratio(6.0, 20.0);
    let often = period * draw.between(0.4, 1.0);
    let (mut flipped, mut to_flip) = ([false; BITS], draw.exponential() * often);
    let mut to_scrub = period * draw.between(0.0, 1.0);
    let steps = stand.series(|_| {
        to_flip -= 1.0 / stand.rate_hz;
        to_scrub -= 1.0 / stand.rate_hz;
        if to_scrub <= 0.0 {
            (flipped, to_scrub) = ([false; BITS], to_scrub + period);
        }
        if to_flip <= 0.0 {
            flipped[draw.of_many(BITS)] ^= true;
            to_flip += often * draw.exponential();
        }
        let weight = |k: usize| one_if(flipped[k]) * stored[k] * f64::from(1 << k);
        (0..BITS).map(weight).sum()
    });
    about_mean(&steps)
}
