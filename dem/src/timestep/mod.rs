//! Stiffness and time step from what a scene expects, and everything that limits the step.
//!
//! ```text
//! k_n = m (v_max / x_max)²                     m mass, v_max largest expected speed, x_max largest overlap
//! dt  = π √( m/(2 k_n) ) / N                   N steps a contact of two equal grains without damping
//! ```
//! Source: Thuillet 2019, Eq. 2.6 (its square is lost in the print) and 2.7, N = 30; x_max about 1 % of
//! the smallest radius (Schwartz et al. 2012).
//!
//! | limit | time | share taken |
//! |---|---|---|
//! | contact time (Hooke) | π √(m/k_n), m reduced mass | 1/N |
//! | Hertz time (elastic laws) | `2.87 (m²/(R E*² v))^{1/5}` | 0.1 |
//! | Rayleigh time (elastic laws) | `π R √(ρ/G)/(0.1631 ν + 0.8766)` | 0.1 |
//! | JKR time | `0.95 r^{7/6} ρ^{1/2}/(γ^{1/6} E*^{1/3})` | 0.1 |
//! | springs and dashpots | where one contact blows up, `stability` | 0.3 |
//! | bond | where one bond blows up, [`crate::Cement::limit`] | 0.3 |
//! | travel | R/v of the smallest grain | 0.1 |
//!
//! Sources: Kappel et al. 2020 (just under 10 % of Rayleigh's and Hertz' times, checked at 3 %);
//! Tatsuuma et al. 2019 (0.1 t_c). The share of stability leaves room for grains with several contacts:
//! dense packings of 216 grains blow up at 0.52 to 1.2 of what their stiffest contact allows, under all
//! laws with and without dashpots (`step-limits` in the benchmarks).

mod bodies;
mod expected;
mod limit;
mod stability;

use crate::contact::{ContactLaw, Elasticity, LawTable, Mindlin, Normal, Tangential, hertz};
use crate::grains::Grain;
use bodies::surfaces;
pub(crate) use bodies::{Body, Classes};
pub use expected::{Conditions, Shares};
pub use limit::{Choice, Guards, Limit, Pair, Remedy, hard};
use stability::oscillations;
use std::f64::consts::PI;

/// k_n (N/m) that keeps the overlap below `largest_overlap` (m) at `speed` (m/s) for mass (kg).
pub fn stiffness(mass: f64, speed: f64, largest_overlap: f64) -> f64 {
    mass * (speed / largest_overlap).powi(2)
}

/// Step (s) that resolves a contact of two grains of `mass` (kg) by `steps_per_contact` steps.
pub fn step(mass: f64, stiffness: f64, steps_per_contact: f64) -> f64 {
    PI * (mass / (2.0 * stiffness)).sqrt() / steps_per_contact
}

/// Shortest times of each kind so far.
struct Shortest(Vec<Limit>);

impl Shortest {
    fn take(&mut self, limit: Limit) {
        // Not finite: nothing oscillates, or at no speed.
        if !limit.seconds.is_finite() {
            return;
        }
        match self.0.iter_mut().find(|l| l.name == limit.name) {
            Some(known) if known.seconds <= limit.seconds => {}
            Some(known) => *known = limit,
            None => self.0.push(limit),
        }
    }

    /// What two bodies in contact allow.
    fn take_pair(
        &mut self,
        law: &ContactLaw,
        [a, b]: [&Body; 2],
        conditions: &Conditions,
        shares: &Shares,
    ) {
        let pair = Pair {
            materials: [a.material, b.material],
            radii: [a.radius, b.radius],
        };
        let surfaces = surfaces(a, b);
        let overlap = expected::overlap(law, a, b, &surfaces.inertia, conditions);
        for oscillation in oscillations(law, &surfaces, overlap) {
            self.take(Limit {
                name: oscillation.name,
                seconds: oscillation.seconds,
                share: shares.stability,
                guards: Guards::Stability,
                why: "at which one contact's energy grows without end",
                pair,
            });
        }
        let mut resolve = |name, seconds, share, why| {
            self.take(Limit::accuracy(pair, name, seconds, share, why));
        };
        let mass = surfaces.inertia.reduced_mass;
        let counted = match &law.normal {
            Normal::Hooke(hooke) => Some(PI * (mass / hooke.stiffness).sqrt()),
            _ => None,
        };
        if let Some(time) = shares.contact_time.or(counted) {
            resolve(
                "contact time",
                time,
                1.0 / shares.steps_per_contact,
                "undamped contact time (Thuillet 2019, Eq. 2.7)",
            );
        }
        resolve(
            "Hertz time",
            hertz_time(law, mass, surfaces.inertia.reduced_radius, conditions.speed),
            shares.hertz,
            "duration of an elastic impact at the largest speed",
        );
    }

    /// What one grain allows among its like.
    fn take_grain(
        &mut self,
        law: &ContactLaw,
        grain: &Body,
        conditions: &Conditions,
        shares: &Shares,
    ) {
        let alike = Pair {
            materials: [grain.material; 2],
            radii: [grain.radius; 2],
        };
        let mut resolve = |name, seconds, share, why| {
            self.take(Limit::accuracy(alike, name, seconds, share, why));
        };
        resolve(
            "Rayleigh time",
            rayleigh_time(law, grain.radius, grain.density()),
            shares.rayleigh,
            "in which a surface wave crosses the grain",
        );
        if let Normal::Jkr(jkr) = &law.normal {
            resolve(
                "JKR time",
                jkr.characteristic_time(grain.radius, grain.density()),
                shares.jkr,
                "in which an adhesive contact oscillates (Tatsuuma et al. 2019)",
            );
        }
        resolve(
            "travel",
            grain.radius / conditions.speed,
            shares.travel,
            "in which the largest speed crosses the radius",
        );
    }
}

/// All limits of the step for these grains and walls (by their materials), each for the pair for
/// which it is shortest, in no order; a kind that the laws do not have is not listed.
pub fn limits(
    grains: &[Grain],
    walls: &[u16],
    laws: &LawTable,
    conditions: &Conditions,
    shares: &Shares,
) -> Vec<Limit> {
    let classes = Classes::of(grains.iter().map(Body::from), walls);
    limits_of(&classes, laws, conditions, shares)
}

pub(crate) fn limits_of(
    classes: &Classes,
    laws: &LawTable,
    conditions: &Conditions,
    shares: &Shares,
) -> Vec<Limit> {
    let mut shortest = Shortest(Vec::new());
    for (a, b) in classes.pairs() {
        let law = laws.between(usize::from(a.material), usize::from(b.material));
        shortest.take_pair(law, [a, b], conditions, shares);
    }
    for body in classes.bodies.iter().filter(|b| !b.fixed) {
        let own = usize::from(body.material);
        shortest.take_grain(laws.between(own, own), body, conditions, shares);
    }
    shortest.0
}

/// The step (s) beyond which a grain on a partner, or on a wall without one, blows up under `overlap`
/// (m), and the part that does it.
pub fn contact_limit(
    law: &ContactLaw,
    grain: &Grain,
    partner: Option<&Grain>,
    overlap: f64,
) -> (f64, &'static str) {
    let partner = partner.map_or(Body::wall(0), Body::from);
    let surfaces = surfaces(&Body::from(grain), &partner);
    let [first, rest @ ..] = oscillations(law, &surfaces, overlap);
    let fastest = rest
        .into_iter()
        .fold(first, |a, b| if b.seconds < a.seconds { b } else { a });
    (fastest.seconds, fastest.name)
}

/// The longest step within its share of every limit.
pub fn choose(mut limits: Vec<Limit>, safety: f64) -> Choice {
    limits.sort_by(|a, b| a.step().total_cmp(&b.step()));
    let (seconds, binding) = limits
        .first()
        .map_or((f64::INFINITY, "none"), |l| (l.step(), l.name));
    Choice {
        seconds: safety * seconds,
        safety,
        binding,
        all: limits,
    }
}

/// `2.87 (m²/(R E*² v))^{1/5}`, infinite at rest.
fn hertz_time(law: &ContactLaw, mass: f64, radius: f64, speed: f64) -> f64 {
    law.normal
        .elastic_modulus()
        .map_or(f64::INFINITY, |modulus| {
            hertz::impact_time(modulus, mass, radius, speed)
        })
}

/// `π R √(ρ/G)/(0.1631 ν + 0.8766)` (s) of a law's like pair; infinite for linear springs, which carry
/// no surface wave.
///
/// A law keeps `E* = E/(2(1 - ν²))` and, with Mindlin, `G* = E/(4(2 - ν)(1 + ν))`, so that
/// `E*/G* = 2(2 - ν)/(1 - ν)` gives ν back. Without Mindlin ν = 0 stands in: the shortest of all ν ≥ 0.
fn rayleigh_time(law: &ContactLaw, radius: f64, density: f64) -> f64 {
    if let Normal::Jkr(jkr) = &law.normal {
        return rayleigh(&jkr.elasticity, radius, density);
    }
    let Some(modulus) = law.normal.elastic_modulus() else {
        return f64::INFINITY;
    };
    let poisson = match &law.tangential {
        Tangential::Mindlin(Mindlin {
            effective_shear, ..
        }) => {
            let ratio = modulus / effective_shear;
            ((ratio - 4.0) / (ratio - 2.0)).clamp(0.0, 0.5)
        }
        _ => 0.0,
    };
    let material = Elasticity {
        youngs_modulus: 2.0 * (1.0 - poisson * poisson) * modulus,
        poissons_ratio: poisson,
    };
    rayleigh(&material, radius, density)
}

/// `π R √(ρ/G)/(0.1631 ν + 0.8766)` (s).
fn rayleigh(material: &Elasticity, radius: f64, density: f64) -> f64 {
    PI * radius * (density / material.shear_modulus()).sqrt()
        / (0.1631 * material.poissons_ratio + 0.8766)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::{Damping, Hooke, TangentialSpring};
    use nalgebra::Vector3;

    #[test]
    fn a_head_on_impact_reaches_the_overlap_asked_for() {
        // Two masses m at ±v: reduced mass m/2, relative speed 2v, x = 2v √(m/2k).
        let (m, v, x) = (0.3, 2.0, 1e-3);
        let k = stiffness(m, v, x);
        assert!((2.0 * v * (m / (2.0 * k)).sqrt() / x - 2.0_f64.sqrt()).abs() < 1e-12);
        // One such grain against a wall: exactly x.
        assert!((v * (m / k).sqrt() / x - 1.0).abs() < 1e-12);
        let tau = PI * (m / 2.0 / k).sqrt();
        assert!((step(m, k, 30.0) * 30.0 / tau - 1.0).abs() < 1e-12);
    }

    fn table(law: ContactLaw) -> LawTable {
        LawTable::new(&law.into()).unwrap()
    }

    fn grain(radius: f64, mass: f64) -> Grain {
        let density = mass / (4.0 / 3.0 * PI * radius.powi(3));
        Grain::at_rest(Vector3::zeros(), radius, density)
    }

    #[test]
    fn the_limit_is_two_over_the_fastest_frequency() {
        let law = table(ContactLaw::linear(
            Hooke::matched(400.0, 1.0),
            TangentialSpring::matched(2.0 / 7.0, 1.0, 0.5),
            None,
        ));
        let limits = |grains: &[Grain], walls: &[u16]| {
            let limits = limits(
                grains,
                walls,
                &law,
                &Conditions::default(),
                &Shares::default(),
            );
            hard(&limits).map(|l| l.seconds)
        };
        // Two grains: ω² = k/(m/2). One on a wall or on a fixed grain: ω² = k/m.
        let pair = limits(&[grain(0.5, 1.0)], &[]).unwrap();
        assert!((pair - 0.1 / 2.0_f64.sqrt()).abs() < 1e-15);
        let fixed = Grain {
            fixed: true,
            ..grain(0.5, 1.0)
        };
        assert_eq!(limits(&[fixed], &[0]), None, "nothing moves");
    }

    #[test]
    fn shortest_times_are_those_of_the_smallest_grain_and_its_formulas() {
        let material = Elasticity {
            youngs_modulus: 1e8,
            poissons_ratio: 0.3,
        };
        let law = table(ContactLaw::hertz_mindlin(material, 0.5, 0.5));
        let grains = [
            Grain::at_rest(Vector3::zeros(), 0.01, 2500.0),
            Grain::at_rest(Vector3::zeros(), 0.002, 2500.0),
        ];
        let conditions = Conditions {
            speed: 3.0,
            ..Conditions::default()
        };
        let all = limits(&grains, &[], &law, &conditions, &Shares::default());
        let of = |name: &str| all.iter().find(|l| l.name == name).unwrap();
        let g: f64 = 1e8 / 2.6;
        let rayleigh = PI * 0.002 * (2500.0 / g).sqrt() / (0.1631 * 0.3 + 0.8766);
        assert!((of("Rayleigh time").seconds / rayleigh - 1.0).abs() < 1e-9);
        let (m, r, e) = (0.5 * grains[1].mass(), 0.001, 0.5 * 1e8 / (1.0 - 0.09));
        let hertz = 2.87 * (m * m / (r * e * e * 3.0)).powf(0.2);
        assert!((of("Hertz time").seconds / hertz - 1.0).abs() < 2e-3);
        assert!((of("travel").seconds - 0.002 / 3.0).abs() < 1e-15);
        let choice = choose(all, 0.5);
        assert_eq!(choice.binding, choice.all[0].name);
        assert!((choice.seconds - 0.5 * choice.all[0].step()).abs() < 1e-20);
    }

    #[test]
    fn an_overdamped_dashpot_limits_the_step_by_itself() {
        let rate = 1e4;
        let law = table(ContactLaw {
            tangential: Tangential::None,
            ..ContactLaw::linear(
                Hooke {
                    stiffness: 1.0,
                    damping: Damping::MassProportional(rate),
                },
                TangentialSpring::matched(0.0, 1.0, 0.0),
                None,
            )
        });
        let all = limits(
            &[grain(0.5, 1.0)],
            &[],
            &law,
            &Conditions::default(),
            &Shares::default(),
        );
        let hard = hard(&all).unwrap();
        assert_eq!(hard.name, "normal dashpot");
        assert!((hard.seconds * rate / 2.0 - 1.0).abs() < 1e-6);
    }
}
