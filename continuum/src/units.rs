//! Natural units: inside the solver ρ = 1, H = 1 and √(gH) (or √(P/ρ)) = 1, so that tolerances
//! mean the same on a comet as on Earth.

use serde::Serialize;

/// The scales by which quantities in SI units are divided on their way into the solver.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Units {
    /// Length (m).
    pub length: f64,
    /// Bulk density (kg/m³).
    pub density: f64,
    /// Velocity (m/s).
    pub velocity: f64,
}

impl Units {
    /// Units of a flow of depth `length` (m) driven by `gravity` (m/s²): velocity √(gH).
    pub fn of_gravity(length: f64, density: f64, gravity: f64) -> Self {
        Self {
            length,
            density,
            velocity: (gravity * length).sqrt(),
        }
    }

    /// Units of a flow of width `length` (m) under a load `pressure` (Pa): velocity √(P/ρ).
    pub fn of_load(length: f64, density: f64, pressure: f64) -> Self {
        Self {
            length,
            density,
            velocity: (pressure / density).sqrt(),
        }
    }

    /// Time (s): length over velocity.
    pub fn time(&self) -> f64 {
        self.length / self.velocity
    }

    /// Stress (Pa): ρ U².
    pub fn stress(&self) -> f64 {
        self.density * self.velocity * self.velocity
    }

    /// Acceleration (m/s²): U²/L.
    pub fn acceleration(&self) -> f64 {
        self.velocity * self.velocity / self.length
    }
}
