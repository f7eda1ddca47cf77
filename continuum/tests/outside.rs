//! A column whose face is not free: other matter leans on it.

use colluvium_continuum::Error;
use colluvium_continuum::column_collapse::{Collapse, CollapseCase, CollapseGround, Matter};
use colluvium_continuum::free_surface::{
    Contact, Outside, SpaceFlow, SurfaceFlow, SurfaceOptions, Terrain,
};
use colluvium_continuum::grid::{Axis, Boundary, Grid};
use colluvium_continuum::rheology::MuI;
use colluvium_continuum::terrain::Profile;
use colluvium_continuum::wall_friction::WallFriction;

/// Cells over the height, which is the width; in natural units the column is 1 high.
const ROWS: usize = 16;
const COLUMNS: usize = 40;

fn case() -> CollapseCase {
    CollapseCase {
        aspect: 1.0,
        height: 2.0,
        gravity: 9.81,
        rheology: MuI::new(0.5, 0.8, 0.4, 0.05, 0.6, 2500.0),
        cells: COLUMNS,
        length_scaled: COLUMNS as f64 / ROWS as f64,
        overhang_degrees: 0.0,
    }
}

fn column() -> Collapse {
    Collapse::new(&case(), &SurfaceOptions::default()).unwrap()
}

/// The same on ground that is level under it and up to 1.8 heights, and goes down beyond.
fn column_on_ground() -> Collapse {
    let slope = vec![[0.0, 0.0], [3.6, 0.0], [5.1, -0.7]];
    let ground = CollapseGround {
        profile: Profile::new(slope).unwrap(),
        contact: Contact::NoSlip,
    };
    let mut collapse =
        Collapse::bare_in_rows(&case(), &SurfaceOptions::default(), &ground, [0.0, 2.0]).unwrap();
    let below = rows_below(&collapse);
    let cells = collapse.flow().state().fractions.len();
    let rows = cells / COLUMNS;
    let fractions = (0..cells).map(|cell| {
        let is_column = cell % COLUMNS < ROWS && (below..below + ROWS).contains(&(cell / COLUMNS));
        f64::from(u8::from(is_column))
    });
    let matter = Matter {
        fractions: fractions.collect(),
        velocity: [
            vec![0.0; (COLUMNS + 1) * rows],
            vec![0.0; COLUMNS * (rows + 1)],
        ],
    };
    collapse.fill(matter).unwrap();
    collapse
}

/// Rows of cells below the column's floor.
fn rows_below(collapse: &Collapse) -> usize {
    let rows = -collapse.origin()[1] / collapse.spacing();
    assert!((rows - rows.round()).abs() < 1e-12, "{rows}");
    rows.round() as usize
}

/// Matter outside that bears its weight, with σ_xx = K σ_zz, on the face and, where asked, in the last 6 cells
/// of the column.
fn leaning(collapse: &Collapse, ratio: f64, shared: bool) -> Outside {
    let cells = collapse.flow().state().fractions.len();
    let mut outside = Outside::nothing(cells);
    let below = rows_below(collapse);
    for cell in below * COLUMNS..cells {
        let (i, k) = (cell % COLUMNS, cell / COLUMNS - below);
        let weight = 1.0 - (k as f64 + 0.5) / ROWS as f64;
        if weight > 0.0 {
            outside.pressure[cell] = 0.5 * (1.0 + ratio) * weight;
            outside.stress[cell] = [0.5 * (1.0 - ratio) * weight, 0.0];
            outside.cover[cell] = 1.0;
            if shared && i < ROWS {
                outside.share[cell] = ((i as f64 + 7.0 - ROWS as f64) / 7.0).max(0.0);
            }
        }
    }
    outside
}

/// Largest speed over √(g H) after a time of √(H/g), and the mean pressure over the weight above in the inner half.
fn after(mut collapse: Collapse, outside: Option<Outside>) -> [f64; 2] {
    if let Some(outside) = outside {
        collapse.flow_mut().set_outside(outside).unwrap();
    }
    let end = collapse.units().time();
    let mut speed = 0.0;
    while collapse.time() < end * (1.0 - 1e-9) {
        speed = collapse.step(end).unwrap().max_speed;
    }
    let (state, below) = (collapse.flow().state(), rows_below(&collapse));
    let (mut pressure, mut weight) = (0.0, 0.0);
    for k in 0..ROWS - 1 {
        for i in 0..ROWS / 2 {
            pressure += state.pressure[i + COLUMNS * (k + below)];
            weight += 1.0 - (k as f64 + 0.5) / ROWS as f64;
        }
    }
    [speed, pressure / weight]
}

#[test]
fn a_face_that_is_leaned_on_stands() {
    let held = leaning(&column(), 1.0, false);
    let [speed, pressure] = after(column(), Some(held));
    println!("level pressure: speed {speed:.1e}, pressure {pressure:.9}");
    assert!(speed < 1e-9 && (pressure - 1.0).abs() < 1e-9);
    // What nobody leans on falls.
    let [speed, _] = after(column(), None);
    println!("nobody: speed {speed:.3}");
    assert!(speed > 0.2, "{speed}");
    // Nor does a pressure without a cover hold it.
    let mut free = leaning(&column(), 1.0, false);
    free.cover.fill(0.0);
    assert_eq!(after(column(), Some(free))[0], speed);
}

/// Within yield a smaller thrust carries the column too: σ_xx = 0.6 σ_zz, with the deviatoric stress that goes with it.
#[test]
fn a_thrust_within_yield_carries_the_column_and_a_smaller_one_does_not() {
    let [speed, pressure] = after(column(), Some(leaning(&column(), 0.6, true)));
    println!("K = 0.6: speed {speed:.1e}, pressure {pressure:.4}");
    assert!(speed < 1e-3, "{speed}");
    // Active failure at K = (1 - μ)/(1 + μ) = 1/3.
    let [falls, _] = after(column(), Some(leaning(&column(), 0.1, true)));
    println!("K = 0.1: speed {falls:.3}");
    assert!(falls > 0.01 && falls > 20.0 * speed, "{falls}");
}

/// What leans on a column does so on ground as on a floor.
#[test]
fn a_column_on_ground_is_leaned_on_as_on_a_floor() {
    let on_ground = column_on_ground();
    assert!(rows_below(&on_ground) > 5);
    let [speed, pressure] = after(column_on_ground(), Some(leaning(&on_ground, 1.0, false)));
    println!("level pressure: speed {speed:.1e}, pressure {pressure:.9}");
    assert!(speed < 1e-9 && (pressure - 1.0).abs() < 1e-9);
    let [falls, _] = after(column_on_ground(), None);
    assert!(falls > 0.2, "{falls}");
    let thrust = |of: fn() -> Collapse| after(of(), Some(leaning(&of(), 0.6, true)));
    let [floor, ground] = [thrust(column), thrust(column_on_ground)];
    println!("K = 0.6: floor {floor:?}, ground {ground:?}");
    assert!(ground[0] < 1e-3 && (ground[1] / floor[1] - 1.0).abs() < 2e-3);
}

/// A force on the matter of a cell moves it by as much on ground as on a floor, and what no face takes is booked.
#[test]
fn forces_from_outside_push_matter_on_ground() {
    let impulse = |mut collapse: Collapse, force: f64| {
        let mut outside = leaning(&collapse, 1.0, false);
        let below = rows_below(&collapse);
        outside.force[ROWS / 2 + COLUMNS * (below + ROWS - 2)] = [force, 0.0];
        outside.force[COLUMNS - 2 + COLUMNS * (below + ROWS - 2)] = [0.25, 0.0];
        collapse.flow_mut().set_outside(outside).unwrap();
        collapse.step(1e-3 * collapse.units().time()).unwrap();
        let pushed = collapse.flow().state().velocity_time;
        let untaken = collapse.flow_mut().take_untaken();
        assert!(
            (untaken[0] / (0.25 * pushed) - 1.0).abs() < 1e-9,
            "{untaken:?}"
        );
        collapse.flow().momentum()[0] / pushed
    };
    for (force, least) in [(0.02, 1e-6), (0.5, 1e-6)] {
        let [floor, ground] = [column(), column_on_ground()].map(|column| impulse(column, force));
        println!("force {force}: rate of momentum {floor:.6e} on a floor, {ground:.6e} on ground");
        assert!(floor > least && (ground / floor - 1.0).abs() < 1e-2);
    }
    assert!(impulse(column_on_ground(), 0.0).abs() < 1e-8);
}

#[test]
fn what_does_not_fit_is_refused() {
    let mut collapse = column();
    let few = collapse.flow_mut().set_outside(Outside::nothing(3));
    assert!(matches!(few, Err(Error::ForeignState { found: 3, .. })));
    let mut outside = leaning(&collapse, 1.0, false);
    outside.share[0] = 1.5;
    let refused = collapse.flow_mut().set_outside(outside.clone());
    assert!(refused.unwrap_err().to_string().contains("outside.share"));
    outside.share[0] = 0.0;
    outside.force[0] = [f64::NAN, 0.0];
    assert!(collapse.flow_mut().set_outside(outside).is_err());
}

/// Cells of a bed in space along each axis, and how far a pit reaches from the middle and from the floor.
const BED: [usize; 3] = [10, 8, 6];
const PIT: [usize; 3] = [2, 2, 3];
const LAYERS: usize = 5;

/// A bed 1 deep between smooth walls, with a pit in its middle.
fn bed_with_pit() -> SpaceFlow<MuI> {
    let spacing = 1.0 / LAYERS as f64;
    let axis = |cells: usize, low| Axis::Bounded {
        length: spacing * cells as f64,
        cells,
        low,
        high: Boundary::FreeSlip,
    };
    let grid = Grid::with_moving_surface([
        axis(BED[0], Boundary::FreeSlip),
        axis(BED[1], Boundary::FreeSlip),
        axis(BED[2], Boundary::NoSlip { velocity: 0.0 }),
    ])
    .unwrap();
    let mut fractions = vec![0.0; BED.iter().product()];
    for (cell, fraction) in fractions.iter_mut().enumerate() {
        let [i, j, k] = place(cell);
        let off = |i: usize, axis: usize| (i as f64 + 0.5 - 0.5 * BED[axis] as f64).abs();
        let in_pit = off(i, 0) < PIT[0] as f64 && off(j, 1) < PIT[1] as f64 && k >= PIT[2];
        *fraction = f64::from(u8::from(k < LAYERS && !in_pit));
    }
    let law = MuI::new(0.5, 0.8, 0.4, 0.05, 0.6, 1.0 / 0.6);
    SpaceFlow::in_space(
        grid,
        fractions,
        law,
        [0.0, 0.0, -1.0],
        SurfaceOptions::default(),
    )
    .unwrap()
}

fn place(cell: usize) -> [usize; 3] {
    [
        cell % BED[0],
        cell / BED[0] % BED[1],
        cell / (BED[0] * BED[1]),
    ]
}

/// Matter in the pit that stands as high as the bed, with σ_xx = σ_yy = K σ_zz.
fn filling_the_pit(ratio: f64) -> Outside<3, 5> {
    let cells = BED.iter().product();
    let mut outside = Outside::nothing(cells);
    for cell in 0..cells {
        let depth = 1.0 - (place(cell)[2] as f64 + 0.5) / LAYERS as f64;
        if depth > 0.0 {
            outside.pressure[cell] = (1.0 + 2.0 * ratio) / 3.0 * depth;
            // (τ_xx + τ_yy − 2 τ_zz)/(2√3) of σ = −depth (K, K, 1).
            outside.stress[cell][1] = (1.0 - ratio) * depth / 3.0_f64.sqrt();
            outside.cover[cell] = 1.0;
        }
    }
    outside
}

/// Largest speed over √(g H) after 0.2 √(H/g).
fn speed_of_pit(outside: Option<Outside<3, 5>>) -> f64 {
    let mut flow = bed_with_pit();
    if let Some(outside) = outside {
        flow.set_outside(outside).unwrap();
    }
    let mut speed = 0.0;
    while flow.state().time < 0.2 * (1.0 - 1e-9) {
        speed = flow.step(0.2).unwrap().max_speed;
    }
    speed
}

/// A pit in space that is full of other matter stays as it is; an empty one falls in, as does one whose filling
/// thrusts with a tenth of its weight.
#[test]
fn a_pit_in_space_stands_when_it_is_filled() {
    let held = speed_of_pit(Some(filling_the_pit(1.0)));
    let (weak, empty) = (speed_of_pit(Some(filling_the_pit(0.1))), speed_of_pit(None));
    println!("pit: filled {held:.1e}, thrust of a tenth {weak:.3}, empty {empty:.3}");
    assert!(held < 1e-9, "{held}");
    assert!(empty > 0.05 && weak < empty, "{weak} {empty}");
}

/// A force on cells of a bed in space gives it that momentum.
#[test]
fn forces_in_space_are_taken_whole() {
    let mut flow = bed_with_pit();
    let mut outside = filling_the_pit(1.0);
    // Upwards, in a cell of the floor's third layer: more than weight and walls bear.
    let cell = 1 + BED[0] * (1 + BED[1] * 2);
    outside.force[cell] = [0.0, 0.0, 0.5];
    flow.set_outside(outside.clone()).unwrap();
    flow.step(1.0).unwrap();
    let lifted = flow.momentum()[2];
    println!(
        "momentum {lifted:.3e} after {:.3e}",
        flow.state().velocity_time
    );
    assert!(lifted > 0.0);
    assert_eq!(flow.take_untaken(), [0.0; 3]);
    outside.force[cell][1] = f64::INFINITY;
    assert!(flow.set_outside(outside).is_err());
}

/// A layer a twentieth of a cell thick on a slope of 1/4 that closes on itself, under a pressure p̂ from outside:
/// acceleration of its faces over that of a block, cos θ (g sin θ − μ (g cos θ + p̂/t)), t its thickness; speeds over
/// time where it is held.
fn layer_under(pressure: f64, cover: f64) -> Vec<f64> {
    let [columns, rows, up] = [16, 9, 4];
    let (foot, thick) = (1.0, 0.05);
    let at = |foot: f64| Profile::new(vec![[-1.0, foot - 0.25], [20.0, foot + 5.0]]).unwrap();
    let (ground, surface) = (at(foot), at(foot + thick));
    let fractions = (0..columns * rows).map(|cell| {
        let low = [(cell % columns) as f64, (cell / columns) as f64];
        let high = low.map(|x| x + 1.0);
        surface.area_in(low, high) - ground.area_in(low, high)
    });
    let mut options = SurfaceOptions::default();
    options.solver.strain_rate_floor = 1e-7;
    options.solver.momentum_tolerance = 1e-9;
    let mut flow: SurfaceFlow<MuI> = SurfaceFlow::over_ground(
        Grid::with_moving_surface([
            Axis::Periodic {
                length: columns as f64,
                cells: columns,
            },
            Axis::Bounded {
                length: rows as f64,
                cells: rows,
                low: Boundary::NoSlip { velocity: 0.0 },
                high: Boundary::FreeSlip,
            },
        ])
        .unwrap(),
        &Terrain {
            shape: ground.clone(),
            origin: [0.0; 2],
            contact: Contact::Coulomb(WallFriction {
                friction: 0.1,
                cohesion: 0.0,
            }),
            rise: [up, 0],
        },
        fractions.collect(),
        MuI::new(0.5, 0.8, 0.4, 0.05, 1.0, 1.0),
        [0.0, -1.0],
        options,
    )
    .unwrap();
    flow.set_outside(Outside {
        pressure: vec![pressure; columns * rows],
        cover: vec![cover; columns * rows],
        ..Outside::nothing(columns * rows)
    })
    .unwrap();
    let dt = 0.01;
    flow.accelerate_in_place(dt).unwrap();
    let cosine = 1.0 / 0.25_f64.hypot(1.0);
    let press = 0.1 * (cosine + cover * pressure / (thick * cosine));
    let exact = (0.25 * cosine - press).max(0.0) * cosine;
    let exact = if exact == 0.0 { 1.0 } else { exact };
    let mut shares = Vec::new();
    for (face, u) in flow.state().velocity[0].iter().enumerate() {
        let (i, k) = (face % columns, face / columns);
        let middle = foot + 0.25 * i as f64 + 0.5 * thick;
        if i > 0 && (k as f64..k as f64 + 1.0).contains(&middle) {
            shares.push(-u / (dt * exact));
        }
    }
    shares.sort_by(f64::total_cmp);
    shares
}

/// What presses from outside on a thin layer holds it by friction as its weight does.
#[test]
fn pressure_from_outside_holds_thin_layers() {
    for (pressure, cover) in [(0.0, 0.0), (0.03, 1.0), (0.06, 0.5), (0.1, 0.0)] {
        let shares = layer_under(pressure, cover);
        println!("p {pressure}, cover {cover}: {shares:.4?}");
        for share in shares {
            assert!((share - 1.0).abs() < 1e-3, "{pressure} {cover} {share}");
        }
    }
    let held = layer_under(0.1, 1.0);
    println!("held: {held:?}");
    assert!(held[held.len() - 1] < 1e-4, "{held:?}");
}
