//! A plane through the shape's origin.
//!
//! ```text
//! distance = c · n
//! ```

use super::shape::Foot;
use nalgebra::Vector3;

/// An unbounded plane; grains live on the side its normal points to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Unit normal, into the grains.
    pub normal: Vector3<f64>,
}

impl Plane {
    /// Foot of a centre.
    #[inline(always)]
    pub fn foot(&self, centre: &Vector3<f64>) -> Foot {
        Foot {
            distance: centre.dot(&self.normal),
            normal: self.normal,
        }
    }
}
