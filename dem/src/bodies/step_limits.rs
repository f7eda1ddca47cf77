//! What bodies mean for the limits of the step.
//!
//! A feeler of radius r of a body of mass M, one of n that may touch at once, is for a limit a grain of
//! that radius and of the mass
//!
//! ```text
//! m = 1/(n (1/M + c²/I))       c farthest feeler from the centre, I smallest principal moment of inertia
//! ```
//! Together n springs k on a rigid body oscillate at ω² ≤ Σ (k/M + k c_i²/I) ≤ k/m. Planes are met by four
//! feelers of a cuboid or a rim and by half of the corners of a mesh, other surfaces by half of all feelers at
//! most. Grains take a part for a wall.

use super::contacts::Bodies;
use super::feelers::Kind;
use super::rigid::Rigid;
use crate::contact::LawTable;
use crate::setup::{Setup, SetupError};
use crate::timestep;
use crate::walls::{Course, Span, Standing};

/// Feelers of a flat face or a rim that meet a plane at once.
const FOUR: usize = 4;

impl Bodies {
    /// Grains and walls that limit the step as bodies do.
    pub fn classes<'a>(
        &'a self,
        walls: &'a [Standing],
    ) -> impl Iterator<Item = timestep::Body> + 'a {
        let parts = self.rigid.iter().flat_map(move |body| {
            body.parts
                .clone()
                .map(move |part| self.class(body, part, walls))
        });
        parts.flatten()
    }

    fn class(&self, body: &Rigid, part: usize, walls: &[Standing]) -> Vec<timestep::Body> {
        let material = walls[part].wall.material;
        let mut classes = vec![timestep::Body::wall(material)];
        let feelers = &self.feelers[part];
        if body.is_driven() || feelers.points.is_empty() {
            return classes;
        }
        let encounters = self.encounters.iter();
        let mut met = encounters.filter(|e| e.prober as usize == part || e.target as usize == part);
        let at_once = if feelers.points.len() == 1 {
            1
        } else if met.any(|e| e.kind == Kind::Ridge) {
            feelers.points.len().div_ceil(2)
        } else {
            FOUR.max(feelers.count(Kind::Corner).div_ceil(2))
        };
        classes.push(timestep::Body {
            material,
            radius: feelers.points[0].radius,
            mass: 1.0 / (at_once as f64 * body.largest_inverse_mass(&walls[part], feelers.reach)),
            fixed: false,
        });
        classes
    }
}

/// The same for a setup.
pub(crate) fn feeling_parts(
    setup: &Setup,
    laws: &LawTable,
) -> Result<Vec<timestep::Body>, SetupError> {
    if setup.bodies.is_empty() {
        return Ok(Vec::new());
    }
    let walls = setup.walls.iter().cloned();
    let before = Span::ending(0, setup.timestep);
    let standing = walls.map(|wall| Standing::at(wall, before, Course::default()));
    let mut standing: Vec<Standing> = standing.collect();
    let bodies = Bodies::new(setup.bodies.clone(), &mut standing, laws, setup.timestep)?;
    Ok(bodies.classes(&standing).collect())
}
