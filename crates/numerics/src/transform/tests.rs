//! Tests of [`super`].

use super::*;

fn record(n: usize) -> Vec<f64> {
    (0..n)
        .map(|i| (i as f64 * 0.7).sin() + 0.01 * ((i * 7919) % 101) as f64)
        .collect()
}

#[test]
fn coefficients_are_their_sums_and_go_back() {
    for n in [2, 3, 4, 6, 7, 10, 16, 27, 30, 64, 101, 202] {
        let (dct, x) = (Dct::new(n), record(n));
        let c = dct.forward(&x);
        for (k, found) in c.iter().enumerate() {
            let share = if k == 0 { 1.0 } else { 2.0 } / n as f64;
            let angle = |i: usize| PI * k as f64 * (i as f64 + 0.5) / n as f64;
            let sum: f64 = x.iter().enumerate().map(|(i, v)| v * angle(i).cos()).sum();
            assert!((found - share.sqrt() * sum).abs() < 1e-12, "{n} {k}");
        }
        for (a, b) in dct.inverse(&c).iter().zip(&x) {
            assert!((a - b).abs() < 1e-12, "{n}");
        }
    }
}

#[test]
fn several_at_once_are_what_each_is_alone() {
    for n in [1, 3, 4, 10, 27, 101] {
        let dct = Dct::new(n);
        let all: Vec<Vec<f64>> = (0..3).map(|i| record(n + i)[i..].to_vec()).collect();
        let close = |a: &[f64], b: &[f64]| {
            let mut pairs = a.iter().zip(b);
            assert!(
                a.len() == n && pairs.all(|(a, b)| (a - b).abs() < 1e-12),
                "{n}"
            );
        };
        let c: Vec<Vec<f64>> = dct.forward_all(&all).collect();
        for ((c, back), x) in c.iter().zip(dct.inverse_all(&c)).zip(&all) {
            close(c, &dct.forward(x));
            close(&back, x);
        }
    }
}

#[test]
fn in_short_numbers_they_are_the_same_about_any_level() {
    for (n, level) in [(4096, 0.0), (3125, 300.0), (6000, -1e4), (2003, 1e6)] {
        let dct = Dct::new(n);
        let all: Vec<Vec<f64>> = (0..3)
            .map(|i| record(n + i)[i..].iter().map(|v| v + level).collect())
            .collect();
        for (short, x) in dct.short(&all).zip(&all) {
            let whole = dct.forward(x);
            let error = |k: usize| f64::from(short[k]) - whole[k];
            let rms = |of: &dyn Fn(usize) -> f64| {
                (1..n).map(|k| of(k).powi(2)).sum::<f64>().sqrt() / (n as f64).sqrt()
            };
            let size = rms(&|k| whole[k]);
            assert!(rms(&error) < 6e-7 * size, "{n}: {:e}", rms(&error) / size);
            let most = whole[1..].iter().fold(0.0, |m: f64, c| m.max(c.abs()));
            for k in 1..n {
                let (e, bound) = (error(k).abs(), 1e-6 * size + 4e-7 * most);
                assert!(e < bound, "{n} {k}: {e:e}, not {bound:e}");
            }
            assert!(error(0).abs() < 1e-6 * (size + whole[0].abs()), "{n}");
        }
    }
}

#[test]
fn energies_are_those_of_the_fourier_transform() {
    for n in [5, 8, 30] {
        let x = record(n);
        let dct = Dct::new(n);
        let of_both = [dct.energies(&dct.forward(&x)), dct.energies_of(x.clone())];
        for (k, found) in of_both.iter().flat_map(|e| e.iter().enumerate()) {
            let sum: Complex<f64> = x
                .iter()
                .enumerate()
                .map(|(j, v)| Complex::from_polar(*v, -PI * (j * k) as f64 / n as f64))
                .sum();
            assert!((found - sum.norm_sqr()).abs() < 1e-9, "{n} {k}");
        }
    }
}

#[test]
fn energies_of_a_long_record_are_those_of_whole_numbers() {
    for n in [LONG + 6, LONG + 7] {
        let x = record(n);
        let dct = Dct::new(n);
        let c = dct.forward(&x);
        let whole = energies(dct.in_whole(), &c, x.clone());
        let mean = whole.iter().sum::<f64>() / n as f64;
        for short in [dct.energies(&c), dct.energies_of(x)] {
            let off = |(a, b): (&f64, &f64)| (a - b).abs() / (mean + b);
            let most = short.iter().zip(&whole).map(off).fold(0.0, f64::max);
            assert!(most < 1e-3, "{n} {most}");
        }
    }
}

#[test]
fn a_real_transform_is_the_complex_one() {
    for n in [2, 6, 20] {
        let x = record(n);
        let mut seen = 0;
        RealFft::new(n).run(
            |j| Complex::new(x[2 * j], x[2 * j + 1]),
            |k, f| {
                let terms = x.iter().enumerate();
                let direct: Complex<f64> = terms
                    .map(|(j, v)| Complex::from_polar(*v, -2.0 * PI * (j * k) as f64 / n as f64))
                    .sum();
                assert!((f - direct).norm() < 1e-10, "{n} {k}");
                seen += 1;
            },
        );
        assert_eq!(seen, n / 2 + 1);
    }
}
