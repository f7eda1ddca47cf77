//! Elastic impacts of clumps: energy, momentum, angular momentum.

use super::scene::*;
use colluvium_dem::*;
use nalgebra::Vector3;

/// Runs until nothing touches any more; the change of the energy over that at the start.
fn through(impact: &mut Simulation, steps: u64) -> f64 {
    let before = impact.energy().kinetic();
    impact.advance(steps).unwrap();
    let after = impact.energy();
    assert!(impact.largest_overlap() > 1e-4, "they met");
    assert_eq!(after.elastic(), 0.0, "they have parted");
    (after.kinetic() / before - 1.0).abs()
}

fn on_a_plane(shape: &[(Vector3<f64>, f64)], k: u32, timestep: f64) -> Simulation {
    let motion = [v(0.1, 0.2, -0.8), v(2.0, -3.0, 5.0)];
    let grains = put(shape, v(0.0, 0.0, 0.035), orientation(k), motion);
    let mut setup = setup(elastic(), grains, timestep);
    setup.walls = vec![Wall::plane(Vector3::zeros(), Vector3::z())];
    let mut impact = Simulation::new(setup).unwrap();
    impact.clump(&rows_of(0, 1, shape.len() as u32)).unwrap();
    impact
}

#[test]
fn elastic_impacts_on_a_plane_keep_energy() {
    for shape in [dogleg(), jack()] {
        let mut worst = 0.0_f64;
        for k in 0..6 {
            let mut impact = on_a_plane(&shape, k, 5e-7);
            worst = worst.max(through(&mut impact, 120_000));
            assert!(impact.momentum_error() < 1e-13);
        }
        println!(
            "{} balls on a plane, 0.5 µs: energy {worst:.1e}",
            shape.len()
        );
        assert!(worst < 1e-8, "{worst:e}");
    }
}

#[test]
fn the_error_of_an_impact_falls_with_the_square_of_the_step() {
    let shape = dogleg();
    let error = |timestep: f64| {
        let mut worst = 0.0_f64;
        for k in 0..6 {
            let mut impact = on_a_plane(&shape, k, timestep);
            worst = worst.max(through(&mut impact, (0.06 / timestep) as u64));
        }
        worst
    };
    let [coarse, fine] = [16e-6, 4e-6].map(error);
    println!("energy at 16 and 4 µs: {coarse:.1e}, {fine:.1e}");
    assert!(coarse / fine > 8.0, "{coarse:e} {fine:e}");
}

#[test]
fn two_clumps_that_meet_keep_energy_and_both_momenta() {
    let mut worst = [0.0_f64; 3];
    for k in 0..6 {
        let mut grains = put(
            &jack(),
            v(-0.03, 0.0, 0.0),
            orientation(k),
            [v(0.5, 0.0, 0.0), v(1.0, 2.0, -3.0)],
        );
        let other = [v(-0.4, 0.02, 0.01), v(-2.0, 0.5, 1.0)];
        grains.extend(put(
            &dogleg(),
            v(0.03, 0.002, 0.001),
            orientation(k + 9),
            other,
        ));
        let mut impact = Simulation::new(setup(elastic(), grains, 5e-7)).unwrap();
        let clumps = [
            Clump {
                grains: (0..4).collect(),
                mass: None,
            },
            Clump {
                grains: (4..7).collect(),
                mass: None,
            },
        ];
        impact.clump(&clumps).unwrap();
        let [p, l] = [
            impact.leapfrog_momentum(),
            impact.leapfrog_angular_momentum(),
        ];
        let energy = through(&mut impact, 240_000);
        let [q, m] = [
            impact.leapfrog_momentum(),
            impact.leapfrog_angular_momentum(),
        ];
        let sizes = impact
            .clump_samples()
            .iter()
            .map(|c| c.mass * c.velocity.norm())
            .sum::<f64>();
        let errors = [
            energy,
            (q - p).norm() / sizes,
            (m - l).norm() / (sizes * 0.03),
        ];
        for (worst, error) in worst.iter_mut().zip(errors) {
            *worst = worst.max(error);
        }
    }
    println!(
        "pairs: energy {:.1e}, momentum {:.1e}, angular {:.1e}",
        worst[0], worst[1], worst[2]
    );
    assert!(
        worst[0] < 1e-8 && worst[1] < 1e-13 && worst[2] < 2e-11,
        "{worst:?}"
    );
}

#[test]
fn a_clump_meets_a_body_and_a_grain_in_a_periodic_box_with_momentum_kept() {
    let mut grains = put(
        &jack(),
        v(0.09, 0.0, 0.0),
        orientation(3),
        [v(0.5, 0.0, 0.0), v(1.0, 2.0, -3.0)],
    );
    grains.push(Grain::at_rest(v(-0.07, 0.003, 0.002), 0.012, DENSITY));
    let mut setup = setup(rough(), grains, 1e-6);
    setup.domain = Domain {
        lower: Vector3::repeat(-0.1),
        upper: Vector3::repeat(0.1),
        periodic: [true; 3],
    };
    setup.bodies =
        vec![Body::new(vec![Part::cuboid(Vector3::repeat(0.01), DENSITY)]).at(v(-0.035, 0.0, 0.0))];
    let mut impact = Simulation::new(setup).unwrap();
    impact.clump(&rows_of(0, 1, 4)).unwrap();
    let p = impact.leapfrog_momentum();
    impact.open_energy_ledger();
    impact.advance(150_000).unwrap();
    assert!((impact.leapfrog_momentum() - p).norm() < 1e-13 * p.norm());
    assert!(impact.body(0).velocity.norm() > 0.0 || impact.grain_list()[4].velocity.norm() > 0.0);
    let ledger = impact.energy_ledger().unwrap();
    assert!(ledger.error().abs() < 1e-11, "{:e}", ledger.error());
    // It has been through the boundary, and its members with it.
    let centre = impact.clump_samples()[0].centre;
    assert!((-0.1..0.1).contains(&centre.x), "{centre}");
    for grain in &impact.grain_list()[..4] {
        let apart = impact.domain().nearest_image(grain.position - centre);
        assert!(apart.norm() < 0.03, "{apart}");
    }
}
