//! One bond: how it stretches, bends and breaks.
//!
//! The incremental law of Potyondy & Cundall (2004), kept as displacements instead of forces:
//!
//! ```text
//! F_n = -k_n A (d - d_0)          d distance of centres, d_0 when bonded; positive pressed together
//! F_t = -k_t A U                  U shear displacement of i against j at the contact point
//! M_t = -k_n I Θ_t                Θ angle turned by i against j, across the line of centres
//! M_n = -k_t J Θ_n                and along it
//! ```
//! The contact point divides the line of centres as the radii do; with `w = (R_i ω_i + R_j ω_j)/(R_i + R_j)`
//! the displacements grow by
//!
//! ```text
//! dU/dt = d (dn/dt - w × n)       dΘ/dt = ω_i - ω_j           (in the frame that turns with w and n)
//! ```
//! A step turns U, Θ and the old normal by `w Δt` exactly, then by the smallest rotation that brings the
//! turned normal to the new one; U grows by the mean d times the difference of the two. A bond that moves as a
//! rigid body has no difference, whatever the step: frames differ by round-off only. Half of ΔΘ is
//! turned along, which makes the step second order.

use super::cement::{Cement, Section};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// Whether a bond holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum BondState {
    /// It holds.
    Whole,
    /// Tensile stress has broken it.
    Torn,
    /// Shear stress has broken it.
    Sheared,
    /// It was taken away.
    Cut,
}

/// Displacements of a bond.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Strain {
    /// Distance of the centres when the bond was made, d_0 (m).
    pub rest: f64,
    /// U (m).
    pub shear: Vector3<f64>,
    /// Θ (rad).
    pub turn: Vector3<f64>,
}

/// Motion of the two grains of a bond.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Relative {
    /// Centre of i minus that of j, nearest image (m).
    pub branch: Vector3<f64>,
    /// Velocity of i minus that of j (m/s).
    pub velocity: Vector3<f64>,
    /// Angular velocities (rad/s).
    pub spins: [Vector3<f64>; 2],
    /// Radii (m).
    pub radii: [f64; 2],
}

/// What a bond does to its grains.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Pull {
    /// Force on i; j takes the opposite (N).
    pub force: Vector3<f64>,
    /// Moments on i and j about their centres (N m).
    pub moments: [Vector3<f64>; 2],
}

/// Stresses at the rim of a bond (Pa).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BondStress {
    /// `-F_n/A + |M_t| R_b/I`.
    pub tensile: f64,
    /// `|F_t|/A + |M_n| R_b/J`.
    ///
    /// Kappel et al. (2020, Eq. 24) print I; the moment along a bond twists it, so J it is, as in
    /// Potyondy & Cundall (2004, Eq. 16).
    pub shear: f64,
}

/// Turns `v` by a rotation vector.
fn turned(v: &Vector3<f64>, by: &Vector3<f64>) -> Vector3<f64> {
    let angle = by.norm();
    if angle == 0.0 {
        return *v;
    }
    let axis = by / angle;
    let (sin, cos) = angle.sin_cos();
    v * cos + axis.cross(v) * sin + axis * (axis.dot(v) * (1.0 - cos))
}

/// Turns `v` as the smallest rotation turns one unit vector into another.
fn carried(v: &Vector3<f64>, from: &Vector3<f64>, to: &Vector3<f64>) -> Vector3<f64> {
    let c = from.cross(to);
    v + c.cross(v) + c.cross(&c.cross(v)) / (1.0 + from.dot(to))
}

impl Strain {
    /// Displacements after a step of this length (s), which has brought the grains to where they are.
    pub fn advanced(&self, moved: &Relative, step: f64) -> Strain {
        let [a, b] = moved.radii;
        let distance = moved.branch.norm();
        let normal = moved.branch / distance;
        let before = moved.branch - step * moved.velocity;
        let (length, before) = (before.norm(), before.normalize());
        let frame = (moved.spins[0] * a + moved.spins[1] * b) * (step / (a + b));
        let carry =
            |v: &Vector3<f64>, from: &Vector3<f64>| carried(&turned(v, &frame), from, &normal);
        let along = turned(&before, &frame);
        let half = (moved.spins[0] - moved.spins[1]) * (0.5 * step);
        let shear = carry(&self.shear, &along) + (normal - along) * (0.5 * (distance + length));
        Strain {
            rest: self.rest,
            shear: shear - normal * normal.dot(&shear),
            turn: carry(&(self.turn + half), &along) + half,
        }
    }

    /// Force and moments at this instant.
    pub fn pull(&self, section: &Section, at: &Relative) -> Pull {
        let [a, b] = at.radii;
        let distance = at.branch.norm();
        let normal = at.branch / distance;
        let shear = -section.shear * self.shear;
        let twist = self.turn.dot(&normal) * normal;
        let moment = -section.bending * (self.turn - twist) - section.twisting * twist;
        let lever = normal.cross(&shear) * (distance / (a + b));
        Pull {
            force: shear - section.axial * (distance - self.rest) * normal,
            moments: [moment - lever * a, -moment - lever * b],
        }
    }

    /// Stresses at the rim.
    pub fn stress(&self, section: &Section, branch: &Vector3<f64>) -> BondStress {
        let distance = branch.norm();
        let normal = branch / distance;
        let twist = self.turn.dot(&normal);
        let bend = (self.turn - twist * normal).norm();
        let rim = section.radius / section.second_moment;
        BondStress {
            tensile: section.axial * (distance - self.rest) / section.area
                + section.bending * bend * rim,
            shear: section.shear * self.shear.norm() / section.area
                + section.twisting * twist.abs() * 0.5 * rim,
        }
    }

    /// Elastic energy (J).
    pub fn energy(&self, section: &Section, branch: &Vector3<f64>) -> f64 {
        let distance = branch.norm();
        let twist = self.turn.dot(branch) / distance;
        let bend2 = self.turn.norm_squared() - twist * twist;
        0.5 * (section.axial * (distance - self.rest).powi(2)
            + section.shear * self.shear.norm_squared()
            + section.bending * bend2
            + section.twisting * twist * twist)
    }
}

impl BondStress {
    /// What a bond under these stresses is; the limits themselves are borne.
    pub fn outcome(&self, cement: &Cement) -> BondState {
        if self.tensile > cement.tensile_strength {
            BondState::Torn
        } else if self.shear > cement.shear_strength {
            BondState::Sheared
        } else {
            BondState::Whole
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RADII: [f64; 2] = [0.02, 0.03];

    fn cement() -> Cement {
        Cement {
            radius_ratio: 0.5,
            ..Cement::sinter(1e7)
        }
    }

    fn section() -> Section {
        cement().section(RADII[0], RADII[1])
    }

    /// Grain j at rest at the origin, grain i at 0.05 n, after one step of one second.
    fn moved(velocity: Vector3<f64>, spins: [Vector3<f64>; 2]) -> (Strain, Relative) {
        let branch = 0.05 * Vector3::x() + velocity;
        let at = Relative {
            branch,
            velocity,
            spins,
            radii: RADII,
        };
        let strain = Strain {
            rest: 0.05,
            ..Strain::default()
        };
        (strain.advanced(&at, 1.0), at)
    }

    fn close(a: Vector3<f64>, b: Vector3<f64>) {
        assert!((a - b).norm() <= 1e-5 * b.norm(), "{a} is not {b}");
    }

    #[test]
    fn pulling_shearing_bending_and_twisting_meet_the_closed_forms() {
        let (s, none) = (section(), Vector3::zeros());
        let radius: f64 = 0.01;
        let area = std::f64::consts::PI * radius.powi(2);
        assert!((s.area - area).abs() < 1e-12 * area);
        assert!((s.axial - 1e7 / 0.05 * area).abs() < 1e-9 * s.axial);
        let e = 1e-8;

        let (strain, at) = moved(e * Vector3::x(), [none; 2]);
        let pull = strain.pull(&s, &at);
        close(pull.force, -s.axial * e * Vector3::x());
        assert_eq!(pull.moments, [none; 2]);
        let stress = strain.stress(&s, &at.branch);
        assert!((stress.tensile - s.axial * e / area).abs() < 1e-6 * stress.tensile);
        assert_eq!(stress.shear, 0.0);

        // Sheared by moving i across, the arms are 0.02 and 0.03 m.
        let (strain, at) = moved(e * Vector3::y(), [none; 2]);
        let pull = strain.pull(&s, &at);
        let force = -s.shear * e * Vector3::y();
        close(pull.force, force);
        close(pull.moments[0], -0.02 * Vector3::x().cross(&force));
        close(pull.moments[1], -0.03 * Vector3::x().cross(&force));
        let stress = strain.stress(&s, &at.branch);
        assert!((stress.shear - s.shear * e / area).abs() < 1e-6 * stress.shear);

        // Bent by spins that leave the contact point where it is.
        let turn = e * Vector3::z();
        let (strain, at) = moved(none, [3.0 * turn, -2.0 * turn]);
        let pull = strain.pull(&s, &at);
        let moment = -s.bending * 5.0 * turn;
        close(pull.moments[0], moment);
        close(pull.moments[1], -moment);
        assert!(pull.force.norm() < 1e-6 * moment.norm() / 0.05);
        let stress = strain.stress(&s, &at.branch);
        let rim = moment.norm() * radius / (0.25 * area * radius * radius);
        assert!((stress.tensile - rim).abs() < 1e-6 * rim);

        // Twisted about the line of centres: half the stress that bending would give, by J = 2 I.
        let turn = e * Vector3::x();
        let (strain, at) = moved(none, [turn, -turn]);
        let pull = strain.pull(&s, &at);
        let moment = -s.twisting * 2.0 * turn;
        close(pull.moments[0], moment);
        close(pull.moments[1], -moment);
        let stress = strain.stress(&s, &at.branch);
        let rim = moment.norm() * radius / (0.5 * area * radius * radius);
        assert!((stress.shear - rim).abs() < 1e-6 * rim);
        assert!(stress.tensile.abs() < 1e-9 * rim);
    }

    /// A strained bond carried round as a rigid body; the second number spoils the spins.
    fn carried_round(steps: usize, spoil: f64) -> f64 {
        let axis = Vector3::new(0.3, -0.5, 0.8).normalize();
        let step = std::f64::consts::TAU / steps as f64;
        let start = 0.05 * Vector3::x();
        let strain = Strain {
            rest: 0.049,
            shear: Vector3::new(0.0, 1e-4, -2e-4),
            turn: Vector3::new(2e-3, 1e-3, 3e-3),
        };
        let mut now = strain;
        for n in 0..steps {
            let at = |n: usize| turned(&start, &(axis * (n as f64 * step)));
            let moved = Relative {
                branch: at(n + 1),
                velocity: at(n + 1) - at(n),
                spins: [axis * (step * (1.0 + spoil)); 2],
                radii: RADII,
            };
            now = now.advanced(&moved, 1.0);
        }
        (now.shear - strain.shear).norm() / strain.shear.norm()
            + (now.turn - strain.turn).norm() / strain.turn.norm()
    }

    #[test]
    fn a_rigid_turn_leaves_a_strained_bond_as_it_was() {
        for steps in [7, 100, 10_000] {
            let error = carried_round(steps, 0.0);
            assert!(error < 1e-14 * (steps as f64 + 10.0), "{steps}: {error:e}");
        }
        // Spins that do not belong to the turn do strain it.
        assert!(carried_round(100, 1e-6) > 1e-6);
    }
}
