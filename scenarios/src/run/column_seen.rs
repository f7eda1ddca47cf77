//! What was seen of a column of grains alone: its heap in time, and what a joint would have to carry.
//!
//! A column joined to a continuum is judged by one of grains alone; the force through the material surface at which it would be
//! joined is part of that (`coupling::overlap::material_edge::Witness`).

use super::heap::HeapCourse;
use super::joined_column::JoinedColumn;
use crate::failure::Failure;
use crate::scene::CollapseScene;
use colluvium_coupling::overlap::material_edge::Witness;
use colluvium_dem::Simulation;

/// What lives in the memory of the recipe.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct SeenColumn {
    /// The heap.
    pub course: HeapCourse,
    /// Looks at the surface of the joint, and the sum of the forces through it (N).
    looks: [f64; 2],
    /// Labels of the grains; empty before the first look and where no joint has room.
    labels: Vec<f64>,
}

/// Numbers in front of the labels: how many they are, and the looks.
const HEAD: usize = 3;

impl SeenColumn {
    /// Nothing yet, of a packing of this solid fraction.
    pub fn of_packing(solid_fraction: f64) -> Self {
        let course = HeapCourse {
            solid_fraction,
            ..HeapCourse::default()
        };
        Self {
            course,
            ..Self::default()
        }
    }

    /// What a memory holds of a heap with so many columns; none at the start.
    pub fn read(memory: &[f64], columns: usize) -> Option<Self> {
        let (head, rest) = memory.split_at_checked(HEAD)?;
        let (labels, course) = rest.split_at_checked(head[0] as usize)?;
        Some(Self {
            course: HeapCourse::read(course, columns)?,
            looks: [head[1], head[2]],
            labels: labels.to_vec(),
        })
    }

    /// Puts it into a memory.
    pub fn write(&self, memory: &mut Vec<f64>) {
        let mut course = Vec::new();
        self.course.write(&mut course);
        memory.clear();
        memory.extend([self.labels.len() as f64, self.looks[0], self.looks[1]]);
        memory.extend(&self.labels);
        memory.append(&mut course);
    }

    /// Looks at what goes through the surface of a joint, if this column has room for one.
    ///
    /// # Errors
    /// If the law that its continuum would have cannot be read.
    pub fn through_joint(
        &mut self,
        scene: &CollapseScene,
        simulation: &mut Simulation,
    ) -> Result<(), Failure> {
        if !scene.has_room_for_a_joint() {
            return Ok(());
        }
        let specs = JoinedColumn::new(scene, "").specs(self.course.solid_fraction)?;
        // Of two edges the one on the wall's side is looked at, of one that one.
        let Some(&spec) = specs.first() else {
            return Ok(());
        };
        let mut witness = match self.labels.is_empty() {
            true => Witness::new(spec, simulation),
            false => Witness::of(spec, std::mem::take(&mut self.labels)),
        };
        self.looks[0] += 1.0;
        self.looks[1] += witness.look(simulation).sum();
        self.labels = witness.into_numbers();
        Ok(())
    }

    /// Mean force through the surface (N).
    pub fn force(&self) -> Option<f64> {
        let [looks, sum] = self.looks;
        (looks > 0.0).then(|| sum / looks)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_seen_is_remembered() {
        let mut seen = SeenColumn::of_packing(0.57);
        seen.course.fronts = vec![[0.0, 1.0, 2.0]];
        let mut memory = vec![3.0];
        seen.write(&mut memory);
        assert_eq!(SeenColumn::read(&memory, 2).as_ref(), Some(&seen));
        assert_eq!(seen.force(), None);
        (seen.labels, seen.looks) = (vec![0.5, -1.0], [2.0, 30.0]);
        seen.write(&mut memory);
        assert_eq!(SeenColumn::read(&memory, 2).as_ref(), Some(&seen));
        assert_eq!(seen.force(), Some(15.0));
        assert_eq!(SeenColumn::read(&[], 2), None);
    }
}
