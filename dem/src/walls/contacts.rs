//! Grains near walls, and what the contact laws make of them.
//!
//! Grains closer to a wall than the skin are listed. The list lasts until a row of grains, or the wall, may
//! have used up the room that unlisted grains had; it may be made at any time without changing a bit, since
//! contacts that do not touch leave zeros. Steps cost only for grains that are listed.

use super::mesh::{CONTACTS, Mesh, Offers};
use super::{Foot, Shape, Standing, WallLoad};
use crate::contact::{HISTORY_MAX, Interaction, Lever, Step, Touch};
use crate::domain::Domain;
use crate::grains::{Grains, vector};
use crate::lanes::Vec3;
use crate::neighbours::Row;
use crate::team::Team;
use nalgebra::Vector3;
use std::ops::Range;

/// A grain near a wall.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WallContact {
    pub grain: u32,
    pub wall: u32,
    /// Number of the block of contacts with a mesh that it is one of, or none.
    pub block: u32,
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
            block: ALONE,
            history: [0.0; HISTORY_MAX],
            slot: [[0.0; 4]; 3],
            touching: false,
            overlap: 0.0,
            normal: [0.0; 3],
        }
    }

    fn part(&mut self) {
        *self = WallContact {
            block: self.block,
            ..WallContact::apart(self.grain, self.wall)
        };
    }

    fn key(&self) -> (u32, u32) {
        (self.grain, self.wall)
    }
}

/// The block of a contact with a wall that is no mesh.
const ALONE: u32 = u32::MAX;

/// Cosine of the angle by which the normal of a contact with a mesh may turn in a step.
const SAME: f64 = 0.5;

/// A triangle near a grain, seen from the grain's image that is moved by `shift`.
#[derive(Clone, Copy, Debug)]
struct Near {
    triangle: u32,
    shift: Vector3<f64>,
}

/// All contacts that a grain may have with a mesh: those that touch come first, the nearest first.
#[derive(Clone, Debug)]
struct Block {
    contacts: Range<usize>,
    near: Range<usize>,
}

/// Overlap, over the radius, at which a contact with a plate cannot begin: the grain was pressed through
/// from the other side, or put into the plate.
const THROUGH: f64 = 0.5;

/// Grains whose contacts are added up together before parts are: the same for any number of threads.
const PART: usize = 1024;

/// Most threads that contacts are shared out over.
const SHARES: usize = 32;

/// Contacts that are evaluated on one thread: those of some parts.
struct Share<'a> {
    /// Number of the first contact.
    first: usize,
    contacts: &'a mut [WallContact],
    parts: &'a [usize],
    loads: &'a mut [WallLoad],
    /// Largest overlap over the radius.
    deepest: f64,
}

/// What a step reads besides the walls.
#[derive(Clone, Copy)]
pub(crate) struct Scene<'a> {
    pub grains: &'a Grains,
    pub domain: &'a Domain,
    pub lever: Lever,
    pub step: Step,
    /// Threads that contacts are shared out over.
    pub threads: usize,
    pub team: &'a Team,
}

/// Where and how a grain meets a wall.
struct Meeting {
    grain: usize,
    /// Centre, from the wall's origin.
    seen: Vector3<f64>,
    foot: Foot,
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
    blocks: Vec<Block>,
    near: Vec<Near>,
    /// Where the contacts of each part of the grains begin, and where those of the last end.
    parts: Vec<usize>,
    /// For each part and wall, what the wall carries of it.
    loads: Vec<WallLoad>,
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

    /// Whether no grain is near a wall.
    pub fn is_empty(&self) -> bool {
        self.contacts.is_empty()
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
        self.blocks.clear();
        self.near.clear();
        self.first.clear();
        self.clearance.clear();
        self.parts.clear();
        if walls.is_empty() {
            return;
        }
        self.first.push(0);
        for row in age.rows {
            let from = self.clearance.len();
            self.clearance.resize(from + walls.len(), f64::INFINITY);
            for g in row.start..row.end {
                if (g as usize).is_multiple_of(PART) {
                    self.parts.push(self.contacts.len());
                }
                let x = &grains.place[g as usize];
                for (w, wall) in walls.iter().enumerate() {
                    let key = (g, w as u32);
                    let free = match &wall.wall.shape {
                        Shape::Mesh(mesh) => self.list_mesh(key, mesh, wall, x, domain, skin),
                        _ => self.list_alone(key, wall, x, domain, skin),
                    };
                    let nearest = &mut self.clearance[from + w];
                    *nearest = nearest.min(free);
                }
                self.first.push(self.contacts.len() as u32);
            }
        }
        let parts = self.parts.len();
        self.parts.push(self.contacts.len());
        self.loads.clear();
        self.loads.resize(parts * walls.len(), WallLoad::default());
        self.travel_then.clear();
        self.travel_then.extend_from_slice(age.travel);
        self.time_then = age.time;
        for wall in walls {
            start_travel(wall, grains, domain, skin);
        }
    }

    /// Lists a grain near a wall that it can touch once; how near unlisted surfaces are (m).
    fn list_alone(
        &mut self,
        (g, w): (u32, u32),
        wall: &Standing,
        x: &[f64; 4],
        domain: &Domain,
        skin: f64,
    ) -> f64 {
        let gap = wall.foot(&wall.seen(&vector(x), domain)).distance - x[3];
        if gap >= skin {
            return gap;
        }
        let known = self.old.binary_search_by_key(&(g, w), WallContact::key);
        self.contacts.push(match known {
            Ok(known) => self.old[known],
            Err(_) => WallContact::apart(g, w),
        });
        f64::INFINITY
    }

    /// Lists a grain near a mesh, with the triangles near it; how near unlisted triangles are (m).
    fn list_mesh(
        &mut self,
        (g, w): (u32, u32),
        mesh: &Mesh,
        wall: &Standing,
        x: &[f64; 4],
        domain: &Domain,
        skin: f64,
    ) -> f64 {
        let (from, reach) = (self.near.len(), x[3] + wall.rounding + skin);
        let near = &mut self.near;
        let far = wall.images_near(mesh, &vector(x), reach, domain, |shift, centre| {
            mesh.near(centre, reach, |triangle| {
                near.push(Near { triangle, shift })
            });
        });
        if near.len() == from {
            return skin.max(far - x[3] - wall.rounding);
        }
        // The order that the tree finds them in must not matter.
        near[from..].sort_unstable_by(|a, b| {
            let shifts = || a.shift.iter().zip(b.shift.iter());
            let order = a.triangle.cmp(&b.triangle);
            shifts().fold(order, |order, (a, b)| order.then(a.total_cmp(b)))
        });
        let rows = (near.len() - from).min(CONTACTS);
        let known = self.old.partition_point(|c| c.key() < (g, w));
        let mut known = self.old[known..].iter().filter(|c| c.key() == (g, w));
        let first = self.contacts.len();
        let block = self.blocks.len() as u32;
        for _ in 0..rows {
            let known = known.next().copied();
            let contact = known.unwrap_or_else(|| WallContact::apart(g, w));
            self.contacts.push(WallContact { block, ..contact });
        }
        self.blocks.push(Block {
            contacts: first..first + rows,
            near: from..self.near.len(),
        });
        skin
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
            wall.load = WallLoad::default();
        }
        if self.contacts.is_empty() {
            return 0.0;
        }
        let standing = &*walls;
        let (blocks, near) = (&self.blocks, &self.near);
        let mut shares: [Option<Share>; SHARES] = std::array::from_fn(|_| None);
        let count = scene.threads.clamp(1, SHARES);
        let total = self.contacts.len();
        let (mut contacts, mut loads) = (self.contacts.as_mut_slice(), self.loads.as_mut_slice());
        let mut part = 0;
        for (s, share) in shares[..count].iter_mut().enumerate() {
            let first = self.parts[part];
            let upto = total * (s + 1) / count;
            let behind = self.parts[part..].partition_point(|&start| start < upto);
            let end = (part + behind).min(self.parts.len() - 1);
            let (own, rest) = contacts.split_at_mut(self.parts[end] - first);
            let (own_loads, rest_loads) = loads.split_at_mut((end - part) * standing.len());
            *share = Some(Share {
                first,
                contacts: own,
                parts: &self.parts[part..=end],
                loads: own_loads,
                deepest: 0.0,
            });
            (contacts, loads, part) = (rest, rest_loads, end);
        }
        let parallel = count > 1 && total >= CONTACTS_TO_SHARE;
        scene.team.each(parallel, &mut shares[..count], &|share| {
            if let Some(share) = share {
                share.evaluate(law, standing, blocks, near, scene);
            }
        });
        let depths = shares.iter().flatten().map(|share| share.deepest);
        let deepest = depths.fold(0.0, f64::max);
        for loads in self.loads.chunks_exact(walls.len()) {
            for (wall, load) in walls.iter_mut().zip(loads) {
                wall.load.force += load.force;
                wall.load.torque += load.torque;
            }
        }
        deepest
    }
}

/// Fewest contacts with walls for which a step goes to several threads.
const CONTACTS_TO_SHARE: usize = 64;

impl Share<'_> {
    fn evaluate<I: Interaction>(
        &mut self,
        law: &I,
        walls: &[Standing],
        blocks: &[Block],
        near: &[Near],
        scene: &Scene,
    ) {
        self.loads.fill(WallLoad::default());
        for (part, loads) in self
            .parts
            .windows(2)
            .zip(self.loads.chunks_exact_mut(walls.len()))
        {
            let (mut k, end) = (part[0] - self.first, part[1] - self.first);
            while k < end {
                let c = &mut self.contacts[k];
                if c.block != ALONE {
                    let block = &blocks[c.block as usize];
                    let own = block.contacts.start - self.first..block.contacts.end - self.first;
                    k = own.end;
                    let near = &near[block.near.clone()];
                    let rows = &mut self.contacts[own];
                    let depth = meet_mesh(rows, near, law, walls, loads, scene);
                    self.deepest = self.deepest.max(depth);
                    continue;
                }
                let (grain, wall) = (c.grain as usize, &walls[c.wall as usize]);
                let x = &scene.grains.place[grain];
                let seen = wall.seen(&vector(x), scene.domain);
                let foot = wall.foot(&seen);
                let meeting = Meeting { grain, seen, foot };
                let load = &mut loads[c.wall as usize];
                let depth = c.evaluate(law, wall, load, &meeting, scene);
                self.deepest = self.deepest.max(depth);
                k += 1;
            }
        }
    }
}

/// Evaluates the contacts of a grain with a mesh; the largest overlap over the radius.
///
/// Histories go on where a contact's normal has turned least since the last step: from face to edge to face
/// there is one contact, whatever triangles it is with.
#[inline(never)]
fn meet_mesh<I: Interaction>(
    rows: &mut [WallContact],
    near: &[Near],
    law: &I,
    walls: &[Standing],
    loads: &mut [WallLoad],
    scene: &Scene,
) -> f64 {
    let (g, wall) = (rows[0].grain, &walls[rows[0].wall as usize]);
    let load = &mut loads[rows[0].wall as usize];
    let grain = g as usize;
    let x = &scene.grains.place[grain];
    let (mut before, mut known) = ([rows[0]; CONTACTS], 0);
    for row in rows.iter_mut().filter(|row| row.touching) {
        before[known] = *row;
        known += 1;
        row.part();
    }
    let before = &mut before[..known];
    let held = if I::HOLDS && known > 0 {
        law.hold(
            wall.coefficients(law, scene.grains, grain),
            before[0].history[I::HISTORY - 1],
        )
    } else {
        0.0
    };
    let radius = x[3] + wall.rounding;
    let seen = |near: &Near| vector(x) + near.shift - wall.pose.position;
    let contacts = Offers::contacts(radius, |offers| {
        let Shape::Mesh(mesh) = &wall.wall.shape else {
            return;
        };
        for (near, number) in near.iter().zip(0..) {
            let centre = wall.pose.inward(&seen(near));
            if let Some(foot) = mesh.offer(near.triangle, &centre, radius + held) {
                offers.take(foot, number, radius);
            }
        }
    });
    let mut deepest: f64 = 0.0;
    for (row, (foot, number)) in rows.iter_mut().zip(contacts.feet()) {
        let seen = vector(x) + near[*number as usize].shift - wall.pose.position;
        let normal = wall.pose.outward(&foot.normal);
        if let Some(same) = take_same(before, &normal) {
            *row = same;
        }
        let meeting = Meeting {
            grain,
            seen,
            foot: Foot {
                distance: foot.distance - wall.rounding,
                normal,
            },
        };
        deepest = deepest.max(row.evaluate(law, wall, load, &meeting, scene));
    }
    deepest
}

/// Takes out the contact whose normal is nearest to this one, if one is near.
fn take_same(before: &mut [WallContact], normal: &Vector3<f64>) -> Option<WallContact> {
    let turned = |c: &WallContact| normal.dot(&Vector3::from(c.normal));
    let left = before.iter_mut().filter(|c| c.touching);
    let same = left.max_by(|a, b| turned(a).total_cmp(&turned(b)))?;
    if turned(same) < SAME {
        return None;
    }
    let taken = *same;
    same.touching = false;
    Some(taken)
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
    wall.extent = (wall.wall.shape.extent() + wall.rounding).min(met);
}

impl WallContact {
    /// Evaluates the law on one contact; its overlap over the radius.
    #[inline(always)]
    fn evaluate<I: Interaction>(
        &mut self,
        law: &I,
        wall: &Standing,
        load: &mut WallLoad,
        meeting: &Meeting,
        scene: &Scene,
    ) -> f64 {
        let grains = scene.grains;
        let (g, foot) = (meeting.grain, &meeting.foot);
        let (x, v, s) = (&grains.place[g], &grains.motion[g], &grains.turn[g]);
        let coefficients = wall.coefficients(law, grains, g);
        let overlap = x[3] - foot.distance;
        let curvature = s[3] + wall.curvature();
        let held = if I::HOLDS {
            law.hold(coefficients, self.history[I::HISTORY - 1])
        } else {
            0.0
        };
        // What is held still and a wall have nothing to say to each other.
        if overlap <= -held || v[3] == 0.0 && !wall.yields() {
            if self.touching {
                self.part();
            }
            return 0.0;
        }
        let normal = Vec3(foot.normal.into());
        let begins = !self.touching || normal.dot(Vec3(self.normal)) < 0.0;
        if begins {
            self.history = [0.0; HISTORY_MAX];
        }
        let share = match scene.lever {
            Lever::ContactPoint => foot.distance / x[3],
            Lever::Radius => 1.0,
        };
        let turn = Vec3([s[0], s[1], s[2]]).scale(share);
        let mut velocity = Vec3([v[0], v[1], v[2]]) - turn.cross(normal);
        let mut spin = Vec3([s[0], s[1], s[2]]).scale(s[3]);
        let mut inverse_mass = v[3];
        if wall.moves() {
            let arm = meeting.seen - foot.normal * foot.distance;
            inverse_mass += wall.inverse_mass_at(&arm, &foot.normal);
            velocity = velocity - Vec3(wall.velocity_at(&arm).into());
            spin = spin - Vec3(wall.spin.into());
        }
        let touch = Touch {
            normal,
            overlap,
            velocity,
            spin,
            inverse_mass,
            curvature,
            inverse_inertia: v[3] * s[3] * s[3],
        };
        let wrench = law.wrench(coefficients, &touch, &mut self.history, scene.step);
        let torque = wrench.tangential.cross(normal).scale(share);
        self.slot = [wrench.force, torque, wrench.moment].map(|v| [v.0[0], v.0[1], v.0[2], 0.0]);
        (self.touching, self.overlap, self.normal) = (true, overlap, normal.0);
        let [force, torque, moment] = self.slot.map(|row| vector(&row));
        // The grain's torque is R times the second row plus the third: what it gains, the wall loses.
        load.force -= force;
        load.torque -= meeting.seen.cross(&force) + torque * x[3] + moment;
        if begins && wall.wall.shape.is_plate() && overlap > THROUGH * x[3] {
            // By the radius it was pressed through, the overlap is the rest of the diameter.
            return 2.0 - overlap * s[3];
        }
        overlap * s[3]
    }
}
