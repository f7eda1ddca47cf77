//! All of a bowl as numbers: what a run goes on from with the same bits.
//!
//! In front stands what every load changes, of a length that does not; behind it what an exchange changes, in rows
//! with their lengths before them.

use super::account::{self, Account, Monitors};
use super::cells::Cells;
use super::journey::Journey;
use super::zone::Zone;
use super::{Bowl, BowlSpec, Layout, OverlapError};
use crate::overlap::joint::{flat, vectors};
use crate::overlap::sighting::free_mass;
use crate::overlap::state_rows;
use colluvium_continuum::free_surface::SpaceState;
use colluvium_dem::Simulation;
use nalgebra::{Matrix3, Vector3};

/// Numbers in front but for the four rows of forces and moments by cell, the account among them.
const FRONT: usize = 4 + 12 + 6 + account::NUMBERS;

impl Bowl {
    /// What every load changes.
    fn front(&self) -> Vec<f64> {
        let cells = self.layout.cells.count();
        let mut front = Vec::with_capacity(FRONT + 12 * cells);
        front.extend([
            cells as f64,
            self.joint.made as f64,
            self.joint.laid_at as f64,
            self.monitors.grain_steps,
        ]);
        let all = [&self.joint.laid, &self.joint.given];
        for given in all {
            front.extend(flat(&[given.traction, given.impedance]));
        }
        front.extend(self.monitors.work);
        front.extend(self.joint.laid.powers);
        front.extend(self.account.numbers());
        for given in all {
            front.extend(flat(&given.relaxation));
            front.extend(flat(&given.spin));
        }
        front
    }

    /// Writes what has changed since an exchange over what [`write`](Self::write) wrote after it.
    pub fn write_over(&self, memory: &mut [f64]) {
        let front = self.front();
        memory[..front.len()].copy_from_slice(&front);
    }

    /// Appends all there is; to be called after every exchange.
    pub fn write(&self, memory: &mut Vec<f64>) {
        memory.extend(self.front());
        let mut put = |row: &[f64]| {
            memory.push(row.len() as f64);
            memory.extend(row);
        };
        put(&[self.joint.exchanges as f64, self.layout.height]);
        put(&self.monitors.numbers());
        put(&self.joint.windows.numbers());
        put(&self.columns);
        put(&self.moved);
        put(&[self.view.rest.ratio]);
        put(self.view.rest.strain.as_flattened());
        let stress = self
            .sums
            .stress
            .iter()
            .flat_map(|s| [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)].map(|at| s[at]));
        put(&stress.collect::<Vec<f64>>());
        for row in [
            &self.joint.accelerations,
            &self.joint.spins,
            &self.held.traction,
            &self.held.velocity,
            &self.joint.owed,
        ] {
            put(&flat(row).collect::<Vec<f64>>());
        }
        put(&self.held.area);
        self.journey.write(&mut put);
        put(&self.layout.zone.corners());
        put(&[self.start_volume]);
        put(self.unborne.as_slice());
        state_rows::write(self.flow.state(), &mut put);
    }

    /// Goes on from what was written of a bowl with the same specification; the simulation is the one that was
    /// joined, resumed itself.
    ///
    /// # Errors
    /// If the numbers do not belong to this specification.
    pub fn read(
        spec: BowlSpec,
        memory: &[f64],
        simulation: &Simulation,
    ) -> Result<Self, OverlapError> {
        let missing = || OverlapError::Record("the bowl's memory misses a part".into());
        let rows = Rows::of(memory).ok_or_else(missing)?;
        let mut bowl = Self::around(spec, spec.layout(rows.height)?, simulation)?;
        let zone = rows.zone(&bowl.layout.cells).ok_or_else(missing)?;
        bowl.layout.has_room_for(&zone)?;
        bowl.take_zone(zone);
        if !rows.fit(&bowl) {
            return Err(missing());
        }
        bowl.grain_mass = free_mass(simulation);
        rows.fill(&mut bowl)?;
        bowl.view
            .look(&bowl.flow, &bowl.layout.cells, &bowl.units, 0.0);
        Ok(bowl)
    }
}

impl Layout {
    /// Whether such a box has a cell of grains beyond its overlap.
    fn has_room_for(&self, zone: &Zone) -> Result<(), OverlapError> {
        let filled = self.cells.counts[2] - super::ROOM;
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
            let left = zone.inside(axis, filled, self.widths[1]);
            if left < 1.0 {
                return Err(OverlapError::Record(format!(
                    "the bowl's memory has a box with {left} cells along {name} beyond its overlap; at least 1 is needed"
                )));
            }
        }
        Ok(())
    }
}

/// What was written, by name.
struct Rows<'a> {
    cells: usize,
    /// Scalars in front, and forces by cell.
    front: [&'a [f64]; 2],
    exchanges: f64,
    height: f64,
    monitors: [f64; account::MONITORED],
    window: &'a [f64],
    columns: &'a [f64],
    moved: &'a [f64],
    ratio: f64,
    strain: &'a [f64],
    stress: &'a [f64],
    accelerations: &'a [f64],
    spins: &'a [f64],
    traction: &'a [f64],
    velocity: &'a [f64],
    owed: &'a [f64],
    area: &'a [f64],
    journey: Journey,
    corners: [f64; 5],
    start_volume: f64,
    unborne: Vector3<f64>,
    state: SpaceState,
}

impl<'a> Rows<'a> {
    /// Of a memory; nothing if a row is missing or too short.
    fn of(memory: &'a [f64]) -> Option<Self> {
        let cells = *memory.first()? as usize;
        let (front, mut rest) = memory.split_at_checked(FRONT + 12 * cells)?;
        let mut take = || {
            let (length, after) = rest.split_first()?;
            let (row, after) = after.split_at_checked(*length as usize)?;
            rest = after;
            Some(row)
        };
        let &[exchanges, height] = take()? else {
            return None;
        };
        // In the order of `write`.
        Some(Self {
            cells,
            front: front.split_at(FRONT).into(),
            exchanges,
            height,
            monitors: take()?.try_into().ok()?,
            window: take()?,
            columns: take()?,
            moved: take()?,
            ratio: *take()?.first()?,
            strain: take()?,
            stress: take()?,
            accelerations: take()?,
            spins: take()?,
            traction: take()?,
            velocity: take()?,
            owed: take()?,
            area: take()?,
            journey: Journey::read(&mut take)?,
            corners: take()?.try_into().ok()?,
            start_volume: *take()?.first()?,
            unborne: *vectors(take()?).first()?,
            state: state_rows::read(&mut take)?,
        })
    }

    /// The box, if it lies in the grid.
    fn zone(&self, cells: &Cells) -> Option<Zone> {
        let [low_x, low_y, low_z, x, y] = self.corners.map(|n| n as usize);
        let counts = cells.counts;
        let lies_inside =
            low_x < x && x <= counts[0] && low_y < y && y <= counts[1] && low_z < counts[2];
        lies_inside.then(|| Zone::new(cells, [low_x, low_y, low_z], [x, y]))
    }

    /// Whether the rows are as long as this bowl's.
    fn fit(&self, bowl: &Bowl) -> bool {
        let grid = &bowl.layout.cells;
        let (cells, faces) = (grid.count(), bowl.faces.all.len());
        self.cells == cells
            && self.columns.len() == grid.counts[0] * grid.counts[1]
            && self.strain.len() == 5 * cells
            && self.stress.len() == 6 * cells
            && self.accelerations.len() == 3 * cells
            && self.spins.len() == 3 * cells
            && self.owed.len() == 3 * cells
            && self.traction.len() == 3 * faces
            && self.velocity.len() == 3 * faces
            && [self.moved, self.area].map(<[f64]>::len) == [faces; 2]
    }

    /// Makes the bowl what it was.
    fn fill(self, bowl: &mut Bowl) -> Result<(), OverlapError> {
        let [scalars, forces] = self.front;
        bowl.journey = self.journey;
        bowl.start_volume = self.start_volume;
        bowl.unborne = self.unborne;
        bowl.columns = self.columns.to_vec();
        bowl.moved = self.moved.to_vec();
        bowl.view.rest.ratio = self.ratio;
        bowl.view.rest.strain = self.strain.as_chunks::<5>().0.to_vec();
        let stresses = self.stress.as_chunks::<6>().0.iter();
        bowl.sums.stress = stresses
            .map(|&[xx, yy, zz, xy, xz, yz]| Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz))
            .collect();
        bowl.joint.accelerations = vectors(self.accelerations);
        bowl.joint.spins = vectors(self.spins);
        bowl.held.traction = vectors(self.traction);
        bowl.held.velocity = vectors(self.velocity);
        bowl.held.area = self.area.to_vec();
        bowl.joint.owed = vectors(self.owed);
        bowl.monitors = Monitors::of(&self.monitors);
        let unfit = || OverlapError::Record("the bowl's window of monitors does not fit".into());
        bowl.joint.windows.take_up(self.window).ok_or_else(unfit)?;
        bowl.monitors.grain_steps = scalars[3];
        bowl.monitors.work = [scalars[16], scalars[17], scalars[18]];
        bowl.joint.laid.powers = [scalars[19], scalars[20], scalars[21]];
        bowl.joint.exchanges = self.exchanges as u64;
        bowl.joint.made = scalars[1] as u64;
        bowl.joint.laid_at = scalars[2] as u64;
        for (k, given) in [&mut bowl.joint.laid, &mut bowl.joint.given]
            .into_iter()
            .enumerate()
        {
            let pair = vectors(&scalars[4 + 6 * k..10 + 6 * k]);
            (given.traction, given.impedance) = (pair[0], pair[1]);
            let row = |n: usize| &forces[3 * self.cells * n..3 * self.cells * (n + 1)];
            given.relaxation = vectors(row(2 * k));
            given.spin = vectors(row(2 * k + 1));
        }
        let mut account = [0.0; account::NUMBERS];
        account.copy_from_slice(&scalars[22..]);
        bowl.account = Account::of(&account);
        bowl.flow.set_state(self.state)?;
        Ok(())
    }
}
