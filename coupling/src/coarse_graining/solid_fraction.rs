//! Solid fraction of the cells of a grid by exact volumes.

use super::{AveragerError, Geometry, Mesh, sphere_box_volume};
use colluvium_dem::Snapshot;

/// Share of each cell that free grains fill, by the exact volume of every sphere in every cell: the cells of a grid
/// that fills the box add up to the grains' volume to round-off. Axes that the geometry averages away span the box.
/// Order of the cells as of [`Mesh::points`].
///
/// # Errors
/// If the geometry has no cells that are boxes (points, cylinder).
pub fn solid_fractions(mesh: &Mesh, snapshot: &Snapshot) -> Result<Vec<f64>, AveragerError> {
    if matches!(
        mesh.geometry(),
        Geometry::Points(_) | Geometry::Cylinder { .. }
    ) {
        return Err(AveragerError::OutOfRange {
            key: "geometry",
            value: f64::NAN,
            allowed: "line, plane or grid: boxes",
        });
    }
    let (active, cells) = (mesh.active(), mesh.cells());
    let lengths = snapshot.domain.lengths();
    // Along an averaged axis a sphere lies whole in the one cell, wherever it is.
    const WHOLE: f64 = 1e300;
    let mut volumes = vec![0.0; mesh.points().len()];
    for grain in snapshot.grains.iter().filter(|g| !g.fixed) {
        let r = grain.radius;
        let images = |axis: usize| -> &[f64] {
            if active[axis] && snapshot.domain.periodic[axis] {
                &[0.0, -1.0, 1.0]
            } else {
                &[0.0]
            }
        };
        for x in images(0) {
            for y in images(1) {
                for z in images(2) {
                    let shift = [x * lengths[0], y * lengths[1], z * lengths[2]];
                    let centre: [f64; 3] =
                        std::array::from_fn(|axis| grain.position[axis] + shift[axis]);
                    let range = |axis: usize| {
                        if !active[axis] {
                            return 0..1;
                        }
                        let n = cells.count[axis] as f64;
                        let index = |x: f64| (x - cells.lower[axis]) / cells.size[axis];
                        let from = index(centre[axis] - r).floor().clamp(0.0, n);
                        let to = index(centre[axis] + r).ceil().clamp(from, n);
                        from as usize..to as usize
                    };
                    let face = |axis: usize, k: usize| {
                        if active[axis] {
                            cells.lower[axis] + cells.size[axis] * k as f64
                        } else if k == 0 {
                            -WHOLE
                        } else {
                            WHOLE
                        }
                    };
                    for k in range(2) {
                        for j in range(1) {
                            for i in range(0) {
                                let lower = [face(0, i), face(1, j), face(2, k)];
                                let upper = [face(0, i + 1), face(1, j + 1), face(2, k + 1)];
                                let at = (k * cells.count[1] + j) * cells.count[0] + i;
                                volumes[at] += sphere_box_volume(centre, r, lower, upper);
                            }
                        }
                    }
                }
            }
        }
    }
    let size: f64 = (0..3)
        .map(|axis| {
            if active[axis] {
                cells.size[axis]
            } else {
                lengths[axis]
            }
        })
        .product();
    volumes.iter_mut().for_each(|v| *v /= size);
    Ok(volumes)
}
