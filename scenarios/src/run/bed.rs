//! A bed of grains from its start through a given number of steps: what `chute` and `settle` share.

use super::energy_table::EnergyTable;
use super::{Findings, Under, impact_scales, step};
use crate::cost::Cost;
use crate::failure::Failure;
use crate::frames::Frames;
use crate::progress::Bar;
use crate::scene::{CohesionKind, Pace, Parts, RollingKind, Scene, SceneError, TangentialKind};
use crate::start_file::{self, StartError};
use crate::summary::{Model, Quantity, Summary};
use colluvium_dem::timestep::{Choice, Conditions, Shares};
use colluvium_dem::{ContactLaw, Grain, Partner, Setup, SetupError, Simulation, Snapshot};
use nalgebra::Vector3;
use std::path::Path;

/// Steps between two looks at the clock.
const STEPS_PER_LOOK: u64 = 50;

/// A bed ready to run.
#[derive(Debug)]
pub struct Bed {
    /// The start.
    pub setup: Setup,
    /// Law of the grains, or of the parcels that stand for them.
    pub law: ContactLaw,
    /// Steps and their length.
    pub pace: Pace,
    /// Further steps at which a row is written.
    pub marks: &'static [u64],
    /// Whether rows hold the energy ledger.
    pub ledger: bool,
    /// Height of the floor, or of the tops of the base (m).
    pub floor: f64,
    /// Area of the floor (m²).
    pub area: f64,
    /// Largest speed to be expected (m/s).
    pub speed: f64,
}

/// A bed that has run.
#[derive(Debug)]
pub struct Ran {
    /// Rows of `energy.csv`.
    pub rows: EnergyTable,
    /// The state at the end.
    pub simulation: Simulation,
    /// Grains and contacts at the end.
    pub snapshot: Snapshot,
}

impl Bed {
    /// The limits of the step and the step they allow, at the fastest impact to be expected and under
    /// the bed's own weight.
    pub fn allowed_step(&self) -> Result<Choice, SetupError> {
        let down = Vector3::new(0.0, 0.0, self.setup.gravity.z);
        let conditions = Conditions {
            speed: self.speed,
            overlap: 0.0,
            ..Conditions::of(&self.setup.grains, &down)
        };
        self.setup.choose_step(&conditions, &Shares::default())
    }

    /// Overlap of the fastest impact of two of the lightest free grains, over their radius.
    pub fn struck(&self) -> f64 {
        let free = self.setup.grains.iter().filter(|g| !g.fixed);
        let lightest = free.min_by(|a, b| a.mass().total_cmp(&b.mass()));
        lightest.map_or(0.0, |g| {
            let (mass, radius) = (0.5 * g.mass(), 0.5 * g.radius);
            impact_scales::overlap(&self.law, mass, radius, self.speed) / g.radius
        })
    }

    /// Free grains.
    pub fn free(&self) -> usize {
        self.setup.grains.iter().filter(|g| !g.fixed).count()
    }
}

/// The grains of a start file, or why there are none.
pub fn read_start(path: &str) -> Result<Vec<Grain>, SceneError> {
    start_file::read(Path::new(path)).map_err(|error| refused_start(path, error.to_string()))
}

/// The error that a start file cannot be used.
pub fn refused_start(path: &str, message: String) -> SceneError {
    SceneError::Start {
        path: path.to_owned(),
        message: format!(
            "{message}; allowed: a CSV file, gzipped or not, with the columns type, radius, density, x, y, z, vx, vy, vz and omegax, omegay, omegaz, of which the type and the spins may be left out"
        ),
    }
}

/// The same for the bundled start, which the program's own tests have read.
pub fn bundled(read: Result<Vec<Grain>, StartError>) -> Result<Vec<Grain>, Failure> {
    read.map_err(|error| Failure::Run(error.to_string()))
}

/// Checks a bed before anything is written.
pub fn check(scene: &Scene, bed: Bed, timestep_key: f64) -> Result<(), Failure> {
    if bed.free() == 0 {
        let path = scene.body.start_file().unwrap_or_default();
        return Err(refused_start(path, "all grains are frozen".into()).into());
    }
    let refused = |error: SetupError| match (error, scene.body.start_file()) {
        // Only the chute is periodic.
        (
            SetupError::NarrowDomain {
                axis,
                length,
                least,
            },
            _,
        ) => {
            let key = if axis == 'x' { "length" } else { "width" };
            let range = format!("at least {least}: two largest diameters and the list's skin");
            scene.out_of_range(key, length, &range).into()
        }
        (error, Some(path)) => refused_start(path, error.to_string()).into(),
        (error, None) => Failure::Input(format!("{}: {error}", scene.origin)),
    };
    let choice = bed.allowed_step().map_err(refused)?;
    let step = bed.pace.timestep;
    step::check(scene, &choice, step, "timestep", timestep_key)?;
    Simulation::new(bed.setup).map(drop).map_err(refused)
}

/// Runs a bed.
pub fn run(bed: &Bed, under: &mut Under) -> Result<Ran, Failure> {
    let refused = |error: SetupError| Failure::Input(error.to_string());
    let setup = bed.setup.clone();
    let mut rows = EnergyTable::new(bed.floor, bed.ledger);
    let mut simulation = match &under.resumed {
        Some(saved) => {
            rows.restore(&saved.record).map_err(Failure::Input)?;
            Simulation::resume(setup, &saved.record).map_err(refused)?
        }
        None => {
            let mut simulation = Simulation::new(setup).map_err(refused)?;
            if bed.ledger {
                simulation.open_energy_ledger();
            }
            simulation
        }
    };
    under.begin()?;
    let bar = Bar::new(&under.scene.name);
    let mut snapshot = Snapshot::default();
    let frames = Frames::new(under.directory.path(), bed.pace.steps, bed.pace.frames);
    if simulation.steps_done() == 0 {
        rows.look(&mut simulation, &mut snapshot);
        frames.take(&mut simulation, &mut snapshot)?;
    }
    while simulation.steps_done() < bed.pace.steps {
        let done = simulation.steps_done();
        let row = next_row(done, bed);
        let next = row.min(done + STEPS_PER_LOOK);
        let next = frames.next(done).map_or(next, |frame| frame.min(next));
        simulation
            .advance(next - done)
            .map_err(|error| Failure::Run(error.to_string()))?;
        if next == row {
            rows.look(&mut simulation, &mut snapshot);
        }
        frames.take(&mut simulation, &mut snapshot)?;
        bar.set(next as f64 / bed.pace.steps as f64);
        under.checkpoint("steps", || {
            let mut record = simulation.checkpoint();
            rows.save(&mut record);
            record
        })?;
    }
    bar.clear();
    frames.join(simulation.steps_done())?;
    simulation.snapshot(&mut snapshot);
    Ok(Ran {
        rows,
        simulation,
        snapshot,
    })
}

/// The step at which the next row is written.
fn next_row(done: u64, bed: &Bed) -> u64 {
    let regular = (done / bed.pace.record_every + 1) * bed.pace.record_every;
    let marks = bed.marks.iter().copied().filter(|&mark| mark > done);
    marks.fold(regular.min(bed.pace.steps), u64::min)
}

/// What every bed reports.
pub fn findings(
    bed: &Bed,
    mut ran: Ran,
    left_out: Vec<String>,
    under: &Under,
) -> Result<Findings, Failure> {
    let simulation = &mut ran.simulation;
    let grains = simulation.grain_count() as u64;
    let mut summary = Summary::begun(&under.scene.name, "run");
    let choice = bed
        .allowed_step()
        .map_err(|error| Failure::Run(error.to_string()))?;
    summary.model = Model {
        grains,
        cells: 0,
        dt_s: bed.pace.timestep,
        dt_limit: step::given(bed.pace.timestep, &choice),
        left_out,
    };
    summary.cost = Cost::measured(under.wall_s(), under.threads, bed.pace.steps * grains, 0);
    summary.state_hash = simulation.state_hash();
    summary.ledger.momentum_relative = Some(simulation.momentum_error());
    let energy = simulation.energy();
    for (name, value) in [
        ("translation_J", energy.translation),
        ("rotation_J", energy.rotation),
        ("elastic_J", energy.elastic()),
    ] {
        summary.ledger.energy.insert(name.into(), value);
    }
    for name in ran.rows.ledger() {
        let value = ran.rows.last(name);
        summary.ledger.energy.insert(format!("{name}_J"), value);
    }
    summary.put(
        "kinetic_energy",
        Quantity::new(ran.rows.last("kinetic_energy"), "J")
            .from("at the end, translation and rotation"),
    );
    let height = ran.rows.last("height");
    summary.put(
        "centre_of_mass_height",
        Quantity::new(height, "m").from("at the end, above the floor or the tops of the base"),
    );
    summary.put(
        "solid_fraction",
        Quantity::new(solid_fraction(&ran.snapshot, bed, height), "1")
            .from("at the end, between a quarter and three quarters of the depth"),
    );
    summary.put(
        "coordination",
        Quantity::new(coordination(&ran.snapshot), "1").from("contacts of a free grain at the end"),
    );
    summary.put(
        "largest_overlap",
        Quantity::new(ran.simulation.largest_overlap(), "R"),
    );
    Ok(Findings {
        summary,
        tables: vec![ran.rows.table()],
        grains: Some(super::grain_table::of(&ran.snapshot)),
    })
}

/// Volume of spheres in the middle half of the depth over the volume of that layer; the depth is
/// twice the height of the centre of mass.
fn solid_fraction(snapshot: &Snapshot, bed: &Bed, height: f64) -> f64 {
    let (low, high) = (bed.floor + 0.5 * height, bed.floor + 1.5 * height);
    let solid: f64 = snapshot
        .grains
        .iter()
        .map(|g| below(high - g.position.z, g.radius) - below(low - g.position.z, g.radius))
        .sum();
    solid / (bed.area * (high - low))
}

/// Volume of a sphere below a plane `z` above its centre.
fn below(z: f64, radius: f64) -> f64 {
    let z = z.clamp(-radius, radius);
    std::f64::consts::PI * (radius * radius * z - z.powi(3) / 3.0 + 2.0 / 3.0 * radius.powi(3))
}

/// Contacts of a free grain, those with walls and the base included.
fn coordination(snapshot: &Snapshot) -> f64 {
    let free = |i: usize| usize::from(!snapshot.grains[i].fixed);
    let touches: usize = snapshot
        .contacts
        .iter()
        .map(|contact| {
            free(contact.grain)
                + match contact.partner {
                    Partner::Grain(j) => free(j),
                    Partner::Wall(_) | Partner::Body(_) => 0,
                }
        })
        .sum();
    let grains: usize = (0..snapshot.grains.len()).map(free).sum();
    touches as f64 / grains as f64
}

/// Physics that the parts of a law do not hold.
pub fn left_out(parts: Parts, also: &[&str]) -> Vec<String> {
    let mut list: Vec<String> = also.iter().map(|&s| s.to_owned()).collect();
    if parts.tangential == TangentialKind::None {
        list.push("friction".into());
    }
    if parts.rolling == RollingKind::None {
        list.push("rolling and twisting resistance".into());
    }
    // JKR contacts adhere by themselves.
    if parts.cohesion == CohesionKind::None && parts.normal != crate::scene::NormalKind::Jkr {
        list.push("cohesion".into());
    }
    list
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sphere_is_cut_by_a_plane() {
        let whole = 4.0 / 3.0 * std::f64::consts::PI * 8.0;
        assert!(below(-3.0, 2.0).abs() < 1e-14);
        assert!((below(9.0, 2.0) / whole - 1.0).abs() < 1e-15);
        assert!((below(0.0, 2.0) / whole - 0.5).abs() < 1e-15);
        // A cap of height h: π h² (3 R - h)/3.
        assert!((below(-1.0, 2.0) - std::f64::consts::PI * 5.0 / 3.0).abs() < 1e-12);
    }
}
