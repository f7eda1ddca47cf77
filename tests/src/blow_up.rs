//! Where steps blow up: every law on one contact and in a dense packing, against the estimates.

use colluvium_dem::contact::hertz::secant_stiffness;
use colluvium_dem::contact::tangential::SpringStiffness;
use colluvium_dem::timestep::{Conditions, Shares, contact_limit};
use colluvium_dem::{
    ContactLaw, Damping, Domain, Elasticity, Epsd, Grain, Hertz, Hooke, Jkr, Mindlin, Normal,
    Rolling, Setup, SetupError, ShapeParameter, Simulation, Snapshot, Tangential, TangentialSpring,
    Threads, Viscoelastic, Wall,
};
use nalgebra::Vector3;

/// A law with the grain it is tried on.
#[derive(Clone, Debug)]
pub struct Trial {
    /// What it is.
    pub name: String,
    /// The law.
    pub law: ContactLaw,
    /// Mean radius (m).
    pub radius: f64,
    /// Density (kg/m³).
    pub density: f64,
}

/// Overlap of elastic contacts on a wall, over the radius.
const PRESSED: f64 = 0.01;
const STIFFNESS: f64 = 1e5;
const SOFT: Elasticity = Elasticity {
    youngs_modulus: 1e7,
    poissons_ratio: 0.3,
};

/// Ice monomers (Tatsuuma et al. 2019): 0.1 µm, 100 mJ/m², 7 GPa, 0.25, ξ_crit 8 Å.
pub const ICE: Jkr = Jkr {
    surface_energy: 0.1,
    elasticity: Elasticity {
        youngs_modulus: 7e9,
        poissons_ratio: 0.25,
    },
    damping_rate: 0.0,
    critical_rolling: 8e-10,
};

fn shape() -> Rolling {
    Rolling::Shape(ShapeParameter {
        beta: 1.0,
        rolling_friction: 1.05,
        twisting_friction: 1.3,
    })
}

fn epsd(damping_ratio: f64) -> Rolling {
    Rolling::Epsd(Epsd {
        rolling_friction: 0.4,
        damping_ratio,
    })
}

/// All compositions, elastic or with the usual dashpots, and some whose dashpots outweigh their springs.
pub fn trials(dashpots: bool) -> Vec<Trial> {
    let e = if dashpots { 0.5 } else { 1.0 };
    let ratio = if dashpots { 0.3 } else { 0.0 };
    let linear = Tangential::Linear(TangentialSpring::matched(2.0 / 7.0, e, 1.0));
    let absolute = Tangential::Linear(TangentialSpring {
        stiffness: SpringStiffness::Absolute(2e5),
        damping: Damping::Restitution(e),
        friction: 1.0,
    });
    let mindlin = Tangential::Mindlin(Mindlin::of(SOFT, e, 1.0));
    let hooke = Normal::Hooke(Hooke::matched(STIFFNESS, e));
    let hertz = Normal::Hertz(Hertz::of(SOFT, e));
    let viscoelastic =
        Normal::Viscoelastic(Viscoelastic::of(SOFT, if dashpots { 2e-3 } else { 0.0 }));
    let jkr = Normal::Jkr(Jkr {
        damping_rate: if dashpots { 0.02 / 1.94e-10 } else { 0.0 },
        ..ICE
    });
    let mut list = vec![
        ("Hooke", hooke, Tangential::None, Rolling::None),
        ("Hooke, linear", hooke, linear, Rolling::None),
        ("Hooke, linear, EPSD", hooke, linear, epsd(ratio)),
        ("Hooke, linear, shape", hooke, linear, shape()),
        ("Hertz", hertz, Tangential::None, Rolling::None),
        ("Hertz, linear", hertz, absolute, Rolling::None),
        ("Hertz, linear, EPSD", hertz, absolute, epsd(ratio)),
        ("Hertz, Mindlin", hertz, mindlin, Rolling::None),
        ("Hertz, Mindlin, EPSD", hertz, mindlin, epsd(ratio)),
        ("Hertz, Mindlin, shape", hertz, mindlin, shape()),
        (
            "viscoelastic",
            viscoelastic,
            Tangential::None,
            Rolling::None,
        ),
        (
            "viscoelastic, linear",
            viscoelastic,
            absolute,
            Rolling::None,
        ),
        (
            "viscoelastic, linear, EPSD",
            viscoelastic,
            absolute,
            epsd(ratio),
        ),
        (
            "viscoelastic, Mindlin",
            viscoelastic,
            mindlin,
            Rolling::None,
        ),
        (
            "viscoelastic, Mindlin, EPSD",
            viscoelastic,
            mindlin,
            epsd(ratio),
        ),
        ("JKR", jkr, Tangential::None, Rolling::None),
        ("JKR, sliding", jkr, Tangential::Jkr, Rolling::None),
        ("JKR, sliding, rolling", jkr, Tangential::Jkr, Rolling::Jkr),
    ];
    if dashpots {
        let rate = Damping::MassProportional(5e3);
        let hooke = Normal::Hooke(Hooke {
            stiffness: STIFFNESS,
            damping: rate,
        });
        let linear = Tangential::Linear(TangentialSpring {
            damping: rate,
            ..TangentialSpring::matched(2.0 / 7.0, 1.0, 1.0)
        });
        let dull = Tangential::Mindlin(Mindlin::of(SOFT, 1e-4, 1.0));
        let viscous = Normal::Viscoelastic(Viscoelastic::of(SOFT, 2e-2));
        list.extend([
            ("Hooke, linear, γ = 5000/s", hooke, linear, Rolling::None),
            (
                "Hertz, Mindlin, e = 10⁻⁴",
                Normal::Hertz(Hertz::of(SOFT, 1e-4)),
                dull,
                Rolling::None,
            ),
            (
                "viscoelastic, Mindlin, A = 20 ms",
                viscous,
                mindlin,
                Rolling::None,
            ),
        ]);
    }
    list.into_iter()
        .map(|(name, normal, tangential, rolling)| {
            let adhesive = matches!(normal, Normal::Jkr(_));
            Trial {
                name: name.into(),
                law: ContactLaw {
                    normal,
                    tangential,
                    rolling,
                    ..ContactLaw::linear(
                        Hooke::matched(1.0, 1.0),
                        TangentialSpring::matched(0.0, 1.0, 0.0),
                        None,
                    )
                },
                radius: if adhesive { 1e-7 } else { 0.5 },
                density: if adhesive { 1000.0 } else { crate::DENSITY },
            }
        })
        .collect()
}

impl Trial {
    fn grain(&self) -> Grain {
        Grain::at_rest(Vector3::zeros(), self.radius, self.density)
    }

    /// Overlap on a wall (m) and the load that holds it (N).
    fn pressed(&self) -> (f64, f64) {
        let (r, x) = (self.radius, PRESSED * self.radius);
        match &self.law.normal {
            Normal::Hooke(hooke) => (x, hooke.stiffness * x),
            Normal::Hertz(hertz) => (x, secant_stiffness(hertz.effective_modulus, r, x) * x),
            Normal::Viscoelastic(v) => (x, secant_stiffness(v.effective_modulus, r, x) * x),
            Normal::Jkr(jkr) => (jkr.equilibrium_overlap(r), 0.0),
        }
    }

    /// Estimated limit of the grain pressed on a wall (s), and what sets it.
    pub fn wall_estimate(&self) -> (f64, &'static str) {
        contact_limit(&self.law, &self.grain(), None, self.pressed().0)
    }

    /// Whether small motions of a grain pressed on a wall grow without end at this step.
    ///
    /// # Errors
    /// If the setup is refused.
    pub fn wall_blows_up(&self, step: f64) -> Result<bool, SetupError> {
        let (overlap, load) = self.pressed();
        let mut grain = self.grain();
        grain.position.z = self.radius - overlap;
        // Springs and dashpots stay a ten-thousandth of the load: far below friction.
        let softest = self.law.stiffness(self.radius, overlap).normal / grain.mass();
        let speed = 1e-4 * overlap * softest * self.wall_estimate().0;
        grain.velocity = speed * Vector3::new(1.0, 0.7, -0.8);
        grain.spin = speed / self.radius * Vector3::new(-0.6, 0.9, 1.1);
        let reach = 20.0 * self.radius;
        let mut simulation = Simulation::new(Setup {
            domain: Domain {
                lower: Vector3::repeat(-reach),
                upper: Vector3::repeat(reach),
                periodic: [false; 3],
            },
            gravity: Vector3::new(0.0, 0.0, -load / grain.mass()),
            law: self.law.into(),
            grains: vec![grain],
            walls: vec![Wall::plane(Vector3::zeros(), Vector3::z())],
            bodies: Vec::new(),
            timestep: step,
            threads: Threads::Serial,
        })?;
        // Looked at after every step: where sliders stop the growth, velocities change sign each step,
        // and their mean at the time of the positions tells nothing.
        Ok(grows(&mut simulation, 1e4, 2000, 1))
    }

    /// Estimated limit of two smallest grains of a packing (s) under its largest overlap.
    pub fn pair_estimate(&self, packing: &Packing) -> f64 {
        let grain = Grain {
            radius: self.radius * SMALLEST,
            ..self.grain()
        };
        contact_limit(
            &self.law,
            &grain,
            Some(&grain),
            packing.overlap * grain.radius,
        )
        .0
    }

    /// The step that the limits choose for a packing (s), and the limit that binds.
    ///
    /// # Errors
    /// If the setup is refused.
    pub fn chosen(&self, packing: &Packing) -> Result<(f64, &'static str), SetupError> {
        let conditions = Conditions {
            overlap: packing.overlap,
            ..Conditions::default()
        };
        let setup = self.setup(packing, 1.0);
        let choice = setup.choose_step(&conditions, &Shares::default())?;
        Ok((choice.seconds, choice.binding))
    }

    fn setup(&self, packing: &Packing, timestep: f64) -> Setup {
        Setup {
            domain: packing.domain,
            gravity: Vector3::zeros(),
            law: self.law.into(),
            grains: packing.grains.clone(),
            walls: Vec::new(),
            bodies: Vec::new(),
            timestep,
            threads: Threads::Serial,
        }
    }

    /// The trial's normal spring alone, with a usual dashpot.
    fn frictionless(&self) -> Trial {
        Trial {
            law: ContactLaw {
                tangential: Tangential::None,
                rolling: Rolling::None,
                normal: match self.law.normal {
                    Normal::Hooke(hooke) => Normal::Hooke(Hooke::matched(hooke.stiffness, 0.5)),
                    Normal::Hertz(hertz) => Normal::Hertz(Hertz {
                        restitution: 0.5,
                        ..hertz
                    }),
                    // The same spring; viscous grains would creep to rest.
                    Normal::Viscoelastic(v) => Normal::Hertz(Hertz {
                        effective_modulus: v.effective_modulus,
                        restitution: 0.5,
                    }),
                    Normal::Jkr(jkr) => Normal::Jkr(Jkr {
                        damping_rate: 0.0,
                        ..jkr
                    }),
                },
                ..self.law
            },
            ..self.clone()
        }
    }

    /// Grains pressed together in a periodic box, at rest under this law.
    fn packing(&self) -> Result<Packing, SetupError> {
        let mut random = 5_u64;
        let mut uniform = || {
            random = random
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (random >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        let r = self.radius;
        // Cubic cells at a solid fraction of 0.66, pulled about by a quarter of a cell.
        let cell = r * (4.0 / 3.0 * std::f64::consts::PI / 0.66_f64).cbrt();
        let side = 6;
        let mut grains = Vec::new();
        for k in 0..side * side * side {
            let at = [k % side, k / side % side, k / (side * side)];
            let at = Vector3::from(at.map(|i| (f64::from(i) + 0.5 + 0.25 * uniform()) * cell));
            let radius = r * (1.0 + 2.0 * (1.0 - SMALLEST) * uniform());
            grains.push(Grain::at_rest(at, radius, self.density));
        }
        let length = f64::from(side) * cell;
        let mut packing = Packing {
            domain: Domain {
                lower: Vector3::zeros(),
                upper: Vector3::repeat(length),
                periodic: [true; 3],
            },
            grains,
            overlap: 0.15,
        };
        let step = 0.2 * self.pair_estimate(&packing);
        let mut simulation = Simulation::new(self.setup(&packing, step))?;
        let mut snapshot = Snapshot::default();
        // Motion is taken out more and more often: first the grains rearrange, then they come to rest.
        for round in 0..400 {
            simulation.advance(if round < 40 { 100 } else { 25 })?;
            simulation.give_velocity(|_| Vector3::zeros());
        }
        simulation.snapshot(&mut snapshot);
        let density = self.density;
        packing.grains = snapshot
            .grains
            .iter()
            .map(|g| Grain::at_rest(g.position, g.radius, density))
            .collect();
        packing.overlap = snapshot
            .contacts
            .iter()
            .map(|c| c.overlap / r)
            .fold(0.0, f64::max);
        Ok(packing)
    }

    /// Whether small motions of a packing grow without end at this step.
    ///
    /// # Errors
    /// If the setup is refused.
    pub fn packing_blows_up(&self, packing: &Packing, step: f64) -> Result<bool, SetupError> {
        let mut setup = self.setup(packing, step);
        let speed = 0.02 * packing.overlap * self.radius / self.pair_estimate(packing);
        for (k, grain) in setup.grains.iter_mut().enumerate() {
            let phase = k as f64;
            grain.velocity =
                speed * Vector3::new(phase.sin(), (1.7 * phase).cos(), (2.3 * phase).sin());
            grain.spin = speed / self.radius
                * Vector3::new(
                    (3.1 * phase).cos(),
                    (0.7 * phase).sin(),
                    (1.3 * phase).cos(),
                );
        }
        Ok(grows(&mut Simulation::new(setup)?, 50.0, 40, 50))
    }
}

/// A packing and how deep its grains overlap.
#[derive(Clone, Debug)]
pub struct Packing {
    domain: Domain,
    grains: Vec<Grain>,
    /// Largest overlap over the mean radius.
    pub overlap: f64,
}

/// Packings by the normal spring that holds them.
#[derive(Clone, Debug, Default)]
pub struct Packings(Vec<(ContactLaw, Packing)>);

impl Packings {
    /// Grains pressed together in a periodic box, at rest under the trial's normal spring.
    ///
    /// # Errors
    /// If the setup is refused or the packing bursts.
    pub fn of(&mut self, trial: &Trial) -> Result<Packing, SetupError> {
        let still = trial.frictionless();
        if let Some((_, packing)) = self.0.iter().find(|(law, _)| *law == still.law) {
            return Ok(packing.clone());
        }
        let packing = still.packing()?;
        self.0.push((still.law, packing.clone()));
        Ok(packing)
    }
}

/// Smallest radius of a packing over the mean.
const SMALLEST: f64 = 0.9;

/// Whether the kinetic energy ever exceeds `factor` times that of the start, in looks a few steps apart.
fn grows(simulation: &mut Simulation, factor: f64, looks: u32, steps: u64) -> bool {
    let start = simulation.energy().kinetic();
    (0..looks).any(|_| {
        simulation.advance(steps).is_err() || {
            let now = simulation.energy().kinetic();
            now.is_nan() || now > factor * start
        }
    })
}

/// The step between `low`, which must not blow up, and `high`, which must, at which things begin to
/// (s); `None` if the bounds are not such.
///
/// # Errors
/// Those of the trial.
pub fn bisect(
    mut low: f64,
    mut high: f64,
    mut blows_up: impl FnMut(f64) -> Result<bool, SetupError>,
) -> Result<Option<f64>, SetupError> {
    if blows_up(low)? || !blows_up(high)? {
        return Ok(None);
    }
    while high > 1.005 * low {
        let middle = (low * high).sqrt();
        if blows_up(middle)? {
            high = middle;
        } else {
            low = middle;
        }
    }
    Ok(Some((low * high).sqrt()))
}
