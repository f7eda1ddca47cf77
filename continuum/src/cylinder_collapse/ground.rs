//! Ground under a cylinder.

use super::{CylinderCase, CylinderCollapse, ROOM_ABOVE, disc_in_cell};
use crate::error::{Error, require};
use crate::free_surface::{Contact, SpaceFlow, SurfaceOptions, Terrain};
use crate::grid::{Axis, Boundary, Grid};
use crate::rheology::{MuI, Rheology};
use crate::terrain::{GridLines, Surface};

/// Ground on which a cylinder stands and runs out, instead of a level floor; SI units.
#[derive(Debug, Clone, PartialEq)]
pub struct CylinderGround {
    /// Its surface, over all of the grid. The axis of the cylinder is at x = y = 0; its top is level and its height above
    /// the ground there.
    pub surface: Surface,
    /// What holds on it.
    pub contact: Contact,
}

/// Most cells of a grid over ground.
const MOST_CELLS: f64 = 2e6;

/// Ground as the grid of a collapse has it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Laid {
    /// Height of the grid's lower edge (m).
    pub bottom: f64,
    /// Mean height of the ground in each column of cells (m), x fastest.
    pub heights: Vec<f64>,
}

impl CylinderCase {
    /// The cylinder at rest on ground, in natural units.
    pub(super) fn flow_over(
        &self,
        ground: &CylinderGround,
        options: &SurfaceOptions,
    ) -> Result<(SpaceFlow<MuI>, Laid), Error> {
        let spacing = self.spacing();
        let columns = self.columns();
        let shape = ground.surface.seen_from([0.0; 3], self.height)?;
        let start = if self.whole { -self.length_scaled } else { 0.0 };
        let end = self.length_scaled;
        let refused = format!(
            "ground everywhere between {} and {} m along x and y, where the grid is",
            start * self.height,
            end * self.height
        );
        let foot = shape.height_at([0.0; 2]);
        let span = shape.heights_over([start; 2], [end; 2]);
        let (Some(foot), Some([low, high])) = (foot, span) else {
            return Err(Error::OutOfRange {
                key: "terrain",
                value: 0.0,
                allowed: refused,
            });
        };
        // A row of ground below, the top of the cylinder on a face of cells, and room above what is highest.
        let below = ((foot + 1.0 - low) / spacing).ceil() + 1.0;
        let bottom = foot + 1.0 - below * spacing;
        let top = (foot + 1.0).max(high) + (ROOM_ABOVE - 1.0);
        let rows = ((top - bottom) / spacing).ceil();
        require(
            rows * (columns * columns) as f64 <= MOST_CELLS,
            "grid.cells",
            self.cells as f64,
            format!(
                "so many that there are at most {MOST_CELLS} in all: ground from {} to {} m needs {rows} rows",
                low * self.height,
                high * self.height
            ),
        )?;
        let rows = rows as usize;
        let axis = |cells: usize, low| Axis::Bounded {
            length: spacing * cells as f64,
            cells,
            low,
            high: Boundary::FreeSlip,
        };
        let side = axis(columns, Boundary::FreeSlip);
        let grid = Grid::with_moving_surface([
            side,
            side,
            axis(rows, Boundary::NoSlip { velocity: 0.0 }),
        ])?;
        let terrain = Terrain {
            shape,
            origin: [start, start, bottom],
            contact: match ground.contact {
                Contact::Coulomb(friction) => Contact::Coulomb(friction.in_units(&self.units())),
                other => other,
            },
            rise: [0; 3],
        };
        let lines = GridLines {
            origin: terrain.origin,
            spacing: [spacing; 3],
            cells: grid.cell_counts(),
        };
        let cut = terrain.shape.cut(&lines, false)?;
        let radius = 1.0 / (self.aspect * spacing);
        let filled_rows = below as usize;
        let mut fractions = Vec::with_capacity(rows * columns * columns);
        let mut heights = vec![bottom * self.height; columns * columns];
        for k in 0..rows {
            for (column, height) in heights.iter_mut().enumerate() {
                let index = [column % columns, column / columns];
                let free = cut.volume_fraction([index[0], index[1], k]);
                *height += (1.0 - free) * spacing * self.height;
                let low = index.map(|n| self.cells_to_axis(n) as f64);
                fractions.push(if k < filled_rows {
                    free * disc_in_cell(radius, low)
                } else {
                    0.0
                });
            }
        }
        let law = self.rheology.in_units(&self.units());
        let flow =
            SpaceFlow::over_ground(grid, &terrain, fractions, law, [0.0, 0.0, -1.0], *options)?;
        let laid = Laid {
            bottom: bottom * self.height,
            heights,
        };
        Ok((flow, laid))
    }
}

impl CylinderCollapse {
    /// The ground under each column of cells as a block with a sloping top (m), corners round its base and round its top:
    /// at a corner it is as high as the columns around are on the mean.
    pub fn ground_blocks(&self) -> Vec<[[f64; 3]; 8]> {
        let Some(Laid { bottom, heights }) = &self.ground else {
            return Vec::new();
        };
        let middles = self.middles();
        let columns = middles.len();
        let half = 0.5 * self.case.spacing() * self.case.height;
        let corner = |i: usize, j: usize| {
            let around = |n: usize| n.saturating_sub(1)..(n + 1).min(columns);
            let all: Vec<f64> = around(j)
                .flat_map(|b| around(i).map(move |a| a + columns * b))
                .map(|column| heights[column])
                .collect();
            all.iter().sum::<f64>() / all.len() as f64
        };
        let block = |n: usize| {
            let [i, j] = [n % columns, n / columns];
            let ([x0, x1], [y0, y1]) = (
                [middles[i] - half, middles[i] + half],
                [middles[j] - half, middles[j] + half],
            );
            [
                [x0, y0, *bottom],
                [x1, y0, *bottom],
                [x1, y1, *bottom],
                [x0, y1, *bottom],
                [x0, y0, corner(i, j)],
                [x1, y0, corner(i + 1, j)],
                [x1, y1, corner(i + 1, j + 1)],
                [x0, y1, corner(i, j + 1)],
            ]
        };
        (0..heights.len()).map(block).collect()
    }
}
