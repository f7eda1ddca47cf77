//! The ground that a cliff stands and falls on: one line, for grains and for their continuum.

use super::record::CliffRecord;
use crate::failure::Failure;
use crate::run::collapse_ground;
use crate::scene::{CliffScene, world::Place};
use crate::table::Table;
use colluvium_continuum::terrain::Profile;
use colluvium_dem::Wall;
use colluvium_dem::walls::{Mesh, MeshError};
use nalgebra::Vector3;
use std::sync::Arc;

impl CliffScene {
    /// Up to where debris is looked for (m).
    pub fn far_end(&self) -> f64 {
        self.lip() + self.shape.room_scaled * self.shape.height
    }

    /// The ground before the cliff, from its foot (0, 0) on to beyond [`Self::far_end`], in the order of x; none where it is
    /// a plane.
    pub fn land(&self, origin: &str) -> Result<Option<Profile>, Failure> {
        let Some(keys) = &self.terrain else {
            return Ok(None);
        };
        let refused = |error: String| Failure::Input(format!("{origin}: {error}"));
        let given = collapse_ground::profile(keys.source()).map_err(refused)?;
        let (file, at) = (
            keys.source().file().map_or("profile", |(key, _)| key),
            Place {
                origin,
                section: "terrain",
            },
        );
        let points = given.points();
        let [from, to] = [points[0][0], points[points.len() - 1][0]];
        if points.windows(2).any(|pair| pair[1][0] < pair[0][0]) {
            let range = "points in the order of x: ground that does not turn back under itself";
            return Err(at.refuse(file, "x that decreases", range).into());
        }
        let end = self.far_end();
        if from > 0.0 || to < end {
            let value = format!("x from {from} to {to} m");
            let range = format!(
                "from the foot of the face, 0, or before it to {end:.6} m or beyond: shape.room_scaled heights beyond the lip"
            );
            return Err(at.refuse(file, value, range).into());
        }
        // The lowest at the foot: a step there is the cliff's own.
        let foot = points.iter().rev().find(|p| p[0] <= 0.0);
        let foot = foot.map_or(points[0], |p| *p);
        let base = if foot[0] < 0.0 {
            given.height_at(0.0).unwrap_or(foot[1])
        } else {
            foot[1]
        };
        let beyond = points.iter().filter(|p| p[0] > 0.0);
        let mut line = vec![[0.0, 0.0]];
        line.extend(beyond.map(|[x, z]| [*x, z - base]));
        // On it goes on level.
        let [last, level] = line[line.len() - 1];
        line.push([last + self.shape.height, level]);
        let land = Profile::new(line).map_err(|error| refused(error.to_string()))?;
        self.lies_below_the_face(&land, at, file)?;
        Ok(Some(land))
    }

    /// Refuses ground that would cut into the part that leans out.
    fn lies_below_the_face(&self, land: &Profile, at: Place<'_>, key: &str) -> Result<(), Failure> {
        let lip = self.lip();
        let slope = self.face() / lip;
        let ends = [lip].into_iter();
        let places = land.points().iter().map(|p| p[0]).chain(ends);
        for x in places.filter(|x| *x > 0.0 && *x <= lip) {
            let (z, face) = (
                land.height_at(x).unwrap_or(0.0),
                self.shape.wall + slope * x,
            );
            if z > face {
                let range = format!("below the face, which is {face:.6} m high there");
                return Err(at.refuse(key, format!("{z} m at x = {x} m"), range).into());
            }
        }
        Ok(())
    }

    /// Height of the ground before the cliff at a place (m): none behind its foot.
    pub(super) fn ground_height(land: Option<&Profile>, x: f64) -> f64 {
        match land {
            Some(land) if x > 0.0 => land.height_at(x).unwrap_or(0.0),
            _ => 0.0,
        }
    }

    /// What the heap left; on land with the ground's height beside.
    pub(super) fn tables(
        record: &CliffRecord,
        places: Vec<f64>,
        deposit: Vec<f64>,
        land: Option<&Profile>,
    ) -> Vec<Table> {
        let ground: Vec<f64> = places
            .iter()
            .map(|x| Self::ground_height(land, *x))
            .collect();
        let tables = record.heap.tables(places, deposit);
        if land.is_none() {
            return tables;
        }
        let beside = |table: Table| {
            if table.column("h").is_empty() {
                return table;
            }
            let instants = table.rows() / ground.len();
            table.with("z_ground", "m", ground.repeat(instants))
        };
        tables.into_iter().map(beside).collect()
    }

    /// What the cliff stands on and falls on, of a material; `across` is the width of the slab (m).
    pub(super) fn ground_on(
        &self,
        land: &Profile,
        material: u16,
        across: f64,
    ) -> Result<(String, Wall), Failure> {
        let wall = self.shape.wall;
        let mut line = vec![[self.back() - self.shape.height, wall]];
        if wall > 0.0 {
            line.push([0.0, wall]);
        }
        line.extend(land.points());
        let mesh = extruded(&line, [-across, 2.0 * across])
            .map_err(|error| Failure::Run(format!("the ground before the cliff: {error}")))?;
        let ground = Wall::mesh(Arc::new(mesh)).material(material);
        Ok(("ground".to_owned(), ground))
    }
}

/// Height of the lowest ground (m); 0 on a plane.
pub(super) fn lowest(land: Option<&Profile>) -> f64 {
    let points = land.map_or(&[][..], Profile::points);
    points.iter().map(|p| p[1]).fold(0.0, f64::min)
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
