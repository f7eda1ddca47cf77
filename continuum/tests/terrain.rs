//! Cells cut by ground: volumes, faces and walls of shapes whose cuts are known.
use colluvium_continuum::terrain::{CutCells, GridLines, HeightRaster, Profile, Surface};

fn plane_grid(cells: [usize; 2], length: [f64; 2]) -> GridLines<2> {
    GridLines {
        origin: [0.0, 0.0],
        spacing: [length[0] / cells[0] as f64, length[1] / cells[1] as f64],
        cells,
    }
}

fn space_grid(cells: [usize; 3], length: [f64; 3]) -> GridLines<3> {
    GridLines {
        origin: [0.0; 3],
        spacing: std::array::from_fn(|a| length[a] / cells[a] as f64),
        cells,
    }
}

/// The index of a cell; x runs fastest.
fn index_of<const N: usize>(lines: &GridLines<N>, number: usize) -> [usize; N] {
    let mut rest = number;
    lines.cells.map(|cells| {
        let along = rest % cells;
        rest /= cells;
        along
    })
}

/// Every cell closes, fractions lie between 0 and 1, and full cells are closed off.
fn closes<const N: usize>(cut: &CutCells<N>) {
    let lines = cut.lines();
    for number in 0..lines.count() {
        let index = index_of(lines, number);
        let fraction = cut.volume_fraction(index);
        assert!((0.0..=1.0).contains(&fraction));
        let largest = (0..N).map(|a| lines.face_area(a)).fold(0.0, f64::max);
        for miss in cut.closure(index) {
            assert!(
                miss.abs() < 1e-12 * largest,
                "{index:?}: {:?} {fraction}",
                cut.closure(index)
            );
        }
        for axis in 0..N {
            for side in [0, 1] {
                let mut face = index;
                face[axis] += side;
                let aperture = cut.aperture(axis, face);
                assert!((0.0..=1.0).contains(&aperture));
                assert!(fraction > 0.0 || aperture == 0.0);
            }
        }
    }
}

fn wall_area<const N: usize>(cut: &CutCells<N>) -> f64 {
    let lines = cut.lines();
    let mut total = 0.0;
    for number in 0..lines.count() {
        let index = index_of(lines, number);
        total += cut.wall(index).map_or(0.0, |wall| wall.area);
    }
    total
}

#[test]
fn incline_cuts_cells_exactly() {
    // z = 0.3 + 0.5 x over 2 × 2, by grids that fit and that do not.
    let incline = Profile::new(vec![[0.0, 0.3], [2.0, 1.3]]).unwrap();
    for cells in [[4, 4], [7, 5], [1, 1], [33, 20]] {
        let cut = incline.cut(&plane_grid(cells, [2.0, 2.0])).unwrap();
        closes(&cut);
        assert!((cut.free_volume() - (4.0 - 0.6 - 1.0)).abs() < 1e-13);
        assert!((wall_area(&cut) - 5.0_f64.sqrt()).abs() < 1e-13);
    }
    let cut = incline.cut(&plane_grid([4, 4], [2.0, 2.0])).unwrap();
    // The first cell: ground from 0.3 to above 0.5 at x = 0.4.
    let free = 0.5 * 0.4 * 0.2;
    assert!((cut.volume_fraction([0, 0]) - free / 0.25).abs() < 1e-14);
    assert!((cut.aperture(0, [0, 0]) - 0.4).abs() < 1e-14);
    assert_eq!(cut.aperture(0, [1, 0]), 0.0);
    assert!((cut.aperture(1, [0, 1]) - 0.8).abs() < 1e-14);
    let wall = cut.wall([0, 0]).unwrap();
    let normal = wall.normal();
    let length = 1.25_f64.sqrt();
    assert!((normal[0] + 0.5 / length).abs() < 1e-14 && (normal[1] - 1.0 / length).abs() < 1e-14);
    assert!((wall.centre[0] - 0.2).abs() < 1e-14 && (wall.centre[1] - 0.4).abs() < 1e-14);
}

#[test]
fn floors_and_cliffs_on_grid_lines_close_their_cells() {
    // A cliff of one cell's width and height steps, on grid lines and between them.
    for (edge, top) in [(1.0, 1.0), (1.1, 1.0), (1.0, 1.1), (1.05, 0.95)] {
        let cliff = Profile::new(vec![[0.0, top], [edge, top], [edge, 0.5], [2.0, 0.5]]).unwrap();
        let trough = Profile::new(vec![[0.0, 0.5], [edge, 0.5], [edge, top], [2.0, top]]).unwrap();
        for (profile, ground) in [
            (cliff, top * edge + 0.5 * (2.0 - edge)),
            (trough, 0.5 * edge + top * (2.0 - edge)),
        ] {
            let cut = profile.cut(&plane_grid([4, 4], [2.0, 2.0])).unwrap();
            closes(&cut);
            assert!((cut.free_volume() - (4.0 - ground)).abs() < 1e-13);
            assert!((wall_area(&cut) - (2.0 + top - 0.5)).abs() < 1e-13);
            assert_eq!(
                cut.volume_fraction([3, 0]) + cut.volume_fraction([0, 0]),
                0.0
            );
        }
    }
}

#[test]
fn overhang_leaves_the_hollow_free() {
    // A ledge 0.6 to 1.0 high that reaches over a hollow 0.7 wide.
    let ledge = Profile::new(vec![
        [0.0, 1.0],
        [1.4, 1.0],
        [1.4, 0.6],
        [0.7, 0.6],
        [0.7, 0.1],
        [2.0, 0.1],
    ])
    .unwrap();
    for cells in [[4, 4], [9, 7], [20, 20]] {
        let cut = ledge.cut(&plane_grid(cells, [2.0, 2.0])).unwrap();
        closes(&cut);
        let ground = 0.7 * 1.0 + 0.7 * 0.4 + 1.3 * 0.1;
        assert!((cut.free_volume() - (4.0 - ground)).abs() < 1e-12);
        assert!((wall_area(&cut) - (1.4 + 0.4 + 0.7 + 0.5 + 1.3)).abs() < 1e-12);
    }
    // Inside the hollow and inside the ledge.
    let cut = ledge.cut(&plane_grid([20, 20], [2.0, 2.0])).unwrap();
    assert!((cut.volume_fraction([10, 3]) - 1.0).abs() < 1e-14);
    assert_eq!(cut.volume_fraction([10, 7]), 0.0);
}

#[test]
fn curved_profile_converges_to_its_integral() {
    let height = |x: f64| 0.6 + 0.3 * (3.0 * x).sin();
    let exact = 2.0 * 1.5 - (0.6 * 2.0 + 0.1 * (1.0 - 6.0_f64.cos()));
    let misses = [16, 64].map(|intervals| {
        let profile = Profile::of_height([0.0, 2.0], intervals, height).unwrap();
        let cut = profile.cut(&plane_grid([13, 11], [2.0, 1.5])).unwrap();
        closes(&cut);
        (cut.free_volume() - exact).abs()
    });
    let order = (misses[0] / misses[1]).log2() / 2.0;
    assert!(order > 1.9, "{order} {misses:?}");
}

fn plane_in_space() -> HeightRaster {
    // z = 0.2 + 0.3 x + 0.1 y on 3 × 2.
    let heights = (0..5)
        .flat_map(|row| {
            (0..4).map(move |column| 0.2 + 0.3 * f64::from(column) + 0.05 * f64::from(row))
        })
        .collect();
    HeightRaster {
        origin: [0.0, 0.0],
        spacing: [1.0, 0.5],
        points: [4, 5],
        heights,
    }
}

#[test]
fn raster_of_a_plane_is_that_plane() {
    let surface = plane_in_space().surface().unwrap();
    for cells in [[3, 2, 4], [5, 7, 3], [1, 1, 1]] {
        let cut = surface
            .cut(&space_grid(cells, [3.0, 2.0, 2.0]), false)
            .unwrap();
        closes(&cut);
        // Mean height 0.2 + 0.45 + 0.1.
        assert!((cut.free_volume() - 6.0 * (2.0 - 0.75)).abs() < 1e-12);
        let area = 6.0 * (1.0 + 0.09 + 0.01_f64).sqrt();
        assert!((wall_area(&cut) - area).abs() < 1e-12);
    }
}

/// A raster ends at its edges along both axes: beyond them there is no ground to be taken for the last heights.
#[test]
fn rasters_end_at_their_edges() {
    let raster = HeightRaster {
        origin: [0.0, 1.0],
        spacing: [0.5, 0.5],
        points: [3, 3],
        heights: (0..9).map(f64::from).collect(),
    };
    let row = |y: f64| raster.profile(y).map(|line| line.points()[0][1]);
    // The edges themselves, and what round-off makes of them, lie on it.
    assert_eq!(row(1.0), Ok(0.0));
    assert_eq!(row(2.0 + 1e-12), Ok(6.0));
    for y in [0.9, 2.1, f64::NAN] {
        let message = row(y).unwrap_err().to_string();
        assert!(
            message.contains("`terrain.y`") && message.contains("1 to 2 m"),
            "{message}"
        );
    }
    let beyond = |x: f64| {
        let line = raster.profile(1.5).unwrap();
        line.cut(&plane_grid([4, 10], [x, 10.0])).map(|_| ())
    };
    assert_eq!(beyond(1.0), Ok(()));
    assert!(beyond(1.1).is_err());
    let surface = raster.surface().unwrap();
    // The same line from its triangles, its edges included.
    for y in [1.0, 1.0 - 1e-12, 1.5, 2.0, 2.0 + 1e-12] {
        let [of_rows, of_triangles] = [raster.profile(y), surface.profile(y)].map(Result::unwrap);
        for x in [0.25, 0.5, 0.75] {
            let heights = [&of_rows, &of_triangles].map(|line| line.height_at(x).unwrap());
            assert!(
                (heights[0] - heights[1]).abs() < 1e-12,
                "{x} {y} {heights:?}"
            );
        }
        assert_eq!(
            of_rows.points().first(),
            of_triangles.points().first(),
            "{y}"
        );
        assert_eq!(of_rows.points().last(), of_triangles.points().last(), "{y}");
    }
    assert!(surface.profile(0.99).is_err() && surface.profile(2.01).is_err());
    for (low, size, spans) in [(1.0, 1.0, true), (0.9, 1.0, false), (1.0, 1.1, false)] {
        let lines = GridLines {
            origin: [0.0, low, 0.0],
            cells: [4, 4, 10],
            spacing: [0.25, size / 4.0, 1.0],
        };
        assert_eq!(surface.cut(&lines, false).is_ok(), spans, "{low} {size}");
    }
}

/// Space cut by terrain that does not vary along y is the plane cut, cell by cell.
#[test]
fn plane_and_space_agree() {
    let height = |x: f64| 0.5 + 0.4 * (2.5 * x).sin();
    let profile = Profile::of_height([0.0, 2.0], 10, height).unwrap();
    let heights: Vec<f64> = (0..3)
        .flat_map(|_| profile.points().iter().map(|p| p[1]))
        .collect();
    let raster = HeightRaster {
        origin: [0.0, 0.0],
        spacing: [0.2, 0.5],
        points: [11, 3],
        heights,
    };
    assert!((raster.profile(0.6).unwrap().points()[3][1] - profile.points()[3][1]).abs() < 1e-15);
    let plane = profile.cut(&plane_grid([7, 5], [2.0, 1.0])).unwrap();
    let space = raster
        .surface()
        .unwrap()
        .cut(&space_grid([7, 3, 5], [2.0, 1.0, 1.0]), false)
        .unwrap();
    closes(&plane);
    closes(&space);
    for i in 0..7 {
        for k in 0..5 {
            for j in 0..3 {
                let (a, b) = (
                    plane.volume_fraction([i, k]),
                    space.volume_fraction([i, j, k]),
                );
                assert!((a - b).abs() < 1e-12, "{i} {j} {k}: {a} {b}");
                let pairs = [
                    (plane.aperture(0, [i, k]), space.aperture(0, [i, j, k])),
                    (plane.aperture(1, [i, k]), space.aperture(2, [i, j, k])),
                    (a, space.aperture(1, [i, j, k])),
                ];
                for (a, b) in pairs {
                    assert!((a - b).abs() < 1e-12, "{i} {j} {k}: {a} {b}");
                }
            }
        }
    }
}

/// A closed box of side lengths a, turned about z and lifted off the floor: its own volume and area,
/// wherever the grid's planes lie; and on grid planes too.
fn block(size: [f64; 3], at: [f64; 3], turn: f64) -> Surface {
    let (sine, cosine) = turn.sin_cos();
    let vertices = (0..8)
        .map(|n| {
            let corner = [n & 1, n >> 1 & 1, n >> 2 & 1];
            let [x, y, z]: [f64; 3] = std::array::from_fn(|a| size[a] * f64::from(corner[a]));
            [
                at[0] + cosine * x - sine * y,
                at[1] + sine * x + cosine * y,
                at[2] + z,
            ]
        })
        .collect();
    let squares = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    let triangles = squares
        .iter()
        .flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]])
        .collect();
    Surface::new(vertices, triangles).unwrap()
}

#[test]
fn closed_bodies_keep_volume_and_area() {
    for (size, at, turn) in [
        ([0.7, 0.5, 0.4], [0.8, 0.6, 0.55], 0.4),
        ([0.7, 0.5, 0.4], [0.8, 0.6, 0.55], 0.0),
        ([0.5, 0.5, 0.5], [0.5, 0.5, 0.5], 0.0),
    ] {
        let body = block(size, at, turn);
        for cells in [[8, 8, 8], [5, 7, 6]] {
            let cut = body.cut(&space_grid(cells, [2.0; 3]), true).unwrap();
            closes(&cut);
            let volume = size.iter().product::<f64>();
            assert!((cut.free_volume() - (8.0 - volume)).abs() < 1e-12);
            let area = 2.0 * (size[0] * size[1] + size[1] * size[2] + size[2] * size[0]);
            assert!((wall_area(&cut) - area).abs() < 1e-12, "{size:?} {cells:?}");
        }
    }
}

/// Rough terrain: every cell closes, and the volume is that under the triangles.
#[test]
fn rough_terrain_closes_everywhere() {
    let points = [17, 13];
    let heights: Vec<f64> = (0..points[1])
        .flat_map(|row| {
            (0..points[0]).map(move |column| {
                // Broad hills and noise of a fixed kind.
                let noise = (12.9898 * column as f64 + 78.233 * row as f64).sin() * 43_758.545_3;
                0.8 + 0.3 * (0.5 * column as f64).sin() * (0.4 * row as f64).cos()
                    + 0.2 * (noise - noise.floor())
            })
        })
        .collect();
    // Far from the origin, as map coordinates are.
    let raster = HeightRaster {
        origin: [431_000.0, 5_020_000.0],
        spacing: [0.25, 0.25],
        points,
        heights,
    };
    let surface = raster.surface().unwrap();
    let ground: f64 = surface
        .triangles()
        .iter()
        .map(|t| {
            let mean = t.iter().map(|c| surface.vertices()[*c][2]).sum::<f64>() / 3.0;
            mean * 0.5 * 0.25 * 0.25
        })
        .sum();
    let lines = GridLines {
        origin: [431_000.0, 5_020_000.0, 0.0],
        spacing: [4.0 / 11.0, 3.0 / 10.0, 0.2],
        cells: [11, 10, 10],
    };
    let cut = surface.cut(&lines, false).unwrap();
    closes(&cut);
    assert!((cut.free_volume() - (4.0 * 3.0 * 2.0 - ground)).abs() < 1e-8);
}

#[test]
fn bad_terrain_is_refused_by_name() {
    let narrow = Profile::new(vec![[0.5, 0.3], [2.0, 1.3]]).unwrap();
    let message = narrow
        .cut(&plane_grid([4, 4], [2.0, 2.0]))
        .unwrap_err()
        .to_string();
    assert!(
        message.contains("terrain.profile") && message.contains("0.5 and 2"),
        "{message}"
    );
    assert!(Profile::new(vec![[0.0, 0.0]]).is_err());
    assert!(Profile::new(vec![[0.0, f64::NAN], [1.0, 0.0]]).is_err());
    let mut holed = plane_in_space();
    holed.heights[3] = f64::NAN;
    let message = holed.surface().unwrap_err().to_string();
    assert!(
        message.contains("terrain.heights") && message.contains("holes"),
        "{message}"
    );
    let beyond = plane_in_space().surface().unwrap();
    let message = beyond
        .cut(&space_grid([3, 3, 3], [3.5, 2.0, 2.0]), false)
        .unwrap_err()
        .to_string();
    assert!(
        message.contains("terrain.triangles") && message.contains("3.5"),
        "{message}"
    );
    let broken = Surface::new(vec![[0.0; 3]; 3], vec![[0, 1, 3]]);
    assert!(broken.unwrap_err().to_string().contains("below 3"));
}
