//! Posterior, residual tests, competing laws and the free-form table on made-up data.

use colluvium_coupling::calibration::{
    Law, LocalPoint, Stress, compare_laws, fit_free_form, fit_mu_i, mu_of_i, residual_tests,
    sample_posterior,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

const TRUTH: [f64; 3] = [0.45, 0.80, 0.30];

fn jop(i: f64) -> f64 {
    mu_of_i(TRUTH[0], TRUTH[1], TRUTH[2], i)
}

/// Ten layers of each of eight runs, I from 0.02 to 2; every run has a shift of its own in μ.
fn draw(rng: &mut ChaCha8Rng, law: &dyn Fn(f64) -> f64, own: f64, common: f64) -> Vec<LocalPoint> {
    let mut normal = || rng.sample::<f64, _>(StandardNormal);
    let mut points = Vec::new();
    for run in 0..8 {
        let shift = common * normal();
        for k in 0..10 {
            let i = 0.02 * 10f64.powf((f64::from(run) + 0.1 * f64::from(k)) / 4.0);
            let friction = law(i) + shift + own * normal();
            points.push(LocalPoint {
                slope_degrees: 30.0 + f64::from(run),
                z: f64::from(k),
                inertial_number: i * (1.0 + 0.03 * normal()),
                inertial_number_error: 0.03 * i,
                friction,
                friction_error: own,
                friction_zz: 0.95 * friction,
                friction_zz_error: own,
                solid_fraction: 0.58 - 0.15 * i,
                solid_fraction_error: 0.002,
            });
        }
    }
    points
}

#[test]
fn credible_intervals_cover_the_truth_at_their_rate() {
    let mut rng = ChaCha8Rng::seed_from_u64(21);
    let draws = 200;
    let (mut narrow, mut wide) = ([0.0; 3], [0.0; 3]);
    let mut mixing = [1.0, 1000.0f64];
    for seed in 0..draws {
        let points = draw(&mut rng, &jop, 0.003, 0.006);
        let fit = fit_mu_i(&points, Stress::MeanPressure).unwrap();
        let posterior = sample_posterior(&points, &fit, seed).unwrap();
        mixing[0] = mixing[0].min(posterior.acceptance);
        mixing[1] = mixing[1].min(posterior.effective_samples);
        for k in 0..3 {
            let [a, b, _, c, d] = posterior.quantiles[k];
            narrow[k] += f64::from(u8::from((b..c).contains(&TRUTH[k]))) / draws as f64;
            wide[k] += f64::from(u8::from((a..d).contains(&TRUTH[k]))) / draws as f64;
        }
    }
    println!(
        "68 % intervals cover {narrow:.3?}, 95 % intervals {wide:.3?}; at least {mixing:.3?} taken, independent"
    );
    assert!(mixing[0] > 0.3 && mixing[1] > 400.0, "{mixing:?}");
    // Eight runs tell the scatter between runs to a quarter: Student's tails, and a floor of 1 on the scale.
    assert!(
        narrow.iter().all(|c| (0.56..0.82).contains(c)),
        "{narrow:?}"
    );
    assert!(wide.iter().all(|c| (0.85..=1.0).contains(c)), "{wide:?}");
}

/// The posterior of I_0 summed up on a grid of (μ_a, μ_b, ln I_0), the frictions at the ends of the data, beside the samples:
/// where the data end below I_0 and the prior has a say, and where they span it.
#[test]
fn samples_are_those_of_the_posterior() {
    for (seed, scale) in [(11, 1.0), (12, 0.15)] {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let law = |i: f64| jop(i * scale);
        let points = draw(&mut rng, &law, 0.004, 0.0);
        let fit = fit_mu_i(&points, Stress::MeanPressure).unwrap();
        assert!(fit.scale_freedom.is_none() && fit.physical);
        let posterior = sample_posterior(&points, &fit, seed).unwrap();
        let [low, high] = fit.valid_i;
        // No farther than the prior goes, and where samples are.
        let all = posterior.samples.iter().map(|s| s[2]);
        let (first, last) = all.fold((f64::INFINITY, 0.0f64), |(a, b), x| (a.min(x), b.max(x)));
        let limits = [
            (0.9 * first).max(low / 100.0).ln(),
            (1.1 * last).min(high * 100.0).ln(),
        ];
        let ends = [low, high].map(|i| fit.band(i));
        let mut density = Vec::new();
        for u in 0..200 {
            let i_0 = (limits[0] + (f64::from(u) + 0.5) / 200.0 * (limits[1] - limits[0])).exp();
            let [a, b] = [low, high].map(|i| i / (i + i_0));
            let mut sum = 0.0;
            for j in -24..=24 {
                for k in -24..=24 {
                    let at = |n: i32, (mu, error): (f64, f64)| mu + 0.25 * f64::from(n) * error;
                    let (mu_a, mu_b) = (at(j, ends[0]), at(k, ends[1]));
                    let span = (mu_b - mu_a) / (b - a);
                    let mu_s = mu_a - span * a;
                    if mu_s < 0.0 || span <= 0.0 {
                        continue;
                    }
                    let log = points.iter().map(|p| {
                        let i = p.inertial_number;
                        let slope = span * i_0 / ((i + i_0) * (i + i_0));
                        let lever = slope * p.inertial_number_error;
                        let variance = p.friction_error.powi(2) + lever * lever;
                        let miss = p.friction - mu_s - span * i / (i + i_0);
                        -0.5 * (miss * miss / variance + (variance / 1.6e-5).ln())
                    });
                    let log = log.sum::<f64>() / fit.error_scale.powi(2);
                    sum += (log + 0.5 * fit.chi_square).exp();
                }
            }
            density.push((i_0, sum));
        }
        let total: f64 = density.iter().map(|d| d.1).sum();
        let mut found = Vec::new();
        for value in posterior.quantiles[2] {
            let below = density.iter().filter(|d| d.0 < value).map(|d| d.1);
            found.push(below.sum::<f64>() / total);
        }
        println!(
            "posterior of I_0 below the samples' quantiles: {found:.3?}, I_0 {:.3?}",
            posterior.quantiles[2]
        );
        for (found, wanted) in found.iter().zip([0.025, 0.16, 0.5, 0.84, 0.975]) {
            // Three errors of 700 independent samples, and a step of the grid.
            let error = 3.0 * (wanted * (1.0 - wanted) / 700.0_f64).sqrt() + 0.015;
            assert!((found - wanted).abs() < error, "{found} {wanted}");
        }
    }
}

#[test]
fn the_same_seed_gives_the_same_samples() {
    let points = draw(&mut ChaCha8Rng::seed_from_u64(1), &jop, 0.003, 0.005);
    let fit = fit_mu_i(&points, Stress::MeanPressure).unwrap();
    let first = sample_posterior(&points, &fit, 7).unwrap();
    assert_eq!(first, sample_posterior(&points, &fit, 7).unwrap());
    assert_ne!(first, sample_posterior(&points, &fit, 8).unwrap());
    assert!(
        first.effective_samples > 600.0,
        "{}",
        first.effective_samples
    );
    let [_, low, middle, high, _] = first.band(|[s, d, i]| mu_of_i(s, d, i, 0.3)).unwrap();
    let (mu, error) = fit.band(0.3);
    assert!((middle - mu).abs() < error && high > low);
    assert!(
        (0.5 * (high - low) / error - 1.0).abs() < 0.3,
        "{low} {high} {error}"
    );
}

#[test]
fn the_true_law_wins() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let mut wins = [0; 3];
    for _ in 0..40 {
        let laws: [(&dyn Fn(f64) -> f64, Law); 3] = [
            (&|i| 0.4 + 0.2 * i, Law::Linear),
            (&jop, Law::Jop),
            (
                &|i| (0.45 * 0.2 + 0.7 * i + 0.25 * i * i) / (0.2 + i),
                Law::BarkerGray,
            ),
        ];
        for (won, (law, name)) in wins.iter_mut().zip(laws) {
            let points = draw(&mut rng, law, 0.004, 0.002);
            let list = compare_laws(&points, Stress::MeanPressure).unwrap();
            *won += usize::from(list[0].law == name);
            let sum: f64 = list.iter().map(|a| a.weight).sum();
            assert!((sum - 1.0).abs() < 1e-12);
        }
    }
    println!("of 40 draws the true law is preferred in {wins:?} (linear, Jop, Barker-Gray)");
    assert!(wins.iter().all(|w| *w >= 32), "{wins:?}");
}

#[test]
fn residuals_of_the_true_law_are_noise_and_others_are_told() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let draws = 200;
    let mut alarms = [0.0; 3];
    for _ in 0..draws {
        let points = draw(&mut rng, &jop, 0.003, 0.0);
        let fit = fit_mu_i(&points, Stress::MeanPressure).unwrap();
        let tests = residual_tests(&points, &fit).unwrap();
        for (alarm, p) in alarms
            .iter_mut()
            .zip([tests.signs, tests.between_runs, tests.depth])
        {
            *alarm += f64::from(u8::from(p < 0.05)) / f64::from(draws);
        }
    }
    println!("false alarms at 5 %: signs, runs, depth {alarms:.3?}");
    assert!(alarms.iter().all(|a| *a < 0.11), "{alarms:?}");

    let told = |change: &dyn Fn(&mut LocalPoint)| {
        let mut points = draw(&mut ChaCha8Rng::seed_from_u64(6), &jop, 0.003, 0.0);
        points.iter_mut().for_each(change);
        let fit = fit_mu_i(&points, Stress::MeanPressure).unwrap();
        residual_tests(&points, &fit).unwrap()
    };
    let runs = told(&|p| p.friction += 0.01 * (7.0 * p.slope_degrees).sin());
    assert!(
        runs.depends_on_run() && !runs.depends_on_place(),
        "{runs:?}"
    );
    let place = told(&|p| p.friction += 0.03 * (p.z / 9.0 - 0.5));
    assert!(place.depends_on_place(), "{place:?}");
    // Jop's law is steepest where I is least, so a part of the trend goes into the curve.
    assert!((place.depth_change - 0.03).abs() < 0.012, "{place:?}");
    let shape = told(&|p| p.friction += 0.02 * (4.0 * p.inertial_number.ln()).sin());
    assert!(shape.wrong_shape(), "{shape:?}");
}

#[test]
fn a_free_table_keeps_its_constraints_and_finds_the_curve() {
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let points = draw(&mut rng, &jop, 0.003, 0.0);
    let table = fit_free_form(&points, Stress::MeanPressure, 9, true).unwrap();
    for (k, i) in table.inertial_number.iter().enumerate() {
        let miss = table.friction[k] - jop(*i);
        assert!(miss.abs() < 0.01, "{i} {miss}");
    }
    assert!(table.friction.windows(2).all(|w| w[1] >= w[0]));
    let slope = |k: usize| {
        (table.friction[k + 1] - table.friction[k])
            / (table.inertial_number[k + 1] - table.inertial_number[k])
    };
    assert!((1..8).all(|k| slope(k) <= slope(k - 1) + 1e-6));

    // A law that falls: the table goes level and says that the constraint binds.
    let falls = |i: f64| 0.6 - 0.1 * i;
    let points = draw(&mut rng, &falls, 0.003, 0.0);
    let level = fit_free_form(&points, Stress::MeanPressure, 9, false).unwrap();
    assert!(level.friction.windows(2).all(|w| w[1] >= w[0]));
    assert!(level.binding >= 7 && level.rms_residual > 0.01, "{level:?}");
    assert!(fit_free_form(&points, Stress::MeanPressure, 1, false).is_err());
}
