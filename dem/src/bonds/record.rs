//! Bonds in a checkpoint.

use super::bond::{Pull, Strain};
use super::{Bond, BondState, Bonds, Cement};
use crate::grains::Grains;
use crate::places::Places;
use crate::population::GONE;
use crate::record::Record;
use crate::state_hash::StateHash;
use nalgebra::Vector3;

/// States in the order of their numbers in a checkpoint.
const STATES: [BondState; 4] = [
    BondState::Whole,
    BondState::Torn,
    BondState::Sheared,
    BondState::Cut,
];

impl Bond {
    /// Numbers of its grains, its cement and its state.
    fn counts(&self) -> [u64; 4] {
        let state = STATES.iter().position(|&s| s == self.state).unwrap_or(0);
        let [i, j] = self.ids.map(u64::from);
        [i, j, u64::from(self.cement), state as u64]
    }

    /// Its strain, and the energy it set free.
    fn numbers(&self) -> [f64; 8] {
        let Strain { rest, shear, turn } = &self.strain;
        [
            rest,
            &shear.x,
            &shear.y,
            &shear.z,
            &turn.x,
            &turn.y,
            &turn.z,
            &self.freed,
        ]
        .map(|x| *x)
    }
}

impl Bonds {
    /// Writes all bonds.
    pub fn record(&self, record: &mut Record) {
        let counts: Vec<u64> = self.list.iter().flat_map(Bond::counts).collect();
        let numbers: Vec<f64> = self.list.iter().flat_map(Bond::numbers).collect();
        let cements = self.cements.iter().flat_map(|c| {
            [
                c.youngs_modulus,
                c.stiffness_ratio,
                c.radius_ratio,
                c.tensile_strength,
                c.shear_strength,
            ]
        });
        record
            .numbers
            .insert("bonds/cement".into(), cements.collect());
        record.numbers.insert("bonds/strain".into(), numbers);
        record
            .numbers
            .insert("bonds/dropped".into(), vec![self.dropped]);
        record.counts.insert("bonds/bond".into(), counts);
    }

    /// Takes the bits of all bonds into a hash of the state.
    pub fn hash(&self, hash: &mut StateHash) {
        for bond in &self.list {
            bond.counts().into_iter().for_each(|c| hash.take(c));
            let numbers = bond.numbers().into_iter();
            numbers.for_each(|x| hash.take(x.to_bits()));
        }
    }

    /// Reads them back.
    pub fn read(&mut self, record: &Record, grains: &Grains) -> Result<(), String> {
        let cements = record.numbers("bonds/cement")?.as_chunks::<5>().0;
        self.cements = cements
            .iter()
            .map(
                |&[
                    youngs_modulus,
                    stiffness_ratio,
                    radius_ratio,
                    tensile,
                    shear,
                ]| {
                    let cement = Cement {
                        youngs_modulus,
                        stiffness_ratio,
                        radius_ratio,
                        tensile_strength: tensile,
                        shear_strength: shear,
                    };
                    cement.validate().map_err(|e| e.to_string())?;
                    Ok(cement)
                },
            )
            .collect::<Result<_, String>>()?;
        let &[dropped] = record.numbers("bonds/dropped")? else {
            return Err("array `bonds/dropped` must have 1 number".into());
        };
        self.dropped = dropped;
        let of = record.counts("bonds/bond")?;
        let strains = record.numbers("bonds/strain")?;
        if of.len() % 4 != 0 || strains.len() != 2 * of.len() {
            return Err("arrays `bonds/bond` and `bonds/strain` do not fit each other".into());
        }
        let mut places = Places::default();
        places.lay(grains);
        let bonds = of.as_chunks::<4>().0.iter().zip(strains.as_chunks::<8>().0);
        self.list = bonds
            .map(|(counts, numbers)| self.bond(counts, numbers, &places))
            .collect::<Result<_, String>>()?;
        Ok(())
    }

    fn bond(&self, counts: &[u64; 4], numbers: &[f64; 8], places: &Places) -> Result<Bond, String> {
        let &[i, j, cement, state] = counts;
        let &[rest, ux, uy, uz, tx, ty, tz, freed] = numbers;
        let wrong =
            || format!("array `bonds/bond` has a bond of grains {i} and {j} that cannot be");
        let mut ids = [0; 2];
        for (id, number) in ids.iter_mut().zip([i, j]) {
            *id = u32::try_from(number).map_err(|_| wrong())?;
        }
        let rows = ids.map(|id| places.of(id));
        let known = usize::try_from(cement).is_ok_and(|c| c < self.cements.len());
        let state = usize::try_from(state).ok().and_then(|s| STATES.get(s));
        let (Some(&state), true) = (state, known && i < j && !rows.contains(&GONE)) else {
            return Err(wrong());
        };
        if !numbers.iter().all(|x| x.is_finite()) {
            return Err("array `bonds/strain` is not finite".into());
        }
        Ok(Bond {
            ids,
            rows,
            cement: cement as u32,
            state,
            strain: Strain {
                rest,
                shear: Vector3::new(ux, uy, uz),
                turn: Vector3::new(tx, ty, tz),
            },
            pull: Pull::default(),
            freed,
        })
    }
}
