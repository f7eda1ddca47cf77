//! Which velocities are unknowns over ground.
//!
//! Over ground a cell is active if more than half of what is free of it is filled, together with the
//! cells that share its pressure. A thin layer on a slope has no unknown for its component along the axis that the
//! ground's normal leans to most; that one is what the others give times the slope.

use super::layers::EMPTY;
use super::{DUST, Ground};
use crate::free_surface::faces::{ACTIVE, Face, Faces, NOBODY, THINNEST_LAYER, ThinLayer};
use crate::free_surface::topology::{NONE, Topology};
use crate::free_surface::transport::MASSLESS;

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
pub(crate) fn faces_over<const D: usize>(
    ground: &Ground<D>,
    topology: &Topology<D>,
    fractions: &[f64],
    acceleration: [f64; D],
    thin_layer: ThinLayer,
) -> Faces<D> {
    let mut faces = Faces {
        shares: Some(std::array::from_fn(|c| vec![[1.0; D]; topology.faces(c)])),
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
    let mut waiting: [Vec<Waiting>; D] = std::array::from_fn(|_| Vec::new());
    for (component, waiting) in waiting.iter_mut().enumerate() {
        for face in 0..topology.faces(component) {
            let (role, waits) = own_role(
                &mut faces, ground, topology, fractions, thin_layer, component, face,
            );
            faces.role[component].push(role);
            waiting.push(waits);
        }
    }
    let none = || std::array::from_fn(|_| Vec::new());
    let mut shares = faces.shares.replace(none()).unwrap_or_else(none);
    let mut lying = Vec::new();
    for (j, &(component, face)) in faces.own.iter().enumerate() {
        if !faces.is_thin[j] {
            shares[component][face] = ground.swell(component, face);
        }
    }
    for (component, waiting) in waiting.iter().enumerate() {
        for (face, waits) in waiting.iter().enumerate() {
            match *waits {
                Waiting::No => {}
                Waiting::Host { else_still } => {
                    let host = faces.host(topology, fractions, component, face);
                    if let Some(host) = host
                        && !(ground.open[component][face]
                            && faces.hangs(topology, fractions, component, face, host))
                    {
                        faces.role[component][face] = Face::Follows(host);
                        if ground.touches(topology, component, face) {
                            shares[component][face] = if faces.is_thin[host] {
                                [1.0; D]
                            } else {
                                ground.shares(component, face, faces.own[host])
                            };
                        }
                    } else if else_still {
                        faces.role[component][face] = Face::Still;
                    } else if D > 2
                        && lies_on_something(&faces, ground, topology, fractions, component, face)
                    {
                        lying.push((component, face));
                    }
                }
                Waiting::Layer => {
                    let movers =
                        layers_beside(&faces, ground, topology, fractions, (component, face));
                    faces.role[component][face] = if movers[0].0 == NONE {
                        Face::Still
                    } else {
                        faces.sliders.push(movers);
                        Face::Slides(faces.sliders.len() - 1)
                    };
                }
            }
        }
    }
    for own in lying {
        faces.role[own.0][own.1] = faces.take(own.0, own.1, false, NONE);
    }
    faces.shares = Some(shares);
    faces.land(topology, fractions);
    faces
}

/// Whether material at a face along the ground lies on cells with a pressure or on ground, with no face to follow: what
/// lies on faces that are shut. It has friction on what is below, and must not fly.
fn lies_on_something<const D: usize>(
    faces: &Faces<D>,
    ground: &Ground<D>,
    topology: &Topology<D>,
    fractions: &[f64],
    component: usize,
    face: usize,
) -> bool {
    let last = D - 1;
    component != last
        && topology.face_mean(component, face, fractions) > EMPTY
        && topology.face_cells[component][face].iter().any(|&cell| {
            let below = topology.cell_neighbours[cell][last][0];
            fractions[cell] > EMPTY
                && below != NONE
                && (ground.solid[below] > 0.0 || faces.pressure[ground.master[below]] != NONE)
        })
}

fn own_role<const D: usize>(
    faces: &mut Faces<D>,
    ground: &Ground<D>,
    topology: &Topology<D>,
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
        if D > 2 && mass <= DUST {
            // Where some of it lies is a matter of round-off, and it must not fall for ever.
            return (Face::Loose, Waiting::Host { else_still: true });
        }
        let touches = cells.map(|cell| ground.wall[cell] != [0.0; D]);
        if touches == [false; 2] {
            let base = faces.material_under(topology, fractions, component, face);
            if base != NONE && open && ground.open[component][base] {
                let own = faces.take(component, face, false, base);
                return (own, Waiting::No);
            }
        }
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
    let own = faces.take(component, face, is_thin, NONE);
    (own, Waiting::No)
}

/// The thin layers of most mass, one for each other component, whose unknowns lie beside a face, and its velocity over
/// theirs.
fn layers_beside<const D: usize>(
    faces: &Faces<D>,
    ground: &Ground<D>,
    topology: &Topology<D>,
    fractions: &[f64],
    (component, face): (usize, usize),
) -> [(usize, f64); 2] {
    let mut movers = NOBODY;
    let mut count = 0;
    for other in (0..D).filter(|&other| other != component) {
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
                    best = Some((j, at));
                }
            }
        }
        let slope = best
            .and_then(|(j, at)| Some((j, ground.slope(topology, faces.acceleration, other, at)?)));
        // The layer has to lie on the slope that this face stands across.
        if let Some((j, slope)) = slope.filter(|(_, slope)| slope.axis == component) {
            movers[count] = (j, slope.rise[other]);
            count += 1;
        }
    }
    movers
}
