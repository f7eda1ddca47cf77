//! Ground under a collapse.

use super::{CollapseCase, ROOM_ABOVE};
use crate::error::{Error, require};
use crate::free_surface::{Contact, SurfaceFlow, SurfaceOptions, Terrain};
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

impl<L: ShearLaw + Clone> CollapseCase<L> {
    /// The column at rest on ground, in natural units, and the height of the grid's lower edge (m).
    pub(super) fn flow_over(
        &self,
        ground: &CollapseGround,
        options: &SurfaceOptions,
    ) -> Result<(SurfaceFlow<L>, f64), Error> {
        let spacing = self.length_scaled / self.cells as f64;
        let length = self.length_scaled * self.height;
        let foot = ground.profile.height_at(0.0).unwrap_or(f64::NAN);
        require(
            foot.is_finite() && ground.profile.height_at(length).is_some(),
            "terrain.profile",
            length,
            format!("ground at all x from 0 to the end of the grid at {length} m"),
        )?;
        require(
            self.overhang_degrees == 0.0,
            "overhang_degrees",
            self.overhang_degrees,
            "0 over terrain: the column's face stands upright there",
        )?;
        let units = self.units();
        let [low, high] = ground.span(length).map(|z| z / self.height);
        let foot = foot / self.height;
        // A row of ground below, and room above what is highest.
        let bottom = low - spacing;
        let top = (foot + 1.0).max(high) + (ROOM_ABOVE - 1.0);
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
        let grid = self.grid(spacing, rows)?;
        let points = ground.profile.points().iter();
        let terrain = Terrain {
            profile: Profile::new(points.map(|p| p.map(|x| x / self.height)).collect())?,
            origin: [0.0, bottom],
            contact: match ground.contact {
                Contact::Coulomb(friction) => Contact::Coulomb(friction.in_units(&units)),
                other => other,
            },
            rise: 0,
        };
        let column = [1.0 / self.aspect, foot + 1.0];
        let fractions = (0..rows)
            .flat_map(|k| (0..self.cells).map(move |i| [i, k]))
            .map(|index| {
                let corner: [f64; 2] =
                    std::array::from_fn(|a| terrain.origin[a] + index[a] as f64 * spacing);
                let end: [f64; 2] =
                    std::array::from_fn(|a| (corner[a] + spacing).min(column[a]).max(corner[a]));
                let size = (end[0] - corner[0]) * (end[1] - corner[1]);
                let part = (size - terrain.profile.area_in(corner, end)) / (spacing * spacing);
                part.clamp(0.0, 1.0)
            })
            .collect();
        let law = self.rheology.in_units(&units);
        let flow = SurfaceFlow::over_ground(grid, &terrain, fractions, law, [0.0, -1.0], *options)?;
        Ok((flow, bottom * self.height))
    }
}
