//! Bodies in a checkpoint and in the hash of the state. What they are comes from the setup.

use super::contacts::{Bodies, BodyContact};
use super::rigid::State;
use crate::contact::HISTORY_MAX;
use crate::record::Record;
use crate::state_hash::StateHash;
use crate::walls::{Standing, WallImpulse};

impl Bodies {
    /// Writes states and springs.
    pub fn record(&self, record: &mut Record) {
        let mut numbers = |name: &str, values: Vec<f64>| {
            record.numbers.insert(format!("bodies/{name}"), values);
        };
        numbers("state", self.rigid.iter().flat_map(|b| b.state()).collect());
        let impulses = self.rigid.iter().flat_map(|b| b.impulse.numbers());
        numbers("impulse", impulses.collect());
        let contacts = self.contacts.iter();
        numbers(
            "history",
            contacts.clone().flat_map(|c| c.history).collect(),
        );
        numbers("normal", contacts.clone().flat_map(|c| c.normal).collect());
        let of = contacts.flat_map(|c| [c.encounter, c.feeler].map(u64::from));
        record.counts.insert("bodies/contact".into(), of.collect());
    }

    /// Reads them back; the last step began and ended at these times (s).
    pub fn read(
        &mut self,
        record: &Record,
        walls: &mut [Standing],
        step: [f64; 2],
    ) -> Result<(), String> {
        if self.is_empty() && !record.numbers.contains_key("bodies/state") {
            return Ok(());
        }
        let sized = |name: &str, each: usize, count: usize| {
            let values = record.numbers(&format!("bodies/{name}"))?;
            if values.len() == each * count && values.iter().all(|x| x.is_finite()) {
                return Ok(values);
            }
            Err(format!(
                "array `bodies/{name}` must have {} finite numbers",
                each * count
            ))
        };
        let bodies = self.rigid.len();
        const STATE: usize = size_of::<State>() / size_of::<f64>();
        let states = sized("state", STATE, bodies)?.as_chunks::<STATE>().0;
        let impulses = sized("impulse", WallImpulse::NUMBERS, bodies)?;
        let impulses = impulses.as_chunks().0;
        for ((body, state), impulse) in self.rigid.iter_mut().zip(states).zip(impulses) {
            body.restore(state, step);
            body.impulse = WallImpulse::from_numbers(impulse);
        }
        let of = record.counts("bodies/contact")?.as_chunks::<2>().0;
        let histories = sized("history", HISTORY_MAX, of.len())?;
        let histories = histories.as_chunks::<HISTORY_MAX>().0;
        let normals = sized("normal", 3, of.len())?.as_chunks::<3>().0;
        let known = of.iter().zip(histories).zip(normals);
        let contacts = known.map(|((&[encounter, feeler], history), normal)| {
            let unknown = || "array `bodies/contact` names unknown sides".to_string();
            let sides = self
                .encounters
                .get(encounter as usize)
                .ok_or_else(unknown)?;
            let feelers = &self.feelers[sides.prober as usize];
            let names = feelers.points.len() + 4 * feelers.rims.len();
            if feeler >= names as u64 {
                return Err(unknown());
            }
            let key = [encounter as u32, feeler as u32];
            Ok(BodyContact::known(key, *history, *normal))
        });
        let contacts = contacts.collect::<Result<Vec<_>, String>>()?;
        let sorted = |w: &[BodyContact]| w[0].key() <= w[1].key();
        if !contacts.windows(2).all(sorted) {
            return Err("array `bodies/contact` is out of order".into());
        }
        self.take_up(contacts);
        self.place(walls);
        Ok(())
    }

    /// Takes states and springs into a hash; a scene without bodies leaves it as it is.
    pub fn hash(&self, hash: &mut StateHash) {
        for body in &self.rigid {
            body.state().iter().for_each(|x| hash.take(x.to_bits()));
        }
        for contact in &self.contacts {
            hash.take(u64::from(contact.encounter) << 32 | u64::from(contact.feeler));
            let springs = contact.history.iter();
            springs.for_each(|x| hash.take(x.to_bits()));
        }
    }
}
