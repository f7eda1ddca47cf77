//! Clumps kept, cut, moved and poured.

use super::scene::*;
use colluvium_dem::preparation::*;
use colluvium_dem::*;
use nalgebra::{UnitQuaternion, Vector3};
use std::ops::ControlFlow;

fn shape() -> ClumpShape {
    ClumpShape::of_balls(jack(), DENSITY)
}

/// A tube with a floor.
fn tube() -> Vec<Wall> {
    vec![
        Wall::plane(Vector3::zeros(), Vector3::z()),
        Wall::cylinder(Vector3::zeros(), Vector3::z(), 0.12, Side::Inside),
    ]
}

/// What jacks are poured into, and how.
pub fn pouring() -> (Setup, ClumpPouring, Relaxation) {
    let shape = shape();
    let mut setup = setup(rough(), Vec::new(), 2e-5);
    setup.gravity = v(0.0, 0.0, -9.81);
    setup.walls = tube();
    let spec = ClumpPouring {
        source: Region::All(vec![
            Region::Cylinder {
                point: Vector3::zeros(),
                axis: Vector3::z(),
                radius: 0.12,
            },
            Region::Block {
                lower: v(-1.0, -1.0, 0.2),
                upper: v(1.0, 1.0, 0.4),
            },
        ]),
        shape,
        count: 60,
        velocity: v(0.0, 0.0, -1.0),
        interval: None,
        fill: FILL,
        seed: 4,
    };
    let mut relaxation = Relaxation::under(9.81);
    relaxation.rest = Rest {
        kinetic: 1e-5,
        unbalanced: 0.05,
    };
    (setup, spec, relaxation)
}

/// Jacks poured into it.
fn poured() -> (Simulation, PouringReport) {
    let (setup, spec, relaxation) = pouring();
    let mut bed = Simulation::new(setup).unwrap();
    let mut go = |_: &RestMeasures| ControlFlow::Continue(());
    let report = pour_clumps(&mut bed, &spec, &relaxation, &mut go);
    (bed, report.unwrap())
}

#[test]
fn clumps_are_poured_kept_and_made_again_as_they_were() {
    let (mut bed, report) = poured();
    let shape = shape();
    assert_eq!((report.grains, bed.clump_count()), (60, 60));
    assert!(report.batches > 1 && report.sizes.is_empty(), "{report:?}");
    assert!((bed.free_mass() / (60.0 * shape.mass.mass) - 1.0).abs() < 1e-12);
    let inside = |g: &Grain| g.position.xy().norm() + 0.9 * g.radius < 0.12;
    assert!(bed.grain_list().iter().all(inside));
    // Every clump has its shape: distances of its balls are those of the balls asked for.
    let packing = Packing::of(&mut bed);
    let lightest = shape.lightest();
    for clump in &packing.clumps {
        let balls = clump.grains.iter().map(|&g| &packing.grains[g as usize]);
        let balls: Vec<&Grain> = balls.collect();
        for (a, (x, r)) in balls.iter().zip(&shape.balls) {
            assert!((a.mass() / lightest - 1.0).abs() < 1e-9);
            assert!((a.radius - r).abs() < 1e-15);
            for (b, (y, _)) in balls.iter().zip(&shape.balls) {
                let (now, then) = ((a.position - b.position).norm(), (x - y).norm());
                assert!((now - then).abs() < 1e-12, "{now} {then}");
            }
        }
    }
    let mass = packing.mass();
    assert!(
        (mass / (60.0 * shape.mass.mass) - 1.0).abs() < 1e-12,
        "{mass}"
    );
    // Made again it has the same clumps, and rests: without forces yet, nothing but the fall of a step moves it.
    let again = |packing: &Packing| {
        let mut setup = setup(rough(), packing.grains.clone(), 2e-5);
        setup.gravity = v(0.0, 0.0, -9.81);
        let mut bed = Simulation::new(setup).unwrap();
        bed.clump(&packing.clumps).unwrap();
        bed
    };
    for (now, then) in again(&packing)
        .clump_samples()
        .iter()
        .zip(&bed.clump_samples())
    {
        assert!((now.centre - then.centre).norm() < 1e-12);
        assert!((now.mass / then.mass - 1.0).abs() < 1e-12);
        assert!((now.angular_momentum - then.angular_momentum).norm() < 1e-9 * then.mass);
        assert_eq!((now.number, now.grains), (then.number, then.grains));
    }
    // Turned and moved, scaled: as if its grains had been.
    let mut turned = packing.clone();
    let turn = UnitQuaternion::from_euler_angles(0.4, -1.0, 2.0);
    turned
        .place(v(0.1, 0.2, 0.3), turn, v(1.0, 0.0, 2.0))
        .unwrap();
    for (now, then) in again(&turned)
        .clump_samples()
        .iter()
        .zip(&bed.clump_samples())
    {
        let put = v(0.1, 0.2, 0.3) + turn * (then.centre - v(0.1, 0.2, 0.3)) + v(1.0, 0.0, 2.0);
        assert!((now.centre - put).norm() < 1e-12);
        let [own, other] = [now, then].map(|c| c.kinetic[1]);
        assert!(
            (own - other).abs() <= 1e-9 * other.max(1e-12),
            "{own} {other}"
        );
    }
    let mut large = packing.clone();
    large.scale(2.0).unwrap();
    assert!((large.mass() / packing.mass() - 8.0).abs() < 1e-9);
    assert!((large.center() - 2.0 * packing.center()).norm() < 1e-12);
    let least = large.clumps[0].grains[0] as usize;
    assert!((large.grains[least].mass() / (8.0 * lightest) - 1.0).abs() < 1e-9);
    // Cut and glued as wholes.
    let half = Region::Block {
        lower: v(-1.0, -1.0, -1.0),
        upper: v(0.0, 1.0, 1.0),
    };
    let mut cut = packing.clone();
    let gone = cut.trim(&half).unwrap();
    assert!(gone > 0 && gone.is_multiple_of(4));
    assert_eq!(cut.clumps.len(), 60 - gone / 4);
    assert!(cut.grains.iter().all(|g| g.position.x < 0.0));
    assert_eq!(again(&cut).clump_count(), cut.clumps.len());
    let mut glued = packing.clone();
    let fixed = glued.glue(&half).unwrap();
    assert!(fixed.is_multiple_of(4) && glued.clumps.len() == 60 - fixed / 4);
    let reaching = glued
        .grains
        .iter()
        .filter(|g| g.fixed && g.position.x > 0.0);
    assert!(reaching.count() > 0, "clumps are fixed whole");
    // With `again` of fixed and free ones the free ones are clumps still.
    assert_eq!(again(&glued).clump_count(), glued.clumps.len());
}

#[test]
fn clumps_settle_under_gravity_in_stages() {
    let (mut bed, _) = poured();
    let packing = Packing::of(&mut bed);
    let mut setup = setup(rough(), packing.grains.clone(), 1.0);
    setup.gravity = v(0.0, 0.0, -1.0);
    setup.walls = tube();
    let stages = Stages::at(&[1.0, 0.1]);
    let mut go = |_: &RestMeasures| ControlFlow::Continue(());
    let (bed, reports) = settle_in_stages(setup, &packing.clumps, &stages, &mut go).unwrap();
    assert_eq!((bed.clump_count(), reports.len()), (60, 2));
    let spread = reports.iter().map(|r| r.sank.abs()).fold(0.0, f64::max);
    assert!(spread < 0.01, "{spread}");
}
