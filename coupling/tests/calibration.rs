//! Fits of made-up data, where the truth is known.

use colluvium_coupling::calibration::thesis::{
    Estimator, Row, TABLE_2_6, VelocityProfile, estimator_fits, published_row,
};
use colluvium_coupling::calibration::{FitError, LocalPoint, MuIFit, Stress, fit_mu_i, mu_of_i};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

const TRUTH: [f64; 3] = [0.45, 0.80, 0.30];

/// Layers of several runs: counting noise in each layer's I and μ, and a shift of μ common to a run.
fn draw(
    rng: &mut ChaCha8Rng,
    runs: &[(f64, f64)],
    layers: usize,
    own: f64,
    common: f64,
) -> Vec<LocalPoint> {
    let mut normal = || rng.sample::<f64, _>(StandardNormal);
    let mut points = Vec::new();
    for (run, &(low, high)) in runs.iter().enumerate() {
        let shift = common * normal();
        for k in 0..layers {
            let i = low + (high - low) * k as f64 / (layers - 1) as f64;
            let mu = mu_of_i(TRUTH[0], TRUTH[1], TRUTH[2], i);
            let i_error = 0.03 * i;
            points.push(LocalPoint {
                slope_degrees: 30.0 + run as f64,
                z: k as f64,
                inertial_number: i + i_error * normal(),
                inertial_number_error: i_error,
                friction: mu + shift + own * normal(),
                friction_error: own,
                friction_zz: 0.95 * mu + shift + own * normal(),
                friction_zz_error: own,
                solid_fraction: 0.58 - 0.15 * i + 0.002 * normal(),
                solid_fraction_error: 0.002,
            });
        }
    }
    points
}

const WIDE: [(f64, f64); 8] = [
    (0.02, 0.05),
    (0.05, 0.1),
    (0.1, 0.2),
    (0.2, 0.3),
    (0.3, 0.5),
    (0.5, 0.8),
    (0.8, 1.3),
    (1.3, 2.0),
];

fn coverage(own: f64, common: f64) -> ([f64; 3], [f64; 3], f64) {
    let mut rng = ChaCha8Rng::seed_from_u64(17);
    let draws = 300;
    let mut inside = [0.0; 3];
    let mut bias = [0.0; 3];
    let mut narrow = 0.0;
    for _ in 0..draws {
        let fit = fit_mu_i(
            &draw(&mut rng, &WIDE, 12, own, common),
            Stress::MeanPressure,
        )
        .expect("made-up data can be fitted");
        let pairs = [
            (fit.mu_s, fit.mu_s_error),
            (fit.mu_2, fit.mu_2_error),
            (fit.i_0, fit.i_0_error),
        ];
        for (k, (value, error)) in pairs.into_iter().enumerate() {
            inside[k] += f64::from(u8::from((value - TRUTH[k]).abs() < error)) / f64::from(draws);
            bias[k] += (value / TRUTH[k] - 1.0) / f64::from(draws);
        }
        let unscaled = fit.mu_s_error / fit.error_scale;
        narrow += f64::from(u8::from((fit.mu_s - TRUTH[0]).abs() < unscaled)) / f64::from(draws);
    }
    (inside, bias, narrow)
}

#[test]
fn errors_cover_the_truth_with_independent_layers() {
    let (inside, bias, _) = coverage(0.004, 0.0);
    println!("independent layers: coverage {inside:.3?}, relative bias {bias:.4?}");
    // Taking the largest of three scales is a little wide.
    assert!(
        inside.iter().all(|c| (0.62..0.85).contains(c)),
        "{inside:?}"
    );
    assert!(bias.iter().all(|b| b.abs() < 0.02), "{bias:?}");
}

#[test]
fn errors_cover_the_truth_when_layers_of_a_run_move_together() {
    let (inside, bias, narrow) = coverage(0.002, 0.01);
    println!("correlated layers: coverage {inside:.3?}, bias {bias:.4?}, unscaled {narrow:.3}");
    assert!(
        inside.iter().all(|c| (0.55..0.82).contains(c)),
        "{inside:?}"
    );
    assert!(bias.iter().all(|b| b.abs() < 0.05), "{bias:?}");
    // Control: as if all layers were independent.
    assert!(narrow < 0.4, "{narrow}");
}

#[test]
fn exact_data_give_exact_parameters_and_a_band() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let points: Vec<_> = draw(&mut rng, &WIDE, 12, 0.002, 0.0)
        .into_iter()
        .map(|p| LocalPoint {
            friction: mu_of_i(TRUTH[0], TRUTH[1], TRUTH[2], p.inertial_number),
            ..p
        })
        .collect();
    let fit = fit_mu_i(&points, Stress::MeanPressure).unwrap();
    assert!(
        (fit.mu_s - 0.45).abs() < 1e-9 && (fit.mu_2 - 0.8).abs() < 1e-9,
        "{fit:?}"
    );
    assert!((fit.i_0 - 0.3).abs() < 1e-8);
    assert!(fit.identified, "{}", fit.identifiability);
    let (mu, error) = fit.band(0.3);
    assert!((mu - 0.625).abs() < 1e-9);
    // Inside the data the band is narrower than either end of the law.
    assert!(error > 0.0 && error < fit.mu_s_error && error < fit.mu_2_error);
    let phi = fit.solid_fraction_of_i.unwrap();
    assert!((phi.intercept - 0.58).abs() < 0.002 && (phi.slope - 0.15).abs() < 0.005);
    let zz = fit_mu_i(&points, Stress::NormalPressure).unwrap();
    assert!((zz.mu_s / 0.45 - 0.95).abs() < 0.02 && zz.stress == Stress::NormalPressure);
}

#[test]
fn a_narrow_range_is_flagged_in_words() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let narrow: Vec<(f64, f64)> = (0..5)
        .map(|k| (0.02 + 0.01 * f64::from(k), 0.03 + 0.01 * f64::from(k)))
        .collect();
    match fit_mu_i(
        &draw(&mut rng, &narrow, 10, 0.004, 0.002),
        Stress::MeanPressure,
    ) {
        Ok(fit) => {
            assert!(!fit.identified);
            assert!(
                fit.identifiability.contains("Not all parameters"),
                "{}",
                fit.identifiability
            );
        }
        Err(error) => assert_eq!(error, FitError::Degenerate),
    }
    let wide: MuIFit = fit_mu_i(
        &draw(&mut rng, &WIDE, 10, 0.004, 0.002),
        Stress::MeanPressure,
    )
    .unwrap();
    assert!(wide.identified, "{}", wide.identifiability);
}

#[test]
fn the_height_of_the_law_is_judged_with_the_covariance() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let slow: Vec<(f64, f64)> = (0..6)
        .map(|k| 0.1 + 0.1 * f64::from(k))
        .map(|i| (i, i + 0.1))
        .collect();
    let mut differ = 0;
    for draw_number in 0..200 {
        // From well known to hardly known, so that some come near the limit of 50 %.
        let own = 0.0005 * f64::from(draw_number % 50 + 1);
        let points = draw(&mut rng, &slow, 10, own, 0.5 * own);
        let Ok(fit) = fit_mu_i(&points, Stress::MeanPressure) else {
            continue;
        };
        let c = &fit.covariance;
        let height = fit.mu_2 - fit.mu_s;
        let error = (c[0][0] + c[1][1] - 2.0 * c[0][1]).sqrt();
        let flagged = fit.identifiability.contains("mu_2 - mu_s");
        assert_eq!(flagged, error >= 0.5 * height, "{}", fit.identifiability);
        differ += u32::from(flagged != (fit.mu_s_error.hypot(fit.mu_2_error) >= 0.5 * height));
    }
    println!("as if uncorrelated, {differ} of 200 draws would be judged otherwise");
    assert!(differ > 0);
}

#[test]
fn a_law_that_no_material_has_is_called_so() {
    let mut rng = ChaCha8Rng::seed_from_u64(6);
    let points = draw(&mut rng, &WIDE, 12, 0.004, 0.002);
    let law = |mu_s: f64, mu_2: f64| {
        let moved: Vec<_> = points
            .iter()
            .map(|p| LocalPoint {
                friction: mu_of_i(mu_s, mu_2, 0.3, p.inertial_number),
                ..*p
            })
            .collect();
        fit_mu_i(&moved, Stress::MeanPressure).unwrap()
    };
    assert!(law(0.45, 0.8).physical && law(0.0001, 0.8).physical);
    let negative = law(-0.1, 0.8);
    assert!(!negative.physical && negative.mu_s < 0.0);
    let falling = law(0.8, 0.45);
    assert!(!falling.physical && falling.mu_2 < falling.mu_s);
}

#[test]
fn bad_points_are_named() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let mut points = draw(&mut rng, &WIDE, 4, 0.004, 0.0);
    points[7].friction_error = 0.0;
    let message = fit_mu_i(&points, Stress::MeanPressure)
        .unwrap_err()
        .to_string();
    assert!(
        message.contains("point 7") && message.contains("mu error"),
        "{message}"
    );
    assert!(matches!(
        fit_mu_i(&points[..3], Stress::MeanPressure),
        Err(FitError::TooFewPoints {
            found: 3,
            needed: 4
        })
    ));
}

/// A Bagnold profile with uniform I in layers of 1 d, with P from φρ_s.
fn bagnold(slope_degrees: f64, i: f64, phi: f64) -> VelocityProfile {
    let slope = slope_degrees.to_radians();
    let (h, d, g): (f64, f64, f64) = (0.245, 0.01, 9.81);
    let z: Vec<f64> = (0..25).map(|k| 0.01 * (f64::from(k) + 0.5) - 0.0).collect();
    let h0 = h;
    let u = z
        .iter()
        .map(|z| {
            2.0 * i * h0.powf(1.5) / (3.0 * d)
                * (phi * g * slope.cos()).sqrt()
                * (1.0 - (1.0 - z / h0).max(0.0).powf(1.5))
        })
        .collect();
    VelocityProfile {
        slope,
        gravity: g,
        diameter: d,
        u,
        phi: vec![phi; z.len()],
        z,
    }
}

#[test]
fn thesis_estimators_return_a_known_inertial_number() {
    let flow = bagnold(33.0, 0.25, 0.5);
    for estimator in [Estimator::Top, Estimator::Mean, Estimator::MinimalResidual] {
        let with = flow.inertial_number(estimator, true).unwrap();
        let without = flow.inertial_number(estimator, false).unwrap();
        assert!((with - 0.25).abs() < 1e-3, "{estimator:?} {with}");
        assert!((with / without - 2f64.sqrt()).abs() < 1e-9);
    }
    let empty = VelocityProfile {
        phi: vec![0.1; 25],
        ..flow
    };
    assert_eq!(empty.inertial_number(Estimator::Top, true), None);
}

#[test]
fn thesis_fit_and_table() {
    let [mu_s, mu_2, i_0] = [0.506, 0.815, 0.332];
    let flows: Vec<_> = [31.0f64, 32.0, 33.0, 34.0, 35.0, 36.0]
        .iter()
        .map(|s| {
            let t = s.to_radians().tan();
            bagnold(*s, i_0 * (t - mu_s) / (mu_2 - t), 0.5)
        })
        .collect();
    let fits = estimator_fits(&flows);
    assert_eq!(fits.len(), 6);
    let top = fits
        .iter()
        .find(|f| f.estimator == Estimator::Top && f.with_phi)
        .unwrap();
    // Digest of the thesis: I = 0.147 at 31° and 0.828 at 36° under this row.
    assert!((top.points[0][1] - 0.147).abs() < 1e-3 && (top.points[5][1] - 0.828).abs() < 2e-3);
    let row = top.row.unwrap();
    assert!(
        (row.mu_s[0] - mu_s).abs() < 1e-4 && (row.i_0[0] - i_0).abs() < 1e-3,
        "{row:?}"
    );
    let published = published_row("moderate", Estimator::Top, true).unwrap();
    assert_eq!(published.mu_2, [0.815, 0.017]);
    assert!(row.differences(published).iter().all(|d| d.abs() < 0.1));
    let far = Row {
        mu_s: [0.4, 0.019],
        ..*published
    };
    assert!((far.differences(published)[0] + 0.106 / (0.019 * 2f64.sqrt())).abs() < 1e-9);
    assert!(published_row("gravel", Estimator::MinimalResidual, true).is_none());
    assert_eq!(TABLE_2_6.len(), 6);
    let few = estimator_fits(&flows[..3]);
    assert!(few[0].row.is_none() && few[0].failure.as_deref().unwrap().contains("3 points"));
}
