//! Grains made clumps.

use super::{ALONE, Clump, Member, State};
use crate::bodies::MassProperties;
use crate::grains::vector;
use crate::setup::{SetupError, check};
use crate::simulation::Simulation;
use nalgebra::{Matrix3, Vector3};

impl Simulation {
    /// Lets grains move as clumps from now on, each as its grains do in the mean: their spins, and their velocities
    /// less the turning. Forces on the grains of this instant are not looked at.
    ///
    /// # Errors
    /// If a grain is not there, is fixed, or is in a clump already, a clump has no grains, no distribution of
    /// mass has such an inertia, or the box moves. Nothing has changed then.
    pub fn clump(&mut self, clumps: &[Clump]) -> Result<(), SetupError> {
        self.refuse_in_moving_box("clumps, their number", clumps.len())?;
        let mut rows: Vec<u32> = vec![ALONE; self.next_id as usize];
        for (row, &id) in self.grains.id.iter().enumerate() {
            let free = !self.grains.is_fixed(row) && !self.clumps.carry(row);
            rows[id as usize] = if free { row as u32 } else { ALONE };
        }
        let mut made = Vec::new();
        for (k, clump) in clumps.iter().enumerate() {
            let key = format!("clumps[{k}]");
            let count = clump.grains.len() as f64;
            check(
                &format!("{key}.grains, their number"),
                count,
                "≥ 1",
                |n| n >= 1.0,
            )?;
            let mut own = Vec::new();
            for &grain in &clump.grains {
                let found = rows.get_mut(grain as usize);
                let row = found.map_or(ALONE, |row| std::mem::replace(row, ALONE));
                let word = "the number of a free grain that is in no clump yet";
                check(&format!("{key}.grains"), f64::from(grain), word, |_| {
                    row != ALONE
                })?;
                own.push((grain, row as usize));
            }
            made.push(self.make_clump(&own, clump.mass, &key)?);
        }
        self.forget_observation();
        for (state, own) in &made {
            let share = |m: &Member| self.grains.place[m.row as usize][3].powi(3);
            let whole: f64 = own.iter().map(share).sum();
            for member in own {
                let share = share(member) / whole;
                let row = member.row as usize;
                self.grains.mass[row] = state.mass * share;
                self.grains.motion[row][3] = 1.0 / state.mass;
            }
        }
        let mut all = self.clumps.take();
        all.append(&mut made);
        self.clumps.lay(all);
        self.clumps_changed();
        Ok(())
    }

    /// A clump of grains by number and row.
    fn make_clump(
        &self,
        of: &[(u32, usize)],
        mass: Option<MassProperties>,
        key: &str,
    ) -> Result<(State, Vec<Member>), SetupError> {
        let first = vector(&self.grains.place[of[0].1]);
        let place = |row: usize| {
            let apart = vector(&self.grains.place[row]) - first;
            first + self.domain.nearest_image(apart)
        };
        let properties = mass.unwrap_or_else(|| {
            let ball = |&(_, row): &(u32, usize)| {
                let (m, radius) = (self.grains.mass[row], self.grains.place[row][3]);
                MassProperties {
                    mass: m,
                    centre: place(row),
                    inertia: Matrix3::identity() * (0.4 * m * radius * radius),
                }
            };
            MassProperties::sum(&of.iter().map(ball).collect::<Vec<_>>())
        });
        properties.validate(key)?;
        let (orientation, moments) = properties.principal();
        // Grains are inside the box; a centre that is given may be beside it.
        let centre = first + self.domain.nearest_image(properties.centre - first);
        let spin_of = |row: usize| vector(&self.grains.turn[row]) * self.grains.turn[row][3];
        let count = of.len() as f64;
        let spin = of
            .iter()
            .map(|&(_, row)| spin_of(row))
            .sum::<Vector3<f64>>()
            / count;
        let drift = |&(_, row): &(u32, usize)| {
            vector(&self.grains.motion[row]) - spin.cross(&(place(row) - centre))
        };
        let velocity = of.iter().map(drift).sum::<Vector3<f64>>() / count;
        let own = orientation.inverse_transform_vector(&spin);
        let state = State {
            mass: properties.mass,
            moments,
            place: centre,
            orientation,
            velocity,
            momentum: orientation * own.component_mul(&moments),
            members: 0..of.len(),
        };
        let member = |&(grain, row): &(u32, usize)| {
            let arm = place(row) - centre;
            Member {
                grain,
                row: row as u32,
                at: orientation.inverse_transform_vector(&arm),
                arm,
                ..Member::default()
            }
        };
        Ok((state, of.iter().map(member).collect()))
    }
}
