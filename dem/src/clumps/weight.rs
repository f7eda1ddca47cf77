//! What a clump weighs against a push, and the clump as it could be made again.

use super::{Clump, Member, State};
use crate::bodies::MassProperties;
use crate::simulation::Simulation;
use nalgebra::{Matrix3, Vector3};

/// Mass that a push through one of these places feels at the least (kg), arms being from the centre of mass:
/// 1/m = 1/M + max n·A n over directions n, A = ρ I⁻¹ ρᵀ with ρ v = r × v.
pub(crate) fn lightest(mass: &MassProperties, arms: impl Iterator<Item = Vector3<f64>>) -> f64 {
    let inverse = mass.inertia.try_inverse().unwrap_or_else(Matrix3::zeros);
    let lever = |arm: Vector3<f64>| {
        let arm = arm.cross_matrix();
        (arm * inverse * arm.transpose())
            .symmetric_eigenvalues()
            .max()
    };
    let most = arms.map(lever).fold(0.0, f64::max);
    1.0 / (1.0 / mass.mass + most)
}

impl State {
    /// Mass, centre and inertia in directions of space.
    fn properties(&self) -> MassProperties {
        let turn = self.orientation.to_rotation_matrix();
        let inertia = turn * Matrix3::from_diagonal(&self.moments) * turn.transpose();
        MassProperties {
            mass: self.mass,
            centre: self.place,
            inertia: 0.5 * (inertia + inertia.transpose()),
        }
    }
}

impl Simulation {
    /// Shows for each member its row and the mass that a push on a grain of its clump feels at the least (kg).
    pub(crate) fn each_lightest(&self, mut see: impl FnMut(usize, f64)) {
        for (state, own) in self.clumps.all() {
            let least = lightest(&state.properties(), own.iter().map(|member| member.arm));
            own.iter().for_each(|m| see(m.row as usize, least));
        }
    }

    /// All clumps as they are now, in the order in which they were made, each with the mass that a push on one
    /// of its grains feels at the least (kg).
    pub fn clump_list(&self) -> Vec<(Clump, f64)> {
        let one = |(state, own): (&State, &[Member])| {
            let mass = state.properties();
            let least = lightest(&mass, own.iter().map(|member| member.arm));
            let clump = Clump {
                grains: own.iter().map(|member| member.grain).collect(),
                mass: Some(mass),
            };
            (clump, least)
        };
        self.clumps.all().map(one).collect()
    }
}
