//! Under a pressure from outside that is the same everywhere every point of matter without weight bears just that.

use super::*;
use crate::free_surface::faces::{Faces, ThinLayer};
use crate::free_surface::fraction::reconstruct;
use crate::free_surface::ground::faces::faces_over;
use crate::free_surface::ground::shores::Shores;
use crate::free_surface::ground::{Contact, Ground, Terrain};
use crate::free_surface::operators::{Material, NEAREST_EXTRAPOLATION, Operators};
use crate::free_surface::sliding::SlidingPlaces;
use crate::grid::{Axis, Boundary, Grid, unflatten};
use crate::strain::{SPACE_COMPONENTS, SPACE_VELOCITIES};
use crate::terrain::Surface;

/// Cells along each axis, and those of a staircase in the corner along its edges.
const CELLS: usize = 7;
const STAIRS: usize = 5;
/// p̂.
const PRESSURE: f64 = 0.7;

fn grid() -> Grid<3> {
    Grid::with_moving_surface(
        [Axis::Bounded {
            length: CELLS as f64,
            cells: CELLS,
            low: Boundary::FreeSlip,
            high: Boundary::FreeSlip,
        }; 3],
    )
    .unwrap()
}

/// Level ground at a third of the first layer of cells.
fn level_ground(grid: &Grid<3>, topology: &Topology<3>) -> Ground<3> {
    let ends = [-1.0, CELLS as f64 + 1.0];
    let corners = ends.map(|x| ends.map(|y| [x, y, 1.0 / 3.0]));
    let terrain = Terrain {
        shape: Surface::new(corners.as_flattened().to_vec(), vec![[0, 2, 1], [1, 2, 3]]).unwrap(),
        origin: [0.0; 3],
        contact: Contact::FreeSlip,
        rise: [0; 3],
    };
    Ground::new(grid, topology, &terrain).unwrap()
}

/// Extremes of the pressure at the points of a staircase, over p̂, of the pressure of a cell in its notches if each of its
/// ways counts p̂ for itself, and the largest number of ways that are alike.
fn borne(over_ground: bool) -> ([f64; 2], f64, usize) {
    let grid = grid();
    let topology = Topology::new(&grid);
    let ground = over_ground.then(|| level_ground(&grid, &topology));
    let fractions: Vec<f64> = (0..grid.cells())
        .map(|cell| {
            let inside = unflatten(cell, [CELLS; 3]).iter().sum::<usize>() < STAIRS;
            let free = ground.as_ref().map_or(1.0, |ground| ground.free[cell]);
            if inside { free } else { 0.0 }
        })
        .collect();
    let mut planes = Vec::new();
    let mut filled = fractions.clone();
    if let Some(ground) = &ground {
        ground.fill(&fractions, &mut filled);
    }
    reconstruct(&topology, &filled, &mut planes);
    let (none, layer) = ([0.0; 3], ThinLayer::DepthAveraged);
    let faces = match &ground {
        None => Faces::of(&grid, &topology, &fractions, none, layer),
        Some(ground) => faces_over(ground, &topology, &fractions, none, layer),
    };
    let outside = Outside {
        pressure: vec![PRESSURE; grid.cells()],
        cover: vec![1.0; grid.cells()],
        ..Outside::nothing(grid.cells())
    };
    let material: Material<'_, 3, SPACE_COMPONENTS> = Material {
        grid: &grid,
        topology: &topology,
        fractions: &fractions,
        planes: &planes,
        shores: &Shores::default(),
        faces: &faces,
        side_walls: None,
        ends: None,
        acceleration: none,
        outside: Some(&outside),
        sliding: &SlidingPlaces::new(&grid),
        stands: false,
    };
    let Operators { discretisation, .. }: Operators<3, SPACE_COMPONENTS, SPACE_VELOCITIES> =
        match &ground {
            None => material.operators(),
            Some(ground) => material.operators_over(ground),
        };
    let p = vec![PRESSURE; faces.active.len()];
    let mut ends = [f64::INFINITY, 0.0_f64];
    for point in discretisation.points() {
        let borne = point.pressure(&p) / PRESSURE;
        ends = [ends[0].min(borne), ends[1].max(borne)];
    }
    let (mut wrong, mut most) = (0.0, 0);
    for cell in 0..grid.cells() {
        let ways = material.pressures_at(cell, NEAREST_EXTRAPOLATION);
        let ways: Vec<_> = ways.into_iter().flatten().collect();
        if ways.len() > most {
            most = ways.len();
            // What comes of p̂ where each way is given all of what it lacks.
            wrong = ways.iter().fold(0.0, |sum, way| {
                let factor = way.share * way.factor;
                sum + factor + material.pressure_beyond(cell, factor) / PRESSURE
            });
        }
    }
    // And it has no force on any velocity.
    let mut force = vec![0.0; discretisation.velocities()];
    for (&(_, j, _), push) in discretisation
        .divergence()
        .iter()
        .zip(discretisation.gradient())
    {
        force[j] += push * PRESSURE;
    }
    for (force, load) in force.iter().zip(discretisation.load(none)) {
        assert!((force + load).abs() < 1e-13, "{force} {load}");
    }
    (ends, wrong, most)
}

#[test]
fn ways_that_are_alike_share_the_pressure_from_outside() {
    for over_ground in [false, true] {
        let ([least, most], wrong, ways) = borne(over_ground);
        println!("ground {over_ground}: {least} to {most}, {ways} ways: {wrong} if each counted");
        assert!(
            (least - 1.0).abs() < 1e-13 && (most - 1.0).abs() < 1e-13,
            "{least} {most}"
        );
        assert!(ways > 1 && (wrong - ways as f64).abs() < 1e-13);
    }
}
