//! Discrete element engine: grains, contact laws, search, walls, rigid bodies, preparation.
//!
//! * A scene hands over a [`Setup`]: grains, walls, bodies, a contact law, gravity, a time step.
//! * [`Simulation::advance`] integrates Newton's equations by leap-frog.
//! * [`Simulation::snapshot`] shows all grains and contacts of one instant; coarse-graining and
//!   output need nothing else.
//!
//! SI units; overlap and compression positive; x downslope, y across, z away from the ground.
//! Results are the same bits for any number of threads and after a restart from a [`Record`].

pub mod bodies;
mod bonds;
mod boundaries;
mod checkpoint;
mod chunk;
mod clumps;
pub mod contact;
mod contacts;
mod conversion;
mod domain;
mod energy;
mod forces;
mod grains;
mod gravity;
mod grid;
mod held;
mod lanes;
mod ledger;
mod loads;
mod motion;
mod neighbours;
mod observe;
mod patch;
mod places;
mod population;
pub mod preparation;
mod reach;
mod record;
mod region;
mod rows;
mod setup;
mod simulation;
mod snapshot;
mod state_hash;
mod sweep;
mod team;
pub mod timestep;
mod validity;
pub mod walls;

pub use bodies::{
    Body, BodyContactSample, BodyLoad, BodySample, Freedom, Hinge, MassProperties, Part, Solid,
    Touched,
};
pub use bonds::{
    BondCount, BondRule, BondState, BondStress, Cement, Cluster, Clusters, Section as BondSection,
};
pub use boundaries::{BoxMotion, Edge, Outflow, Outlet, StressServo};
pub use clumps::{Clump, ClumpSample};
pub use contact::{
    Cohesion, ContactLaw, Damping, Elasticity, Epsd, Hertz, Hooke, Jkr, LawTable, Laws, Lever,
    Mindlin, Normal, Rolling, ShapeParameter, SpringStiffness, Tangential, TangentialSpring,
    Viscoelastic,
};
pub use domain::Domain;
pub use energy::Energy;
pub use grains::Grain;
pub use gravity::{GRAVITATION, HeavySphere, Schedule, SelfGravity, TreeError};
pub use lanes::Width;
pub use ledger::{Bonding, Channels, EnergyLedger, Falling};
pub use loads::Load;
pub use patch::Patch;
pub use record::Record;
pub use region::Region;
pub use setup::{Setup, SetupError, Threads};
pub use simulation::{Diverged, Simulation};
pub use snapshot::{BondSample, ContactSample, GrainSample, Partner, Snapshot};
pub use state_hash::StateHash;
pub use walls::{Motion, Pose, Shape, Side, Wall, WallImpulse, WallLoad};
