//! How broken a cliff is when its grains become a continuum.

/// How broken the cliff was at the hand-over: what a continuum cannot tell.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Broken {
    /// Steps made up to the first hand-over, and grains of the face.
    pub counts: [f64; 2],
    /// Share of the contacts before the crack that still held.
    pub held: f64,
    /// How far the sintered part had turned forward (degrees).
    pub turned: f64,
    /// Share of the bonds that the crack left that were whole; not a number where there were none.
    pub bonds: f64,
    /// Columns of the boulders' table.
    pub boulders: Vec<Vec<f64>>,
}

impl Broken {
    /// Appends it to a memory.
    pub fn write(&self, memory: &mut Vec<f64>) {
        memory.extend(self.counts);
        memory.extend([self.held, self.turned, self.bonds]);
        let rows = self.boulders.first().map_or(0, Vec::len);
        memory.extend([self.boulders.len() as f64, rows as f64]);
        memory.extend(self.boulders.iter().flatten());
    }

    /// Reads it from the front of a memory, and says what follows.
    pub fn read(memory: &[f64]) -> Option<(Broken, &[f64])> {
        let (&[steps, grains, held, turned, bonds, columns, rows], rest) =
            memory.split_first_chunk::<7>()?;
        let (columns, rows) = (columns as usize, rows as usize);
        let (numbers, rest) = rest.split_at_checked(columns * rows)?;
        let boulders = (0..columns).map(|c| numbers[c * rows..(c + 1) * rows].to_vec());
        Some((
            Broken {
                counts: [steps, grains],
                held,
                turned,
                bonds,
                boulders: boulders.collect(),
            },
            rest,
        ))
    }
}
