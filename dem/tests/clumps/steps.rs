//! The step that grains of a clump bear.

use super::scene::*;
use colluvium_dem::*;
use nalgebra::Matrix3;

/// Two balls, loose or as one, and a third that goes too fast past them for the list of neighbours.
fn too_fast(clump: Option<MassProperties>) -> Simulation {
    let grain = |x: f64, radius| Grain::at_rest(v(x, 0.0, 0.0), radius, 1000.0);
    let mut third = Grain::at_rest(v(-0.5, 0.5, 0.0), 0.1, 1000.0);
    third.velocity = v(3.0, 0.0, 0.0);
    let grains = vec![grain(-0.5, 0.1), grain(0.0, 0.099), third];
    let mut world = Simulation::new(setup(rough(), grains, 0.1)).unwrap();
    if clump.is_some() {
        let clump = Clump {
            grains: vec![0, 1],
            mass: clump,
        };
        world.clump(&[clump]).unwrap();
    }
    world
}

/// The step that a run which does not follow its motion is told to take (s).
fn remedy(mut world: Simulation) -> f64 {
    let Err(Diverged::Leap { remedy, .. }) = world.advance(3) else {
        panic!("the step is too long");
    };
    assert!(remedy.exceeded);
    remedy.seconds
}

#[test]
fn a_member_limits_the_step_with_what_a_push_on_it_moves() {
    let apart = 4.0 / 3.0 * std::f64::consts::PI * 0.099_f64.powi(3) * 1000.0;
    // Of a mass that is all in the middle the far ball has next to no inertia beside it.
    let mass = MassProperties {
        mass: 8.0,
        centre: v(-0.5, 0.0, 0.0),
        inertia: Matrix3::identity() * 0.032,
    };
    let least = 1.0 / (1.0 / 8.0 + 0.25 / 0.032);
    assert!(least < 0.1 * apart);
    let clumped = too_fast(Some(mass));
    let (_, found) = clumped.clump_list()[0];
    assert!((found / least - 1.0).abs() < 1e-12, "{found} kg");
    // A spring's step goes with the root of the mass.
    let shorter = remedy(clumped) / remedy(too_fast(None));
    let expected = (least / apart).sqrt();
    assert!((shorter / expected - 1.0).abs() < 1e-12, "{shorter}");
}
