//! Periodic boxes that change.
//!
//! The box grows and shrinks about its centre, and shears along x. An image n boxes away along axis k
//! moves against the grain itself by `n dL_k/dt`; sheared, one above along the axis g by `γ̇ L_g` along x
//! (Lees & Edwards 1972); an offset that is left stretches with the edge along x. Newton's equations are
//! those of the space outside: nothing but contacts across the boundary and grains that cross it brings
//! the motion in. A grain that crosses changes its velocity by that of the image (Tatsuuma et al. 2019,
//! Eq. 12–15), in the lists' own time: until they are built anew it is known by an image of its own.
//!
//! Where the rate changes, grains may be *carried*: each is kicked by the change of the velocity that
//! uniform deformation has at its place. All images then stay alike. Without that, grains are taken into
//! the box first and keep their velocities: only the boundary moves.
//!
//! The boundary works on grains by `F · w` of every contact across it, w the image's velocity, and by the
//! kinetic energy of those that cross: what stress times rate of strain is, to round-off
//! ([`crate::EnergyLedger::boundary`]).

use crate::domain::{Cell, ImageDrift};
use crate::grains::vector;
use crate::record::Record;
use crate::setup::{SetupError, check, check_box};
use crate::simulation::{Diverged, Simulation};
use nalgebra::Vector3;

/// How an edge of the box changes.
#[derive(Clone, Debug, PartialEq)]
pub enum Edge {
    /// It does not.
    Rest,
    /// It grows at this speed (m/s): both faces at half of it.
    Speed(f64),
    /// Its length at rising times (s, m), straight lines between them; it rests before and after.
    Lengths(Vec<(f64, f64)>),
}

/// Shrinks or grows a box, the same share along all axes, until it carries a pressure.
///
/// ```text
/// dL/dt = -rate L (p_wanted - p)/p_wanted, at most ± rate L
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StressServo {
    /// Wanted pressure, -1/3 the trace of the stress (Pa).
    pub pressure: f64,
    /// Largest rate of strain of an edge (1/s).
    pub rate: f64,
    /// Steps between two looks at the stress.
    pub every: u64,
}

/// How a periodic box moves.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum BoxMotion {
    /// Not at all; an offset of earlier shear stays.
    #[default]
    Rest,
    /// Edges change their lengths.
    Stretch {
        /// Each edge.
        edges: [Edge; 3],
        /// Whether grains are carried where a speed changes.
        carry: bool,
    },
    /// All edges follow the pressure; grains are carried.
    Servo(StressServo),
    /// Planes across an axis slide along x.
    Shear {
        /// 1 or 2: y or z.
        across: usize,
        /// γ̇ = dv_x/dy or dv_x/dz (1/s).
        rate: f64,
        /// Whether grains are carried where the rate changes, as at the start.
        carry: bool,
    },
}

impl BoxMotion {
    fn validate(&self) -> Result<(), SetupError> {
        match self {
            BoxMotion::Rest => Ok(()),
            BoxMotion::Stretch { edges, .. } => {
                (0..3).try_for_each(|k| edges[k].validate(&format!("box.edges[{k}]")))
            }
            BoxMotion::Servo(servo) => {
                let positive = |key: &str, v: f64| check(key, v, "> 0", |v| v > 0.0);
                positive("box.pressure", servo.pressure)?;
                positive("box.rate", servo.rate)?;
                positive("box.every", servo.every as f64)
            }
            BoxMotion::Shear { across, rate, .. } => {
                check("box.across", *across as f64, "1 (y) or 2 (z)", |a| {
                    a == 1.0 || a == 2.0
                })?;
                check("box.shear_rate", *rate, "finite, 1/s", |_| true)
            }
        }
    }

    /// Axes that must be periodic.
    fn needs(&self) -> [bool; 3] {
        match self {
            BoxMotion::Rest => [false; 3],
            BoxMotion::Stretch { edges, .. } => [0, 1, 2].map(|k| edges[k] != Edge::Rest),
            BoxMotion::Servo(_) => [true; 3],
            BoxMotion::Shear { across, .. } => [true, *across == 1, *across == 2],
        }
    }

    fn carries(&self) -> bool {
        match self {
            BoxMotion::Rest => false,
            BoxMotion::Stretch { carry, .. } | BoxMotion::Shear { carry, .. } => *carry,
            BoxMotion::Servo(_) => true,
        }
    }
}

impl Edge {
    fn validate(&self, key: &str) -> Result<(), SetupError> {
        match self {
            Edge::Rest => Ok(()),
            Edge::Speed(speed) => check(key, *speed, "finite, m/s", |_| true),
            Edge::Lengths(points) => {
                let mut last = f64::NEG_INFINITY;
                for (time, length) in points {
                    check(
                        &format!("{key}, time"),
                        *time,
                        "above the one before",
                        |t| t > last,
                    )?;
                    check(&format!("{key}, length"), *length, "> 0 m", |l| l > 0.0)?;
                    last = *time;
                }
                let count = points.len() as f64;
                check(&format!("{key}, points"), count, "at least 2", |n| n > 1.0)
            }
        }
    }

    /// Speed over a step of this length (s) from an instant (s) at which the edge is `length` (m).
    fn speed(&self, time: f64, step: f64, length: f64) -> f64 {
        let points = match self {
            Edge::Rest => return 0.0,
            Edge::Speed(speed) => return *speed,
            Edge::Lengths(points) => points,
        };
        let (first, last) = (points[0], points[points.len() - 1]);
        let end = time + step;
        if end <= first.0 || time >= last.0 {
            return 0.0;
        }
        let after = points
            .partition_point(|(t, _)| *t <= end)
            .min(points.len() - 1);
        let ((t0, l0), (t1, l1)) = (points[after - 1], points[after]);
        let wanted = l0 + (l1 - l0) * ((end.min(last.0) - t0) / (t1 - t0));
        (wanted - length) / step
    }

    fn numbers(&self) -> Vec<f64> {
        match self {
            Edge::Rest => Vec::new(),
            Edge::Speed(speed) => vec![*speed],
            Edge::Lengths(points) => points.iter().flat_map(|(t, l)| [*t, *l]).collect(),
        }
    }

    fn from_numbers(numbers: &[f64]) -> Edge {
        match numbers {
            [] => Edge::Rest,
            [speed] => Edge::Speed(*speed),
            points => Edge::Lengths(
                points
                    .as_chunks::<2>()
                    .0
                    .iter()
                    .map(|&[t, l]| (t, l))
                    .collect(),
            ),
        }
    }
}

/// A box in motion.
#[derive(Clone, Debug, Default)]
pub(crate) struct MovingBox {
    motion: BoxMotion,
    pub drift: ImageDrift,
}

impl MovingBox {
    /// Writes the box into a checkpoint.
    pub fn record(&self, cell: &Cell, record: &mut Record) {
        let d = &self.drift;
        let [x, y, z] = d.speeds;
        let (kind, own) = match &self.motion {
            BoxMotion::Rest => (0, Vec::new()),
            BoxMotion::Stretch { .. } => (1, Vec::new()),
            BoxMotion::Servo(s) => (2, vec![s.pressure, s.rate]),
            BoxMotion::Shear { across, rate, .. } => (3, vec![*across as f64, *rate]),
        };
        let every = match &self.motion {
            BoxMotion::Servo(servo) => servo.every,
            _ => 0,
        };
        let carry = u64::from(self.motion.carries());
        record.counts.insert(
            "box/motion".into(),
            vec![kind, carry, every, d.gradient as u64],
        );
        record.numbers.insert("box/motion".into(), own);
        if let BoxMotion::Stretch { edges, .. } = &self.motion {
            for (edge, axis) in edges.iter().zip(["x", "y", "z"]) {
                let name = format!("box/edge_{axis}");
                record.numbers.insert(name, edge.numbers());
            }
        }
        record
            .numbers
            .insert("box/drift".into(), vec![x, y, z, d.offset, d.slip]);
        let bounds = cell.domain.lower.iter().chain(cell.domain.upper.iter());
        record
            .numbers
            .insert("box/bounds".into(), bounds.copied().collect());
    }

    /// Reads it back, with the box itself.
    pub fn read(&mut self, cell: &mut Cell, record: &Record) -> Result<(), String> {
        let &[kind, carry, every, gradient] = record.counts("box/motion")? else {
            return Err("array `box/motion` must have 4 counts".into());
        };
        let carry = carry != 0;
        self.motion = match (kind, record.numbers("box/motion")?) {
            (0, []) => BoxMotion::Rest,
            (1, []) => {
                let mut edges = [const { Edge::Rest }; 3];
                for (edge, axis) in edges.iter_mut().zip(["x", "y", "z"]) {
                    *edge = Edge::from_numbers(record.numbers(&format!("box/edge_{axis}"))?);
                }
                BoxMotion::Stretch { edges, carry }
            }
            (2, &[pressure, rate]) => BoxMotion::Servo(StressServo {
                pressure,
                rate,
                every,
            }),
            (3, &[across, rate]) => BoxMotion::Shear {
                across: across as usize,
                rate,
                carry,
            },
            _ => return Err("array `box/motion` says nothing that a box can do".into()),
        };
        self.motion.validate().map_err(|e| e.to_string())?;
        let (&[x, y, z, offset, slip], gradient @ 0..3) = (record.numbers("box/drift")?, gradient)
        else {
            return Err("array `box/drift` must have 5 numbers".into());
        };
        self.drift = ImageDrift {
            speeds: [x, y, z],
            gradient: gradient as usize,
            offset,
            slip,
        };
        let &[a, b, c, d, e, f] = record.numbers("box/bounds")? else {
            return Err("array `box/bounds` must have 6 numbers".into());
        };
        cell.domain.lower = Vector3::new(a, b, c);
        cell.domain.upper = Vector3::new(d, e, f);
        let lengths = cell.domain.lengths();
        if !lengths.iter().all(|l| l.is_finite() && *l > 0.0) {
            return Err("array `box/bounds` has no box".into());
        }
        Ok(())
    }
}

impl Simulation {
    /// The box and how its images move.
    pub(crate) fn cell(&self) -> Cell {
        Cell {
            domain: self.domain,
            drift: self.moving_box.drift,
        }
    }

    /// Lets the box move from now on.
    ///
    /// # Errors
    /// If a number is out of its range, an axis that moves is not periodic, or there are walls or fixed
    /// grains, which have no images that could move.
    pub fn set_box_motion(&mut self, motion: BoxMotion) -> Result<(), SetupError> {
        motion.validate()?;
        if motion != BoxMotion::Rest {
            for (k, needed) in motion.needs().into_iter().enumerate() {
                let periodic = f64::from(u8::from(self.domain.periodic[k] || !needed));
                check(
                    &format!("box: periodic[{k}]"),
                    periodic,
                    "1 where it moves",
                    |p| p == 1.0,
                )?;
            }
            let clumps = self.clump_count() as f64;
            let word = "0 where the box moves: they do not go through its boundaries";
            check("box: clumps, their number", clumps, word, |n| n == 0.0)?;
            let held = (0..self.grains.len())
                .filter(|&i| self.grains.is_fixed(i))
                .count();
            let standing = (held + self.walls.len()) as f64;
            check(
                "box: walls and fixed grains",
                standing,
                "0 in a moving box",
                |n| n == 0.0,
            )?;
        }
        if let (BoxMotion::Shear { across, .. }, true) =
            (&motion, self.moving_box.drift.offset != 0.0)
        {
            let sheared = self.moving_box.drift.gradient as f64;
            check("box.across", *across as f64, "as before", |a| a == sheared)?;
        }
        self.forget_observation();
        self.moving_box.motion = motion;
        self.steer_box();
        Ok(())
    }

    /// Refuses so many things that have no images which could move, if the box moves or is sheared.
    pub(crate) fn refuse_in_moving_box(&self, key: &str, number: usize) -> Result<(), SetupError> {
        let moving = &self.moving_box;
        if moving.motion == BoxMotion::Rest && !moving.drift.moves() {
            return Ok(());
        }
        check(
            key,
            number as f64,
            "0 in a box that moves or is sheared",
            |n| n == 0.0,
        )
    }

    /// Reads the box of a checkpoint.
    pub(crate) fn read_box(&mut self, record: &Record) -> Result<(), String> {
        let mut cell = self.cell();
        self.moving_box.read(&mut cell, record)?;
        self.domain = cell.domain;
        Ok(())
    }

    /// How the box moves.
    pub fn box_motion(&self) -> &BoxMotion {
        &self.moving_box.motion
    }

    /// Moves the box by a step.
    pub(crate) fn move_box(&mut self) {
        let drift = &mut self.moving_box.drift;
        if !drift.moves() {
            return;
        }
        for k in 0..3 {
            let half = 0.5 * self.timestep * drift.speeds[k];
            self.domain.lower[k] -= half;
            self.domain.upper[k] += half;
        }
        let length = self.domain.lengths().x;
        drift.offset += self.timestep * drift.slip;
        let turns = (drift.offset / length).round();
        drift.offset -= length * turns;
        drift.slip -= drift.speeds[0] * turns;
    }

    /// Gives the box its speeds for the next step.
    pub(crate) fn steer_box(&mut self) {
        let (mut next, lengths) = (self.moving_box.drift, self.domain.lengths());
        match &self.moving_box.motion {
            BoxMotion::Rest => (next.speeds, next.slip) = ([0.0; 3], 0.0),
            BoxMotion::Stretch { edges, .. } => {
                let (time, step) = (self.time(), self.timestep);
                next.speeds = [0, 1, 2].map(|k| edges[k].speed(time, step, lengths[k]));
                next.slip = self.affine_slip(next.speeds[0]);
            }
            BoxMotion::Servo(servo) if self.steps.is_multiple_of(servo.every) => {
                let servo = *servo;
                let pressure = -self.stress().trace() / 3.0;
                self.forget_observation();
                let share = (servo.pressure - pressure) / servo.pressure;
                next.speeds = (lengths * (-servo.rate * share.clamp(-1.0, 1.0))).into();
                next.slip = self.affine_slip(next.speeds[0]);
            }
            BoxMotion::Servo(_) => return,
            BoxMotion::Shear { across, rate, .. } => {
                next.speeds = [0.0; 3];
                (next.gradient, next.slip) = (*across, rate * lengths[*across]);
            }
        }
        if next != self.moving_box.drift {
            self.change_drift(next);
        }
    }

    /// How fast the offset of earlier shear grows where the edge along x does at a speed (m/s): with it, as all
    /// lengths along x do, d(offset)/dt = offset (dL_x/dt)/L_x.
    fn affine_slip(&self, speed: f64) -> f64 {
        let now = &self.moving_box.drift;
        if now.offset == 0.0 || speed == 0.0 {
            0.0
        } else if speed == now.speeds[0] {
            // Both have been on straight lines through the same share.
            now.slip
        } else {
            now.offset * speed / self.domain.lengths().x
        }
    }

    /// Goes to other speeds, which the grains are carried by or not.
    fn change_drift(&mut self, next: ImageDrift) {
        let carry = self.moving_box.motion.carries();
        if !carry {
            self.wrap_grains();
        }
        let (now, cell) = (
            self.cell(),
            Cell {
                domain: self.domain,
                drift: next,
            },
        );
        self.moving_box.drift = next;
        if carry {
            for i in 0..self.grains.len() {
                let x = vector(&self.grains.place[i]);
                self.shift_velocity(i, cell.stream(&x) - now.stream(&x));
            }
        }
    }

    /// Takes all grains into a moving box.
    pub(crate) fn wrap_grains(&mut self) {
        let cell = self.cell();
        if !cell.drift.moves() {
            return;
        }
        for i in 0..self.grains.len() {
            let x = vector(&self.grains.place[i]);
            let (inside, image) = cell.wrap(x);
            if inside != x {
                self.grains.place[i][..3].copy_from_slice(inside.as_slice());
                self.shift_velocity(i, -image);
            }
        }
    }

    /// Changes a velocity by way of the boundary.
    fn shift_velocity(&mut self, i: usize, by: Vector3<f64>) {
        let v = vector(&self.grains.motion[i]);
        if !self.grains.is_fixed(i) {
            let m = self.grains.mass[i];
            self.account += m * by;
            if let Some(ledger) = &mut self.ledger {
                ledger.boundary += m * by.dot(&(v + 0.5 * by));
            }
        }
        self.grains.motion[i][..3].copy_from_slice((v + by).as_slice());
    }

    /// Refuses to go on in a box that has become too narrow for its lists.
    pub(crate) fn check_width(&self) -> Result<(), Diverged> {
        if !self.moving_box.drift.moves() {
            return Ok(());
        }
        let largest = self.list.levels.iter().map(|l| l.radius);
        let largest = largest.fold(0.0, f64::max);
        check_box(&self.domain, largest, self.skin).map_err(|narrow| Diverged::Narrow {
            time: self.time(),
            narrow: Box::new(narrow),
        })
    }
}
