//! A column of grains and a plane continuum behind it, joined at an edge that moves with the material; or grains between two
//! continua, joined to each at an edge of its own ([`GrainZone`]).
//!
//! An edge knows one axis, out of its continuum into the grains ([`Side`]), here x.
//! At the start the edge is the vertical plane x = x_b. Grains lie beyond it; the continuum reaches from the wall at
//! x = 0 to x_a, inside the grains. Each grain keeps the label ξ = x − x_b that it had at the start while it stays
//! among its neighbours: labels say where in the overlap it is, however the material has deformed, and nothing ever crosses
//! the edge. From the edge into the
//! grains: *shell* ξ < b, *buffer* ξ < ξ_m, *inner overlap* ξ_m < ξ < ξ_a; totals count grains in front of the surface to
//! which those of ξ = ξ_m have moved, the *handshake surface*, and the continuum behind it. What is exchanged is what a flat edge exchanges (see [`super`]), cell by cell:
//!
//! - *on the continuum*: its surface inside the grains bears their mean pressure, and from ξ_m to ξ_a its deviatoric
//!   stress is w σ_grains + (1 − w) σ_continuum, w = (ξ̄ − ξ_m)/(ξ_a − ξ_m) from the mean label ξ̄ of a cell's grains
//!   ([`Outside`]); beyond ξ_m it is a copy of the grains, made anew at every exchange (`copy.rs`);
//! - *on the grains*: the shell bears the continuum's traction row by row, with an impedance in its normal part
//!   (`rows.rs`);
//! - *on both, equal and opposite*: mean velocities of the buffer relax to each other, along x and z, mean spins to
//!   half of the curl, for which the continuum has forces about the cell; and grains that have come out of the edge are carried by the continuum that they lie in (`embedded.rs`).
//!
//! Grains that have left their neighbours get labels anew (`labels.rs`).
//!
//! The continuum is what is missing of the column's mass, at the solid fraction of its grains. The continuum remembers how its grains pressed sideways at rest (`rest_stress.rs`), without which it pushes those of the
//! overlap by 30 to 50 % too much; `witness.rs` is the force that they bear without a joint. What lies far behind the edge and never moves need not be computed: the continuum may begin at a smooth
//! wall x = x_w, behind which material *rests* as it stood.

mod account;
mod cells;
mod continuum;
mod copy;
mod embedded;
mod exchange;
mod floor;
mod labels;
mod layout;
mod memory;
mod oracle;
#[cfg(test)]
mod rotation;
mod rows;
mod side;
mod start;
mod totals;
mod travel;
mod view;
mod watch;
mod witness;
mod zone;

pub use super::cell_monitors::CellMonitors as Monitors;
pub use account::Account;
pub use cells::Cells;
pub use continuum::Continuum;
pub use floor::LEVEL;
pub use side::Side;
pub use travel::{Move, Travel};
pub use witness::{Through, Witness};
pub use zone::GrainZone;

use super::OverlapError;
use super::cell_joint::CellJoint;
use super::rest_stress::RestStress;
use super::settings::Resolved;
use super::sighting::{Sighting, free_grains};
use cells::Sums;
use colluvium_continuum::column_collapse::CollapseCase;
use colluvium_continuum::free_surface::{Outside, SurfaceOptions};
use colluvium_dem::{GrainSample, Simulation};
use labels::{Labels, NO_LABEL};
use rows::Row;
use travel::Journey;
use view::View;

/// Exchanges longer by no more than this factor than the continuum's largest step are one step, not two halves.
const NEARLY: f64 = 1.1;
/// Fewest cells of continuum behind the edge.
const LEAST_CELLS: f64 = 3.0;

/// What a column is joined from at one edge (SI). Places are on the edge's own axis, from the same origin as x
/// ([`Side::along`]).
#[derive(Clone, Copy, Debug)]
pub struct MaterialEdgeSpec {
    /// The whole column as a continuum, at the solid fraction of its grains.
    pub case: CollapseCase,
    /// Settings of the continuum's solver.
    pub options: SurfaceOptions,
    /// Where its continuum lies.
    pub side: Side,
    /// Where the edge is at the start, x_b (m).
    pub place: f64,
    /// Where the grid of the continuum begins, x_w, at a smooth wall (m); what lies behind rests.
    pub wall: f64,
    /// Where the column begins at the start (m): x_w, or farther on, with a face that is free.
    pub back: f64,
    /// Width of the slab across (m).
    pub slab: f64,
    /// Widths, times and the impedance.
    pub settings: Resolved,
    /// When the edge moves on to other material, if it does.
    pub travel: Option<Travel>,
}

impl MaterialEdgeSpec {
    /// Labels at which the buffer and the inner overlap end, ξ_m and ξ_a (m).
    pub fn zones(&self) -> [f64; 2] {
        let s = &self.settings;
        [s.buffer, s.buffer + s.inner]
    }

    /// Density of the continuum (kg/m³).
    pub fn density(&self) -> f64 {
        self.case.rheology.bulk_density()
    }

    /// tan of the angle by which the face of its continuum leans out, away from the grains.
    fn lean(&self) -> f64 {
        self.case.overhang_degrees.to_radians().tan()
    }

    /// Spacing of the grid (m).
    pub fn spacing(&self) -> f64 {
        self.case.length_scaled * self.case.height / self.case.cells as f64
    }

    /// The column of the continuum that has a mass (kg), from where it begins, or the foot of a face that leans out, to x_a.
    fn column(&self, mass: f64) -> CollapseCase {
        let width = self.place + self.zones()[1] - self.back;
        let area = mass / (self.density() * self.slab);
        let height = match self.lean() {
            0.0 => mass / (self.density() * self.slab * width),
            // Of width h + lean h^2/2 = area, without a difference of near numbers.
            lean => 2.0 * area / (width + (width * width + 2.0 * lean * area).sqrt()),
        };
        let spared = (self.wall / self.spacing()).floor().max(0.0) as usize;
        let cells = self.case.cells.saturating_sub(spared).max(1);
        CollapseCase {
            aspect: height / width,
            height,
            cells,
            length_scaled: self.spacing() * cells as f64 / height,
            overhang_degrees: 0.0,
            ..self.case
        }
    }
}

/// What acts on the grains until the next exchange.
#[derive(Clone, Debug, Default, PartialEq)]
struct Held {
    rows: Vec<Row>,
    /// No grain of the buffer lies farther than this (m).
    reach: f64,
    /// Where the handshake surface is, row by row (m).
    handshake: Vec<f64>,
}

/// Grains and continuum joined at an edge that moves with them: one of a [`GrainZone`]'s. All along its own axis but for what is
/// said otherwise. The grains are the caller's: every call needs the same simulation.
pub struct MaterialEdge {
    spec: MaterialEdgeSpec,
    /// The continuum's grid.
    cells: Cells,
    /// Between which places its grains lie at the start (m).
    ours: [f64; 2],
    /// From which place on the ground below them is level (m).
    level: f64,
    labels: Labels,
    journey: Journey,
    sums: Sums,
    view: View,
    held: Held,
    joint: CellJoint<2, 1>,
    account: Account,
    /// Σ over exchanges of the grains' mass in the full cells of the overlap, over that of the continuum in them.
    packed: f64,
    /// Labels renewed.
    renewed: f64,
    sighting: Sighting,
    scratch: exchange::Scratch,
    outside: Outside,
}

impl MaterialEdge {
    /// Gives its grains their labels, those too that become its continuum and are still there.
    fn mark(
        spec: MaterialEdgeSpec,
        ours: [f64; 2],
        continuum: &Continuum,
        sighting: Sighting,
        simulation: &Simulation,
    ) -> Self {
        let free = || sighting.snapshot.grains.iter().filter(|g| !g.fixed);
        let last = free().map(|g| g.id).max().unwrap_or(0) as usize;
        let mut labels = vec![NO_LABEL; last + 1];
        let [from, to] = ours;
        for grain in free().filter(|g| (from..=to).contains(&g.position.x)) {
            labels[grain.id as usize] = grain.position.x - spec.place;
        }
        let mut edge = Self::around(spec, ours, continuum, labels, simulation);
        edge.sighting = sighting;
        // Stresses as they are while all grains are still there.
        edge.sum_up(1.0);
        edge.remember_rest();
        edge
    }

    /// Takes the grains behind the edge away.
    fn cut_off(&mut self, simulation: &mut Simulation) {
        if let Some(travel) = self.spec.travel {
            self.put_by(&travel, simulation);
        }
        let (side, place) = (self.spec.side, self.spec.place);
        let floor = place - self.spec.settings.inner;
        let begins = self.ours[0];
        simulation.remove(|g| {
            let at = side.along(g.position.x);
            at >= begins && at < if g.fixed { floor } else { place }
        });
    }

    /// Looks at the grains as they are now, along its own axis.
    fn look(&mut self, simulation: &mut Simulation) {
        self.sighting.look_along(self.spec.side, simulation);
    }

    fn around(
        spec: MaterialEdgeSpec,
        ours: [f64; 2],
        continuum: &Continuum,
        labels: Vec<f64>,
        simulation: &Simulation,
    ) -> Self {
        let cells = continuum.cells_along(spec.side);
        Self {
            cells,
            ours,
            level: continuum.level,
            labels: Labels {
                given: labels,
                base: vec![spec.place; cells.counts[1]],
                edge: 0.0,
            },
            journey: Journey::default(),
            sums: Sums::nothing(&cells),
            view: View {
                rest: RestStress {
                    active: (1.0 - spec.case.rheology.mu_s).max(0.0)
                        / (1.0 + spec.case.rheology.mu_s),
                    ..RestStress::nothing(cells.count(), spec.settings.rest_strain)
                },
                ..View::default()
            },
            held: Held {
                rows: vec![Row::default(); cells.counts[1]],
                reach: 0.0,
                handshake: vec![spec.place + spec.settings.buffer; cells.counts[1]],
            },
            joint: CellJoint::new(cells.count(), cells.counts[1], &spec.settings, simulation),
            account: Account::default(),
            packed: 0.0,
            renewed: 0.0,
            sighting: Sighting::default(),
            scratch: exchange::Scratch::default(),
            outside: Outside::nothing(cells.count()),
            spec,
        }
    }

    /// Takes K_0 from the stresses of the grains that become continuum or overlap.
    fn remember_rest(&mut self) {
        let end = self.spec.place + self.spec.zones()[1];
        let columns = self.cells.counts[0];
        let cells = self.sums.stress.iter().enumerate();
        let behind = cells.filter(|(cell, _)| {
            let centre = self.cells.centre(cell % columns);
            centre > self.spec.back && centre < end
        });
        let [across, down] = behind.fold([0.0; 2], |sum, (_, s)| [sum[0] + s[0], sum[1] + s[1]]);
        self.view.rest.measure(across, down);
    }

    /// Ratio of sideways to vertical stress that the continuum remembers, K_0; 1 where it remembers nothing.
    pub fn rest_ratio(&self) -> f64 {
        match self.spec.settings.rest_strain > 0.0 {
            true => self.view.rest.ratio,
            false => 1.0,
        }
    }

    /// Label of a free grain from that of the edge (m); none of what has none.
    pub fn label(&self, grain: &GrainSample) -> Option<f64> {
        self.labels.of(grain)
    }

    /// Whether a grain (along x) lies in front of the handshake surface; none of one that is not its own.
    fn is_in_front(&self, grain: &GrainSample) -> Option<bool> {
        let grain = self.spec.side.grain(*grain);
        self.label(&grain)
            .map(|_| witness::is_before(&grain, &self.cells, &self.held.handshake))
    }

    /// What it was made from.
    pub fn spec(&self) -> &MaterialEdgeSpec {
        &self.spec
    }

    /// Its share of the accounts since the start, with what the grains have been given since the last exchange.
    fn account(&self, simulation: &Simulation) -> Account {
        let mut account = self.account;
        let [traction, impedance, relaxation] = self.joint.unbooked(simulation);
        account.traction += traction;
        account.impedance += impedance;
        account.relaxation += relaxation;
        account
    }

    /// Momentum that the continuum has still to take from the relaxation (N s).
    pub fn owed(&self, simulation: &Simulation) -> [f64; 2] {
        self.joint.owed(simulation).into()
    }

    /// What the monitors have seen, with the window that is open.
    pub fn monitors(&self) -> Monitors {
        self.joint.seen()
    }

    /// Mass of the grains in the overlap over that of the continuum there.
    pub fn packing_ratio(&self) -> f64 {
        self.packed / self.joint.monitors.exchanges.max(1.0)
    }

    /// Labels renewed.
    pub fn renewed(&self) -> f64 {
        self.renewed
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

    /// Momentum of the free grains as they are held, without what walls have taken: the same bits after a restart (N s).
    fn held_momentum(&self, simulation: &Simulation) -> [f64; 2] {
        let grains = free_grains(simulation);
        let momenta = grains.iter().map(|g| g.mass * g.velocity);
        let sum = momenta.fold(nalgebra::Vector3::zeros(), |sum, p| sum + p);
        self.spec.side.in_plane([sum.x, sum.z])
    }

    /// Where the handshake surface is, row by row from z = 0 on (m): where grains of nearby labels have moved to.
    pub fn handshake(&self) -> &[f64] {
        &self.held.handshake[self.cells.below..]
    }
}
