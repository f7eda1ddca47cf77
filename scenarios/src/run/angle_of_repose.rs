//! The angle at which an avalanche comes to rest.
//!
//! A bed on a rough base of its own grains, periodic along and across, is set in gentle shear on a slope
//! that is then held. Below some angle the avalanche rests, above it it goes on: that angle is sought by
//! halving, each time with the bed as it was prepared: one that an avalanche has rested in before is
//! stronger, by 2° at β = 0.2. The slope has no ends: boxes with walls that are tilted until they run, and
//! heaps that drain over the edges of their base, stand up to ten degrees steeper with two thousand grains,
//! because walls carry the toe and layers are thin where they end.
//!
//! What decides is whether the mean velocity is lost within a time. Half a degree below the angle of rest
//! that takes longer than is waited for: the angle is found too low by about that, and known to half the
//! last step of the search.

use super::world::workshop::{Surroundings, step_for};
use super::world::{Course, Expected, Ran, Recipe, RecipeKeys, Workshop, World};
use crate::failure::Failure;
use crate::run_directory::toml_table;
use crate::scene::world::Materials;
use crate::scene::{AngleOfReposeScene, layers};
use crate::summary::{Figure, Quantity, Summary};
use crate::table::Table;
use colluvium_dem::preparation::{InclineBed, Midway, Packing, Watch, settle_incline_bed_from};
use colluvium_dem::{ContactLaw, Grain, Rolling, SetupError, Simulation, Snapshot, Tangential};
use nalgebra::Vector3;

/// Mean velocity of an avalanche at its end, over √(g d).
const STOPPED: f64 = 0.01;
/// Times its first velocity at which an avalanche has run away.
const AWAY: f64 = 3.0;
/// Share of its first velocity below which it counts as resting when it is no longer watched.
const RESTS: f64 = 0.1;
/// Looks at an avalanche in √(d/g).
const LOOKS: f64 = 1.0;
/// √(d/g) that a bed takes to settle for each grain over a square diameter, for the plan (measured: 8.3).
const SETTLING: f64 = 8.0;

/// Angles of repose (degrees) by μ_R and β with μ_s = 1 and μ_T = 1.3: F. Thuillet, PhD thesis, Université
/// Côte d'Azur 2019, Table 2.2, from avalanches of Y. Zhang.
pub const PUBLISHED_ANGLES: [[f64; 3]; 7] = [
    [1.05, 0.1, 25.0],
    [1.05, 0.2, 28.0],
    [1.05, 0.3, 31.0],
    [1.05, 1.0, 38.5],
    [2.0, 0.1, 26.5],
    [2.0, 0.2, 31.0],
    [2.0, 0.3, 33.0],
];

/// The table's angle for a law, where it has one.
fn published(law: &ContactLaw) -> Option<f64> {
    let Tangential::Linear(spring) = law.tangential else {
        return None;
    };
    let Rolling::Shape(shape) = law.rolling else {
        return None;
    };
    let near = |a: f64, b: f64| (a - b).abs() < 1e-9;
    PUBLISHED_ANGLES
        .iter()
        .find(|[rolling, beta, _]| {
            near(shape.rolling_friction, *rolling)
                && near(shape.beta, *beta)
                && near(shape.twisting_friction, 1.3)
                && near(spring.friction, 1.0)
        })
        .map(|[.., angle]| *angle)
}

/// Numbers of a grain of the bed in the recipe's memory: its place and its radius (m).
const GRAIN: usize = 4;

/// Numbers of a trial in the recipe's memory: slope (degrees), whether it rested, its last velocity over the
/// first, and how long it was watched (s).
const TRIAL: usize = 4;

/// The recipe's memory: where the search stands, and the trials so far.
#[derive(Clone, Debug, PartialEq)]
struct Search {
    low: f64,
    high: f64,
    /// When the present avalanche was set moving (s).
    since: f64,
    /// Mean velocity that it was given (m/s).
    given: f64,
    trials: Vec<[f64; TRIAL]>,
    /// The free grains of the bed as it was prepared.
    bed: Vec<[f64; GRAIN]>,
}

impl Search {
    fn read(state: &[f64]) -> Option<Search> {
        let (head, rest) = state.split_first_chunk::<5>()?;
        let &[low, high, since, given, trials] = head;
        let (trials, bed) = rest.split_at_checked(TRIAL * trials as usize)?;
        Some(Search {
            low,
            high,
            since,
            given,
            trials: trials.as_chunks::<TRIAL>().0.to_vec(),
            bed: bed.as_chunks::<GRAIN>().0.to_vec(),
        })
    }

    fn write(&self, state: &mut Vec<f64>) {
        state.clear();
        let trials = self.trials.len() as f64;
        state.extend([self.low, self.high, self.since, self.given, trials]);
        state.extend(self.trials.iter().flatten());
        state.extend(self.bed.iter().flatten());
    }

    fn slope(&self) -> f64 {
        0.5 * (self.low + self.high)
    }

    /// Takes in how an avalanche ended.
    fn judge(&mut self, velocity: f64, watched: f64) {
        let slope = self.slope();
        let rests = velocity < RESTS * self.given;
        let share = velocity / self.given;
        self.trials
            .push([slope, f64::from(u8::from(rests)), share, watched]);
        *(if rests { &mut self.low } else { &mut self.high }) = slope;
    }
}

impl AngleOfReposeScene {
    fn diameter(&self, materials: &Materials) -> f64 {
        2.0 * materials.ingredients[0].sizes.mean()
    }

    /// √(d/g) (s).
    fn unit(&self) -> Option<f64> {
        let materials = AngleOfReposeScene::materials(self, "").ok()?;
        Some((self.diameter(&materials) / self.gravity).sqrt())
    }

    fn edges(&self, d: f64) -> [f64; 2] {
        [self.floor.length_diameters, self.floor.width_diameters].map(|edge| self.scale * edge * d)
    }

    fn count(&self) -> usize {
        let base = self.floor.length_diameters * self.floor.width_diameters;
        (self.scale.powi(2) * base * self.floor.filling).round() as usize
    }

    fn tilted(&self, slope: f64) -> Vector3<f64> {
        let (s, c) = slope.to_radians().sin_cos();
        self.gravity * Vector3::new(s, 0.0, -c)
    }

    /// Avalanches at most.
    fn trials(&self) -> f64 {
        let width = self.search.high - self.search.low;
        (width / self.search.resolution).log2().ceil().max(1.0)
    }

    fn shear(&self, unit: f64) -> f64 {
        self.search.shear_scaled / unit
    }

    /// Puts the bed back as it was prepared.
    fn lay(&self, bed: &[[f64; GRAIN]], simulation: &mut Simulation) -> Result<(), Failure> {
        let first = self.grains.values().next();
        let density = first.map_or(f64::NAN, |keys| keys.density);
        let grains: Vec<Grain> = bed
            .iter()
            .map(|&[x, y, z, radius]| Grain::at_rest(Vector3::new(x, y, z), radius, density))
            .collect();
        simulation.remove(|grain| !grain.fixed);
        simulation
            .insert(&grains)
            .map(drop)
            .map_err(|error| Failure::Run(error.to_string()))
    }

    /// Sets the bed moving on the slope that is to be tried next.
    fn begin(
        &self,
        search: &mut Search,
        simulation: &mut Simulation,
        unit: f64,
    ) -> Result<(), Failure> {
        let rate = self.shear(unit);
        simulation
            .set_gravity(self.tilted(search.slope()))
            .map_err(|error| Failure::Run(error.to_string()))?;
        simulation.give_velocity(|g| Vector3::new(rate * g.position.z.max(0.0), 0.0, 0.0));
        search.since = simulation.time();
        search.given = simulation.momentum().x / simulation.free_mass();
        Ok(())
    }
}

impl Recipe for AngleOfReposeScene {
    fn about(&self) -> String {
        format!(
            "{} grains on a rough periodic slope, set moving between {} and {} degrees until the angle of rest is known \
             to {} degrees",
            self.count(),
            self.search.low,
            self.search.high,
            0.5 * self.search.resolution
        )
    }

    fn materials(&self, origin: &str) -> Result<Materials, Failure> {
        Ok(AngleOfReposeScene::materials(self, origin)?)
    }

    fn keys(&self) -> RecipeKeys<'_> {
        RecipeKeys {
            contact: &self.contact,
            seed: self.seed,
            coarse_graining: 1.0,
            step: &self.timestep,
            output: &self.output,
            packing: self.packing.as_deref(),
        }
    }

    fn provenance(&self) -> Result<Option<toml::Table>, Failure> {
        let mut keys = toml_table("the preparation", self)?;
        for later in ["packing", "output", "search"] {
            keys.remove(later);
        }
        for step in ["seconds", "safety"] {
            layers::remove(&mut keys, &format!("timestep.{step}"));
        }
        Ok(Some(keys))
    }

    fn prepare(&self, shop: &mut Workshop, _: &str) -> Result<(), Failure> {
        let first = &shop.materials.ingredients[0];
        let [length, width] = self.edges(2.0 * first.sizes.mean());
        let around = Surroundings {
            gravity: self.tilted(0.0),
            ..Surroundings::none(shop.materials.laws.clone())
        };
        let step = step_for(shop.materials, &around, shop.safety)
            .ok_or_else(|| Failure::Run("preparation: nothing limits the step".into()))?;
        let spec = InclineBed {
            grains: self.count(),
            radius: first.sizes.radius.clone(),
            density: first.density,
            length,
            width,
            law: *shop.materials.first_law(),
            gravity: self.gravity,
            timestep: step,
            seed: self.seed,
        };
        shop.step(|shop, step| {
            let state = step.goes_on().map(|midway| &midway.record);
            let look = &mut |_, simulation: &mut Simulation| {
                step.pass(|| Midway {
                    record: simulation.checkpoint(),
                    loops: Vec::new(),
                })
            };
            let bed = settle_incline_bed_from(state, &spec, shop.threads, look);
            let bed = bed.map_err(|error| match error {
                SetupError::Record(why) => Failure::damaged(&why),
                SetupError::Diverged(_) | SetupError::Interrupted => {
                    Failure::Run(error.to_string())
                }
                error => Failure::Input(format!("preparation: {error}")),
            })?;
            shop.packing = Packing {
                domain: bed.domain,
                grains: bed.grains,
                contacts: Vec::new(),
                clumps: Vec::new(),
            };
            shop.grain_steps += bed.report.grain_steps;
            shop.note(
                "bed",
                format!(
                    "{} grains over {} that stick to the floor, depth {:.4e} m, solid fraction {:.4}, {:.2} contacts a grain, kinetic \
                     energy {:.1e} m g d a grain",
                    bed.report.grains,
                    bed.report.base_grains,
                    bed.report.depth,
                    bed.report.solid_fraction,
                    bed.report.coordination,
                    bed.report.kinetic_energy
                ),
            );
            Ok(())
        })
    }

    fn world(&self, _: &Packing, materials: &Materials, _: &str) -> Result<World, Failure> {
        let d = self.diameter(materials);
        let unit = (d / self.gravity).sqrt();
        let depth = self.floor.filling * d;
        Ok(World {
            gravity: self.tilted(0.5 * (self.search.low + self.search.high)),
            // At the surface of an avalanche that has run away.
            speed: 2.0 * AWAY * self.shear(unit) * depth,
            ..World::empty((self.trials() + 1.0) * (self.search.watch_scaled + 2.0 * LOOKS) * unit)
        })
    }

    fn expected(&self, materials: &Materials) -> Expected {
        let around = Surroundings {
            gravity: self.tilted(0.0),
            ..Surroundings::none(materials.laws.clone())
        };
        let (d, base) = (self.diameter(materials), self.scale.powi(2));
        let base = base * self.floor.length_diameters * self.floor.width_diameters;
        let unit = (d / self.gravity).sqrt();
        let grains = self.count() as f64 + base;
        let steps = step_for(materials, &around, self.timestep.preparation)
            .map(|step| SETTLING * self.floor.filling * unit / step);
        Expected {
            grains,
            preparation: steps.map(|steps| steps * grains),
            duration: self.trials() * self.search.watch_scaled * unit,
        }
    }

    fn left_out(&self) -> Vec<&'static str> {
        vec![
            "air",
            "breakage of grains",
            "ends and sides of the slope (periodic)",
        ]
    }

    fn plan(&self) -> Vec<(String, String)> {
        let trials = format!(
            "{} avalanches, each watched for {} √(d/g) at most",
            self.trials(),
            self.search.watch_scaled
        );
        vec![("search".into(), trials)]
    }

    fn steer_every(&self, timestep: f64) -> u64 {
        self.unit()
            .map_or(1, |unit| (LOOKS * unit / timestep).round().max(1.0) as u64)
    }

    fn steer(&self, simulation: &mut Simulation, state: &mut Vec<f64>) -> Result<Course, Failure> {
        let Some(unit) = self.unit() else {
            return Ok(Course::Over);
        };
        let Some(mut search) = Search::read(state) else {
            let free = simulation.grain_list().into_iter().filter(|g| !g.fixed);
            let mut search = Search {
                low: self.search.low,
                high: self.search.high,
                since: 0.0,
                given: 0.0,
                trials: Vec::new(),
                bed: free
                    .map(|g| [g.position.x, g.position.y, g.position.z, g.radius])
                    .collect(),
            };
            self.begin(&mut search, simulation, unit)?;
            search.write(state);
            return Ok(Course::On);
        };
        let velocity = simulation.momentum().x / simulation.free_mass();
        let watched = simulation.time() - search.since;
        let stopped = STOPPED * self.gravity * unit;
        if velocity > stopped
            && velocity < AWAY * search.given
            && watched < self.search.watch_scaled * unit
        {
            return Ok(Course::On);
        }
        search.judge(velocity, watched);
        let over = search.high - search.low <= self.search.resolution;
        if !over {
            self.lay(&search.bed, simulation)?;
            self.begin(&mut search, simulation, unit)?;
        }
        search.write(state);
        Ok(if over { Course::Over } else { Course::On })
    }

    fn columns(&self) -> Vec<(String, &'static str)> {
        vec![("slope".into(), "degree"), ("trials".into(), "1")]
    }

    fn look(&self, simulation: &mut Simulation, _: &Snapshot, state: &[f64]) -> Vec<f64> {
        let g = simulation.gravity();
        let trials = Search::read(state).map_or(0, |search| search.trials.len());
        vec![g.x.atan2(-g.z).to_degrees(), trials as f64]
    }

    fn conclude(&self, ran: &mut Ran, summary: &mut Summary) -> Result<Vec<Table>, Failure> {
        let search = Search::read(&ran.state);
        let search = search.ok_or_else(|| Failure::Run("no avalanche was set moving".into()))?;
        let (angle, error) = (search.slope(), 0.5 * (search.high - search.low));
        let mut found = Quantity::new(angle, "degree").with_error(error);
        let source = "Thuillet 2019, Tab. 2.2, avalanches of Y. Zhang";
        found = match published(&ran.stand.setup.law.own[0]) {
            Some(reference) => found.against(reference, source),
            None => found.from("middle and half width of the last bracket"),
        };
        summary.put("angle_of_repose", found);
        summary.put(
            "friction",
            Quantity::new(angle.to_radians().tan(), "1").from("its tangent"),
        );
        summary.put("avalanches", Quantity::new(search.trials.len() as f64, "1"));
        for (bound, value, word) in [
            ("low", search.low, "does not move on"),
            ("high", search.high, "rests"),
        ] {
            let given = if bound == "low" {
                self.search.low
            } else {
                self.search.high
            };
            if value == given {
                summary.remarks.push(format!(
                    "search.{bound} = {given} was never tried: the angle may lie beyond it, if an avalanche there {word}."
                ));
            }
        }
        let column = |k: usize| search.trials.iter().map(|t| t[k]).collect();
        let table = Table::new("avalanches")
            .with("slope", "degree", column(0))
            .with("rests", "1", column(1))
            .with("last_velocity", "of the first", column(2))
            .with("watched", "s", column(3));
        summary.figures.push(Figure::history(
            "mean velocity downslope [m/s]",
            &[("vx", "grains")],
            "Avalanches on one slope after the other: each is set moving, and rests or does not.",
        ));
        summary.figures.push(Figure::history(
            "slope [degrees]",
            &[("slope", "slope")],
            "The slopes that were tried.",
        ));
        Ok(vec![table])
    }

    fn compared(&self) -> Vec<&'static str> {
        vec!["angle_of_repose"]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_search_is_remembered_and_halves_its_bracket() {
        let mut search = Search {
            low: 20.0,
            high: 40.0,
            since: 1.5,
            given: 0.2,
            trials: Vec::new(),
            bed: vec![[1.0, 2.0, 3.0, 0.5], [-1.0, 0.0, 4.0, 0.4]],
        };
        search.judge(0.001, 3.0);
        search.judge(0.3, 4.0);
        assert_eq!(
            (search.low, search.high, search.slope()),
            (30.0, 35.0, 32.5)
        );
        assert_eq!(
            search.trials,
            [[30.0, 1.0, 0.005, 3.0], [35.0, 0.0, 0.3 / 0.2, 4.0]]
        );
        let mut state = vec![7.0];
        search.write(&mut state);
        assert_eq!(Search::read(&state), Some(search));
        assert_eq!(Search::read(&[]), None);
    }
}
