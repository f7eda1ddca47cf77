//! A cone or its stump about an axis through the shape's origin: a hopper's mouth, a funnel, or a solid.
//!
//! The radius changes linearly from one end, at the origin, to the other; a radius of zero is a tip.

use super::meridian;
use super::shape::{Foot, Side};
use nalgebra::{Vector2, Vector3};

/// Whether a frustum is a bent plate or a solid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ends {
    /// Open at both ends, as thin as paper; grains live on a side or on both.
    Open(Side),
    /// A solid with flat lids; grains live outside.
    Capped,
}

/// A frustum of a cone; with equal radii a cylinder.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frustum {
    /// Unit vector along its axis, from the first end to the second.
    pub axis: Vector3<f64>,
    /// Distance of the ends (m).
    pub height: f64,
    /// Radii at the origin and at the other end (m).
    pub radii: [f64; 2],
    /// Plate or solid.
    pub ends: Ends,
}

impl Frustum {
    /// Foot of a centre.
    pub fn foot(&self, centre: &Vector3<f64>) -> Foot {
        let [low, high] = self.radii;
        let (a, b) = (Vector2::new(low, 0.0), Vector2::new(high, self.height));
        match self.ends {
            Ends::Open(side) => meridian::plate(centre, &self.axis, [a, b], side),
            Ends::Capped => {
                let (bottom, top) = (Vector2::zeros(), Vector2::new(0.0, self.height));
                let chain = [bottom, a, b, top];
                // A tip has no lid.
                let from = usize::from(low == 0.0);
                let to = chain.len() - usize::from(high == 0.0);
                meridian::solid(centre, &self.axis, &chain[from..to])
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cone(ends: Ends) -> Frustum {
        // Slope 3:4 of the side, so that unit vectors are short fractions.
        Frustum {
            axis: Vector3::z(),
            height: 4.0,
            radii: [4.0, 1.0],
            ends,
        }
    }

    #[test]
    fn the_side_pushes_at_right_angles_to_itself() {
        let n = Vector3::new(0.8, 0.0, 0.6);
        let middle = Vector3::new(2.5, 0.0, 2.0);
        for (ends, side) in [
            (Ends::Open(Side::Outside), 1.0),
            (Ends::Open(Side::Inside), -1.0),
            (Ends::Open(Side::Both), 1.0),
            (Ends::Capped, 1.0),
        ] {
            let foot = cone(ends).foot(&(middle + n * 0.25 * side));
            assert!((foot.distance - 0.25).abs() < 1e-15, "{ends:?}");
            assert!((foot.normal - n * side).norm() < 1e-15, "{ends:?}");
        }
    }

    #[test]
    fn a_solid_has_lids_edges_and_an_inside() {
        let solid = cone(Ends::Capped);
        let lid = solid.foot(&Vector3::new(0.0, 0.5, 4.5));
        assert_eq!((lid.distance, lid.normal), (0.5, Vector3::z()));
        let floor = solid.foot(&Vector3::new(3.0, 0.0, -0.5));
        assert_eq!((floor.distance, floor.normal), (0.5, -Vector3::z()));
        let edge = solid.foot(&Vector3::new(1.0 + 0.3, 0.0, 4.0 + 0.4));
        assert!((edge.distance - 0.5).abs() < 1e-15);
        assert!((edge.normal - Vector3::new(0.6, 0.0, 0.8)).norm() < 1e-14);
        let inside = solid.foot(&Vector3::new(0.1, 0.0, 0.2));
        assert!((inside.distance + 0.2).abs() < 1e-15);
        assert_eq!(inside.normal, -Vector3::z());
    }

    #[test]
    fn a_tip_is_a_point() {
        let tip = Frustum {
            axis: Vector3::z(),
            height: 2.0,
            radii: [1.0, 0.0],
            ends: Ends::Capped,
        };
        let foot = tip.foot(&Vector3::new(0.0, 0.0, 3.0));
        assert!((foot.distance - 1.0).abs() < 1e-15);
        assert!((foot.normal - Vector3::z()).norm() < 1e-15);
    }
}
