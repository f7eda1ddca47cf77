//! Beds on slopes: clumps stand where balls of their volume flow.

use super::scene::*;
use colluvium_dem::preparation::{ClumpShape, Scattering, scatter};
use colluvium_dem::*;
use nalgebra::Vector3;

const WIDTH: f64 = 0.16;
const COUNT: usize = 220;
const G: f64 = 9.81;

fn law() -> ContactLaw {
    ContactLaw::linear(
        Hooke::matched(5e3, 0.4),
        TangentialSpring::matched(2.0 / 7.0, 0.4, 0.5),
        None,
    )
}

/// A bed at rest on a bumpy base, periodic along and across, of so many clumps.
fn bed(balls: Vec<(Vector3<f64>, f64)>) -> Simulation {
    let mut grains = Vec::new();
    for k in 0..100 {
        let cell = [k % 10, k / 10].map(|c| (f64::from(c) + 0.5) * WIDTH / 10.0);
        let height = 0.003 * (f64::from(k * 7 % 5) - 2.0);
        let mut grain = Grain::at_rest(v(cell[0], cell[1], height), 0.009, DENSITY);
        grain.fixed = true;
        grains.push(grain);
    }
    let domain = Domain {
        lower: Vector3::zeros(),
        upper: v(WIDTH, WIDTH, 2.0),
        periodic: [true, true, false],
    };
    let region = Region::Block {
        lower: v(0.0, 0.0, 0.03),
        upper: v(WIDTH, WIDTH, 1.6),
    };
    let scattered = scatter(
        &Scattering {
            shape: ClumpShape::of_balls(balls, DENSITY),
            region,
            domain,
            count: COUNT,
            velocity: Vector3::zeros(),
            seed: 1,
        },
        &grains,
        100,
    )
    .unwrap();
    grains.extend(scattered.grains);
    let mut setup = setup(law(), grains, 4e-5);
    setup.domain = domain;
    setup.gravity = v(0.0, 0.0, -G);
    let mut bed = Simulation::new(setup).unwrap();
    bed.clump(&scattered.clumps).unwrap();
    for _ in 0..800 {
        bed.advance(100).unwrap();
        bed.damp(0.95);
    }
    let rest = bed.rest_measures(G);
    assert!(rest.kinetic < 1e-3, "{rest}");
    bed
}

/// Mean velocity down a slope that is tilted at once, a push given, after a second and a half (m/s).
fn speed_on(bed: &Simulation, degrees: f64) -> f64 {
    let mut flow = bed.clone();
    let (s, c) = degrees.to_radians().sin_cos();
    flow.set_gravity(v(G * s, 0.0, -G * c)).unwrap();
    flow.give_velocity(|grain| v(2.0 * grain.position.z.max(0.0), 0.0, 0.0));
    flow.advance(37_500).unwrap();
    let moving = flow.clump_samples();
    moving.iter().map(|clump| clump.velocity.x).sum::<f64>() / moving.len() as f64
}

#[test]
fn clumps_stand_on_slopes_on_which_balls_of_their_volume_flow() {
    let cube: f64 = jack().iter().map(|(_, r)| r.powi(3)).sum();
    let balls = bed(vec![(Vector3::zeros(), cube.cbrt())]);
    let jacks = bed(jack());
    let speeds = |bed: &Simulation, list: &[f64]| -> Vec<f64> {
        list.iter().map(|&degrees| speed_on(bed, degrees)).collect()
    };
    let round = speeds(&balls, &[16.0, 30.0]);
    let angular = speeds(&jacks, &[30.0, 45.0]);
    println!("balls at 16, 30 degrees: {round:?} m/s; jacks at 30, 45 degrees: {angular:?} m/s");
    // The controls: neither holds everywhere, neither flows everywhere.
    assert!(round[0] < 0.01 && round[1] > 0.3, "{round:?}");
    assert!(angular[0] < 0.01 && angular[1] > 0.3, "{angular:?}");
}
