//! A row of bonded grains against the theory of beams.
//!
//! N free grains at spacing a, the one before them held. Bonds bend by springs `c = k_n I` half way
//! between grains and shear by springs `s = k_t A`, so the row is a beam of bending stiffness c a and
//! shear stiffness s a, of length L = N a:
//!
//! ```text
//! static, force P at the end    w = P L³/(3 c a) (1 - 1/(4 N²)) + P L/(s a)      exactly
//! first frequency               ω = (β/L)² √(c a/(m/a)),  with half a grain's mass at the end more
//! 1 + cos β cosh β + (β/2N) (cos β sinh β - sin β cosh β) = 0
//! ```
//! The static row is softer than the beam by a term of second order. So is its frequency, but for the
//! grains' own moment of inertia and shear, which the theory (Euler–Bernoulli) has not: both lower ω by
//! a share that falls with 1/N² as well.

use crate::world::laws;
use colluvium_dem::*;
use nalgebra::Vector3;

const RADIUS: f64 = 0.05;
const SPACING: f64 = 2.0 * RADIUS * 1.001;

fn cement() -> Cement {
    Cement {
        youngs_modulus: 1e7,
        radius_ratio: 0.5,
        tensile_strength: f64::INFINITY,
        shear_strength: f64::INFINITY,
        ..Cement::sinter(1e7)
    }
}

fn row(free: usize) -> Simulation {
    let mut grains: Vec<Grain> = (0..=free)
        .map(|k| Grain::at_rest(Vector3::x() * (SPACING * k as f64), RADIUS, 1000.0))
        .collect();
    grains[0].fixed = true;
    let step = cement().limit(&grains[1], &grains[2]).seconds * 0.2;
    let mut simulation = Simulation::new(Setup {
        domain: Domain {
            lower: Vector3::repeat(-5.0),
            upper: Vector3::repeat(5.0),
            periodic: [false; 3],
        },
        gravity: Vector3::zeros(),
        law: laws()[0].1.into(),
        grains,
        walls: Vec::new(),
        bodies: Vec::new(),
        timestep: step,
        threads: Threads::Serial,
    })
    .unwrap();
    let bonds = simulation.bond(&BondRule {
        cement: cement(),
        gap: 0.01,
        materials: Vec::new(),
        within: Region::Everywhere,
    });
    assert_eq!(bonds.unwrap(), free);
    simulation
}

fn deflection(simulation: &mut Simulation, seen: &mut Snapshot, tip: usize) -> f64 {
    simulation.snapshot(seen);
    let last = seen.grains.iter().find(|g| g.id as usize == tip);
    last.unwrap().position.z
}

/// ω of Euler and Bernoulli for a beam with half a grain more at its end.
fn beam_frequency(free: usize) -> f64 {
    let section = cement().section(RADIUS, RADIUS);
    let n = free as f64;
    let equation = |b: f64| {
        let (sin, cos) = b.sin_cos();
        1.0 + cos * b.cosh() + 0.5 * b / n * (cos * b.sinh() - sin * b.cosh())
    };
    let (mut low, mut high) = (1.0, 2.0);
    assert!(equation(low) > 0.0 && equation(high) < 0.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if equation(middle) > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    let mass = Grain::at_rest(Vector3::zeros(), RADIUS, 1000.0).mass();
    (low / (n * SPACING)).powi(2) * (section.bending * SPACING * SPACING / mass).sqrt()
}

/// Mean deflection under a steady end load over whole periods, and the frequency about it.
fn vibrate(free: usize, load: f64) -> (f64, f64) {
    let mut simulation = row(free);
    let force = Vector3::new(0.0, 0.0, -load);
    simulation
        .set_loads(&[Load {
            grain: free as u32,
            force,
            moment: Vector3::zeros(),
        }])
        .unwrap();
    let (step, expected) = (simulation.timestep(), beam_frequency(free));
    let every = (0.01 * std::f64::consts::TAU / expected / step) as u64;
    let mut seen = Snapshot::default();
    let mut series = Vec::new();
    for _ in 0..1100 {
        series.push(deflection(&mut simulation, &mut seen, free));
        simulation.advance(every).unwrap();
    }
    let fit = FirstMode::of(&series, expected * step * every as f64);
    (fit.mean, fit.angle / (step * every as f64))
}

/// `mean + A cos(angle n) + B sin(angle n)` fitted to a series: the angle by which the rest is least.
struct FirstMode {
    mean: f64,
    angle: f64,
}

impl FirstMode {
    fn of(series: &[f64], near: f64) -> Self {
        let (mut low, mut high) = (0.93 * near, 1.07 * near);
        for _ in 0..60 {
            let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
            if Self::rest(series, a).0 < Self::rest(series, b).0 {
                high = b;
            } else {
                low = a;
            }
        }
        let angle = 0.5 * (low + high);
        let mean = Self::rest(series, angle).1;
        FirstMode { mean, angle }
    }

    fn rest(series: &[f64], angle: f64) -> (f64, f64) {
        let rows = |n: usize| {
            let (sin, cos) = (angle * n as f64).sin_cos();
            Vector3::new(1.0, cos, sin)
        };
        let mut matrix = nalgebra::Matrix3::zeros();
        let mut right = Vector3::zeros();
        for (n, &y) in series.iter().enumerate() {
            matrix += rows(n) * rows(n).transpose();
            right += rows(n) * y;
        }
        let fit = matrix.try_inverse().unwrap() * right;
        let rest = |(n, &y): (usize, &f64)| (y - rows(n).dot(&fit)).powi(2);
        (series.iter().enumerate().map(rest).sum(), fit[0])
    }
}

#[test]
fn a_row_of_grains_bends_and_vibrates_like_a_beam() {
    let section = cement().section(RADIUS, RADIUS);
    let mut errors = Vec::new();
    for free in [6, 12, 24] {
        let n = free as f64;
        let length = n * SPACING;
        // A thousandth of the length at the end: theory is linear.
        let load = 0.003 * section.bending * SPACING / length.powi(2);
        let bending = load * length.powi(3) / (3.0 * section.bending * SPACING);
        let shear = load * length / (section.shear * SPACING);
        let exact = bending * (1.0 - 0.25 / (n * n)) + shear;
        let (mean, frequency) = vibrate(free, load);
        let softer = (-mean - exact).abs() / exact;
        assert!(
            softer < 5e-4,
            "{free} grains: {softer:e} from the row's own deflection"
        );
        // The beam of Euler and Bernoulli, without shear.
        let beam = (-mean - bending).abs() / bending;
        let slower = (beam_frequency(free) - frequency) / frequency;
        println!("{free} grains: deflection off by {beam:.2e}, frequency by {slower:.2e}");
        errors.push([beam, slower]);
    }
    for k in 0..2 {
        assert!(errors[2][k].abs() < 3e-3, "{errors:?}");
        for pair in errors.windows(2) {
            let order = (pair[0][k] / pair[1][k]).log2();
            assert!((1.7..2.5).contains(&order), "order {order} in {errors:?}");
        }
    }
}
