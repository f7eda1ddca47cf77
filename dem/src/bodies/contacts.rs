//! Contacts of bodies with walls and with each other.
//!
//! Every feeler of one side that is near the other side asks for the nearest point of its surface, as
//! the centre of a grain would, and calls the pair law with
//!
//! ```text
//! δ = r - distance        overlap of the feeler with the other side's surface
//! v = V_a + ω_a × a - (V_b + ω_b × b)          at the contact point, on the other side's surface
//! 1/m = n (1/m_a + 1/m_b),   1/m_k = 1/M_k + (c_k × n̂) · J_k⁻¹ (c_k × n̂)
//! ```
//! where c_k are the arms of the mean contact point of the n contacts of this pair of bodies and n̂ is
//! their mean normal: dashpots are matched to what the contacts move *together*. One corner then has the
//! restitution that the law asks for at any place of the body, and so has a cuboid that falls flat on
//! four. The elastic force knows nothing of it.
//!
//! The radius of curvature in Hertz' law is the feeler's, with that of a ball that it meets. Contacts are
//! looked for anew in every step; only their springs are kept, in order of feelers.

use super::Body;
use super::encounters::{self, Encounter};
use super::feelers::{self, Feeler, Feelers};
use super::lookout::{Lookout, Ways};
use super::rigid::{Rigid, Twist};
use crate::contact::composition::Visitor;
use crate::contact::{HISTORY_MAX, Interaction, LawTable, Step, Touch};
use crate::domain::Domain;
use crate::lanes::Vec3;
use crate::setup::SetupError;
use crate::walls::mesh::Offers;
use crate::walls::{Foot, Shape, Standing, Wall};
use nalgebra::Vector3;

/// A contact of a feeler that touches, or holds across a gap.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BodyContact {
    pub encounter: u32,
    pub feeler: u32,
    pub history: [f64; HISTORY_MAX],
    /// Unit normal towards the side that feels.
    pub normal: [f64; 3],
    pub overlap: f64,
    pub curvature: f64,
    /// On the side that feels: force, and moment beyond the force's own.
    pub force: Vector3<f64>,
    pub moment: Vector3<f64>,
    /// Arms of the contact point from the pivots of both sides.
    pub arms: [Vector3<f64>; 2],
}

impl BodyContact {
    pub fn key(&self) -> (u32, u32) {
        (self.encounter, self.feeler)
    }

    /// A contact of a checkpoint.
    pub fn known(key: [u32; 2], history: [f64; HISTORY_MAX], normal: [f64; 3]) -> BodyContact {
        BodyContact {
            encounter: key[0],
            feeler: key[1],
            history,
            normal,
            overlap: 0.0,
            curvature: 0.0,
            force: Vector3::zeros(),
            moment: Vector3::zeros(),
            arms: [Vector3::zeros(); 2],
        }
    }
}

/// A feeler within reach of a surface.
#[derive(Clone, Copy, Debug)]
struct Meeting {
    encounter: u32,
    feeler: u32,
    radius: f64,
    foot: Foot,
    arms: [Vector3<f64>; 2],
}

/// What the contacts of a pair of bodies have in common.
#[derive(Clone, Copy, Debug, Default)]
struct Group {
    count: f64,
    arms: [Vector3<f64>; 2],
    normal: Vector3<f64>,
}

/// Cosine of the angle by which the normal of a contact with a mesh may turn in a step.
const SAME: f64 = 0.5;

/// All bodies of a scene.
#[derive(Clone, Debug, Default)]
pub(crate) struct Bodies {
    pub rigid: Vec<Rigid>,
    pub(super) encounters: Vec<Encounter>,
    pub(super) feelers: Vec<Feelers>,
    lookouts: Vec<Lookout>,
    ways: Ways,
    pub(super) contacts: Vec<BodyContact>,
    old: Vec<BodyContact>,
    before: Vec<BodyContact>,
    meetings: Vec<Meeting>,
    near: Vec<(u32, Vector3<f64>)>,
    /// Sum of the forces on free bodies from outside, besides uniform gravity (N).
    pub external: Vector3<f64>,
    /// Largest gap that any established contact of bodies holds across (m).
    hold: f64,
}

impl Bodies {
    /// Makes bodies ready and puts their parts behind the walls.
    pub fn new(
        bodies: Vec<Body>,
        walls: &mut Vec<Standing>,
        law: &LawTable,
        timestep: f64,
    ) -> Result<Bodies, SetupError> {
        if bodies.is_empty() {
            return Ok(Bodies::default());
        }
        let finest = bodies.iter().flat_map(|b| &b.parts);
        let finest = finest.map(|p| p.rounding).fold(f64::INFINITY, f64::min);
        let shapes = walls
            .iter()
            .map(|w| Feelers::of_wall(&w.wall.shape, finest));
        let mut feelers: Vec<Feelers> = shapes.collect();
        let mut rigid = Vec::new();
        for (number, body) in bodies.into_iter().enumerate() {
            let key = format!("bodies[{number}]");
            let one = Rigid::new(body, walls.len(), timestep, &key)?;
            for (k, part) in one.body.parts.iter().enumerate() {
                let core = super::rounded::core(part);
                feelers.push(Feelers::of_part(part, &core.shape));
                let curvature = match &core.shape {
                    Shape::SphereShell(ball) => 1.0 / ball.radius,
                    _ => 0.0,
                };
                let at = one.parts.start + k;
                let wall = Wall::new(core.shape, one.part_pose(at)).material(part.material);
                let carrier = one.carrier(at, number as u32, curvature);
                walls.push(Standing::part(wall, core.rounding, carrier));
            }
            rigid.push(one);
        }
        feelers::check_count(&feelers)?;
        let balls = feelers.iter().flat_map(|f| &f.points).map(|f| f.radius);
        let largest = balls.fold(0.0, f64::max);
        let holds = law.laws().iter().map(|law| law.reach(largest));
        let encounters = encounters::all(walls, &rigid, &feelers);
        let mut bodies = Bodies {
            lookouts: vec![Lookout::default(); encounters.len()],
            ways: Ways::new(walls),
            encounters,
            feelers,
            rigid,
            hold: holds.fold(0.0, f64::max),
            ..Bodies::default()
        };
        bodies.place(walls);
        Ok(bodies)
    }

    /// Whether there is none.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.rigid.is_empty()
    }

    /// Puts the parts where their bodies are.
    pub fn place(&mut self, walls: &mut [Standing]) {
        for (number, body) in self.rigid.iter().enumerate() {
            let twist = body.twist();
            for part in body.parts.clone() {
                let wall = &mut walls[part];
                let carrier = body.carrier(part, number as u32, wall.curvature());
                let velocity = twist.at(&carrier.offset);
                wall.carrier = Some(carrier);
                let pose = body.part_pose(part);
                self.ways.go(part, wall, &pose);
                wall.carry(pose, velocity, twist.spin);
            }
        }
    }

    /// The body that a wall is part of.
    pub fn of_part<'a>(&'a self, wall: &Standing) -> Option<&'a Rigid> {
        let carrier = wall.carrier.as_ref()?;
        self.rigid.get(carrier.body as usize)
    }

    /// Remembers the contacts as they are.
    pub fn remember(&mut self) {
        self.before.clone_from(&self.contacts);
    }

    /// Goes back to the contacts that were remembered.
    pub fn recall(&mut self) {
        std::mem::swap(&mut self.contacts, &mut self.before);
    }

    /// Evaluates all contacts of bodies with walls and with each other and gathers what they and grains do
    /// to each body; grains have been there before. The largest overlap over the feeler's radius.
    pub fn evaluate<I: Interaction>(
        &mut self,
        law: &I,
        walls: &mut [Standing],
        domain: &Domain,
        step: Step,
    ) -> f64 {
        for body in &mut self.rigid {
            body.load = Default::default();
            for part in body.parts.clone() {
                let (load, offset) = (&walls[part].load, walls[part].carrier);
                let offset = offset.map_or(Vector3::zeros(), |c| c.offset);
                body.load.force += load.force;
                body.load.torque += load.torque + offset.cross(&load.force);
            }
        }
        self.meet(walls, domain);
        std::mem::swap(&mut self.contacts, &mut self.old);
        self.contacts.clear();
        let (mut deepest, mut from): (f64, usize) = (0.0, 0);
        while let Some(first) = self.meetings.get(from) {
            let group = self.encounters[first.encounter as usize].group;
            let alike = |m: &Meeting| self.encounters[m.encounter as usize].group == group;
            let len = self.meetings[from..]
                .iter()
                .take_while(|m| alike(m))
                .count();
            let inverse_mass = self.moved_together(walls, from..from + len);
            for k in from..from + len {
                deepest = deepest.max(self.touch(law, walls, k, inverse_mass, step));
            }
            from += len;
        }
        deepest
    }

    /// Finds the feelers that are within reach of a surface, in order of encounters and feelers.
    fn meet(&mut self, walls: &[Standing], domain: &Domain) {
        self.meetings.clear();
        for number in 0..self.encounters.len() {
            let encounter = self.encounters[number];
            let feelers = &self.feelers[encounter.prober as usize];
            let lookout = &mut self.lookouts[number];
            lookout.look(&encounter, &self.ways, walls, feelers, domain, self.hold);
            if !lookout.awake {
                continue;
            }
            for k in 0..self.lookouts[number].near.len() {
                let k = self.lookouts[number].near[k];
                let Feeler { at, radius } =
                    self.feelers[encounter.prober as usize].points[k as usize];
                self.feel(number, k, at, radius, walls, domain);
            }
            if encounter.flat {
                self.feel_rims(number, walls, domain);
            }
        }
    }

    /// Feels for a plane with the lowest points of rims.
    fn feel_rims(&mut self, number: usize, walls: &[Standing], domain: &Domain) {
        let encounter = self.encounters[number];
        let (prober, target) = (encounter.prober as usize, encounter.target as usize);
        let pose = &walls[prober].pose;
        let seen = walls[target].seen(&pose.position, domain);
        let down = -pose.inward(&walls[target].foot(&seen).normal);
        let first = self.feelers[prober].points.len();
        for k in 0..self.feelers[prober].rims.len() {
            let rim = self.feelers[prober].rims[k];
            let across = down - rim.axis * rim.axis.dot(&down);
            let length = across.norm();
            // Of a rim that lies flat all points are as low as any.
            let lowest = if length > 1e-8 {
                across / length
            } else {
                rim.start()
            };
            let side = rim.axis.cross(&lowest);
            for (q, direction) in [lowest, side, -lowest, -side].into_iter().enumerate() {
                let at = rim.centre + direction * rim.radius;
                let name = (first + 4 * k + q) as u32;
                self.feel(number, name, at, rim.ball, walls, domain);
            }
        }
    }

    /// Asks how far the other side is from a feeler.
    fn feel(
        &mut self,
        number: usize,
        feeler: u32,
        at: Vector3<f64>,
        radius: f64,
        walls: &[Standing],
        domain: &Domain,
    ) {
        let encounter = self.encounters[number];
        let prober = &walls[encounter.prober as usize];
        let target = &walls[encounter.target as usize];
        let arm = prober.pose.outward(&at);
        let x = prober.pose.position + arm;
        let offsets = [prober, target].map(|w| w.carrier.map_or(Vector3::zeros(), |c| c.offset));
        let meeting = |seen: Vector3<f64>, foot: Foot| {
            let way = foot.normal * foot.distance;
            Meeting {
                encounter: number as u32,
                feeler,
                radius,
                foot,
                arms: [offsets[0] + arm - way, offsets[1] + seen - way],
            }
        };
        let Shape::Mesh(mesh) = &target.wall.shape else {
            let seen = target.seen(&x, domain);
            let foot = target.foot(&seen);
            if radius - foot.distance > -self.hold {
                self.meetings.push(meeting(seen, foot));
            }
            return;
        };
        let (reach, near) = (radius + target.rounding, &mut self.near);
        near.clear();
        target.images_near(mesh, &x, reach + self.hold, domain, |shift, centre| {
            mesh.near(centre, reach + self.hold, |triangle| {
                near.push((triangle, shift))
            });
        });
        // The order that the tree finds them in must not matter.
        near.sort_unstable_by(|(a, s), (b, t)| {
            let shifts = || s.iter().zip(t.iter());
            shifts().fold(a.cmp(b), |order, (a, b)| order.then(a.total_cmp(b)))
        });
        let contacts = Offers::contacts(reach, |offers| {
            for ((triangle, shift), number) in near.iter().zip(0..) {
                let centre = target.pose.inward(&(x + shift - target.pose.position));
                if let Some(foot) = mesh.offer(*triangle, &centre, reach + self.hold) {
                    offers.take(foot, number, reach);
                }
            }
        });
        for (foot, number) in contacts.feet() {
            let seen = x + near[*number as usize].1 - target.pose.position;
            let foot = Foot {
                distance: foot.distance - target.rounding,
                normal: target.pose.outward(&foot.normal),
            };
            self.meetings.push(meeting(seen, foot));
        }
    }

    /// 1/m that the contacts of a pair of bodies move together, times their number (1/kg).
    fn moved_together(&self, walls: &[Standing], range: std::ops::Range<usize>) -> f64 {
        let mut group = Group::default();
        let first = self.encounters[self.meetings[range.start].encounter as usize];
        for meeting in &self.meetings[range] {
            if meeting.radius <= meeting.foot.distance {
                continue;
            }
            // Both sides of a pair feel: arms and normals are counted from the first one that did.
            let of = walls[self.encounters[meeting.encounter as usize].prober as usize].carrier;
            let same = of.map(|c| c.body) == walls[first.prober as usize].carrier.map(|c| c.body);
            let [a, b] = meeting.arms;
            let (arms, normal) = if same {
                ([a, b], meeting.foot.normal)
            } else {
                ([b, a], -meeting.foot.normal)
            };
            group.count += 1.0;
            group.normal += normal;
            for (sum, arm) in group.arms.iter_mut().zip(arms) {
                *sum += arm;
            }
        }
        let normal = group.normal.try_normalize(1e-6 * group.count);
        let sides = [first.prober, first.target].map(|k| walls[k as usize].carrier);
        let sides = sides.iter().zip(&group.arms);
        let each = sides.map(|(carrier, arm)| match (carrier, normal) {
            (None, _) => 0.0,
            (Some(carrier), Some(n)) => carrier.inverse_mass_at(&(arm / group.count), &n),
            // Squeezed from all around.
            (Some(carrier), None) => carrier.inverse_mass,
        });
        let together = group.count.max(1.0) * each.sum::<f64>();
        if together > 0.0 {
            return together;
        }
        // Pushed straight at a hinge: nothing moves.
        let bodies = [first.prober, first.target].map(|k| self.of_part(&walls[k as usize]));
        let masses = bodies.iter().flatten().filter(|body| !body.is_driven());
        group.count.max(1.0) * masses.map(|body| 1.0 / body.mass.mass).sum::<f64>()
    }

    /// Evaluates the law on a meeting.
    fn touch<I: Interaction>(
        &mut self,
        law: &I,
        walls: &mut [Standing],
        meeting: usize,
        inverse_mass: f64,
        step: Step,
    ) -> f64 {
        let Meeting {
            encounter,
            feeler,
            radius,
            foot,
            arms,
        } = self.meetings[meeting];
        let sides = self.encounters[encounter as usize];
        let [a, b] = [sides.prober, sides.target].map(|k| k as usize);
        let row = usize::from(walls[a].wall.material) * law.materials();
        let coefficients = &law.table()[row + usize::from(walls[b].wall.material)];
        let known = take_known(&mut self.old, (encounter, feeler), &foot.normal);
        let mut history = known.map_or([0.0; HISTORY_MAX], |c| c.history);
        let overlap = radius - foot.distance;
        let curvature = if radius > 0.0 {
            1.0 / radius + walls[b].curvature()
        } else {
            1.0 / walls[b].rounding
        };
        let held = if I::HOLDS {
            law.hold(coefficients, history[I::HISTORY - 1])
        } else {
            0.0
        };
        if overlap <= -held {
            return 0.0;
        }
        let [first, second] = [a, b].map(|k| twist_of(&self.rigid, &walls[k]));
        let velocity = first.at(&arms[0]) - second.at(&arms[1]);
        let touch = Touch {
            normal: Vec3(foot.normal.into()),
            overlap,
            velocity: Vec3(velocity.into()),
            spin: Vec3((first.spin - second.spin).into()),
            inverse_mass,
            curvature,
            inverse_inertia: inverse_mass * curvature * curvature,
        };
        let wrench = law.wrench(coefficients, &touch, &mut history, step);
        let (force, moment) = (
            Vector3::from(wrench.force.0),
            Vector3::from(wrench.moment.0),
        );
        for (k, sign, arm) in [(a, 1.0, &arms[0]), (b, -1.0, &arms[1])] {
            let (force, torque) = (sign * force, sign * (arm.cross(&force) + moment));
            let load = match &walls[k].carrier {
                Some(carrier) => &mut self.rigid[carrier.body as usize].load,
                None => &mut walls[k].load,
            };
            load.force += force;
            load.torque += torque;
        }
        self.contacts.push(BodyContact {
            encounter,
            feeler,
            history,
            normal: foot.normal.into(),
            overlap,
            curvature,
            force,
            moment,
            arms,
        });
        // Of a ball the radius is the scale, of others the way from the surface to the sharp core.
        overlap / (radius + walls[b].rounding)
    }

    /// Forces of the contacts of bodies with walls and with each other (N).
    pub fn forces(&self) -> impl Iterator<Item = f64> {
        self.contacts.iter().map(|contact| contact.force.norm())
    }

    /// Takes up contacts of a checkpoint.
    pub fn take_up(&mut self, contacts: Vec<BodyContact>) {
        self.contacts = contacts;
    }

    /// Energy in the springs of all contacts, one by one.
    pub fn stored(
        &self,
        law: &LawTable,
        walls: &[Standing],
        mut see: impl FnMut(crate::contact::Stored),
    ) {
        for contact in &self.contacts {
            let sides = self.encounters[contact.encounter as usize];
            let [a, b] = [sides.prober, sides.target].map(|k| walls[k as usize].wall.material);
            see(law.visit(StoredIn {
                contact,
                pair: usize::from(a) * law.materials() + usize::from(b),
            }));
        }
    }
}

/// Energy of one contact.
struct StoredIn<'a> {
    contact: &'a BodyContact,
    pair: usize,
}

impl Visitor for StoredIn<'_> {
    type Output = crate::contact::Stored;
    fn visit<I: Interaction>(self, law: &I) -> Self::Output {
        let BodyContact {
            overlap,
            curvature,
            history,
            ..
        } = self.contact;
        let coefficients = &law.table()[self.pair];
        law.stored(coefficients, *overlap, *curvature, &history[..I::HISTORY])
    }
}

/// How the surface of a wall or a part moves about its pivot.
pub(super) fn twist_of(rigid: &[Rigid], wall: &Standing) -> Twist {
    match &wall.carrier {
        Some(carrier) => rigid[carrier.body as usize].twist(),
        None => Twist {
            velocity: wall.velocity,
            spin: wall.spin,
        },
    }
}

/// Takes out the contact that went before: the one of this feeler whose normal is nearest, if it has not
/// turned far. Contacts lie in the order in which feelers are asked.
fn take_known(
    old: &mut [BodyContact],
    key: (u32, u32),
    normal: &Vector3<f64>,
) -> Option<BodyContact> {
    let from = old.partition_point(|c| c.key() < key);
    let turned = |c: &BodyContact| normal.dot(&Vector3::from(c.normal));
    let same = old[from..].iter_mut().take_while(|c| c.key() == key);
    let same = same.max_by(|a, b| turned(a).total_cmp(&turned(b)))?;
    if turned(same) < SAME {
        return None;
    }
    let taken = *same;
    // Nothing is near a normal that is no direction.
    same.normal = [0.0; 3];
    Some(taken)
}
