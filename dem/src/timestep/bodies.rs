//! The few grains and walls that a shortest limit can belong to.

use super::stability::Surfaces;
use crate::contact::Inertia;
use crate::grains::Grain;
use std::f64::consts::PI;

/// A grain or a wall, by what limits need of it; fixed ones have infinite mass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Body {
    pub material: u16,
    pub radius: f64,
    pub mass: f64,
    pub fixed: bool,
}

impl Body {
    pub fn wall(material: u16) -> Body {
        Body {
            material,
            radius: f64::INFINITY,
            mass: f64::INFINITY,
            fixed: true,
        }
    }

    pub fn density(&self) -> f64 {
        self.mass / (4.0 / 3.0 * PI * self.radius.powi(3))
    }
}

impl From<&Grain> for Body {
    fn from(g: &Grain) -> Body {
        Body {
            material: g.material,
            radius: g.radius,
            mass: g.mass(),
            fixed: g.fixed,
        }
    }
}

/// The few bodies of each material that a shortest limit can belong to.
#[derive(Clone, Debug, Default)]
pub(crate) struct Classes {
    pub bodies: Vec<Body>,
}

impl Classes {
    /// Of grains and of walls by their materials.
    pub fn of(grains: impl Iterator<Item = Body>, walls: &[u16]) -> Classes {
        // Smallest, largest and lightest of each material, free and fixed.
        let mut found: Vec<[Body; 3]> = Vec::new();
        for body in grains {
            let alike = |[first, ..]: &&mut [Body; 3]| {
                (first.material, first.fixed) == (body.material, body.fixed)
            };
            let Some([small, large, light]) = found.iter_mut().find(alike) else {
                found.push([body; 3]);
                continue;
            };
            if body.radius < small.radius {
                *small = body;
            }
            if body.radius > large.radius {
                *large = body;
            }
            if body.mass < light.mass {
                *light = body;
            }
        }
        let mut bodies: Vec<Body> = Vec::new();
        let walls = walls.iter().map(|&material| Body::wall(material));
        for body in found.into_iter().flatten().chain(walls) {
            if !bodies.contains(&body) {
                bodies.push(body);
            }
        }
        Classes { bodies }
    }

    pub fn pairs(&self) -> impl Iterator<Item = (&Body, &Body)> {
        let pairs = self.bodies.iter().enumerate();
        pairs.flat_map(|(k, a)| {
            let partners = self.bodies[k..].iter().map(move |b| (a, b));
            partners.filter(|(a, b)| !(a.fixed && b.fixed))
        })
    }
}

/// Masses and radii of a contact of two bodies.
pub(super) fn surfaces(a: &Body, b: &Body) -> Surfaces {
    let inverse = |body: &Body| if body.fixed { 0.0 } else { 1.0 / body.mass };
    let (m, n) = (inverse(a), inverse(b));
    let about = |inverse: f64, body: &Body, power: i32| {
        if body.fixed {
            0.0
        } else {
            inverse / body.radius.powi(power)
        }
    };
    Surfaces {
        inertia: Inertia {
            reduced_mass: 1.0 / (m + n),
            reduced_radius: 1.0 / (1.0 / a.radius + 1.0 / b.radius),
            inverse_inertia: about(m, a, 2) + about(n, b, 2),
        },
        skew: about(m, a, 1) - about(n, b, 1),
    }
}
