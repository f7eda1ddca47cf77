//! How deep and how long spheres press each other, for any normal law: what time steps, durations
//! and plans are measured by.

use colluvium_dem::{ContactLaw, Hertz, Jkr, Normal};
use std::f64::consts::PI;

/// Overlap of an undamped impact (m).
pub fn overlap(law: &ContactLaw, reduced_mass: f64, reduced_radius: f64, speed: f64) -> f64 {
    match &law.normal {
        Normal::Hooke(hooke) => speed * (reduced_mass / hooke.stiffness).sqrt(),
        Normal::Hertz(hertz) => hertz.impact_overlap(reduced_mass, reduced_radius, speed),
        Normal::Viscoelastic(v) => v.impact_overlap(reduced_mass, reduced_radius, speed),
        // Adhesion pulls the spheres together first; the rest is as without it.
        Normal::Jkr(jkr) => {
            jkr.equilibrium_overlap(reduced_radius)
                + without_adhesion(jkr).impact_overlap(reduced_mass, reduced_radius, speed)
        }
    }
}

/// Half a period of the undamped contact (s) at an overlap (m): the shortest motion a step resolves.
pub fn half_period(law: &ContactLaw, reduced_mass: f64, reduced_radius: f64, overlap: f64) -> f64 {
    let stiffness = law.stiffness(reduced_radius, overlap).normal;
    PI * (reduced_mass / stiffness).sqrt()
}

/// Duration of an undamped impact (s); of a bound contact, half its period.
pub fn duration(law: &ContactLaw, reduced_mass: f64, reduced_radius: f64, speed: f64) -> f64 {
    let elastic = match &law.normal {
        Normal::Hooke(hooke) => return PI * (reduced_mass / hooke.stiffness).sqrt(),
        Normal::Hertz(hertz) => hertz.contact_time(reduced_mass, reduced_radius, speed),
        Normal::Viscoelastic(v) => v.contact_time(reduced_mass, reduced_radius, speed),
        Normal::Jkr(jkr) => {
            let bound = jkr.equilibrium_overlap(reduced_radius);
            let swing = half_period(law, reduced_mass, reduced_radius, bound);
            without_adhesion(jkr)
                .contact_time(reduced_mass, reduced_radius, speed)
                .min(swing)
        }
    };
    if elastic.is_finite() && elastic > 0.0 {
        elastic
    } else {
        // No impact: the swing under a thousandth of the radius.
        half_period(law, reduced_mass, reduced_radius, 1e-3 * reduced_radius)
    }
}

fn without_adhesion(jkr: &Jkr) -> Hertz {
    Hertz::of(jkr.elasticity, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use colluvium_dem::{Elasticity, Hooke, TangentialSpring};

    #[test]
    fn an_elastic_impact_lasts_about_a_period_at_its_depth() {
        let material = Elasticity {
            youngs_modulus: 1e8,
            poissons_ratio: 0.3,
        };
        let law = ContactLaw::hertz_mindlin(material, 0.5, 0.5);
        let (m, r, v) = (1e-3, 2.5e-3, 1.0);
        let deepest = overlap(&law, m, r, v);
        // ½ m v² = 2/5 k x², k the secant stiffness: 2.94 x/v against 2.57 x/v/1.118.
        let ratio = duration(&law, m, r, v) / half_period(&law, m, r, deepest);
        assert!(
            (ratio - 2.9432 / (PI / 1.5_f64.sqrt() * 0.8_f64.sqrt())).abs() < 1e-3,
            "{ratio}"
        );
        assert!(duration(&law, m, r, 0.0).is_finite());
    }

    #[test]
    fn a_linear_spring_has_one_time() {
        let spring = TangentialSpring::matched(2.0 / 7.0, 1.0, 0.5);
        let law = ContactLaw::linear(Hooke::matched(1e4, 0.5), spring, None);
        assert_eq!(
            duration(&law, 1e-3, 1.0, 0.0),
            half_period(&law, 1e-3, 1.0, 1e-3)
        );
        assert!((overlap(&law, 1e-4, 1.0, 2.0) - 2e-4).abs() < 1e-18);
    }
}
