//! Material with a moving free surface against exact solutions: rest, free fall, Bagnold flow with
//! the surface inside a cell, standing waves.
use std::f64::consts::PI;

use colluvium_continuum::free_surface::plane::Plane;
use colluvium_continuum::free_surface::{SurfaceFlow, SurfaceOptions};
use colluvium_continuum::grid::{Axis, Boundary, Grid};
use colluvium_continuum::rheology::MuI;
use colluvium_continuum::wall_friction::{SideWalls, WallFriction};

const ROUGH: Boundary = Boundary::NoSlip { velocity: 0.0 };
const SMOOTH: Boundary = Boundary::FreeSlip;

/// μ_s 0.32, Δμ 0.28, I_0 0.4 in natural units.
fn grains(diameter: f64) -> MuI {
    MuI::new(0.32, 0.60, 0.4, diameter, 1.0, 1.0)
}

fn frictionless() -> MuI {
    MuI::new(0.0, 0.0, 0.4, 0.03, 1.0, 1.0)
}

fn bounded(length: f64, cells: usize, low: Boundary, high: Boundary) -> Axis {
    Axis::Bounded {
        length,
        cells,
        low,
        high,
    }
}

/// Settings under which rest can be told from creep.
fn precise(largest_step: f64) -> SurfaceOptions {
    let mut options = SurfaceOptions {
        largest_step,
        growth: 1e9,
        ..SurfaceOptions::default()
    };
    options.solver.strain_rate_floor = 1e-7;
    options.solver.momentum_tolerance = 1e-9;
    options
}

/// Fractions below a height h(x), sampled finely along x and exact along z.
fn below(columns: usize, rows: usize, spacing: f64, height: impl Fn(f64) -> f64) -> Vec<f64> {
    let samples = 200;
    (0..columns * rows)
        .map(|cell| {
            let (i, k) = (cell % columns, cell / columns);
            let filled = (0..samples).map(|s| {
                let x = (i as f64 + (s as f64 + 0.5) / samples as f64) * spacing;
                (height(x) / spacing - k as f64).clamp(0.0, 1.0)
            });
            filled.sum::<f64>() / samples as f64
        })
        .collect()
}

/// A box filled up to a plane normal to gravity, which is tilted against the grid: nothing moves
/// and the pressure is ρ g times the depth, to round-off, wherever the surface cuts the cells.
#[test]
fn plane_surfaces_normal_to_gravity_rest_exactly() {
    for tilt in [0.0_f64, 0.1, 0.25] {
        for cells in [16, 32] {
            let h = 1.0 / cells as f64;
            let axis = bounded(1.0, cells, ROUGH, ROUGH);
            let gravity = [tilt.sin(), -tilt.cos()];
            let up = [-gravity[0], -gravity[1], 0.0];
            let level = 0.5 * up[0] + 0.52 * up[1];
            let depth = |x: f64, z: f64| level - up[0] * x - up[1] * z;
            let fractions = (0..cells * cells)
                .map(|cell| {
                    let (x, z) = ((cell % cells) as f64 * h, (cell / cells) as f64 * h);
                    let plane = Plane {
                        normal: up,
                        offset: depth(x, z) / h,
                    };
                    plane.volume_in([0.0; 3], [1.0; 3])
                })
                .collect();
            let mut flow = SurfaceFlow::at_rest(
                Grid::with_moving_surface([axis; 2]).unwrap(),
                fractions,
                grains(1.0 / 30.0),
                gravity,
                precise(0.05),
            )
            .unwrap();
            for _ in 0..10 {
                flow.step(f64::INFINITY).unwrap();
            }
            assert!(
                flow.max_speed() < 1e-8,
                "{tilt} {cells} {:e}",
                flow.max_speed()
            );
            for (cell, p) in flow.state().pressure.iter().enumerate() {
                let centre = |n: usize| (n as f64 + 0.5) * h;
                let exact = depth(centre(cell % cells), centre(cell / cells));
                let miss = (p - exact).abs();
                assert!(*p < 0.0 || miss < 1e-9 * h, "{tilt} {cells} {miss:e}");
            }
        }
    }
}

/// A pile on a rough floor between smooth walls, under a surface h(x).
fn pile(cells: usize, largest_step: f64, height: impl Fn(f64) -> f64) -> SurfaceFlow<MuI> {
    let spacing = 3.0 / cells as f64;
    let rows = cells / 4;
    SurfaceFlow::at_rest(
        Grid::with_moving_surface([
            bounded(3.0, cells, SMOOTH, SMOOTH),
            bounded(0.75, rows, ROUGH, SMOOTH),
        ])
        .unwrap(),
        below(cells, rows, spacing, height),
        grains(1.0 / 30.0),
        [0.0, -1.0],
        precise(largest_step),
    )
    .unwrap()
}

/// Slopes of 0.2 and less under μ_s = 0.32, with a toe that thins out to nothing: at rest from the
/// first step, toe included, for small steps and large ones. Creep is linear in ε: with ε = 1e-7
/// √(g/H) it stays below 1e-6 √(g d).
#[test]
fn piles_below_repose_rest() {
    let bound = 1e-6 * (1.0_f64 / 30.0).sqrt();
    for largest_step in [0.05, 1.0] {
        let mut wedge = pile(48, largest_step, |x| 0.5 - 0.2 * (x - 0.07));
        let mut waves = pile(48, largest_step, |x| 0.4 + 0.1 * (2.7 * x + 0.3).sin());
        for _ in 0..20 {
            for flow in [&mut wedge, &mut waves] {
                let step = flow.step(f64::INFINITY).unwrap();
                assert!(step.max_speed < bound, "{:e}", step.max_speed);
            }
        }
    }
}

/// Negative control: a slope of 0.4, beyond tan(asin μ_s) = 0.338, moves.
#[test]
fn pile_above_repose_flows() {
    let mut wedge = pile(48, 0.05, |x| 0.5 - 0.4 * (x - 0.07));
    let step = wedge.step(f64::INFINITY).unwrap();
    assert!(step.max_speed > 1e-3, "{:e}", step.max_speed);
}

/// A step that does not go forwards is refused and changes nothing.
#[test]
fn steps_go_forwards() {
    let mut wedge = pile(12, 0.05, |x| 0.5 - 0.4 * (x - 0.07));
    let before = wedge.state().clone();
    for limit in [0.0, -0.1, f64::NAN] {
        for refused in [wedge.step(limit), wedge.accelerate_in_place(limit)] {
            let message = refused.unwrap_err().to_string();
            assert!(message.contains("allowed above 0"), "{message}");
        }
    }
    assert_eq!(wedge.state(), &before);
}

/// A detached lump falls freely: its velocity is g t on all of its faces and it keeps its shape.
#[test]
fn detached_lump_falls_freely() {
    let cells = 32;
    let h = 1.0 / cells as f64;
    let centre = [0.47, 0.71];
    let radius = 0.18;
    let samples = 24;
    let disc = |fall: f64| -> Vec<f64> {
        (0..cells * cells)
            .map(|cell| {
                let inside = (0..samples * samples).filter(|s| {
                    let at =
                        |n: usize, s: usize| (n as f64 + (s as f64 + 0.5) / samples as f64) * h;
                    let x = at(cell % cells, s % samples) - centre[0];
                    let z = at(cell / cells, s / samples) - centre[1] + fall;
                    x.hypot(z) < radius
                });
                inside.count() as f64 / (samples * samples) as f64
            })
            .collect()
    };
    let axis = bounded(1.0, cells, ROUGH, ROUGH);
    let mut flow = SurfaceFlow::at_rest(
        Grid::with_moving_surface([axis; 2]).unwrap(),
        disc(0.0),
        grains(0.03),
        [0.0, -1.0],
        SurfaceOptions::default(),
    )
    .unwrap();
    let volume = flow.volume();
    let end = 0.8;
    while flow.state().time < end - 1e-9 {
        let before = flow.momentum();
        let step = flow.step(end - flow.state().time).unwrap();
        let pushed = flow.momentum();
        assert!((pushed[0] - before[0]).abs() < 1e-14 * volume);
        assert!((flow.volume() / volume - 1.0).abs() < 1e-13);
        // The velocity stands half a step ahead: momentum is its volume times g t on every face.
        let speed = -pushed[1] / volume;
        assert!(
            (step.max_speed / speed - 1.0).abs() < 1e-9,
            "{} {speed}",
            step.max_speed
        );
    }
    let height = |fractions: &[f64]| -> f64 {
        let parts = fractions.iter().enumerate();
        let sum: f64 = parts
            .map(|(cell, f)| f * ((cell / cells) as f64 + 0.5))
            .sum();
        sum * h / fractions.iter().sum::<f64>()
    };
    let fallen = disc(0.5 * end * end);
    let now = &flow.state().fractions;
    let behind = height(now) - height(&fallen);
    assert!(behind.abs() < 1e-3, "{behind}");
    // A disc of six cells' radius, ten cells down.
    let miss: f64 = now.iter().zip(&fallen).map(|(a, b)| (a - b).abs()).sum();
    let total: f64 = fallen.iter().sum();
    assert!(miss / total < 0.01, "{}", miss / total);
}

/// Bagnold flow (slope 0.43 rad, d = 0.04, depth 1) on cells of a given size, in a box that is higher than the layer.
fn bagnold(cells: usize, h: f64) -> (SurfaceFlow<MuI>, impl Fn(f64) -> f64) {
    let slope = 0.43_f64;
    let length = h * cells as f64;
    let grid = Grid::with_moving_surface([Axis::Flat, bounded(length, cells, ROUGH, SMOOTH)]);
    let fractions = (0..cells).map(|k| (1.0 / h - k as f64).clamp(0.0, 1.0));
    let mut options = precise(1.0);
    options.solver.strain_rate_floor = 1e-6;
    options.solver.stress_tolerance = 1e-8;
    let mut flow = SurfaceFlow::at_rest(
        grid.unwrap(),
        fractions.collect(),
        grains(0.04),
        [slope.sin(), -slope.cos()],
        options,
    )
    .unwrap();
    flow.accelerate_in_place(1e8).unwrap();
    let inertial_number = 0.4 * (slope.tan() - 0.32) / (0.60 - slope.tan());
    let surface = 2.0 / 3.0 * inertial_number / 0.04 * slope.cos().sqrt();
    (flow, move |z: f64| surface * (1.0 - (1.0 - z).powf(1.5)))
}

/// Relative L2 error of Bagnold flow in a box that is higher than the layer by a quarter, so that the surface lies inside a
/// cell.
fn bagnold_error(cells: usize) -> f64 {
    let h = 1.25 / cells as f64;
    let (flow, exact) = bagnold(cells, h);
    let (mut miss, mut size) = (0.0, 0.0);
    for (k, u) in flow.state().velocity[0].iter().enumerate() {
        let z = (k as f64 + 0.5) * h;
        if z < 1.0 {
            miss += (u - exact(z)).powi(2);
            size += exact(z).powi(2);
        }
    }
    (miss / size).sqrt()
}

/// A layer thinner than half a cell on top of Bagnold flow slides on it with the shear rate of its own weight, exact at the
/// depth where it lies. Negative control: what is thinner than a tenth of a cell moves with what is below.
#[test]
fn layers_on_material_slide_under_their_weight() {
    for (depth, slides) in [(0.05, false), (0.12, true), (0.3, true), (0.48, true)] {
        let h = 1.0 / (8.0 + depth);
        let (flow, exact) = bagnold(10, h);
        let u = &flow.state().velocity[0];
        let (base, near) = (8.0 * h, 1e-4 * h);
        let rate = (exact(base + near) - exact(base - near)) / (2.0 * near);
        let found = (u[8] - u[7]) / h / rate;
        println!("depth {depth}: {found:.6} of the shear rate");
        assert!(
            (found - f64::from(u8::from(slides))).abs() < 1e-3,
            "{depth}: {found}"
        );
    }
}

/// Basilisk C 25-02-26 with a sharp interface on the same grids: 1.54e-2, 6.22e-3, 3.75e-3.
#[test]
fn bagnold_flow_with_its_surface_inside_a_cell() {
    let errors = [16, 32, 64, 128].map(bagnold_error);
    for (error, peer) in errors.iter().zip([1.54e-2, 6.22e-3, 3.75e-3]) {
        assert!(*error < 0.1 * peer, "{errors:?}");
    }
    assert!(errors[2] < 1e-4, "{errors:?}");
    let order = (errors[0] / errors[3]).log2() / 3.0;
    assert!(order >= 1.9, "order {order}");
}

/// A layer of depth 1 on a smooth floor between side walls (slope 0.3 rad) moves as a block: gravity less
/// the mean of 2 μ p/W. Velocity after a time of 1, and what it should be.
fn block_between_walls(cells: usize, width: f64) -> (f64, f64) {
    let (h, slope, friction) = (1.25 / cells as f64, 0.3_f64, 0.2);
    let grid = Grid::with_moving_surface([Axis::Flat, bounded(1.25, cells, SMOOTH, SMOOTH)]);
    let fractions = (0..cells).map(|k| (1.0 / h - k as f64).clamp(0.0, 1.0));
    let flow = SurfaceFlow::at_rest(
        grid.unwrap(),
        fractions.collect(),
        grains(0.04),
        [slope.sin(), -slope.cos()],
        precise(1.0),
    );
    let walls = SideWalls {
        width,
        friction: WallFriction {
            friction,
            cohesion: 0.0,
        },
    };
    let mut flow = flow.unwrap().between_side_walls(walls).unwrap();
    for _ in 0..4 {
        flow.accelerate_in_place(0.25).unwrap();
    }
    let exact = slope.sin() - friction * slope.cos() / width;
    (flow.state().velocity[0][0], exact.max(0.0))
}

#[test]
fn side_walls_hold_a_block_back_or_still() {
    let misses = [16, 32].map(|cells| {
        let (u, exact) = block_between_walls(cells, 1.0);
        (u / exact - 1.0).abs()
    });
    assert!(
        misses[1] < 2e-3 && misses[1] < 0.4 * misses[0],
        "{misses:?}"
    );
    let (u, exact) = block_between_walls(32, 0.6);
    assert!(exact == 0.0 && u.abs() < 1e-5, "{u}");
}

/// A standing wave of small amplitude in a box without friction: ω² = g k tanh(k H). Root mean
/// square of the difference to cos ωt over `periods`, relative to the amplitude.
fn standing_wave(cells: usize, step: f64, periods: f64) -> f64 {
    let h = 1.0 / cells as f64;
    let rows = cells * 3 / 4;
    let (depth, amplitude, k) = (0.513, 0.01, PI);
    let mut flow = SurfaceFlow::at_rest(
        Grid::with_moving_surface([
            bounded(1.0, cells, SMOOTH, SMOOTH),
            bounded(rows as f64 * h, rows, SMOOTH, SMOOTH),
        ])
        .unwrap(),
        below(cells, rows, h, |x| depth + amplitude * (k * x).cos()),
        frictionless(),
        [0.0, -1.0],
        precise(step),
    )
    .unwrap();
    let frequency = (k * (k * depth).tanh()).sqrt();
    let end = periods * 2.0 * PI / frequency;
    let mode = |flow: &SurfaceFlow<MuI>| -> f64 {
        let heights = flow.heights();
        let parts = heights.iter().enumerate();
        parts
            .map(|(i, z)| (z - depth) * (k * (i as f64 + 0.5) * h).cos())
            .sum()
    };
    let start = mode(&flow);
    let (mut sum, mut count) = (0.0, 0.0);
    while flow.state().time < end * (1.0 - 1e-9) {
        let time = flow.step(end - flow.state().time).unwrap().time;
        sum += (mode(&flow) / start - (frequency * time).cos()).powi(2);
        count += 1.0;
    }
    (sum / count).sqrt()
}

#[test]
fn standing_wave_keeps_time_and_height() {
    let error = standing_wave(32, 0.02, 1.0);
    assert!(error < 5e-3, "{error:e}");
}

/// Three periods on two grids.
#[test]
#[ignore = "long: run by tests/validate.sh"]
fn standing_wave_over_three_periods() {
    for (cells, step) in [(32, 0.02), (64, 0.01)] {
        let error = standing_wave(cells, step, 3.0);
        println!("standing wave, {cells} cells: {error:.2e} of its amplitude");
        assert!(error < 5e-3, "{error:e}");
    }
}

/// Largest miss of the shear stress of cells against the exact mean over their filled part, s (1 − z) under a level
/// surface at z = 1, over s; and of the cell on the floor alone.
fn misses_of_stress(flow: &SurfaceFlow<MuI>, s: f64) -> [f64; 2] {
    let misses = flow.cell_fields().into_iter().map(|field| {
        let height = field.upper[1] - field.lower[1];
        let middle = field.lower[1] + 0.5 * field.fraction * height;
        (field.stress[1] - s * (1.0 - middle)).abs() / s
    });
    let misses: Vec<f64> = misses.collect();
    [misses.iter().copied().fold(0.0, f64::max), misses[0]]
}

/// However full the highest cell is. (On an axis along which nothing varies a cell has half of the corners.)
#[test]
fn stress_of_a_cell_is_the_mean_over_its_filled_part() {
    for depth in [0.2, 0.5, 0.51, 0.75, 1.0] {
        let (flow, _) = bagnold(10, 1.0 / (8.0 + depth));
        let [worst, _] = misses_of_stress(&flow, 0.43f64.sin());
        assert!(worst < 1e-6, "{depth}: {worst}");
        // What flows down the slope moves along the flat axis, too.
        assert!(flow.cell_fields()[4].velocity[0] > 1.0);
    }
}

/// A block that slides down a rough board bears what the board does, μ_w p on it and less above, in the cells on the board
/// as in the others.
#[test]
fn stress_beside_a_sliding_wall_is_that_of_the_wall() {
    let (cells, slope, friction) = (5, 0.4_f64, 0.2);
    let h = 1.25 / cells as f64;
    let wall = WallFriction {
        friction,
        cohesion: 0.0,
    };
    let board = Boundary::CoulombWall {
        velocity: 0.0,
        friction: wall,
    };
    let along = Axis::Periodic {
        length: 4.0 * h,
        cells: 4,
    };
    for (x, columns) in [(Axis::Flat, 1), (along, 4)] {
        let grid = Grid::with_moving_surface([x, bounded(1.25, cells, board, SMOOTH)]);
        let mut flow = SurfaceFlow::at_rest(
            grid.unwrap(),
            below(columns, cells, h, |_| 1.0),
            grains(0.04),
            [slope.sin(), -slope.cos()],
            precise(1.0),
        )
        .unwrap();
        for _ in 0..4 {
            flow.accelerate_in_place(0.25).unwrap();
        }
        let [worst, on_wall] = misses_of_stress(&flow, friction * slope.cos());
        assert!(
            worst < 1e-3 && on_wall < 1e-3,
            "{columns}: {worst} {on_wall}"
        );
    }
}
