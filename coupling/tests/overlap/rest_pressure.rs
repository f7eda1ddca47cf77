//! A bed at rest that is cut presses on its joint as it did before.

use super::growth::{TRAVEL, rested, spec, stresses};
use colluvium_coupling::overlap::bowl::Bowl;

/// σ_xx of grains in the middle of the box, a time after the cut, over that before it; and what presses through the handshake
/// surface, grains over continuum.
fn after(rest_strain: f64, time: f64) -> [f64; 2] {
    let mut simulation = rested();
    let middle = [11.0, 15.0];
    let before = stresses(&mut simulation, middle)[0];
    let mut spec = spec(&mut simulation, TRAVEL, f64::INFINITY);
    spec.settings.rest_strain = rest_strain;
    let mut bowl = Bowl::cut(spec, &mut simulation).unwrap();
    let each = bowl.spec().settings.steps_of_loads(simulation.timestep());
    for _ in 0..(time / simulation.timestep()).round() as u64 / each {
        simulation.advance(each).unwrap();
        bowl.go_on(&mut simulation).unwrap();
    }
    let kept = stresses(&mut simulation, middle)[0] / before;
    let ratio = bowl.monitors().force_ratio();
    println!(
        "forgotten in {rest_strain}: K_0 {:.3}, sideways {kept:.3} of before, force ratio {ratio:.3}",
        bowl.rest_ratio()
    );
    [kept, ratio]
}

/// A continuum that knows nothing of rest has σ_xx = σ_zz, and squeezes grains that had K_0 of it.
#[test]
fn a_joint_presses_sideways_as_its_grains_did() {
    let [[with, ratio], [without, _]] = [0.01, 0.0].map(|strain| after(strain, 20.0));
    assert!((with - 1.0).abs() < 0.05, "{with}");
    assert!((ratio - 1.0).abs() < 0.1, "{ratio}");
    assert!(without > 1.1, "{without}");
}
