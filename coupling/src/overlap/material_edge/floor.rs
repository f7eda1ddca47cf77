//! Ground under a continuum that has the column's front.
//!
//! One description serves grains and continuum ([`CollapseGround`], along x). A continuum whose far face is free runs out over it by cut
//! cells, seen along its edge's own axis, so in a mirror where it looks in one. The column and its overlaps stand where the ground is level at
//! z = 0; there a row of cells begins, and no cell is cut. What has grains on both sides, or a wall of the grid behind, stands on
//! level ground alone.
//!
//! Force and impulse of the ground on the continuum are those of a wall: part of what an account says it had from walls
//! and surface.

use super::travel::BY_GROUND;
use super::{MaterialEdge, MaterialEdgeSpec, OverlapError, Side, Travel};
use colluvium_continuum::column_collapse::CollapseGround;
use colluvium_continuum::terrain::Profile;

/// Ground that is off by less than this part of a cell is level.
pub const LEVEL: f64 = 1e-9;
/// Part of a full cell's mass in grains of the overlap from which on a row has some.
const COVERED: f64 = 0.3;

/// Whether a continuum with these edges ends at a face that is free.
pub(super) fn has_front(edges: &[MaterialEdgeSpec]) -> bool {
    matches!(edges, [edge] if edge.back > edge.wall)
}

/// From which place on along its own axis an edge has level ground below its grains (m).
pub(super) fn level_from(ground: &CollapseGround, spec: &MaterialEdgeSpec) -> f64 {
    let least = LEVEL * spec.spacing();
    let points = along(ground, spec.side);
    let uneven = points.iter().rposition(|[_, z]| z.abs() > least);
    match uneven {
        None => f64::NEG_INFINITY,
        Some(last) => points
            .get(last + 1)
            .map_or(f64::INFINITY, |[place, _]| *place),
    }
}

/// Points (m) of the ground along an axis, rising as far as the ground does not turn back.
fn along(ground: &CollapseGround, side: Side) -> Vec<[f64; 2]> {
    let points = ground.profile.points().iter();
    let mut points: Vec<[f64; 2]> = points.map(|p| side.in_plane(*p)).collect();
    if side == Side::Above {
        // In a mirror ground is on the other hand of a line.
        points.reverse();
    }
    points
}

/// The ground as the grid of an edge's continuum has it: along its axis, from where the grid begins. Beyond its ends it goes on
/// level for a cell, for round-off.
pub(super) fn under_grid(
    ground: &CollapseGround,
    spec: &MaterialEdgeSpec,
) -> Result<CollapseGround, OverlapError> {
    let mut points = along(ground, spec.side);
    for point in &mut points {
        point[0] -= spec.wall;
    }
    let ends = [points.first().copied(), points.last().copied()];
    if let [Some([first, low]), Some([last, high])] = ends {
        let h = spec.spacing();
        points.insert(0, [first - h, low]);
        points.push([last + h, high]);
    }
    Ok(CollapseGround {
        profile: Profile::new(points)?,
        contact: ground.contact,
    })
}

/// Refuses ground that is not level under the column and its overlap.
pub(super) fn check(ground: &CollapseGround, spec: &MaterialEdgeSpec) -> Result<(), OverlapError> {
    let lip = spec.back - spec.lean() * spec.case.height;
    let level = level_from(ground, spec);
    if level <= lip.min(spec.place) {
        return Ok(());
    }
    Err(OverlapError::OutOfRange {
        key: "ground",
        value: spec.side.along(level),
        allowed: "level at z = 0 under the column and its overlap",
    })
}

impl MaterialEdge {
    /// Moves inwards that were not made, as the ground there is not level: how many, each counted once until it is made or no
    /// longer wanted, and when the first (s).
    pub fn stopped_moves(&self) -> Option<(f64, f64)> {
        let [count, first] = self.journey.stopped;
        (count > 0.0).then_some((count, first))
    }

    /// Where it has come to ground that is not level, if it has (m along x), and up to where the ground is level: where the edge is, or
    /// more of its grains than fill a cell.
    pub fn beyond_level_ground(&self) -> Option<[f64; 2]> {
        let grains = self.sighting.snapshot.grains.iter();
        let beyond = grains.filter(|g| self.labels.of(g).is_some() && g.position.x < self.level);
        let [mass, farthest] = beyond.fold([0.0, self.level], |[mass, farthest], g| {
            [mass + g.mass, g.position.x.min(farthest)]
        });
        let least = match mass > self.full() {
            true => farthest,
            false => self.least_place(),
        };
        let ends = [least, self.level].map(|place| self.spec.side.along(place));
        (least < self.level).then_some(ends)
    }

    /// Least place of the edge in rows with grains of its overlap (m).
    fn least_place(&self) -> f64 {
        let [columns, _] = self.cells.counts;
        let covers = self.sums.cover.chunks(columns);
        let full = self.full();
        let rows = self.held.rows.iter().zip(covers);
        let there = rows.filter(|(_, covers)| covers.iter().any(|c| c.copied > COVERED * full));
        there.fold(f64::INFINITY, |least, (row, _)| least.min(row.place))
    }

    /// Whether the ground is level where a move inwards at a time (s) would put the edge; if not, that is noted.
    pub(super) fn has_level_ground_for(&mut self, travel: &Travel, time: f64) -> bool {
        if self.least_place() - travel.width >= self.level {
            return true;
        }
        if self.journey.refuse(BY_GROUND) {
            let [count, first] = &mut self.journey.stopped;
            if *count == 0.0 {
                *first = time;
            }
            *count += 1.0;
        }
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use colluvium_continuum::free_surface::Contact;

    #[test]
    fn a_mirror_turns_the_ground_and_keeps_it_below_the_line() {
        let step = vec![[0.0, 0.0], [4.0, 0.0], [4.0, -1.0], [9.0, -2.0]];
        let ground = CollapseGround {
            profile: Profile::new(step).unwrap(),
            contact: Contact::NoSlip,
        };
        let seen = along(&ground, Side::Above);
        assert_eq!(seen, [[-9.0, -2.0], [-4.0, -1.0], [-4.0, 0.0], [0.0, 0.0]]);
        let mirrored = Profile::new(seen).unwrap();
        for box_of in [[3.0, -3.0, 4.0, 0.5], [4.0, -3.0, 6.0, -1.1]] {
            let [x0, z0, x1, z1] = box_of;
            let own = ground.profile.area_in([x0, z0], [x1, z1]);
            let image = mirrored.area_in([-x1, z0], [-x0, z1]);
            assert!(own > 0.0 && (image - own).abs() < 1e-14, "{own} {image}");
        }
    }
}
