//! Collapse of columns: conservation, arrest, restart, steps of any size, and what the thin-layer
//! rule and the time step change.
//!
//! Basilisk C 25-02-26 (an air phase, own measurement) runs out by 1.02, 1.16 and 1.16 column widths
//! at a = 0.5 on 128, 256 and 512 cells along x, with a film of air under the front that carries it;
//! without the air it would be 0.97 to 1.07.
use colluvium_continuum::column_collapse::{Collapse, CollapseCase};
use colluvium_continuum::free_surface::{SurfaceOptions, ThinLayer};
use colluvium_continuum::rheology::MuI;
use colluvium_continuum::wall_friction::{SideWalls, WallFriction};

fn case(aspect: f64, cells: usize, diameter: f64) -> CollapseCase {
    CollapseCase {
        aspect,
        height: 1.0,
        gravity: 1.0,
        rheology: MuI::new(0.32, 0.60, 0.4, diameter, 1.0, 1.0),
        cells,
        length_scaled: if aspect > 3.0 { 3.75 } else { 5.0 },
        overhang_degrees: 0.0,
    }
}

fn wide(cells: usize) -> CollapseCase {
    case(0.5, cells, 1.0 / 30.0)
}

/// Runs to rest or to `end`; the collapse, and whether it came to rest.
fn run(case: &CollapseCase, options: &SurfaceOptions, end: f64) -> (Collapse, bool) {
    let mut collapse = Collapse::new(case, options).unwrap();
    while collapse.time() < end - 1e-9 {
        let step = collapse.step(end).unwrap();
        assert!(collapse.volume_drift().abs() < 1e-12);
        if collapse.is_at_rest(&step) {
            return (collapse, true);
        }
    }
    (collapse, false)
}

fn runout(collapse: &Collapse, case: &CollapseCase) -> f64 {
    collapse.front(0.01).position / case.width() - 1.0
}

/// ∫|h_a − h_b| dx over the area, the finer heap averaged onto the coarser grid.
fn profile_difference(coarse: &Collapse, fine: &Collapse) -> f64 {
    let (x, a) = coarse.profile();
    let (_, b) = fine.profile();
    let miss: f64 = a
        .iter()
        .zip(b.chunks_exact(b.len() / a.len()))
        .map(|(a, b)| (a - b.iter().sum::<f64>() / b.len() as f64).abs())
        .sum();
    assert!(x.len() == a.len());
    miss / a.iter().sum::<f64>()
}

/// To rest in finite time, with its volume to round-off and a core that stays.
#[test]
fn wide_column_collapses_and_comes_to_rest() {
    let case = wide(64);
    let (collapse, at_rest) = run(&case, &SurfaceOptions::default(), 12.0);
    assert!(at_rest && collapse.time() < 8.0, "{}", collapse.time());
    let runout = runout(&collapse, &case);
    assert!((1.0..1.2).contains(&runout), "{runout}");
    for f in &collapse.flow().state().fractions {
        assert!((0.0..=1.0 + 1e-9).contains(f), "{f}");
    }
    assert!(collapse.front(0.01).height > 0.995);
}

/// With friction above one a column bears its own weight, σ_xx = 0 and |τ| = p < μ_s p, and stands; where its face ends
/// inside a cell the sliver there comes down. (Pressure that went through zero at the face let columns fall under μ_s = 2:
/// half of the area moved at 1.05.) With less it falls.
#[test]
fn friction_above_one_holds_a_column_up() {
    for (friction, aspect, cells, largest) in [
        (1.05, 2.0, 50, 1e-5),
        (1.05, 2.0, 104, 0.02),
        (1.5, 2.0, 96, 0.02),
        (2.0, 2.0, 96, 0.02),
        (2.0, 2.0, 192, 1e-6),
        (2.0, 6.0, 192, 0.02),
    ] {
        let standing = CollapseCase {
            rheology: MuI::new(friction, friction + 0.28, 0.4, 1.0 / 65.0, 1.0, 1.0),
            ..case(aspect, cells, 1.0 / 65.0)
        };
        let options = SurfaceOptions::default();
        let before = Collapse::new(&standing, &options).unwrap();
        let (after, at_rest) = run(&standing, &options, 4.0);
        let change = profile_difference(&before, &after);
        println!(
            "μ_s = {friction}, {cells} cells: the profile changes by {change:.2e} of the area"
        );
        assert!(at_rest && change < largest, "{at_rest} {change}");
    }
    let nearly = CollapseCase {
        rheology: MuI::new(0.95, 1.23, 0.4, 1.0 / 65.0, 1.0, 1.0),
        ..case(2.0, 48, 1.0 / 65.0)
    };
    for falling in [case(2.0, 96, 1.0 / 65.0), nearly] {
        let options = SurfaceOptions::default();
        let before = Collapse::new(&falling, &options).unwrap();
        let (after, _) = run(&falling, &options, 1.0);
        assert!(profile_difference(&before, &after) > 0.2);
    }
}

#[test]
fn restart_gives_the_same_bits() {
    let case = wide(32);
    let options = SurfaceOptions::default();
    let mut whole = Collapse::new(&case, &options).unwrap();
    for _ in 0..12 {
        whole.step(f64::INFINITY).unwrap();
    }
    let mut resumed = Collapse::new(&case, &options).unwrap();
    resumed.set_state(whole.flow().state().clone()).unwrap();
    for _ in 0..12 {
        whole.step(f64::INFINITY).unwrap();
        resumed.step(f64::INFINITY).unwrap();
    }
    assert_eq!(whole.flow().state(), resumed.flow().state());
    assert!(resumed.set_state(Default::default()).is_err());
}

/// A step that ends in an error leaves the state as it was, whether it does not converge or the solver refuses its settings.
#[test]
fn a_step_that_fails_changes_nothing() {
    let case = wide(32);
    let mut moving = Collapse::new(&case, &SurfaceOptions::default()).unwrap();
    for _ in 0..5 {
        moving.step(f64::INFINITY).unwrap();
    }
    let before = moving.flow().state().clone();
    let mut unreachable = SurfaceOptions::default();
    unreachable.solver.momentum_tolerance = 1e-30;
    unreachable.solver.tolerance_in_motion = 1.0;
    unreachable.solver.max_iterations = 1;
    let mut refused = SurfaceOptions::default();
    refused.solver.floor_factor = 2.0;
    assert!(Collapse::new(&case, &refused).is_err());
    let mut collapse = Collapse::new(&case, &unreachable).unwrap();
    collapse.set_state(before.clone()).unwrap();
    collapse.step(f64::INFINITY).unwrap_err();
    assert_eq!(*collapse.flow().state(), before);
    moving.step(f64::INFINITY).unwrap();
    assert_ne!(*moving.flow().state(), before);
}

/// A step of Courant number one moves its material in two parts and keeps every fraction in [0, 1].
#[test]
fn long_steps_move_material_in_parts() {
    let case = case(6.26, 96, 1.0 / 134.0);
    let options = SurfaceOptions {
        courant: 1.0,
        ..SurfaceOptions::default()
    };
    let mut collapse = Collapse::new(&case, &options).unwrap();
    while collapse.time() < 4.0 {
        collapse.step(4.0).unwrap();
        for f in &collapse.flow().state().fractions {
            assert!((0.0..=1.0 + 1e-9).contains(f), "{f}");
        }
    }
    assert!(collapse.volume_drift().abs() < 1e-12);
}

/// Without an intermediate step from rest to any Δt: no blow-up and no cut.
#[test]
fn first_step_may_have_any_size() {
    for dt in [1e-3, 0.1, 1.0, 10.0] {
        let options = SurfaceOptions {
            largest_step: dt,
            ..SurfaceOptions::default()
        };
        let column = Collapse::new(&wide(48), &options).unwrap();
        let mut flow = column.into_flow();
        let step = flow.accelerate_in_place(dt).unwrap();
        // Nothing falls faster than freely.
        assert!(
            step.max_speed <= 1.5 * dt && step.max_speed > 0.0,
            "{dt} {}",
            step.max_speed
        );
    }
}

/// The error of a step moves the front at rest by less than half a percent at Courant numbers 0.45 and 0.9, against
/// 0.1125. Negative control: with first order in time profiles are off by twice as much at least.
#[test]
#[ignore = "long: run by tests/validate.sh"]
fn time_step_does_not_move_the_front() {
    let case = wide(128);
    let runs = |second_order| {
        [0.1125, 0.45, 0.9].map(|courant| {
            let options = SurfaceOptions {
                courant,
                second_order,
                ..SurfaceOptions::default()
            };
            run(&case, &options, 8.0).0
        })
    };
    let misses = [true, false].map(|second_order| {
        let [fine, usual, long] = runs(second_order);
        let front = |run: &Collapse| run.front(0.01).position;
        let fronts = [&usual, &long].map(|run| front(run) / front(&fine) - 1.0);
        let profiles = [&usual, &long].map(|run| profile_difference(run, &fine));
        println!(
            "second order: {second_order}: Courant numbers 0.45 and 0.9 move the front by {fronts:.5?}, profiles by {profiles:.5?}"
        );
        (fronts, profiles)
    });
    let [(fronts, profiles), (_, control)] = misses;
    assert!(fronts.iter().all(|front| front.abs() < 2e-3), "{fronts:?}");
    for (found, control) in profiles.iter().zip(control) {
        assert!(*found < 0.5 * control, "{profiles:?} {control:?}");
    }
}

/// Frozen layers hold the front back, layers that only follow slide on for ever; depth-averaged
/// ones come to rest, and with half as many cells run out nearer to their own result (by 3.6 %) than frozen ones ever do
/// (8 %). The profiles of both change by 5.0e-3 and 4.3e-3 of the area from 64 to 128 cells.
#[test]
#[ignore = "long: run by tests/validate.sh"]
fn thin_layer_rules_compared() {
    let rules = [
        ThinLayer::DepthAveraged,
        ThinLayer::Frozen,
        ThinLayer::Following,
    ];
    let found = rules.map(|thin_layer| {
        let options = SurfaceOptions {
            thin_layer,
            ..SurfaceOptions::default()
        };
        let cases = [64, 128].map(wide);
        let [coarse, fine] = cases.map(|case| run(&case, &options, 8.0));
        let fronts = [runout(&coarse.0, &cases[0]), runout(&fine.0, &cases[1])];
        let difference = profile_difference(&coarse.0, &fine.0);
        let at_rest = [coarse.1, fine.1];
        println!(
            "{thin_layer:?}: run-out {fronts:?}, profiles differ by {difference:.2e}, at rest {at_rest:?}"
        );
        (fronts, difference, at_rest == [true; 2])
    });
    let [averaged, frozen, following] = found;
    assert!(averaged.2 && frozen.2 && !following.2);
    let change = |runouts: [f64; 2]| (runouts[1] / runouts[0] - 1.0).abs();
    assert!(change(averaged.0) < 0.045 && averaged.1 < 6e-3);
    let away = (frozen.0[1] / averaged.0[1] - 1.0).abs();
    assert!(away > 1.5 * change(averaged.0));
}

/// Root mean square, over columns of a heap 1.2 to 9 cells high, of the second difference of their heights, in cells.
fn roughness(collapse: &Collapse) -> f64 {
    let spacing = collapse.spacing();
    let heights: Vec<f64> = collapse.profile().1.iter().map(|h| h / spacing).collect();
    let among = heights
        .windows(3)
        .filter(|h| (1.2..9.0).contains(&h[1]))
        .map(|h| (h[0] - 2.0 * h[1] + h[2]).powi(2));
    let squares: Vec<f64> = among.collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

/// Where the centre of mass lies along x, in column widths.
fn centre(collapse: &Collapse, case: &CollapseCase) -> f64 {
    let (x, h) = collapse.profile();
    let moment: f64 = x.iter().zip(&h).map(|(x, h)| x * h).sum();
    moment / h.iter().sum::<f64>() / case.width()
}

/// A heap a few cells thick has no steps where its surface passes half a cell: 0.009 of a cell; 0.017 while layers on material
/// moved with what is below them. Its profile is that of half as many cells to 0.7 % of the area; 1.2 % while the floor
/// under a single cell bore the pressure extrapolated from it.
#[test]
fn low_heap_has_no_steps() {
    let cases = [96, 192].map(|cells| case(6.26, cells, 1.0 / 134.0));
    let [coarse, fine] = cases.map(|case| run(&case, &SurfaceOptions::default(), 6.0).0);
    let (steps, difference) = (roughness(&fine), profile_difference(&coarse, &fine));
    println!("second differences {steps:.4} of a cell, profiles differ by {difference:.4}");
    assert!(steps < 0.012 && difference < 0.01, "{steps} {difference}");
}

/// Profiles at t = 6 on three grids come closer by order 1.7 and 1.4 at a = 0.5 and 1.42. At a = 6.26, where
/// the heap is a few cells thick, the order is 1.2 at t = 3; from then on the tip of the toe, thinner than a grain and than a
/// cell, still creeps farther on finer grids, and at rest profiles differ by 0.92 and 0.81 % of the area (0.79 while steps were of first
/// order in time, whose errors cancelled some of those of the grid): a known lack, no order of one is asked of them there, but of the centre of mass (3.5). Basilisk at a = 1.42: 4.6e-2 between 128 and 256 cells, 4.9e-2 between 256 and 512.
#[test]
#[ignore = "long: run by tests/validate.sh"]
fn deposits_converge_with_the_grid() {
    for (aspect, diameter, grids, end, least, most) in [
        (0.5, 1.0 / 30.0, [32, 64, 128], 6.0, 1.3, 0.008),
        (1.42, 1.0 / 65.0, [64, 128, 256], 6.0, 1.1, 0.008),
        (6.26, 1.0 / 134.0, [96, 192, 384], 3.0, 1.0, 0.008),
        (
            6.26,
            1.0 / 134.0,
            [96, 192, 384],
            6.0,
            f64::NEG_INFINITY,
            0.0085,
        ),
    ] {
        let cases = grids.map(|cells| case(aspect, cells, diameter));
        let runs = cases.map(|case| run(&case, &SurfaceOptions::default(), end).0);
        let [coarse, middle, fine] = &runs;
        let differences = [
            profile_difference(coarse, middle),
            profile_difference(middle, fine),
        ];
        let order = (differences[0] / differences[1]).log2();
        let runouts = [0, 1, 2].map(|n| runout(&runs[n], &cases[n]));
        let centres = [0, 1, 2].map(|n| centre(&runs[n], &cases[n]));
        let steps = [centres[1] - centres[0], centres[2] - centres[1]];
        let order_of_centre = (steps[0] / steps[1]).abs().log2();
        println!(
            "a = {aspect}, t = {end}, {grids:?} cells: profiles differ by {differences:.4?}, order {order:.2}, centre of mass {centres:.4?}, order {order_of_centre:.2}, run-out {runouts:.3?}"
        );
        assert!(differences[1] < most && order > least, "{aspect} {end}");
        assert!(aspect < 3.0 || order_of_centre > 1.0, "{order_of_centre}");
    }
}

/// The deposit of a tall column at rest, where its toe is thinner than a grain: the order is one once a grain is some cells
/// wide (0.6, 1.2 and 2.3 on these grids); on 96 to 384 cells it is 0.2 (see above).
#[test]
#[ignore = "long, half an hour of a core: run by tests/validate.sh"]
fn tall_deposits_converge_where_a_grain_is_some_cells_wide() {
    let options = SurfaceOptions {
        courant: 0.9,
        ..SurfaceOptions::default()
    };
    let grids = [288, 576, 1152];
    let heaps = grids.map(|cells| {
        let (heap, at_rest) = run(&case(6.26, cells, 1.0 / 134.0), &options, 12.0);
        assert!(at_rest, "{cells} cells");
        println!("{cells} cells: at rest at t = {:.2}", heap.time());
        heap
    });
    let [coarse, middle, fine] = &heaps;
    let first = profile_difference(coarse, middle);
    let second = profile_difference(middle, fine);
    let order = (first / second).log2();
    println!(
        "{grids:?} cells: deposits differ by {first:.2e}, {second:.2e} of the area, order {order:.2}"
    );
    assert!(order > 1.0 && second < 0.004, "{order} {second}");
}

/// Run-out of columns of glass beads (Jop, Forterre & Pouliquen 2006: tan 20.9°, tan 32.76°, I_0 =
/// 0.279; d = 1.15 mm = L/87) against the bands of the experiments of Lube et al. and Lajeunesse et al., as
/// Lagrée, Staron & Popinet (2011, eq. 3.1) state their laws. The experiments were made in channels: one 45 mm wide whose
/// walls rub with tan 10.4° (glass beads on glass) is assumed for all of them. Negative controls:
/// every band refuses the run with μ_s = 2, whose columns stand, and up to a = 3 with μ_s = 0.9.
#[test]
#[ignore = "long: run by tests/validate.sh"]
fn runout_beside_the_bands_of_experiments() {
    let walls = SideWalls {
        width: 0.045,
        friction: WallFriction {
            friction: 0.1835,
            cohesion: 0.0,
        },
    };
    let runout =
        |mu_s: f64, mu_2: f64, (aspect, cells, length_scaled), walls: Option<SideWalls>| {
            let height = 0.1 * aspect;
            let case = CollapseCase {
                aspect,
                height,
                gravity: 9.81,
                rheology: MuI::new(mu_s, mu_2, 0.279, 1.15e-3, 0.6, 2500.0),
                cells,
                length_scaled,
                overhang_degrees: 0.0,
            };
            let options = SurfaceOptions::default();
            let mut collapse = match walls {
                None => Collapse::new(&case, &options),
                Some(walls) => Collapse::between_side_walls(&case, &options, walls),
            }
            .unwrap();
            let end = 8.0 * case.units().time();
            while collapse.time() < end * (1.0 - 1e-9) {
                let step = collapse.step(end).unwrap();
                if collapse.is_at_rest(&step) {
                    break;
                }
            }
            collapse.front(0.01 * height).position / case.width() - 1.0
        };
    let found = [
        ((0.5, 96, 5.0), 0.60..1.10),
        ((1.0, 96, 4.0), 1.20..2.20),
        ((2.0, 96, 3.0), 2.40..3.60),
        ((3.0, 128, 2.8), 3.95..4.78),
        ((6.0, 192, 2.8), 6.27..7.59),
    ]
    .map(|(grid, band)| {
        let plane = runout(0.381863, 0.643468, grid, None);
        let channel = runout(0.381863, 0.643468, grid, Some(walls));
        let standing = runout(2.0, 2.28, grid, None);
        // At a = 6 the first step does not converge with 0.9: neither does the column stand nor a fall begin.
        let stiff = (grid.0 < 6.0).then(|| runout(0.9, 1.2, grid, None));
        println!(
            "glass beads, a = {}: run-out {plane:.2}, in the channel {channel:.2}, experiments {band:?}; with μ_s = 2 {standing:.2}, 0.9 {stiff:.2?}",
            grid.0
        );
        assert!(!band.contains(&standing) && stiff.is_none_or(|runout| !band.contains(&runout)));
        [band.contains(&plane), band.contains(&channel)]
    });
    println!("inside the bands (plane, channel): {found:?}");
    assert!(found.iter().all(|[_, channel]| *channel));
}

/// A cliff whose face leans out holds the area of its section to round-off, at any angle; it falls and runs out farther than
/// the upright column on the same foot. Faces that would not fit are refused.
#[test]
fn overhanging_face_falls() {
    let options = SurfaceOptions::default();
    let upright = case(1.0, 40, 1.0 / 30.0);
    let mut fronts = Vec::new();
    for degrees in [0.0, 10.0, 27.3, 45.0] {
        let case = CollapseCase {
            overhang_degrees: degrees,
            ..upright
        };
        let start = Collapse::new(&case, &options).unwrap();
        let exact = 1.0 + 0.5 * f64::to_radians(degrees).tan();
        let area = start.flow().volume();
        assert!(
            (area / exact - 1.0).abs() < 1e-12,
            "{degrees}: {area} {exact}"
        );
        // At half its height the face is where it has to be; the lip makes the front.
        let lip = 1.0 + f64::to_radians(degrees).tan();
        assert!((start.front(1e-6).position - lip).abs() < 0.2, "{degrees}");
        if degrees < 30.0 {
            let (end, rests) = run(&case, &options, 15.0);
            assert!(rests, "{degrees}");
            fronts.push(runout(&end, &case));
        }
    }
    assert!(fronts.is_sorted(), "{fronts:?}");
    let far = CollapseCase {
        overhang_degrees: 59.0,
        length_scaled: 2.5,
        ..upright
    };
    let error = Collapse::new(&far, &options).map(drop).unwrap_err();
    assert!(error.to_string().contains("overhang"), "{error}");
}

/// A tall column on a fine grid takes its first step whole, though many of its cells go to and fro between pressure and none
/// while ε falls: counted as conflicts from the start they ended every attempt.
#[test]
#[ignore = "long: run by tests/validate.sh"]
fn tall_column_on_a_fine_grid_takes_its_first_step() {
    let case = case(6.26, 1536, 1.0 / 134.0);
    let mut column = Collapse::new(&case, &SurfaceOptions::default()).unwrap();
    let step = column.step(f64::INFINITY).unwrap();
    println!("first step: {} iterations", step.newton_iterations);
    assert_eq!((step.cuts, step.held_points), (0, 0));
}
