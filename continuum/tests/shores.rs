//! Ponds at rest over slopes that cut the cells: where the level surface meets the ground the pressure is ρ g times the depth.
use colluvium_continuum::column_collapse::{Collapse, CollapseCase, CollapseGround};
use colluvium_continuum::free_surface::{Contact, SpaceFlow, SurfaceFlow, SurfaceOptions, Terrain};
use colluvium_continuum::grid::{Axis, Boundary, Grid};
use colluvium_continuum::rheology::MuI;
use colluvium_continuum::terrain::{GridLines, Profile, Surface};

const ROUGH: Boundary = Boundary::NoSlip { velocity: 0.0 };
const SMOOTH: Boundary = Boundary::FreeSlip;
/// In cells, which are the unit of length here.
const DIAMETER: f64 = 1.0 / 3.0;

fn grains() -> MuI {
    MuI::new(0.32, 0.60, 0.4, DIAMETER, 1.0, 1.0)
}

fn precise() -> SurfaceOptions {
    let mut options = SurfaceOptions {
        growth: 1e9,
        ..SurfaceOptions::default()
    };
    options.solver.strain_rate_floor = 1e-7;
    options.solver.momentum_tolerance = 1e-9;
    options
}

fn cells_long(cells: usize, low: Boundary) -> Axis {
    Axis::Bounded {
        length: cells as f64,
        cells,
        low,
        high: SMOOTH,
    }
}

/// Largest |p − ρ g depth| over ρ g times a cell, and over the pressure itself, in cells whose centre lies deeper than a
/// tenth of a cell, and the largest speed.
fn misses(pressure: &[f64], row: usize, level: f64, speed: f64) -> [f64; 3] {
    let mut worst = [0.0_f64, 0.0, speed];
    let mut compared = 0;
    for (cell, &p) in pressure.iter().enumerate() {
        let exact = level - ((cell / row) as f64 + 0.5);
        if p >= 0.0 {
            worst[0] = worst[0].max((p - exact).abs());
            if exact > 0.1 {
                worst[1] = worst[1].max((p / exact - 1.0).abs());
                compared += 1;
            }
        }
    }
    assert!(compared > 5, "{compared} cells with a pressure");
    worst
}

/// The same of a pond 24 cells long over ground, under a surface.
fn pond_under(surface: &Profile, ground: &Profile, level: f64) -> [f64; 3] {
    let [columns, rows] = [24, 12];
    let fractions = (0..columns * rows).map(|cell| {
        let low = [cell % columns, cell / columns].map(|i| i as f64);
        let high = low.map(|x| x + 1.0);
        (surface.area_in(low, high) - ground.area_in(low, high)).max(0.0)
    });
    let axes = [cells_long(columns, SMOOTH), cells_long(rows, ROUGH)];
    let terrain = Terrain {
        shape: ground.clone(),
        origin: [0.0; 2],
        contact: Contact::NoSlip,
        rise: [0; 2],
    };
    let mut flow: SurfaceFlow<MuI> = SurfaceFlow::over_ground(
        Grid::with_moving_surface(axes).unwrap(),
        &terrain,
        fractions.collect(),
        grains(),
        [0.0, -1.0],
        precise(),
    )
    .unwrap();
    let before = flow.volume();
    for _ in 0..5 {
        flow.step(f64::INFINITY).unwrap();
    }
    assert!((flow.volume() / before - 1.0).abs() < 1e-13);
    misses(&flow.state().pressure, columns, level, flow.max_speed())
}

/// The same over a slope whose shore is at x = 16 + shift, with a surface that ends where it meets the ground, or cell by cell with
/// what stands out of the ground taken off, so that it is not level there.
fn pond(slope: f64, level: f64, shift: f64, is_level: bool) -> [f64; 3] {
    let shore = 16.0 + shift;
    let height = |x: f64| level + slope * (x - shore);
    let ends = [-30.0, 60.0];
    let ground = ends.map(|x| [x, height(x)]).to_vec();
    let surface = if is_level {
        vec![[ends[0], level], [shore, level], [ends[1], height(ends[1])]]
    } else {
        ends.map(|x| [x, level]).to_vec()
    };
    let [surface, ground] = [surface, ground].map(|line| Profile::new(line).unwrap());
    pond_under(&surface, &ground, level)
}

/// Slopes of 0.1 to 1.7, the surface at four heights and two places in the cells: nothing moves, and the pressure is the
/// exact one to 1e-9 of itself and of ρ g times a cell. Where what stands out of the ground is taken off the matter beside
/// it the surface of the last cell is not level, and the pressure not that of one: negative control.
#[test]
fn pressure_at_shores_is_that_of_the_depth() {
    let mut control = 0.0_f64;
    let mut failures = Vec::new();
    for slope in [0.1, 0.2, 0.45, 0.8, 1.0, 1.7] {
        for level in [4.05, 4.3, 4.55, 4.8] {
            for shift in [0.0, 0.37] {
                let [miss, relative, speed] = pond(slope, level, shift, true);
                println!("{slope} {level} {shift}: {miss:.2e} {relative:.2e} {speed:.1e}");
                if miss > 1e-9 || relative > 1e-9 || speed > 1e-6 * DIAMETER.sqrt() {
                    failures.push((slope, level, shift, miss, relative, speed));
                }
                control = control.max(pond(slope, level, shift, false)[1]);
            }
        }
    }
    println!("not level: {control:e}");
    assert!(failures.is_empty(), "{failures:?}");
    assert!(control > 1e-3, "{control:e}");
}

/// Points of a line with the one where it crosses a level, if there is one, between them.
fn with_crossings(points: &[[f64; 2]], level: f64) -> Vec<[f64; 2]> {
    let mut all = vec![points[0]];
    for pair in points.windows(2) {
        let [from, to] = [pair[0][1] - level, pair[1][1] - level];
        if from * to < 0.0 {
            let part = from / (from - to);
            all.push([pair[0][0] + part * (pair[1][0] - pair[0][0]), level]);
        }
        all.push(pair[1]);
    }
    all
}

/// The same over a line of ground with a level surface, which ends where it meets the ground, or with one that rises by a part of
/// its way, which is not at rest.
fn level_pond(points: Vec<[f64; 2]>, level: f64) -> [f64; 3] {
    tilted_pond(points, level, 0.0)
}

fn tilted_pond(points: Vec<[f64; 2]>, level: f64, rise: f64) -> [f64; 3] {
    let surface = with_crossings(&points, level);
    let surface = surface
        .into_iter()
        .map(|[x, z]| [x, z.max(level + rise * (x - 12.0))]);
    let surface = Profile::new(surface.collect()).unwrap();
    pond_under(&surface, &Profile::new(points).unwrap(), level)
}

/// Ground that is curved, a valley and a hill, of twenty pieces a cell: within a cell it is what it is, not a plane. (Under planes
/// of matter and ground together the mean is 3.0 and 1.7 %, the worst 9.9 and 7.6 %; with a plane of ground in each cell 0.08 and 0.04,
/// 0.40 and 0.21 %.)
#[test]
fn pressure_at_shores_of_curved_ground() {
    let valley = |r: f64| 1.2 + r * r / 25.0;
    let hill = |r: f64| 7.5 - r * r / 20.0;
    for (name, height) in [("valley", &valley as &dyn Fn(f64) -> f64), ("hill", &hill)] {
        let mut worst = [0.0_f64; 3];
        for level in [4.05, 4.3, 4.55, 4.8, 5.1] {
            for shift in [0.0, 0.21, 0.43, 0.68] {
                let x = (-400..=640).map(|i| 0.05 * f64::from(i));
                let points: Vec<_> = x.map(|x| [x, height(x - 12.0 - shift)]).collect();
                let found = level_pond(points, level);
                worst = std::array::from_fn(|n| worst[n].max(found[n]));
            }
        }
        let [miss, relative, speed] = worst;
        println!("{name}: {miss:.2e} {relative:.2e} {speed:.1e}");
        assert!(
            miss < 1e-9 && relative < 1e-9,
            "{name} {miss:e} {relative:e}"
        );
        assert!(speed < 1e-6 * DIAMETER.sqrt(), "{name} {speed:e}");
    }
}

/// Random numbers from 0 to 1.
fn numbers(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / f64::from(1_u32 << 31)
    }
}

/// Ground of kinks at random heights, with slopes up to 2.7, islands and ridges narrower than a cell among them. (With a plane of ground in each cell the pressure beside kinks 3.7 cells apart was up to 50 % off and
/// matter moved.)
#[test]
fn pressure_at_shores_among_kinks() {
    for spacing in [1.3, 2.3, 3.7] {
        let mut worst = [0.0_f64; 3];
        for seed in 0..12_u64 {
            let mut random = numbers(17 + 1000 * seed + (10.0 * spacing) as u64);
            let points = (0..(70.0 / spacing) as u32)
                .map(|n| [spacing * f64::from(n) - 20.0, 2.0 + 3.5 * random()]);
            let level = 4.05 + 0.3 * (seed % 4) as f64;
            let found = level_pond(points.collect(), level);
            println!("{spacing} {seed}: {found:?}");
            worst = std::array::from_fn(|n| worst[n].max(found[n]));
        }
        let [miss, relative, speed] = worst;
        println!("{spacing}: {miss:.2e} {relative:.2e} {speed:.1e}");
        // A surface that rises by a fiftieth has not the pressure of a level one: negative control.
        let mut random = numbers(17);
        let points = (0..(70.0 / spacing) as u32)
            .map(|n| [spacing * f64::from(n) - 20.0, 2.0 + 3.5 * random()]);
        let [control, ..] = tilted_pond(points.collect(), 4.35, 0.02);
        println!("rising: {control:e}");
        assert!(control > 1e-3, "{control:e}");
        assert!(
            miss < 1e-9 && relative < 1e-9,
            "{spacing} {miss:e} {relative:e}"
        );
        assert!(speed < 1e-6 * DIAMETER.sqrt(), "{spacing} {speed:e}");
    }
}

/// The part of a convex polygon in space above a level, or below it.
fn clipped(polygon: &[[f64; 3]], level: f64, above: bool) -> Vec<[f64; 3]> {
    let height = |corner: [f64; 3]| (corner[2] - level) * if above { 1.0 } else { -1.0 };
    let mut left = Vec::new();
    for (n, &from) in polygon.iter().enumerate() {
        let to = polygon[(n + 1) % polygon.len()];
        let (a, b) = (height(from), height(to));
        if a > 0.0 {
            left.push(from);
        }
        if (a > 0.0) != (b > 0.0) {
            left.push(std::array::from_fn(|k| {
                from[k] + a / (a - b) * (to[k] - from[k])
            }));
        }
    }
    left
}

/// The higher one of ground and a level.
fn with_level(ground: &Surface, level: f64) -> Surface {
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for corners in ground.triangles() {
        let triangle = corners.map(|c| ground.vertices()[c]);
        for above in [true, false] {
            let mut part = clipped(&triangle, level, above);
            if !above {
                part.iter_mut().for_each(|corner| corner[2] = level);
            }
            let first = vertices.len();
            triangles.extend((2..part.len()).map(|n| [first, first + n - 1, first + n]));
            vertices.extend(part);
        }
    }
    Surface::new(vertices, triangles).unwrap()
}

/// What a pond in space over ground misses, ten cells by eight.
fn pond_in_space(ground: &Surface, level: f64) -> [f64; 3] {
    let cells = [10, 8, 7];
    let lines = GridLines {
        origin: [0.0; 3],
        spacing: [1.0; 3],
        cells,
    };
    let surface = with_level(ground, level);
    let [under, below] = [ground, &surface].map(|s| s.cut(&lines, false).unwrap());
    let fractions = (0..cells.iter().product()).map(|n: usize| {
        let index = [
            n % cells[0],
            n / cells[0] % cells[1],
            n / (cells[0] * cells[1]),
        ];
        (under.volume_fraction(index) - below.volume_fraction(index)).max(0.0)
    });
    let [x, y, z] = cells;
    let axes = [
        cells_long(x, SMOOTH),
        cells_long(y, SMOOTH),
        cells_long(z, ROUGH),
    ];
    let terrain = Terrain {
        shape: ground.clone(),
        origin: [0.0; 3],
        contact: Contact::NoSlip,
        rise: [0; 3],
    };
    let mut flow: SpaceFlow<MuI> = SpaceFlow::over_ground(
        Grid::with_moving_surface(axes).unwrap(),
        &terrain,
        fractions.collect(),
        grains(),
        [0.0, 0.0, -1.0],
        precise(),
    )
    .unwrap();
    for _ in 0..3 {
        flow.step(f64::INFINITY).unwrap();
    }
    let row = cells[0] * cells[1];
    misses(&flow.state().pressure, row, level, flow.max_speed())
}

/// In space: a level surface over an incline oblique to the grid.
#[test]
fn pressure_at_shores_in_space() {
    for (slope, level) in [([0.5, 0.3], 3.8), ([0.5, 0.3], 3.3), ([0.4, -0.9], 3.55)] {
        let height = |[x, y]: [f64; 2]| 2.6 + slope[0] * (x - 5.0) + slope[1] * (y - 4.0);
        let square = [[-2.0, -2.0], [12.0, -2.0], [12.0, 12.0], [-2.0, 12.0]];
        let corners = square.map(|at| [at[0], at[1], height(at)]).to_vec();
        let ground = Surface::new(corners, vec![[0, 1, 2], [0, 2, 3]]).unwrap();
        let [miss, relative, speed] = pond_in_space(&ground, level);
        println!("{slope:?} {level}: {miss:e} {relative:e} {speed:e}");
        assert!(relative < 1e-9 && miss < 1e-9 && speed < 1e-6 * DIAMETER.sqrt());
    }
}

/// In space: facets of random heights, with slopes up to 1.4. (Where they are 1.7 cells wide, steeper than 2 and leave pores within cells
/// the pressure of one of four ponds is exact; the others miss by 0.1, 7 and 27 % in the worst cell.)
#[test]
fn pressure_at_shores_among_facets() {
    const WIDTH: f64 = 3.1;
    const COUNT: usize = 5;
    for seed in 0..4_u32 {
        let mut random = numbers(60 + 1000 * u64::from(seed));
        let vertices = (0..COUNT * COUNT).map(|n| {
            let [x, y] = [n % COUNT, n / COUNT].map(|i| WIDTH * i as f64 - 2.0);
            [x, y, 1.5 + 3.0 * random()]
        });
        let squares = (0..COUNT * COUNT).filter(|n| (n + 1) % COUNT > 0 && n / COUNT + 1 < COUNT);
        let triangles =
            squares.flat_map(|n| [[n, n + 1, n + COUNT + 1], [n, n + COUNT + 1, n + COUNT]]);
        let ground = Surface::new(vertices.collect(), triangles.collect()).unwrap();
        let [miss, relative, speed] = pond_in_space(&ground, 3.15 + 0.3 * f64::from(seed));
        println!("{seed}: {miss:.2e} {relative:.2e} {speed:.1e}");
        assert!(relative < 1e-9 && miss < 1e-9 && speed < 1e-6 * DIAMETER.sqrt());
    }
}

/// Front of a column of height 1 where it rests, and when (in √(height/gravity)), or at `until`.
fn front_of_column(
    points: Vec<[f64; 2]>,
    aspect: f64,
    [cells, length]: [usize; 2],
    until: f64,
) -> (f64, Option<f64>) {
    let case = CollapseCase {
        overhang_degrees: 0.0,
        aspect,
        height: 1.0,
        gravity: 1.0,
        rheology: MuI::new(0.32, 0.60, 0.4, 1.0 / 30.0, 1.0, 1.0),
        cells,
        length_scaled: length as f64,
    };
    let ground = CollapseGround {
        profile: Profile::new(points).unwrap(),
        contact: Contact::NoSlip,
    };
    let options = SurfaceOptions::default();
    let mut collapse = Collapse::over_ground(&case, &options, &ground, None).unwrap();
    let mut time = None;
    while time.is_none() && collapse.time() < until * (1.0 - 1e-9) {
        let step = collapse.step(until).unwrap();
        time = collapse.is_at_rest(&step).then(|| collapse.time());
    }
    (collapse.front(0.01).position, time)
}

/// Columns that run out over a step down, down a slope and up one, against runs of before: fast matter is left as it is, and fronts are
/// those under planes of matter and ground together. Below the step thin matter still moves at t = 12. While all that follows an unknown
/// weighed on it fronts were 6.118, 4.325 and 3.615; the first lay between 6.089 and 6.147 by how closely linear systems are solved.
#[test]
fn run_outs_over_ground_are_as_before() {
    let step = vec![[0.0, 2.0], [3.1, 2.0], [3.1, 1.5], [9.0, 1.5]];
    let down = vec![[0.0, 0.0], [3.1, 0.0], [20.0, -3.0]];
    let up = vec![[0.0, 0.0], [3.1, 0.0], [20.0, 5.0]];
    for (points, grid, rests, expected, within) in [
        (step, [90, 7], false, 5.854, 7e-3),
        (down, [64, 5], true, 4.286, 5e-3),
        (up, [64, 5], true, 3.615, 5e-3),
    ] {
        let (front, time) = front_of_column(points, 0.5, grid, 12.0);
        println!("{front} {expected} {time:?}");
        assert!(
            (front / expected - 1.0).abs() < within,
            "{front} {expected}"
        );
        assert!(!rests || time.is_some(), "{expected}");
    }
}

/// The same line with more points on it is the same ground but for round-off.
#[test]
fn run_outs_do_not_part_by_round_off() {
    let heights = [1.0, 1.0, 1.0, 0.875, 0.625, 0.25, 0.125, 0.0, 0.0];
    let line: Vec<[f64; 2]> = (0..)
        .zip(heights)
        .map(|(n, z)| [0.5 * f64::from(n), z])
        .collect();
    let front = |points| front_of_column(points, 1.0, [40, 4], 3.0).0;
    let few = front(line.clone());
    for part in [0.1, 0.35, 0.65] {
        let mut more = vec![line[0]];
        for pair in line.windows(2) {
            more.push([0, 1].map(|k| pair[0][k] + part * (pair[1][k] - pair[0][k])));
            more.push(pair[1]);
        }
        let many = front(more);
        println!("{part}: {:e}", many / few - 1.0);
        assert!((many / few - 1.0).abs() < 1e-6, "{many} {few}");
    }
}
