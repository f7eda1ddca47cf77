//! Flows whose linear systems are solved with multigrid against the same ones with factors.
use colluvium_continuum::column_collapse::{Collapse, CollapseCase};
use colluvium_continuum::cylinder_collapse::{CylinderCase, CylinderCollapse};
use colluvium_continuum::free_surface::{Contact, SpaceFlow, SurfaceOptions};
use colluvium_continuum::grid::{Axis, Boundary, Grid};
use colluvium_continuum::rheology::MuI;
use colluvium_continuum::yield_step::LinearSolver;

const SOLVERS: [LinearSolver; 2] = [LinearSolver::Factors, LinearSolver::Multigrid];

fn options(linear_solver: LinearSolver) -> SurfaceOptions {
    let mut options = SurfaceOptions::default();
    options.solver.linear_solver = linear_solver;
    options.solver.linear_tolerance = 1e-9;
    options.solver.momentum_tolerance = 1e-8;
    options.solver.stress_tolerance = 1e-7;
    options.solver.tolerance_in_motion = 1.0;
    options
}

fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    a.iter()
        .zip(b)
        .fold(0.0, |most, (a, b)| (a - b).abs().max(most))
}

fn cylinder(cells: usize, options: &SurfaceOptions) -> CylinderCollapse {
    let case = CylinderCase {
        aspect: 1.0,
        height: 1.0,
        gravity: 1.0,
        rheology: MuI::new(0.382, 0.643, 0.279, 0.02, 1.0, 1.0),
        cells,
        length_scaled: 2.9,
        whole: false,
        floor: Contact::NoSlip,
    };
    CylinderCollapse::new(&case, options).unwrap()
}

/// Rigid, flowing and falling matter, a surface that crosses cells, followers: the same flow from both.
#[test]
fn cylinder_collapses_alike() {
    let [factors, multigrid] = SOLVERS.map(|solver| {
        let mut collapse = cylinder(16, &options(solver));
        while collapse.time() < 1.5 - 1e-9 {
            collapse.step(1.5).unwrap();
        }
        assert!(collapse.volume_drift().abs() < 1e-12);
        (collapse.flow().state().clone(), collapse.asymmetry())
    });
    let difference = largest_difference(&factors.0.fractions, &multigrid.0.fractions);
    let speeds =
        (0..3).map(|c| largest_difference(&factors.0.velocity[c], &multigrid.0.velocity[c]));
    let speeds = speeds.fold(0.0, f64::max);
    eprintln!(
        "fractions {difference:e}, speeds {speeds:e}, asymmetry {:e}",
        multigrid.1
    );
    assert!(
        difference < 1e-6 && speeds < 1e-6,
        "{difference:e} {speeds:e}"
    );
    assert!(multigrid.1 < 1e-6, "{:e}", multigrid.1);
}

/// The same in a plane, where factors are cheaper. Near the front one cell or the other follows another neighbour
/// for a step, because what is left of a residual decides; the heap is the same.
#[test]
fn column_collapses_alike() {
    let case = CollapseCase {
        aspect: 1.42,
        height: 1.0,
        gravity: 1.0,
        rheology: MuI::new(0.32, 0.60, 0.4, 1.0 / 65.0, 1.0, 1.0),
        cells: 64,
        length_scaled: 5.0,
        overhang_degrees: 0.0,
    };
    let [factors, multigrid] = SOLVERS.map(|solver| {
        let mut collapse = Collapse::new(&case, &options(solver)).unwrap();
        [0.3, 1.5].map(|end| {
            while collapse.time() < end - 1e-9 {
                collapse.step(end).unwrap();
            }
            collapse.flow().heights()
        })
    });
    let early = largest_difference(&factors[0], &multigrid[0]);
    let apart: f64 = factors[1]
        .iter()
        .zip(&multigrid[1])
        .map(|(a, b)| (a - b).abs())
        .sum();
    let apart = apart / factors[1].iter().sum::<f64>();
    eprintln!("heights at t = 0.3 {early:e}, area at t = 1.5 {apart:e}");
    assert!(early < 1e-7 && apart < 5e-4, "{early:e} {apart:e}");
}

/// Steady Bagnold flow down the diagonal of a periodic box, its surface inside a cell: u ∝ 1 − (1 − z/h)^(3/2)
/// with the error of the grid, the same from both.
#[test]
fn bagnold_flow_in_space_is_the_same() {
    let cells = 16;
    let h = 1.25 / cells as f64;
    let fractions = (0..cells)
        .flat_map(|k| std::iter::repeat_n((1.0 / h - k as f64).clamp(0.0, 1.0), 16))
        .collect::<Vec<_>>();
    let along = 0.43_f64.sin() / 2.0_f64.sqrt();
    let [factors, multigrid] = SOLVERS.map(|solver| {
        let across = Axis::Periodic {
            length: 4.0 * h,
            cells: 4,
        };
        let z = Axis::Bounded {
            length: 1.25,
            cells,
            low: Boundary::NoSlip { velocity: 0.0 },
            high: Boundary::FreeSlip,
        };
        let mut flow = SpaceFlow::in_space(
            Grid::with_moving_surface([across, across, z]).unwrap(),
            fractions.clone(),
            MuI::new(0.32, 0.60, 0.4, 0.04, 1.0, 1.0),
            [along, along, -0.43_f64.cos()],
            options(solver),
        )
        .unwrap();
        flow.accelerate_in_place(1e8).unwrap();
        flow.state().velocity.clone()
    });
    let speed = factors[0].iter().fold(0.0_f64, |most, u| most.max(u.abs()));
    for c in 0..3 {
        let difference = largest_difference(&factors[c], &multigrid[c]);
        assert!(difference < 1e-6 * speed, "{c} {difference:e} {speed}");
    }
    assert!(speed > 1.0);
}

#[test]
fn restart_gives_the_same_bits() {
    let options = options(LinearSolver::Multigrid);
    let mut whole = cylinder(12, &options);
    for _ in 0..5 {
        whole.step(f64::INFINITY).unwrap();
    }
    let mut resumed = cylinder(12, &options);
    resumed.set_state(whole.flow().state().clone()).unwrap();
    for _ in 0..5 {
        whole.step(f64::INFINITY).unwrap();
        resumed.step(f64::INFINITY).unwrap();
    }
    assert_eq!(whole.flow().state(), resumed.flow().state());
}
