//! Walls on which material slides: a slab on a base, shear with slip, a heap between side walls.
use std::ops::ControlFlow;

use colluvium_continuum::discretisation::{Discretisation, ThresholdPressure};
use colluvium_continuum::flow::{Flow, YieldMethod};
use colluvium_continuum::grid::{Axis, Boundary, Grid};
use colluvium_continuum::heap::HeapCase;
use colluvium_continuum::layer::{LayerSolution, Options};
use colluvium_continuum::rheology::MuI;
use colluvium_continuum::wall_friction::WallFriction;
use colluvium_continuum::yield_step::{
    FlowState, PrimalDual, PrimalDualOptions, StepProblem, YieldSolver,
};

fn material() -> MuI {
    MuI::new(0.32, 0.60, 0.4, 0.04, 1.0, 1.0)
}

fn base(friction: f64) -> Boundary {
    Boundary::CoulombWall {
        velocity: 0.0,
        friction: WallFriction {
            friction,
            cohesion: 0.0,
        },
    }
}

fn across(cells: usize, low: Boundary, high: Boundary) -> Axis {
    Axis::Bounded {
        length: 1.0,
        cells,
        low,
        high,
    }
}

/// A layer of depth one under gravity one on a slope.
fn slab(along: Axis, low: Boundary, tangent: f64) -> Flow<MuI> {
    let slope = tangent.atan();
    Flow::at_rest(
        Grid::new([along, across(16, low, Boundary::FreeSurface)]).unwrap(),
        ThresholdPressure::Corner,
        material(),
        [slope.sin(), -slope.cos()],
        YieldMethod::default(),
        |z| slope.cos() * (1.0 - z),
    )
    .unwrap()
}

#[test]
fn slab_slides_with_weight_less_friction() {
    let periodic = Axis::Periodic {
        length: 0.25,
        cells: 4,
    };
    for along in [Axis::Flat, periodic] {
        for (tangent, friction) in [(0.30_f64, 0.2), (0.25, 0.0), (0.31, 0.3)] {
            let mut flow = slab(along, base(friction), tangent);
            let slope = tangent.atan();
            let acceleration = slope.sin() - friction * slope.cos();
            for step in 1..=4 {
                flow.step(0.5).unwrap();
                let (u, _) = flow.profile();
                let expected = acceleration * 0.5 * f64::from(step);
                for u in u {
                    // The rigid material creeps at the floor.
                    assert!((u - expected).abs() < 5e-6, "{u} {expected}");
                }
            }
            let stress = flow.boundary_shear_stress()[0];
            assert!((stress - friction * slope.cos()).abs() < 1e-8);
            // The material itself stays rigid.
            assert!(flow.yielded_and_ill_posed()[0] < 1e-12);
        }
    }
}

#[test]
fn slab_rests_on_a_rough_enough_base() {
    for dt in [0.05, 1e6] {
        let mut flow = slab(Axis::Flat, base(0.28), 0.27);
        flow.step(dt).unwrap();
        assert!(flow.max_speed() < 5e-6, "{:e}", flow.max_speed());
    }
}

/// A slab thrown onto a base comes to rest after u_0/(g (μ_b cosθ − sinθ)), in the step in which it
/// should and not later.
#[test]
fn moving_slab_stops_in_finite_time() {
    let (friction, slope, start) = (0.3, 0.1_f64, 0.5);
    let low = base(friction);
    let grid = Grid::new([Axis::Flat, across(16, low, Boundary::FreeSurface)]).unwrap();
    let discretisation = Discretisation::new(grid, ThresholdPressure::Corner);
    let h = 1.0 / 16.0;
    let pressure = (0..16)
        .map(|k| slope.cos() * (1.0 - (f64::from(k) + 0.5) * h))
        .collect();
    let mut state = FlowState::at_rest(&discretisation, pressure);
    state.u[discretisation.grid().component(0)].fill(start);
    let load = discretisation.load([slope.sin(), -slope.cos()]);
    let mut solver = PrimalDual::new(&discretisation, PrimalDualOptions::default()).unwrap();
    let deceleration = friction * slope.cos() - slope.sin();
    let dt = 0.1;
    for step in 1..=40 {
        let problem = StepProblem {
            discretisation: &discretisation,
            rheology: &material(),
            load: &load,
            dt,
        };
        assert!(solver.step(&problem, &mut state).unwrap().converged);
        let expected = (start - deceleration * dt * f64::from(step)).max(0.0);
        for u in &state.u[discretisation.grid().component(0)] {
            assert!((u - expected).abs() < 3e-6, "step {step}: {u} {expected}");
        }
    }
}

/// Shear between a plate that moves at U under a load P and a base with μ_b: below μ_s the material
/// moves as a block with the plate, between μ_s and what U would need it shears at μ(I) = μ_b and
/// slips for the rest, above that it sticks.
#[test]
fn shear_with_slip_on_the_base() {
    let (speed, load) = (2.0, 1.0);
    let lid = Boundary::LoadedWall {
        velocity: speed,
        pressure: load,
    };
    let law = material();
    let without_slip = law.mu(law.inertial_number(speed, load));
    for (friction, rate) in [
        (0.25, 0.0),
        (0.34, law.inertial_number_at(0.34) / 0.04),
        (0.55, speed),
    ] {
        let mut flow = Flow::at_rest(
            Grid::new([Axis::Flat, across(16, base(friction), lid)]).unwrap(),
            ThresholdPressure::Corner,
            law,
            [0.0, 0.0],
            YieldMethod::default(),
            |_| load,
        )
        .unwrap();
        flow.step(1e8).unwrap();
        let (u, _) = flow.profile();
        for (k, u) in u.iter().enumerate() {
            let z = (k as f64 + 0.5) / 16.0;
            let expected = speed - rate * (1.0 - z);
            assert!(
                (u - expected).abs() < 5e-6,
                "μ_b {friction}: {u} {expected}"
            );
        }
        let stress = flow.boundary_shear_stress();
        for side in stress {
            assert!(
                (side - friction.min(without_slip) * load).abs() < 1e-7,
                "{stress:?}"
            );
        }
    }
    assert!(without_slip > 0.34 && without_slip < 0.55);
}

/// Negative control: the same slab on a base without slip rests.
#[test]
fn slab_on_a_rough_base_does_not_slide() {
    let mut flow = slab(Axis::Flat, Boundary::NoSlip { velocity: 0.0 }, 0.30);
    flow.step(1.0).unwrap();
    assert!(flow.max_speed() < 5e-6);
}

fn heap(cells: usize) -> HeapCase {
    HeapCase {
        slope: 0.43_f64,
        depth: 1.0,
        gravity: 1.0,
        width: 1.5,
        wall_friction: 0.3,
        rheology: material(),
        cells,
        columns: None,
    }
}

fn solve(case: &HeapCase) -> LayerSolution {
    case.solve(&Options::default(), &mut |_| ControlFlow::Continue(()))
        .unwrap()
}

#[test]
fn heap_flows_on_material_at_rest_at_second_order() {
    let depth = 1.5 * (0.43_f64.tan() - 0.32) / 0.3;
    assert!((heap(16).flowing_depths()[1] - depth).abs() < 1e-14 && depth < 0.7);
    let errors = [16, 32, 64, 128].map(|cells| solve(&heap(cells)).velocity_error_l2_relative);
    let order = (errors[0] / errors[3]).log2() / 3.0;
    assert!(order >= 1.9 && errors[3] < 1e-3, "{order} {errors:?}");
    let solution = solve(&heap(64));
    assert!((solution.yielded_fraction - depth).abs() < 0.02);
    for (z, u) in solution.z.iter().zip(&solution.u) {
        assert!(1.0 - z < depth || u.abs() < 2e-5, "{z} {u}");
    }
}

/// Negative control: with the pressure of the material's threshold in cells a heap between side walls misses what the test
/// above asks for, as a layer without them does.
#[test]
fn pressure_in_cells_spoils_the_heap() {
    let options = Options {
        threshold_pressure: ThresholdPressure::Cell,
        ..Options::default()
    };
    for cells in [32, 128] {
        let case = heap(cells);
        let coarse = case.solve(&options, &mut |_| ControlFlow::Continue(()));
        let coarse = coarse.unwrap().velocity_error_l2_relative;
        let fine = solve(&case).velocity_error_l2_relative;
        println!("{cells} cells: {fine:.2e} at corners, {coarse:.2e} in cells");
        assert!(coarse > 3.0 * fine, "{cells} cells: {fine:e} {coarse:e}");
    }
}

#[test]
fn cohesive_heap_and_columns() {
    let mut case = heap(64);
    case.rheology.cohesion = 0.01;
    let solution = solve(&case);
    assert!(solution.velocity_error_l2_relative < 1e-3);
    let flat = solve(&heap(16));
    let wide = solve(&HeapCase {
        columns: Some(4),
        ..heap(16)
    });
    for (a, b) in flat.u.iter().zip(&wide.u) {
        assert!((a - b).abs() < 1e-7);
    }
}

#[test]
fn heap_that_flows_to_its_base_is_refused() {
    let case = HeapCase {
        depth: 0.5,
        ..heap(16)
    };
    let message = case.validate().unwrap_err().to_string();
    assert!(
        message.contains("depth") && message.contains("0.69"),
        "{message}"
    );
}
