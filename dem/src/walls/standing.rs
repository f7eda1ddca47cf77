//! A wall, or a part of a rigid body, during a run: where it is, how it moves, what it carries.

use super::load::{WallImpulse, WallLoad};
use super::mesh::Mesh;
use super::motion::Motion;
use super::pose::Pose;
use super::servo::Course;
use super::shape::Shape;
use super::{Foot, Wall};
use crate::contact::{COEFFICIENTS, Interaction};
use crate::domain::Domain;
use crate::grains::Grains;
use nalgebra::{Matrix3, Vector3};

/// A wall and its state.
#[derive(Clone, Debug)]
pub(crate) struct Standing {
    pub wall: Wall,
    pub pose: Pose,
    /// Mean velocity of its origin over the last step, and its angular velocity.
    pub velocity: Vector3<f64>,
    pub spin: Vector3<f64>,
    pub course: Course,
    /// Of the last forces evaluated.
    pub load: WallLoad,
    pub impulse: WallImpulse,
    /// How far any point of its surface that grains may meet has come since grains near it were listed (m).
    pub travel: f64,
    /// Distance of the farthest such point from its origin, at least (m).
    pub extent: f64,
    /// How far the surface lies beyond the shape: parts of bodies have rounded edges (m).
    pub rounding: f64,
    /// The body that it is a part of, if it is.
    pub carrier: Option<Carrier>,
    upright: bool,
}

/// What a part knows of its body.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Carrier {
    /// Number of the body.
    pub body: u32,
    /// From the point that the body turns about to the part's origin (m).
    pub offset: Vector3<f64>,
    /// 1/M (1/kg), 0 for a body that moves as it is told.
    pub inverse_mass: f64,
    /// Inverse of the inertia tensor in directions of space (1/(kg m²)).
    pub inverse_inertia: Matrix3<f64>,
    /// 1/R of a sphere (1/m), 0 for other parts.
    pub curvature: f64,
}

impl Carrier {
    /// 1/m that a push along a unit normal feels at an arm from the turning point (1/kg).
    pub fn inverse_mass_at(&self, arm: &Vector3<f64>, normal: &Vector3<f64>) -> f64 {
        let lever = arm.cross(normal);
        self.inverse_mass + lever.dot(&(self.inverse_inertia * lever))
    }

    /// Whether forces move it.
    pub fn yields(&self) -> bool {
        self.inverse_mass > 0.0 || self.inverse_inertia != Matrix3::zeros()
    }
}

/// A step in time; times are the same bits whenever they are asked for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Span {
    from: f64,
    to: f64,
    length: f64,
}

impl Span {
    /// The step that ends after `steps` steps of this length (s).
    pub fn ending(steps: u64, length: f64) -> Span {
        Span {
            from: (steps as f64 - 1.0) * length,
            to: steps as f64 * length,
            length,
        }
    }
}

/// A wall's next step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stride {
    pose: Pose,
    course: Course,
    pub velocity: Vector3<f64>,
    pub spin: Vector3<f64>,
}

impl Standing {
    /// Puts a wall where it is at the end of a step.
    pub fn at(wall: Wall, step: Span, course: Course) -> Standing {
        let pose = wall.motion.pose(&wall.pose, step.to, course.along);
        let [velocity, spin] = wall.motion.velocity(&wall.pose, step.from, step.to);
        let mut standing = Standing {
            upright: pose.is_upright(),
            wall,
            pose,
            velocity,
            spin,
            course,
            load: WallLoad::default(),
            impulse: WallImpulse::default(),
            travel: 0.0,
            extent: f64::INFINITY,
            rounding: 0.0,
            carrier: None,
        };
        if let Motion::Servo(servo) = &standing.wall.motion {
            standing.velocity = servo.axis * course.speed;
        }
        standing
    }

    /// Whether forces move it: it is part of a body that yields.
    #[inline(always)]
    pub fn yields(&self) -> bool {
        self.carrier.as_ref().is_some_and(Carrier::yields)
    }

    /// 1/m that a push along a unit normal feels at an arm from the origin (1/kg); 0 for walls.
    #[inline(always)]
    pub fn inverse_mass_at(&self, arm: &Vector3<f64>, normal: &Vector3<f64>) -> f64 {
        match &self.carrier {
            None => 0.0,
            Some(carrier) => carrier.inverse_mass_at(&(carrier.offset + arm), normal),
        }
    }

    /// 1/R that enters a contact law (1/m): of spheres of bodies; walls have none.
    #[inline(always)]
    pub fn curvature(&self) -> f64 {
        self.carrier.map_or(0.0, |carrier| carrier.curvature)
    }

    #[inline(always)]
    pub fn moves(&self) -> bool {
        self.carrier.is_some() || !matches!(self.wall.motion, Motion::Fixed)
    }

    /// A step under the present load.
    pub fn stride(&self, step: Span) -> Stride {
        let (motion, start) = (&self.wall.motion, &self.wall.pose);
        let mut course = self.course;
        let [mut velocity, spin] = motion.velocity(start, step.from, step.to);
        if let Motion::Servo(servo) = motion {
            course = servo.next(&course, &self.load.force, step.length);
            velocity = servo.axis * course.speed;
        }
        Stride {
            pose: motion.pose(start, step.to, course.along),
            course,
            velocity,
            spin,
        }
    }

    /// A part of a body, whose surface lies beyond its shape by a rounding (m).
    pub fn part(wall: Wall, rounding: f64, carrier: Carrier) -> Standing {
        let start = Span::ending(0, 0.0);
        Standing {
            rounding,
            carrier: Some(carrier),
            ..Standing::at(wall, start, Course::default())
        }
    }

    /// Goes where its body takes it.
    pub fn carry(&mut self, pose: Pose, velocity: Vector3<f64>, spin: Vector3<f64>) {
        let turn = pose.orientation * self.pose.orientation.inverse();
        self.travel += (pose.position - self.pose.position).norm();
        let turned = 2.0 * turn.imag().norm();
        if turned > 0.0 {
            self.travel += turned * self.extent;
        }
        (self.pose, self.velocity, self.spin) = (pose, velocity, spin);
        self.upright = pose.is_upright();
    }

    /// Makes a step.
    pub fn advance(&mut self, step: Span) {
        if matches!(self.wall.motion, Motion::Fixed) {
            return;
        }
        let next = self.stride(step);
        let moved = (next.pose.position - self.pose.position).norm();
        let turned = 2.0 * (0.5 * next.spin.norm() * step.length).sin().abs();
        self.travel += moved;
        if turned > 0.0 {
            self.travel += turned * self.extent;
        }
        (self.pose, self.course) = (next.pose, next.course);
        (self.velocity, self.spin) = (next.velocity, next.spin);
        self.upright = self.pose.is_upright();
    }

    /// A centre seen from the wall's origin: its nearest image to a bounded wall.
    #[inline(always)]
    pub fn seen(&self, x: &Vector3<f64>, domain: &Domain) -> Vector3<f64> {
        let apart = x - self.pose.position;
        match self.wall.shape {
            // It spans the periodic axes, or is not what a periodic box can hold.
            Shape::Plane(_) => apart,
            _ => domain.nearest_image(apart),
        }
    }

    /// Foot of a centre seen from the wall's origin, in directions of space.
    #[inline(always)]
    pub fn foot(&self, seen: &Vector3<f64>) -> Foot {
        if self.upright {
            let foot = self.wall.shape.foot(seen);
            return Foot {
                distance: foot.distance - self.rounding,
                ..foot
            };
        }
        let foot = self.wall.shape.foot(&self.pose.inward(seen));
        Foot {
            distance: foot.distance - self.rounding,
            normal: self.pose.outward(&foot.normal),
        }
    }

    /// Velocity of the surface at an arm from the wall's origin (m/s).
    #[inline(always)]
    pub fn velocity_at(&self, arm: &Vector3<f64>) -> Vector3<f64> {
        self.velocity + self.spin.cross(arm)
    }
}

impl Standing {
    /// How fast grains that drift at a velocity may near the wall (m/s).
    #[inline(always)]
    pub fn drift(&self, drift: &Vector3<f64>) -> f64 {
        match &self.wall.shape {
            Shape::Plane(plane) if self.upright => drift.dot(&plane.normal).abs(),
            _ => drift.norm(),
        }
    }

    /// Coefficients of the law between the wall and a grain.
    #[inline(always)]
    pub fn coefficients<'a, I: Interaction>(
        &self,
        law: &'a I,
        grains: &Grains,
        grain: usize,
    ) -> &'a [f64; COEFFICIENTS] {
        let own = usize::from(grains.material[grain]) * law.materials();
        &law.table()[own + usize::from(self.wall.material)]
    }

    /// Shows the images of a centre that are nearer than `reach` to the box of a mesh: what to add to
    /// the centre, and the image in the mesh's own coordinates. Returns the distance of the nearest (m).
    pub fn images_near(
        &self,
        mesh: &Mesh,
        x: &Vector3<f64>,
        reach: f64,
        domain: &Domain,
        mut see: impl FnMut(Vector3<f64>, &Vector3<f64>),
    ) -> f64 {
        let [low, high] = mesh.bounds();
        let middle = self.pose.position + self.pose.outward(&(0.5 * (low + high)));
        let apart = x - middle;
        let lengths = domain.lengths();
        // Whole lengths, so that an image has the same bits whenever it is looked for.
        let home = (domain.nearest_image(apart) - apart).component_div(&lengths);
        let home = home.map(f64::round);
        let round = domain
            .periodic
            .map(|periodic| if periodic { -1..=1 } else { 0..=0 });
        let mut nearest = f64::INFINITY;
        for i in round[0].clone() {
            for j in round[1].clone() {
                for k in round[2].clone() {
                    let turns = home + Vector3::new(i, j, k).map(f64::from);
                    let shift = lengths.component_mul(&turns);
                    let centre = self.pose.inward(&(x + shift - self.pose.position));
                    let distance = mesh.box_distance(&centre);
                    nearest = nearest.min(distance);
                    if distance < reach {
                        see(shift, &centre);
                    }
                }
            }
        }
        nearest
    }
}
