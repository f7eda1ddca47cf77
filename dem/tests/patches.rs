//! Grains taken out of a run and put back: they go on as if they had never been away.

use crate::world::{laws, setup};
use colluvium_dem::*;
use std::collections::BTreeMap;

const STEP: f64 = 5e-5;

/// A cloud that has fallen together, and the same once more.
fn pair(law: ContactLaw) -> [Simulation; 2] {
    let mut simulation = Simulation::new(setup(law, 900, STEP)).unwrap();
    simulation.advance(3000).unwrap();
    let record = simulation.checkpoint();
    let again = Simulation::resume(setup(law, 900, STEP), &record).unwrap();
    [simulation, again]
}

/// Places, velocities and spins by number.
fn seen(simulation: &mut Simulation) -> BTreeMap<u32, [f64; 9]> {
    let mut snapshot = Snapshot::default();
    simulation.snapshot(&mut snapshot);
    let row = |g: &GrainSample| {
        let parts = [&g.position, &g.velocity, &g.spin];
        (g.id, std::array::from_fn(|k| parts[k / 3][k % 3]))
    };
    snapshot.grains.iter().map(row).collect()
}

/// Largest differences of places (m), velocities (m/s) and spins (rad/s).
fn apart(one: &mut Simulation, other: &mut Simulation) -> [f64; 3] {
    let (one, other) = (seen(one), seen(other));
    assert!(one.keys().eq(other.keys()));
    let mut most = [0.0_f64; 3];
    for (a, b) in one.values().zip(other.values()) {
        for k in 0..9 {
            most[k / 3] = most[k / 3].max((a[k] - b[k]).abs());
        }
    }
    most
}

/// Away from the floor, with which contacts are not kept.
fn taken(g: &GrainSample) -> bool {
    g.position.x < 0.5 && g.position.z > 0.12
}

#[test]
fn what_is_put_back_at_once_goes_on_as_before() {
    for (name, law) in laws() {
        let [mut whole, mut other] = pair(law);
        let before = whole.leapfrog_momentum();
        let patch = other.take_out(taken);
        assert!(patch.grains.len() > 100, "{name}: {}", patch.grains.len());
        assert_eq!(
            other.grain_count() + patch.grains.len(),
            whole.grain_count()
        );
        let patch = Patch::of(&patch.numbers()).unwrap();
        other.put_back(&patch).unwrap();
        let back = other.leapfrog_momentum();
        assert!((before - back).norm() < 1e-12 * before.norm(), "{name}");
        whole.advance(40).unwrap();
        other.advance(40).unwrap();
        let [x, v, spin] = apart(&mut whole, &mut other);
        assert!(
            x < 1e-13 && v < 1e-10 && spin < 1e-8,
            "{name}: {x:e} {v:e} {spin:e}"
        );
        assert!(other.momentum_error() < 1e-11, "{name}");
    }
}

/// The control: the same grains without the histories of their contacts stand under other forces.
#[test]
fn without_histories_it_does_not() {
    let (_, law) = laws()[1];
    let [mut whole, mut other] = pair(law);
    let mut patch = other.take_out(taken);
    assert!(patch.pairs.len() > 50);
    patch.pairs.clear();
    patch.histories.clear();
    other.put_back(&patch).unwrap();
    whole.advance(40).unwrap();
    other.advance(40).unwrap();
    let [x, v, _] = apart(&mut whole, &mut other);
    assert!(x > 1e-8 && v > 1e-5, "{x:e} {v:e}");
}

#[test]
fn a_patch_of_another_run_is_refused() {
    let (_, law) = laws()[1];
    let [mut simulation, _] = pair(law);
    let patch = simulation.take_out(taken);
    let count = simulation.grain_count();
    let twice = Patch {
        ids: vec![*seen(&mut simulation).keys().next().unwrap()],
        grains: patch.grains[..1].to_vec(),
        ..Patch::default()
    };
    let never = Patch {
        ids: vec![1_000_000],
        ..twice.clone()
    };
    let mut short = patch.clone();
    short.histories.pop();
    for (wrong, key) in [
        (&twice, "patch.ids"),
        (&never, "patch.ids"),
        (&short, "patch.histories"),
    ] {
        let error = simulation.put_back(wrong).unwrap_err().to_string();
        assert!(error.contains(key), "{error}");
        assert_eq!(simulation.grain_count(), count);
    }
    simulation.put_back(&patch).unwrap();
    assert!(simulation.put_back(&patch).is_err());
    assert!(Patch::of(&patch.numbers()[..20]).is_none());
}

/// Split by numbers and merged again a patch is what it was; one part put back after the other, the springs between them
/// come with the second.
#[test]
fn a_patch_may_be_put_back_in_parts() {
    let (name, law) = laws()[1];
    let [mut whole, mut other] = pair(law);
    let patch = other.take_out(taken);
    let mut second = patch.clone();
    let first = second.split(|id, _| id % 3 == 0);
    assert!(
        first.grains.len() > 20 && second.grains.len() > 20,
        "{name}"
    );
    let both = first
        .pairs
        .iter()
        .filter(|pair| second.pairs.contains(pair));
    assert!(both.count() > 10);
    other.put_back(&first).unwrap();
    other.put_back(&second).unwrap();
    whole.advance(40).unwrap();
    other.advance(40).unwrap();
    let [x, v, spin] = apart(&mut whole, &mut other);
    assert!(
        x < 1e-13 && v < 1e-10 && spin < 1e-8,
        "{x:e} {v:e} {spin:e}"
    );
    let mut merged = second;
    merged.split(|id, _| first.ids.contains(&id));
    merged.merge(&first);
    assert_eq!((&merged.grains, &merged.ids), (&patch.grains, &patch.ids));
    assert_eq!(merged.pairs.len(), patch.pairs.len());
    assert_eq!(merged.histories.len(), patch.histories.len());
}
