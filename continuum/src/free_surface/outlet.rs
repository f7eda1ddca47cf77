//! An opening in the floor of a plane, through which material falls out.
//!
//! It takes up whole cells of the floor, from face to face of the grid. On its plane the material is free: p = 0 there, half a cell
//! below the lowest pressures, and no shear; walls beside it end at its edge, where the pressure on the floor is the mean of
//! both sides. The velocity through a face of it is an unknown with the mass of the half cell above, driven by gravity,
//! the pressure of that cell and the stretching of it:
//!
//! ```text
//! (h/2) Δx ∂w/∂t = −Δx p + Δx τ_zz − (h/2) Δx g
//! ```
//!
//! What crosses the plane is gone, with its volume ([`super::SurfaceState::passed`]) and its momentum. Nothing comes back:
//! where matter moves up from the plane, it leaves a free surface behind.

use super::flow::SurfaceFlow;
use crate::error::{Error, require};
use crate::rheology::Rheology;

/// Faces of the grid are where they are to within this part of a cell.
const ON_FACE: f64 = 1e-6;

impl<R: Rheology> SurfaceFlow<R> {
    /// The same flow with the floor open from one place to another along x, in natural units, at faces of the grid. What
    /// hangs over it begins without pressure.
    ///
    /// # Errors
    /// Places that are not faces of the grid one behind the other, ground, or other ends that are open.
    pub fn with_outlet(mut self, from: f64, to: f64) -> Result<Self, Error> {
        let floor = self.grid().axes()[1].boundary_at(0);
        require(
            self.is_closed() && floor.is_some_and(|floor| floor.outer_pressure().is_none()),
            "outlet",
            to - from,
            "a level floor that closes the grid, between ends that are closed",
        )?;
        let axis = self.grid().axes()[0];
        let length = axis.spacing() * axis.cells() as f64;
        let mut ends = [0; 2];
        for ((end, key), place) in ends
            .iter_mut()
            .zip(["outlet.from", "outlet.to"])
            .zip([from, to])
        {
            let face = place / axis.spacing();
            require(
                (0.0..=length * (1.0 + ON_FACE)).contains(&place)
                    && (face - face.round()).abs() < ON_FACE,
                key,
                place,
                format!(
                    "a whole number of cells of {} between 0 and {length}",
                    axis.spacing()
                ),
            )?;
            *end = face.round() as usize;
        }
        let [first, last] = ends;
        require(
            first < last,
            "outlet.to",
            to,
            format!("greater than outlet.from = {from}"),
        )?;
        self.open_floor(first..last);
        Ok(self)
    }
}
