//! What is remembered of a cliff between looks; it is part of checkpoints.

use crate::run::heap::HeapCourse;

/// When things happened, and how the cliff stood.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CliffTimes {
    /// When the crack opened (s); not a number before.
    pub opened: f64,
    /// When the part before the crack had sunk by the share of its height that counts as failure (s).
    pub failed: f64,
    /// How far it had sunk when the crack opened (m).
    pub sunk_standing: f64,
    /// Largest kinetic energy (J) and when (s).
    pub peak: [f64; 2],
    /// Grains that lost their cohesion.
    pub loosened: f64,
}

/// A grain of the part before the crack: number and place at the start (m).
pub type FaceGrain = [f64; 3];

/// The memory of a cliff.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CliffRecord {
    /// Times.
    pub times: CliffTimes,
    /// Grains before the crack at the start.
    pub face: Vec<FaceGrain>,
    /// Their contacts with each other when the crack opened, by numbers.
    pub pairs: Vec<[u32; 2]>,
    /// The heap in time.
    pub heap: HeapCourse,
}

/// Numbers before the lists.
const HEAD: usize = 8;

impl CliffRecord {
    /// What a memory holds, for a heap with so many columns; none at the start.
    pub fn read(memory: &[f64], columns: usize) -> Option<CliffRecord> {
        let &[
            opened,
            failed,
            sunk_standing,
            energy,
            when,
            loosened,
            face,
            pairs,
        ] = memory.get(..HEAD)?
        else {
            return None;
        };
        let (face, pairs) = (face as usize, pairs as usize);
        let first = HEAD + 3 * face;
        let second = first + 2 * pairs;
        let ids = memory.get(first..second)?.as_chunks::<2>().0.iter();
        Some(CliffRecord {
            times: CliffTimes {
                opened,
                failed,
                sunk_standing,
                peak: [energy, when],
                loosened,
            },
            face: memory[HEAD..first].as_chunks::<3>().0.to_vec(),
            pairs: ids.map(|pair| pair.map(|id| id as u32)).collect(),
            heap: HeapCourse::read(&memory[second..], columns)?,
        })
    }

    /// Puts it into a memory.
    pub fn write(&self, memory: &mut Vec<f64>) {
        let CliffTimes {
            opened,
            failed,
            sunk_standing,
            peak: [energy, when],
            loosened,
        } = self.times;
        let mut heap = Vec::new();
        self.heap.write(&mut heap);
        memory.clear();
        memory.extend([opened, failed, sunk_standing, energy, when, loosened]);
        memory.extend([self.face.len() as f64, self.pairs.len() as f64]);
        memory.extend(self.face.iter().flatten());
        memory.extend(self.pairs.iter().flatten().copied().map(f64::from));
        memory.extend(heap);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cliff_is_remembered() {
        let record = CliffRecord {
            times: CliffTimes {
                opened: 600.0,
                failed: 700.5,
                sunk_standing: 0.1,
                peak: [3.0, 800.0],
                loosened: 12.0,
            },
            face: vec![[3.0, 0.5, 20.0], [9.0, 1.5, 21.0]],
            pairs: vec![[3, 9]],
            heap: HeapCourse {
                solid_fraction: 0.33,
                resting: 1.0,
                fronts: vec![[0.0, 5.0, 30.0]],
                profiles: vec![(0.0, vec![30.0, 29.0])],
            },
        };
        let mut memory = vec![4.0];
        record.write(&mut memory);
        assert_eq!(CliffRecord::read(&memory, 2), Some(record));
        assert_eq!(CliffRecord::read(&[], 2), None);
    }
}
