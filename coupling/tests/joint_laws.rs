//! Friction and solid fraction as one law: of made-up layers the criterion finds which of the candidates made them.
use colluvium_coupling::calibration::{
    Fraction, JointComparison, LocalPoint, Stress, compare_joint_laws, mu_of_i,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

/// How layers are made.
#[derive(Clone, Copy)]
struct Truth {
    /// −∂φ/∂I.
    slope: f64,
    /// Deviations of φ that are real: of flows and of layers.
    deviation: [f64; 2],
    /// K.
    dilatancy: f64,
    /// Correlation of neighbouring layers' errors.
    neighbours: f64,
    /// Relative error of I.
    of_i: f64,
}

const PLAIN: Truth = Truth {
    slope: 0.12,
    deviation: [0.004, 0.003],
    dilatancy: 0.0,
    neighbours: 0.0,
    of_i: 0.04,
};

/// Fifteen layers of each of eight flows, I from 0.05 to 1; layers' errors are 0.006 of μ and 0.003 of φ, each flow has a
/// friction of its own, 0.002.
fn draw(rng: &mut ChaCha8Rng, truth: &Truth) -> Vec<LocalPoint> {
    let mut points = Vec::new();
    for flow in 0..8 {
        let mut normal = || rng.sample::<f64, _>(StandardNormal);
        let own = 0.002 * normal();
        let loose = truth.deviation[0] * normal();
        let (mut of_mu, mut of_phi) = (normal(), normal());
        for layer in 0..15 {
            let i = 0.05 * 20f64.powf((f64::from(flow) + 0.05 * f64::from(layer)) / 7.7);
            let fresh = (1.0 - truth.neighbours * truth.neighbours).sqrt();
            of_mu = truth.neighbours * of_mu + fresh * normal();
            of_phi = truth.neighbours * of_phi + fresh * normal();
            let deviation = loose + truth.deviation[1] * normal();
            let friction =
                mu_of_i(0.45, 0.8, 0.3, i) + truth.dilatancy * deviation + own + 0.006 * of_mu;
            points.push(LocalPoint {
                slope_degrees: 25.0 + f64::from(flow),
                z: f64::from(layer),
                inertial_number: i * (1.0 + truth.of_i * normal()),
                inertial_number_error: truth.of_i * i,
                friction,
                friction_error: 0.006,
                friction_zz: 0.95 * friction,
                friction_zz_error: 0.006,
                solid_fraction: 0.58 - truth.slope * i + deviation + 0.003 * of_phi,
                solid_fraction_error: 0.003,
            });
        }
    }
    points
}

const DRAWS: usize = 200;

/// How often each of the three is the best, of all draws, and the comparisons.
fn rates(seed: u64, truth: &Truth) -> ([f64; 3], Vec<JointComparison>) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut wins = [0.0; 3];
    let all: Vec<JointComparison> = (0..DRAWS)
        .map(|_| compare_joint_laws(&draw(&mut rng, truth), Stress::MeanPressure).unwrap())
        .collect();
    for found in &all {
        let best = found.alternatives[0].fraction;
        for (win, fraction) in wins.iter_mut().zip(Fraction::ALL) {
            *win += f64::from(u8::from(fraction == best)) / DRAWS as f64;
        }
        assert!((found.weights.iter().sum::<f64>() - 1.0).abs() < 1e-12);
    }
    (wins, all)
}

#[test]
fn the_true_candidate_wins_and_the_false_do_not() {
    let dilating = Truth {
        dilatancy: 2.0,
        ..PLAIN
    };
    let still = Truth {
        deviation: [0.0; 2],
        ..PLAIN
    };
    let cases: [(&str, Truth, usize, f64); 8] = [
        (
            "one phi",
            Truth {
                slope: 0.0,
                ..PLAIN
            },
            0,
            0.8,
        ),
        ("phi(I)", PLAIN, 1, 0.9),
        ("phi(I), no deviation", still, 1, 0.9),
        (
            "phi(I), errors of I twice as large",
            Truth {
                of_i: 0.08,
                ..PLAIN
            },
            1,
            0.9,
        ),
        (
            "phi(I), neighbours alike",
            Truth {
                neighbours: 0.5,
                ..PLAIN
            },
            1,
            0.9,
        ),
        (
            "denser is weaker",
            Truth {
                dilatancy: -2.0,
                ..PLAIN
            },
            1,
            0.95,
        ),
        ("dilatancy", dilating, 2, 0.9),
        (
            "dilatancy, neighbours alike",
            Truth {
                neighbours: 0.5,
                ..dilating
            },
            2,
            0.8,
        ),
    ];
    let mut missed = Vec::new();
    for (seed, (name, truth, expected, rate)) in cases.iter().enumerate() {
        let (wins, all) = rates(40 + seed as u64, truth);
        let ks: Vec<[f64; 2]> = all
            .iter()
            .filter_map(|f| f.best(Fraction::Dilatancy)?.dilatancy)
            .collect();
        let mean = ks.iter().map(|k| k[0]).sum::<f64>() / ks.len().max(1) as f64;
        let near = ks.iter().filter(|[k, e]| (k - truth.dilatancy).abs() < *e);
        let near = near.count() as f64 / ks.len().max(1) as f64;
        let flows = all.iter().map(|f| f.deviation.flows).sum::<f64>() / DRAWS as f64;
        let layers = all.iter().map(|f| f.deviation.layers).sum::<f64>() / DRAWS as f64;
        println!(
            "{name}: one phi {:.3}, phi(I) {:.3}, dilatancy {:.3}; K = {mean:.2} of {} draws, within its error in {near:.2}; \
             deviation {flows:.4}, {layers:.4}",
            wins[0],
            wins[1],
            wins[2],
            ks.len()
        );
        if truth.dilatancy > 0.0 {
            assert!((mean / truth.dilatancy - 1.0).abs() < 0.1, "{name}: {mean}");
            assert!((0.58..0.80).contains(&near), "{name}: {near}");
        }
        if wins[*expected] < *rate {
            missed.push(format!("{name}: {wins:.3?}"));
        }
    }
    assert!(missed.is_empty(), "{missed:?}");
}
