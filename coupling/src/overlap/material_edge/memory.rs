//! All of a zone as numbers: what a run goes on from with the same bits.
//!
//! In front stands what every load changes, of a length that does not; behind it what an exchange changes, in rows
//! with their lengths before them. A continuum stands with its keeper.

use super::account::{self, Account};
use super::rows::{self, Row};
use super::travel::{Journey, Move};
use super::{Continuum, GrainZone, MaterialEdge, MaterialEdgeSpec, OverlapError, layout};
use crate::overlap::cell_joint::CellJoint;
use crate::overlap::state_rows;
use colluvium_continuum::column_collapse::CollapseGround;
use colluvium_continuum::strain::SPACE_COMPONENTS;
use colluvium_dem::{Patch, Simulation};
use std::ops::Range;

/// Numbers in front of those of the edges, with the lengths of which they end: how many there are, and steps of grains.
const HEAD: usize = 2 + account::NUMBERS;

impl MaterialEdge {
    /// What every load changes.
    fn front(&self) -> Vec<f64> {
        self.joint.front(&self.account.numbers())
    }

    /// Writes what has changed since an exchange over what [`write`](Self::write) wrote after it.
    fn write_over(&self, memory: &mut [f64]) {
        let front = self.front();
        memory[..front.len()].copy_from_slice(&front);
    }

    /// Appends all there is, with the continuum if it keeps it.
    fn write(&self, continuum: &Continuum, keeps: bool, memory: &mut Vec<f64>) {
        memory.extend(self.front());
        let mut put = |row: &[f64]| {
            memory.push(row.len() as f64);
            memory.extend(row);
        };
        put(&[
            continuum.mass,
            continuum.rest_mass,
            self.held.reach,
            self.packed,
            self.renewed,
        ]);
        self.joint.write(&mut put);
        put(&self.labels.given);
        put(&self.labels.base);
        let journey = &self.journey;
        put(&[
            self.labels.edge,
            journey.resting,
            journey.returns,
            journey.refused,
            journey.stopped[0],
            journey.stopped[1],
            journey.refusing,
            journey.displaced,
            journey.strips.len() as f64,
        ]);
        let moves: Vec<f64> = journey.moves.iter().flat_map(Move::numbers).collect();
        put(&moves);
        for strip in &journey.strips {
            put(&strip.numbers());
        }
        put(self.sums.stress.as_flattened());
        let rows: Vec<f64> = self.held.rows.iter().flat_map(Row::numbers).collect();
        put(&rows);
        put(&self.held.handshake);
        put(&[self.view.rest.ratio]);
        put(self.view.rest.strain.as_flattened());
        if keeps {
            state_rows::write(continuum.collapse.flow().state(), &mut put);
        }
    }

    /// From what was written of an edge; its keeper's continuum is made before the other edge is read.
    fn read_back(
        (specs, k): (&[MaterialEdgeSpec], usize),
        ours: [f64; 2],
        memory: &[f64],
        (own, ground): (Range<usize>, Option<&CollapseGround>),
        known: &mut Option<Continuum>,
        simulation: &Simulation,
    ) -> Result<Option<Self>, OverlapError> {
        let Some((front, mut rest)) = CellJoint::<2, 1>::split(memory, account::NUMBERS) else {
            return Ok(None);
        };
        let mut take = || {
            let (length, after) = rest.split_first()?;
            let (row, after) = after.split_at_checked(*length as usize)?;
            rest = after;
            Some(row)
        };
        let (Some(&[mass, rest_mass, reach, packed, renewed]), Some(joint), Some(labels)) =
            (take(), CellJoint::<2, 1>::rows(&mut take), take())
        else {
            return Ok(None);
        };
        let keeps = known.is_none();
        let continuum = match known {
            Some(continuum) => continuum,
            None => known.insert(Continuum::standing(
                specs,
                (own, ground),
                [mass, rest_mass],
                simulation.timestep(),
            )?),
        };
        let mut edge = Self::around(specs[k], ours, continuum, labels.to_vec(), simulation);
        let Some(base) = take() else {
            return Ok(None);
        };
        let Some(
            &[
                at,
                resting,
                returns,
                refused,
                stopped,
                first,
                refusing,
                displaced,
                strips,
            ],
        ) = take()
        else {
            return Ok(None);
        };
        let Some(moves) = take() else {
            return Ok(None);
        };
        let strips = (0..strips as usize).map(|_| Patch::of(take()?));
        let Some(strips) = strips.collect() else {
            return Ok(None);
        };
        let moves = moves.as_chunks().0.iter().map(Move::of).collect();
        let Some(moves) = moves else {
            return Ok(None);
        };
        if base.len() != edge.labels.base.len() {
            return Ok(None);
        }
        edge.labels.base = base.to_vec();
        edge.labels.edge = at;
        edge.journey = Journey {
            strips,
            moves,
            resting,
            returns,
            refused,
            stopped: [stopped, first],
            refusing,
            displaced,
        };
        let Some([stress, edge_rows, handshake]) = (|| Some([take()?, take()?, take()?]))() else {
            return Ok(None);
        };
        let Some((&[ratio], strain)) = take().zip(take()) else {
            return Ok(None);
        };
        let state = keeps.then(|| state_rows::read(&mut take));
        if state.as_ref().is_some_and(Option::is_none) {
            return Ok(None);
        }
        let cells = edge.cells.count();
        let fits = stress.len() == 3 * cells
            && strain.len() == SPACE_COMPONENTS * cells
            && edge_rows.len() == rows::NUMBERS * handshake.len()
            && handshake.len() == edge.cells.counts[1];
        let account = edge.joint.fill(front, account::NUMBERS, joint);
        let Some(account) = account.and_then(|numbers| numbers.try_into().ok()) else {
            return Ok(None);
        };
        if !fits {
            return Ok(None);
        }
        edge.sums.stress = stress.as_chunks::<3>().0.to_vec();
        let numbers = edge_rows.as_chunks::<{ rows::NUMBERS }>().0;
        edge.held.rows = numbers.iter().map(Row::of).collect();
        edge.held.handshake = handshake.to_vec();
        edge.held.reach = reach;
        (edge.packed, edge.renewed) = (packed, renewed);
        edge.account = Account::of(account);
        if let Some(state) = state.flatten() {
            continuum.collapse.set_state(state)?;
        }
        edge.look_at(continuum);
        edge.view.rest.ratio = ratio;
        edge.view.rest.strain = strain.as_chunks().0.to_vec();
        Ok(Some(edge))
    }
}

impl GrainZone {
    fn head(&self) -> [f64; HEAD] {
        let own = self.own.numbers();
        std::array::from_fn(|k| match k.checked_sub(2) {
            None => [self.edges.len() as f64, self.grain_steps][k],
            Some(k) => own[k],
        })
    }

    /// Appends all there is; to be called after every exchange.
    pub fn write(&self, memory: &mut Vec<f64>) {
        memory.extend(self.head());
        for continuum in &self.continua {
            for k in continuum.edges.clone() {
                let length = memory.len();
                memory.push(0.0);
                let keeps = k == continuum.edges.start + continuum.keeper;
                self.edges[k].write(continuum, keeps, memory);
                memory[length] = (memory.len() - length - 1) as f64;
            }
        }
    }

    /// Writes what has changed since an exchange over what [`write`](Self::write) wrote after it.
    pub fn write_over(&self, memory: &mut [f64]) {
        memory[..HEAD].copy_from_slice(&self.head());
        let mut from = HEAD;
        for edge in &self.edges {
            edge.write_over(&mut memory[from + 1..]);
            from += 1 + memory[from] as usize;
        }
    }

    /// Goes on from what was written of a zone with the same specification and ground; the simulation is the one that was
    /// joined, resumed itself.
    ///
    /// # Errors
    /// If the numbers do not belong to this specification.
    pub fn read(
        specs: &[MaterialEdgeSpec],
        ground: Option<&CollapseGround>,
        memory: &[f64],
        simulation: &Simulation,
    ) -> Result<Self, OverlapError> {
        let damaged = || OverlapError::Record("the joined column's memory misses a part".into());
        let (head, mut rest) = memory.split_first_chunk::<HEAD>().ok_or_else(damaged)?;
        if head[0] != specs.len() as f64 {
            return Err(damaged());
        }
        let mut memories = Vec::with_capacity(specs.len());
        for _ in specs {
            let (length, after) = rest.split_first().ok_or_else(damaged)?;
            let (own, after) = after
                .split_at_checked(*length as usize)
                .ok_or_else(damaged)?;
            memories.push(own);
            rest = after;
        }
        let ours = layout::grains(specs);
        let mut zone = Self::of(Vec::new(), Vec::new());
        for own in layout::continua(specs) {
            let mut continuum = None;
            let keeper = layout::keeper(specs, &own);
            let mut order: Vec<usize> = own.clone().collect();
            order.sort_by_key(|k| *k != keeper);
            let mut edges = Vec::new();
            for k in order {
                let (place, known) = ((own.clone(), ground), &mut continuum);
                let (from, memory) = ((specs, k), memories[k]);
                let edge =
                    MaterialEdge::read_back(from, ours[k], memory, place, known, simulation)?;
                edges.push((k, edge.ok_or_else(damaged)?));
            }
            edges.sort_by_key(|(k, _)| *k);
            zone.edges.extend(edges.into_iter().map(|(_, edge)| edge));
            zone.continua.extend(continuum);
        }
        zone.grain_steps = head[1];
        zone.own = Account::of(&std::array::from_fn(|k| head[2 + k]));
        zone.weigh(simulation);
        Ok(zone)
    }
}
