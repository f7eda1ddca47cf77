//! From grains to fields: averages along z of density, velocity and stress.
//!
//! Fields after Goldhirsch (2010), with the wall force of Weinhart et al. (2012); averages run over x and y
//! of the periodic box and over a layer along z:
//! - ρ = Σ m W, j = Σ m v W, u = j/ρ, over grains that are free; the fixed grains of a rough base are wall;
//! - contact stress σᶜ = Σ f ⊗ a ∫₀¹ W(z − zᵢ − s a_z) ds over each free grain and each of its contacts, with
//!   the force f on the grain and the arm a from its centre to the contact point, so each pair is split at
//!   its contact point; bonds count like contacts;
//! - wall force t = Σ f W(z − z_c) at contacts with fixed grains and walls;
//! - kinetic stress σᵏ = −⟨ρ u′u′⟩, temperature T = tr⟨u′u′⟩/3.
//!
//! Then ∂ₜj + ∇·(ρ u u) = ∇·σ + t + ρ g holds at any instant, kernel and height, by construction.
//!
//! Mass, momentum and stress go by the kernel around the centre of the grain (that is what makes the balance
//! hold); the solid fraction φ goes by the exact volume of each sphere in each layer. Both recover the total.
//! Stress is positive in tension; the pressures p, `sigma_zz` and τ of a [`Profile`] are positive in
//! compression.

mod averager;
mod kernel;
mod layering;
mod profile;
mod sums;

pub use averager::{Averager, AveragerError};
pub use kernel::{Gauss, Heaviside, Kernel, Layers, Lucy};
pub use layering::{Layering, sphere_volume_below};
pub use profile::{BalanceCheck, Estimate, Profile, ProfileRow};
