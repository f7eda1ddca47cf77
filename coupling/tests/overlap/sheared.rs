//! Grains of stored sheared packings come back where the continuum has sheared what was stored.

use super::growth::{Bed, DENSITY, SIZE, TRAVEL, laws, speed, stresses, unbalanced};
use colluvium_dem::preparation::*;
use nalgebra::Vector3;
use std::ops::ControlFlow;
use std::sync::OnceLock;

/// A packing sheared slowly under the pressure of half of the bed's depth.
fn packing() -> ShearedCell {
    static CELL: OnceLock<ShearedCell> = OnceLock::new();
    let cell = CELL.get_or_init(|| {
        let spec = Shearing {
            grains: 500,
            ingredients: vec![Ingredient::alone(
                RadiusLaw::Uniform {
                    low: 0.45,
                    high: 0.55,
                },
                DENSITY,
            )],
            laws: laws(),
            diameter: 1.0,
            density: DENSITY,
            pressure: 5.0,
            inertial: 0.05,
            strain: 3.0,
            timestep: 2e-3,
            seed: 7,
        };
        let mut go = |_: &_| ControlFlow::Continue(());
        let (cell, report) = shear(&spec, &mut go).unwrap();
        println!("{report}");
        cell
    });
    cell.clone()
}

/// What is done to the stored grains.
#[derive(Clone, Copy, PartialEq)]
enum Back {
    /// Nothing but what the continuum does.
    Stored,
    /// A packing comes in their place.
    Sheared,
    /// They lose their springs, and overlaps.
    Fresh,
}

/// A bed at rest whose stored part has been sheared by so much along y between its side walls, which leaves the wall of its box and its
/// surface where they are; moved in y it is turned back into the box periodically.
fn sheared(back: Back, shear: f64) -> (Bed, Vec<u32>) {
    let misplaced = match back {
        Back::Sheared => 0.5 * shear,
        _ => f64::INFINITY,
    };
    let mut bed = Bed::of(TRAVEL, misplaced);
    bed.advance(3.0, 0.9);
    let middle = Vector3::new(0.0, 0.5 * SIZE[1], 0.5 * SIZE[2]);
    let step = shear * Vector3::y() * Vector3::z().transpose();
    bed.bowl.deform_stored(&middle, &step);
    for grain in &mut bed.bowl.stored_mut().grains {
        grain.position.y = grain.position.y.rem_euclid(SIZE[1]);
    }
    match back {
        Back::Stored => {}
        Back::Sheared => bed.bowl.set_packings(vec![packing()]),
        Back::Fresh => {
            let store = bed.bowl.stored_mut();
            store.pairs.clear();
            store.histories.clear();
        }
    }
    let before: Vec<u32> = bed.simulation.held(|_| true).map(|g| g.id).collect();
    bed.grow();
    // No side moves for what else is stored.
    bed.bowl.deform_stored(&middle, &-step);
    let new = bed
        .simulation
        .held(|_| true)
        .filter(|g| !before.contains(&g.id));
    let face = bed.face();
    let mut ids: Vec<u32> = new
        .filter(|g| g.position.x < face - 0.5)
        .map(|g| g.id)
        .collect();
    ids.sort_unstable();
    (bed, ids)
}

/// What a patch does in the first two √(d/g) after it has come back, by what it is: of a packing in steady shear, of the bed's own
/// grains sheared by the continuum, and of those without springs. Stresses are over those of the bed at rest in the same place.
#[test]
fn sheared_material_comes_back_from_a_packing() {
    let mut whole = super::growth::rested();
    let mut run = |name: &str, back: Back, shear: f64| {
        let (mut bed, ids) = sheared(back, shear);
        let last = *bed.bowl.moves().last().unwrap();
        let first = unbalanced(&mut bed.simulation, &ids);
        let face = bed.face();
        let mut rows = Vec::new();
        for _ in 0..4 {
            bed.advance(0.5, 1.0);
            rows.push(stresses(&mut bed.simulation, [face - 2.0, face]));
        }
        let rest = stresses(&mut whole, [face - 2.0, face]);
        let over = rows.iter().map(|r| [r[0] / rest[0], r[1] / rest[1]]);
        let over: Vec<[f64; 2]> = over.collect();
        println!(
            "{name}: {} grains, {} replaced, {} moved, remainder {:.3e}; unbalanced {first:.2}; sxx, szz over the bed's {over:.3?}; speed {:.3}",
            ids.len(),
            last.replaced,
            last.displaced,
            last.remainder,
            speed(&bed.simulation)
        );
        let books = bed.books();
        assert!(books[1].abs() < 1e-12 && books[2] < 1e-12 && books[3] < 1e-12);
        (last.replaced, first, over[0])
    };
    run("stored, not sheared", Back::Stored, 0.0);
    run("stored, 0.3", Back::Stored, 0.3);
    let (none, stored, weak) = run("stored, 0.7", Back::Stored, 0.7);
    let (_, fresh, _) = run("fresh, 0.7", Back::Fresh, 0.7);
    let (replaced, packing, carries) = run("sheared packing, 0.7", Back::Sheared, 0.7);
    assert!(none == 0.0 && replaced > 100.0);
    assert!(packing < 0.2 * stored && packing < 0.2 * fresh);
    // After half of the time the packing carries the bed's weight, and grains whose neighbours were pulled apart do not.
    assert!((0.8..1.3).contains(&carries[1]) && carries[0] > 1.5 * weak[0]);
    assert!(weak[1] < 0.5);
}
