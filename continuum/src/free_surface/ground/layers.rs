//! Thin layers on slopes, which slide as blocks.
//!
//! The ground's normal leans most to one axis m. A layer's velocity has the components along the other axes for
//! unknowns, u; the one along m is σ·u with σ the rise of the ground, so that a layer of mass m has the kinetic
//! energy ½ m u·G u, G = 1 + σ σᵀ. Gravity and the slope of its own surface η drive it with f = g − |g_m| ∇η, friction
//! holds it with μ g_n m G u/√(u·G u). Divided by G, which leaves a mass for each unknown:
//!
//! ```text
//! m du/dt = m d − μ g_n m s u/|u|,    d = G⁻¹ f = f − σ (σ·f)/(1 + σ²),    s = |d|/√(d·G d).
//! ```
//!
//! s is exact where a layer moves the way it is driven, and so is the limit of rest, √(d·G d) = μ g_n.

use super::shores::STANDS_OUT;
use super::{Contact, Ground, unit};
use crate::discretisation::{Parts, QuadraturePoint};
use crate::free_surface::faces::{Face, weight_onto};
use crate::free_surface::operators::Material;
use crate::free_surface::topology::{NONE, Topology};
use crate::strain::shear_row;
use crate::wall_friction::PointLaw;

/// Cells with less material count as empty beside a thin layer.
pub(super) const EMPTY: f64 = 1e-9;

/// A layer reaches a face if what it fills there is this part of what it fills of its cell.
const REACHES: f64 = 0.25;
/// A slope goes on if it changes by less than this part of itself from cell to cell.
const EVEN: f64 = 0.1;
/// How near to a face a layer has to be filled, in cells.
const BESIDE: f64 = 1e-3;

/// How a thin layer lies on a slope, seen from the component of one of its unknowns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Slope<const D: usize> {
    /// The axis that the ground's normal leans to most.
    pub axis: usize,
    /// Rise σ of the ground along that axis per length along each other one.
    pub rise: [f64; D],
    /// Gravity towards the ground along the axis, |g_m|.
    pub press: f64,
    /// Weight onto the ground per mass over |n|, n the component of its normal along the axis.
    pub weight: f64,
}

impl<const D: usize> Slope<D> {
    /// 1 + σ².
    fn stretch(&self) -> f64 {
        1.0 + self.rise.iter().map(|s| s * s).sum::<f64>()
    }

    /// d and s, from f.
    fn drive(&self, force: [f64; D]) -> ([f64; D], f64) {
        let dot = |a: [f64; D], b: [f64; D]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let lost = dot(self.rise, force) / self.stretch();
        let mut drive = [0.0; D];
        for (axis, drive) in drive.iter_mut().enumerate() {
            if axis != self.axis {
                *drive = force[axis] - self.rise[axis] * lost;
            }
        }
        let (square, along) = (dot(drive, drive), dot(self.rise, drive));
        let share = if square > 0.0 {
            (square / (square + along * along)).sqrt()
        } else {
            1.0 / self.stretch().sqrt()
        };
        (drive, share)
    }
}

impl<const D: usize> Ground<D> {
    /// The slope under a face, if ground lies beside it whose normal does not lean to its component most.
    pub(crate) fn slope(
        &self,
        topology: &Topology<D>,
        acceleration: [f64; D],
        component: usize,
        face: usize,
    ) -> Option<Slope<D>> {
        let normal = unit(self.normal_at(topology, component, face));
        let axis = (0..D).rev().reduce(|most, axis| {
            if normal[axis].abs() > normal[most].abs() {
                axis
            } else {
                most
            }
        })?;
        if normal[axis] == 0.0 || axis == component {
            return None;
        }
        let mut rise = normal.map(|n| -n / normal[axis]);
        rise[axis] = 0.0;
        let towards: f64 = -(0..D).map(|a| acceleration[a] * normal[a]).sum::<f64>();
        let is_above = normal[axis] < 0.0;
        Some(Slope {
            axis,
            rise,
            press: weight_onto(&acceleration, axis, usize::from(is_above)),
            weight: towards.max(0.0) / normal[axis].abs(),
        })
    }

    /// Thickness of material and of material and ground together along an axis, in cells, at a cell:
    /// with the cells on both sides of it, as a layer on a slope may cross rows.
    pub(crate) fn thickness(
        &self,
        topology: &Topology<D>,
        fractions: &[f64],
        axis: usize,
        cell: usize,
    ) -> [f64; 2] {
        let mut sums = [fractions[cell], fractions[cell] + self.solid[cell]];
        for (side, beside) in topology.cell_neighbours[cell][axis].into_iter().enumerate() {
            if beside != NONE {
                sums[0] += fractions[beside];
                sums[1] += fractions[beside] + self.solid[beside];
            } else if side == 0 {
                // Below the grid is ground.
                sums[1] += 1.0;
            }
        }
        sums
    }
}

impl<const D: usize, const C: usize> Material<'_, D, C> {
    /// Whether a cell belongs to a thin layer, whose friction acts on its unknowns alone.
    pub(super) fn has_layer(&self, cell: usize) -> bool {
        (0..D).any(|axis| {
            let pair = self.topology.cell_faces[cell][axis];
            pair.iter().any(|&face| {
                face != NONE
                    && match self.faces.role[axis][face] {
                        Face::Own(j) => self.faces.is_thin[j],
                        Face::Slides(_) => true,
                        _ => false,
                    }
            })
        })
    }

    /// Rise of the surface of a thin layer across a face between two cells along `along`, in cells along `axis`. Ground that
    /// stands out beside it does not push it, nor down the slope does matter that ends before the face: nothing would
    /// follow the velocity, which would grow for ever over matter at rest. (In a plane; in space what little reaches a face
    /// is a matter of round-off.)
    fn surface_rise(
        &self,
        ground: &Ground<D>,
        axis: usize,
        along: usize,
        [low, high]: [usize; 2],
    ) -> f64 {
        let [
            [low_filled, low_ground, low_level],
            [high_filled, high_ground, high_level],
        ] = [low, high].map(|cell| {
            let [filled, level] = ground.thickness(self.topology, self.fractions, axis, cell);
            let at_shore = self.level_at_shore(ground, axis, cell, level);
            [filled, level - filled, at_shore]
        });
        let rise = high_level - low_level;
        let step = high_filled - low_filled;
        let (thicker, side) = if step < 0.0 { (low, 1) } else { (high, 0) };
        let of_ground = high_ground - low_ground;
        if D == 2 && self.goes_on_down(ground, [axis, along], thicker, of_ground, step) {
            let reach = self.reach(ground, thicker, along, side);
            return of_ground + reach * (rise - of_ground);
        }
        if (high_filled <= EMPTY && rise > 0.0) || (low_filled <= EMPTY && rise < 0.0) {
            0.0
        } else {
            rise
        }
    }

    /// Whether ground that rises by so many cells to the next column does so as in a cell itself, and falls the way the
    /// thickness does by a step. Over an edge matter falls, whatever the planes beside it.
    fn goes_on_down(
        &self,
        ground: &Ground<D>,
        [axis, along]: [usize; 2],
        cell: usize,
        rise: f64,
        step: f64,
    ) -> bool {
        let spacing = |axis: usize| self.grid.axes()[axis].spacing();
        let wall = ground.wall[cell];
        let here = -wall[along] * spacing(along) / (wall[axis] * spacing(axis));
        rise * step.signum() > EMPTY && (here - rise).abs() <= EVEN * rise.abs()
    }

    /// How far the matter of a cell reaches its face on one side of an axis, from 0 to 1. Were it all or nothing, matter would
    /// stop where it just touches the face, and creep on with what little is there.
    fn reach(&self, ground: &Ground<D>, cell: usize, axis: usize, side: usize) -> f64 {
        let filled = self.fractions[cell];
        if filled <= EMPTY {
            return 0.0;
        }
        let (mut low, mut high) = ([0.0; 3], [1.0; 3]);
        if side == 1 {
            low[axis] = 1.0 - BESIDE;
        } else {
            high[axis] = BESIDE;
        }
        let share = ground.matter(cell, filled, self.planes[cell].as_ref(), low, high);
        let aperture = ground.aperture[axis][self.topology.cell_faces[cell][axis][side]];
        (aperture * share / (REACHES * filled)).min(1.0)
    }

    /// Height of the surface in the middle of a column of three cells with one in the middle, from its foot: that of matter
    /// and ground, `level`, but of the surface of matter where ground stands out of it in one of them and it leans to the
    /// axis most.
    fn level_at_shore(&self, ground: &Ground<D>, axis: usize, cell: usize, level: f64) -> f64 {
        let [below, above] = self.topology.cell_neighbours[cell][axis];
        let column = [below, cell, above].into_iter().enumerate();
        let mut at_shore = column
            .filter(|&(_, at)| at != NONE)
            .filter_map(|(row, at)| {
                let shore = self.shores.at(at).filter(|shore| shore.weight > 0.0)?;
                let lean = shore.fitted.normal[axis];
                let leans_most = shore.fitted.normal.iter().all(|n| n.abs() <= lean);
                (leans_most && ground.standing_out(at, &shore.fitted) > STANDS_OUT).then(|| {
                    let mut foot = [0.5; 3];
                    foot[axis] = 0.0;
                    let there = row as f64 + shore.fitted.depth(foot) / lean;
                    level + shore.weight * (there - level)
                })
            });
        at_shore.next().unwrap_or(level)
    }

    /// f at a face of a component, on a slope.
    fn force_on_layer(
        &self,
        ground: &Ground<D>,
        slope: &Slope<D>,
        component: usize,
        face: usize,
    ) -> [f64; D] {
        let spacing = |axis: usize| self.grid.axes()[axis].spacing();
        let rise = |low: usize, high: usize, along: usize| {
            self.surface_rise(ground, slope.axis, along, [low, high]) * spacing(slope.axis)
                / spacing(along)
        };
        let [low, high] = self.topology.face_cells[component][face];
        std::array::from_fn(|along| {
            let of_surface = if along == slope.axis {
                0.0
            } else if along == component {
                rise(low, high, along)
            } else {
                // The mean of those across the faces round the two cells.
                let (mut sum, mut count) = (0.0, 0.0);
                for cell in [low, high] {
                    let [before, after] = self.topology.cell_neighbours[cell][along];
                    for [from, to] in [[before, cell], [cell, after]] {
                        if from != NONE && to != NONE {
                            sum += rise(from, to, along);
                            count += 1.0;
                        }
                    }
                }
                if count > 0.0 { sum / count } else { 0.0 }
            };
            self.acceleration[along] - slope.press * of_surface
        })
    }

    /// Thin layers: what drives them, and the friction that holds them. The velocity along the other axis is the mean
    /// of those at the faces around, which bear their share of the friction.
    pub(super) fn add_layers<const V: usize>(
        &self,
        ground: &Ground<D>,
        heavy: &[f64],
        parts: &mut Parts<D, C, V>,
        places: &mut Vec<usize>,
    ) {
        for (j, &(component, face)) in self.faces.own.iter().enumerate() {
            if !self.faces.is_thin[j] {
                continue;
            }
            let slope = ground.slope(self.topology, self.acceleration, component, face);
            let Some(slope) = slope else { continue };
            let (drive, share) = slope.drive(self.force_on_layer(ground, &slope, component, face));
            // Gravity is a load on the mass of every unknown.
            parts.boundary_load[j] =
                heavy[j] * drive[component] - self.acceleration[component] * parts.mass[j];
            let axis = slope.axis;
            // What presses from outside acts on a surface as long as the ground below, of which each row bears the
            // share of what lies in it.
            let [mut thickness, mut outside] = [0.0; 2];
            for &cell in &self.topology.face_cells[component][face] {
                thickness += ground.thickness(self.topology, self.fractions, axis, cell)[0];
                outside += self.pressure_beyond(cell, 0.0);
            }
            let outside =
                outside * slope.stretch() / (thickness * self.grid.axes()[axis].spacing());
            let weight = slope.weight + outside;
            if ground.contact == Contact::FreeSlip || weight == 0.0 {
                continue;
            }
            let rate = 2.0 / self.grid.axes()[axis].spacing();
            let row = |along: usize| shear_row::<D>(along.min(axis), along.max(axis));
            // Half a cell deep over a whole face: weight times rate is the area under the layer.
            let mut point = QuadraturePoint::new(0.5 * self.grid.cell_volume());
            point.add_velocity(j, row(component), rate);
            let mut beside = 0.0;
            for other in (0..D).filter(|&other| other != component && other != axis) {
                for &cell in &self.topology.face_cells[component][face] {
                    for at in self.topology.cell_faces[cell][other] {
                        if at != NONE
                            && let Face::Own(k) = self.faces.role[other][at]
                            && self.faces.is_thin[k]
                        {
                            point.add_velocity(k, row(other), 0.25 * rate);
                            beside += 0.25;
                        }
                    }
                }
            }
            point.weight *= (1.0 - 0.5 * beside) * share / slope.stretch().sqrt();
            point.pressure_offset = heavy[j] / self.grid.face_area(axis) * weight;
            point.law = match ground.contact {
                Contact::Coulomb(friction) => PointLaw::OnWall(friction),
                _ => PointLaw::Material,
            };
            let [_, high] = self.topology.face_cells[component][face];
            parts.points.push(point);
            places.push(self.sliding.of_layer(self.fractions.len(), component, high));
        }
    }

    /// Pressure on the ground under a layer too thin to have one: that of its weight, and of what lies on it.
    pub(super) fn layer_weight(&self, ground: &Ground<D>, cell: usize) -> f64 {
        let axis = D - 1;
        let [thickness, _] = ground.thickness(self.topology, self.fractions, axis, cell);
        let spacing = self.grid.axes()[axis].spacing();
        thickness.min(1.0) * spacing * weight_onto(&self.acceleration, axis, 0)
            + self.pressure_beyond(cell, 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn slope(rise: [f64; 3]) -> Slope<3> {
        Slope {
            axis: 2,
            rise,
            press: 1.0,
            weight: 1.0,
        }
    }

    /// Down a plane in any direction a layer is driven by g sin θ along the plane and held by μ g cos θ.
    #[test]
    fn layers_are_driven_down_planes_of_any_direction() {
        for rise in [
            [0.4, 0.0, 0.0],
            [0.0, -0.7, 0.0],
            [0.3, 0.3, 0.0],
            [0.2, -0.5, 0.0],
        ] {
            let slope = slope(rise);
            let steepness = rise[0].hypot(rise[1]);
            // A layer of even thickness: the surface rises as the ground does.
            let (drive, share) = slope.drive([-rise[0], -rise[1], 0.0]);
            let along = drive[0].hypot(drive[1]) / share;
            let sine = steepness / steepness.hypot(1.0);
            assert!((along - sine).abs() < 1e-15, "{rise:?} {along} {sine}");
            assert!((share - 1.0 / steepness.hypot(1.0)).abs() < 1e-15);
        }
        // Along a valley's side, level that way, nothing is lost.
        let (drive, share) = slope([0.6, 0.0, 0.0]).drive([0.0, 0.3, 0.0]);
        assert_eq!((drive, share), ([0.0, 0.3, 0.0], 1.0));
    }
}
