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
//! | travel | R/v of the smallest grain | 0.1 |
//!
//! Sources: Kappel et al. 2020 (just under 10 % of Rayleigh's and Hertz' times, checked at 3 %);
//! Tatsuuma et al. 2019 (0.1 t_c). The share of stability leaves room for grains with several contacts:
//! dense packings of 216 grains blow up at 0.52 to 1.2 of what their stiffest contact allows, under all
//! laws with and without dashpots (`step-limits` in the benchmarks).

mod stability;

use crate::contact::{
    ContactLaw, Elasticity, Hertz, Inertia, LawTable, Mindlin, Normal, Tangential,
};
use crate::grains::Grain;
use nalgebra::Vector3;
use stability::{Surfaces, oscillations};
use std::f64::consts::PI;
use std::fmt;

/// k_n (N/m) that keeps the overlap below `largest_overlap` (m) at `speed` (m/s) for mass (kg).
pub fn stiffness(mass: f64, speed: f64, largest_overlap: f64) -> f64 {
    mass * (speed / largest_overlap).powi(2)
}

/// Step (s) that resolves a contact of two grains of `mass` (kg) by `steps_per_contact` steps.
pub fn step(mass: f64, stiffness: f64, steps_per_contact: f64) -> f64 {
    PI * (mass / (2.0 * stiffness)).sqrt() / steps_per_contact
}

/// What grains will meet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conditions {
    /// Largest speed of two surfaces against each other (m/s).
    pub speed: f64,
    /// Largest overlap of any contact over the harmonic mean of its radii (–), as
    /// [`crate::Simulation::largest_overlap`] reports it.
    pub overlap: f64,
    /// Largest pressure (Pa): a contact carries it on the product of its diameters.
    pub pressure: f64,
}

impl Default for Conditions {
    /// At rest, with an overlap of 1 %.
    fn default() -> Self {
        Conditions {
            speed: 0.0,
            overlap: 0.01,
            pressure: 0.0,
        }
    }
}

impl Conditions {
    /// Speeds of the start and of a fall through the whole heap, and its weight.
    pub fn of(grains: &[Grain], gravity: &Vector3<f64>) -> Conditions {
        let fastest = grains.iter().map(|g| g.velocity.norm()).fold(0.0, f64::max);
        let g = gravity.norm();
        let height = |grain: &Grain| grain.position.dot(gravity) / g.max(f64::MIN_POSITIVE);
        let low = grains.iter().map(height).fold(f64::INFINITY, f64::min);
        let high = grains.iter().map(height).fold(f64::NEG_INFINITY, f64::max);
        let depth = if g > 0.0 && high > low {
            high - low
        } else {
            0.0
        };
        let heaviest = grains.iter().map(|g| g.density).fold(0.0, f64::max);
        Conditions {
            // Two grains may meet head on.
            speed: 2.0 * fastest + (2.0 * g * depth).sqrt(),
            pressure: DENSE * heaviest * g * depth,
            ..Conditions::default()
        }
    }
}

/// Solid fraction of a dense packing.
const DENSE: f64 = 0.6;

/// Which share of each time a step may take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shares {
    /// Steps of a contact (N); elastic laws count only a `contact_time` that is given.
    pub steps_per_contact: f64,
    /// Contact time (s) that those steps divide instead of the shortest one of all pairs: a scene may
    /// count them for its mean grain, as the thesis does.
    pub contact_time: Option<f64>,
    /// Of the Hertz time.
    pub hertz: f64,
    /// Of the Rayleigh time.
    pub rayleigh: f64,
    /// Of the JKR time.
    pub jkr: f64,
    /// Of the stability limit of one contact.
    pub stability: f64,
    /// Of the smallest radius over the speed.
    pub travel: f64,
    /// Of what remains: a scene's own safety factor.
    pub safety: f64,
}

impl Default for Shares {
    fn default() -> Self {
        Shares {
            steps_per_contact: 30.0,
            contact_time: None,
            hertz: 0.1,
            rayleigh: 0.1,
            jkr: 0.1,
            stability: 0.3,
            travel: 0.1,
            safety: 1.0,
        }
    }
}

/// Two surfaces that a limit is for; a wall's radius is infinite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pair {
    /// Numbers of the materials.
    pub materials: [u16; 2],
    /// Radii (m).
    pub radii: [f64; 2],
}

impl fmt::Display for Pair {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let [a, b] = self.materials;
        if a != b {
            write!(f, "materials {a} and {b}, ")?;
        }
        match self.radii {
            [r, wall] | [wall, r] if wall.is_infinite() => write!(f, "radius {r:.4e} m on a wall"),
            [r, s] if r == s => write!(f, "radii {r:.4e} m"),
            [r, s] => write!(f, "radii {r:.4e} m and {s:.4e} m"),
        }
    }
}

/// What a limit guards.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Guards {
    /// Accuracy: the step must resolve this time.
    Accuracy,
    /// Stability: beyond this time itself the energy of one contact grows without end.
    Stability,
}

/// A time that the step must stay below.
#[derive(Clone, Debug, PartialEq)]
pub struct Limit {
    /// In a word or two.
    pub name: &'static str,
    /// The time itself (s).
    pub seconds: f64,
    /// Share of it that a step may take.
    pub share: f64,
    /// What it guards.
    pub guards: Guards,
    /// What it is.
    pub why: &'static str,
    /// For whom it is shortest.
    pub pair: Pair,
}

impl Limit {
    /// The step it allows (s).
    pub fn step(&self) -> f64 {
        self.share * self.seconds
    }
}

impl fmt::Display for Limit {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Limit {
            name, seconds, why, ..
        } = self;
        write!(f, "{name}: ")?;
        if self.share < 1.0 && (1.0 / self.share).fract() == 0.0 && self.share < 0.1 {
            write!(f, "1/{:.0}", 1.0 / self.share)?;
        } else {
            write!(f, "{:.3}", self.share)?;
        }
        write!(f, " of {seconds:.4e} s, {why} ({})", self.pair)
    }
}

/// A step and its reason.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// The step (s); infinite if nothing limits it.
    pub seconds: f64,
    /// Name of the limit that binds.
    pub binding: &'static str,
    /// All limits, the binding one first.
    pub all: Vec<Limit>,
}

impl Choice {
    /// The limit that binds.
    pub fn limit(&self) -> Option<&Limit> {
        self.all.first()
    }

    /// The shortest time at which a contact blows up, and its name.
    pub fn hard(&self) -> Option<&Limit> {
        hard(&self.all)
    }
}

/// The shortest of the limits that guard stability.
pub fn hard(limits: &[Limit]) -> Option<&Limit> {
    limits
        .iter()
        .filter(|l| l.guards == Guards::Stability)
        .min_by(|a, b| a.seconds.total_cmp(&b.seconds))
}

/// A grain or a wall, by what limits need of it; fixed ones have infinite mass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Body {
    pub material: u16,
    pub radius: f64,
    pub mass: f64,
    pub fixed: bool,
}

impl Body {
    fn wall(material: u16) -> Body {
        Body {
            material,
            radius: f64::INFINITY,
            mass: f64::INFINITY,
            fixed: true,
        }
    }

    fn density(&self) -> f64 {
        self.mass / (4.0 / 3.0 * PI * self.radius.powi(3))
    }
}

impl From<&Grain> for Body {
    fn from(g: &Grain) -> Body {
        Body {
            material: g.material,
            radius: g.radius,
            mass: g.mass(),
            fixed: g.fixed,
        }
    }
}

/// The few bodies of each material that a shortest limit can belong to.
#[derive(Clone, Debug, Default)]
pub(crate) struct Classes {
    bodies: Vec<Body>,
}

impl Classes {
    /// Of grains and of walls by their materials.
    pub fn of(grains: impl Iterator<Item = Body>, walls: &[u16]) -> Classes {
        // Smallest, largest and lightest of each material, free and fixed.
        let mut found: Vec<[Body; 3]> = Vec::new();
        for body in grains {
            let alike = |[first, ..]: &&mut [Body; 3]| {
                (first.material, first.fixed) == (body.material, body.fixed)
            };
            let Some([small, large, light]) = found.iter_mut().find(alike) else {
                found.push([body; 3]);
                continue;
            };
            if body.radius < small.radius {
                *small = body;
            }
            if body.radius > large.radius {
                *large = body;
            }
            if body.mass < light.mass {
                *light = body;
            }
        }
        let mut bodies: Vec<Body> = Vec::new();
        let walls = walls.iter().map(|&material| Body::wall(material));
        for body in found.into_iter().flatten().chain(walls) {
            if !bodies.contains(&body) {
                bodies.push(body);
            }
        }
        Classes { bodies }
    }

    fn pairs(&self) -> impl Iterator<Item = (&Body, &Body)> {
        let pairs = self.bodies.iter().enumerate();
        pairs.flat_map(|(k, a)| {
            let partners = self.bodies[k..].iter().map(move |b| (a, b));
            partners.filter(|(a, b)| !(a.fixed && b.fixed))
        })
    }
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
        let pair = Pair {
            materials: [a.material, b.material],
            radii: [a.radius, b.radius],
        };
        let surfaces = surfaces(a, b);
        let overlap = overlap(law, a, b, &surfaces.inertia, conditions);
        for oscillation in oscillations(law, &surfaces, overlap) {
            shortest.take(Limit {
                name: oscillation.name,
                seconds: oscillation.seconds,
                share: shares.stability,
                guards: Guards::Stability,
                why: "at which one contact's energy grows without end",
                pair,
            });
        }
        let accuracy = |name, seconds, share, why| Limit {
            name,
            seconds,
            share,
            guards: Guards::Accuracy,
            why,
            pair,
        };
        let (mass, radius) = (
            surfaces.inertia.reduced_mass,
            surfaces.inertia.reduced_radius,
        );
        let counted = match &law.normal {
            Normal::Hooke(hooke) => Some(PI * (mass / hooke.stiffness).sqrt()),
            _ => None,
        };
        if let Some(time) = shares.contact_time.or(counted) {
            shortest.take(accuracy(
                "contact time",
                time,
                1.0 / shares.steps_per_contact,
                "undamped contact time (Thuillet 2019, Eq. 2.7)",
            ));
        }
        shortest.take(accuracy(
            "Hertz time",
            hertz_time(law, mass, radius, conditions.speed),
            shares.hertz,
            "duration of an elastic impact at the largest speed",
        ));
    }
    for body in classes.bodies.iter().filter(|b| !b.fixed) {
        let own = usize::from(body.material);
        let law = laws.between(own, own);
        let mut take = |name, seconds, share, why| {
            shortest.take(Limit {
                name,
                seconds,
                share,
                guards: Guards::Accuracy,
                why,
                pair: Pair {
                    materials: [body.material; 2],
                    radii: [body.radius; 2],
                },
            });
        };
        take(
            "Rayleigh time",
            rayleigh_time(law, body.radius, body.density()),
            shares.rayleigh,
            "in which a surface wave crosses the grain",
        );
        if let Normal::Jkr(jkr) = &law.normal {
            take(
                "JKR time",
                jkr.characteristic_time(body.radius, body.density()),
                shares.jkr,
                "in which an adhesive contact oscillates (Tatsuuma et al. 2019)",
            );
        }
        take(
            "travel",
            body.radius / conditions.speed,
            shares.travel,
            "in which the largest speed crosses the radius",
        );
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
        binding,
        all: limits,
    }
}

fn surfaces(a: &Body, b: &Body) -> Surfaces {
    let inverse = |body: &Body| if body.fixed { 0.0 } else { 1.0 / body.mass };
    let (m, n) = (inverse(a), inverse(b));
    let about = |inverse: f64, body: &Body, power: i32| {
        if body.fixed {
            0.0
        } else {
            inverse / body.radius.powi(power)
        }
    };
    Surfaces {
        inertia: Inertia {
            reduced_mass: 1.0 / (m + n),
            reduced_radius: 1.0 / (1.0 / a.radius + 1.0 / b.radius),
            inverse_inertia: about(m, a, 2) + about(n, b, 2),
        },
        skew: about(m, a, 1) - about(n, b, 1),
    }
}

/// Largest overlap that a pair will meet (m).
fn overlap(law: &ContactLaw, a: &Body, b: &Body, inertia: &Inertia, expected: &Conditions) -> f64 {
    let Inertia {
        reduced_mass: mass,
        reduced_radius: radius,
        ..
    } = *inertia;
    let walled = a.radius.is_infinite() || b.radius.is_infinite();
    let (mean, breadth) = if walled {
        (radius, 4.0 * radius * radius)
    } else {
        (2.0 * radius, 4.0 * a.radius * b.radius)
    };
    let load = expected.pressure * breadth + law.cohesion.force(radius);
    let speed = expected.speed;
    let elastic = |modulus: f64| {
        let struck = (15.0 * mass * speed * speed / (16.0 * modulus * radius.sqrt())).powf(0.4);
        let pressed = (0.75 * load / (modulus * radius.sqrt())).powf(2.0 / 3.0);
        struck.max(pressed)
    };
    let met = match &law.normal {
        Normal::Hooke(hooke) => {
            (load / hooke.stiffness).max(speed * (mass / hooke.stiffness).sqrt())
        }
        Normal::Hertz(hertz) => elastic(hertz.effective_modulus),
        Normal::Viscoelastic(v) => elastic(v.effective_modulus),
        Normal::Jkr(jkr) => elastic(jkr.effective_modulus()).max(jkr.equilibrium_overlap(radius)),
    };
    met.max(expected.overlap * mean)
}

/// `2.87 (m²/(R E*² v))^{1/5}`, infinite at rest.
fn hertz_time(law: &ContactLaw, mass: f64, radius: f64, speed: f64) -> f64 {
    let modulus = match &law.normal {
        Normal::Hooke(_) => return f64::INFINITY,
        Normal::Hertz(hertz) => hertz.effective_modulus,
        Normal::Viscoelastic(v) => v.effective_modulus,
        Normal::Jkr(jkr) => jkr.effective_modulus(),
    };
    Hertz {
        effective_modulus: modulus,
        restitution: 1.0,
    }
    .contact_time(mass, radius, speed)
}

/// `π R √(ρ/G)/(0.1631 ν + 0.8766)` (s) of a law's like pair; infinite for linear springs, which carry
/// no surface wave.
///
/// A law keeps `E* = E/(2(1 - ν²))` and, with Mindlin, `G* = E/(4(2 - ν)(1 + ν))`, so that
/// `E*/G* = 2(2 - ν)/(1 - ν)` gives ν back. Without Mindlin ν = 0 stands in: the shortest of all ν ≥ 0.
fn rayleigh_time(law: &ContactLaw, radius: f64, density: f64) -> f64 {
    let modulus = match &law.normal {
        Normal::Hooke(_) => return f64::INFINITY,
        Normal::Hertz(hertz) => hertz.effective_modulus,
        Normal::Viscoelastic(v) => v.effective_modulus,
        Normal::Jkr(jkr) => return rayleigh(&jkr.elasticity, radius, density),
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

/// A step that would do where one has failed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Remedy {
    /// The step (s).
    pub seconds: f64,
    /// The limit that it comes from.
    pub limit: &'static str,
    /// Whether the failing step was longer.
    pub exceeded: bool,
}

impl fmt::Display for Remedy {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Remedy { seconds, limit, .. } = self;
        if !seconds.is_finite() {
            write!(f, "nothing in the contact laws limits it")
        } else if self.exceeded {
            write!(f, "{seconds:.3e} s would do (limit: {limit})")
        } else {
            write!(
                f,
                "though it is within its limits (the nearest is {limit}, {seconds:.3e} s): the grains \
                 are too soft for their speeds, or started inside each other"
            )
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::{Damping, Hooke, TangentialSpring};

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

    #[test]
    fn pairs_and_walls_are_named() {
        let pair = |materials, radii| Pair { materials, radii }.to_string();
        assert_eq!(pair([0, 0], [1e-3, 1e-3]), "radii 1.0000e-3 m");
        assert_eq!(
            pair([0, 1], [1e-3, f64::INFINITY]),
            "materials 0 and 1, radius 1.0000e-3 m on a wall"
        );
    }
}
