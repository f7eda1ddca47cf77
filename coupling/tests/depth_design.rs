//! Slopes and depths of flows chosen together: against even choices at equal cost, by what fits to made-up flows find.
use colluvium_coupling::calibration::{LocalPoint, Stress, fit_mu_i, mu_of_i};
use colluvium_coupling::campaign::{
    Depths, Flow, GuessedLaw, Precision, Prospect, choose_flows, choose_slopes, cost, prospect,
    prospect_of_flows,
};
use nalgebra::{Matrix3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

const LAW: GuessedLaw = GuessedLaw {
    mu_s: 0.45,
    mu_2: 0.95,
    i_0: 0.6,
};
const RANGE: [f64; 2] = [27.0, 37.0];
const APART: f64 = 0.5;
const CHOICES: [f64; 6] = [0.4, 0.5, 0.65, 0.8, 1.25, 1.5];

fn depths(choices: &[f64]) -> Depths {
    Depths::new(choices, 23.6, 0.03)
}

fn even(count: usize, depth: f64) -> Vec<Flow> {
    let step = (RANGE[1] - RANGE[0]) / (count - 1) as f64;
    let of = |k: usize| Flow {
        slope_degrees: RANGE[0] + step * k as f64,
        depth,
    };
    (0..count).map(of).collect()
}

/// Geometric mean of the errors along the axes of the ellipsoid: of theirs over ours.
fn ratio_of_errors(ours: &Prospect, theirs: &Prospect) -> f64 {
    (ours.determinant / theirs.determinant).powf(1.0 / 6.0)
}

#[test]
fn with_one_depth_only_slopes_are_chosen() {
    let (precision, depths) = (Precision::default(), depths(&[]));
    let flows = choose_flows(&LAW, &precision, &depths, RANGE, 7, APART);
    let slopes: Vec<f64> = flows.iter().map(|f| f.slope_degrees).collect();
    let alone = choose_slopes(&LAW, &precision, RANGE, 7, APART);
    assert_eq!(slopes.len(), 7);
    let of_flows = prospect_of_flows(&LAW, &precision, &depths, &flows);
    let of_slopes = prospect(&LAW, &precision, &alone);
    assert!(
        of_flows.determinant >= of_slopes.determinant * (1.0 - 1e-12),
        "{slopes:?} {alone:?}"
    );
    assert!((cost(&depths, &flows) - 7.0).abs() < 1e-12);
}

#[test]
fn depth_follows_what_it_is_worth() {
    let precision = Precision::default();
    let of = |change: &dyn Fn(&mut Depths), precision: &Precision| {
        let mut depths = depths(&CHOICES);
        change(&mut depths);
        let flows = choose_flows(&LAW, precision, &depths, RANGE, 7, APART);
        assert!(cost(&depths, &flows) <= 7.0 + 1e-9);
        for (k, a) in flows.iter().enumerate() {
            for b in &flows[..k] {
                let near = (a.slope_degrees - b.slope_degrees).abs() < APART - 1e-9;
                assert!(a.depth != b.depth || !near, "{flows:?}");
            }
        }
        flows.iter().map(|f| f.depth).sum::<f64>() / flows.len() as f64
    };
    // A flow's own error alone and no length: layers are worth nothing, and more and thinner flows all.
    let own = of(
        &|d| {
            (d.layer_mu, d.layer_i) = (0.0, 0.0);
            d.amplitude = 0.0;
        },
        &precision,
    );
    // A length of ten diameters: thin flows tell of that and not of the law.
    let long = of(&|d| d.amplitude = 10.0, &precision);
    // Nearly all error is of layers, a bed costs nothing: what counts is the share of layers that count.
    let poor = Precision {
        relative_mu: 0.023 / 16.6_f64.sqrt(),
        relative_i: 0.06 / 16.6_f64.sqrt(),
    };
    let of_layers = of(&|d| d.bed = 0.0, &poor);
    println!(
        "mean depth: own errors {own:.2}, long length {long:.2}, layers' errors {of_layers:.2}"
    );
    assert!(own < 0.7, "{own}");
    assert!(long >= 1.0, "{long}");
    assert!(of_layers > 1.1, "{of_layers}");
    // A length that holds all of them: there is no flow to choose.
    let mut none = depths(&CHOICES);
    none.amplitude = 100.0;
    assert!(choose_flows(&LAW, &precision, &none, RANGE, 7, APART).is_empty());
}

/// Points of a design as a campaign would measure it: each flow errs by its own share of μ and I and each layer besides, the
/// errors `scale` times those of the model; thin flows hold.
fn measured(rng: &mut ChaCha8Rng, depths: &Depths, flows: &[Flow], scale: f64) -> Vec<LocalPoint> {
    let precision = Precision::default();
    let full_layers = depths.full - 7.0;
    let own = |all: f64, layer: f64| (all * all - layer * layer / full_layers).sqrt();
    let own_mu = scale * own(precision.relative_mu, depths.layer_mu);
    let own_i = scale * own(precision.relative_i, depths.layer_i);
    let (layer_mu, layer_i) = (scale * depths.layer_mu, scale * depths.layer_i);
    let mut normal = || rng.sample::<f64, _>(StandardNormal);
    let mut points = Vec::new();
    for flow in flows {
        let t = flow.slope_degrees.to_radians().tan();
        let i = LAW.i_0 * (t - LAW.mu_s) / (LAW.mu_2 - t);
        let (flow_mu, flow_i) = (1.0 + own_mu * normal(), 1.0 + own_i * normal());
        for layer in 0..(depths.full * flow.depth - 7.0).round() as usize {
            let friction = t * flow_mu * (1.0 + layer_mu * normal());
            points.push(LocalPoint {
                slope_degrees: flow.slope_degrees,
                z: layer as f64,
                inertial_number: i * flow_i * (1.0 + layer_i * normal()),
                inertial_number_error: layer_i * i,
                friction,
                friction_error: layer_mu * t,
                friction_zz: friction,
                friction_zz_error: layer_mu * t,
                solid_fraction: 0.55,
                solid_fraction_error: 0.003,
            });
        }
    }
    points
}

/// Determinant of what many fits scatter by.
fn scatter(seed: u64, depths: &Depths, flows: &[Flow]) -> f64 {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let found: Vec<Vector3<f64>> = (0..DRAWS)
        .map(|_| {
            let points = measured(&mut rng, depths, flows, SCALE);
            let fit = fit_mu_i(&points, Stress::MeanPressure).unwrap();
            Vector3::new(fit.mu_s, fit.mu_2, fit.i_0)
        })
        .collect();
    let mean = found.iter().sum::<Vector3<f64>>() / DRAWS as f64;
    let squares: Matrix3<f64> = found
        .iter()
        .map(|p| (p - mean) * (p - mean).transpose())
        .sum();
    assert!((mu_of_i(mean[0], mean[1], mean[2], 0.5) - mu_of_i(0.45, 0.95, 0.6, 0.5)).abs() < 2e-3);
    (squares / (DRAWS - 1) as f64).determinant()
}

const DRAWS: usize = 300;
/// So small that fits stay where the law is nearly linear in its parameters, as a design takes it to be.
const SCALE: f64 = 0.1;

/// In beds as deep as the shipped ones slopes are what is gained by; in beds twice as deep, depths as well.
#[test]
fn chosen_flows_tell_more_at_equal_cost_than_even_ones() {
    let precision = Precision::default();
    let shipped = depths(&CHOICES);
    let deep = Depths::new(&[0.35, 0.5, 0.7], 47.2, 0.015);
    for (depths, over_slopes) in [(shipped, 1.0), (deep, 1.1)] {
        let alone = Depths {
            choices: Vec::new(),
            ..depths.clone()
        };
        let chosen = choose_flows(&LAW, &precision, &depths, RANGE, 7, APART);
        let slopes = choose_flows(&LAW, &precision, &alone, RANGE, 7, APART);
        // Depths in turn, and slopes that see one end of the law less: the control.
        let spread: Vec<Flow> = even(7, 1.0)
            .iter()
            .enumerate()
            .map(|(k, f)| Flow {
                depth: [1.0, 0.7, 1.3][k % 3],
                ..*f
            })
            .collect();
        let steep: Vec<Flow> = (0..7)
            .map(|k| Flow {
                slope_degrees: 31.0 + f64::from(k),
                depth: 1.0,
            })
            .collect();
        let told = |flows: &[Flow]| prospect_of_flows(&LAW, &precision, &depths, flows);
        let error = |flows: &[Flow]| scatter(1, &depths, flows).powf(1.0 / 6.0);
        let ours = error(&chosen);
        let list: Vec<(f64, f64)> = chosen.iter().map(|f| (f.slope_degrees, f.depth)).collect();
        println!(
            "chosen of {} d: {list:?}, cost {:.3}",
            depths.full,
            cost(&depths, &chosen)
        );
        for (name, flows, least) in [
            ("even slopes", even(7, 1.0), 1.05),
            ("slopes chosen", slopes, over_slopes),
            ("even slopes and depths", spread, 1.05),
            ("steep slopes", steep, 1.4),
        ] {
            let promised = ratio_of_errors(&told(&chosen), &told(&flows));
            let found = error(&flows) / ours;
            println!(
                "{name}: cost {:.3}; errors are {promised:.3} times those of the chosen, found {found:.3}",
                cost(&depths, &flows)
            );
            assert!(
                cost(&depths, &flows) > 0.98 * cost(&depths, &chosen),
                "{name}"
            );
            assert!(promised >= least, "{name}: {promised}");
            assert!(
                least == 1.0 || found > 1.0 + 0.4 * (least - 1.0),
                "{name}: {found}"
            );
            assert!(
                (found / promised - 1.0).abs() < 0.2,
                "{name}: {found} {promised}"
            );
        }
    }
}
