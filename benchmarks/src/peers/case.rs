//! One description of each comparison: every code's deck and start state are written from it.

use super::law::{Cohesion, Law, Rolling};
use colluvium_dem::Grain;
use colluvium_tests::{chute_start, settle_start, settled_start};
use serde::Serialize;

/// A resting plane across one axis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Wall {
    /// 0, 1, 2 for x, y, z.
    pub axis: usize,
    /// Where it stands (m).
    pub position: f64,
    /// Grains are above it, along the axis (or below).
    pub grains_above: bool,
}

/// Kinetic energy (translation) and height of the centre of mass of the free grains after a step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct State {
    /// Steps since the start.
    pub step: u64,
    /// Σ m v²/2 (J).
    pub kinetic: f64,
    /// Centre of mass, z (m).
    pub height: f64,
}

/// What errors are measured against.
#[derive(Clone, Debug)]
pub enum Reference {
    /// States computed once and kept here.
    Known {
        /// Where they come from.
        source: &'static str,
        /// The states.
        states: &'static [State],
    },
    /// Our own run with so many steps for each step.
    FinerStep(u64),
    /// LAMMPS in the same go: for runs whose end no finer step could confirm.
    Lammps,
}

/// A comparison: start, box, law, step, and what is read off.
#[derive(Clone, Debug, Serialize)]
pub struct Case {
    /// Name on the command line.
    pub name: &'static str,
    /// What it is.
    pub title: &'static str,
    /// Lower corner of the box (m).
    pub lower: [f64; 3],
    /// Upper corner of the box (m).
    pub upper: [f64; 3],
    /// Periodic axes.
    pub periodic: [bool; 3],
    /// Acceleration of gravity (m/s²).
    pub gravity: [f64; 3],
    /// Step (s).
    pub timestep: f64,
    /// Distance beyond touching within which the other codes list pairs (m).
    pub skin: f64,
    /// Contact law.
    pub law: Law,
    /// Resistance to rolling and twisting.
    pub rolling: Rolling,
    /// Attraction of touching grains.
    pub cohesion: Cohesion,
    /// Our own side takes the grains for two materials in turns, of the same law each.
    pub two_materials: bool,
    /// Walls.
    pub walls: Vec<Wall>,
    /// Steps before the clock starts.
    pub warm_up: u64,
    /// Steps on the clock.
    pub steps: u64,
    /// Steps between states; divides the two above.
    pub every: u64,
    /// Steps whose states are compared.
    pub compared: Vec<u64>,
    /// The grains; their order is their number.
    #[serde(skip)]
    pub grains: Vec<Grain>,
    /// What errors are measured against.
    #[serde(skip)]
    pub reference: Reference,
}

/// Names of all cases.
pub const CASES: [&str; 11] = [
    "chute",
    "settled",
    "settle",
    "settled-hooke",
    "settled-viscoelastic",
    "settled-epsd",
    "settled-shape",
    "settled-cohesion",
    "settled-dmt",
    "settled-mixed",
    "settled-jkr",
];

/// A case by its name.
pub fn case(name: &str) -> Option<Case> {
    match name {
        "chute" => Some(chute()),
        "settled" => Some(settled()),
        "settle" => Some(settle()),
        _ => settled_under(name),
    }
}

/// LAMMPS 22 Jul 2025, `gran/hooke/history`, double precision, from the start state shipped here.
const CHUTE_REFERENCE: [State; 3] = [
    State {
        step: 200,
        kinetic: 4_866.273_164_57,
        height: 16.981_430_756_5,
    },
    State {
        step: 600,
        kinetic: 3_721.552_569_85,
        height: 16.978_394_030_5,
    },
    State {
        step: 1000,
        kinetic: 3_071.946_623_22,
        height: 16.977_063_927_3,
    },
];

fn chute() -> Case {
    let slope = 26_f64.to_radians();
    Case {
        name: "chute",
        title: "32 000 equal spheres (1 024 frozen) creeping down a slope of 26°, linear springs",
        lower: [0.0, 0.0, -0.5],
        upper: [40.0, 20.0, 60.0],
        periodic: [true, true, false],
        gravity: [slope.sin(), 0.0, -slope.cos()],
        timestep: 1e-4,
        skin: 0.1,
        law: Law::Hooke {
            stiffness: 2e5,
            tangential: 2e5 * 2.0 / 7.0,
            damping: 50.0,
            friction: 0.5,
        },
        rolling: Rolling::Free,
        cohesion: Cohesion::None,
        two_materials: false,
        walls: Vec::new(),
        warm_up: 200,
        steps: 800,
        every: 200,
        compared: vec![200, 600, 1000],
        grains: chute_start(),
        reference: Reference::Known {
            source: "LAMMPS 22 Jul 2025, gran/hooke/history, one core, double precision",
            states: &CHUTE_REFERENCE,
        },
    }
}

/// Young's modulus (Pa) and Poisson's ratio of the settled bed.
const YOUNG: f64 = 1e7;
const POISSON: f64 = 0.3;

fn settled() -> Case {
    let wall = |axis, position, grains_above| Wall {
        axis,
        position,
        grains_above,
    };
    Case {
        name: "settled",
        title: "10 000 spheres of 2.5 mm ± 20 % at rest in a box, Hertz–Mindlin",
        lower: [0.0, 0.0, -0.01],
        upper: [0.1, 0.1, 0.42],
        periodic: [false; 3],
        gravity: [0.0, 0.0, -9.81],
        timestep: 2e-5,
        skin: 1e-3,
        law: Law::HertzMindlin {
            young: YOUNG,
            poisson: POISSON,
            restitution: 0.5,
            friction: 0.5,
        },
        rolling: Rolling::Free,
        cohesion: Cohesion::None,
        two_materials: false,
        walls: vec![
            wall(0, 0.0, true),
            wall(0, 0.1, false),
            wall(1, 0.0, true),
            wall(1, 0.1, false),
            wall(2, 0.0, true),
        ],
        warm_up: 250,
        steps: 1750,
        every: 250,
        compared: vec![250, 1000, 2000],
        grains: settled_start(),
        reference: Reference::FinerStep(10),
    }
}

/// The settled bed under another law. It is laid under the law of `settled` and goes on under this one:
/// what is compared is the cost of a law on one packing; the first steps are those of a bed that finds its
/// balance anew.
fn settled_under(name: &str) -> Option<Case> {
    let bed = settled();
    let epsd = Rolling::Epsd {
        friction: 0.2,
        damping_ratio: 0.3,
    };
    // Some five times the weight of a grain, with all of them.
    let area = Cohesion::ContactArea { density: 4e4 };
    let adhesion = 1.0;
    Some(match name {
        "settled-hooke" => Case {
            name: "settled-hooke",
            title: "10 000 spheres of 2.5 mm ± 20 % at rest in a box, linear springs",
            law: Law::Hooke {
                stiffness: 1500.0,
                tangential: 1500.0 * 2.0 / 7.0,
                damping: 500.0,
                friction: 0.5,
            },
            ..bed
        },
        "settled-viscoelastic" => Case {
            name: "settled-viscoelastic",
            title: "10 000 spheres of 2.5 mm ± 20 % at rest in a box, viscous elastic spheres",
            law: Law::Viscoelastic {
                young: YOUNG,
                poisson: POISSON,
                dissipation: 1e-4,
                friction: 0.5,
            },
            ..bed
        },
        "settled-epsd" => Case {
            name: "settled-epsd",
            title: "10 000 spheres of 2.5 mm ± 20 % at rest in a box, Hertz–Mindlin, EPSD rolling",
            rolling: epsd,
            ..bed
        },
        "settled-shape" => Case {
            name: "settled-shape",
            title: "10 000 spheres of 2.5 mm ± 20 % at rest in a box, Hertz–Mindlin, rolling and twisting springs",
            rolling: Rolling::Shape {
                beta: 0.2,
                rolling_friction: 1.05,
                twisting_friction: 1.3,
            },
            ..bed
        },
        "settled-cohesion" => Case {
            name: "settled-cohesion",
            title: "10 000 spheres of 2.5 mm ± 20 % at rest in a box, Hertz–Mindlin, EPSD rolling, cohesion on the contact area",
            rolling: epsd,
            cohesion: area,
            ..bed
        },
        "settled-dmt" => Case {
            name: "settled-dmt",
            title: "10 000 spheres of 2.5 mm ± 20 % at rest in a box, Hertz–Mindlin, EPSD rolling, DMT cohesion",
            rolling: epsd,
            cohesion: Cohesion::Dmt {
                work_of_adhesion: adhesion,
            },
            ..bed
        },
        "settled-mixed" => Case {
            name: "settled-mixed",
            title: "10 000 spheres of 2.5 mm ± 20 % at rest in a box, Hertz–Mindlin, EPSD rolling, cohesion on the contact area, two materials in our own run",
            rolling: epsd,
            cohesion: area,
            two_materials: true,
            ..bed
        },
        "settled-jkr" => Case {
            name: "settled-jkr",
            title: "10 000 spheres of 2.5 mm ± 20 % at rest in a box, JKR with sliding, rolling and twisting",
            law: Law::Jkr {
                young: YOUNG,
                poisson: POISSON,
                surface_energy: 0.5 * adhesion,
                damping_rate: 500.0,
                critical_rolling: 2.5e-5,
            },
            ..bed
        },
        _ => return None,
    })
}

fn settle() -> Case {
    Case {
        name: "settle",
        title: "10 000 spheres of 2.5 mm ± 20 % poured into a box, Hertz–Mindlin, the whole run",
        warm_up: 500,
        steps: 24_500,
        every: 500,
        compared: vec![5_000, 15_000, 25_000],
        grains: settle_start(),
        reference: Reference::Lammps,
        ..settled()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_case_says_what_it_compares() {
        for name in CASES {
            let case = case(name).unwrap();
            assert_eq!(case.name, name);
            assert_eq!((case.warm_up % case.every, case.steps % case.every), (0, 0));
            let end = case.warm_up + case.steps;
            assert!(
                case.compared
                    .iter()
                    .all(|s| s % case.every == 0 && *s <= end)
            );
        }
        assert!(case("nothing").is_none());
    }
}
