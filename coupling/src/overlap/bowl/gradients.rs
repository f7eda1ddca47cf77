//! How fast the continuum is sheared, cell by cell.

use super::cells::Cells;
use super::continuum::{View, components};
use colluvium_continuum::rheology::strain_rate_norm;
use nalgebra::{Matrix3, Vector3};

/// L_ij = ∂u_i/∂x_j of a cell (1/s), from differences between the full cells beside it; zero in one that is not full.
pub(super) fn gradient(view: &View, cells: &Cells, cell: usize) -> Matrix3<f64> {
    let mut gradient = Matrix3::zeros();
    if !view.is_full(cell) {
        return gradient;
    }
    let index = cells.index(cell);
    for axis in 0..3 {
        let beside = |n: usize| {
            let mut other = index;
            other[axis] = n;
            let other = cells.cell(other);
            view.is_full(other).then_some(other)
        };
        let low = index[axis].checked_sub(1).and_then(beside);
        let high = Some(index[axis] + 1).filter(|n| *n < cells.counts[axis]);
        let high = high.and_then(beside);
        let count = f64::from(u8::from(low.is_some())) + f64::from(u8::from(high.is_some()));
        if count > 0.0 {
            let [a, b] = [low, high].map(|at| view.velocity[at.unwrap_or(cell)]);
            gradient.set_column(axis, &((b - a) / (count * cells.spacing[axis])));
        }
    }
    gradient
}

/// Those of all cells.
pub(super) fn gradients(view: &View, cells: &Cells) -> Vec<Matrix3<f64>> {
    let of = |cell| gradient(view, cells, cell);
    (0..cells.count()).map(of).collect()
}

/// Its interpolation at a place, over full cells.
pub(super) fn gradient_at(
    view: &View,
    gradients: &[Matrix3<f64>],
    hats: &[(usize, f64); 8],
) -> Matrix3<f64> {
    let (mut sum, mut weight) = (Matrix3::zeros(), 0.0);
    for &(cell, hat) in hats.iter().filter(|(cell, _)| view.is_full(*cell)) {
        weight += hat;
        sum += hat * gradients[cell];
    }
    if weight > 0.0 { sum / weight } else { sum }
}

/// Components of D, the symmetric part less its trace, whose squares add up to 2 D:D.
pub(super) fn shear_components(gradient: &Matrix3<f64>) -> [f64; 5] {
    components(&(gradient + gradient.transpose())).0
}

/// γ̇ = √(2 D:D).
pub(super) fn shear_rate(gradient: &Matrix3<f64>) -> f64 {
    strain_rate_norm(shear_components(gradient))
}

/// ω, the rotation rate of the material: half of the curl (1/s).
pub(super) fn rotation(gradient: &Matrix3<f64>) -> Vector3<f64> {
    let g = |i: usize, j: usize| gradient[(i, j)] - gradient[(j, i)];
    0.5 * Vector3::new(g(2, 1), g(0, 2), g(1, 0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_linear_velocity_has_its_gradient_up_to_the_edges() {
        let cells = Cells {
            counts: [5, 5, 5],
            low: [0.0; 3],
            spacing: [0.5, 1.0, 0.25],
        };
        let wanted = Matrix3::new(1.0, -2.0, 3.0, 0.5, -1.5, 4.0, 0.0, 2.5, 0.5);
        let velocity = |cell: usize| {
            let index = cells.index(cell);
            wanted * Vector3::from_fn(|k, _| (index[k] as f64 + 0.5) * cells.spacing[k])
        };
        let mut view = View {
            fraction: vec![1.0; cells.count()],
            velocity: (0..cells.count()).map(velocity).collect(),
            ..View::default()
        };
        let empty = cells.cell([2, 2, 2]);
        view.fraction[empty] = 0.1;
        for (cell, found) in gradients(&view, &cells).iter().enumerate() {
            let right = if cell == empty {
                Matrix3::zeros()
            } else {
                wanted
            };
            assert!((found - right).norm() < 1e-12, "{cell}");
        }
        let shear = Matrix3::new(0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        assert_eq!((shear_rate(&shear), rotation(&shear)), (2.0, Vector3::y()));
        let pure = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, -2.0));
        assert!((shear_rate(&pure) - 12.0_f64.sqrt()).abs() < 1e-14);
    }
}
