//! All of a bowl as numbers: what a run goes on from with the same bits.
//!
//! In front stands what every load changes, of a length that does not; behind it what an exchange changes, in rows
//! with their lengths before them.

use super::account::{self, Account, Monitors};
use super::journey::Journey;
use super::zone::Zone;
use super::{Bowl, BowlSpec, OverlapError, continuum};
use crate::overlap::sighting::free_mass;
use colluvium_dem::Simulation;
use nalgebra::{Matrix3, Vector3};

/// Numbers in front but for the two rows of forces by cell, the account among them.
const FRONT: usize = 4 + 12 + account::NUMBERS;

/// Vectors one behind the other.
fn flat(rows: &[Vector3<f64>]) -> impl Iterator<Item = f64> {
    rows.iter().flat_map(|row| [row.x, row.y, row.z])
}

fn vectors(numbers: &[f64]) -> Vec<Vector3<f64>> {
    let rows = numbers.as_chunks::<3>().0;
    rows.iter().map(|row| Vector3::from(*row)).collect()
}

impl Bowl {
    /// What every load changes.
    fn front(&self) -> Vec<f64> {
        let cells = self.layout.cells.count();
        let mut front = Vec::with_capacity(FRONT + 6 * cells);
        front.extend([
            cells as f64,
            self.made as f64,
            self.laid_at as f64,
            self.monitors.grain_steps,
        ]);
        for given in [&self.laid, &self.given] {
            front.extend(flat(&[given.traction, given.impedance]));
        }
        front.extend(self.account.numbers());
        front.extend(flat(&self.laid.relaxation));
        front.extend(flat(&self.given.relaxation));
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
        put(&[self.exchanges as f64, self.layout.height]);
        put(&self.monitors.numbers());
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
            &self.held.accelerations,
            &self.held.traction,
            &self.held.velocity,
            &self.owed,
        ] {
            put(&flat(row).collect::<Vec<f64>>());
        }
        put(&self.held.area);
        self.journey.write(&mut put);
        put(&self.layout.zone.corners());
        put(&[self.start_volume]);
        put(self.unborne.as_slice());
        continuum::write(self.flow.state(), &mut put);
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
        Self::read_back(spec, memory, simulation)?
            .ok_or_else(|| OverlapError::Record("the bowl's memory misses a part".into()))
    }

    fn read_back(
        spec: BowlSpec,
        memory: &[f64],
        simulation: &Simulation,
    ) -> Result<Option<Self>, OverlapError> {
        let cells = memory.first().map_or(0, |cells| *cells as usize);
        let Some((front, mut rest)) = memory.split_at_checked(FRONT + 6 * cells) else {
            return Ok(None);
        };
        let mut take = || {
            let (length, after) = rest.split_first()?;
            let (row, after) = after.split_at_checked(*length as usize)?;
            rest = after;
            Some(row)
        };
        let Some(&[exchanges, height]) = take() else {
            return Ok(None);
        };
        let Some(monitors) = take().and_then(|row| row.try_into().ok()) else {
            return Ok(None);
        };
        let rows = (|| {
            let row = [take()?, take()?, take()?, take()?, take()?, take()?];
            Some((row, [take()?, take()?, take()?, take()?]))
        })();
        let Some((
            [columns, moved, ratio, strain, stress, accelerations],
            [traction, velocity, owed, area],
        )) = rows
        else {
            return Ok(None);
        };
        let Some(journey) = Journey::read(&mut take) else {
            return Ok(None);
        };
        let (Some(&[x, y, z, high_x, high_y]), Some(&[start_volume]), Some(&[u, v, w])) =
            (take(), take(), take())
        else {
            return Ok(None);
        };
        let Some(state) = continuum::read(&mut take) else {
            return Ok(None);
        };
        let mut bowl = Self::around(spec, spec.layout(height)?, simulation)?;
        let [low_x, low_y, low_z, high_x, high_y] = [x, y, z, high_x, high_y].map(|n| n as usize);
        let grid = bowl.layout.cells.counts;
        if high_x > grid[0]
            || high_y > grid[1]
            || low_x >= high_x
            || low_y >= high_y
            || low_z >= grid[2]
        {
            return Ok(None);
        }
        let cells = bowl.layout.cells;
        let zone = Zone::new(&cells, [low_x, low_y, low_z], [high_x, high_y]);
        let filled = cells.counts[2] - super::ROOM;
        let left = |axis: usize| zone.inside(axis, filled, bowl.layout.widths[1]);
        if let Some(axis) = (0..3).find(|axis| left(*axis) < 1.0) {
            let name = ["x", "y", "z"][axis];
            return Err(OverlapError::Record(format!(
                "the bowl's memory has a box with {} cells along {name} beyond its overlap; at least 1 is needed",
                left(axis)
            )));
        }
        bowl.take_zone(zone);
        bowl.journey = journey;
        bowl.start_volume = start_volume;
        bowl.unborne = Vector3::new(u, v, w);
        let cells = cells.count();
        let (layer, faces) = (
            bowl.layout.cells.counts[0] * bowl.layout.cells.counts[1],
            bowl.faces.all.len(),
        );
        let fits = memory[0] as usize == cells
            && columns.len() == layer
            && moved.len() == faces
            && ratio.len() == 1
            && strain.len() == 5 * cells
            && stress.len() == 6 * cells
            && accelerations.len() == 3 * cells
            && owed.len() == 3 * cells
            && traction.len() == 3 * faces
            && velocity.len() == 3 * faces
            && area.len() == faces;
        let (scalars, forces) = front.split_at(FRONT);
        let Ok(account) = scalars[16..].try_into() else {
            return Ok(None);
        };
        if !fits {
            return Ok(None);
        }
        bowl.grain_mass = free_mass(simulation);
        bowl.columns = columns.to_vec();
        bowl.moved = moved.to_vec();
        bowl.view.rest.ratio = ratio[0];
        bowl.view.rest.strain = strain.as_chunks::<5>().0.to_vec();
        let stresses = stress.as_chunks::<6>().0.iter();
        bowl.sums.stress = stresses
            .map(|&[xx, yy, zz, xy, xz, yz]| Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz))
            .collect();
        bowl.held.accelerations = vectors(accelerations);
        bowl.held.traction = vectors(traction);
        bowl.held.velocity = vectors(velocity);
        bowl.held.area = area.to_vec();
        bowl.owed = vectors(owed);
        bowl.monitors = Monitors::of(monitors);
        bowl.monitors.grain_steps = scalars[3];
        bowl.exchanges = exchanges as u64;
        bowl.made = scalars[1] as u64;
        bowl.laid_at = scalars[2] as u64;
        for (k, given) in [&mut bowl.laid, &mut bowl.given].into_iter().enumerate() {
            let pair = vectors(&scalars[4 + 6 * k..10 + 6 * k]);
            (given.traction, given.impedance) = (pair[0], pair[1]);
            given.relaxation = vectors(&forces[3 * cells * k..3 * cells * (k + 1)]);
        }
        bowl.account = Account::of(account);
        bowl.flow.set_state(state)?;
        bowl.view
            .look(&bowl.flow, &bowl.layout.cells, &bowl.units, 0.0);
        Ok(Some(bowl))
    }
}
