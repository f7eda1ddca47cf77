//! From grains to fields: density, velocity, stress and their kin, in layers or at points.
//!
//! Fields after Goldhirsch (2010), with the wall force of Weinhart et al. (2012). Two roads:
//! - an [`Averager`] for flows that are uniform along x and y: means over layers along z, with block errors;
//! - [`PointSums`] for anything else: fields at points, along z, in a plane, on a grid or around an axis
//!   ([`Geometry`]), with kernels of the dimensions that are left ([`Smoothing`]), by species, with spin,
//!   couple stress, fabric and coordination ([`PointFields`]); [`solid_fractions`] of cells are exact.
//!
//! In layers, averages run over x and y of the periodic box and over a layer along z:
//! - ρ = Σ m W, j = Σ m v W, u = j/ρ, over grains that are free; the fixed grains of a rough base are wall;
//! - contact stress σᶜ = Σ f ⊗ a ∫₀¹ W(z − zᵢ − s a_z) ds over each free grain and each of its contacts, with
//!   the force f on the grain and the arm a from its centre to the contact point, so each pair is split at
//!   its contact point; bonds count like contacts;
//! - wall force t = Σ f W(z − z_c) at contacts with fixed grains and walls;
//! - kinetic stress σᵏ = −⟨ρ u′u′⟩, temperature T = tr⟨u′u′⟩/3, about a velocity that is linear within the layer and
//!   in time: the speed that a flow gains while it is averaged is no fluctuation.
//!
//! Then ∂ₜj + ∇·(ρ u u) = ∇·σ + t + ρ g holds at any instant, kernel and height, by construction.
//!
//! Mass, momentum and stress go by the kernel around the centre of the grain (that is what makes the balance
//! hold); the solid fraction φ goes by the exact volume of each sphere in each layer. Both recover the total.
//! Stress is positive in tension; the pressures p, `sigma_zz` and τ of a [`Profile`] are positive in
//! compression.

mod averager;
mod fields;
mod kernel;
mod layering;
mod mesh;
mod profile;
mod smoothing;
mod solid_fraction;
mod sphere_box;
mod sums;
mod sums_at_points;

pub use averager::{Averager, AveragerError};
pub use fields::{Balance, PointFields};
pub use kernel::{Gauss, Heaviside, Kernel, Layers, Lucy};
pub use layering::{Layering, sphere_volume_below};
pub use mesh::{Cells, Geometry, Mesh};
pub use profile::{BalanceCheck, Estimate, Profile, ProfileRow};
pub use smoothing::{AlongSegment, Shape, Smoothing};
pub use solid_fraction::solid_fractions;
pub use sphere_box::sphere_box_volume;
pub use sums_at_points::{PointSums, SpeciesOf};
