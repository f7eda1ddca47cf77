//! Plans of scenes of grains with walls, bonds, gravity and a preparation.

use super::{Lines, law};
use crate::failure::Failure;
use crate::run::step;
use crate::run::world::course::{left_out, trial};
use crate::run::world::{Recipe, Stand, store};
use crate::scene::Scene;
use crate::scene::world::Materials;
use colluvium_dem::preparation::{SizeLaw, Weight};
use colluvium_dem::{
    Body, BoxMotion, Domain, Edge, Freedom, Grain, Motion, Shape, Simulation, Solid, Threads, Wall,
};
use nalgebra::Vector3;
use std::time::Instant;

/// Grains of the lattice on which the rate is measured, and grain-steps.
const PROBE_GRAINS: usize = 3000;
const PROBE: u64 = 1_500_000;

/// The plan of a scene of grains.
pub fn plan(scene: &Scene, recipe: &dyn Recipe) -> Result<String, Failure> {
    let origin = &scene.origin;
    let mut lines = Lines::default();
    let materials = recipe.materials(origin)?;
    let found = store::find(recipe, &materials, origin)?;
    let packing = found.as_ref().map(|stored| stored.packing.clone());
    let packing = packing.unwrap_or_else(|| trial(&materials));
    let stand = Stand::new(recipe, &packing, &materials, Threads::Serial, origin)?;
    lines.say("scene", &format!("{}: {}", scene.name, recipe.about()));
    let mut expected = recipe.expected(&materials);
    if let Some(stored) = &found {
        expected.grains = stored.packing.grains.len() as f64;
        expected.preparation = Some(0.0);
    }
    say_grains(&mut lines, &materials, expected.grains);
    let factor = recipe.keys().coarse_graining;
    if factor > 1.0 {
        lines.say(
            "parcels",
            &format!(
                "{factor} times the grains' size; law of the parcels: forces as the square of their size at a scaled overlap, so \
                 that stress, velocity and solid fraction stay (Kappel et al. 2020, §2.5); cost falls as the fourth power"
            ),
        );
    }
    law::say(&mut lines, materials.first_law());
    say_world(&mut lines, &stand);
    say_start(&mut lines, recipe, found.is_some());
    for (topic, text) in recipe.plan() {
        lines.say(&topic, &text);
    }
    lines.say("left out", &left_out(recipe, &stand).join(", "));
    let (taken, choice) = (stand.setup.timestep, &stand.choice);
    let words = match recipe.keys().step.seconds {
        Some(_) => step::given(taken, choice),
        None => step::chosen(choice),
    };
    lines.say_step(taken, &words, choice);
    lines.say(
        "steps",
        &format!("{} at most, {:.4e} s", stand.steps, stand.world.duration),
    );
    say_cost(
        &mut lines,
        &materials,
        &stand,
        expected.grains,
        expected.preparation,
    )?;
    Ok(lines.0)
}

fn say_grains(lines: &mut Lines, materials: &Materials, grains: f64) {
    if grains > 0.0 {
        lines.say("grains", &format!("about {grains:.0}"));
    }
    let parts: f64 = materials
        .ingredients
        .iter()
        .map(|i| i.parts_by_volume)
        .sum();
    for i in &materials.ingredients {
        let name = &materials.names[usize::from(i.material)];
        lines.say(
            "",
            &format!(
                "{name}: {:.4} of the volume, {} kg/m³, {}",
                i.parts_by_volume / parts,
                i.density,
                sizes(&i.sizes)
            ),
        );
    }
}

fn sizes(law: &SizeLaw) -> String {
    let by = match law.weight {
        Weight::Number => "number",
        Weight::Mass => "mass",
    };
    format!(
        "radii {:.4e} to {:.4e} m, mean by number {:.4e} m, shares by {by}",
        law.smallest(),
        law.largest(),
        law.mean()
    )
}

fn say_world(lines: &mut Lines, stand: &Stand) {
    let world = &stand.world;
    for (k, (name, wall)) in world.walls.iter().enumerate() {
        let topic = if k == 0 { "walls" } else { "" };
        lines.say(topic, &format!("{name}: {}", wall_in_words(wall)));
    }
    for (k, (name, body)) in world.bodies.iter().enumerate() {
        let topic = if k == 0 { "bodies" } else { "" };
        lines.say(topic, &format!("{name}: {}", body_in_words(body)));
    }
    if !world.clumps.is_empty() {
        let members: usize = world.clumps.iter().map(|clump| clump.grains.len()).sum();
        let text = format!(
            "{} of {members} balls, rigid, at random places; each moves by the forces on its balls",
            world.clumps.len()
        );
        lines.say("clumps", &text);
    }
    say_box(lines, stand);
    // A component that is zero has no sign.
    let g = world.gravity.map(|component| component + 0.0);
    let mut pulls = vec![format!("({:.4e}, {:.4e}, {:.4e}) m/s²", g.x, g.y, g.z)];
    if world.schedule.is_some() {
        pulls.push("changing in time".into());
    }
    if let Some(sphere) = &world.sphere {
        let radius = sphere.radius;
        pulls.push(format!(
            "a heavy sphere, G M = {:.4e} m³/s², radius {radius} m",
            sphere.parameter
        ));
    }
    if let Some(own) = &world.own_gravity {
        pulls.push(format!(
            "the grains themselves, by a tree of opening {}",
            own.opening
        ));
    }
    lines.say("gravity", &pulls.join(", "));
    for (k, rule) in world.bonds.iter().enumerate() {
        let topic = if k == 0 { "bonds" } else { "" };
        let cement = &rule.cement;
        lines.say(
            topic,
            &format!(
                "between grains less than {} mean radii apart, in {}: E = {:.3e} Pa, radius {} of the smaller grain's, strength {:.3e} Pa \
                 in tension, {:.3e} Pa in shear (Potyondy & Cundall 2004)",
                rule.gap,
                rule.within,
                cement.youngs_modulus,
                cement.radius_ratio,
                cement.tensile_strength,
                cement.shear_strength
            ),
        );
    }
    for crack in &world.cracks {
        lines.say("crack", &format!("no bonds in {crack}"));
    }
}

/// The box, where it has no sides, moves or lets grains go.
fn say_box(lines: &mut Lines, stand: &Stand) {
    let (domain, world) = (&stand.setup.domain, &stand.world);
    let lengths = domain.lengths();
    let axes: Vec<&str> = ["x", "y", "z"]
        .into_iter()
        .zip(domain.periodic)
        .filter_map(|(axis, periodic)| periodic.then_some(axis))
        .collect();
    if !axes.is_empty() {
        let motion = match &world.box_motion {
            BoxMotion::Rest => "at rest".to_owned(),
            BoxMotion::Stretch { edges, .. } => {
                let edge = |edge: &Edge| match edge {
                    Edge::Rest => "rests".to_owned(),
                    Edge::Speed(speed) => format!("grows at {speed} m/s"),
                    Edge::Lengths(points) => format!("follows {} points", points.len()),
                };
                let [x, y, z] = [0, 1, 2].map(|k| edge(&edges[k]));
                format!("x {x}, y {y}, z {z}")
            }
            BoxMotion::Servo(servo) => format!(
                "all edges follow a pressure of {} Pa at {} 1/s at most",
                servo.pressure, servo.rate
            ),
            BoxMotion::Shear { across, rate, .. } => format!(
                "sheared along x across {} at {rate} 1/s (Lees & Edwards 1972)",
                ["x", "y", "z"][*across]
            ),
        };
        let text = format!(
            "{:.4e} m x {:.4e} m x {:.4e} m, periodic along {}; {motion}",
            lengths.x,
            lengths.y,
            lengths.z,
            axes.join(", ")
        );
        lines.say("box", &text);
    }
    if let Some(outlet) = &world.outlet {
        let text = format!("grains that leave {} are taken out", outlet.keep);
        lines.say("outlet", &text);
    }
}

fn body_in_words(body: &Body) -> String {
    let mut words = Vec::new();
    for part in &body.parts {
        words.push(match &part.solid {
            Solid::Sphere { radius } => format!("sphere of radius {radius} m"),
            Solid::Cuboid { half_sides: h } => {
                format!(
                    "cuboid of {} m x {} m x {} m",
                    2.0 * h.x,
                    2.0 * h.y,
                    2.0 * h.z
                )
            }
            Solid::Frustum { radii, height } => {
                format!("radii {} and {} m, {height} m long", radii[0], radii[1])
            }
            Solid::Mesh(mesh) => format!("mesh of {} triangles", mesh.triangles().len()),
        });
    }
    let moves = match &body.freedom {
        Freedom::Free => "free",
        Freedom::Hinged(_) => "on a hinge",
        Freedom::Driven(Motion::Fixed) => "held",
        Freedom::Driven(_) => "driven",
    };
    let mass = match body.mass_properties("body") {
        Ok(mass) if !matches!(body.freedom, Freedom::Driven(_)) => {
            format!(", {:.4e} kg", mass.mass)
        }
        _ => String::new(),
    };
    format!("{}; {moves}{mass}", words.join(", "))
}

fn wall_in_words(wall: &Wall) -> String {
    let shape = match &wall.shape {
        Shape::Plane(_) => "plane".to_owned(),
        Shape::Disk(disk) => format!("disk of radius {} m", disk.radius),
        Shape::Rectangle(r) => format!(
            "rectangle of {} m x {} m",
            2.0 * r.half_sides[0].norm(),
            2.0 * r.half_sides[1].norm()
        ),
        Shape::Cylinder(c) if c.half_length.is_finite() => {
            format!(
                "tube of radius {} m, {} m long",
                c.radius,
                2.0 * c.half_length
            )
        }
        Shape::Cylinder(c) => format!("endless cylinder of radius {} m", c.radius),
        Shape::Frustum(f) => format!(
            "truncated cone, radii {} and {} m, {} m long",
            f.radii[0], f.radii[1], f.height
        ),
        Shape::Cuboid(c) => {
            let [x, y, z] = (2.0 * c.half_sides).into();
            format!("block of {x} m x {y} m x {z} m")
        }
        Shape::SphereShell(s) => format!("sphere of radius {} m", s.radius),
        Shape::Mesh(mesh) => format!("mesh of {} triangles", mesh.triangles().len()),
    };
    let motion = match &wall.motion {
        Motion::Fixed => "at rest",
        Motion::Steady(_) => "moving steadily",
        Motion::Sine(_) => "shaking",
        Motion::Staircase(_) => "jumping",
        Motion::Rotation(_) => "turning",
        Motion::Table(_) => "following a table",
        Motion::Servo(_) => "driven by a force",
    };
    let p = wall.pose.position;
    format!("{shape} at ({}, {}, {}) m, {motion}", p.x, p.y, p.z)
}

fn say_start(lines: &mut Lines, recipe: &dyn Recipe, stored: bool) {
    let text = match (recipe.keys().packing, stored) {
        (Some(named), true) => format!("from the stored packing {}", store::place(named).display()),
        (Some(named), false) => format!(
            "prepared, and kept as {} for other scenes",
            store::place(named).display()
        ),
        (None, _) => format!("prepared from the seed {}", recipe.keys().seed),
    };
    lines.say("start", &text);
}

fn say_cost(
    lines: &mut Lines,
    materials: &Materials,
    stand: &Stand,
    grains: f64,
    preparation: Option<f64>,
) -> Result<(), Failure> {
    let rate = measured_rate(materials, stand)?;
    lines.say(
        "rate",
        &format!(
            "{rate:.3e} grain-steps/s on one thread, measured now on a lattice of {PROBE_GRAINS} such grains"
        ),
    );
    if grains.is_nan() || grains <= 0.0 {
        lines.say(
            "cost",
            "open: the number of grains comes out of the preparation",
        );
        return Ok(());
    }
    let work = stand.steps as f64 * grains;
    let before = match preparation {
        Some(0.0) => "no preparation".to_owned(),
        Some(steps) => format!(
            "about {steps:.1e} before, for the preparation: {:.0} s",
            steps / rate
        ),
        None => "and the preparation".to_owned(),
    };
    lines.say(
        "cost",
        &format!(
            "{work:.3e} grain-steps at most: {:.0} s on one thread; {before}",
            work / rate
        ),
    );
    Ok(())
}

/// Grain-steps per second of a simple cubic lattice of touching grains under the scene's law.
fn measured_rate(materials: &Materials, stand: &Stand) -> Result<f64, Failure> {
    let mut setup = stand.setup.clone();
    let first = &materials.ingredients[0];
    let radius = first.sizes.mean();
    let edge = (PROBE_GRAINS as f64).cbrt().ceil() as usize;
    let spacing = 1.999 * radius;
    setup.grains = (0..PROBE_GRAINS)
        .map(|k| {
            let place = Vector3::new(k % edge, k / edge % edge, k / (edge * edge));
            Grain {
                material: first.material,
                ..Grain::at_rest(place.map(|c| c as f64 * spacing), radius, first.density)
            }
        })
        .collect();
    setup.walls.clear();
    setup.bodies.clear();
    setup.gravity = Vector3::zeros();
    setup.domain = Domain {
        periodic: [false; 3],
        ..setup.domain
    };
    let failed = |error: String| Failure::Run(error);
    let mut simulation = Simulation::new(setup).map_err(|e| failed(e.to_string()))?;
    let steps = PROBE / PROBE_GRAINS as u64;
    let start = Instant::now();
    simulation
        .advance(steps)
        .map_err(|e| failed(e.to_string()))?;
    let seconds = start.elapsed().as_secs_f64().max(1e-9);
    Ok((steps * PROBE_GRAINS as u64) as f64 / seconds)
}
