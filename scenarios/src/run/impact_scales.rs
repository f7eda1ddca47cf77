//! How deep and how long spheres press each other, for any normal law: what time steps, durations
//! and plans are measured by.

use colluvium_dem::contact::hertz;
use colluvium_dem::{ContactLaw, Normal};
use std::f64::consts::PI;

/// Overlap of an undamped impact (m).
pub fn overlap(law: &ContactLaw, reduced_mass: f64, reduced_radius: f64, speed: f64) -> f64 {
    let elastic =
        |modulus: f64| hertz::impact_overlap(modulus, reduced_mass, reduced_radius, speed);
    match &law.normal {
        Normal::Hooke(hooke) => speed * (reduced_mass / hooke.stiffness).sqrt(),
        Normal::Hertz(hertz) => elastic(hertz.effective_modulus),
        Normal::Viscoelastic(v) => elastic(v.effective_modulus),
        // Adhesion pulls the spheres together first; the rest is as without it.
        Normal::Jkr(jkr) => {
            jkr.equilibrium_overlap(reduced_radius) + elastic(jkr.effective_modulus())
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
    let swing = |overlap| half_period(law, reduced_mass, reduced_radius, overlap);
    let Some(modulus) = law.normal.elastic_modulus() else {
        // A linear spring has one time at all overlaps.
        return swing(0.0);
    };
    let mut elastic = hertz::impact_time(modulus, reduced_mass, reduced_radius, speed);
    if let Normal::Jkr(jkr) = &law.normal {
        elastic = elastic.min(swing(jkr.equilibrium_overlap(reduced_radius)));
    }
    if elastic.is_finite() && elastic > 0.0 {
        elastic
    } else {
        // No impact: the swing under a thousandth of the radius.
        swing(1e-3 * reduced_radius)
    }
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
