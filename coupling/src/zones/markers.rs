//! Pieces of material that move with the continuum and remember what it was wrong about.

use super::{Concern, Look, Oracle};
use colluvium_continuum::free_surface::CellFields;

/// A piece of material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Marker {
    /// Where it was at the start (m).
    pub start: [f64; 2],
    /// Where it is (m).
    pub place: [f64; 2],
    /// Its volume over the width of the slab (m²).
    pub volume: f64,
    /// Misplaced strain so far, by what was the worst concern while it was made.
    pub misplaced: [f64; 4],
}

impl Marker {
    /// Misplaced strain, all concerns together.
    pub fn total(&self) -> f64 {
        self.misplaced.iter().sum()
    }
}

/// Markers of all material, one for each cell of a grid that held any at the start.
#[derive(Clone, Debug, PartialEq)]
pub struct Markers {
    /// The markers.
    pub list: Vec<Marker>,
    spacing: [f64; 2],
    /// Lower corner of cell (0, 0) (m).
    corner: [f64; 2],
}

impl Markers {
    /// One marker for each cell, at its centre along x and in the middle of its filled part.
    pub fn new(fields: &[CellFields]) -> Self {
        let spacing = fields
            .first()
            .map_or([1.0; 2], |f| [0, 1].map(|a| f.upper[a] - f.lower[a]));
        let least = |a: usize| fields.iter().map(|f| f.lower[a]).fold(f64::MAX, f64::min);
        let list = fields
            .iter()
            .map(|f| {
                let place = [
                    0.5 * (f.lower[0] + f.upper[0]),
                    f.lower[1] + 0.5 * f.fraction * spacing[1],
                ];
                Marker {
                    start: place,
                    place,
                    volume: f.fraction * spacing[0] * spacing[1],
                    misplaced: [0.0; 4],
                }
            })
            .collect();
        Self {
            list,
            spacing,
            corner: [least(0), least(1)],
        }
    }

    /// Moves on by a time dt (s) in which the continuum looks like these fields; `floor` is the height of a rough
    /// floor (m).
    pub fn follow(&mut self, fields: &[CellFields], oracle: &Oracle, floor: Option<f64>, dt: f64) {
        let sight = Sight::new(self, fields);
        for marker in &mut self.list {
            if let Some(cell) = sight.cell(marker.place)
                && cell.flows
            {
                let look = Look {
                    inertial_number: oracle
                        .law
                        .inertial_number(cell.strain_rate, cell.pressure.max(f64::MIN_POSITIVE)),
                    thickness: sight.flowing_thickness(marker.place[0]),
                    above_floor: floor.map(|floor| marker.place[1] - floor),
                };
                let (error, concern) = oracle.worst(&look);
                marker.misplaced[concern.index()] += error * cell.strain_rate * dt;
            }
            let velocity = sight.velocity(marker.place);
            for axis in [0, 1] {
                marker.place[axis] += velocity[axis] * dt;
            }
            if let Some(floor) = floor {
                marker.place[1] = marker.place[1].max(floor);
            }
        }
    }

    /// The farthest x (m) at the start behind which no material has moved by more than a length (m).
    pub fn still(&self, length: f64) -> f64 {
        let moved = |m: &&Marker| {
            let way = [0, 1].map(|a| m.place[a] - m.start[a]);
            way[0].hypot(way[1]) > length
        };
        let first = self.list.iter().filter(moved).map(|m| m.start[0]);
        let first = first.fold(f64::INFINITY, f64::min);
        let behind = self.list.iter().map(|m| m.start[0]);
        behind.filter(|x| *x < first).fold(0.0, f64::max)
    }

    /// Volume that has misplaced more strain than a tolerance, by the concern that took the largest part (m²).
    pub fn needy(&self, tolerance: f64) -> [f64; 4] {
        let mut volumes = [0.0; 4];
        for marker in self.list.iter().filter(|m| m.total() > tolerance) {
            let first = Concern::ALL
                .into_iter()
                .max_by(|a, b| marker.misplaced[a.index()].total_cmp(&marker.misplaced[b.index()]));
            if let Some(concern) = first {
                volumes[concern.index()] += marker.volume;
            }
        }
        volumes
    }
}

/// Fields by cell.
struct Sight<'a> {
    cells: Vec<Option<&'a CellFields>>,
    columns: usize,
    thickness: Vec<f64>,
    spacing: [f64; 2],
    corner: [f64; 2],
}

impl<'a> Sight<'a> {
    fn new(markers: &Markers, fields: &'a [CellFields]) -> Self {
        let (spacing, corner) = (markers.spacing, markers.corner);
        let index = |f: &CellFields, a: usize| ((f.lower[a] - corner[a]) / spacing[a]).round();
        let most = |a: usize| fields.iter().map(|f| index(f, a)).fold(0.0, f64::max) as usize + 1;
        let (columns, rows) = (most(0), most(1));
        let mut cells = vec![None; columns * rows];
        let mut thickness = vec![0.0; columns];
        // Material below or left of where there was any at the start has no place here: its floor and wall are there.
        for f in fields
            .iter()
            .filter(|f| index(f, 0) >= 0.0 && index(f, 1) >= 0.0)
        {
            let (i, k) = (index(f, 0) as usize, index(f, 1) as usize);
            cells[k * columns + i] = Some(f);
            if f.flows {
                thickness[i] += f.fraction * spacing[1];
            }
        }
        Self {
            cells,
            columns,
            thickness,
            spacing,
            corner,
        }
    }

    fn at(&self, i: isize, k: isize) -> Option<&'a CellFields> {
        let (i, k) = (usize::try_from(i).ok()?, usize::try_from(k).ok()?);
        let row = (i < self.columns).then_some(k * self.columns + i)?;
        self.cells.get(row).copied().flatten()
    }

    /// Coordinates in cells.
    fn scaled(&self, place: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|a| (place[a] - self.corner[a]) / self.spacing[a])
    }

    fn cell(&self, place: [f64; 2]) -> Option<&'a CellFields> {
        let [x, z] = self.scaled(place).map(|u| u.floor() as isize);
        self.at(x, z)
    }

    fn flowing_thickness(&self, x: f64) -> f64 {
        let column = self.scaled([x, 0.0])[0].max(0.0) as usize;
        self.thickness.get(column).copied().unwrap_or(0.0)
    }

    /// Bilinear between the centres of cells with material; zero where there is none around (m/s).
    fn velocity(&self, place: [f64; 2]) -> [f64; 2] {
        let centred = self.scaled(place).map(|u| u - 0.5);
        let low = centred.map(f64::floor);
        let share = [0, 1].map(|a| centred[a] - low[a]);
        let (mut sum, mut weight) = ([0.0; 2], 0.0);
        for (i, k) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            let Some(cell) = self.at(low[0] as isize + i, low[1] as isize + k) else {
                continue;
            };
            let along = |a: usize, far: isize| if far == 1 { share[a] } else { 1.0 - share[a] };
            let w = along(0, i) * along(1, k);
            weight += w;
            for (s, v) in sum.iter_mut().zip(cell.velocity) {
                *s += w * v;
            }
        }
        match weight > 0.0 {
            true => sum.map(|s| s / weight),
            false => [0.0; 2],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use colluvium_continuum::rheology::MuI;

    fn oracle() -> Oracle {
        Oracle {
            law: MuI {
                mu_s: 0.5,
                mu_2: 0.9,
                i_0: 0.5,
                diameter: 0.01,
                solid_fraction: 0.5,
                grain_density: 2000.0,
                cohesion: 0.0,
            },
            window: Some([0.1, 0.5]),
            covariance: None,
        }
    }

    /// Cells of 0.1 m, filled to x < 1 and z < 0.5 shifted along x, that turn about a centre at a rate, and
    /// shear at a rate.
    fn fields(turn: f64, strain_rate: f64, pressure: f64) -> Vec<CellFields> {
        let cell = |(i, k): (usize, usize)| {
            let lower = [0.1 * i as f64, 0.1 * k as f64];
            let centre = lower.map(|x| x + 0.05);
            CellFields {
                lower,
                upper: lower.map(|x| x + 0.1),
                fraction: 1.0,
                velocity: [-turn * (centre[1] - 1.0), turn * (centre[0] - 1.0)],
                pressure,
                stress: [0.0; 2],
                strain_rate,
                flows: strain_rate > 0.0,
                well_posed: true,
            }
        };
        (0..20)
            .flat_map(|k| (0..20).map(move |i| cell((i, k))))
            .collect()
    }

    #[test]
    fn markers_turn_with_the_material() {
        let cells = fields(1.0, 0.0, 100.0);
        let mut markers = Markers::new(&cells);
        let steps = 4000;
        let dt = 2.0 * std::f64::consts::PI / steps as f64;
        for _ in 0..steps {
            markers.follow(&cells, &oracle(), None, dt);
        }
        // Bilinear velocities are exact here; what is left is the step's own error, dt/2 a radian.
        let off = |m: &&Marker| (m.start[0] - 1.0).hypot(m.start[1] - 1.0) < 0.9;
        for m in markers.list.iter().filter(off) {
            let miss = (m.place[0] - m.start[0]).hypot(m.place[1] - m.start[1]);
            assert!(miss < 0.006, "{m:?}");
            assert_eq!(m.total(), 0.0);
        }
    }

    #[test]
    fn what_has_not_moved_ends_where_something_has() {
        let mut markers = Markers::new(&fields(0.0, 0.0, 100.0));
        assert!((markers.still(0.01) - 1.95).abs() < 1e-12);
        for m in markers.list.iter_mut().filter(|m| m.start[0] > 1.2) {
            m.place[1] -= 0.02;
        }
        assert!((markers.still(0.01) - 1.15).abs() < 1e-12);
        assert!((markers.still(0.03) - 1.95).abs() < 1e-12);
        for m in &mut markers.list {
            m.place[0] += 0.1;
        }
        assert_eq!(markers.still(0.01), 0.0);
    }

    #[test]
    fn strain_outside_the_window_is_misplaced_and_strain_inside_is_not() {
        let oracle = oracle();
        // I = γ̇ d √(ρ_s/p): 5 · 0.01 · √(2000/p) = 0.25 or 1.
        for (pressure, number) in [(80.0, 0.25), (5.0, 1.0)] {
            let cells = fields(0.0, 5.0, pressure);
            let mut markers = Markers::new(&cells);
            for _ in 0..10 {
                markers.follow(&cells, &oracle, None, 0.02);
            }
            let thick = (0.48 * 0.01_f64 / 2.0).powi(2);
            let error = (1.0 - oracle.law.mu(0.5) / oracle.law.mu(1.0)).max(thick);
            let expected = if number > 0.5 { error } else { thick };
            for m in &markers.list {
                assert!((m.total() - expected).abs() < 1e-12, "I = {number}: {m:?}");
            }
            let needy = markers.needy(0.01);
            assert_eq!(needy[Concern::Window.index()] > 3.99, number > 0.5);
        }
    }
}
