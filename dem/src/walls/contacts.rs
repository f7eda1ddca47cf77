//! Grains near walls, and what the contact laws make of them.
//!
//! Grains closer to a wall than the skin are listed. The list lasts until a row of grains, or the wall, may
//! have used up the room that unlisted grains had; it may be made at any time without changing a bit, since
//! contacts that do not touch leave zeros. Steps cost only for grains that are listed.

use super::Standing;
use crate::contact::{HISTORY_MAX, Interaction, Lever, Step, Touch};
use crate::domain::Domain;
use crate::grains::{Grains, vector};
use crate::lanes::Vec3;
use crate::neighbours::Row;
use nalgebra::Vector3;

/// A grain near a wall.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WallContact {
    pub grain: u32,
    pub wall: u32,
    pub history: [f64; HISTORY_MAX],
    /// Force, moment of the tangential force, further moment on the grain.
    pub slot: [[f64; 4]; 3],
    /// Whether the law acts, or holds across a gap.
    pub touching: bool,
    /// Overlap (m) and unit normal into the grain, while it touches.
    pub overlap: f64,
    pub normal: [f64; 3],
}

impl WallContact {
    pub fn apart(grain: u32, wall: u32) -> WallContact {
        WallContact {
            grain,
            wall,
            history: [0.0; HISTORY_MAX],
            slot: [[0.0; 4]; 3],
            touching: false,
            overlap: 0.0,
            normal: [0.0; 3],
        }
    }

    fn part(&mut self) {
        *self = WallContact::apart(self.grain, self.wall);
    }

    fn key(&self) -> (u32, u32) {
        (self.grain, self.wall)
    }
}

/// Overlap, over the radius, at which a contact with a plate cannot begin: the grain was pressed through
/// from the other side, or put into the plate.
const THROUGH: f64 = 0.5;

/// What a step reads besides the walls.
#[derive(Clone, Copy)]
pub(crate) struct Scene<'a> {
    pub grains: &'a Grains,
    pub domain: &'a Domain,
    pub lever: Lever,
    pub step: Step,
}

/// Where and how a grain meets a wall.
struct Meeting {
    grain: usize,
    /// Centre, from the wall's origin.
    seen: Vector3<f64>,
    distance: f64,
    normal: Vector3<f64>,
}

/// How long a list has lasted: travel of rows and time since the pairs were listed.
#[derive(Clone, Copy)]
pub(crate) struct Age<'a> {
    pub rows: &'a [Row],
    pub travel: &'a [f64],
    pub time: f64,
}

/// All grains that may touch a wall before the list is made anew.
#[derive(Clone, Debug, Default)]
pub(crate) struct WallContacts {
    pub contacts: Vec<WallContact>,
    /// Contacts of grain g: `first[g]..first[g + 1]`; empty where there are no walls.
    first: Vec<u32>,
    /// For each row and wall, how far its nearest *unlisted* surface was when listed (m).
    clearance: Vec<f64>,
    /// Travel of each row, and time, since the pairs were listed, when this list was made.
    travel_then: Vec<f64>,
    time_then: f64,
    old: Vec<WallContact>,
    /// Contacts as they were before they were looked at out of turn.
    before: Vec<WallContact>,
}

impl WallContacts {
    /// Contacts of a grain.
    #[inline(always)]
    pub fn of(&self, grain: usize) -> &[WallContact] {
        if self.first.is_empty() {
            return &[];
        }
        &self.contacts[self.first[grain] as usize..self.first[grain + 1] as usize]
    }

    /// All contacts that touch.
    pub fn touching(&self) -> impl Iterator<Item = &WallContact> {
        self.contacts.iter().filter(|c| c.touching)
    }

    /// Remembers the contacts as they are.
    pub fn remember(&mut self) {
        self.before.clone_from(&self.contacts);
    }

    /// Goes back to the contacts that were remembered.
    pub fn recall(&mut self) {
        std::mem::swap(&mut self.contacts, &mut self.before);
    }

    /// How long the list has lasted, at an age of the pairs' list (s).
    pub fn age(&self, pairs: f64) -> f64 {
        pairs - self.time_then
    }

    /// Takes contacts out of the list, to be put into the next one; `new_index` says where their grains are.
    pub fn take_down(&mut self, new_index: impl Fn(u32) -> u32) {
        std::mem::swap(&mut self.contacts, &mut self.old);
        self.old.retain(|c| c.touching);
        for c in &mut self.old {
            c.grain = new_index(c.grain);
        }
        self.old.sort_unstable_by_key(WallContact::key);
    }

    /// Takes up the contacts of a checkpoint, to be put into the next list.
    pub fn take_up(&mut self, mut contacts: Vec<WallContact>) {
        contacts.sort_unstable_by_key(WallContact::key);
        self.old = contacts;
    }

    /// Lists grains closer than `skin` to a wall, with the contacts taken down before.
    pub fn list(
        &mut self,
        walls: &mut [Standing],
        grains: &Grains,
        domain: &Domain,
        skin: f64,
        age: Age,
    ) {
        self.contacts.clear();
        self.first.clear();
        self.clearance.clear();
        if walls.is_empty() {
            return;
        }
        self.first.push(0);
        for row in age.rows {
            let from = self.clearance.len();
            self.clearance.resize(from + walls.len(), f64::INFINITY);
            for g in row.start..row.end {
                let x = &grains.place[g as usize];
                for (w, wall) in walls.iter().enumerate() {
                    let gap = wall.foot(&wall.seen(&vector(x), domain)).distance - x[3];
                    if gap >= skin {
                        let nearest = &mut self.clearance[from + w];
                        *nearest = nearest.min(gap);
                        continue;
                    }
                    let key = (g, w as u32);
                    let known = self.old.binary_search_by_key(&key, WallContact::key);
                    self.contacts.push(match known {
                        Ok(known) => self.old[known],
                        Err(_) => WallContact::apart(g, w as u32),
                    });
                }
                self.first.push(self.contacts.len() as u32);
            }
        }
        self.travel_then.clear();
        self.travel_then.extend_from_slice(age.travel);
        self.time_then = age.time;
        for wall in walls {
            start_travel(wall, grains, domain, skin);
        }
    }

    /// Whether an unlisted grain may have reached a wall.
    pub fn outdated(&self, walls: &[Standing], age: Age) -> bool {
        if walls.is_empty() {
            return false;
        }
        let since = self.age(age.time);
        let rows = age.rows.iter().zip(age.travel).zip(&self.travel_then);
        rows.zip(self.clearance.chunks_exact(walls.len())).any(
            |(((row, travel), then), clearance)| {
                let travel = travel - then;
                walls.iter().zip(clearance).any(|(wall, clearance)| {
                    travel + wall.drift(&Vector3::from(row.drift)) * since + wall.travel
                        >= *clearance
                })
            },
        )
    }

    /// Evaluates the law on all listed contacts; the largest overlap over the radius.
    pub fn evaluate<I: Interaction>(
        &mut self,
        law: &I,
        walls: &mut [Standing],
        scene: &Scene,
    ) -> f64 {
        for wall in walls.iter_mut() {
            wall.load = Default::default();
        }
        let mut deepest: f64 = 0.0;
        for c in &mut self.contacts {
            let (grain, wall) = (c.grain as usize, &mut walls[c.wall as usize]);
            let x = &scene.grains.place[grain];
            let seen = wall.seen(&vector(x), scene.domain);
            let foot = wall.foot(&seen);
            let meeting = Meeting {
                grain,
                seen,
                distance: foot.distance,
                normal: foot.normal,
            };
            deepest = deepest.max(c.evaluate(law, wall, &meeting, scene));
        }
        deepest
    }
}

/// Notes how far from its origin a wall may meet grains, and lets its travel start.
fn start_travel(wall: &mut Standing, grains: &Grains, domain: &Domain, skin: f64) {
    wall.travel = 0.0;
    if !wall.moves() {
        return;
    }
    let places = grains.place[..grains.len()].iter();
    let far = places.map(|x| wall.seen(&vector(x), domain).norm() + x[3]);
    // A grain that comes from afar comes along with the room it had: twice is enough.
    let met = 2.0 * far.fold(0.0, f64::max) + skin;
    wall.extent = wall.wall.shape.extent().min(met);
}

impl WallContact {
    /// Evaluates the law on one contact; its overlap over the radius.
    fn evaluate<I: Interaction>(
        &mut self,
        law: &I,
        wall: &mut Standing,
        meeting: &Meeting,
        scene: &Scene,
    ) -> f64 {
        let grains = scene.grains;
        let g = meeting.grain;
        let (x, v, s) = (&grains.place[g], &grains.motion[g], &grains.turn[g]);
        let pair =
            usize::from(grains.material[g]) * law.materials() + usize::from(wall.wall.material);
        let coefficients = &law.table()[pair];
        let overlap = x[3] - meeting.distance;
        let held = if I::HOLDS && self.history[I::HISTORY - 1] != 0.0 {
            law.hold(coefficients, s[3])
        } else {
            0.0
        };
        if overlap <= -held || v[3] == 0.0 {
            if self.touching {
                self.part();
            }
            return 0.0;
        }
        let normal = Vec3([meeting.normal.x, meeting.normal.y, meeting.normal.z]);
        let begins = !self.touching || normal.dot(Vec3(self.normal)) < 0.0;
        if begins {
            self.history = [0.0; HISTORY_MAX];
        }
        let share = match scene.lever {
            Lever::ContactPoint => meeting.distance / x[3],
            Lever::Radius => 1.0,
        };
        let turn = Vec3([s[0], s[1], s[2]]).scale(share);
        let mut velocity = Vec3([v[0], v[1], v[2]]) - turn.cross(normal);
        let mut spin = Vec3([s[0], s[1], s[2]]).scale(s[3]);
        if wall.moves() {
            let arm = meeting.seen - meeting.normal * meeting.distance;
            velocity = velocity - Vec3(wall.velocity_at(&arm).into());
            spin = spin - Vec3(wall.spin.into());
        }
        let touch = Touch {
            normal,
            overlap,
            velocity,
            spin,
            inverse_mass: v[3],
            curvature: s[3],
            inverse_inertia: v[3] * s[3] * s[3],
        };
        let wrench = law.wrench(coefficients, &touch, &mut self.history, scene.step);
        let torque = wrench.tangential.cross(normal).scale(share);
        self.slot = [wrench.force, torque, wrench.moment].map(|v| [v.0[0], v.0[1], v.0[2], 0.0]);
        (self.touching, self.overlap, self.normal) = (true, overlap, normal.0);
        let [force, torque, moment] = self.slot.map(|row| vector(&row));
        // The grain's torque is R times the second row plus the third: what it gains, the wall loses.
        wall.load.force -= force;
        wall.load.torque -= meeting.seen.cross(&force) + torque * x[3] + moment;
        if begins && wall.wall.shape.is_plate() && overlap > THROUGH * x[3] {
            // By the radius it was pressed through, the overlap is the rest of the diameter.
            return 2.0 - overlap * s[3];
        }
        overlap * s[3]
    }
}
