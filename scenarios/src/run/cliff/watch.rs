//! What is looked at while a cliff stands and falls, and the crack's opening.

use super::debris::forward_turn;
use super::record::{CliffRecord, CliffTimes};
use crate::failure::Failure;
use crate::run::heap::{HeapAxis, edge};
use crate::run::world::fragments;
use crate::scene::CliffScene;
use crate::scene::world::Place;
use colluvium_dem::{Grain, Simulation};
use std::collections::BTreeSet;

/// Looks between two profiles.
const PROFILE_EVERY: usize = 20;
/// Height over the mean diameter of parcels at which debris ends: half a layer of single parcels.
pub(super) const EDGE: f64 = 0.25;

impl CliffScene {
    pub(super) fn heap_axis(&self, diameter: f64) -> HeapAxis {
        let length = self.far_end() - self.back();
        HeapAxis {
            start: self.back(),
            spacing: diameter,
            columns: (length / diameter).ceil() as usize,
            mirrored: false,
        }
    }

    /// What a look at the start remembers.
    pub(super) fn begin(&self, simulation: &mut Simulation) -> CliffRecord {
        let grains = simulation.grain_list();
        let solid: f64 = grains.iter().map(Grain::volume).sum();
        let room = self.areas()[0] * simulation.domain().lengths().y;
        let before = |g: &Grain| !g.fixed && self.before_crack(&g.position);
        let face = grains.iter().enumerate().filter(|(_, g)| before(g));
        let face = face.map(|(k, g)| [k as f64, g.position.x, g.position.z]);
        let mut record = CliffRecord {
            times: CliffTimes {
                opened: f64::NAN,
                failed: f64::NAN,
                ..CliffTimes::default()
            },
            face: face.collect(),
            ..CliffRecord::default()
        };
        record.heap.solid_fraction = solid / room;
        let own: BTreeSet<u32> = record.face.iter().map(|g| g[0] as u32).collect();
        let pairs = fragments::touching(simulation).into_iter();
        record.pairs = pairs
            .filter(|pair| pair.iter().all(|id| own.contains(id)))
            .collect();
        record
    }

    /// Opens the crack: says how many grains it made loose.
    pub(super) fn open(&self, simulation: &mut Simulation, diameter: f64) -> Result<f64, Failure> {
        let Some(region) = self.crack_region(diameter) else {
            return Ok(0.0);
        };
        let materials = CliffScene::materials(self, "")?;
        let at = Place {
            origin: "",
            section: "crack",
        };
        let loose = materials.number("crack", "crack", at)?;
        simulation.cut_bonds(&region);
        let loosened = simulation
            .convert(|g| (!g.fixed && region.contains(&g.position)).then_some(loose))
            .map_err(|error| Failure::Run(error.to_string()))?;
        Ok(loosened as f64)
    }

    /// How far the part before the crack has sunk, on the mean (m).
    pub(super) fn sunk(record: &CliffRecord, grains: &[Grain]) -> f64 {
        let sunk = record
            .face
            .iter()
            .map(|[k, _, z]| z - grains[*k as usize].position.z);
        sunk.sum::<f64>() / record.face.len().max(1) as f64
    }

    /// How far the sintered part before the crack has turned forward (degrees).
    pub(super) fn turned(&self, record: &CliffRecord, grains: &[Grain]) -> f64 {
        let low = self.shape.height - self.shape.sintered;
        let cap = record.face.iter().filter(|g| g[2] > low);
        let cap: Vec<_> = cap.collect();
        let before: Vec<[f64; 2]> = cap.iter().map(|g| [g[1], g[2]]).collect();
        let at = |k: f64| &grains[k as usize];
        let now = cap.iter().map(|g| at(g[0]).position).map(|x| [x.x, x.z]);
        let weights: Vec<f64> = cap.iter().map(|g| at(g[0]).mass()).collect();
        forward_turn(&before, &now.collect::<Vec<_>>(), &weights)
    }

    /// Speed that nine grains in ten of what stood before the crack stay below (m/s).
    pub(super) fn speed(record: &CliffRecord, grains: &[Grain]) -> f64 {
        let speeds = record.face.iter();
        let mut speeds: Vec<f64> = speeds
            .map(|g| grains[g[0] as usize].velocity.norm())
            .collect();
        speeds.sort_by(f64::total_cmp);
        speeds.get(speeds.len() * 9 / 10).copied().unwrap_or(0.0)
    }

    pub(super) fn heights(&self, grains: &[Grain], axis: &HeapAxis, base: f64) -> Vec<f64> {
        // The wall below is part of the heap's height.
        let rows = grains.iter().map(|g| [g.position.x, g.volume()]);
        let mut heights = axis.heights(rows, base);
        for (x, h) in axis.positions().into_iter().zip(&mut heights) {
            if x < 0.0 {
                *h += self.shape.wall;
            }
        }
        heights
    }

    pub(super) fn see(
        &self,
        simulation: &mut Simulation,
        record: &mut CliffRecord,
        axis: &HeapAxis,
    ) {
        let grains = simulation.grain_list();
        let base = record.heap.solid_fraction * simulation.domain().lengths().y;
        let heights = self.heights(&grains, axis, base);
        record.see(simulation.time(), axis, heights);
    }
}

impl CliffRecord {
    /// Notes where the debris ends and how high it is, and now and then all heights.
    pub(super) fn see(&mut self, time: f64, axis: &HeapAxis, heights: Vec<f64>) {
        let front = edge(&axis.positions(), &heights, EDGE * axis.spacing);
        let highest = heights.iter().copied().fold(0.0, f64::max);
        if self.heap.fronts.len().is_multiple_of(PROFILE_EVERY) {
            self.heap.profiles.push((time, heights));
        }
        self.heap.fronts.push([time, front, highest]);
    }
}
