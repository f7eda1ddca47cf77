//! The handshake surface in a column of grains alone: what a joined column is to be compared with.
//!
//! A law of yield says less than which stress a column has: grains press sideways by what their fabric bears, a coaxial μ(I) law by
//! what its motion makes of it. So the ratio of both sides' forces at a joint is the model's as much as the joint's. What the
//! joint alone does to its grains is the force through the same material surface with it, over that without:
//! a witness gives the grains of a whole column the labels that a cut at the same place would have given them,
//! follows the surface in the same way, and says what crosses it.

use super::labels::{Labels, NO_LABEL};
use super::{Cells, MaterialEdgeSpec};
use crate::overlap::sighting::Sighting;
use colluvium_dem::{GrainSample, Simulation};

/// Forces along x through a surface (N), on the side of larger x.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Through {
    /// Of the contacts that cross it.
    pub contacts: f64,
    /// Flux of momentum by velocities about the mean of a row.
    pub kinetic: f64,
}

/// Heights of the column that rows reach up to.
const TALL: f64 = 1.5;
/// Half width of the band of labels in which velocities are looked at, in diameters.
const BAND: f64 = 1.0;

impl Through {
    /// Through the surface at these places row by row (m) whose label is given (m).
    pub(super) fn of(
        sighting: &Sighting,
        (labels, cells): (&Labels, &Cells),
        (places, label): (&[f64], f64),
        diameter: f64,
    ) -> Self {
        let inside = |g: &GrainSample| labels.of(g).map(|_| is_before(g, cells, places));
        let contacts = sighting.crossing(inside).map(|(_, force)| force.x).sum();
        let half = BAND * diameter;
        let mut rows = vec![[0.0; 3]; cells.counts[1]];
        let near = |g: &&GrainSample| labels.of(g).is_some_and(|own| (own - label).abs() < half);
        for grain in sighting.snapshot.grains.iter().filter(near) {
            let u = grain.velocity.x;
            for (row, hat) in cells.rows(grain.position.z) {
                let m = hat * grain.mass;
                for (sum, part) in rows[row].iter_mut().zip([m, m * u, m * u * u]) {
                    *sum += part;
                }
            }
        }
        let rows = rows.iter().filter(|row| row[0] > 0.0);
        let twice: f64 = rows.map(|[m, p, e]| e - p * p / m).sum();
        Self {
            contacts,
            kinetic: twice / (2.0 * half),
        }
    }

    /// Both.
    pub fn sum(&self) -> f64 {
        self.contacts + self.kinetic
    }
}

/// Whether a grain lies in front of a surface at these places row by row (m).
pub(super) fn is_before(grain: &GrainSample, cells: &Cells, places: &[f64]) -> bool {
    let row = (grain.position.z / cells.spacing).max(0.0) as usize + cells.below;
    grain.position.x >= places[row.min(places.len() - 1)]
}

/// A column of grains alone, seen by where a joined one would be cut.
#[derive(Clone, Debug)]
pub struct Witness {
    spec: MaterialEdgeSpec,
    cells: Cells,
    labels: Labels,
    sighting: Sighting,
    /// Surfaces of the labels 0, ξ_m and ξ_a, row by row (m).
    surfaces: [Vec<f64>; 3],
}

impl Witness {
    /// Gives the grains of a settled column their labels.
    pub fn new(spec: MaterialEdgeSpec, simulation: &mut Simulation) -> Self {
        let mut sighting = Sighting::default();
        sighting.look_along(spec.side, simulation);
        let free = || sighting.snapshot.grains.iter().filter(|g| !g.fixed);
        let last = free().map(|g| g.id).max().unwrap_or(0) as usize;
        let mut given = vec![NO_LABEL; last + 1];
        for grain in free() {
            given[grain.id as usize] = grain.position.x - spec.place;
        }
        let mut witness = Self::around(spec, given);
        witness.sighting = sighting;
        witness
    }

    fn around(spec: MaterialEdgeSpec, given: Vec<f64>) -> Self {
        let h = spec.spacing();
        let cells = Cells {
            counts: [
                spec.case.cells.max(1),
                (TALL * spec.case.height / h).ceil() as usize + 1,
            ],
            low: spec.wall.min(0.0),
            below: 0,
            spacing: h,
            slab: spec.slab,
        };
        let labels = Labels {
            given,
            base: vec![spec.place; cells.counts[1]],
            edge: 0.0,
        };
        let [handshake, inner] = spec.zones();
        let surfaces =
            [0.0, handshake, inner].map(|label| vec![spec.place + label; cells.counts[1]]);
        Self {
            spec,
            cells,
            labels,
            sighting: Sighting::default(),
            surfaces,
        }
    }

    /// Looks at the grains as they are now, finds the surface anew and says what goes through it.
    pub fn look(&mut self, simulation: &mut Simulation) -> Through {
        self.sighting.look_along(self.spec.side, simulation);
        let [handshake, inner] = self.spec.zones();
        let at = [0.0, handshake, inner];
        let grains = &self.sighting.snapshot.grains;
        self.surfaces = at.map(|label| self.labels.surface(&self.cells, grains, label, &self.spec));
        let places = [0, 1, 2].map(|k| self.surfaces[k].as_slice());
        let shell = self.spec.settings.shell;
        self.labels.renew(&self.cells, grains, places, (at, shell));
        Through::of(
            &self.sighting,
            (&self.labels, &self.cells),
            (&self.surfaces[1], handshake),
            self.spec.case.rheology.diameter,
        )
    }

    /// Where the handshake surface would be, row by row (m).
    pub fn handshake(&self) -> &[f64] {
        &self.surfaces[1]
    }

    /// Labels, to go on from (m).
    pub fn into_numbers(self) -> Vec<f64> {
        self.labels.given
    }

    /// From such numbers.
    pub fn of(spec: MaterialEdgeSpec, labels: Vec<f64>) -> Self {
        Self::around(spec, labels)
    }
}
