//! Grains that are taken out of a run with their contacts, and put back later.
//!
//! A region that stops, or is handed over to another model, keeps what a fresh packing would not have: which grains
//! touch, and how far their springs are stretched. Put back where they were, among the neighbours that they had, they
//! stand under the same forces.

use crate::grains::Grain;
use crate::setup::SetupError;
use crate::simulation::Simulation;
use crate::snapshot::GrainSample;

/// Grains with the histories of their contacts.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Patch {
    /// The grains; their velocities live where the integrator holds them, in a run half a step back.
    pub grains: Vec<Grain>,
    /// Their numbers, rising.
    pub ids: Vec<u32>,
    /// Numbers of both grains of each contact that had a history; one of them at least belongs to the patch.
    pub pairs: Vec<[u32; 2]>,
    /// The histories, one after the other.
    pub histories: Vec<f64>,
}

/// Numbers of a grain in a row.
const OF_A_GRAIN: usize = 14;

impl Patch {
    /// Mass of its free grains (kg).
    pub fn mass(&self) -> f64 {
        let free = self.grains.iter().filter(|g| !g.fixed);
        free.map(Grain::mass).sum()
    }

    /// Takes those grains out for which `f` says so by their numbers and themselves. Histories of contacts between both parts stay with both: each is
    /// given to its contact where the second grain of it is put back.
    pub fn split(&mut self, mut f: impl FnMut(u32, &Grain) -> bool) -> Patch {
        let rows = self.ids.iter().zip(&self.grains);
        let goes: Vec<bool> = rows.map(|(id, grain)| f(*id, grain)).collect();
        let part = |wanted: bool| {
            let rows = self.grains.iter().zip(&self.ids).zip(&goes);
            let rows = rows
                .filter(|(_, goes)| **goes == wanted)
                .map(|(row, _)| row);
            let (grains, ids) = rows.map(|(grain, id)| (*grain, *id)).unzip();
            let mut patch = Patch {
                grains,
                ids,
                ..Patch::default()
            };
            let width = self.width();
            for (k, pair) in self.pairs.iter().enumerate() {
                if pair.iter().any(|id| patch.ids.binary_search(id).is_ok()) {
                    patch.pairs.push(*pair);
                    let row = k * width..(k + 1) * width;
                    patch.histories.extend_from_slice(&self.histories[row]);
                }
            }
            patch
        };
        let (taken, rest) = (part(true), part(false));
        *self = rest;
        taken
    }

    /// Takes another patch's grains in, none of which it has.
    pub fn merge(&mut self, other: &Patch) {
        let width = self.width().max(other.width());
        let mut rows: Vec<(u32, Grain)> = Vec::new();
        let mut contacts: Vec<([u32; 2], &[f64])> = Vec::new();
        for patch in [&*self, other] {
            rows.extend(patch.ids.iter().copied().zip(patch.grains.iter().copied()));
            let row = |k: usize| &patch.histories[k * width..(k + 1) * width];
            contacts.extend(patch.pairs.iter().enumerate().map(|(k, p)| (*p, row(k))));
        }
        rows.sort_unstable_by_key(|(id, _)| *id);
        let ends = |pair: &[u32; 2]| (pair[0].min(pair[1]), pair[0].max(pair[1]));
        contacts.sort_by_key(|(pair, _)| ends(pair));
        // Of a contact between both either may know; what the other says is later.
        contacts.dedup_by(|later, former| {
            let same = ends(&later.0) == ends(&former.0);
            if same {
                *former = *later;
            }
            same
        });
        let merged = Patch {
            ids: rows.iter().map(|(id, _)| *id).collect(),
            grains: rows.into_iter().map(|(_, grain)| grain).collect(),
            pairs: contacts.iter().map(|(pair, _)| *pair).collect(),
            histories: contacts.iter().flat_map(|(_, row)| row.to_vec()).collect(),
        };
        *self = merged;
    }

    /// Numbers of a history.
    fn width(&self) -> usize {
        self.histories
            .len()
            .checked_div(self.pairs.len())
            .unwrap_or(0)
    }

    /// All of it as numbers, for a checkpoint of whoever holds it.
    pub fn numbers(&self) -> Vec<f64> {
        let mut row = vec![self.grains.len() as f64, self.pairs.len() as f64];
        for (grain, id) in self.grains.iter().zip(&self.ids) {
            row.push(f64::from(*id));
            for vector in [&grain.position, &grain.velocity, &grain.spin] {
                row.extend(vector.iter());
            }
            row.extend([grain.radius, grain.density]);
            row.extend([f64::from(u8::from(grain.fixed)), f64::from(grain.material)]);
        }
        row.extend(self.pairs.iter().flatten().map(|id| f64::from(*id)));
        row.extend(&self.histories);
        row
    }

    /// From such numbers; none if they are none of a patch.
    pub fn of(numbers: &[f64]) -> Option<Self> {
        let (&[grains, pairs], rest) = numbers.split_first_chunk()?;
        let (rows, rest) = rest.split_at_checked(grains as usize * OF_A_GRAIN)?;
        let (ends, histories) = rest.split_at_checked(2 * pairs as usize)?;
        let mut patch = Self {
            histories: histories.to_vec(),
            ..Self::default()
        };
        for [
            id,
            x,
            y,
            z,
            u,
            v,
            w,
            a,
            b,
            c,
            radius,
            density,
            fixed,
            material,
        ] in rows.as_chunks::<OF_A_GRAIN>().0
        {
            patch.ids.push(*id as u32);
            patch.grains.push(Grain {
                position: [*x, *y, *z].into(),
                velocity: [*u, *v, *w].into(),
                spin: [*a, *b, *c].into(),
                radius: *radius,
                density: *density,
                fixed: *fixed != 0.0,
                material: *material as u16,
            });
        }
        for [a, b] in ends.as_chunks::<2>().0 {
            patch.pairs.push([*a as u32, *b as u32]);
        }
        Some(patch)
    }
}

impl Simulation {
    /// Takes out all grains for which `f` says so, with all others of their clumps, and the histories of their
    /// contacts with each other and with those that stay. Contacts with walls and bodies, bonds and clumps are not kept.
    pub fn take_out(&mut self, f: impl FnMut(&GrainSample) -> bool) -> Patch {
        let goes = self.marked(f);
        // Springs as they stand between steps, not as they are looked at.
        self.forget_observation();
        let samples: Vec<GrainSample> = self.held(|_| true).collect();
        let mut taken: Vec<usize> = (0..goes.len()).filter(|&i| goes[i]).collect();
        taken.sort_unstable_by_key(|&i| samples[i].id);
        let grain = |&i: &usize| {
            let sample = &samples[i];
            let radius = sample.radius;
            let mut grain = Grain::at_rest(sample.position, radius, 1.0);
            grain.density = sample.mass / grain.volume();
            grain.velocity = sample.velocity;
            grain.spin = sample.spin;
            grain.fixed = sample.fixed;
            grain.material = self.grains.material[i];
            grain
        };
        let mut patch = Patch {
            grains: taken.iter().map(grain).collect(),
            ids: taken.iter().map(|&i| samples[i].id).collect(),
            ..Patch::default()
        };
        let mut contacts: Vec<([u32; 2], Vec<f64>)> = Vec::new();
        self.reach.touching(self.layout.history, |i, j, history| {
            if goes[i as usize] || goes[j as usize] {
                let ids = [i, j].map(|grain| self.grains.id[grain as usize]);
                contacts.push((ids, history.to_vec()));
            }
        });
        contacts.sort_unstable_by_key(|(ids, _)| *ids);
        for (ids, history) in contacts {
            patch.pairs.push(ids);
            patch.histories.extend(history);
        }
        let ids = &patch.ids;
        self.remove(|g| ids.binary_search(&g.id).is_ok());
        patch
    }

    /// Puts a patch of this run back: its grains with their numbers, and the histories of those contacts both of whose
    /// grains are there.
    ///
    /// # Errors
    /// If a grain of it is there already or never was, if it has histories of another law, or as
    /// [`insert`](Self::insert) does. Nothing has changed then.
    pub fn put_back(&mut self, patch: &Patch) -> Result<(), SetupError> {
        let [small, large] = self.admit(&patch.grains)?;
        let width = self.layout.history;
        let there = |id: &u32| self.grains.id.contains(id);
        let refused = |key: &str, value: f64, allowed| SetupError::OutOfRange {
            key: format!("patch.{key}"),
            value,
            allowed,
        };
        let strange = |id: &&u32| **id >= self.next_id || there(id);
        if let Some(id) = patch.ids.iter().find(strange) {
            let allowed = "the number of a grain that was taken out of this run";
            return Err(refused("ids", f64::from(*id), allowed));
        }
        if patch.ids.len() != patch.grains.len() || !patch.ids.is_sorted_by(|a, b| a < b) {
            let allowed = "one for each grain, rising";
            return Err(refused("ids", patch.ids.len() as f64, allowed));
        }
        if patch.histories.len() != width * patch.pairs.len() {
            let allowed = "as many for each pair as the contact law has";
            return Err(refused("histories", patch.histories.len() as f64, allowed));
        }
        if patch.grains.is_empty() {
            return Ok(());
        }
        self.forget_observation();
        self.size_lists(small, large);
        self.grains.append(&patch.grains, 0);
        let first = self.grains.len() - patch.ids.len();
        self.grains.id[first..].copy_from_slice(&patch.ids);
        self.rebuild();
        if width > 0 {
            self.give_histories(patch);
        }
        self.seat(|id| patch.ids.binary_search(&id).is_ok());
        Ok(())
    }

    /// Puts a patch of no run in: its grains get numbers that none has had, rising as theirs do, and those contacts stay both of
    /// whose grains it has. Says how they are called.
    ///
    /// # Errors
    /// As [`put_back`](Self::put_back), or if numbers have run out.
    pub fn put_in(&mut self, patch: &Patch) -> Result<Patch, SetupError> {
        let first = self.next_id;
        let count = u32::try_from(patch.ids.len()).ok();
        let Some(end) = count.and_then(|count| first.checked_add(count)) else {
            return Err(SetupError::OutOfRange {
                key: "grains inserted so far".into(),
                value: f64::from(first) + patch.ids.len() as f64,
                allowed: "below 2³²",
            });
        };
        let name = |id: &u32| {
            let own = patch.ids.binary_search(id).ok()?;
            Some(first + own as u32)
        };
        let mut named = Patch {
            grains: patch.grains.clone(),
            ids: (first..end).collect(),
            ..Patch::default()
        };
        let width = patch.width();
        for (k, [a, b]) in patch.pairs.iter().enumerate() {
            if let (Some(a), Some(b)) = (name(a), name(b)) {
                named.pairs.push([a, b]);
                let row = &patch.histories[k * width..(k + 1) * width];
                named.histories.extend_from_slice(row);
            }
        }
        self.next_id = end;
        let put = self.put_back(&named);
        if put.is_err() {
            self.next_id = first;
        }
        put.map(|()| named)
    }

    /// Histories of a patch to its contacts, beside those that there are.
    fn give_histories(&mut self, patch: &Patch) {
        let width = self.layout.history;
        let (mut pairs, mut springs) = (Vec::new(), Vec::new());
        self.reach.touching(width, |i, j, history| {
            pairs.push([i, j]);
            springs.extend_from_slice(history);
        });
        let rows = self.grains.id.iter().enumerate();
        let mut places: Vec<(u32, u32)> = rows.map(|(i, id)| (*id, i as u32)).collect();
        places.sort_unstable();
        let place = |id: u32| {
            let at = places.binary_search_by_key(&id, |(id, _)| *id).ok()?;
            Some(places[at].1)
        };
        for ([a, b], history) in patch.pairs.iter().zip(patch.histories.chunks_exact(width)) {
            if let (Some(i), Some(j)) = (place(*a), place(*b)) {
                pairs.push([i, j]);
                springs.extend_from_slice(history);
            }
        }
        self.take_histories(&pairs, &springs);
    }
}
