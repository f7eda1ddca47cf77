//! What there is of both sides, each counted on its own side of the handshake surfaces.

use super::view::View;
use super::{Continuum, GrainZone, MaterialEdge, Side};
use colluvium_continuum::free_surface::CellFields;
use colluvium_dem::{GrainSample, Simulation};

/// Parts of a cell along x that parcels speak of.
const PARTS: usize = 4;

impl Continuum {
    /// Between which places along its own axis totals count it, row by row (m).
    pub(super) fn counted(&self, edges: &[MaterialEdge]) -> Vec<[f64; 2]> {
        let Some((keeper, other)) = self.parted(edges) else {
            return Vec::new();
        };
        let begins = |row: usize| {
            let other = other.map(|other| -other.held.handshake[row]);
            other.unwrap_or(f64::NEG_INFINITY)
        };
        let ends = keeper.held.handshake.iter().enumerate();
        ends.map(|(row, end)| [begins(row), *end]).collect()
    }

    /// Fields of the cells with material, copies included, along x and z, each with whether totals count its middle.
    pub(super) fn fields(&self, counted: &[[f64; 2]]) -> Vec<(CellFields, bool)> {
        let (side, low) = (self.spec.side, self.cells.low);
        let turned = |mut cell: CellFields| {
            cell.lower[0] += low;
            cell.upper[0] += low;
            let row = cell.lower[1] / self.cells.spacing + self.cells.below as f64;
            let row = row.round() as usize;
            let middle = 0.5 * (cell.lower[0] + cell.upper[0]);
            let counted = counted.get(row);
            let counted = counted.is_none_or(|[begin, end]| middle >= *begin && middle < *end);
            if side == Side::Above {
                (cell.lower[0], cell.upper[0]) =
                    (side.along(cell.upper[0]), side.along(cell.lower[0]));
                cell.velocity = side.in_plane(cell.velocity);
                cell.stress = side.stress(cell.stress);
            }
            (cell, counted)
        };
        self.collapse.fields().into_iter().map(turned).collect()
    }

    /// The ground under each column of its cells along x and z (m), if it runs over ground.
    pub fn ground_outline(&self) -> Vec<[[f64; 2]; 4]> {
        let side = self.spec.side;
        let turned = |[x, z]: [f64; 2]| side.in_plane([x + self.spec.wall, z]);
        let pieces = self.collapse.ground_outline().into_iter();
        let mut pieces: Vec<[[f64; 2]; 4]> = pieces.map(|piece| piece.map(turned)).collect();
        if side == Side::Above {
            // Corners go round the same way.
            for [a, b, c, d] in &mut pieces {
                std::mem::swap(a, b);
                std::mem::swap(c, d);
            }
        }
        pieces
    }

    /// Depth of matter, copies included, over each column of cells, and their places along x (m).
    pub fn heights(&self) -> (Vec<f64>, Vec<f64>) {
        let (mut places, heights) = self.collapse.profile();
        for place in &mut places {
            *place = self.spec.side.along(*place + self.spec.wall);
        }
        (places, heights)
    }

    /// Height at a place along x (m); before the start of its grid that at its start, beyond its end 0.
    pub(super) fn height(&self, x: f64) -> f64 {
        let cell = (self.spec.side.along(x) - self.cells.low) / self.cells.spacing;
        let (_, heights) = self.collapse.profile();
        match cell >= 0.0 {
            true => heights.get(cell as usize).copied().unwrap_or(0.0),
            false => heights.first().copied().unwrap_or(0.0),
        }
    }

    /// Error of its volume against what it began with and its copies were given since, relative.
    pub(super) fn volume_error(&self, copied: f64) -> f64 {
        let now = self.collapse.flow().volume();
        let start = now / (1.0 + self.collapse.volume_drift());
        (now - start - copied) / start
    }

    /// Kinetic energy of what totals count, of the mean velocities of its cells (J).
    pub(super) fn kinetic(&self, view: &View, counted: &[[f64; 2]]) -> f64 {
        let columns = self.cells.counts[0];
        let cells = view.velocity.iter().zip(&view.fraction);
        let counted = cells.enumerate().filter(|(cell, _)| {
            let place = self.cells.centre(cell % columns);
            let [begin, end] = counted[cell / columns];
            place >= begin && place < end
        });
        let twice: f64 = counted.map(|(_, (u, f))| f * u.norm_squared()).sum();
        0.5 * self.spec.density() * self.cells.volume() * twice
    }

    /// What totals count, and what rests behind it, as parcels: places on its own axis (m) and volumes of grains in them (m³).
    pub(super) fn parcels(&self, counted: &[[f64; 2]]) -> Vec<[f64; 2]> {
        let [columns, rows] = self.cells.counts;
        let (h, solid) = (self.cells.spacing, self.spec.case.rheology.solid_fraction);
        let volume = self.cells.volume() * solid / PARTS as f64;
        let fractions = &self.collapse.flow().state().fractions;
        let resting = self.rest_mass / self.spec.case.rheology.grain_density;
        let slices = (PARTS as f64 * self.spec.wall / h).ceil();
        let mut parcels: Vec<[f64; 2]> = (0..slices as usize)
            .map(|slice| {
                let place = (slice as f64 + 0.5) / slices * self.spec.wall;
                [place, resting / slices]
            })
            .collect();
        for (k, [begin, end]) in counted.iter().enumerate().take(rows) {
            for i in 0..columns {
                let fraction = fractions[i + columns * k];
                if fraction <= 0.0 {
                    continue;
                }
                for part in 0..PARTS {
                    let low = self.cells.face(i) + part as f64 / PARTS as f64 * h;
                    let width = h / PARTS as f64;
                    let [from, to] = [begin, end].map(|at| ((at - low) / width).clamp(0.0, 1.0));
                    if to > from {
                        let middle = low + 0.5 * (from + to) * width;
                        parcels.push([middle, fraction * (to - from) * volume]);
                    }
                }
            }
        }
        parcels
    }
}

impl GrainZone {
    /// Whether totals count a grain (along x): it lies in front of the handshake surfaces of all edges that it belongs to, whose other side
    /// they count as continuum. By its label it would be counted where the continuum is too, once labels have mixed.
    pub fn counts(&self, grain: &GrainSample) -> bool {
        let mut known = self.edges.iter().filter_map(|e| e.is_in_front(grain));
        known.next() == Some(true) && known.all(|is_in_front| is_in_front)
    }

    /// The edges of a continuum.
    fn edges_of(&self, continuum: &Continuum) -> &[MaterialEdge] {
        self.edges.get(continuum.edges.clone()).unwrap_or_default()
    }

    /// Kinetic energy of the continua behind the handshake surfaces (J).
    pub fn continuum_kinetic(&self) -> f64 {
        let of = |continuum: &Continuum| {
            let edges = self.edges_of(continuum);
            let counted = continuum.counted(edges);
            let keeper = edges.get(continuum.keeper);
            keeper.map_or(0.0, |keeper| continuum.kinetic(&keeper.view, &counted))
        };
        self.continua.iter().map(of).sum()
    }

    /// Mass of the continua, copies included (kg).
    pub fn continuum_mass(&self) -> f64 {
        self.continua.iter().map(|continuum| continuum.mass).sum()
    }

    /// Fields of the cells with material of each continuum along x, copies included, each with whether totals count its middle.
    pub fn fields(&self) -> Vec<Vec<(CellFields, bool)>> {
        let of =
            |continuum: &Continuum| continuum.fields(&continuum.counted(self.edges_of(continuum)));
        self.continua.iter().map(of).collect()
    }

    /// Largest error of a continuum's volume, relative.
    pub fn volume_error(&self) -> f64 {
        let errors = self.continua.iter().map(|continuum| {
            let edges = self.edges_of(continuum).iter();
            continuum.volume_error(edges.map(|edge| edge.account.copied).sum())
        });
        errors.fold(0.0, |most: f64, error| match error.abs() > most.abs() {
            true => error,
            false => most,
        })
    }

    /// Mass of grains and of continua that totals count, over that of all grains at the start, less 1: what the
    /// handshake surfaces gained or lost by differences of both sides' motion.
    pub fn mass_error(&self, simulation: &Simulation) -> f64 {
        let mut masses: Vec<(u32, f64)> = simulation
            .held(|_| true)
            .filter(|g| self.counts(g))
            .map(|g| (g.id, g.mass))
            .collect();
        masses.sort_unstable_by_key(|m| m.0);
        let grains: f64 = masses.iter().map(|m| m.1).sum();
        let continuum = self.continua.iter().map(|continuum| {
            let parcels = continuum.parcels(&continuum.counted(self.edges_of(continuum)));
            let solid: f64 = parcels.iter().map(|[_, volume]| volume).sum();
            solid * continuum.spec.case.rheology.grain_density
        });
        (grains + continuum.sum::<f64>()) / self.own.mass - 1.0
    }

    /// The continua behind the handshake surfaces, and what rests behind them, as parcels: places along x (m) and volumes of
    /// grains in them (m³).
    pub fn parcels(&self) -> Vec<[f64; 2]> {
        let of = |continuum: &Continuum| {
            let side = continuum.spec.side;
            let parcels = continuum.parcels(&continuum.counted(self.edges_of(continuum)));
            let turned = parcels.into_iter();
            turned.map(move |[x, volume]| [side.along(x), volume])
        };
        self.continua.iter().flat_map(of).collect()
    }

    /// Height of a continuum, copies included, at a place along x (m); beyond the ends of its grid that at its ends.
    pub fn continuum_height(&self, x: f64) -> f64 {
        let heights = self.continua.iter().map(|continuum| continuum.height(x));
        heights.fold(0.0, f64::max)
    }

    /// Height up to which totals count grains over a place along x (m), as far as handshake surfaces bound them.
    pub fn grains_height(&self, x: f64) -> f64 {
        let before = |edge: &MaterialEdge| {
            let at = edge.spec.side.along(x);
            let rows = edge.held.handshake.iter().skip(edge.cells.below);
            rows.filter(|place| **place < at).count() as f64 * edge.cells.spacing
        };
        // Intervals of grains, one after the other, end at an edge above which continuum lies.
        let (mut most, mut own) = (0.0_f64, f64::INFINITY);
        for edge in &self.edges {
            match edge.spec.side {
                Side::Below => own = before(edge),
                Side::Above => most = most.max(own.min(before(edge))),
            }
        }
        match self.edges.last().map(|edge| edge.spec.side) {
            Some(Side::Below) => most.max(own),
            _ => most,
        }
    }
}
