//! Well-posedness of the μ(I) equations.

/// C = 4r² − 4r + μ²(1 − r/2)² with r = I μ′/μ (dimensionless): incompressible μ(I) flow is well
/// posed where C < 0 and ill posed where C > 0, where waves grow faster the shorter they are.
///
/// `mu` is μ(I), `slope` is μ′(I), `inertial_number` is I. Source: Barker, Schaeffer, Bohorquez &
/// Gray, *J. Fluid Mech.* 779 (2015) 794; the form in r from Barker & Gray, *J. Fluid Mech.* 828
/// (2017) 5, eq. 3.9.
pub fn well_posedness(inertial_number: f64, mu: f64, slope: f64) -> f64 {
    let r = inertial_number * slope / mu;
    let half = 1.0 - 0.5 * r;
    4.0 * r * r - 4.0 * r + mu * mu * half * half
}

#[cfg(test)]
mod tests {
    use crate::rheology::MuI;

    /// Limits of the well-posed window for parameter sets of the literature, from the roots of C.
    #[test]
    fn window_of_published_materials() {
        for (mu_s, mu_2, i_0, low, high) in [
            // Jop, Forterre & Pouliquen's glass beads: tan 20.9°, tan 32.76°.
            (0.381863, 0.643468, 0.279, 0.01935, 0.8523),
            (0.32, 0.60, 0.4, 0.01363, 1.810),
            (0.342, 0.557, 0.069, 0.00397, 0.2802),
        ] {
            let law = MuI::new(mu_s, mu_2, i_0, 1e-3, 0.6, 2500.0);
            assert!(law.well_posedness(low * 0.998) > 0.0);
            assert!(law.well_posedness(low * 1.002) < 0.0);
            assert!(law.well_posedness(high * 0.998) < 0.0);
            assert!(law.well_posedness(high * 1.002) > 0.0);
        }
    }
}
