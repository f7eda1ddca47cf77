//! All of a bowl as numbers: what a run goes on from with the same bits.
//!
//! In front stands what every load changes, of a length that does not; behind it what an exchange changes, in rows
//! with their lengths before them.

use super::account::{self, Account};
use super::cells::Cells;
use super::journey::Journey;
use super::zone::Zone;
use super::{Bowl, BowlSpec, Layout, OverlapError};
use crate::overlap::cell_joint::CellJoint;
use crate::overlap::cell_memory;
use crate::overlap::joint::{flat, vectors};
use crate::overlap::sighting::free_mass;
use crate::overlap::state_rows;
use colluvium_continuum::free_surface::SpaceState;
use colluvium_dem::Simulation;
use nalgebra::{Matrix3, Vector3};

/// What a memory that does not fit is told.
const MISSING: &str = "the bowl's memory misses a part";
/// Numbers in front that are not the joint's: steps of grains, and the account.
const MORE: usize = 1 + account::NUMBERS;

impl Bowl {
    /// What every load changes.
    fn front(&self) -> Vec<f64> {
        let mut more = [self.grain_steps; MORE];
        more[1..].copy_from_slice(&self.account.numbers());
        self.joint.front(&more)
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
        put(&[self.layout.height]);
        self.joint.write(&mut put);
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
        for row in [&self.held.traction, &self.held.velocity] {
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
        let missing = || OverlapError::Record(MISSING.into());
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
    front: &'a [f64],
    height: f64,
    joint: cell_memory::Rows<'a>,
    columns: &'a [f64],
    moved: &'a [f64],
    ratio: f64,
    strain: &'a [f64],
    stress: &'a [f64],
    traction: &'a [f64],
    velocity: &'a [f64],
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
        let (front, mut rest) = CellJoint::<3, 3>::split(memory, MORE)?;
        let mut take = || {
            let (length, after) = rest.split_first()?;
            let (row, after) = after.split_at_checked(*length as usize)?;
            rest = after;
            Some(row)
        };
        let &[height] = take()? else {
            return None;
        };
        // In the order of `write`.
        Some(Self {
            front,
            height,
            joint: CellJoint::<3, 3>::rows(&mut take)?,
            columns: take()?,
            moved: take()?,
            ratio: *take()?.first()?,
            strain: take()?,
            stress: take()?,
            traction: take()?,
            velocity: take()?,
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
        self.columns.len() == grid.counts[0] * grid.counts[1]
            && self.strain.len() == 5 * cells
            && self.stress.len() == 6 * cells
            && self.traction.len() == 3 * faces
            && self.velocity.len() == 3 * faces
            && [self.moved, self.area].map(<[f64]>::len) == [faces; 2]
    }

    /// Makes the bowl what it was.
    fn fill(self, bowl: &mut Bowl) -> Result<(), OverlapError> {
        let missing = || OverlapError::Record(MISSING.into());
        let more = bowl.joint.fill(self.front, MORE, self.joint);
        let (steps, account) = more.and_then(<[f64]>::split_first).ok_or_else(missing)?;
        bowl.grain_steps = *steps;
        bowl.account = Account::of(account.try_into().map_err(|_| missing())?);
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
        bowl.held.traction = vectors(self.traction);
        bowl.held.velocity = vectors(self.velocity);
        bowl.held.area = self.area.to_vec();
        bowl.flow.set_state(self.state)?;
        Ok(())
    }
}
