//! Ground under a collapse.

use super::{CollapseCase, ROOM_ABOVE};
use crate::error::{Error, require};
use crate::free_surface::{Contact, SurfaceFlow, SurfaceOptions, Terrain};
use crate::grid::Grid;
use crate::rheology::ShearLaw;
use crate::terrain::Profile;

/// Ground on which a column stands and runs out, instead of a level floor; SI units.
#[derive(Debug, Clone, PartialEq)]
pub struct CollapseGround {
    /// Its surface, over all of the grid's length from x = 0 on. The column stands on it, its top level
    /// and its height above the ground at x = 0.
    pub profile: Profile,
    /// What holds on it.
    pub contact: Contact,
}

impl CollapseGround {
    /// Lowest and highest ground between x = 0 and a length (m).
    pub fn span(&self, length: f64) -> [f64; 2] {
        let points = self.profile.points().iter();
        let inside = points
            .filter(|[x, _]| *x > 0.0 && *x < length)
            .map(|p| p[1]);
        let ends = [0.0, length].map(|x| self.profile.height_at(x));
        inside
            .chain(ends.into_iter().flatten())
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], z| {
                [low.min(z), high.max(z)]
            })
    }
}

/// Most cells of a grid over ground.
const MOST_CELLS: f64 = 4e6;
/// Ground that reaches below a row by less than this part of a cell does not.
const ROUNDED: f64 = 1e-9;

/// A grid over ground, in natural units.
struct Laid {
    grid: Grid,
    terrain: Terrain,
    spacing: f64,
    /// Cells along x and z.
    counts: [usize; 2],
}

impl<L: ShearLaw + Clone> CollapseCase<L> {
    /// The grid over ground, with room up to a height `top` (m) at least and, if it is given, a row of cells that begins at a height
    /// `level` (m).
    fn lay(&self, ground: &CollapseGround, top: f64, level: Option<f64>) -> Result<Laid, Error> {
        let spacing = self.length_scaled / self.cells as f64;
        let length = self.length_scaled * self.height;
        require(
            [0.0, length]
                .iter()
                .all(|x| ground.profile.height_at(*x).is_some()),
            "terrain.profile",
            length,
            format!("ground at all x from 0 to the end of the grid at {length} m"),
        )?;
        let units = self.units();
        let [low, high] = ground.span(length).map(|z| z / self.height);
        // A row of ground below, and room above what is highest.
        let bottom = match level.map(|z| z / self.height) {
            None => low - spacing,
            Some(level) => {
                let below = ((level - low) / spacing - ROUNDED).ceil().max(0.0) + 1.0;
                level - below * spacing
            }
        };
        let top = (top / self.height).max(high) + (ROOM_ABOVE - 1.0);
        let rows = ((top - bottom) / spacing).ceil();
        require(
            rows * self.cells as f64 <= MOST_CELLS,
            "grid.cells",
            self.cells as f64,
            format!(
                "so many that there are at most {MOST_CELLS} in all: ground from {} to {} m needs {rows} rows",
                low * self.height,
                high * self.height
            ),
        )?;
        let rows = rows as usize;
        let points = ground.profile.points().iter();
        Ok(Laid {
            grid: self.grid(spacing, rows)?,
            terrain: Terrain {
                shape: Profile::new(points.map(|p| p.map(|x| x / self.height)).collect())?,
                origin: [0.0, bottom],
                contact: match ground.contact {
                    Contact::Coulomb(friction) => Contact::Coulomb(friction.in_units(&units)),
                    other => other,
                },
                rise: [0; 2],
            },
            spacing,
            counts: [self.cells, rows],
        })
    }

    /// A flow over a grid, with this part of each cell filled.
    fn flow_on(
        &self,
        laid: Laid,
        fractions: Vec<f64>,
        options: &SurfaceOptions,
    ) -> Result<(SurfaceFlow<L>, f64), Error> {
        let bottom = laid.terrain.origin[1] * self.height;
        let law = self.rheology.in_units(&self.units());
        let flow = SurfaceFlow::over_ground(
            laid.grid,
            &laid.terrain,
            fractions,
            law,
            [0.0, -1.0],
            *options,
        )?;
        Ok((flow, bottom))
    }

    /// The column at rest on ground, in natural units, and the height of the grid's lower edge (m).
    pub(super) fn flow_over(
        &self,
        ground: &CollapseGround,
        options: &SurfaceOptions,
    ) -> Result<(SurfaceFlow<L>, f64), Error> {
        require(
            self.overhang_degrees == 0.0,
            "overhang_degrees",
            self.overhang_degrees,
            "0 over terrain: the column's face stands upright there",
        )?;
        let foot = ground.profile.height_at(0.0).unwrap_or(f64::NAN);
        let laid = self.lay(ground, foot + self.height, None)?;
        let Laid {
            terrain, spacing, ..
        } = &laid;
        let column = [1.0 / self.aspect, foot / self.height + 1.0];
        let [columns, rows] = laid.counts;
        let fractions = (0..rows)
            .flat_map(|k| (0..columns).map(move |i| [i, k]))
            .map(|index| {
                let corner: [f64; 2] =
                    std::array::from_fn(|a| terrain.origin[a] + index[a] as f64 * spacing);
                let end: [f64; 2] =
                    std::array::from_fn(|a| (corner[a] + spacing).min(column[a]).max(corner[a]));
                let size = (end[0] - corner[0]) * (end[1] - corner[1]);
                let part = (size - terrain.shape.area_in(corner, end)) / (spacing * spacing);
                part.clamp(0.0, 1.0)
            })
            .collect();
        self.flow_on(laid, fractions, options)
    }

    /// Ground without any matter on it, with room up to a height and a row that begins at another (m), and the height of the
    /// grid's lower edge (m).
    pub(super) fn bare(
        &self,
        ground: &CollapseGround,
        (top, level): (f64, Option<f64>),
        options: &SurfaceOptions,
    ) -> Result<(SurfaceFlow<L>, f64), Error> {
        let laid = self.lay(ground, top, level)?;
        let nothing = vec![0.0; laid.counts.iter().product()];
        self.flow_on(laid, nothing, options)
    }
}

/// Matter on a grid as it stands at an instant; SI units.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Matter {
    /// Part of each cell that it fills, x fastest: at most what ground leaves free.
    pub fractions: Vec<f64>,
    /// Velocity (m/s) through each face of each component, x fastest: one face more than cells along the component.
    pub velocity: [Vec<f64>; 2],
}
