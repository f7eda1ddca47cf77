//! Grains in a box within a bed that is a continuum in space around them: the bowl that a ball falls into.
//!
//! Grains fill a box of the continuum's cells, open at the top; it stays where it is, for what moves a lot should
//! lie well inside it. With ξ the distance from the nearest side into the grains, from the sides inwards: *shell*
//! ξ < b, *buffer* ξ < ξ_m, *inner overlap* ξ_m < ξ < ξ_a; totals count grains inside the handshake surface ξ = ξ_m
//! and continuum outside it. What is exchanged is what a flat edge exchanges (see [`super`]), cell by cell in space:
//!
//! - *on the continuum*: its surface at ξ_a, inside the grains, bears their mean pressure, and from ξ_m to ξ_a its
//!   deviatoric stress is w σ_grains + (1 − w) σ_continuum, w = (ξ − ξ_m)/(ξ_a − ξ_m) at the middle of a cell
//!   ([`Outside`]); beyond ξ_m it is a copy of the grains, made anew at every exchange (`copy.rs`);
//! - *on the grains*: the shell bears the continuum's traction σ n A, face by face of the box, with an impedance in
//!   its normal part, −Z A (s·n) n, s the mean of v − u over the shell's grains, u at each one's place;
//! - *on both, equal and opposite*: mean velocities of the buffer relax to each other, mean spins to half of the curl, for which
//!   the continuum has forces about the cell.
//!
//! The continuum is what is missing of the bed's mass, at the solid fraction of its grains, with a level surface.
//! One grain may belong to neither side: the ball.

mod account;
mod cells;
mod continuum;
mod copy;
mod dilute;
mod exchange;
mod gradients;
mod growth;
mod journey;
mod memory;
mod oracle;
mod returning;
mod room;
#[cfg(test)]
mod rotation;
mod settlement;
mod store;
mod watch;
mod zone;

pub use super::cell_monitors::CellMonitors as Monitors;
pub use account::Account;
pub use cells::Cells;
pub use journey::{Growth, Move};
pub use zone::Zone;

use super::OverlapError;
use super::angular::AngularBook;
use super::cell_joint::CellJoint;
use super::rest_stress::RestStress;
use super::settings::{Resolved, check};
use super::sighting::{Sighting, free_mass};
use cells::Sums;
use colluvium_continuum::free_surface::{Outside, SpaceFields, SpaceFlow, SurfaceOptions};
use colluvium_continuum::rheology::MuI;
use colluvium_continuum::units::Units;
use colluvium_dem::preparation::ShearedCell;
use colluvium_dem::{GrainSample, Simulation};
use continuum::View;
use journey::Journey;
use nalgebra::{Matrix3, Vector3};
use zone::Faces;

/// Faces with less than this of a full shell hand on what presses on them: a force on few grains throws them out.
const LEAST_SHELL: f64 = 0.3;
/// Rows of cells above the surface of the bed, for it to rise into.
const ROOM: usize = 2;
/// Rounds in which the height of the continuum and what lies inside the handshake surface come to agree.
const ROUNDS: usize = 20;

/// What a bowl is made from (SI).
#[derive(Clone, Copy, Debug)]
pub struct BowlSpec {
    /// Lower corner of the bed (m): its floor, and where its walls meet.
    pub low: [f64; 3],
    /// Its extent along x and y (m).
    pub size: [f64; 2],
    /// Gravity, downwards (m/s²).
    pub gravity: f64,
    /// The law of the continuum, at the solid fraction of the grains.
    pub law: MuI,
    /// Settings of the continuum's solver.
    pub options: SurfaceOptions,
    /// Low and high edge of the box along x and y (m), rounded to cells; at or beyond a wall of the bed it has no side there.
    pub edges: [[f64; 2]; 2],
    /// Height of its bottom above the floor (m), rounded to cells.
    pub bottom: f64,
    /// Widths, times and the impedance.
    pub settings: Resolved,
    /// Number of the grain that belongs to neither side.
    pub ball: Option<u32>,
    /// When the box grows and shrinks, if it does.
    pub growth: Option<Growth>,
}

/// The grid and the box in it.
#[derive(Clone, Debug)]
struct Layout {
    cells: Cells,
    zone: Zone,
    /// Cells of the buffer, and of buffer and inner overlap together.
    widths: [f64; 2],
    /// Height of the continuum (m).
    height: f64,
}

impl BowlSpec {
    fn belongs(&self) -> impl Fn(&GrainSample) -> bool + use<> {
        let ball = self.ball;
        move |grain| !grain.fixed && Some(grain.id) != ball
    }

    /// Density of the continuum (kg/m³).
    pub fn density(&self) -> f64 {
        self.law.bulk_density()
    }

    fn units(&self, height: f64) -> Units {
        Units::of_gravity(height, self.density(), self.gravity)
    }

    /// Cells of buffer, and of buffer and inner overlap together.
    fn widths(&self) -> [f64; 2] {
        let s = &self.settings;
        let [buffer, inner] = [s.buffer, s.inner].map(|w| (w / s.cell).round().max(1.0));
        [buffer, buffer + inner]
    }

    /// Whether a box, its overlap and some continuum around it have room in a bed of this height (m).
    ///
    /// # Errors
    /// [`OverlapError::OutOfRange`] with `x`, `y` (the box's extent along it, m), `bottom` or `sides` (their number).
    pub fn check(&self, height: f64) -> Result<(), OverlapError> {
        self.layout(height).map(drop)
    }

    /// The grid of a bed of this height, and the box in it.
    fn layout(&self, height: f64) -> Result<Layout, OverlapError> {
        let cell = self.settings.cell;
        let across = |extent: f64| (extent / cell).round().max(1.0) as usize;
        let filled = across(height);
        let [x, y] = self.size.map(across);
        let cells = Cells {
            counts: [x, y, filled + ROOM],
            low: self.low,
            spacing: [
                self.size[0] / x as f64,
                self.size[1] / y as f64,
                height / filled as f64,
            ],
        };
        let widths = self.widths();
        // From both walls inwards, so that a box in the middle stays in the middle.
        let margins = [0, 1].map(|axis| {
            let [low, high] = self.edges[axis];
            let wall = self.low[axis] + self.size[axis];
            [low - self.low[axis], wall - high]
                .map(|margin| (margin / cells.spacing[axis]).round().max(0.0) as usize)
        });
        let mz = (self.bottom / cells.spacing[2]).round().max(0.0) as usize;
        let zone = Zone::new(
            &cells,
            [margins[0][0], margins[1][0], mz],
            [
                x.saturating_sub(margins[0][1]),
                y.saturating_sub(margins[1][1]),
            ],
        );
        let [x, y] = self.edges.map(|[low, high]| high - low);
        for (axis, key, value) in [(0, "x", x), (1, "y", y), (2, "bottom", self.bottom)] {
            let allowed = "such that a cell of grains is left beyond the overlap";
            let left = zone.inside(axis, filled, widths[1]);
            check(key, value, left >= 1.0, allowed)?;
        }
        let allowed = "such that some continuum is left around the grains";
        let sides = zone.sides.len();
        check("sides", sides as f64, sides > 0, allowed)?;
        Ok(Layout {
            cells,
            zone,
            widths,
            height,
        })
    }

    /// The grid on which the continuum's mass is what the bed has beyond the grains inside the handshake surface.
    fn fitting(&self, grains: &[GrainSample]) -> Result<Layout, OverlapError> {
        let belongs = self.belongs();
        let bed = || grains.iter().filter(|grain| belongs(grain));
        let total: f64 = bed().map(|grain| grain.mass).sum();
        let area = self.size[0] * self.size[1];
        let mut height = total / (self.density() * area);
        let mut layout = self.layout(height)?;
        for _ in 0..ROUNDS {
            let Layout {
                cells,
                zone,
                widths,
                ..
            } = &layout;
            let inside = bed().filter(|g| zone.label(cells, &g.position) > widths[0]);
            let inside: f64 = inside.map(|grain| grain.mass).sum();
            // Of the box within the handshake surface: its part of the area, and where it begins.
            let across = [0, 1].map(|axis| {
                let sides = zone.sides.iter().filter(|s| s.axis == axis).count() as f64;
                let all = (zone.high[axis] - zone.low[axis]) as f64 - sides * widths[0];
                all / cells.counts[axis] as f64
            });
            let part = across[0] * across[1];
            let below = match zone.low[2] {
                0 => 0.0,
                low => (low as f64 + widths[0]) * cells.spacing[2] / height,
            };
            let found = (total - inside) / (self.density() * area * (1.0 - part * (1.0 - below)));
            let settled = (found / height - 1.0).abs() < 1e-12;
            height = found;
            layout = self.layout(height)?;
            if settled {
                break;
            }
        }
        Ok(layout)
    }
}

/// What acts on the grains until the next exchange.
#[derive(Clone, Debug, Default, PartialEq)]
struct Held {
    /// Force of the continuum on each face of the box (N), the area it acts on (m²), and the continuum's velocity
    /// there (m/s).
    traction: Vec<Vector3<f64>>,
    area: Vec<f64>,
    velocity: Vec<Vector3<f64>>,
}

/// Grains in a bowl and the continuum around them. The grains are the caller's: every call needs the same simulation.
pub struct Bowl {
    spec: BowlSpec,
    layout: Layout,
    units: Units,
    faces: Faces,
    /// Weight of the shell on a face of each side from which on it bears what presses on it (kg).
    least: Vec<f64>,
    /// Faces of the handshake surface.
    handshake: Faces,
    flow: SpaceFlow<MuI>,
    /// Mass of the free grains, ball included (kg).
    grain_mass: f64,
    /// Volume of the continuum at the start, in its own unit.
    start_volume: f64,
    /// Mass of grains over each column of cells at the start (kg).
    columns: Vec<f64>,
    sums: Sums,
    view: View,
    held: Held,
    joint: CellJoint<3, 3>,
    /// Momentum of moves of the box that no cell was there to give back yet (N s).
    unborne: Vector3<f64>,
    /// How far grains have moved outwards through each face of the box (m).
    moved: Vec<f64>,
    journey: Journey,
    /// Packings in steady shear, for what has been sheared while it was stored.
    packings: Vec<ShearedCell>,
    /// L of all cells after the last exchange (1/s), of a box that grows.
    gradients: Vec<Matrix3<f64>>,
    account: Account,
    /// Grains times their steps.
    grain_steps: f64,
    sighting: Sighting,
    scratch: exchange::Scratch,
    outside: Outside<3, 5>,
    angular: Option<AngularBook>,
}

impl Bowl {
    /// Cuts a bed at rest: what lies outside the box becomes continuum.
    ///
    /// # Errors
    /// Settings out of range, or a box that leaves no room for grains, overlap or continuum.
    pub fn cut(spec: BowlSpec, simulation: &mut Simulation) -> Result<Self, OverlapError> {
        let mut sighting = Sighting::default();
        sighting.look(simulation);
        let layout = spec.fitting(&sighting.snapshot.grains)?;
        let mut bowl = Self::around(spec, layout, simulation)?;
        bowl.sighting = sighting;
        // Stresses as they are while all grains are still there.
        bowl.sum_up(1.0);
        let sums = &bowl.sums.stress;
        let total = sums.iter().sum::<nalgebra::Matrix3<f64>>();
        let across = 0.5 * (total[(0, 0)] + total[(1, 1)]);
        bowl.view.rest.measure(across, total[(2, 2)]);
        let (cells, zone) = (bowl.layout.cells, bowl.layout.zone.clone());
        let belongs = spec.belongs();
        let bed = bowl.sighting.snapshot.grains.iter().filter(|g| belongs(g));
        bowl.account.mass = bed.map(|grain| grain.mass).sum();
        match spec.growth {
            Some(_) => bowl.put_by(simulation)?,
            None => {
                simulation.remove(|g| belongs(g) && zone.label(&cells, &g.position) < 0.0);
            }
        }
        bowl.sighting.look(simulation);
        bowl.see_grains();
        bowl.columns = bowl.column_masses();
        bowl.grain_mass = free_mass(simulation);
        bowl.account.grains_before = bowl.grain_momentum(simulation);
        bowl.prime()?;
        bowl.agree();
        // What it was primed with is not its state.
        bowl.view
            .look(&bowl.flow, &bowl.layout.cells, &bowl.units, 0.0);
        bowl.lay(simulation)?;
        Ok(bowl)
    }

    fn around(
        spec: BowlSpec,
        layout: Layout,
        simulation: &Simulation,
    ) -> Result<Self, OverlapError> {
        let Layout {
            cells,
            zone,
            widths,
            height,
        } = &layout;
        let units = spec.units(*height);
        let filled = cells.counts[2] - ROOM;
        let fractions = (0..cells.count()).map(|cell| {
            let index = cells.index(cell);
            let is_bed = index[2] < filled && zone.label_of_cell(index) < widths[1];
            f64::from(u8::from(is_bed))
        });
        let flow = continuum::bed(cells, fractions.collect(), &spec.law, &units, &spec.options)?;
        let count = cells.count();
        let zone = zone.clone();
        let mut bowl = Self {
            units,
            grain_mass: 0.0,
            start_volume: flow.volume(),
            flow,
            columns: Vec::new(),
            sums: Sums::nothing(cells),
            view: View {
                rest: RestStress::nothing(layout.cells.count(), spec.settings.rest_strain),
                ..View::default()
            },
            held: Held::default(),
            joint: CellJoint::new(count, count, &spec.settings, simulation),
            unborne: Vector3::zeros(),
            moved: Vec::new(),
            journey: Journey::default(),
            packings: Vec::new(),
            gradients: vec![Matrix3::zeros(); count],
            account: Account::default(),
            grain_steps: 0.0,
            sighting: Sighting::default(),
            scratch: exchange::Scratch::default(),
            outside: Outside::nothing(count),
            angular: None,
            least: Vec::new(),
            faces: Faces::default(),
            handshake: Faces::default(),
            spec,
            layout,
        };
        bowl.take_zone(zone);
        Ok(bowl)
    }

    /// Takes a box for its own: the faces of its sides, on which nothing acts yet.
    fn take_zone(&mut self, zone: Zone) {
        let cells = &self.layout.cells;
        self.faces = Faces::of(cells, &zone);
        let narrowed = zone.narrowed(cells, self.layout.widths[0] as usize);
        self.handshake = Faces::of(cells, &narrowed);
        let shell = self.spec.settings.shell / self.spec.settings.cell;
        let least = |side: &zone::Side| {
            let width = shell * cells.spacing[side.axis];
            LEAST_SHELL * 0.5 * self.spec.density() * width * cells.face_area(side.axis)
        };
        self.least = zone.sides.iter().map(least).collect();
        let faces = self.faces.all.len();
        self.held.traction = vec![Vector3::zeros(); faces];
        self.held.area = vec![0.0; faces];
        self.held.velocity = vec![Vector3::zeros(); faces];
        self.moved = vec![0.0; faces];
        self.layout.zone = zone;
    }

    /// What it was made from.
    pub fn spec(&self) -> &BowlSpec {
        &self.spec
    }

    /// The grid of the continuum.
    pub fn cells(&self) -> &Cells {
        &self.layout.cells
    }

    /// The box of grains.
    pub fn zone(&self) -> &Zone {
        &self.layout.zone
    }

    /// The continuum, in natural units.
    pub fn flow(&self) -> &SpaceFlow<MuI> {
        &self.flow
    }

    /// Height of the continuum at the start (m).
    pub fn height(&self) -> f64 {
        self.layout.height
    }

    /// Fields of the continuum's cells behind the handshake surface (SI).
    pub fn fields(&self) -> Vec<SpaceFields> {
        let cells = &self.layout.cells;
        let mut fields = self.flow.cell_fields();
        for f in &mut fields {
            f.scale(self.layout.height, &self.units);
            for corner in [&mut f.lower, &mut f.upper] {
                for (x, low) in corner.iter_mut().zip(cells.low) {
                    *x += low;
                }
            }
        }
        fields.retain(|f| {
            let middle = Vector3::from_fn(|axis, _| 0.5 * (f.lower[axis] + f.upper[axis]));
            self.layout.zone.label(cells, &middle) < self.layout.widths[0]
        });
        fields
    }

    /// Accounts since the start, with what the grains have been given since the last exchange.
    pub fn account(&self, simulation: &Simulation) -> Account {
        let mut account = self.account;
        let [traction, impedance, relaxation] = self.joint.unbooked(simulation);
        account.traction += traction;
        account.impedance += impedance;
        account.relaxation += relaxation;
        account.weight += self.weight_until_now(simulation);
        account
    }

    /// Books angular momentum of the grains, ball included, from now on, for which [`see_step`](Self::see_step) has to be called before every step
    /// of the grains; what is written does not hold the account.
    ///
    /// # Errors
    /// If the grains refuse the loads, which are laid anew.
    pub fn open_angular_book(&mut self, simulation: &mut Simulation) -> Result<(), OverlapError> {
        self.book_grains(simulation);
        self.angular = Some(AngularBook::open(simulation));
        self.lay(simulation)
    }

    /// Books the step that comes next.
    pub fn see_step(&mut self, simulation: &Simulation) {
        if let Some(book) = &mut self.angular {
            book.see(simulation);
        }
    }

    /// The account of angular momentum, if it is open.
    pub fn angular_book(&self) -> Option<&AngularBook> {
        self.angular.as_ref()
    }

    /// Impulse of the grains' weight that is not booked yet (N s).
    fn weight_until_now(&self, simulation: &Simulation) -> Vector3<f64> {
        simulation.gravity() * self.grain_mass * self.joint.acting(simulation)
    }

    /// K_0 of the bed when it was cut.
    pub fn rest_ratio(&self) -> f64 {
        self.view.rest.ratio
    }

    /// Momentum that the continuum has still to take from the relaxation (N s).
    pub fn owed(&self, simulation: &Simulation) -> Vector3<f64> {
        self.joint.owed(simulation) - self.unborne
    }

    /// What the monitors have seen, with the window that is open.
    pub fn monitors(&self) -> Monitors {
        self.joint.seen()
    }

    /// Grains times their steps.
    pub fn grain_steps(&self) -> f64 {
        self.grain_steps
    }

    /// Farthest that grains have moved through a face of the box in the mean, outwards positive (m).
    pub fn farthest_moved(&self) -> f64 {
        let sizes = self.moved.iter().copied();
        sizes.fold(self.journey.farthest, |most: f64, m| {
            if m.abs() > most.abs() { m } else { most }
        })
    }

    /// Distance between the ball's surface and the handshake surface (m), none without a ball: what comes beyond it
    /// the continuum does not know of.
    pub fn ball_clearance(&self, simulation: &Simulation) -> Option<f64> {
        let Layout {
            cells,
            zone,
            widths,
            ..
        } = &self.layout;
        let ball = self.spec.ball?;
        let ball = simulation.held(|_| true).find(|g| g.id == ball)?;
        let ways = zone.sides.iter().map(|side| {
            let depth = zone.depth(cells, side, &ball.position) - widths[0];
            depth * cells.spacing[side.axis] - ball.radius
        });
        Some(ways.fold(f64::INFINITY, f64::min))
    }

    /// Time between two exchanges (s).
    pub fn exchange_time(&self) -> f64 {
        self.joint.exchange_time()
    }

    /// Exchanges made.
    pub fn exchanges(&self) -> u64 {
        self.joint.exchanges
    }

    /// Whether an exchange has just been made.
    pub fn at_exchange(&self) -> bool {
        self.joint.made == 0
    }

    /// Momentum of the grains, ball included, with what walls have taken (N s).
    pub fn grain_momentum(&self, simulation: &mut Simulation) -> Vector3<f64> {
        simulation.leapfrog_momentum() + simulation.wall_impulse()
    }

    /// Mass of grains over each column of cells (kg).
    fn column_masses(&self) -> Vec<f64> {
        let layer = self.layout.cells.counts[0] * self.layout.cells.counts[1];
        let mut masses = vec![0.0; layer];
        for row in self.sums.cover.chunks_exact(layer) {
            for (mass, cover) in masses.iter_mut().zip(row) {
                *mass += cover.mass;
            }
        }
        masses
    }

    /// Mass of a cell full of continuum (kg).
    fn full(&self) -> f64 {
        self.spec.density() * self.layout.cells.volume()
    }

    /// Mass of the continuum behind the handshake surface (kg).
    pub fn continuum_mass(&self) -> f64 {
        let Layout {
            cells,
            zone,
            widths,
            ..
        } = &self.layout;
        let fractions = self.flow.state().fractions.iter().enumerate();
        let behind =
            fractions.filter(|(cell, _)| zone.label_of_cell(cells.index(*cell)) < widths[0]);
        self.full() * behind.map(|(_, f)| f).sum::<f64>()
    }

    /// Error of the continuum's volume against what it began with and its copy was given since, relative.
    pub fn volume_error(&self) -> f64 {
        (self.flow.volume() - self.start_volume - self.account.copied) / self.start_volume
    }

    /// Mass of grains inside the handshake surface and of continuum outside it over that of the bed, less 1.
    pub fn mass_error(&self, simulation: &Simulation) -> f64 {
        let Layout {
            cells,
            zone,
            widths,
            ..
        } = &self.layout;
        let ball = self.spec.ball;
        let mut masses: Vec<(u32, f64)> = simulation
            .held(|at| zone.label(cells, at) > widths[0])
            .filter(|g| !g.fixed && Some(g.id) != ball)
            .map(|g| (g.id, g.mass))
            .collect();
        masses.sort_unstable_by_key(|m| m.0);
        let grains: f64 = masses.iter().map(|m| m.1).sum();
        (grains + self.continuum_mass()) / self.account.mass - 1.0
    }

    /// ρ U L³ (N s).
    fn impulse_unit(&self) -> f64 {
        self.units.density * self.units.velocity * self.units.length.powi(3)
    }
}
