//! Ground that is no plane under a slab of grains: the line that their continuum has for ground, drawn out across.

use crate::failure::Failure;
use crate::scene::world::Place;
use crate::table::Table;
use colluvium_continuum::terrain::Profile;
use colluvium_coupling::overlap::material_edge::LEVEL;
use colluvium_dem::Wall;
use colluvium_dem::walls::{Mesh, MeshError};
use nalgebra::Vector3;
use std::sync::Arc;

/// Ground from x = 0 on, in the order of x; its height counts from its own at 0.
#[derive(Clone, Debug, PartialEq)]
pub struct Land {
    line: Profile,
}

impl Land {
    /// Of a line that a scene gives at a key, to be there up to an end (m) that is said in words; then it goes on level for a
    /// length `beyond` (m).
    pub fn new(
        given: &Profile,
        (end, words): (f64, &str),
        beyond: f64,
        (at, key): (Place<'_>, &str),
    ) -> Result<Land, Failure> {
        let points = given.points();
        let [from, to] = [points[0][0], points[points.len() - 1][0]];
        if points.windows(2).any(|pair| pair[1][0] < pair[0][0]) {
            let range = "points in the order of x: ground that does not turn back under itself";
            return Err(at.refuse(key, "x that decreases", range).into());
        }
        if from > 0.0 || to < end {
            let value = format!("x from {from} to {to} m");
            let range = format!("from 0 or before it to {end:.6} m or beyond: {words}");
            return Err(at.refuse(key, value, range).into());
        }
        // Of a step at 0 the far side.
        let first = points.partition_point(|p| p[0] <= 0.0);
        let base = match points[..first].last() {
            Some([x, z]) if *x == 0.0 => *z,
            _ => given.height_at(0.0).unwrap_or(0.0),
        };
        let mut line = vec![[0.0, 0.0]];
        line.extend(points[first..].iter().map(|[x, z]| [*x, z - base]));
        let [last, level] = line[line.len() - 1];
        line.push([last + beyond, level]);
        let line = Profile::new(line).map_err(|error| at.refuse(key, "given", error))?;
        Ok(Land { line })
    }

    /// The line itself.
    pub fn line(&self) -> &Profile {
        &self.line
    }

    /// Height at x (m); 0 before 0 and on a plane, that of its end beyond it.
    pub fn height(land: Option<&Land>, x: f64) -> f64 {
        let Some(land) = land.filter(|_| x > 0.0) else {
            return 0.0;
        };
        let last = land.line.points().last().map_or(0.0, |p| p[1]);
        land.line.height_at(x).unwrap_or(last)
    }

    /// Heights of the lowest and the highest ground (m), 0 among them.
    pub fn span(land: Option<&Land>) -> [f64; 2] {
        let points = land.map_or(&[][..], |land| land.line.points());
        points.iter().fold([0.0; 2], |[low, high], [_, z]| {
            [f64::min(low, *z), f64::max(high, *z)]
        })
    }

    /// Where it is no longer level (m), seen on cells so long (m): by [`LEVEL`] as a joint's continuum has it.
    pub fn level_up_to(&self, cell: f64) -> f64 {
        let points = self.line.points();
        let pair = points
            .windows(2)
            .find(|pair| pair[1][1].abs() > LEVEL * cell);
        pair.map_or(f64::INFINITY, |pair| pair[0][0])
    }

    /// It as a wall, lower by a depth (m), behind 0 with these points (x, z) (m); `across` is the width of the slab (m).
    pub fn wall(&self, behind: &[[f64; 2]], depth: f64, across: f64) -> Result<Wall, Failure> {
        let own = self.line.points().iter();
        let lowered = own.map(|[x, z]| [*x, z - depth]);
        let line: Vec<[f64; 2]> = behind.iter().copied().chain(lowered).collect();
        let mesh = extruded(&line, [-across, 2.0 * across])
            .map_err(|error| Failure::Run(format!("ground as a wall: {error}")))?;
        Ok(Wall::mesh(Arc::new(mesh)))
    }

    /// Tables of heights over x, with the height of the ground beside them where it is no plane.
    pub fn beside(land: Option<&Land>, places: &[f64], tables: Vec<Table>) -> Vec<Table> {
        if land.is_none() {
            return tables;
        }
        let ground: Vec<f64> = places.iter().map(|x| Self::height(land, *x)).collect();
        let beside = |table: Table| {
            if table.column("h").is_empty() {
                return table;
            }
            let instants = table.rows() / ground.len();
            table.with("z_ground", "m", ground.repeat(instants))
        };
        tables.into_iter().map(beside).collect()
    }
}

/// A line (x, z) as a surface from one y to another (m), facing up where x increases.
fn extruded(line: &[[f64; 2]], ends: [f64; 2]) -> Result<Mesh, MeshError> {
    let vertices = line
        .iter()
        .flat_map(|[x, z]| ends.map(|y| Vector3::new(*x, y, *z)));
    let pieces = 0..line.len() as u32 - 1;
    let triangles: Vec<[u32; 3]> = pieces
        .map(|n| 2 * n)
        .flat_map(|n| [[n, n + 2, n + 1], [n + 1, n + 2, n + 3]])
        .collect();
    Mesh::new(vertices.collect(), &triangles)
}

#[cfg(test)]
mod tests {
    use super::*;

    const AT: (Place<'_>, &str) = (
        Place {
            origin: "scene",
            section: "terrain",
        },
        "profile",
    );

    fn land(points: &[[f64; 2]]) -> Result<Land, String> {
        let given = Profile::new(points.to_vec()).unwrap();
        Land::new(&given, (10.0, "the end"), 5.0, AT).map_err(|why| format!("{why:?}"))
    }

    #[test]
    fn heights_count_from_zero() {
        // From a step at 0, and from within a slope.
        let step = land(&[[-1.0, 7.0], [0.0, 7.0], [0.0, 4.0], [6.0, 4.0], [12.0, 1.0]]).unwrap();
        for (x, z) in [
            (-2.0, 0.0),
            (3.0, 0.0),
            (9.0, -1.5),
            (14.0, -3.0),
            (99.0, -3.0),
        ] {
            assert_eq!(Land::height(Some(&step), x), z, "{x}");
        }
        assert_eq!(step.level_up_to(0.1), 6.0);
        // Round-off is no slope.
        let rounded = land(&[[0.0, 0.0], [3.0, 1e-12], [6.0, 0.0], [12.0, -3.0]]).unwrap();
        assert_eq!(rounded.level_up_to(0.1), 6.0);
        assert_eq!(Land::span(Some(&step)), [-3.0, 0.0]);
        let slope = land(&[[-2.0, 3.0], [2.0, 1.0], [10.0, 5.0]]).unwrap();
        assert_eq!(Land::height(Some(&slope), 2.0), -1.0);
        assert_eq!(Land::height(Some(&slope), 10.0), 3.0);
        assert_eq!(slope.level_up_to(0.1), 0.0);
        assert_eq!(Land::height(None, 3.0), 0.0);
    }

    #[test]
    fn lines_that_are_no_land_are_refused() {
        for (points, word) in [
            (&[[0.0, 0.0], [9.0, 0.0]][..], "the end"),
            (&[[0.5, 0.0], [19.0, 0.0]], "or before it"),
            (
                &[[0.0, 0.0], [5.0, 1.0], [4.0, 0.5], [20.0, 0.0]],
                "turn back",
            ),
        ] {
            let why = land(points).unwrap_err();
            assert!(
                why.contains(word) && why.contains("terrain.profile"),
                "{why}"
            );
        }
    }
}
