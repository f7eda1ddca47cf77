//! Finite-volume solver for dense granular flow with a yield stress.
//!
//! The material is incompressible: ρ ∂u/∂t = −∇p + ∇·τ + ρ g, ∇·u = 0, with
//! τ = κ(γ̇, p) 2D/γ̇ where it moves and |τ| ≤ κ(0, p) where it does not. The threshold κ comes from
//! [`rheology`], for μ(I) κ = c + μ(I) p. Velocities live on the faces and pressures in the cells of
//! a staggered [`grid`]; a time step solves for velocity, pressure and stress at once
//! ([`yield_step`]), from rest or in motion, for any Δt.
//!
//! # Conventions
//! - SI units at the surface of the crate; inside, natural units ([`units`]) in which ρ = 1.
//! - γ̇ = √(2 D:D), so that γ̇ = |du/dz| in simple shear.
//! - Pressure is positive in compression, other stresses are positive in tension.
//! - The inertial number I = γ̇ d √(ρ_s/p) is formed with the density of the grains ρ_s; the bulk
//!   density is ρ = φ ρ_s.
//! - A caller inside a pool of rayon's gets its threads for flows of some thousand unknowns and more, any other has one.
//!   No bit depends on how many there are.
//!
//! # Cases with exact solutions
//! [`bagnold`] (a layer on an incline), [`plane_shear`] (between plates under a load) and
//! [`vertical_chute`] (between vertical walls, with a rigid plug), [`heap`] (a flow on a pile between
//! side walls, over material at rest); [`plane_wave`] measures how small
//! disturbances of a uniform flow grow or decay.
//!
//! ```
//! use std::ops::ControlFlow;
//!
//! use colluvium_continuum::bagnold::BagnoldCase;
//! use colluvium_continuum::layer::Options;
//! use colluvium_continuum::rheology::MuI;
//!
//! let layer = BagnoldCase {
//!     slope: 25.0_f64.to_radians(),
//!     depth: 0.1,
//!     gravity: 9.81,
//!     rheology: MuI::new(0.382, 0.643, 0.279, 0.5e-3, 0.6, 2500.0),
//!     cells: 64,
//!     columns: None,
//! };
//! let flow = layer.solve(&Options::default(), &mut |_| ControlFlow::Continue(()))?;
//! assert!(flow.velocity_error_l2_relative < 1e-4);
//! # Ok::<(), colluvium_continuum::Error>(())
//! ```

pub mod bagnold;
pub mod channel_collapse;
pub mod column;
pub mod column_collapse;
pub mod cylinder_collapse;
pub mod discretisation;
mod error;
pub mod flow;
pub mod free_surface;
pub mod grid;
pub mod heap;
pub mod layer;
pub mod linear_solver;
pub mod open_chute;
pub mod plane_shear;
pub mod plane_wave;
pub mod rheology;
pub mod silo;
pub mod strain;
pub mod terrain;
pub mod threads;
pub mod units;
pub mod vertical_chute;
pub mod wall_friction;
pub mod yield_step;

pub use error::Error;
