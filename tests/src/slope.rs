//! The angles at which a slope starts to slide and at which it comes to rest.
//!
//! A bed settles on a rough base of its own grains in a box, periodic across the slope, closed by a
//! rough wall at the lower and the upper end. Gravity is then rotated slowly until grains run; its
//! direction is held and the avalanche runs out. The lower end fills, the upper end empties, and what
//! counts is the angle between the new surface and the horizontal, read off the middle half of the box.
//! Nothing is poured or dropped, and the slope is as long as the box.
//!
//! Units d = m = g = 1.

use crate::DENSITY;
use crate::fit::Line;
use colluvium_dem::preparation::{InclineBed, RadiusLaw, settle_incline_bed};
use colluvium_dem::{
    ContactLaw, Domain, Hooke, Plane, Setup, SetupError, ShapeParameter, Simulation, Snapshot,
    TangentialSpring, Threads, timestep,
};
use nalgebra::Vector3;
use std::ops::ControlFlow;

/// k_n d/(m g): grains under 10 d of others overlap by 0.2 % of d.
const STIFFNESS: f64 = 5e3;

/// Steps a contact.
const STEPS: f64 = 20.0;

/// The thesis' grains (Tab. 2.2, ε as in Tab. 2.1) by μ_R and β.
pub fn grains(rolling_friction: f64, beta: f64) -> ContactLaw {
    ContactLaw::linear(
        Hooke::matched(STIFFNESS, 0.5),
        TangentialSpring::matched(2.0 / 7.0, 0.5, 1.0),
        Some(ShapeParameter {
            beta,
            rolling_friction,
            twisting_friction: 1.3,
        }),
    )
}

/// A bed to be tilted.
#[derive(Clone, Copy, Debug)]
pub struct Tilt {
    /// Length of the box (d).
    pub length: f64,
    /// Width of the periodic slice (d).
    pub width: f64,
    /// Grains a d² of the base; 1.1 make a layer one grain deep.
    pub filling: f64,
    /// Tilt at which the slow rotation begins (degrees).
    pub from: f64,
    /// Its speed (degrees a √(d/g)).
    pub speed: f64,
    /// Seed of the bed.
    pub seed: u64,
}

/// What a bed did.
#[derive(Clone, Copy, Debug)]
pub struct Avalanche {
    /// Slope of the surface when it began to run (degrees).
    pub start: f64,
    /// Slope of the surface at rest after it (degrees).
    pub rest: f64,
    /// How far the grains' mean went downslope after the start (d).
    pub run: f64,
    /// Time from the first tilt to rest (√(d/g)).
    pub time: f64,
    /// Grains times steps, the bed's preparation left out.
    pub grain_steps: u64,
}

/// Kinetic energy of an avalanche, and of rest (m g d a grain).
const RUNS: f64 = 2e-2;
const AT_REST: f64 = 1e-6;

impl Tilt {
    /// Tilts until an avalanche has come to rest.
    ///
    /// # Errors
    /// If the bed cannot be prepared or its step is too long.
    pub fn run(&self, law: ContactLaw) -> Result<Avalanche, SetupError> {
        let timestep = timestep::step(1.0, STIFFNESS, STEPS);
        let spec = InclineBed {
            grains: (self.length * self.width * self.filling) as usize,
            radius: RadiusLaw::Gaussian {
                mean: 0.5,
                relative_deviation: 0.1,
                cut: 1.0,
            },
            density: DENSITY,
            length: self.length,
            width: self.width,
            law,
            gravity: 1.0,
            timestep,
            seed: self.seed,
        };
        let bed = settle_incline_bed(&spec, Threads::Serial, &mut |_| ControlFlow::Continue(()))?;
        // Grains that the periodic box had cut stick out at both ends: the walls stand outside of them.
        let end = |x: f64, normal: f64| Plane {
            point: Vector3::new(x, 0.0, 0.0),
            normal: Vector3::new(normal, 0.0, 0.0),
            material: 0,
        };
        let mut simulation = Simulation::new(Setup {
            domain: Domain {
                periodic: [false, true, false],
                ..bed.domain
            },
            gravity: -Vector3::z(),
            law: law.into(),
            grains: bed.grains,
            planes: vec![end(-0.55, 1.0), end(self.length + 0.55, -1.0)],
            timestep,
            threads: Threads::Serial,
        })?;
        let look_time = 0.5;
        let look = (look_time / timestep) as u64;
        let mut snapshot = Snapshot::default();
        let (mut tilt, mut still) = (0.0, 0);
        let mut started: Option<(f64, f64)> = None;
        loop {
            if started.is_none() {
                // The first degrees go fast, but not so fast that the bed sloshes.
                tilt += look_time * if tilt < self.from { 2.0 } else { self.speed };
                let (s, c) = f64::to_radians(tilt).sin_cos();
                simulation.set_gravity(Vector3::new(s, 0.0, -c));
            }
            simulation.advance(look)?;
            simulation.snapshot(&mut snapshot);
            let free = snapshot.grains.iter().filter(|g| !g.fixed);
            let count = free.clone().count() as f64;
            let energy: f64 = free
                .clone()
                .map(|g| 0.5 * g.mass * g.velocity.norm_squared())
                .sum();
            let mean = free.map(|g| g.position.x).sum::<f64>() / count;
            match started {
                None if energy > RUNS * count => {
                    started = Some((tilt - self.rise(&snapshot), mean));
                }
                None if tilt > 80.0 => started = Some((f64::NAN, mean)),
                None => {}
                Some((start, from)) => {
                    still = if energy < AT_REST * count {
                        still + 1
                    } else {
                        0
                    };
                    if still >= 6 || simulation.time() > 600.0 {
                        return Ok(Avalanche {
                            start,
                            rest: tilt - self.rise(&snapshot),
                            run: mean - from,
                            time: simulation.time(),
                            grain_steps: simulation.steps_done() * simulation.grain_count() as u64,
                        });
                    }
                }
            }
        }
    }

    /// By how much the surface rises along x against the base (degrees).
    fn rise(&self, snapshot: &Snapshot) -> f64 {
        let (columns, lanes) = (self.length as usize, self.width as usize);
        // Tops of grains over cells about one grain wide: the free surface without its holes.
        let mut tops = vec![0.0_f64; columns * lanes];
        for g in snapshot.grains.iter().filter(|g| !g.fixed) {
            let i = (g.position.x / self.length * columns as f64).floor();
            let j = (g.position.y / self.width * lanes as f64) as usize % lanes;
            if i >= 0.0 && (i as usize) < columns {
                let top = &mut tops[i as usize * lanes + j];
                *top = top.max(g.position.z + g.radius);
            }
        }
        let profile: Vec<(f64, f64)> = tops
            .chunks(lanes)
            .enumerate()
            .map(|(i, tops)| (i as f64 + 0.5, tops.iter().sum::<f64>() / lanes as f64))
            .collect();
        let scale = self.length / columns as f64;
        let middle = &profile[columns / 4..columns - columns / 4];
        (Line::through(middle).slope / scale).atan().to_degrees()
    }
}
