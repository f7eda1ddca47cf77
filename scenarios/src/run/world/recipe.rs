//! What a scene of grains brings with it.

use super::build::World;
use super::course::Ran;
use super::workshop::Workshop;
use crate::failure::Failure;
use crate::run_directory::RunDirectory;
use crate::scene::LawKeys;
use crate::scene::world::{Materials, OutputKeys, StepKeys};
use crate::summary::Summary;
use crate::table::Table;
use crate::vtkhdf::Frame;
use colluvium_dem::preparation::Packing;
use colluvium_dem::{Simulation, Snapshot};
use nalgebra::Vector3;
use std::fmt::Debug;

/// What a scene expects of itself before anything is computed, for its plan.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Expected {
    /// Grains or parcels of the run.
    pub grains: f64,
    /// Grain-steps of the preparation, where they can be told.
    pub preparation: Option<f64>,
    /// Time that is simulated at most (s).
    pub duration: f64,
}

/// How a run stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Course {
    /// It goes on.
    On,
    /// What it was for has happened.
    Over,
}

/// Keys that every scene of grains has.
#[derive(Clone, Copy, Debug)]
pub struct RecipeKeys<'a> {
    /// The contact law's.
    pub contact: &'a LawKeys,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Size of the computed parcels over that of the grains.
    pub coarse_graining: f64,
    /// The time step's.
    pub step: &'a StepKeys,
    /// The output's.
    pub output: &'a OutputKeys,
    /// Name or file of a packing to start from.
    pub packing: Option<&'a str>,
}

/// A scene of grains, in what it does. All methods are told the scene file for their messages.
pub trait Recipe: Debug + Sync {
    /// What the scene is, in a sentence.
    fn about(&self) -> String;

    /// What grains and walls are made of.
    fn materials(&self, origin: &str) -> Result<Materials, Failure>;

    /// The keys that every such scene has.
    fn keys(&self) -> RecipeKeys<'_>;

    /// What the preparation goes by: a packing that was made by anything else is refused. None where the
    /// scene has no preparation of its own.
    fn provenance(&self) -> Result<Option<toml::Table>, Failure>;

    /// Puts the grains in place.
    fn prepare(&self, shop: &mut Workshop, origin: &str) -> Result<(), Failure>;

    /// The world around a packing.
    fn world(
        &self,
        packing: &Packing,
        materials: &Materials,
        origin: &str,
    ) -> Result<World, Failure>;

    /// Whether what only this recipe knows of fits together, before anything is written.
    fn check(&self) -> Result<(), Failure> {
        Ok(())
    }

    /// Whether its preparation can be done, as far as that can be told without doing it.
    fn check_room(&self, _materials: &Materials, _origin: &str) -> Result<(), Failure> {
        Ok(())
    }

    /// Makes what the run needs beside its packing, of this step (s), and keeps it in the run's directory; or reads it there.
    fn stock(
        &self,
        _materials: &Materials,
        _timestep: f64,
        _directory: &RunDirectory,
    ) -> Result<(), Failure> {
        Ok(())
    }

    /// What is to be expected.
    fn expected(&self, materials: &Materials) -> Expected;

    /// What the scene leaves out besides what its law does.
    fn left_out(&self) -> Vec<&'static str>;

    /// Lines of the plan that only this scene has: a topic and a text.
    fn plan(&self) -> Vec<(String, String)> {
        Vec::new()
    }

    /// Steps between two calls of [`Recipe::steer`], for a step of this length (s).
    fn steer_every(&self, _timestep: f64) -> u64 {
        u64::MAX
    }

    /// Step at which [`Recipe::steer`] is called next, after so many steps (of this length, s).
    fn next_steer(&self, done: u64, timestep: f64, _state: &[f64]) -> u64 {
        let every = self.steer_every(timestep).max(1);
        (done / every).saturating_add(1).saturating_mul(every)
    }

    /// Brings the memory up to date before it is written or read by others: where [`Recipe::steer`] is called too often to do it
    /// each time.
    fn keep(&self, _state: &mut Vec<f64>) {}

    /// Drives the run, at step 0 and then every so many steps. `state` is the recipe's own memory, empty at
    /// first; it is part of checkpoints.
    fn steer(
        &self,
        _simulation: &mut Simulation,
        _state: &mut Vec<f64>,
    ) -> Result<Course, Failure> {
        Ok(Course::On)
    }

    /// Own columns of `history.csv`, with units.
    fn columns(&self) -> Vec<(String, &'static str)> {
        Vec::new()
    }

    /// Their values at a row.
    fn look(&self, _simulation: &mut Simulation, _seen: &Snapshot, _state: &[f64]) -> Vec<f64> {
        Vec::new()
    }

    /// Direction in which pictures look, and which way is up in them.
    fn view(&self) -> [Vector3<f64>; 2] {
        [Vector3::y(), Vector3::z()]
    }

    /// What hangs together at the end, for a picture: for each grain in the order of numbers the rank of
    /// its group by mass, none for single grains. None where no picture of it is wanted.
    fn groups(&self, _simulation: &mut Simulation, _state: &[f64]) -> Option<Vec<Option<usize>>> {
        None
    }

    /// Whether a continuum goes on beside the grains.
    fn has_continuum(&self) -> bool {
        false
    }

    /// Its cells at an instant, for pictures; none where it is not begun.
    fn continuum(&self, _simulation: &Simulation, _state: &[f64]) -> Option<Frame> {
        None
    }

    /// Results of the run for the summary, and further tables.
    fn conclude(&self, ran: &mut Ran, summary: &mut Summary) -> Result<Vec<Table>, Failure>;

    /// Results that runs are compared by (`pareto`).
    fn compared(&self) -> Vec<&'static str>;
}

/// What a recipe in a field `scene` says, said by the one that wraps it: all that is not joined to a continuum.
macro_rules! as_the_scene {
    () => {
        fn materials(
            &self,
            origin: &str,
        ) -> Result<$crate::scene::world::Materials, $crate::failure::Failure> {
            $crate::run::world::Recipe::materials(self.scene, origin)
        }

        fn keys(&self) -> $crate::run::world::RecipeKeys<'_> {
            self.scene.keys()
        }

        fn provenance(&self) -> Result<Option<toml::Table>, $crate::failure::Failure> {
            self.scene.provenance()
        }

        fn prepare(
            &self,
            shop: &mut $crate::run::world::Workshop,
            origin: &str,
        ) -> Result<(), $crate::failure::Failure> {
            self.scene.prepare(shop, origin)
        }

        fn world(
            &self,
            packing: &colluvium_dem::preparation::Packing,
            materials: &$crate::scene::world::Materials,
            origin: &str,
        ) -> Result<$crate::run::world::World, $crate::failure::Failure> {
            self.scene.world(packing, materials, origin)
        }

        fn compared(&self) -> Vec<&'static str> {
            self.scene.compared()
        }
    };
}
pub(crate) use as_the_scene;
