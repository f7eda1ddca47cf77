//! The components of the strain rate, by the number of axes.
//!
//! D = (∇u + ∇uᵀ)/2 without its trace has two components in a plane flow and five in space. They are
//! chosen so that γ̇² = 2 D:D is the sum of their squares:
//!
//! ```text
//! plane:  γ = (D_xx − D_zz, 2 D_xz)
//! space:  γ = (D_xx − D_yy, (D_xx + D_yy − 2 D_zz)/√3, 2 D_xy, 2 D_xz, 2 D_yz)
//! ```
//!
//! The stress has the components s that do the work s·γ = τ:D: ((τ_xx − τ_zz)/2, τ_xz) in the plane,
//! ((τ_xx − τ_yy)/2, (τ_xx + τ_yy − 2 τ_zz)/(2√3), τ_xy, τ_xz, τ_yz) in space, so that
//! |τ|² = ½ τ:τ is the sum of their squares too.

use crate::rheology::strain_rate_norm;

/// Components of the strain rate in space.
pub const SPACE_COMPONENTS: usize = 5;
/// Most velocities that a quadrature point in space depends on: six faces of the cell, and two more across
/// each of the three edges that meet at its corner.
pub const SPACE_VELOCITIES: usize = 12;

/// 1/√3.
const THIRD_ROOT: f64 = 0.577_350_269_189_625_8;

/// Components to which the stretching ∂u_axis/∂x_axis belongs, each with its factor.
#[inline]
pub(crate) fn stretching<const D: usize>(axis: usize) -> &'static [(usize, f64)] {
    match (D, axis) {
        (2, 0) => &[(0, 1.0)],
        (2, _) => &[(0, -1.0)],
        (_, 0) => &[(0, 1.0), (1, THIRD_ROOT)],
        (_, 1) => &[(0, -1.0), (1, THIRD_ROOT)],
        _ => &[(1, -2.0 * THIRD_ROOT)],
    }
}

/// The component of the shear between two axes, the lower first.
#[inline]
pub(crate) fn shear_row<const D: usize>(low: usize, high: usize) -> usize {
    if D == 2 { 1 } else { low + high + 1 }
}

/// The middle eigenvalue λ₂ of A = 2D/γ̇, 0 in plane flow: with tr A = 0 and A:A = 2 the eigenvalues are the roots of
/// λ³ − λ = det A, and λ₂ = (2/√3) sin(θ), sin 3θ = −(3√3/2) det A, |θ| ≤ π/6.
pub(crate) fn middle_stretching<const C: usize>(rate: &[f64; C]) -> f64 {
    let norm = strain_rate_norm(*rate);
    let &[a, b, xy, xz, yz] = rate.as_slice() else {
        return 0.0;
    };
    if norm == 0.0 {
        return 0.0;
    }
    let [xx, yy, zz] = deviator([a, b, xy, xz, yz]);
    let determinant =
        xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz);
    let sine = -1.5 * 3.0_f64.sqrt() * determinant / norm.powi(3);
    2.0 * THIRD_ROOT * (libm::asin(sine.clamp(-1.0, 1.0)) / 3.0).sin()
}

/// τ_xx, τ_yy and τ_zz of a stress in space.
pub fn deviator(stress: [f64; SPACE_COMPONENTS]) -> [f64; 3] {
    let level = THIRD_ROOT * stress[1];
    [level + stress[0], level - stress[0], -2.0 * level]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Components of a velocity gradient without divergence, `gradient[i][j]` = ∂u_i/∂x_j.
    fn components(gradient: [[f64; 3]; 3]) -> [f64; SPACE_COMPONENTS] {
        let mut rate = [0.0; SPACE_COMPONENTS];
        for i in 0..3 {
            for &(row, factor) in stretching::<3>(i) {
                rate[row] += factor * gradient[i][i];
            }
            for j in 0..i {
                rate[shear_row::<3>(j, i)] += gradient[i][j] + gradient[j][i];
            }
        }
        rate
    }

    #[test]
    fn the_norm_is_that_of_the_tensor() {
        let gradient = [[0.3, 1.1, -0.6], [-0.4, 0.5, 0.9], [0.2, -1.7, -0.8]];
        let mut squares = 0.0;
        for (i, row) in gradient.iter().enumerate() {
            for (j, value) in row.iter().enumerate() {
                squares += f64::powi(0.5 * (value + gradient[j][i]), 2);
            }
        }
        let tensor = f64::sqrt(2.0 * squares);
        assert!((strain_rate_norm(components(gradient)) / tensor - 1.0).abs() < 1e-15);
    }

    /// Shears and normal stresses give back |τ|² = ½ τ:τ, and the definitions of the first two components.
    #[test]
    fn the_deviator_belongs_to_its_components() {
        let stress = [0.4, -1.1, 0.3, 0.7, -0.2];
        let [xx, yy, zz] = deviator(stress);
        assert!((0.5 * (xx - yy) - stress[0]).abs() < 1e-15 && (xx + yy + zz).abs() < 1e-15);
        assert!(((xx + yy - 2.0 * zz) / (2.0 * 3.0_f64.sqrt()) - stress[1]).abs() < 1e-15);
        let shears: f64 = stress[2..].iter().map(|s| s * s).sum();
        let half = 0.5 * (xx * xx + yy * yy + zz * zz) + shears;
        assert!((half.sqrt() / strain_rate_norm(stress) - 1.0).abs() < 1e-15);
    }

    /// A plane flow has the same γ̇ in whichever plane it lies, and the one of two components.
    #[test]
    fn plane_flow_is_a_case_of_flow_in_space() {
        let plane = strain_rate_norm([2.0 * 0.7, 1.3]);
        for [a, b] in [[0, 1], [0, 2], [1, 2]] {
            let mut gradient = [[0.0; 3]; 3];
            (gradient[a][a], gradient[b][b], gradient[a][b]) = (0.7, -0.7, 1.3);
            assert!((strain_rate_norm(components(gradient)) - plane).abs() < 1e-15);
        }
    }

    /// λ₂ solves λ³ − λ = det A and lies between the two others; stretching along one axis, along two, and in a plane.
    #[test]
    fn the_middle_stretching_is_an_eigenvalue() {
        let gradient = [[0.3, 1.1, -0.6], [-0.4, 0.5, 0.9], [0.2, -1.7, -0.8]];
        let rate = components(gradient);
        let norm = strain_rate_norm(rate);
        let a = |i: usize, j: usize| (gradient[i][j] + gradient[j][i]) / norm;
        let middle = middle_stretching(&rate);
        let determinant = |l: f64| {
            let d = |i: usize| a(i, i) - l;
            d(0) * (d(1) * d(2) - a(1, 2) * a(1, 2))
                - a(0, 1) * (a(0, 1) * d(2) - a(1, 2) * a(0, 2))
                + a(0, 2) * (a(0, 1) * a(1, 2) - d(1) * a(0, 2))
        };
        assert!(determinant(middle).abs() < 1e-14);
        // −λ³ + λ + det A rises through the middle one of its roots.
        assert!(determinant(middle + 1e-3) > 0.0 && determinant(middle - 1e-3) < 0.0);
        let diagonal = |x, y, z| components([[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]]);
        let near = |rate: [f64; 5], value: f64| (middle_stretching(&rate) - value).abs() < 1e-7;
        assert!(near(diagonal(-0.2, 0.4, -0.2), -THIRD_ROOT));
        assert!(near(diagonal(3.0, 3.0, -6.0), THIRD_ROOT));
        assert!(near(diagonal(1.0, 0.0, -1.0), 0.0));
        assert_eq!(middle_stretching(&[0.3, 0.7]), 0.0);
    }
}
