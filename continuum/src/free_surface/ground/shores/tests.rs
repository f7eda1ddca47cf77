use super::*;
use crate::free_surface::fraction::reconstruct;
use crate::free_surface::ground::{Contact, Terrain};
use crate::grid::{Axis, Boundary, Grid};
use crate::terrain::Profile;

const COLUMNS: usize = 20;
const ROWS: usize = 16;
/// Surfaces are compared in cells with more matter than this: less does not say where it lies to so many digits.
const SOME: f64 = 1e-4;

fn along(cells: usize) -> Axis {
    Axis::Bounded {
        length: cells as f64,
        cells,
        low: Boundary::FreeSlip,
        high: Boundary::FreeSlip,
    }
}

/// Heights of a line of slope `slope` through (10.3, 7.45).
fn line(slope: f64) -> impl Fn(f64) -> f64 {
    move |x| 7.45 + slope * (x - 10.3)
}

/// Matter between ground and a surface in each cell of 20 × 16, ground, and the planes of both together.
struct Lying {
    topology: Topology<2>,
    ground: Ground<2>,
    fractions: Vec<f64>,
    planes: Vec<Option<Plane>>,
    shores: Shores,
}

impl Lying {
    /// On ground of a slope under `surface`, where that is higher.
    fn new(slope: f64, surface: impl Fn(f64) -> f64) -> Self {
        let grid = Grid::with_moving_surface([along(COLUMNS), along(ROWS)]).unwrap();
        let topology = Topology::new(&grid);
        let height = line(slope);
        // Kinks fall on points of the profile: where a line meets the ground, x = 10.3.
        let points = || (0..=300).map(|n| 0.3 + 0.1 * (f64::from(n) - 50.0));
        let profile =
            |of: &dyn Fn(f64) -> f64| Profile::new(points().map(|x| [x, of(x)]).collect()).unwrap();
        let top = profile(&|x| height(x).max(surface(x)));
        let terrain = Terrain {
            shape: profile(&height),
            origin: [0.0; 2],
            contact: Contact::NoSlip,
            rise: [0; 2],
        };
        let ground = Ground::new(&grid, &topology, &terrain).unwrap();
        let fractions: Vec<f64> = (0..COLUMNS * ROWS)
            .map(|cell| {
                let low = [cell % COLUMNS, cell / COLUMNS].map(|i| i as f64);
                let high = low.map(|x| x + 1.0);
                let area = top.area_in(low, high) - terrain.shape.area_in(low, high);
                area.clamp(0.0, ground.free[cell])
            })
            .collect();
        let (mut filled, mut planes) = (Vec::new(), Vec::new());
        ground.fill(&fractions, &mut filled);
        reconstruct(&topology, &filled, &mut planes);
        for (plane, fraction) in planes.iter_mut().zip(&fractions) {
            if *fraction <= DUST {
                *plane = None;
            }
        }
        let mut shores = Shores::default();
        shores.find(&ground, &topology, &fractions, &planes);
        Self {
            topology,
            ground,
            fractions,
            planes,
            shores,
        }
    }

    /// By how much the surface misses a line in the middle of its cells, 3 to 16 along x and off the lid: of matter, and of
    /// matter and ground.
    fn misses(&self, surface: impl Fn(f64) -> f64) -> [f64; 2] {
        let mut worst = [0.0_f64; 2];
        for (cell, own) in self.planes.iter().enumerate() {
            let [column, row] = [cell % COLUMNS, cell / COLUMNS];
            let is_inside = (3..17).contains(&column) && (2..ROWS - 2).contains(&row);
            let Some(own) = own.filter(|_| is_inside && self.fractions[cell] > SOME) else {
                continue;
            };
            let plane = self.shores.plane(cell).copied().unwrap_or(own);
            for (worst, plane) in worst.iter_mut().zip([plane, own]) {
                for x in [0.0, 1.0] {
                    let there = [x, surface(column as f64 + x) - row as f64, 0.0];
                    *worst = worst.max(plane.depth(there).abs());
                }
            }
        }
        worst
    }
}

/// A wedge of matter on a slope, level or not, up or down: the surface is the plane that it was made from up to the last cell.
/// The planes of matter and ground are not (negative control).
#[test]
fn plane_surfaces_are_found_at_shores() {
    let mut control = 0.0_f64;
    for ground in [-0.9, -0.45, -0.2, 0.3, 0.7, 1.3] {
        for surface in [-0.5, -0.3, -0.1, 0.0, 0.15, 0.4] {
            let exact = line(surface);
            let lying = Lying::new(ground, &exact);
            let [miss, before] = lying.misses(&exact);
            assert!(miss < 1e-8, "{ground} {surface}: {miss:e}");
            control = control.max(before);
        }
    }
    assert!(control > 0.05, "{control:e}");
}

/// Where no plane fits the surface stays that of matter and ground: an edge as steep as it is high.
#[test]
fn what_is_no_plane_is_left_alone() {
    let front = |x: f64| {
        let below = line(-0.3)(x);
        if x < 10.3 {
            below + 0.9 * (10.3 - x).sqrt()
        } else {
            below
        }
    };
    let lying = Lying::new(-0.3, front);
    assert!(!lying.shores.cells.is_empty());
    let last = lying.shores.cells.iter().filter(|shore| {
        let around = Neighbourhood::around(&lying.topology, &lying.fractions, shore.cell);
        around.any(|cell| lying.fractions[cell] <= DUST && lying.ground.free[cell] < 1.0)
    });
    let weights: Vec<f64> = last.map(|shore| shore.weight).collect();
    assert!(
        !weights.is_empty() && weights.iter().all(|w| *w == 0.0),
        "{weights:?}"
    );
}
