//! Energy of contacts led by hand: closed paths of load and shear, and impacts under laws that no scene
//! could name, which the same checks must catch.

use super::composition::Visitor;
use super::mindlin::SpringMemory;
use super::*;

const SOFT: Elasticity = Elasticity {
    youngs_modulus: 1e7,
    poissons_ratio: 0.25,
};
const MASS: f64 = 0.01;
const RADIUS: f64 = 0.01;

fn touch(overlap: f64, approach: f64, slip: f64) -> Touch<f64> {
    Touch {
        normal: Vec3([0.0, 0.0, 1.0]),
        overlap,
        velocity: Vec3([slip, 0.0, -approach]),
        spin: Vec3([0.0, slip / RADIUS, 0.0]),
        inverse_mass: 1.0 / MASS,
        curvature: 1.0 / RADIUS,
        inverse_inertia: 1.0 / (MASS * RADIUS * RADIUS),
    }
}

/// Work put into a contact per turn of a closed path of overlap and shear, once it repeats (J).
struct Turning {
    /// Overlap grows and falls twice a turn, this share of its mean, in step with the shear's product.
    swing: f64,
}

impl Visitor for Turning {
    type Output = f64;
    fn visit<I: Interaction>(self, law: &I) -> f64 {
        let (steps, turns, mean, shear) = (4000, 6, 1e-4, 1e-5);
        let dt = 1e-2 / f64::from(steps);
        let at = |k: i32| {
            let angle = std::f64::consts::TAU * f64::from(k) / f64::from(steps);
            let overlap = mean * (1.0 + self.swing * (2.0 * angle).sin());
            (overlap, shear * angle.sin())
        };
        let mut history = [0.0; HISTORY_MAX];
        let (mut work, mut before) = (0.0, [0.0; 2]);
        for k in 1..=turns * steps {
            let ((x0, u0), (x1, u1)) = (at(k - 1), at(k));
            let touch = touch(x1, (x1 - x0) / dt, (u1 - u0) / dt);
            let step = Step { stretch: dt };
            let force = law
                .wrench(&law.table()[0], &touch, &mut history, step)
                .force
                .0;
            let resists = [force[2], -force[0]];
            if k > steps {
                work += 0.5 * (resists[0] + before[0]) * (x1 - x0);
                work += 0.5 * (resists[1] + before[1]) * (u1 - u0);
            }
            before = resists;
        }
        work / f64::from(turns - 1)
    }
}

fn table(law: ContactLaw) -> LawTable {
    match LawTable::new(&law.into()) {
        Ok(table) => table,
        Err(error) => panic!("{error}"),
    }
}

fn springs(memory: SpringMemory, friction: f64) -> ContactLaw {
    let mut law = ContactLaw::hertz_mindlin(SOFT, 1.0, friction);
    law.tangential = Tangential::Mindlin(Mindlin {
        memory,
        ..Mindlin::of(SOFT, 1.0, friction)
    });
    law
}

#[test]
fn no_cycle_of_load_and_shear_creates_energy() {
    let scale = 0.5 * Mindlin::of(SOFT, 1.0, 1.0).stiffness(RADIUS, 1e-4) * 1e-10;
    for swing in [-0.8, -0.3, 0.0, 0.3, 0.8] {
        // Sticking, and slipping at times.
        for friction in [100.0, 0.05] {
            let law = table(springs(SpringMemory::Energy, friction));
            let work = law.visit(Turning { swing }) / scale;
            assert!(work > -1e-3, "swing {swing}, μ {friction}: {work} of ½kS²");
        }
    }
}

#[test]
fn a_spring_that_keeps_its_displacement_does_and_is_caught() {
    // Sheared in the soft half of the swing, let go in the stiff one: ∮ k(x) u du < 0.
    let scale = 0.5 * Mindlin::of(SOFT, 1.0, 1.0).stiffness(RADIUS, 1e-4) * 1e-10;
    let law = table(springs(SpringMemory::Displacement, 100.0));
    let work = [-0.8, 0.8].map(|swing| law.visit(Turning { swing }) / scale);
    assert!(work[0].min(work[1]) < -0.5, "{work:?}");
    assert!(
        work[0].max(work[1]) > 0.5,
        "and takes it the other way round"
    );
}

/// An impact of a sphere with slip (m/s); one coefficient of the law may be changed.
struct Meeting {
    slip: f64,
    change: Option<(usize, f64)>,
}

impl Visitor for Meeting {
    /// Energy after over before, -1.
    type Output = f64;
    fn visit<I: Interaction>(self, law: &I) -> f64 {
        let mut coefficients = law.table()[0];
        if let Some((k, factor)) = self.change {
            coefficients[k] *= factor;
        }
        let (dt, mut gap, mut v, mut slip) = (2e-6, 1e-12, -0.5, self.slip);
        // Relative motion of the surfaces of a sphere on a wall: mass m across, 2/7 m along.
        let energy = |v: f64, slip: f64| 0.5 * MASS * (v * v + 2.0 / 7.0 * slip * slip);
        let before = energy(v, slip);
        let mut history = [0.0; HISTORY_MAX];
        for _ in 0..200_000 {
            gap += dt * v;
            if gap >= 0.0 {
                return energy(v, slip) / before - 1.0;
            }
            let step = Step { stretch: dt };
            let force = law
                .wrench(&coefficients, &touch(-gap, -v, slip), &mut history, step)
                .force
                .0;
            v += dt * force[2] / MASS;
            slip += dt * 3.5 * force[0] / MASS;
        }
        f64::NAN
    }
}

#[test]
fn a_dashpot_of_the_wrong_sign_is_caught() {
    let spring = Tangential::Linear(TangentialSpring {
        stiffness: SpringStiffness::Absolute(3e4),
        damping: Damping::Restitution(0.7),
        friction: 0.5,
    });
    let hertz = ContactLaw::hertz_mindlin(SOFT, 0.7, 0.5);
    // The place of the normal dashpot is 1 in all; the slider has the same test of the tangential one.
    for (name, normal, tangential) in [
        ("hooke", Normal::Hooke(Hooke::matched(1e5, 0.7)), spring),
        ("hertz, linear", hertz.normal, spring),
        ("hertz", hertz.normal, hertz.tangential),
        (
            "viscoelastic",
            Normal::Viscoelastic(Viscoelastic::of(SOFT, 1e-4)),
            hertz.tangential,
        ),
    ] {
        let law = table(ContactLaw {
            normal,
            tangential,
            ..hertz
        });
        for slip in [0.0, 0.05, 0.5, 5.0] {
            let gain = |change| law.visit(Meeting { slip, change });
            assert!(gain(None) < 0.0, "{name}, slip {slip}: {}", gain(None));
            if slip < 1.0 {
                let caught = gain(Some((1, -1.0)));
                assert!(caught > 0.02, "{name}, slip {slip}: normal {caught}");
            }
        }
    }
}
