//! Grains as the integrator holds them between steps, for what acts on them every step.

use crate::grains::vector;
use crate::simulation::Simulation;
use crate::snapshot::GrainSample;

impl Simulation {
    /// All grains, in the order of their rows: positions now, velocities and spins half a step back.
    ///
    /// Other than a [`snapshot`](Self::snapshot) it evaluates no forces.
    pub fn held(&self) -> impl Iterator<Item = GrainSample> + '_ {
        let cell = self.cell();
        let grains = &self.grains;
        (0..grains.len()).map(move |i| {
            let (position, image) = cell.wrap(vector(&grains.place[i]));
            GrainSample {
                id: grains.id[i],
                position,
                velocity: vector(&grains.motion[i]) - image,
                spin: vector(&grains.turn[i]) * grains.turn[i][3],
                radius: grains.place[i][3],
                mass: grains.mass[i],
                fixed: grains.is_fixed(i),
            }
        })
    }

    /// By how much time the next step changes velocities (s): a step, or half of one where velocities
    /// have just been given and belong to the time of the positions.
    pub fn next_kick(&self) -> f64 {
        if self.steps_since_start > 0 {
            self.timestep
        } else {
            0.5 * self.timestep
        }
    }
}
