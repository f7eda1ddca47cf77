//! Beds and bodies as scenes set them up, before a run.

use colluvium::run::bed::Bed;
use colluvium::run::{chute, settle};
use colluvium::scene::{ChuteScene, CliffScene, Kind, Scene, SceneBody};
use colluvium_dem::{Grain, Simulation, Threads};
use nalgebra::Vector3;

#[test]
fn loose_grains_touch_neither_each_other_nor_the_walls() {
    for set in ["seed=3", "coarse_graining=2", "scale=0.3"] {
        let scene = Scene::load("settle", &[set.to_owned()]).unwrap();
        let SceneBody::Settle(body) = &scene.body else {
            panic!("wrong kind")
        };
        let bed = settle::prepare(body, Threads::Serial).unwrap();
        assert_eq!(bed.setup.grains.len(), body.count());
        let mut simulation = Simulation::new(bed.setup).unwrap();
        assert_eq!(simulation.energy().elastic(), 0.0, "{set}");
    }
}

fn chute_of(settings: &[&str]) -> ChuteScene {
    let settings: Vec<String> = settings.iter().map(|&s| s.to_owned()).collect();
    let scene = Scene::load("chute", &settings).unwrap();
    chute::body(&scene).unwrap().clone()
}

#[test]
fn parcels_keep_box_mass_and_depth() {
    let one = chute::prepare(&chute_of(&[]), Threads::Serial).unwrap();
    let free = |bed: &Bed| -> (f64, f64) {
        let free = || bed.setup.grains.iter().filter(|g| !g.fixed);
        let mass: f64 = free().map(Grain::mass).sum();
        let moment: f64 = free().map(|g| g.mass() * g.position.z).sum();
        (mass, moment / mass - bed.floor)
    };
    let (mass, height) = free(&one);
    for factor in [1.5, 2.0] {
        let set = format!("coarse_graining={factor}");
        let parcels = chute::prepare(&chute_of(&[&set]), Threads::Serial).unwrap();
        let (m, h) = free(&parcels);
        assert!((m / mass - 1.0).abs() < 1e-3, "{m} {mass}");
        // Voids at the seams make the start stand higher until the flow closes them.
        assert!((0.95..1.15).contains(&(h / height)), "{h} {height}");
        assert_eq!(parcels.setup.domain.upper.x, 40.0);
        assert!((parcels.pace.timestep / (1e-4 * factor) - 1.0).abs() < 1e-14);
        let base = parcels.setup.grains.iter().filter(|g| g.fixed).count() as f64;
        assert!(
            (base * factor * factor / 1024.0 - 1.0).abs() < 0.15,
            "{base}"
        );
    }
}

#[test]
fn copies_lie_side_by_side() {
    let four = chute::prepare(&chute_of(&["scale=2"]), Threads::Serial).unwrap();
    assert_eq!(four.setup.grains.len(), 4 * 32_000);
    assert_eq!(four.setup.domain.upper.x, 80.0);
    let [a, b] = [0, 3 * 32_000].map(|k| four.setup.grains[k].position);
    assert!((b - a - Vector3::new(40.0, 20.0, 0.0)).norm() < 1e-12);
}

fn cliff(settings: &[&str]) -> CliffScene {
    let settings: Vec<String> = settings.iter().map(|s| (*s).to_owned()).collect();
    let scene = Scene::load("cliff", &settings).unwrap();
    match scene.body {
        SceneBody::Grains(kind) => match *kind {
            Kind::Cliff(cliff) => *cliff,
            _ => panic!("another scene"),
        },
        _ => panic!("another family"),
    }
}

#[test]
fn face_and_crack_meet_at_the_foot() {
    let scene = cliff(&["shape.overhang_degrees=20", "crack.degrees=10"]);
    let body = scene.body();
    let at = |x: f64, z: f64| Vector3::new(x, 1.0, z);
    let (face, crack) = (20f64.to_radians().tan(), 10f64.to_radians().tan());
    for z in [1.0, 15.0, 29.0] {
        assert!(body.contains(&at(face * z - 0.01, z)));
        assert!(!body.contains(&at(face * z + 0.01, z)));
        assert!(scene.before_crack(&at(-crack * z + 0.01, z)));
        assert!(!scene.before_crack(&at(-crack * z - 0.01, z)));
    }
    assert!(!body.contains(&at(0.0, 30.1)) && !body.contains(&at(scene.back() - 0.1, 3.0)));
    // The crack is as deep as it says, and parts the layer all through.
    let region = scene.crack_region(1.0).unwrap();
    let low = 30.0 * (1.0 - scene.crack.depth_scaled);
    assert!(region.contains(&at(-crack * (low + 0.1), low + 0.1)));
    assert!(!region.contains(&at(-crack * (low - 0.1), low - 0.1)));
    assert!(region.contains(&at(-crack * 29.9, 29.9)));
    // Areas in section, by counting.
    let step = 0.1;
    let mut counted = [0.0; 2];
    for i in -400..400 {
        for k in 0..320 {
            let x = at((f64::from(i) + 0.5) * step, (f64::from(k) + 0.5) * step);
            if body.contains(&x) {
                counted[0] += step * step;
                counted[1] += step * step * f64::from(u8::from(scene.before_crack(&x)));
            }
        }
    }
    for (counted, exact) in counted.iter().zip(scene.areas()) {
        assert!((counted / exact - 1.0).abs() < 0.01, "{counted} {exact}");
    }
}
