//! Where grains end: signed distance, directions, area.

use colluvium_dem::Domain;
use nalgebra::Vector3;

/// The edge b of a zone of grains, with one column of continuum on its other side.
///
/// What is averaged over grains and what acts on them asks the geometry these questions only; an edge of several
/// columns is several such edges, each with its share of the grains.
pub trait ZoneEdge {
    /// Distance of a point from the edge (m), positive outwards, where there are no grains; the same for all
    /// images of the point along periodic axes.
    fn distance(&self, x: &Vector3<f64>) -> f64;
    /// Outward normal at a point.
    fn normal(&self, x: &Vector3<f64>) -> Vector3<f64>;
    /// Direction along which the continuum flows at a point.
    fn tangent(&self, x: &Vector3<f64>) -> Vector3<f64>;
    /// Area of the edge (m²).
    fn area(&self) -> f64;
    /// Moves the edge outwards by so much (m).
    fn shift(&mut self, by: f64);
}

/// A plane across the whole periodic box, normal to one of its axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlatEdge {
    /// Axis of the normal: 0, 1, 2 for x, y, z.
    pub axis: usize,
    /// Axis of the flow.
    pub flow_axis: usize,
    /// Grains lie below the plane (towards lower coordinates), and the continuum above it.
    pub grains_below: bool,
    /// Coordinate of the plane (m).
    pub position: f64,
    /// Area (m²).
    pub area: f64,
}

impl FlatEdge {
    /// The plane across a box that is periodic along the two other axes.
    pub fn across(
        domain: &Domain,
        axis: usize,
        flow_axis: usize,
        grains_below: bool,
        position: f64,
    ) -> Self {
        let lengths = domain.lengths();
        let area = (0..3).filter(|&a| a != axis).map(|a| lengths[a]).product();
        Self {
            axis,
            flow_axis,
            grains_below,
            position,
            area,
        }
    }

    /// +1 where outwards is towards higher coordinates, −1 otherwise.
    pub fn sign(&self) -> f64 {
        if self.grains_below { 1.0 } else { -1.0 }
    }
}

impl ZoneEdge for FlatEdge {
    #[inline]
    fn distance(&self, x: &Vector3<f64>) -> f64 {
        self.sign() * (x[self.axis] - self.position)
    }

    #[inline]
    fn normal(&self, _: &Vector3<f64>) -> Vector3<f64> {
        self.sign() * Vector3::ith(self.axis, 1.0)
    }

    #[inline]
    fn tangent(&self, _: &Vector3<f64>) -> Vector3<f64> {
        Vector3::ith(self.flow_axis, 1.0)
    }

    #[inline]
    fn area(&self) -> f64 {
        self.area
    }

    fn shift(&mut self, by: f64) {
        self.position += self.sign() * by;
    }
}
