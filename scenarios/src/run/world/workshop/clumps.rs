//! Clumps put into a packing in the making.

use super::{Surroundings, Workshop, ended, refused};
use crate::failure::Failure;
use colluvium_dem::preparation::{
    ClumpPouring, ClumpShape, FILL, Relaxation, Scattering, pour_clumps, scatter,
};
use colluvium_dem::{Pose, Region};
use nalgebra::Vector3;

impl Workshop<'_> {
    /// Inserts clumps of a shape among what is there.
    pub fn insert_clumps(
        &mut self,
        shape: ClumpShape,
        (region, count): (Region, usize),
        velocity: Vector3<f64>,
    ) -> Result<(), Failure> {
        let balls = shape.balls.len();
        let spec = Scattering {
            shape,
            region,
            domain: self.packing.domain,
            count,
            velocity,
            seed: self.seed,
        };
        let among = &self.packing.grains;
        let put = scatter(&spec, among, among.len() as u32).map_err(refused)?;
        self.packing.grains.extend(put.grains);
        self.packing.clumps.extend(put.clumps);
        self.note("insert", format!("{count} clumps of {balls} balls"));
        Ok(())
    }

    /// Pours clumps of a shape from a source until they rest.
    pub fn pour_clumps(
        &mut self,
        around: &Surroundings,
        (shape, source, count): (ClumpShape, Region, usize),
        (velocity, interval): (Vector3<f64>, Option<f64>),
        relaxation: &Relaxation,
    ) -> Result<(), Failure> {
        self.coming = shape.grains(&Pose::at(Vector3::zeros()), velocity);
        let spec = ClumpPouring {
            source,
            shape,
            count,
            velocity,
            interval,
            fill: FILL,
            seed: self.seed,
        };
        let poured = self.step(|shop, step| {
            let mut simulation = shop.simulation_of(around, step)?;
            let report = pour_clumps(&mut simulation, &spec, relaxation, step).map_err(ended)?;
            shop.take(simulation);
            shop.note(
                "pour",
                format!(
                    "{count} clumps of {} balls poured in {} batches, {:.3e} s apart; {}",
                    spec.shape.balls.len(),
                    report.batches,
                    report.interval,
                    report.rest
                ),
            );
            Ok(())
        });
        self.coming.clear();
        poured
    }
}
