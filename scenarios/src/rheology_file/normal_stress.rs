//! A measured law as a continuum reads it whose one pressure is σ_zz.
//!
//! The points of a law have I = γ̇ d √(ρ_s/p) with p = trace/3. On a slope the pressure of a continuum that has only one is
//! the weight, σ_zz, and its inertial number γ̇ d √(ρ_s/σ_zz) = I √r with r = p/σ_zz. The same law against that number has
//! I_0 √r in the place of I_0, and so have the inertial numbers between which it was measured. Read as it stands, I_0
//! makes a layer faster by 1/√r: 3.8 % for r = 0.928, for u ∝ I.

use super::RheologyFile;
use colluvium_coupling::calibration::{SolidFractionFit, mu_of_i};

impl RheologyFile {
    /// The law of |τ|/σ_zz, with inertial numbers made with σ_zz; without `mu_zz` nothing changes.
    ///
    /// r is what the file's two laws make of it, |τ|/σ_zz over |τ|/p, at the geometric middle of the inertial numbers that
    /// were measured (at I_0 where the file does not name them).
    ///
    /// # Errors
    /// Says what would make a scene refuse the law, with the range allowed.
    pub fn against_normal_stress(mut self) -> Result<RheologyFile, String> {
        let Some(fit) = self.mu_zz.take() else {
            return Ok(self);
        };
        let middle = match self.valid_i {
            Some([low, high]) if low > 0.0 => (low * high).sqrt(),
            Some([_, high]) => 0.5 * high,
            None => self.i_0,
        };
        let friction = mu_of_i(self.mu_s, self.mu_2, self.i_0, middle);
        let friction_zz = mu_of_i(fit.mu_s, fit.mu_2, fit.i_0, middle);
        let ratio = friction_zz / friction;
        if !(ratio > 0.0 && ratio.is_finite()) {
            return Err(format!(
                "p/sigma_zz = |tau|/sigma_zz / (|tau|/p) = {friction_zz} / {friction} at I = {middle} is not allowed; allowed: (0, inf)"
            ));
        }
        let root = ratio.sqrt();
        (self.mu_s, self.mu_2, self.i_0) = (fit.mu_s, fit.mu_2, fit.i_0 * root);
        self.mu_s_error = Some(fit.mu_s_error);
        self.mu_2_error = Some(fit.mu_2_error);
        self.i_0_error = Some(fit.i_0_error * root);
        // That of |τ|/p; none of |τ|/σ_zz is kept.
        self.covariance = None;
        self.valid_i = self.valid_i.map(|range| range.map(|i| i * root));
        self.solid_fraction_of_i = self.solid_fraction_of_i.map(|law| SolidFractionFit {
            slope: law.slope / root,
            slope_error: law.slope_error / root,
            ..law
        });
        self.table = self.table.map(|points| {
            points
                .iter()
                .map(|[i, mu]| [i * root, mu * ratio])
                .collect()
        });
        self.check()?;
        Ok(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rheology_file::FitRow;
    use colluvium_continuum::bagnold::BagnoldCase;
    use colluvium_continuum::rheology::MuI;
    use std::path::Path;

    /// A law of grains whose p is `ratio` of σ_zz at every I.
    fn law(ratio: f64) -> RheologyFile {
        let text = "mu_s = 0.5\nmu_2 = 0.9\ni_0 = 0.6\ndiameter = 0.01\nsolid_fraction = 0.5\ngrain_density = 2500.0\n\
                    valid_i = [0.1, 0.9]\ntable = [[0.1, 0.55], [0.9, 0.74]]\n";
        let mut law: RheologyFile = toml::from_str(text).unwrap();
        law.mu_zz = Some(FitRow {
            mu_s: 0.5 * ratio,
            mu_s_error: 0.01,
            mu_2: 0.9 * ratio,
            mu_2_error: 0.01,
            i_0: 0.6,
            i_0_error: 0.1,
        });
        law
    }

    /// What the grains do: at a slope the stress ratio |τ|/σ_zz = tan θ gives I by p, hence γ̇ = I √(p/ρ_s)/d with
    /// p = r σ_zz. The continuum knows σ_zz only and is to shear at the same rate.
    #[test]
    fn a_layer_of_one_pressure_shears_as_the_grains_do() {
        for ratio in [1.0, 0.928, 0.846] {
            let read = law(ratio).against_normal_stress().unwrap();
            let tangent = 0.65 * ratio;
            // μ = 0.65 of |τ|/p.
            let inertial_number = 0.6 * (0.65 - 0.5) / (0.9 - 0.65);
            let slope = f64::atan(tangent);
            let (depth, gravity) = (0.3, 9.81);
            let case = BagnoldCase {
                slope,
                depth,
                gravity,
                rheology: MuI {
                    mu_s: read.mu_s,
                    mu_2: read.mu_2,
                    i_0: read.i_0,
                    diameter: read.diameter,
                    solid_fraction: read.solid_fraction,
                    grain_density: 2500.0,
                    cohesion: 0.0,
                },
                cells: 64,
                columns: None,
            };
            // ∫ γ̇ from the base: 2/3 I √(r φ g cos θ) h^{3/2}/d, with p = r σ_zz.
            let expected = 2.0 / 3.0
                * inertial_number
                * (ratio * 0.5 * gravity * slope.cos()).sqrt()
                * depth.powf(1.5)
                / 0.01;
            let top = case.exact_velocity(depth);
            assert!((top / expected - 1.0).abs() < 1e-9, "{top} {expected}");
            // As it stands in the file, the law is too fast by 1/√r.
            let mut plain = case;
            plain.rheology.i_0 = 0.6;
            let wrong = plain.exact_velocity(depth) / expected;
            assert!((wrong * ratio.sqrt() - 1.0).abs() < 1e-9, "{wrong}");
            assert_eq!(read.valid_i.unwrap()[1], 0.9 * ratio.sqrt());
            let points = read.table.unwrap();
            assert!((points[1][1] - 0.74 * ratio).abs() < 1e-12);
        }
    }

    #[test]
    fn a_law_that_falls_is_refused() {
        let why = RheologyFile::read(Path::new("gravel"))
            .unwrap()
            .against_normal_stress()
            .unwrap_err();
        assert!(why.contains("mu_2"), "{why}");
    }
}
