//! Plane walls: the same contact laws with a partner of infinite mass and radius.

use crate::contact::{HISTORY_MAX, Interaction, Lever, Step, Touch};
use crate::grains::Grains;
use crate::lanes::Vec3;
use crate::neighbours::Row;
use nalgebra::Vector3;

/// A resting plane; grains live on the side its normal points to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// A point of the plane (m).
    pub point: Vector3<f64>,
    /// Unit normal, into the grains.
    pub normal: Vector3<f64>,
    /// Number of its material in the law table.
    pub material: u16,
}

impl Plane {
    /// Distance of a point in front of the plane (m).
    pub fn distance(&self, x: &Vector3<f64>) -> f64 {
        (x - self.point).dot(&self.normal)
    }
}

/// A grain near a plane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlaneContact {
    pub grain: u32,
    pub plane: u32,
    pub history: [f64; HISTORY_MAX],
    /// Force, moment of the tangential force, further moment on the grain.
    pub slot: [[f64; 4]; 3],
}

/// All grains that may touch a plane before the Verlet list is built again.
#[derive(Clone, Debug, Default)]
pub(crate) struct PlaneContacts {
    pub contacts: Vec<PlaneContact>,
    /// Contacts of grain g: `first(g)..first[g + 1]`; empty where there are no planes.
    first: Vec<u32>,
    /// For each row and plane, how far its nearest *unlisted* surface was at the build (m).
    clearance: Vec<f64>,
    old: Vec<PlaneContact>,
}

impl PlaneContacts {
    /// Contacts of a grain.
    #[inline(always)]
    pub fn of(&self, grain: usize) -> &[PlaneContact] {
        if self.first.is_empty() {
            return &[];
        }
        &self.contacts[self.first[grain] as usize..self.first[grain + 1] as usize]
    }

    /// Lists grains closer than `skin` to a plane; `new_index` says where old grains went.
    pub fn build(
        &mut self,
        planes: &[Plane],
        grains: &Grains,
        rows: &[Row],
        skin: f64,
        new_index: impl Fn(u32) -> u32,
    ) {
        if planes.is_empty() {
            return;
        }
        std::mem::swap(&mut self.contacts, &mut self.old);
        for c in &mut self.old {
            c.grain = new_index(c.grain);
        }
        self.old.sort_by_key(|c| (c.grain, c.plane));
        self.contacts.clear();
        self.first.clear();
        self.first.push(0);
        self.clearance.clear();
        for row in rows {
            let from = self.clearance.len();
            self.clearance.resize(from + planes.len(), f64::INFINITY);
            for g in row.start..row.end {
                let x = &grains.place[g as usize];
                for (p, plane) in planes.iter().enumerate() {
                    let gap = plane.distance(&crate::grains::vector(x)) - x[3];
                    if gap >= skin {
                        let nearest = &mut self.clearance[from + p];
                        *nearest = nearest.min(gap);
                        continue;
                    }
                    let key = (g, p as u32);
                    let known = self
                        .old
                        .binary_search_by_key(&key, |c| (c.grain, c.plane))
                        .ok();
                    self.contacts.push(PlaneContact {
                        grain: g,
                        plane: p as u32,
                        history: known.map_or([0.0; HISTORY_MAX], |k| self.old[k].history),
                        slot: [[0.0; 4]; 3],
                    });
                }
                self.first.push(self.contacts.len() as u32);
            }
        }
    }

    /// Restores the listed contacts of a checkpoint.
    pub fn restore(&mut self, contacts: Vec<PlaneContact>, clearance: Vec<f64>, grains: usize) {
        self.first.clear();
        if !clearance.is_empty() {
            self.first.resize(grains + 1, 0);
            for c in &contacts {
                self.first[c.grain as usize + 1] += 1;
            }
            for g in 0..grains {
                self.first[g + 1] += self.first[g];
            }
        }
        self.contacts = contacts;
        self.clearance = clearance;
    }

    /// See the field.
    pub fn clearance(&self) -> &[f64] {
        &self.clearance
    }

    /// Whether an unlisted grain may have reached a plane.
    pub fn outdated(&self, planes: &[Plane], rows: &[Row], travel: &[f64], age: f64) -> bool {
        if planes.is_empty() {
            return false;
        }
        rows.iter()
            .zip(travel)
            .zip(self.clearance.chunks_exact(planes.len()))
            .any(|((row, travel), clearance)| {
                planes.iter().zip(clearance).any(|(plane, clearance)| {
                    let w = Vector3::from(row.drift).dot(&plane.normal);
                    travel + w.abs() * age >= *clearance
                })
            })
    }

    /// Evaluates the law on all listed contacts; the largest overlap over the radius.
    pub fn evaluate<I: Interaction>(
        &mut self,
        law: &I,
        planes: &[Plane],
        grains: &Grains,
        lever: Lever,
        step: Step,
    ) -> f64 {
        let mut deepest: f64 = 0.0;
        for c in &mut self.contacts {
            let g = c.grain as usize;
            let (x, v, s) = (&grains.place[g], &grains.motion[g], &grains.turn[g]);
            let plane = &planes[c.plane as usize];
            let pair =
                usize::from(grains.material[g]) * law.materials() + usize::from(plane.material);
            let coefficients = &law.table()[pair];
            let distance = plane.distance(&crate::grains::vector(x));
            let overlap = x[3] - distance;
            let held = if I::HOLDS && c.history[I::HISTORY - 1] != 0.0 {
                law.hold(coefficients, s[3])
            } else {
                0.0
            };
            if overlap <= -held || v[3] == 0.0 {
                c.history = [0.0; HISTORY_MAX];
                c.slot = [[0.0; 4]; 3];
                continue;
            }
            let normal = Vec3([plane.normal.x, plane.normal.y, plane.normal.z]);
            let arm = match lever {
                Lever::ContactPoint => distance / x[3],
                Lever::Radius => 1.0,
            };
            let surface = Vec3([s[0], s[1], s[2]]).scale(arm);
            let touch = Touch {
                normal,
                overlap,
                velocity: Vec3([v[0], v[1], v[2]]) - surface.cross(normal),
                spin: Vec3([s[0], s[1], s[2]]).scale(s[3]),
                inverse_mass: v[3],
                curvature: s[3],
                inverse_inertia: v[3] * s[3] * s[3],
            };
            let wrench = law.wrench(coefficients, &touch, &mut c.history, step);
            let torque = wrench.tangential.cross(normal).scale(arm);
            c.slot = [wrench.force, torque, wrench.moment].map(|v| [v.0[0], v.0[1], v.0[2], 0.0]);
            deepest = deepest.max(overlap * s[3]);
        }
        deepest
    }
}
