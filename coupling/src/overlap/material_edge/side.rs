//! On which side of the grains an edge lies, and what the world looks like along its own axis.
//!
//! An edge knows one axis, which points out of its continuum into the grains: x itself where the continuum lies below them, −x
//! where it lies above. What it sees of grains is turned onto that axis where it is looked at, its loads are turned back
//! where they are laid, and nothing between knows of sides. So a mirrored scene gives mirrored loads, to the bit.

use colluvium_dem::{ContactSample, GrainSample};
use nalgebra::{Vector2, Vector3};

/// Where the continuum of an edge lies, seen from the grains.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Side {
    /// At smaller x.
    #[default]
    Below,
    /// At larger x.
    Above,
}

impl Side {
    /// A place along x, or a component along it, on the edge's own axis; and back.
    pub fn along(self, x: f64) -> f64 {
        match self {
            Self::Below => x,
            Self::Above => -x,
        }
    }

    /// A vector of the plane x–z on the edge's own axes; and back.
    pub fn in_plane(self, [x, z]: [f64; 2]) -> [f64; 2] {
        [self.along(x), z]
    }

    /// ((σ_xx − σ_zz)/2, σ_xz) on the edge's own axes; and back. A shear stress changes its sign in a mirror, a difference of normal
    /// stresses does not.
    pub(super) fn stress(self, [normal, shear]: [f64; 2]) -> [f64; 2] {
        [normal, self.along(shear)]
    }

    /// How what has the axis of this side looks along that of another: as it is, or in a mirror.
    pub(super) fn seen_along(self, other: Self) -> Self {
        match self == other {
            true => Self::Below,
            false => Self::Above,
        }
    }

    /// A vector in space on the edge's own axes; and back.
    pub fn turned(self, v: Vector3<f64>) -> Vector3<f64> {
        Vector3::new(self.along(v.x), v.y, v.z)
    }

    /// An axial vector, of turning or of a moment, on the edge's own axes; and back.
    pub fn turned_about(self, v: Vector3<f64>) -> Vector3<f64> {
        Vector3::new(v.x, self.along(v.y), self.along(v.z))
    }

    /// A grain on the edge's own axes.
    pub(in crate::overlap) fn grain(self, grain: GrainSample) -> GrainSample {
        GrainSample {
            position: self.turned(grain.position),
            velocity: self.turned(grain.velocity),
            spin: self.turned_about(grain.spin),
            ..grain
        }
    }

    /// A contact on the edge's own axes.
    pub(in crate::overlap) fn contact(self, contact: ContactSample) -> ContactSample {
        ContactSample {
            force: self.turned(contact.force),
            arm: self.turned(contact.arm),
            partner_arm: self.turned(contact.partner_arm),
            torque: self.turned_about(contact.torque),
            partner_torque: self.turned_about(contact.partner_torque),
            ..contact
        }
    }
}

/// A vector of the plane x–z in space.
pub(super) fn in_slab(v: Vector2<f64>) -> Vector3<f64> {
    Vector3::new(v[0], 0.0, v[1])
}

/// Turns the order of the numbers of each row of so many.
pub(super) fn mirror_rows<T>(values: &mut [T], columns: usize) {
    for row in values.chunks_mut(columns.max(1)) {
        row.reverse();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mirror_turns_moments_as_cross_products() {
        let (arm, force) = (Vector3::new(1.0, 2.0, 3.0), Vector3::new(-4.0, 0.5, 7.0));
        for side in [Side::Below, Side::Above] {
            // A mirror image turns the other way round: the moment of turned vectors is that of an axial vector.
            let moment = side.turned(arm).cross(&side.turned(force));
            assert_eq!(moment, side.turned_about(arm.cross(&force)));
            assert_eq!(side.turned(side.turned(arm)), arm);
        }
        assert_eq!(Side::Above.in_plane([2.0, 3.0]), [-2.0, 3.0]);
    }
}
