//! Loose grains that fall into a box with walls.

use super::bed::{self, Bed};
use super::{Findings, Under};
use crate::failure::Failure;
use crate::scene::{Scene, SettleScene};
use colluvium_dem::preparation::RadiusLaw;
use colluvium_dem::{Domain, Grain, Setup, Threads, Wall};
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// What settling leaves out, whatever its law.
const LEFT_OUT: [&str; 3] = ["bonds", "air", "breakage of grains"];

/// Distance of neighbours in the loose lattice, in largest diameters.
const SPACING: f64 = 1.02;
/// Largest displacement off the lattice, over the room between grains: they do not touch.
const SHAKE: f64 = 0.4;

/// Checks settling before anything is written.
pub fn check(scene: &Scene, body: &SettleScene) -> Result<(), Failure> {
    bed::check(scene, prepare(body, Threads::Serial)?, body.timestep)
}

/// Sets settling up.
pub fn prepare(scene: &SettleScene, threads: Threads) -> Result<Bed, Failure> {
    let [length, width] = scene.edges();
    let grains = match &scene.start {
        Some(path) => {
            if scene.coarse_graining != 1.0 {
                let message = format!(
                    "it is taken as it is, so coarse_graining = {} has no grains to make parcels of: give a start with parcels, their law and their time step, or leave `start` out",
                    scene.coarse_graining
                );
                return Err(bed::refused_start(path, message).into());
            }
            let grains = bed::read_start(path)?;
            check_box(path, &grains, [length, width])?;
            grains
        }
        None => loose(scene),
    };
    let law = scene
        .contact
        .law("contact")?
        .coarse_grained(scene.coarse_graining);
    let pace = scene.pace();
    let highest = grains
        .iter()
        .map(|g| g.position.z + g.radius)
        .fold(0.0, f64::max);
    let fastest = grains.iter().map(|g| g.velocity.norm()).fold(0.0, f64::max);
    let wall = |point: Vector3<f64>, normal: Vector3<f64>| Wall::plane(point, normal);
    let (origin, far) = (Vector3::zeros(), Vector3::new(length, width, 0.0));
    Ok(Bed {
        floor: 0.0,
        area: length * width,
        speed: fastest + (2.0 * scene.gravity * highest).sqrt(),
        setup: Setup {
            domain: Domain {
                lower: Vector3::new(0.0, 0.0, -scene.radius()),
                upper: Vector3::new(length, width, highest),
                periodic: [false; 3],
            },
            gravity: Vector3::new(0.0, 0.0, -scene.gravity),
            law: law.into(),
            grains,
            walls: vec![
                wall(origin, Vector3::z()),
                wall(origin, Vector3::x()),
                wall(origin, Vector3::y()),
                wall(far, -Vector3::x()),
                wall(far, -Vector3::y()),
            ],
            bodies: Vec::new(),
            timestep: pace.timestep,
            threads,
        },
        law,
        pace,
        marks: &[],
        ledger: scene.ledger,
    })
}

/// Grains of a start file lie between the walls.
fn check_box(path: &str, grains: &[Grain], edges: [f64; 2]) -> Result<(), Failure> {
    for (k, grain) in grains.iter().enumerate() {
        let x = grain.position;
        let inside =
            (0.0..=edges[0]).contains(&x.x) && (0.0..=edges[1]).contains(&x.y) && x.z >= 0.0;
        if !inside {
            let message = format!(
                "grain {} at ({}, {}, {}) lies outside of the box [0, {}] x [0, {}] above z = 0",
                k + 1,
                x.x,
                x.y,
                x.z,
                edges[0],
                edges[1]
            );
            return Err(bed::refused_start(path, message).into());
        }
    }
    Ok(())
}

/// A lattice of grains without contacts, shaken a little, with small random velocities.
fn loose(scene: &SettleScene) -> Vec<Grain> {
    let mut random = ChaCha8Rng::seed_from_u64(scene.seed);
    let (mean, spread) = (scene.radius(), scene.grains.spread);
    let radius = RadiusLaw::Uniform {
        low: mean * (1.0 - spread),
        high: mean * (1.0 + spread),
    };
    let spacing = SPACING * 2.0 * radius.largest();
    let [length, width] = scene.edges();
    let columns = ((length / spacing) as usize).max(1);
    let lanes = ((width / spacing) as usize).max(1);
    let (dx, dy) = (length / columns as f64, width / lanes as f64);
    let room = SHAKE * (spacing - 2.0 * radius.largest());
    let speed = 0.5 * (scene.gravity * 2.0 * mean).sqrt();
    (0..scene.count())
        .map(|k| {
            let (layer, at) = (k / (columns * lanes), k % (columns * lanes));
            let mut draw = |width: f64| width * (2.0 * random.random::<f64>() - 1.0);
            let position = Vector3::new(
                ((at % columns) as f64 + 0.5) * dx + draw(room),
                ((at / columns) as f64 + 0.5) * dy + draw(room),
                (layer as f64 + 0.5) * spacing + draw(room),
            );
            let velocity = Vector3::from_fn(|_, _| draw(speed));
            Grain {
                velocity,
                ..Grain::at_rest(position, radius.draw(&mut random), scene.grains.density)
            }
        })
        .collect()
}

/// What settling leaves out.
pub fn left_out(scene: &SettleScene) -> Vec<String> {
    bed::left_out(scene.contact.parts(), &LEFT_OUT)
}

pub(super) fn run(scene: &SettleScene, under: &mut Under) -> Result<Findings, Failure> {
    let bed = prepare(scene, under.threads_of_one_run())?;
    let ran = bed::run(&bed, under)?;
    bed::findings(&bed, ran, left_out(scene), under)
}
