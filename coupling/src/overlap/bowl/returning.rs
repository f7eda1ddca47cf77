//! What comes back when a side of the box moves outwards.
//!
//! Stored grains come back where the continuum has carried them, with their springs. Where it has sheared them by more than γ_max
//! since they were put by, in the mean over a cell, neighbours have been pulled apart and springs mean nothing: grains of a stored
//! sheared packing come in their place, if the bowl was given any ([`Bowl::set_packings`]). That one is taken whose ln p and ln I are
//! nearest to those of the continuum there. It is turned so that the directions of its largest and least rate of stretching are those
//! of the continuum's mean rate there, or of the shear so far where it rests (whose axes lie a few degrees from those of its rate, and whose sense of rotation is
//! not known), and its rotation has the same sense; it is cut to what
//! lies nearer to a grain that it comes for than to any other, and below the continuum's surface; grains at its rim that lie deep in
//! others are left out. Velocities are the continuum's at
//! the place of each grain with the fluctuations of the packing, spins half the curl with the packing's. Nothing is scaled; by how
//! much its mass is another the continuum takes up (`settlement.rs`).

use super::gradients::{gradient_at, rotation, shear_rate};
use super::room::{make_room, too_deep};
use super::store::{Store, shear_of};
use super::{Bowl, OverlapError};
use colluvium_dem::preparation::ShearedCell;
use colluvium_dem::{Patch, Simulation};
use nalgebra::{Matrix3, Rotation3, Vector3};
use rstar::RTree;
use rstar::primitives::GeomWithData;

/// Farthest that the centre of a new grain may lie from one that it comes for, in diameters: holes of a bed are no wider.
const REACH: f64 = 0.9;
/// Overlap over the sum of radii at which a grain at the rim of a piece is left out, and what may be left of it after room was made.
const DEEP: f64 = 0.2;
const TOO_DEEP: f64 = 0.02;
/// I below which the continuum rests.
const RESTS: f64 = 1e-4;

/// What the continuum does where grains are wanted.
#[derive(Clone, Copy, Debug, Default)]
struct Local {
    gradient: Matrix3<f64>,
    stretch: Matrix3<f64>,
    pressure: f64,
    inertial: f64,
}

impl Bowl {
    /// Gives the bowl packings in steady shear, for what has been sheared while it was stored.
    pub fn set_packings(&mut self, packings: Vec<ShearedCell>) {
        self.packings = packings;
    }

    /// Puts stored grains back, or others in the place of those sheared too far; says how many were moved to make room, and how
    /// many others came. `below` says what lies in the shell and is kept as it comes back.
    pub(super) fn bring_back(
        &mut self,
        mut coming: Store,
        heights: &[f64],
        below: impl Fn(&Vector3<f64>) -> bool,
        simulation: &mut Simulation,
    ) -> Result<[f64; 2], OverlapError> {
        let lost = self.lost(&coming);
        let lost = coming.split(|id, _| lost.binary_search(&id).is_ok());
        let mut kept = coming.clone();
        let mut patch = coming.patch;
        for grain in &mut patch.grains {
            grain.spin = Vector3::zeros();
        }
        let mut displaced = self.fit(&mut patch);
        simulation.put_back(&patch)?;
        let mut replaced = 0.0;
        if !lost.patch.ids.is_empty() {
            self.sighting.look(simulation);
            let mut piece = self.piece(&lost, heights);
            self.leave_out(&mut piece, DEEP);
            displaced += self.fit(&mut piece);
            self.leave_out(&mut piece, TOO_DEEP);
            let piece = Store::fresh(simulation.put_in(&piece)?);
            replaced = piece.patch.ids.len() as f64;
            kept.merge(&piece);
        }
        let shell = kept.split(|_, g| below(&g.position));
        self.journey.store.merge(&shell);
        Ok([displaced, replaced])
    }

    /// Numbers of those grains whose cells have been sheared too far.
    fn lost(&self, coming: &Store) -> Vec<u32> {
        let most = self.spec.growth.map_or(f64::INFINITY, |g| g.misplaced);
        if self.packings.is_empty() || most == f64::INFINITY {
            return Vec::new();
        }
        let cells = &self.layout.cells;
        let cell_of = |at: &Vector3<f64>| {
            let place = |k: usize| {
                let most = cells.counts[k] - 1;
                (cells.offset(k, at[k]).max(0.0) as usize).min(most)
            };
            cells.cell([0, 1, 2].map(place))
        };
        let mut sums = vec![[0.0; 2]; cells.count()];
        for (grain, stretch) in coming.rows() {
            let sum = &mut sums[cell_of(&grain.position)];
            sum[0] += shear_of(&stretch);
            sum[1] += 1.0;
        }
        let ids = coming.patch.ids.iter().zip(coming.rows());
        let lost = ids.filter(|(_, (grain, _))| {
            let [shear, count] = sums[cell_of(&grain.position)];
            !grain.fixed && shear > most * count
        });
        lost.map(|(id, _)| *id).collect()
    }

    /// Means over the places of grains.
    fn local(&self, lost: &Store) -> Local {
        let (cells, law) = (&self.layout.cells, &self.spec.law);
        let mut mean = Local::default();
        let share = 1.0 / lost.patch.ids.len() as f64;
        for (grain, stretch) in lost.rows() {
            let hats = cells.hats(&grain.position);
            mean.gradient += share * gradient_at(&self.view, &self.gradients, &hats);
            mean.stretch += share * stretch;
            let full = hats.iter().filter(|(cell, _)| self.view.is_full(*cell));
            let trace = |(cell, hat): &(usize, f64)| hat * self.view.stress[*cell].trace();
            mean.pressure -= share * full.map(trace).sum::<f64>() / 3.0;
        }
        mean.pressure = mean.pressure.max(f64::MIN_POSITIVE);
        mean.inertial =
            shear_rate(&mean.gradient) * law.diameter * (law.grain_density / mean.pressure).sqrt();
        mean
    }

    /// A piece of the packing that suits, in the place of these grains.
    fn piece(&self, lost: &Store, heights: &[f64]) -> Patch {
        let local = self.local(lost);
        let near = |packing: &ShearedCell| {
            let ways = [
                packing.pressure / local.pressure,
                packing.inertial / local.inertial.max(RESTS),
            ];
            ways.iter().map(|way| way.ln().powi(2)).sum::<f64>()
        };
        let packings = self.packings.iter();
        let Some(packing) = packings.min_by(|a, b| near(a).total_cmp(&near(b))) else {
            return Patch::default();
        };
        let rate = match local.inertial > RESTS {
            true => 0.5 * (local.gradient + local.gradient.transpose()),
            false => local.stretch,
        };
        let frame = frame_of(&rate, &rotation(&local.gradient));
        let entry =
            |at: &Vector3<f64>, is_lost: bool| GeomWithData::new([at.x, at.y, at.z], is_lost);
        let grains = &lost.patch.grains;
        let own = grains.iter().map(|g| entry(&g.position, true));
        let there = self.sighting.snapshot.grains.iter();
        let there = there.map(|g| entry(&g.position, false));
        let store = self
            .stored()
            .grains
            .iter()
            .map(|g| entry(&g.position, false));
        let tree = RTree::bulk_load(own.chain(there).chain(store).collect());
        let reach = REACH * self.spec.law.diameter;
        let corner = |pick: fn(f64, f64) -> f64, first: f64| {
            let all = grains.iter().map(|g| g.position);
            all.fold(Vector3::repeat(first), |most, at| most.zip_map(&at, pick))
        };
        let low = corner(f64::min, f64::INFINITY).map(|x| x - reach);
        let high = corner(f64::max, f64::NEG_INFINITY).map(|x| x + reach);
        let cells = &self.layout.cells;
        let keep = |at: &Vector3<f64>| {
            let column = |axis: usize| {
                let most = cells.counts[axis] - 1;
                (cells.offset(axis, at[axis]).max(0.0) as usize).min(most)
            };
            let surface = heights[column(0) + cells.counts[0] * column(1)];
            let place: [f64; 3] = (*at).into();
            let nearest = tree.nearest_neighbor(&place);
            cells.offset(2, at.z) <= surface
                && nearest.is_some_and(|entry| {
                    let way = Vector3::from(*entry.geom()) - at;
                    entry.data && way.norm() <= reach
                })
        };
        let middle = 0.5 * (low + high);
        let mut piece = packing.cut(&frame, &middle, [low, high], keep);
        for grain in &mut piece.grains {
            let hats = cells.hats(&grain.position);
            grain.velocity += self.view.velocity_at(&hats).unwrap_or_default();
            grain.spin += rotation(&gradient_at(&self.view, &self.gradients, &hats));
        }
        piece
    }

    /// Leaves grains of a piece out that overlap one that is there, or one before them, deeper than this.
    fn leave_out(&self, piece: &mut Patch, most: f64) {
        let there = self.sighting.snapshot.grains.iter();
        let there: Vec<_> = there.map(|g| (g.position, g.radius)).collect();
        let goes = too_deep(&piece.grains, &there, most);
        let ids: Vec<u32> = piece.ids.clone();
        piece.split(|id, _| ids.binary_search(&id).is_ok_and(|k| goes[k]));
    }

    /// Makes room for a patch among the grains that are there; says how many grains of it were moved.
    fn fit(&self, patch: &mut Patch) -> f64 {
        let there = self.sighting.snapshot.grains.iter();
        let there: Vec<_> = there.map(|g| (g.position, g.radius)).collect();
        let (low, size, allowed) = (self.spec.low, self.spec.size, self.journey.overlaps);
        let inside = |at: &mut Vector3<f64>, radius: f64| {
            // Walls are as stiff as half of a pair: grains lie at most as deep in them.
            let reach = (1.0 - 2.0 * allowed.deepest) * radius;
            for axis in 0..2 {
                at[axis] = at[axis].clamp(low[axis] + reach, low[axis] + size[axis] - reach);
            }
            at.z = at.z.max(low[2] + reach);
        };
        let room = make_room(&mut patch.grains, &there, allowed, inside);
        room.moved
    }
}

/// The turn that takes a simple shear dv_x/dz > 0 to one whose extension and compression lie along the largest and least axes of a
/// rate of stretching, of the two that do the one that rotates as asked for.
fn frame_of(rate: &Matrix3<f64>, rotation: &Vector3<f64>) -> Rotation3<f64> {
    let eigen = rate.symmetric_eigen();
    let mut order = [0, 1, 2];
    order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
    let [extends, _, shortens] = order.map(|k| eigen.eigenvectors.column(k).into_owned());
    // v_x = γ̇ z stretches along x + z, shortens along z − x and rotates about y.
    let about = shortens.cross(&extends);
    let shortens = if about.dot(rotation) < 0.0 {
        -shortens
    } else {
        shortens
    };
    let half = 0.5_f64.sqrt();
    let (along, across) = (half * (extends - shortens), half * (extends + shortens));
    let columns = Matrix3::from_columns(&[along, across.cross(&along), across]);
    Rotation3::from_matrix_unchecked(columns)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_turns_a_simple_shear_onto_another() {
        let shear = Matrix3::new(0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        for angles in [[0.0; 3], [0.3, -1.0, 2.0], [3.0, 0.5, -0.4]] {
            let turn = Rotation3::from_euler_angles(angles[0], angles[1], angles[2]);
            let turned = turn * shear * turn.inverse();
            let rate = 0.5 * (turned + turned.transpose());
            let frame = frame_of(&rate, &rotation(&turned));
            let back = frame * shear * frame.inverse();
            assert!((back - turned).norm() < 1e-12, "{angles:?} {back}");
            assert!((frame.matrix().determinant() - 1.0).abs() < 1e-12);
        }
    }
}
