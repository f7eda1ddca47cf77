//! Who gets bonded.

use super::bond::{Pull, Strain};
use super::{Bond, BondState, Cement};
use crate::grains::{SPHERE_INERTIA, vector};
use crate::neighbours::Neighbours;
use crate::region::Region;
use crate::setup::{SetupError, check};
use crate::simulation::Simulation;
use crate::timestep::{Limit, Pair};
use nalgebra::Vector3;
use std::collections::BTreeSet;

/// Which grains get bonded to each other.
#[derive(Clone, Debug, PartialEq)]
pub struct BondRule {
    /// What the bonds are made of.
    pub cement: Cement,
    /// Largest gap between surfaces over the mean of the two radii.
    pub gap: f64,
    /// Materials that bond to each other and among themselves; none given: all.
    pub materials: Vec<u16>,
    /// Where the contact point must lie.
    pub within: Region,
}

/// A pair to be bonded: numbers, rows, distance of centres (m).
struct Found {
    ids: [u32; 2],
    rows: [u32; 2],
    distance: f64,
}

impl Simulation {
    /// Bonds all pairs of grains that a rule is for, free of stress, and says how many.
    ///
    /// A pair that is bonded, or once was, gets no other bond: broken ones never heal.
    ///
    /// # Errors
    /// If a number is out of its range, a periodic axis too narrow for the gap, or the step too long
    /// for one of the bonds alone. Nothing has changed then.
    pub fn bond(&mut self, rule: &BondRule) -> Result<usize, SetupError> {
        rule.cement.validate()?;
        rule.within.validate("bonds.within")?;
        check("bonds.gap", rule.gap, "≥ 0", |v| v >= 0.0)?;
        for &material in &rule.materials {
            crate::setup::known_material(material, self.law.materials())?;
        }
        let found = self.pairs_to_bond(rule)?;
        self.check_bond_step(&rule.cement, &found)?;
        self.forget_observation();
        let cement = self.bonds.cements.len() as u32;
        self.bonds.cements.push(rule.cement);
        let bond = |pair: &Found| Bond {
            ids: pair.ids,
            rows: pair.rows,
            cement,
            state: BondState::Whole,
            strain: Strain {
                rest: pair.distance,
                ..Strain::default()
            },
            pull: Pull::default(),
            freed: 0.0,
        };
        self.bonds.list.extend(found.iter().map(bond));
        if self.ledger.is_some() {
            self.open_energy_ledger();
        }
        Ok(found.len())
    }

    /// Pairs that a rule is for, by their numbers.
    fn pairs_to_bond(&self, rule: &BondRule) -> Result<Vec<Found>, SetupError> {
        let grains = &self.grains;
        let radii = grains.place[..grains.len()].iter().map(|x| x[3]);
        let largest = radii.fold(0.0, f64::max);
        crate::setup::check_box(&self.domain, largest, rule.gap * largest)?;
        // A list of its own, with the gap for a skin: that of the run must stay what it is.
        let (mut sorted, mut list) = (grains.clone(), Neighbours::default());
        let cell = self.cell();
        list.build(&mut sorted, &cell, rule.gap * largest, false);
        let known: BTreeSet<[u32; 2]> = self.bonds.list.iter().map(|b| b.ids).collect();
        let bonds =
            |g: usize| rule.materials.is_empty() || rule.materials.contains(&sorted.material[g]);
        let mut found = Vec::new();
        for i in 0..sorted.len() {
            for &j in list.partners(i) {
                let (x, y) = (&sorted.place[i], &sorted.place[j as usize]);
                let (branch, _) = cell.nearest(vector(x) - vector(y));
                let (distance, sum) = (branch.norm(), x[3] + y[3]);
                let point = cell.wrap(vector(x) - branch * (x[3] / sum)).0;
                let mut ids = [sorted.id[i], sorted.id[j as usize]];
                ids.sort_unstable();
                if distance - sum <= 0.5 * rule.gap * sum
                    && bonds(i)
                    && bonds(j as usize)
                    && rule.within.contains(&point)
                    && !known.contains(&ids)
                {
                    found.push((ids, distance));
                }
            }
        }
        found.sort_by_key(|&(ids, _)| ids);
        let mut places = crate::places::Places::default();
        places.lay(grains);
        let found = found.into_iter().map(|(ids, distance)| Found {
            ids,
            rows: ids.map(|id| places.of(id)),
            distance,
        });
        Ok(found.collect())
    }

    /// Refuses bonds that blow up on their own.
    fn check_bond_step(&self, cement: &Cement, found: &[Found]) -> Result<(), SetupError> {
        let limits = found
            .iter()
            .map(|pair| self.bond_limit_of(cement, pair.rows));
        match limits.min_by(|a, b| a.seconds.total_cmp(&b.seconds)) {
            Some(limit) if self.timestep >= limit.seconds => Err(SetupError::Unstable {
                timestep: self.timestep,
                below: limit.seconds,
                limit: limit.name,
                pair: limit.pair,
                would_do: limit.step(),
            }),
            _ => Ok(()),
        }
    }

    fn bond_limit_of(&self, cement: &Cement, rows: [u32; 2]) -> Limit {
        let rows = rows.map(|row| row as usize);
        let inverse = |row: usize| {
            let (m, r) = (self.grains.motion[row][3], self.grains.turn[row][3]);
            [m, m * r * r / SPHERE_INERTIA]
        };
        let pair = Pair {
            materials: rows.map(|row| self.grains.material[row]),
            radii: rows.map(|row| self.grains.place[row][3]),
        };
        cement.limit_of(rows.map(inverse), pair)
    }

    /// The limit that the whole bonds set to the step, if there are any.
    pub fn bond_limit(&self) -> Option<Limit> {
        let bonds = self.bonds.whole();
        bonds
            .map(|bond| self.bond_limit_of(&self.bonds.cements[bond.cement as usize], bond.rows))
            .min_by(|a, b| a.seconds.total_cmp(&b.seconds))
    }

    /// Numbers of the grains of all bonds, the lower one first, with their states and contact points.
    pub fn bonds(&mut self) -> Vec<([u32; 2], BondState, Vector3<f64>)> {
        self.observe();
        let (grains, cell) = (&self.grains, self.cell());
        let show = |bond: &Bond| (bond.ids, bond.state, bond.middle(grains, &cell));
        self.bonds.list.iter().map(show).collect()
    }
}
