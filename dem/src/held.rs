//! Grains as the integrator holds them between steps, for what acts on them every step.

use crate::grains::vector;
use crate::simulation::Simulation;
use crate::snapshot::GrainSample;
use nalgebra::Vector3;

impl Simulation {
    /// The grains at places for which `near` says so, in the order of their rows: positions now, velocities and
    /// spins half a step back.
    ///
    /// Other than a [`snapshot`](Self::snapshot) it evaluates no forces, and it takes no position into the box:
    /// along periodic axes `near` sees places that may be some boxes away.
    pub fn held(&self, near: impl Fn(&Vector3<f64>) -> bool) -> impl Iterator<Item = GrainSample> {
        let grains = &self.grains;
        let places = grains.place[..grains.len()].iter().enumerate();
        places.filter_map(move |(i, place)| {
            let position = vector(place);
            near(&position).then(|| GrainSample {
                id: grains.id[i],
                position,
                velocity: vector(&grains.motion[i]),
                spin: vector(&grains.turn[i]) * grains.turn[i][3],
                radius: place[3],
                mass: grains.mass[i],
                fixed: grains.is_fixed(i),
                clump: self.clumps.number(i),
            })
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

    /// For how long the last steps, so many of them, have changed velocities (s): half a step less where velocities
    /// have been given since, which belong to the time of the positions.
    ///
    /// ```text
    /// t = (n − ½) Δt if 0 < n₀ ≤ n, else n Δt,      n₀ the steps since velocities were given last
    /// ```
    pub fn kick_time(&self, steps: u64) -> f64 {
        let given = (1..=steps).contains(&self.steps_since_start);
        let first = if given { 0.5 } else { 1.0 } * self.timestep;
        match steps {
            0 => 0.0,
            steps => first + (steps - 1) as f64 * self.timestep,
        }
    }
}
