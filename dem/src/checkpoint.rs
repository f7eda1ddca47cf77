//! Checkpoints: a simulation taken apart into arrays and put together again, bit for bit.
//!
//! The Verlet list is part of the state: its order decides the order of sums, and its age when it is
//! built again. The shorter list of pairs within reach is not: it changes no bits. Only contacts that
//! touch have a history.

use crate::contact::{COEFFICIENTS, HISTORY_MAX};
use crate::grains::Grains;
use crate::grid::Grid;
use crate::ledger::EnergyLedger;
use crate::neighbours::{Level, Row};
use crate::record::Record;
use crate::setup::{Setup, SetupError};
use crate::simulation::Simulation;
use crate::walls::{Course, Span, Standing, WallContact, WallImpulse};
use nalgebra::Vector3;

fn flatten<const N: usize>(rows: &[[f64; N]]) -> Vec<f64> {
    rows.iter().flatten().copied().collect()
}

fn rows<const N: usize>(flat: &[f64]) -> Vec<[f64; N]> {
    flat.as_chunks::<N>().0.to_vec()
}

fn wide(small: &[u32]) -> Vec<u64> {
    small.iter().map(|&x| u64::from(x)).collect()
}

fn narrow(name: &str, wide: &[u64]) -> Result<Vec<u32>, String> {
    wide.iter()
        .map(|&x| u32::try_from(x).map_err(|_| format!("array `{name}` has the number {x}")))
        .collect()
}

/// The real numbers called `name`, of which there must be `len`.
fn sized<'a>(record: &'a Record, name: &str, len: usize) -> Result<&'a [f64], String> {
    let values = record.numbers(name)?;
    if values.iter().any(|x| x.is_nan()) {
        return Err(format!("array `{name}` holds what is not a number"));
    }
    if values.len() == len {
        return Ok(values);
    }
    let found = values.len();
    Err(format!(
        "array `{name}` has {found} numbers, expected {len}"
    ))
}

impl Simulation {
    /// The whole state. Going on from it gives the same bits as going on without it.
    pub fn checkpoint(&mut self) -> Record {
        self.forget_observation();
        self.fold_impulses();
        let n = self.grains.len();
        let mut record = Record::default();
        let mut numbers = |name: &str, values: Vec<f64>| {
            record.numbers.insert(name.into(), values);
        };
        numbers("grains/place", flatten(&self.grains.place[..n]));
        numbers("grains/motion", flatten(&self.grains.motion[..n]));
        numbers("grains/turn", flatten(&self.grains.turn[..n]));
        numbers("grains/mass", self.grains.mass.clone());
        let (mut pairs, mut springs) = (Vec::new(), Vec::new());
        self.reach.touching(self.layout.history, |i, j, history| {
            pairs.extend([u64::from(i), u64::from(j)]);
            springs.extend_from_slice(history);
        });
        numbers("contacts/history", springs);
        let drifts: Vec<_> = self.list.rows.iter().map(|r| r.drift).collect();
        numbers("list/row_drift", flatten(&drifts));
        numbers("list/travel", self.list.travel.clone());
        let levels = self.list.levels.iter();
        let axes = |grid: &Grid| [grid.along, grid.across[1]].map(|axis| axis as f64);
        let grids = levels.flat_map(|l| {
            let [along, slow] = axes(&l.grid);
            [l.grid.origin, l.grid.inverse_cell, [l.radius, along, slow]]
        });
        numbers("list/grid", grids.flatten().collect());
        numbers("list/skin", vec![self.skin, self.hold]);
        numbers("list/age", vec![self.list.age]);
        let standing = self.walls.iter().filter(|w| w.carrier.is_none());
        let walls: Vec<&WallContact> = self.wall_contacts.touching().collect();
        let histories: Vec<_> = walls.iter().map(|c| c.history).collect();
        numbers("walls/history", flatten(&histories));
        let normals: Vec<_> = walls.iter().map(|c| c.normal).collect();
        numbers("walls/normal", flatten(&normals));
        let courses = standing.clone().map(|w| [w.course.along, w.course.speed]);
        numbers("walls/course", courses.flatten().collect());
        let impulses = standing.flat_map(|w| w.impulse.numbers());
        numbers("walls/impulse", impulses.collect());
        numbers("wall_impulse", self.impulse.to_vec());
        numbers("momentum_account", self.account.iter().copied().collect());
        numbers("largest_overlap", vec![self.deepest]);
        let ledger = self.ledger.map(|ledger| ledger.numbers());
        numbers("energy_ledger", ledger.unwrap_or_default());
        numbers("timestep", vec![self.timestep]);
        numbers("law/coefficients", flatten(&self.law.table().rows));
        numbers("gravity", self.gravity.iter().copied().collect());
        let mut counts = |name: &str, values: Vec<u64>| {
            record.counts.insert(name.into(), values);
        };
        counts("law/kind", self.law.kind().to_vec());
        counts("grains/id", wide(&self.grains.id));
        let material = self.grains.material[..n].iter().map(|&m| u64::from(m));
        let numbered = [self.setup_grains as u64, u64::from(self.next_id)];
        counts("grains/numbered", numbered.to_vec());
        counts("grains/material", material.collect());
        counts("contacts/pair", pairs);
        counts("list/first", wide(&self.list.first));
        counts("list/partner", wide(&self.list.partner));
        let ends: Vec<u32> = self.list.rows.iter().map(|r| r.end).collect();
        counts("list/row_end", wide(&ends));
        let cells = self.list.levels.iter().flat_map(|l| l.grid.cells);
        counts("list/cells", cells.map(|c| c as u64).collect());
        let of: Vec<u32> = walls.iter().flat_map(|c| [c.grain, c.wall]).collect();
        counts("walls/contact", wide(&of));
        counts(
            "steps",
            vec![
                self.steps,
                self.steps_since_start,
                u64::from(self.springs_current),
            ],
        );
        self.loads.record(&mut record);
        self.bonds.record(&mut record);
        self.bodies.record(&mut record);
        self.clumps.record(&mut record);
        self.fields.record(&mut record);
        self.moving_box.record(&self.cell(), &mut record);
        self.drain.record(&mut record);
        record
    }

    /// Puts a simulation together from its setup and a checkpoint of it. The setup's laws and step are those that
    /// the run had when the checkpoint was taken.
    ///
    /// # Errors
    /// If the setup is wrong, or the checkpoint is damaged or of another scene, law or step.
    pub fn resume(setup: Setup, record: &Record) -> Result<Simulation, SetupError> {
        let mut s = Simulation::unlisted(setup)?;
        s.read(record).map_err(SetupError::Record)?;
        Ok(s)
    }

    fn read(&mut self, record: &Record) -> Result<(), String> {
        let &[of_setup, next_id] = record.counts("grains/numbered")? else {
            return Err("array `grains/numbered` must have 2 numbers".into());
        };
        self.compare(record)?;
        if of_setup != self.setup_grains as u64 {
            let grains = self.setup_grains;
            return Err(format!(
                "array `grains/numbered` is of a scene with {of_setup} grains, not {grains}"
            ));
        }
        let id = narrow("grains/id", record.counts("grains/id")?)?;
        let n = id.len();
        let mut numbers = id.clone();
        numbers.sort_unstable();
        if numbers.windows(2).any(|w| w[0] == w[1])
            || numbers.last().is_some_and(|&id| u64::from(id) >= next_id)
            || next_id > u64::from(u32::MAX)
        {
            return Err("array `grains/id` does not number the grains of this scene".into());
        }
        self.next_id = next_id as u32;
        let sized = |name: &str, len: usize| sized(record, name, len);
        let mut grains = Grains {
            place: rows(sized("grains/place", 4 * n)?),
            motion: rows(sized("grains/motion", 4 * n)?),
            turn: rows(sized("grains/turn", 4 * n)?),
            mass: sized("grains/mass", n)?.to_vec(),
            id,
            material: record
                .counts("grains/material")?
                .iter()
                .map(|&m| m as u16)
                .collect(),
            spare: Vec::new(),
        };
        let known = |&m: &u16| usize::from(m) < self.law.materials();
        if grains.material.len() != n || !grains.material.iter().all(known) {
            return Err("array `grains/material` names unknown materials".into());
        }
        let finite = |rows: &[[f64; 4]]| rows.iter().flatten().all(|x| x.is_finite());
        if !finite(&grains.place) || !finite(&grains.motion) || !finite(&grains.turn) {
            return Err(
                "array `grains/place`, `grains/motion` or `grains/turn` is not finite".into(),
            );
        }
        grains.pad();
        let lists = sized("list/skin", 2)?;
        let widest = f64::MAX.sqrt();
        if !(lists[0] > 0.0 && lists[0] < widest && (0.0..widest).contains(&lists[1])) {
            return Err("array `list/skin` does not hold two lengths".into());
        }
        self.set_skin(lists[0]);
        self.hold = lists[1];
        let first = narrow("list/first", record.counts("list/first")?)?;
        let partner = narrow("list/partner", record.counts("list/partner")?)?;
        let rising = first.first() == Some(&0) && first.windows(2).all(|w| w[0] <= w[1]);
        // Each pair stands at its lower grain: j > i, which also keeps a grain from meeting itself.
        let ordered = || {
            first.windows(2).enumerate().all(|(i, w)| {
                let pairs = &partner[w[0] as usize..w[1] as usize];
                pairs.iter().all(|&j| j as usize > i && (j as usize) < n)
            })
        };
        if first.len() != n + 1 || !rising || first[n] as usize != partner.len() || !ordered() {
            return Err("arrays `list/first` and `list/partner` do not fit each other".into());
        }
        let touching = narrow("contacts/pair", record.counts("contacts/pair")?)?;
        let touching = touching.as_chunks::<2>().0;
        let listed = |&[i, j]: &[u32; 2]| {
            let own = (i as usize) < n;
            own && partner[first[i as usize] as usize..first[i as usize + 1] as usize].contains(&j)
        };
        if !touching.iter().all(listed) {
            return Err("array `contacts/pair` has a pair that is not in `list/partner`".into());
        }
        let springs = sized("contacts/history", self.layout.history * touching.len())?;
        let ends = narrow("list/row_end", record.counts("list/row_end")?)?;
        let drifts: Vec<[f64; 3]> = rows(sized("list/row_drift", 3 * ends.len())?);
        let cells = record.counts("list/cells")?.as_chunks::<3>().0;
        let grids = sized("list/grid", 9 * cells.len())?.as_chunks::<9>().0;
        let mut levels = Vec::new();
        let mut first_row: usize = 0;
        for (cells, &[x, y, z, u, v, w, radius, along, slow]) in cells.iter().zip(grids) {
            let axes = [along, slow].map(|axis| (0..3).find(|&a| a as f64 == axis));
            let [Some(along), Some(slow)] = axes else {
                return Err("array `list/grid` names axes that there are not".into());
            };
            let Some(fast) = (0..3).find(|&a| a != along && a != slow && along != slow) else {
                return Err("array `list/grid` names an axis twice".into());
            };
            let grid = Grid {
                origin: [x, y, z],
                inverse_cell: [u, v, w],
                cells: cells.map(|c| c as usize),
                periodic: self.domain.periodic,
                along,
                across: [fast, slow],
            };
            let [m, s] = grid.across.map(|axis| grid.cells[axis]);
            let rows = m.checked_mul(s).filter(|&r| r > 0 && r <= ends.len());
            let rows = rows.ok_or("array `list/cells` does not fit `list/row_end`")?;
            levels.push(Level::restored(
                grid,
                first_row,
                radius,
                self.skin + self.hold,
            ));
            first_row += rows;
        }
        if first_row != ends.len()
            || ends.last().is_none_or(|&e| e as usize != n)
            || ends.windows(2).any(|w| w[0] > w[1])
        {
            return Err("array `list/row_end` does not cover the grains".into());
        }
        let mut start = 0;
        self.list.rows = ends
            .iter()
            .zip(drifts)
            .map(|(&end, drift)| {
                let row = Row { start, end, drift };
                start = end;
                row
            })
            .collect();
        self.list.travel = sized("list/travel", ends.len())?.to_vec();
        self.list.age = sized("list/age", 1)?[0];
        self.list.first = first;
        self.list.partner = partner;
        self.list.restore(levels);
        self.loads.read(record, &grains)?;
        self.bonds.read(record, &grains)?;
        self.fields.read(record)?;
        self.read_box(record)?;
        self.drain.read(record)?;
        self.clumps
            .read(record, &grains, &mut self.list, &self.domain)?;
        self.grains = grains;
        self.weigh();

        self.impulse.copy_from_slice(sized("wall_impulse", 3)?);
        self.account = Vector3::from_column_slice(sized("momentum_account", 3)?);
        self.deepest = sized("largest_overlap", 1)?[0];
        self.ledger = EnergyLedger::from_numbers(record.numbers("energy_ledger")?)?;
        self.gravity = Vector3::from_column_slice(sized("gravity", 3)?);
        let &[steps, since_start, springs_current] = record.counts("steps")? else {
            return Err("array `steps` must have 3 numbers".into());
        };
        (self.steps, self.steps_since_start) = (steps, since_start);
        self.springs_current = springs_current != 0;
        self.read_walls(record)?;
        self.renew_rows();
        self.take_histories(touching, springs);
        Ok(())
    }

    /// Refuses a checkpoint of a run under another step or other laws.
    fn compare(&self, record: &Record) -> Result<(), String> {
        let [step, own] = [sized(record, "timestep", 1)?[0], self.timestep];
        if step.to_bits() != own.to_bits() {
            return Err(format!(
                "array `timestep` is of a run with steps of {step:e} s, not {own:e} s"
            ));
        }
        if record.counts("law/kind")? != self.law.kind() {
            return Err("array `law/kind` is of other kinds of laws than the scene's".into());
        }
        let rows = &self.law.table().rows;
        let known = sized(record, "law/coefficients", COEFFICIENTS * rows.len())?;
        let alike = |(a, b): (&f64, &f64)| a.to_bits() == b.to_bits();
        if let Some(k) = known
            .iter()
            .zip(rows.iter().flatten())
            .position(|both| !alike(both))
        {
            let (pair, n) = (k / COEFFICIENTS, self.law.materials());
            let [a, b] = [pair / n, pair % n];
            return Err(format!(
                "array `law/coefficients` is of another law between the materials {a} and {b}"
            ));
        }
        Ok(())
    }

    /// Takes up walls and the contacts with them; steps and lists are known.
    fn read_walls(&mut self, record: &Record) -> Result<(), String> {
        let all = self.walls.len();
        let walls = self.wall_count();
        let courses = sized(record, "walls/course", 2 * walls)?;
        let impulses = sized(record, "walls/impulse", WallImpulse::NUMBERS * walls)?;
        let step = Span::ending(self.steps, self.timestep);
        let courses = courses.as_chunks::<2>().0.iter();
        let impulses = impulses.as_chunks().0.iter();
        for ((wall, &[along, speed]), impulse) in self.walls.iter_mut().zip(courses).zip(impulses) {
            *wall = Standing::at(wall.wall.clone(), step, Course { along, speed });
            wall.impulse = WallImpulse::from_numbers(impulse);
        }
        let last = [self.steps as f64 - 1.0, self.steps as f64].map(|n| n * self.timestep);
        self.bodies.read(record, &mut self.walls, last)?;
        let of = narrow("walls/contact", record.counts("walls/contact")?)?;
        let of = of.as_chunks::<2>().0;
        let histories: Vec<[f64; HISTORY_MAX]> =
            rows(sized(record, "walls/history", of.len() * HISTORY_MAX)?);
        let normals: Vec<[f64; 3]> = rows(sized(record, "walls/normal", of.len() * 3)?);
        let n = self.grains.len();
        let known = |&[grain, wall]: &[u32; 2]| (grain as usize) < n && (wall as usize) < all;
        if !of.iter().all(known) {
            return Err("array `walls/contact` names unknown grains or walls".into());
        }
        let contacts = of.iter().zip(histories).zip(normals);
        let contacts = contacts.map(|((&[grain, wall], history), normal)| WallContact {
            history,
            normal,
            touching: true,
            ..WallContact::apart(grain, wall)
        });
        self.wall_contacts.take_up(contacts.collect());
        self.list_walls();
        Ok(())
    }
}
