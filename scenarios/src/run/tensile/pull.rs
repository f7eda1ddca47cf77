//! The pull on each sample, and what its clamp feels.
//!
//! The sample's own momentum says what the clamp feels: nothing else acts on it.
//!
//! ```text
//! σ_c = σ_a - Δp/(A Δt)        σ_a (Pa) pull, p (N s) momentum of the sample downwards, A (m²) its cross-section
//! ```
//!
//! The pull rises in steps. A step waits until the clamp feels what is pulled, but not for ever: a sample that
//! yields goes on yielding. The force is shared out by mass over those grains of the lowest layer that still
//! hang on the clamp.

use super::sample::LAYER;
use crate::failure::Failure;
use crate::run::comet;
use crate::run::world::fragments;
use crate::scene::TensileScene;
use crate::scene::world::Materials;
use colluvium_dem::{Grain, Load, Simulation};
use nalgebra::Vector3;

/// The clamp's force has fallen below this share of its largest: the sample is broken.
pub const BROKEN: f64 = 0.5;
/// Looks in a row with so little force after which it counts as broken: waves pass.
const LOOKS: f64 = 3.0;
/// Difference between pull and clamp over the pull up to which the sample carries the pull.
pub const LAG: f64 = 0.1;

/// How one sample stands.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pull {
    /// Stress applied now (Pa).
    pub applied: f64,
    /// Momentum downwards at the last look (N s), and when (s).
    momentum: f64,
    time: f64,
    /// Mean stress on the clamp since the look before (Pa).
    pub stress: f64,
    /// The largest so far, and the stress applied then (Pa).
    pub strength: f64,
    pub applied_then: f64,
    /// The largest pull that the clamp came to feel (Pa).
    pub carried: f64,
    /// Looks that the present step has waited for.
    waited: f64,
    /// Looks in a row at which the clamp felt little.
    low: f64,
    /// Whether it has broken.
    over: f64,
    /// Its grains in number, and the numbers of those of its lowest layer.
    grains: usize,
    layer: Vec<u32>,
}

const HEAD: usize = 11;

impl Pull {
    /// Reads one from the recipe's memory, and what is left of that.
    fn read(state: &[f64]) -> Option<(Pull, &[f64])> {
        let (head, rest) = state.split_first_chunk::<{ HEAD + 1 }>()?;
        let &[
            applied,
            momentum,
            time,
            stress,
            strength,
            applied_then,
            carried,
            waited,
            low,
            over,
            grains,
            count,
        ] = head;
        let (layer, rest) = rest.split_at_checked(count as usize)?;
        let pull = Pull {
            applied,
            momentum,
            time,
            stress,
            strength,
            applied_then,
            carried,
            waited,
            low,
            over,
            grains: grains as usize,
            layer: layer.iter().map(|id| *id as u32).collect(),
        };
        Some((pull, rest))
    }

    fn write(&self, state: &mut Vec<f64>) {
        let head: [f64; HEAD] = [
            self.applied,
            self.momentum,
            self.time,
            self.stress,
            self.strength,
            self.applied_then,
            self.carried,
            self.waited,
            self.low,
            self.over,
            self.grains as f64,
        ];
        state.extend(head);
        state.push(self.layer.len() as f64);
        state.extend(self.layer.iter().map(|id| f64::from(*id)));
    }

    /// Whether the sample has broken.
    pub fn is_over(&self) -> bool {
        self.over > 0.0
    }

    /// Takes a look at the sample, and says whether the pull goes on rising.
    fn look(
        &mut self,
        (time, momentum): (f64, f64),
        area: f64,
        (step, patience): (f64, f64),
    ) -> bool {
        let passed = time - self.time;
        let mut rises = true;
        if passed > 0.0 {
            self.stress = self.applied - (momentum - self.momentum) / (passed * area);
            if self.stress > self.strength {
                (self.strength, self.applied_then) = (self.stress, self.applied);
            }
            self.waited += 1.0;
            let carried = (self.applied - self.stress).abs() <= LAG * self.applied;
            if carried {
                self.carried = self.carried.max(self.applied);
            }
            rises = carried || self.waited >= patience;
            // Early waves take the clamp's force up and down.
            let little = self.stress < BROKEN * self.strength && self.strength > 3.0 * step;
            self.low = if little { self.low + 1.0 } else { 0.0 };
            if self.low >= LOOKS {
                self.over = 1.0;
            }
        }
        (self.time, self.momentum) = (time, momentum);
        rises
    }
}

/// All samples, from the recipe's memory.
pub fn read(mut state: &[f64]) -> Vec<Pull> {
    let mut pulls = Vec::new();
    while let Some((pull, rest)) = Pull::read(state) {
        pulls.push(pull);
        state = rest;
    }
    pulls
}

fn write(pulls: &[Pull], state: &mut Vec<f64>) {
    state.clear();
    pulls.iter().for_each(|pull| pull.write(state));
}

/// Momentum downwards of grains (N s).
fn momentum(grains: &[Grain]) -> f64 {
    let free = grains.iter().filter(|g| !g.fixed);
    free.map(|g| -g.mass() * g.velocity.z).sum()
}

impl TensileScene {
    /// The samples before they are pulled.
    fn samples_at_rest(&self, grains: &[Grain], materials: &Materials) -> Vec<Pull> {
        let thickness = LAYER * comet::diameter(materials);
        let mut pulls = vec![Pull::default(); self.samples];
        let mut lowest = vec![f64::INFINITY; self.samples];
        for grain in grains {
            let k = self.sample_at(&grain.position);
            lowest[k] = lowest[k].min(grain.position.z);
        }
        for (id, grain) in (0..).zip(grains) {
            let k = self.sample_at(&grain.position);
            pulls[k].grains += 1;
            if !grain.fixed && grain.position.z <= lowest[k] + thickness {
                pulls[k].layer.push(id);
            }
        }
        pulls
    }

    /// For each grain whether it hangs on the clamp.
    fn hanging(&self, simulation: &mut Simulation, grains: &[Grain]) -> Vec<bool> {
        let masses: Vec<f64> = grains.iter().map(Grain::mass).collect();
        let pairs = fragments::touching(simulation);
        let mut hanging = vec![false; grains.len()];
        let clamped = |k: &usize| grains[*k].fixed || grains[*k].position.z > self.clamp_foot();
        for fragment in fragments::joined(&masses, &pairs) {
            if fragment.grains.iter().any(clamped) {
                fragment.grains.iter().for_each(|&k| hanging[k] = true);
            }
        }
        hanging
    }

    /// Looks at all samples and pulls on. Says whether any is left whole.
    pub(super) fn pull_on(
        &self,
        simulation: &mut Simulation,
        state: &mut Vec<f64>,
        materials: &Materials,
    ) -> Result<bool, Failure> {
        let grains = simulation.grain_list();
        let mut pulls = read(state);
        if pulls.is_empty() {
            pulls = self.samples_at_rest(&grains, materials);
        }
        let (area, time) = (self.area(), simulation.time());
        let step = self.pull.step * self.rumpf(materials);
        let hanging = self.hanging(simulation, &grains);
        let mut loads = Vec::new();
        let mut first = 0;
        for pull in &mut pulls {
            let own = &grains[first..first + pull.grains];
            first += pull.grains;
            if pull.is_over() {
                continue;
            }
            let rises = pull.look((time, momentum(own)), area, (step, self.pull.patience));
            let layer = pull.layer.iter().copied();
            let held: Vec<u32> = layer.filter(|id| hanging[*id as usize]).collect();
            if held.is_empty() {
                pull.over = 1.0;
            }
            if pull.is_over() {
                continue;
            }
            if rises {
                pull.applied += step;
                pull.waited = 0.0;
            }
            let mass = |id: &u32| grains[*id as usize].mass();
            let force = -pull.applied * area / held.iter().map(mass).sum::<f64>();
            loads.extend(held.iter().map(|id| Load {
                grain: *id,
                force: Vector3::new(0.0, 0.0, force * mass(id)),
                moment: Vector3::zeros(),
            }));
        }
        simulation
            .set_loads(&loads)
            .map_err(|error| Failure::Run(error.to_string()))?;
        write(&pulls, state);
        Ok(pulls.iter().any(|pull| !pull.is_over()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_comes_back_as_it_went_and_a_pull_waits_for_the_clamp() {
        let mut pull = Pull {
            applied: 1.0,
            grains: 7,
            layer: vec![3, 4],
            ..Pull::default()
        };
        // After a second at 1 Pa on 2 m², 0.5 N s are in the sample: the clamp took 1.5 N s, 0.75 Pa.
        assert!(!pull.look((1.0, 0.5), 2.0, (0.1, 8.0)));
        assert_eq!((pull.stress, pull.carried), (0.75, 0.0));
        // Then nothing is added: it is carried, and the pull rises.
        assert!(pull.look((2.0, 0.5), 2.0, (0.1, 8.0)));
        assert_eq!((pull.strength, pull.carried), (1.0, 1.0));
        // It lets go: after three looks with little on the clamp it counts as broken.
        for (k, over) in [(3.0, false), (4.0, false), (5.0, true)] {
            pull.look((k, 0.5 + 2.0 * (k - 2.0)), 2.0, (0.1, 8.0));
            assert_eq!(pull.is_over(), over, "{k}");
        }
        let mut state = Vec::new();
        write(&[pull.clone(), Pull::default()], &mut state);
        assert_eq!(read(&state), [pull, Pull::default()]);
    }
}
