//! What an observer sees of the grains at one instant: the input of coarse-graining and of output.

use crate::bodies::{BodyContactSample, BodySample};
use crate::bonds::BondStress;
use crate::domain::Domain;
use nalgebra::Vector3;

/// A grain at one instant; velocities belong to the same time as the position.
#[derive(Clone, Copy, Debug)]
pub struct GrainSample {
    /// Number the grain was given at the start; it never changes.
    pub id: u32,
    /// Centre (m), inside the box along periodic axes.
    pub position: Vector3<f64>,
    /// Velocity of the centre (m/s).
    pub velocity: Vector3<f64>,
    /// Angular velocity (rad/s).
    pub spin: Vector3<f64>,
    /// Radius (m).
    pub radius: f64,
    /// Mass (kg); the true mass, also for fixed grains.
    pub mass: f64,
    /// Held in place: part of a wall or a rough base.
    pub fixed: bool,
    /// Number of the clump that carries it (see [`crate::ClumpSample::number`]).
    pub clump: Option<u32>,
}

/// Who a grain touches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Partner {
    /// Index into [`Snapshot::grains`].
    Grain(usize),
    /// Index of the wall.
    Wall(usize),
    /// Index of the body.
    Body(usize),
}

/// A contact at one instant. Each pair appears once.
#[derive(Clone, Copy, Debug)]
pub struct ContactSample {
    /// Index of the grain the force acts on, into [`Snapshot::grains`].
    pub grain: usize,
    /// The other side; it feels the opposite force.
    pub partner: Partner,
    /// Overlap, positive when pressed together (m).
    pub overlap: f64,
    /// Force on `grain` (N).
    pub force: Vector3<f64>,
    /// From the centre of `grain` to the contact point (m).
    pub arm: Vector3<f64>,
    /// From the centre of `partner` to the contact point (m); zero for a wall or
    /// a body.
    ///
    /// `arm - partner_arm` is the branch vector from `grain` to `partner`, nearest image.
    pub partner_arm: Vector3<f64>,
    /// Torque on `grain` about its centre (N m): that of the force, and moments of rolling and twisting.
    pub torque: Vector3<f64>,
    /// Torque on `partner` about its centre (N m); zero for a wall.
    pub partner_torque: Vector3<f64>,
}

/// A whole bond at one instant; it acts beside the contact of its grains, if they touch.
#[derive(Clone, Copy, Debug)]
pub struct BondSample {
    /// Indices of its grains into [`Snapshot::grains`].
    pub grains: [usize; 2],
    /// Force on the first grain; the second one feels the opposite (N).
    pub force: Vector3<f64>,
    /// Moment on the first grain about its centre (N m).
    pub moment: Vector3<f64>,
    /// From the centre of the first grain to the point that divides the line of centres (m).
    pub arm: Vector3<f64>,
    /// From the centre of the second one, as in [`ContactSample::partner_arm`] (m).
    pub partner_arm: Vector3<f64>,
    /// Radius of the bond (m).
    pub radius: f64,
    /// Stresses at its rim.
    pub stress: BondStress,
}

impl BondSample {
    /// The bond as if it were a contact; what its force and moments do about any point cancels in the pair.
    pub fn as_contact(&self) -> ContactSample {
        let branch = self.arm - self.partner_arm;
        ContactSample {
            grain: self.grains[0],
            partner: Partner::Grain(self.grains[1]),
            overlap: 0.0,
            force: self.force,
            arm: self.arm,
            partner_arm: self.partner_arm,
            torque: self.moment,
            partner_torque: branch.cross(&self.force) - self.moment,
        }
    }
}

/// All grains and contacts at one instant. Reuse one value: its buffers are kept.
#[derive(Clone, Debug)]
pub struct Snapshot {
    /// Time (s).
    pub time: f64,
    /// The box.
    pub domain: Domain,
    /// Acceleration of gravity (m/s²).
    pub gravity: Vector3<f64>,
    /// All grains, fixed ones included.
    pub grains: Vec<GrainSample>,
    /// All touching contacts.
    pub contacts: Vec<ContactSample>,
    /// All whole bonds, in the order in which they were made.
    pub bonds: Vec<BondSample>,
    /// All rigid bodies.
    pub bodies: Vec<BodySample>,
    /// Contacts of bodies with walls and with each other.
    pub body_contacts: Vec<BodyContactSample>,
}

impl Default for Snapshot {
    fn default() -> Self {
        Snapshot {
            time: 0.0,
            domain: Domain {
                lower: Vector3::zeros(),
                upper: Vector3::zeros(),
                periodic: [false; 3],
            },
            gravity: Vector3::zeros(),
            grains: Vec::new(),
            contacts: Vec::new(),
            bonds: Vec::new(),
            bodies: Vec::new(),
            body_contacts: Vec::new(),
        }
    }
}
