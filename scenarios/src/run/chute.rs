//! Grains on a rough chute, from a start file.

use super::bed::{self, Bed};
use super::{Findings, Under};
use crate::failure::Failure;
use crate::scene::{ChuteScene, Scene, SceneBody};
use crate::start_file;
use crate::summary::Quantity;
use colluvium_dem::{Domain, Grain, Setup, Threads};
use nalgebra::Vector3;

/// What the chute leaves out, whatever its law.
const LEFT_OUT: [&str; 4] = [
    "bonds",
    "air",
    "side walls (periodic)",
    "breakage of grains",
];

/// Kinetic energy of translation after so many steps of the bundled scene: LAMMPS 22 Jul 2025,
/// `gran/hooke/history`, from the same start.
pub const LAMMPS: [(u64, f64); 5] = [
    (200, 4866.2732),
    (600, 3721.5526),
    (1000, 3071.9466),
    (1400, 2620.8282),
    (2400, 1999.0591),
];

/// Steps at which LAMMPS' energies are printed.
const MARKS: [u64; 5] = [200, 600, 1000, 1400, 2400];

/// Room between two parcels beyond which a seam of the cut start counts as overlapping, over their
/// diameter: as deep as grains of the bed press each other.
const SEAM: f64 = 0.01;

/// Checks a chute before anything is written.
pub fn check(scene: &Scene, body: &ChuteScene) -> Result<(), Failure> {
    bed::check(scene, prepare(body, Threads::Serial)?, body.timestep)
}

/// Sets a chute up.
pub fn prepare(scene: &ChuteScene, threads: Threads) -> Result<Bed, Failure> {
    let grains = match &scene.start {
        Some(path) => {
            let grains = bed::read_start(path)?;
            check_box(scene, path, &grains)?;
            grains
        }
        None => bed::bundled(start_file::chute())?,
    };
    let floor = base_top(&grains);
    let tiled = tile(&grains, scene);
    let grains = if scene.coarse_graining > 1.0 {
        enlarge(&tiled, scene, floor)
    } else {
        tiled
    };
    let law = scene
        .contact
        .law("contact")?
        .coarse_grained(scene.coarse_graining);
    let slope = scene.slope_degrees.to_radians();
    let [length, width] = scene.edges();
    let (lowest, highest) = grains.iter().fold((0.0_f64, 1.0_f64), |(low, high), g| {
        (
            low.min(g.position.z - g.radius),
            high.max(g.position.z + g.radius),
        )
    });
    let pace = scene.pace();
    let speed = grains.iter().map(|g| g.velocity.norm()).fold(0.0, f64::max);
    Ok(Bed {
        floor,
        area: length * width,
        speed: speed + scene.gravity * slope.sin() * pace.timestep * pace.steps as f64,
        setup: Setup {
            domain: Domain {
                lower: Vector3::new(0.0, 0.0, lowest),
                upper: Vector3::new(length, width, highest),
                periodic: [true, true, false],
            },
            gravity: scene.gravity * Vector3::new(slope.sin(), 0.0, -slope.cos()),
            law: law.into(),
            grains,
            walls: Vec::new(),
            bodies: Vec::new(),
            timestep: pace.timestep,
            threads,
        },
        law,
        pace,
        marks: &MARKS,
        ledger: scene.ledger,
    })
}

/// Grains of a start file lie in the periodic box of the scene.
fn check_box(scene: &ChuteScene, path: &str, grains: &[Grain]) -> Result<(), Failure> {
    for (axis, (name, key, edge)) in [("x", "length", scene.length), ("y", "width", scene.width)]
        .into_iter()
        .enumerate()
    {
        let outside = grains
            .iter()
            .position(|g| !(0.0..=edge).contains(&g.position[axis]));
        if let Some(k) = outside {
            let message = format!(
                "grain {} has {name} = {}, outside of the scene's box [0, {key} = {edge}]",
                k + 1,
                grains[k].position[axis]
            );
            return Err(bed::refused_start(path, message).into());
        }
    }
    Ok(())
}

/// Mean height of the tops of the frozen grains; of the lowest grain where none is frozen.
fn base_top(grains: &[Grain]) -> f64 {
    let base = || grains.iter().filter(|g| g.fixed);
    let count = base().count();
    if count == 0 {
        let bottom = |g: &Grain| g.position.z - g.radius;
        return grains.iter().map(bottom).fold(f64::INFINITY, f64::min);
    }
    base().map(|g| g.position.z + g.radius).sum::<f64>() / count as f64
}

/// Lays the start side by side along x and y.
fn tile(grains: &[Grain], scene: &ChuteScene) -> Vec<Grain> {
    let copies = scene.copies();
    let corner = |k: usize| {
        Vector3::new(
            (k % copies) as f64 * scene.length,
            (k / copies) as f64 * scene.width,
            0.0,
        )
    };
    (0..copies * copies)
        .flat_map(|k| {
            grains.iter().map(move |g| Grain {
                position: g.position + corner(k),
                ..*g
            })
        })
        .collect()
}

/// A bed of parcels from a bed of grains: enlarged about the tops of its base, cut to the same box and
/// then, from the top, to the same mass; one of two parcels that the cut pushed into each other across
/// a seam is left out, which leaves voids that the flow has to close. Velocities stay, spins become slower as radii grow.
fn enlarge(grains: &[Grain], scene: &ChuteScene, floor: f64) -> Vec<Grain> {
    let factor = scene.coarse_graining;
    let [length, width] = scene.edges();
    let mass: f64 = grains.iter().filter(|g| !g.fixed).map(Grain::mass).sum();
    let mut inside: Vec<Grain> = grains
        .iter()
        .map(|g| {
            let mut position = factor * g.position;
            position.z -= (factor - 1.0) * floor;
            Grain {
                position,
                spin: g.spin / factor,
                radius: factor * g.radius,
                ..*g
            }
        })
        .filter(|g| g.position.x < length && g.position.y < width)
        .collect();
    // Frozen ones first, so that the base has no holes but those of its own seams; then from below.
    inside.sort_by(|a, b| {
        b.fixed
            .cmp(&a.fixed)
            .then(a.position.z.total_cmp(&b.position.z))
    });
    let mut kept: Vec<Grain> = Vec::new();
    let mut at_seams: Vec<Grain> = Vec::new();
    let mut held = 0.0;
    for grain in inside {
        let reach = 2.0 * grain.radius;
        let x = grain.position;
        let near = x.x < reach || x.y < reach || x.x > length - reach || x.y > width - reach;
        if near {
            if at_seams
                .iter()
                .any(|g| cut_into(g, &grain, [length, width]))
            {
                continue;
            }
            at_seams.push(grain);
        }
        if !grain.fixed {
            if held + 0.5 * grain.mass() > mass {
                continue;
            }
            held += grain.mass();
        }
        kept.push(grain);
    }
    kept
}

/// Whether two parcels overlap across a seam of the box.
fn cut_into(a: &Grain, b: &Grain, edges: [f64; 2]) -> bool {
    let mut apart = a.position - b.position;
    let mut across = false;
    for (axis, edge) in edges.into_iter().enumerate() {
        let turns = (apart[axis] / edge).round();
        across |= turns != 0.0;
        apart[axis] -= turns * edge;
    }
    across && apart.norm() < (a.radius + b.radius) * (1.0 - SEAM)
}

/// What the chute leaves out.
pub fn left_out(scene: &ChuteScene) -> Vec<String> {
    bed::left_out(scene.contact.parts(), &LEFT_OUT)
}

/// Whether the scene is the bundled one but for its length and its output.
fn is_bundled(scene: &Scene) -> bool {
    let mut own = scene.resolved.clone();
    let Ok(mut bundled) = Scene::load("chute", &[]).map(|scene| scene.resolved) else {
        return false;
    };
    for key in ["steps", "duration", "record_every", "ledger", "frames"] {
        own.remove(key);
        bundled.remove(key);
    }
    own == bundled
}

pub(super) fn run(scene: &ChuteScene, under: &mut Under) -> Result<Findings, Failure> {
    let bed = prepare(scene, under.threads_of_one_run())?;
    let ran = bed::run(&bed, under)?;
    let mut found = bed::findings(&bed, ran, left_out(scene), under)?;
    let energy = &found.tables[0];
    let rows: Vec<(f64, f64)> = energy.pairs("step", "translation");
    let velocity = energy.column("velocity").last().copied();
    for (step, reference) in LAMMPS {
        if let Some(&(_, energy)) = rows.iter().find(|row| row.0 == step as f64) {
            let quantity = Quantity::new(energy, "J");
            let quantity = if is_bundled(under.scene) {
                quantity.against(reference, "translation; LAMMPS 22 Jul 2025, same start")
            } else {
                quantity.from("translation")
            };
            found
                .summary
                .put(&format!("kinetic_energy_at_step_{step}"), quantity);
        }
    }
    found.summary.put(
        "mean_velocity",
        Quantity::new(velocity.unwrap_or(f64::NAN), "m/s").from("downslope, at the end"),
    );
    Ok(found)
}

/// The scene's body, if it is a chute.
pub fn body(scene: &Scene) -> Option<&ChuteScene> {
    match &scene.body {
        SceneBody::Chute(body) => Some(body),
        _ => None,
    }
}
