//! A round plate without thickness, centred on the shape's origin; grains may lie on both faces.

use super::meridian;
use super::shape::{Foot, Side};
use nalgebra::{Vector2, Vector3};

/// A disk.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disk {
    /// Unit vector along its axis.
    pub axis: Vector3<f64>,
    /// Radius (m).
    pub radius: f64,
}

impl Disk {
    /// Foot of a centre: on a face along the axis, on the rim from the nearest point of the rim.
    pub fn foot(&self, centre: &Vector3<f64>) -> Foot {
        let rim = Vector2::new(self.radius, 0.0);
        meridian::plate(centre, &self.axis, [rim, Vector2::zeros()], Side::Both)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_push_along_the_axis_and_the_rim_away_from_itself() {
        let disk = Disk {
            axis: Vector3::z(),
            radius: 2.0,
        };
        for z in [0.7, -0.7] {
            let foot = disk.foot(&Vector3::new(1.2, -0.5, z));
            assert_eq!(foot.distance, 0.7);
            assert_eq!(foot.normal, Vector3::new(0.0, 0.0, z.signum()));
        }
        let foot = disk.foot(&Vector3::new(3.0, 4.0, 4.0));
        assert!((foot.distance - 5.0).abs() < 1e-15);
        let exact = Vector3::new(1.8, 2.4, 4.0) / 5.0;
        assert!((foot.normal - exact).norm() < 1e-15, "{}", foot.normal);
        let centre = disk.foot(&Vector3::new(0.0, 0.0, 0.3));
        assert_eq!(centre.normal, Vector3::z());
    }
}
