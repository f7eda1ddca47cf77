//! Heaps of grains as heights over x, and where they end.
//!
//! ```text
//! h(x) = Σ V_i w(x - x_i) / (φ W)        w(s) = (1 - |s|/b)/b for |s| < b, b = 2 Δx
//! ```
//! V_i volumes of grains, W width of the slab, φ solid fraction of the material before: the height that the
//! grains over x would have if they were packed as they were. It keeps the area: what an incompressible
//! continuum has too.

use crate::table::Table;

/// Places at which heights are taken: the middles of columns side by side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeapAxis {
    /// Where the first column begins (m).
    pub start: f64,
    /// Width of a column (m).
    pub spacing: f64,
    /// How many there are.
    pub columns: usize,
    /// Whether the start is a plane of symmetry: what is smeared beyond it comes back.
    pub mirrored: bool,
}

impl HeapAxis {
    /// Middles of the columns (m).
    pub fn positions(&self) -> Vec<f64> {
        let place = |i: usize| self.start + (i as f64 + 0.5) * self.spacing;
        (0..self.columns).map(place).collect()
    }

    /// Heights (m) of grains, each a place along x (m) and a volume (m³); `base` is φ W (m).
    pub fn heights(&self, grains: impl IntoIterator<Item = [f64; 2]>, base: f64) -> Vec<f64> {
        let mut heights = vec![0.0; self.columns];
        let last = self.columns as i64 - 1;
        for [x, volume] in grains {
            let at = (x - self.start) / self.spacing - 0.5;
            let first = at.floor() as i64 - 1;
            for column in first..first + 4 {
                // Over columns Δx apart the weights of a hat 2 Δx wide on each side add up to 1/Δx.
                let weight = 0.5 * (1.0 - 0.5 * (column as f64 - at).abs()).max(0.0);
                let home = if column < 0 && self.mirrored {
                    -1 - column
                } else {
                    column
                };
                heights[home.clamp(0, last) as usize] += weight * volume / (base * self.spacing);
            }
        }
        heights
    }
}

/// The farthest x (m) at which a heap is as high as a threshold (m); that of a continuum's heap is found in
/// the same way.
pub fn edge(positions: &[f64], heights: &[f64], threshold: f64) -> f64 {
    let last = (0..heights.len()).rev().find(|&i| heights[i] >= threshold);
    match last {
        None => positions.first().copied().unwrap_or(0.0),
        Some(i) if i + 1 == heights.len() => positions[i],
        Some(i) => {
            let share = (heights[i] - threshold) / (heights[i] - heights[i + 1]);
            positions[i] + (positions[i + 1] - positions[i]) * share
        }
    }
}

/// The place (m) up to which a share of a heap's area lies, in columns side by side with these middles (m). Near the end of a heap
/// it is what `edge` is without hanging on the last grains.
pub fn place_of_share(positions: &[f64], heights: &[f64], share: f64) -> f64 {
    let spacing = match positions {
        [first, second, ..] => second - first,
        _ => 0.0,
    };
    let mut left = share * heights.iter().sum::<f64>();
    for (x, h) in positions.iter().zip(heights) {
        if left <= *h && *h > 0.0 {
            return x + (left / h - 0.5) * spacing;
        }
        left -= h;
    }
    positions.last().map_or(0.0, |x| x + 0.5 * spacing)
}

/// Height of a profile (places and heights, m) between the places at which it is known; 0 beyond them (m).
pub fn height_at((x, h): &(Vec<f64>, Vec<f64>), at: f64) -> f64 {
    let after = x.partition_point(|place| *place < at);
    match (after.checked_sub(1), x.get(after)) {
        (_, None) => 0.0,
        (None, Some(_)) => h[0],
        (Some(before), Some(_)) => {
            let share = (at - x[before]) / (x[after] - x[before]);
            h[before] + share * (h[after] - h[before])
        }
    }
}

/// ∫|h_1 − h_2| w dx over ∫h_1 w dx, at the places of the first.
pub fn apart(
    first: &(Vec<f64>, Vec<f64>),
    second: &(Vec<f64>, Vec<f64>),
    weight: impl Fn(f64) -> f64,
) -> f64 {
    let rows = || first.0.iter().zip(&first.1);
    let miss: f64 = rows()
        .map(|(&x, h)| weight(x) * (h - height_at(second, x)).abs())
        .sum();
    miss / rows().map(|(&x, h)| weight(x) * h).sum::<f64>()
}

/// What was seen of a heap in time; it lives in the memory of a recipe.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HeapCourse {
    /// Solid fraction of the material before.
    pub solid_fraction: f64,
    /// Looks in a row at which everything rested.
    pub resting: f64,
    /// Time (s), front (m), greatest height (m).
    pub fronts: Vec<[f64; 3]>,
    /// Times (s) with the heights of all columns (m).
    pub profiles: Vec<(f64, Vec<f64>)>,
}

/// Numbers before the fronts.
const HEAD: usize = 3;

impl HeapCourse {
    /// What a memory holds of a heap with so many columns; none at the start.
    pub fn read(memory: &[f64], columns: usize) -> Option<HeapCourse> {
        let &[solid_fraction, resting, fronts] = memory.get(..HEAD)? else {
            return None;
        };
        let end = HEAD + 3 * fronts as usize;
        let seen = memory.get(HEAD..end)?.as_chunks::<3>().0.to_vec();
        let rows = memory[end..].chunks_exact(columns + 1);
        Some(HeapCourse {
            solid_fraction,
            resting,
            fronts: seen,
            profiles: rows.map(|row| (row[0], row[1..].to_vec())).collect(),
        })
    }

    /// Puts it into a memory.
    pub fn write(&self, memory: &mut Vec<f64>) {
        memory.clear();
        memory.extend([self.solid_fraction, self.resting, self.fronts.len() as f64]);
        memory.extend(self.fronts.iter().flatten());
        for (time, heights) in &self.profiles {
            memory.push(*time);
            memory.extend(heights);
        }
    }

    /// What every heap writes: `front`, `deposit` and `profiles`, as the continuum's collapse does.
    pub fn tables(&self, positions: Vec<f64>, deposit: Vec<f64>) -> Vec<Table> {
        self.tables_along("x", positions, deposit)
    }

    /// The same along an axis of this name.
    pub fn tables_along(&self, axis: &str, positions: Vec<f64>, deposit: Vec<f64>) -> Vec<Table> {
        let mut rows: [Vec<f64>; 3] = Default::default();
        for (time, heights) in &self.profiles {
            rows[0].extend(std::iter::repeat_n(*time, heights.len()));
            rows[1].extend(&positions);
            rows[2].extend(heights);
        }
        let [times, places, heights] = rows;
        let column = |k: usize| self.fronts.iter().map(|f| f[k]).collect();
        vec![
            Table::new("front")
                .with("t", "s", column(0))
                .with(&format!("{axis}_front"), "m", column(1))
                .with("height", "m", column(2)),
            Table::new("deposit")
                .with(axis, "m", positions)
                .with("h", "m", deposit),
            Table::new("profiles")
                .with("t", "s", times)
                .with(axis, "m", places)
                .with("h", "m", heights),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const AXIS: HeapAxis = HeapAxis {
        start: 0.0,
        spacing: 0.5,
        columns: 40,
        mirrored: true,
    };

    #[test]
    fn heights_keep_the_volume_and_the_centre_of_mass() {
        let grains = [[0.1, 2.0], [0.77, 1.0], [7.3, 3.0], [11.02, 0.5]];
        let (base, places) = (0.6 * 4.0, AXIS.positions());
        let heights = AXIS.heights(grains, base);
        let sum: f64 = heights.iter().sum::<f64>() * AXIS.spacing * base;
        assert!((sum / 6.5 - 1.0).abs() < 1e-14, "{sum}");
        // A grain far from the mirror keeps its place.
        let alone = AXIS.heights([[7.3, 3.0]], base);
        let moment: f64 = alone.iter().zip(&places).map(|(h, x)| h * x).sum();
        assert!((moment / alone.iter().sum::<f64>() - 7.3).abs() < 1e-12);
        // A level layer is level up to the mirror.
        let layer = (0..4000).map(|k| [0.0025 * (f64::from(k) + 0.5), 1e-3]);
        let heights = AXIS.heights(layer, 1.0);
        let exact = 1e-3 / 0.0025;
        assert!(heights[..18].iter().all(|h| (h / exact - 1.0).abs() < 1e-3));
    }

    #[test]
    fn edges_lie_where_the_heap_falls_below_the_threshold() {
        let (x, h) = ([0.5, 1.5, 2.5, 3.5], [2.0, 1.0, 0.5, 0.0]);
        assert_eq!(edge(&x, &h, 0.25), 3.0);
        assert_eq!(edge(&x, &h, 1.0), 1.5);
        assert_eq!(edge(&x, &[1.0; 4], 0.5), 3.5);
        assert_eq!(edge(&x, &h, 3.0), 0.5);
    }

    #[test]
    fn a_share_of_the_area_hangs_little_on_the_last_grain() {
        let (x, flat) = ([0.5, 1.5, 2.5, 3.5, 4.5], [2.0, 2.0, 1.0, 0.0, 0.0]);
        assert_eq!(place_of_share(&x, &flat, 0.8), 2.0);
        assert_eq!(place_of_share(&x, &flat, 1.0), 3.0);
        assert_eq!(place_of_share(&x, &flat, 0.9), 2.5);
        // One grain far in front moves it by its share of the area, and the edge all the way.
        let far = [2.0, 2.0, 1.0, 0.0, 0.025];
        assert!((place_of_share(&x, &far, 0.9) - 2.5225).abs() < 1e-12);
        assert!(edge(&x, &far, 0.02) - edge(&x, &flat, 0.02) > 1.0);
    }

    #[test]
    fn a_course_is_remembered() {
        let course = HeapCourse {
            solid_fraction: 0.57,
            resting: 2.0,
            fronts: vec![[0.0, 1.0, 2.0], [0.1, 1.1, 1.9]],
            profiles: vec![(0.0, vec![1.0, 2.0, 3.0]), (0.5, vec![0.5, 1.5, 2.5])],
        };
        let mut memory = vec![1.0];
        course.write(&mut memory);
        assert_eq!(HeapCourse::read(&memory, 3), Some(course));
        assert_eq!(HeapCourse::read(&[], 3), None);
    }

    #[test]
    fn deposits_are_compared_by_the_area_between_them() {
        let flat = (vec![0.5, 1.5, 2.5, 3.5], vec![1.0, 1.0, 1.0, 0.0]);
        assert_eq!(apart(&flat, &flat, |_| 1.0), 0.0);
        let higher = (flat.0.clone(), vec![1.5, 1.0, 0.5, 0.0]);
        assert!((apart(&flat, &higher, |_| 1.0) - 1.0 / 3.0).abs() < 1e-14);
        assert_eq!(height_at(&higher, 2.0), 0.75);
        assert_eq!(
            (height_at(&higher, 0.0), height_at(&higher, 9.0)),
            (1.5, 0.0)
        );
    }
}
