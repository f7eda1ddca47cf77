//! Clumps in a checkpoint and in the hash of the state.

use super::{Clumps, Member, State};
use crate::domain::Domain;
use crate::grains::{Grains, vector};
use crate::neighbours::Neighbours;
use crate::record::Record;
use crate::state_hash::StateHash;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// Numbers of a clump: mass, moments, place, orientation, velocity, angular momentum.
const NUMBERS: usize = 17;

/// Numbers of a member: place in the clump, in space, velocity and turn of its row.
const MEMBER: usize = 12;

impl Clumps {
    /// Writes all of them; a scene without clumps writes nothing.
    pub fn record(&self, record: &mut Record) {
        if self.is_empty() {
            return;
        }
        let states = self.all().flat_map(|(state, _)| numbers(state));
        record
            .numbers
            .insert("clumps/state".into(), states.collect());
        let members = self.all().flat_map(|(_, own)| own).flat_map(|m| {
            let vectors = [m.at, m.arm, m.velocity, m.turn];
            vectors.into_iter().flat_map(<[f64; 3]>::from)
        });
        record
            .numbers
            .insert("clumps/member".into(), members.collect());
        let grains = self
            .all()
            .flat_map(|(_, own)| own)
            .map(|m| u64::from(m.grain));
        record
            .counts
            .insert("clumps/grain".into(), grains.collect());
        let counts = self.all().map(|(_, own)| own.len() as u64);
        record
            .counts
            .insert("clumps/count".into(), counts.collect());
    }

    /// Reads them back; grains and lists are known.
    pub fn read(
        &mut self,
        record: &Record,
        grains: &Grains,
        list: &mut Neighbours,
        domain: &Domain,
    ) -> Result<(), String> {
        if !record.counts.contains_key("clumps/count") {
            return Ok(());
        }
        let counts = record.counts("clumps/count")?;
        let numbers = record.counts("clumps/grain")?;
        let states = record.numbers("clumps/state")?;
        let members = record.numbers("clumps/member")?;
        let in_all = counts.iter().try_fold(
            0_u64,
            |sum, &n| {
                if n == 0 { None } else { sum.checked_add(n) }
            },
        );
        let fit = in_all == Some(numbers.len() as u64)
            && states.len() == NUMBERS * counts.len()
            && members.len() == MEMBER * numbers.len()
            && states.iter().chain(members).all(|x| x.is_finite());
        let states = states.as_chunks::<NUMBERS>().0;
        let solid = |s: &[f64; NUMBERS]| s[..4].iter().all(|&x| x > 0.0);
        if !fit || !states.iter().all(solid) {
            return Err(
                "arrays `clumps/count`, `grain`, `state`, `member` do not fit each other".into(),
            );
        }
        let mut known = grains.id.clone();
        known.sort_unstable();
        let mut rest = numbers.iter().zip(members.as_chunks::<MEMBER>().0);
        let mut taken = std::collections::BTreeSet::new();
        let mut all = Vec::new();
        for (&count, state) in counts.iter().zip(states) {
            let mut own = Vec::new();
            for (&number, m) in rest.by_ref().take(count as usize) {
                let grain = u32::try_from(number).ok();
                let grain = grain.filter(|id| known.binary_search(id).is_ok() && taken.insert(*id));
                let grain = grain.ok_or_else(|| {
                    format!(
                        "array `clumps/grain` names grain {number}, which is not there or twice"
                    )
                })?;
                let v = |k: usize| Vector3::new(m[k], m[k + 1], m[k + 2]);
                own.push(Member {
                    grain,
                    at: v(0),
                    arm: v(3),
                    velocity: v(6),
                    turn: v(9),
                    ..Member::default()
                });
            }
            all.push((state_of(state), own));
        }
        self.lay(all);
        list.clumps = self.by_number();
        self.settle(grains, list, domain, false);
        // A member that has left its clump would be put back by the next step.
        for (state, own) in self.all() {
            for m in own {
                let x = vector(&grains.place[m.row as usize]);
                let off = (x - state.place - m.arm - m.image).norm();
                let scale = x.norm() + state.place.norm() + grains.place[m.row as usize][3];
                if off > 1e-9 * scale {
                    return Err(format!(
                        "array `clumps/state` does not fit the place of grain {}",
                        m.grain
                    ));
                }
            }
        }
        Ok(())
    }

    /// Takes states into a hash; a scene without clumps leaves it as it is.
    pub fn hash(&self, hash: &mut StateHash) {
        for (state, _) in self.all() {
            numbers(state).iter().for_each(|x| hash.take(x.to_bits()));
        }
    }
}

fn numbers(state: &State) -> [f64; NUMBERS] {
    let mut all = [0.0; NUMBERS];
    all[0] = state.mass;
    let q = state.orientation.quaternion().coords;
    all[7..11].copy_from_slice(q.as_slice());
    for (at, v) in [
        (1, &state.moments),
        (4, &state.place),
        (11, &state.velocity),
        (14, &state.momentum),
    ] {
        all[at..at + 3].copy_from_slice(v.as_slice());
    }
    all
}

fn state_of(all: &[f64; NUMBERS]) -> State {
    let v = |k: usize| Vector3::new(all[k], all[k + 1], all[k + 2]);
    let q = Quaternion::new(all[10], all[7], all[8], all[9]);
    State {
        mass: all[0],
        moments: v(1),
        place: v(4),
        // Its bits as they were: it is of length 1 already.
        orientation: UnitQuaternion::new_unchecked(q),
        velocity: v(11),
        momentum: v(14),
        members: 0..0,
    }
}
