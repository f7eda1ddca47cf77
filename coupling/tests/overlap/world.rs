//! Beds, flows and what is joined at their edges.

use colluvium_continuum::grid::Boundary;
use colluvium_continuum::rheology::MuI;
use colluvium_coupling::overlap::{FlatEdge, OverlapSettings, OverlapSpec, Scales};
use colluvium_dem::preparation::{InclineBed, RadiusLaw, settle_incline_bed};
use colluvium_dem::*;
use nalgebra::Vector3;
use std::ops::ControlFlow;
use std::sync::OnceLock;

pub const STIFFNESS: f64 = 5000.0;
pub const STEP: f64 = 2e-3;
pub const DENSITY: f64 = 6.0 / std::f64::consts::PI;
/// Solid fraction of the flows at 24°, measured through the depth.
pub const SOLID_FRACTION: f64 = 0.5655;

pub fn law() -> ContactLaw {
    ContactLaw::linear(
        Hooke::matched(STIFFNESS, 0.6),
        TangentialSpring::matched(2.0 / 7.0, 0.6, 0.5),
        None,
    )
}

/// Fitted to full flows of these grains at 24° and 26°.
pub fn rheology() -> MuI {
    MuI::new(0.309, 0.701, 0.3, 1.0, SOLID_FRACTION, DENSITY)
}

/// A settled bed on a rough base.
#[derive(Debug)]
pub struct Bed {
    pub domain: Domain,
    pub grains: Vec<Grain>,
    pub depth: f64,
}

fn settle(grains: usize, length: f64, width: f64) -> Bed {
    let spec = InclineBed {
        grains,
        radius: RadiusLaw::Uniform {
            low: 0.45,
            high: 0.55,
        },
        density: DENSITY,
        length,
        width,
        law: law(),
        gravity: 1.0,
        timestep: STEP,
        seed: 7,
    };
    let bed =
        settle_incline_bed(&spec, Threads::Serial, &mut |_| ControlFlow::Continue(())).unwrap();
    let mut domain = bed.domain;
    domain.upper.z = 2.5 * bed.report.depth;
    Bed {
        domain,
        grains: bed.grains,
        depth: bed.report.depth,
    }
}

/// The study's bed: 1360 grains on 8 x 6 d, 25 d deep.
pub fn deep_bed() -> &'static Bed {
    static BED: OnceLock<Bed> = OnceLock::new();
    BED.get_or_init(|| settle(1360, 8.0, 6.0))
}

/// 520 grains on 6 x 5 d, 15 d deep.
pub fn small_bed() -> &'static Bed {
    static BED: OnceLock<Bed> = OnceLock::new();
    BED.get_or_init(|| settle(520, 6.0, 5.0))
}

impl Bed {
    /// The bed on a slope, at rest.
    pub fn tilted(&self, slope_degrees: f64) -> Setup {
        let slope = slope_degrees.to_radians();
        let fixed = self.grains.iter().filter(|g| g.fixed);
        let lowest = fixed.map(|g| g.position.z - g.radius).fold(0.0, f64::min);
        Setup {
            domain: self.domain,
            gravity: Vector3::new(slope.sin(), 0.0, -slope.cos()),
            law: law().into(),
            grains: self.grains.clone(),
            walls: vec![Wall::plane(Vector3::z() * lowest, Vector3::z())],
            bodies: Vec::new(),
            timestep: STEP,
            threads: Threads::Serial,
        }
    }

    /// A flow that began with Bagnold's profile and has gone on for a while.
    pub fn flow(&self, slope_degrees: f64, time: f64) -> Simulation {
        let setup = self.tilted(slope_degrees);
        let law = rheology();
        let slope = slope_degrees.to_radians();
        let inertial_number = law.inertial_number_at(slope.tan());
        let scale = 2.0 / 3.0 * inertial_number * (SOLID_FRACTION * slope.cos()).sqrt();
        let depth = self.depth;
        let mut simulation = Simulation::new(setup).unwrap();
        simulation.give_velocity(|grain| {
            let z = grain.position.z.clamp(0.0, depth);
            Vector3::x() * scale * (depth.powf(1.5) - (depth - z).powf(1.5))
        });
        simulation.advance(steps(time)).unwrap();
        simulation
    }

    /// What is joined at a height: continuum above a free-standing lower part.
    pub fn continuum_above(&self, height: f64, settings: OverlapSettings) -> OverlapSpec<MuI> {
        OverlapSpec {
            edge: FlatEdge::across(&self.domain, 2, 0, true, height),
            far_end: Boundary::FreeSurface,
            ..self.spec(settings)
        }
    }

    /// The reverse: continuum on the base, grains on it.
    pub fn continuum_below(&self, height: f64, settings: OverlapSettings) -> OverlapSpec<MuI> {
        OverlapSpec {
            edge: FlatEdge::across(&self.domain, 2, 0, false, height),
            far_end: Boundary::NoSlip { velocity: 0.0 },
            ..self.spec(settings)
        }
    }

    fn spec(&self, settings: OverlapSettings) -> OverlapSpec<MuI> {
        let rheology = rheology();
        OverlapSpec {
            edge: FlatEdge::across(&self.domain, 2, 0, true, 0.0),
            rheology,
            mass: None,
            far_end: Boundary::FreeSurface,
            scales: scales(rheology.bulk_density()),
            settings,
            strain_rate_floor: 1e-6,
        }
    }
}

pub fn scales(density: f64) -> Scales {
    Scales {
        diameter: 1.0,
        time: 1.0,
        density,
        stiffness: STIFFNESS,
    }
}

pub fn steps(time: f64) -> u64 {
    (time / STEP).round() as u64
}

/// Largest speed of any free grain.
pub fn fastest(simulation: &mut Simulation, snapshot: &mut Snapshot) -> f64 {
    simulation.snapshot(snapshot);
    let free = snapshot.grains.iter().filter(|g| !g.fixed);
    free.map(|g| g.velocity.norm()).fold(0.0, f64::max)
}
