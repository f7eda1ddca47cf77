//! Mean stress of a whole box.

use crate::grains::vector;
use crate::simulation::Simulation;
use nalgebra::{Matrix3, Vector3};

impl Simulation {
    /// Mean Cauchy stress over the box at this instant (Pa), positive in tension.
    ///
    /// ```text
    /// σ = -(1/V) ( Σ m v' ⊗ v' + Σ F ⊗ b )
    /// ```
    /// v' is the velocity against uniform deformation of the box, F the force on a grain by contact or
    /// bond, b the way to it from its partner's nearest image. Rows are directions of force.
    ///
    /// A clump is one mass: v' is its centre's, and b leads from centre to centre. What holds its members
    /// together then has no part in the sum: members' own v' ⊗ v' and b would need it.
    pub fn stress(&mut self) -> Matrix3<f64> {
        self.observe();
        let cell = self.cell();
        let mut sum = Matrix3::zeros();
        for i in (0..self.grains.len()).filter(|&i| self.moves_alone(i)) {
            let x = vector(&self.grains.place[i]);
            let v: Vector3<f64> = self.synchronised(i).0 - cell.stream(&x);
            sum += self.grains.mass[i] * v * v.transpose();
        }
        self.each_clump_now(|mass, place, velocity| {
            let v = velocity - cell.stream(place);
            sum += mass * v * v.transpose();
        });
        let (rows, arms) = (self.slot_rows(), self.member_arms());
        let apart = |i: usize, j: usize| {
            let (a, b) = (&self.grains.place[i], &self.grains.place[j]);
            let way = cell.nearest(vector(a) - vector(b)).0;
            if arms.is_empty() {
                return way;
            }
            way - arms[i] + arms[j]
        };
        for (chunk, k) in self.reach.pairs() {
            let slot = &chunk.slots[k * rows];
            let [i, j] = chunk.pair(k);
            sum += vector(slot) * apart(i, j).transpose();
        }
        for bond in self.bonds.whole() {
            let [i, j] = bond.rows.map(|row| row as usize);
            sum += bond.pull.force * apart(i, j).transpose();
        }
        -sum / self.domain.lengths().product()
    }
}
