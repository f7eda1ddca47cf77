//! Which velocities are unknowns over ground.
//!
//! Over ground a cell is active if more than half of what is free of it is filled, together with the
//! cells that share its pressure. A thin layer on a slope has one unknown for its two components, the
//! one along the axis that the slope leans to; the other one is that times the slope.

use super::Ground;
use crate::free_surface::faces::{ACTIVE, Face, Faces, THINNEST_LAYER, ThinLayer, weight_onto};
use crate::free_surface::topology::{NONE, Topology};
use crate::free_surface::transport::MASSLESS;
use crate::grid::DIMENSIONS;

/// Cells with less material count as empty beside a thin layer.
const EMPTY: f64 = 1e-9;

/// How a thin layer lies on a slope, seen from the component of its unknown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Slope {
    /// Rise of the ground along the other axis per length along that of the unknown.
    pub rise: f64,
    /// Gravity towards the ground along the other axis.
    pub press: f64,
    /// Weight onto the ground per mass over |n|, n the component of its normal along the other axis.
    pub weight: f64,
}

impl Ground {
    /// The slope under a face, if ground lies beside it and leans to the axis of its component.
    pub(crate) fn slope(
        &self,
        topology: &Topology,
        acceleration: [f64; DIMENSIONS],
        component: usize,
        face: usize,
    ) -> Option<Slope> {
        let mut normal = [0.0; DIMENSIONS];
        for &cell in &topology.face_cells[component][face] {
            if cell != NONE {
                for (n, wall) in normal.iter_mut().zip(self.wall[cell]) {
                    *n += wall;
                }
            }
        }
        let length = normal[0].hypot(normal[1]);
        if length == 0.0 {
            return None;
        }
        let other = 1 - component;
        let [own, across] = [normal[component] / length, normal[other] / length];
        if own.abs() > across.abs() || (own.abs() == across.abs() && component == 1) {
            return None;
        }
        let rise = -own / across;
        let towards = -(acceleration[component] * own + acceleration[other] * across);
        let is_above = across < 0.0;
        Some(Slope {
            rise,
            press: weight_onto(&acceleration, other, usize::from(is_above)),
            weight: towards.max(0.0) / across.abs(),
        })
    }

    /// Thickness of material and of material and ground together along an axis, in cells, at a cell:
    /// with the cells on both sides of it, as a layer on a slope may cross rows.
    pub(crate) fn thickness(
        &self,
        topology: &Topology,
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

    /// Rise of the surface of a thin layer across a face, in cells along `axis`. Ground that stands out
    /// beside it does not push it.
    pub(crate) fn surface_rise(
        &self,
        topology: &Topology,
        fractions: &[f64],
        axis: usize,
        [low, high]: [usize; 2],
    ) -> f64 {
        let [[low_filled, low_level], [high_filled, high_level]] =
            [low, high].map(|cell| self.thickness(topology, fractions, axis, cell));
        let rise = high_level - low_level;
        if (high_filled <= EMPTY && rise > 0.0) || (low_filled <= EMPTY && rise < 0.0) {
            0.0
        } else {
            rise
        }
    }
}

/// What a face without a role of its own waits for.
#[derive(Clone, Copy, PartialEq)]
enum Waiting {
    /// Nothing.
    No,
    /// A face to follow; without one it stands still or flies.
    Host { else_still: bool },
    /// A thin layer to slide with.
    Layer,
}

/// Roles of faces over ground.
pub(crate) fn faces_over(
    ground: &Ground,
    topology: &Topology,
    fractions: &[f64],
    acceleration: [f64; DIMENSIONS],
    thin_layer: ThinLayer,
) -> Faces {
    let mut faces = Faces {
        shares: Some([0, 1].map(|c| vec![[1.0; 2]; topology.faces(c)])),
        ..Faces::empty(topology.cells(), acceleration)
    };
    for cell in 0..topology.cells() {
        if ground.master[cell] != cell {
            continue;
        }
        let [mut filled, mut free] = [fractions[cell], ground.free[cell]];
        for part in ground.parts_of(cell) {
            filled += fractions[part];
            free += ground.free[part];
        }
        if filled > ACTIVE * free {
            faces.pressure[cell] = faces.active.len();
            faces.active.push(cell);
        }
    }
    let mut waiting: [Vec<Waiting>; DIMENSIONS] = Default::default();
    for (component, waiting) in waiting.iter_mut().enumerate() {
        for face in 0..topology.faces(component) {
            let (role, waits) = own_role(
                &mut faces, ground, topology, fractions, thin_layer, component, face,
            );
            faces.role[component].push(role);
            waiting.push(waits);
        }
    }
    let mut shares = faces.shares.take().unwrap_or_default();
    for (j, &(component, face)) in faces.own.iter().enumerate() {
        if !faces.is_thin[j] {
            shares[component][face] = [ground.swell(component, face), 1.0];
        }
    }
    for (component, waiting) in waiting.iter().enumerate() {
        for (face, waits) in waiting.iter().enumerate() {
            match *waits {
                Waiting::No => {}
                Waiting::Host { else_still } => {
                    if let Some(host) = faces.host(topology, fractions, component, face) {
                        faces.role[component][face] = Face::Follows(host);
                        if ground.touches(topology, component, face) {
                            shares[component][face] = if faces.is_thin[host] {
                                [1.0; 2]
                            } else {
                                ground.shares(component, face, faces.own[host])
                            };
                        }
                    } else if else_still {
                        faces.role[component][face] = Face::Still;
                    }
                }
                Waiting::Layer => {
                    let found = layer_beside(&faces, topology, fractions, component, face);
                    let slope = found.and_then(|j| {
                        let (other, beside) = faces.own[j];
                        Some((j, ground.slope(topology, acceleration, other, beside)?))
                    });
                    faces.role[component][face] = match slope {
                        Some((j, slope)) => {
                            shares[component][face] = [slope.rise; 2];
                            Face::Slides(j)
                        }
                        None => Face::Still,
                    };
                }
            }
        }
    }
    faces.shares = Some(shares);
    faces
}

fn own_role(
    faces: &mut Faces,
    ground: &Ground,
    topology: &Topology,
    fractions: &[f64],
    thin_layer: ThinLayer,
    component: usize,
    face: usize,
) -> (Face, Waiting) {
    let cells = topology.face_cells[component][face];
    if cells.contains(&NONE) || ground.aperture[component][face] == 0.0 {
        return (Face::Still, Waiting::No);
    }
    let open = ground.open[component][face];
    let free = Waiting::Host { else_still: !open };
    let is_thin = cells
        .iter()
        .all(|&cell| faces.pressure[ground.master[cell]] == NONE);
    if is_thin {
        let mass = topology.face_mean(component, face, fractions);
        let touches = cells.map(|cell| ground.wall[cell] != [0.0; DIMENSIONS]);
        if mass <= MASSLESS || touches == [false; 2] || thin_layer == ThinLayer::Following {
            return (Face::Loose, free);
        }
        if thin_layer == ThinLayer::Frozen || mass < THINNEST_LAYER {
            return (Face::Still, Waiting::No);
        }
        let Some(slope) = ground.slope(topology, faces.acceleration, component, face) else {
            let outer = cells[usize::from(touches[0])];
            return if touches == [true; 2] || fractions[outer] <= EMPTY {
                (Face::Still, Waiting::Layer)
            } else {
                (Face::Loose, free)
            };
        };
        // On a steep slope a face above all material has nothing to bring down.
        let along = faces.acceleration[component];
        let upper = cells[usize::from(along < 0.0)];
        if along.abs() > slope.press && fractions[upper] <= EMPTY {
            return (Face::Loose, Waiting::Host { else_still: true });
        }
    } else if !open {
        return (Face::Loose, free);
    }
    faces.own.push((component, face));
    faces.is_thin.push(is_thin);
    (Face::Own(faces.own.len() - 1), Waiting::No)
}

/// The thin layer of most mass whose unknown lies beside a face of the other component.
fn layer_beside(
    faces: &Faces,
    topology: &Topology,
    fractions: &[f64],
    component: usize,
    face: usize,
) -> Option<usize> {
    let other = 1 - component;
    let beside = topology.face_cells[component][face]
        .iter()
        .flat_map(|&cell| topology.cell_faces[cell][other]);
    let mut best = None;
    let mut most = 0.0;
    for at in beside.filter(|&at| at != NONE) {
        if let Face::Own(j) = faces.role[other][at] {
            let mass = topology.face_mean(other, at, fractions);
            if faces.is_thin[j] && mass > most {
                most = mass;
                best = Some(j);
            }
        }
    }
    best
}
