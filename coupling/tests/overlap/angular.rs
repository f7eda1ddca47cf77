//! Angular momentum of the grains closes to round-off with what every load gives, and does not where one is left out.

use super::growth::{self, Bed};
use super::material::{Joined, TRAVEL};
use super::world::{DENSITY, law, rheology, scales};
use colluvium_continuum::grid::Boundary;
use colluvium_coupling::overlap::material_edge::Travel;
use colluvium_coupling::overlap::{AngularBook, FlatEdge, Overlap, OverlapSettings, OverlapSpec};
use colluvium_dem::{Domain, Grain, Setup, Simulation, Threads, Wall};
use nalgebra::Vector3;

/// The account of an axis closes; without one of these entries, left out by name, it does not.
fn closes(book: &AngularBook, simulation: &Simulation, axes: &[usize], entries: &[&str]) {
    for &axis in axes {
        println!(
            "axis {axis}: L {:.3e}, weight {:.3e}, traction {:.3e}, relaxation {:.3e}, moments {:.3e}, handed {:.3e}",
            simulation.leapfrog_angular_momentum()[axis],
            book.weight[axis],
            book.traction[axis],
            book.relaxation[axis],
            book.moments[axis],
            book.handed[axis],
        );
    }
    let arms = book.arms(axes);
    println!("arms of traction and relaxation {arms:.3?}");
    // Half a diameter; a depth of the shell or a cell would be more.
    assert!(arms.iter().all(|arm| *arm < 0.5), "{arms:?}");
    for &axis in axes {
        let error = book.error(simulation, axis);
        println!("about axis {axis}: {error:.1e}");
        assert!(error < 1e-11, "axis {axis}: {error:e}");
    }
    for entry in entries {
        let mut blind = book.clone();
        *match *entry {
            "weight" => &mut blind.weight,
            "traction" => &mut blind.traction,
            "relaxation" => &mut blind.relaxation,
            "moments" => &mut blind.moments,
            _ => &mut blind.handed,
        } = Vector3::zeros();
        let worst = axes.iter().map(|&axis| blind.error(simulation, axis));
        let worst = worst.fold(0.0, f64::max);
        println!("without {entry}: {worst:.1e}");
        assert!(worst > 1e-8, "without {entry}: {worst:e}");
    }
}

/// Grains that move every way in a box with rough walls, under a continuum that slides over them.
#[test]
fn a_flat_edge_in_a_box_keeps_all_three() {
    let (pitch, side, layers) = (1.02, 5, 14);
    let length = pitch * f64::from(side);
    let far = Vector3::new(length, length, 0.0);
    let places =
        (0..layers).flat_map(|k| (0..side).flat_map(move |j| (0..side).map(move |i| [i, j, k])));
    let grains = places.map(|place| {
        let centre = Vector3::from_iterator(place.iter().map(|&p| pitch * (f64::from(p) + 0.5)));
        let turned =
            |phase: f64| 0.3 * (12.9 * centre.x + 78.2 * centre.y + phase * centre.z).sin();
        Grain {
            velocity: Vector3::new(0.1 * centre.z + turned(1.7), turned(5.3), turned(9.1)),
            spin: Vector3::new(turned(3.1), turned(4.7), turned(7.9)),
            ..Grain::at_rest(centre, 0.5, DENSITY)
        }
    });
    let wall = |point, normal| Wall::plane(point, normal);
    let setup = Setup {
        domain: Domain {
            lower: Vector3::repeat(-1.0),
            upper: Vector3::new(length + 1.0, length + 1.0, 1e3),
            periodic: [false; 3],
        },
        gravity: Vector3::new(0.3, 0.1, -1.0),
        law: law().into(),
        grains: grains.collect(),
        walls: vec![
            wall(Vector3::zeros(), Vector3::z()),
            wall(Vector3::zeros(), Vector3::x()),
            wall(Vector3::zeros(), Vector3::y()),
            wall(far, -Vector3::x()),
            wall(far, -Vector3::y()),
        ],
        bodies: Vec::new(),
        timestep: 2e-3,
        threads: Threads::Serial,
    };
    let mut simulation = Simulation::new(setup).unwrap();
    let mut edge = FlatEdge::across(simulation.domain(), 2, 0, true, 9.0);
    edge.area = length * length;
    let spec = OverlapSpec {
        edge,
        rheology: rheology(),
        mass: None,
        far_end: Boundary::FreeSurface,
        scales: scales(rheology().bulk_density()),
        settings: OverlapSettings::default(),
        strain_rate_floor: 1e-6,
    };
    let mut overlap = Overlap::replace(spec, &mut simulation).unwrap();
    overlap.open_angular_book();
    // In pieces that end between two loads.
    for _ in 0..7 {
        overlap.advance(&mut simulation, 333).unwrap();
    }
    let entries = ["weight", "traction", "relaxation", "moments"];
    closes(
        overlap.angular_book().unwrap(),
        &simulation,
        &[0, 1, 2],
        &entries,
    );
}

/// A column whose edge moves with the material and hands strips over, periodic across: about that axis.
#[test]
fn a_material_edge_keeps_that_about_its_slab() {
    let mut joined = Joined::with_edge(false, false, 11.0, Some(TRAVEL));
    joined
        .zone
        .open_angular_book(&mut joined.simulation)
        .unwrap();
    joined.advance(12.0, 1.0);
    let moves = joined.edge().moves().len();
    println!("{moves} moves");
    assert!(moves > 0);
    let entries = ["weight", "traction", "relaxation", "moments", "handed"];
    closes(
        joined.zone.angular_book().unwrap(),
        &joined.simulation,
        &[1],
        &entries,
    );
}

/// A bowl in a bed with walls, stirred.
#[test]
fn a_bowl_keeps_all_three() {
    let travel = Travel {
        wake: 0.02,
        ..growth::TRAVEL
    };
    let mut bed = Bed::with(travel);
    let middle = Vector3::new(0.5 * growth::SIZE[0], 0.5 * growth::SIZE[1], 0.0);
    bed.simulation.give_velocity(|g| {
        let from = g.position - middle;
        0.3 * (-0.02 * from.norm_squared()).exp() * Vector3::new(0.3 - from.y, 0.2 + from.x, -1.0)
    });
    bed.bowl.open_angular_book(&mut bed.simulation).unwrap();
    bed.advance(2.0, 1.0);
    let moves = bed.bowl.moves().len();
    println!("{moves} moves");
    let entries = ["weight", "traction", "relaxation", "moments", "handed"];
    let entries = &entries[..if moves > 0 { 5 } else { 4 }];
    closes(
        bed.bowl.angular_book().unwrap(),
        &bed.simulation,
        &[0, 1, 2],
        entries,
    );
}
