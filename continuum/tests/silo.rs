//! A silo that runs out of its floor.

use colluvium_continuum::free_surface::{Contact, SurfaceFlow, SurfaceOptions};
use colluvium_continuum::grid::{Axis, Boundary, Grid};
use colluvium_continuum::rheology::MuI;
use colluvium_continuum::silo::{Silo, SiloCase, SteadyRate};
use rayon::ThreadPoolBuilder;

/// The material of Staron, Lagrée & Popinet (2012), in a silo 90 grains wide.
const WIDTH: f64 = 90.0;
/// A rate is constant if it changes by less than this from one half of the steady window to the other.
const CONSTANT: f64 = 0.02;

/// A silo 90 grain diameters (units of length) wide with an outlet W/`ratio`, filled `depth` W deep, in a unit of g.
fn silo(ratio: f64, depth: f64, cells: usize) -> SiloCase {
    SiloCase {
        width: WIDTH,
        outlet: WIDTH / ratio,
        height: depth * WIDTH,
        gravity: 1.0,
        rheology: MuI::new(0.32, 0.60, 0.4, 1.0, 1.0, 1.0),
        cells,
        walls: Contact::NoSlip,
        floor: Contact::NoSlip,
        whole: false,
    }
}

/// The same without friction, in the material or on walls.
fn frictionless(case: SiloCase) -> SiloCase {
    SiloCase {
        rheology: MuI::new(0.0, 0.0, 0.4, 1.0, 1.0, 1.0),
        walls: Contact::FreeSlip,
        floor: Contact::FreeSlip,
        ..case
    }
}

/// Instants of a run, a quarter of √(L/g) apart, up to a time over √(L/g).
fn instants(case: &SiloCase, until: f64) -> Vec<[f64; 3]> {
    let mut silo = Silo::new(case, &SurfaceOptions::default()).unwrap();
    let mut found = vec![silo.instant()];
    let unit = silo.units().time();
    for nth in 1..=(4.0 * until).round() as usize {
        let time = 0.25 * unit * nth as f64;
        while silo.time() < time * (1.0 - 1e-12) {
            silo.step(time).unwrap();
        }
        found.push(silo.instant());
        assert!(
            silo.volume_drift().abs() < 1e-13,
            "{:e}",
            silo.volume_drift()
        );
    }
    found
}

/// The steady rate, over √g L^{3/2}.
fn steady(case: &SiloCase, until: f64) -> SteadyRate {
    let rate = case.steady_rate(&instants(case, until)).unwrap();
    let unit = case.rate_unit();
    SteadyRate {
        rate: rate.rate / unit,
        first_half: rate.first_half / unit,
        second_half: rate.second_half / unit,
        ..rate
    }
}

/// Under μ(I) a silo runs out at a constant rate; a fluid without friction (control) drains the slower the lower it stands.
#[test]
fn granular_matter_runs_out_at_a_constant_rate_and_a_fluid_does_not() {
    let case = silo(4.0, 1.5, 4);
    let grains = steady(&case, 7.0);
    let fluid = steady(&frictionless(case), 7.0);
    println!("grains {grains:?}\nfluid {fluid:?}");
    assert!(grains.change().abs() < CONSTANT, "{}", grains.change());
    assert!(fluid.change() < -2.0 * CONSTANT, "{}", fluid.change());
    assert!((1.2..1.6).contains(&grains.rate), "{}", grains.rate);
}

/// Material without friction over a floor that is open everywhere falls with g, to round-off, and what has left is W t²/2. On a
/// floor that is closed the same stands still under the pressure of its weight.
#[test]
fn over_an_open_floor_matter_falls_freely() {
    let case = SiloCase {
        outlet: WIDTH,
        height: 2.0 * WIDTH,
        cells: 8,
        whole: true,
        ..frictionless(silo(1.0, 2.0, 8))
    };
    let mut silo = Silo::new(&case, &SurfaceOptions::default()).unwrap();
    let until = 0.9;
    while silo.flow().state().time < until - 1e-12 {
        silo.step(until * silo.units().time()).unwrap();
        let state = silo.flow().state();
        for (cell, fraction) in state.fractions.iter().enumerate() {
            if *fraction > 0.5 {
                let miss = state.velocity[1][cell] / state.velocity_time + 1.0;
                assert!(miss.abs() < 1e-13, "{miss:e}");
            }
        }
        assert!(state.velocity[0].iter().all(|u| *u == 0.0));
    }
    let [_, left] = silo.flow().state().passed;
    assert!((left / (0.5 * until * until) - 1.0).abs() < 1e-12, "{left}");
    assert!(silo.volume_drift().abs() < 1e-14);

    let axis = |cells: usize| Axis::Bounded {
        length: cells as f64 / 8.0,
        cells,
        low: Boundary::FreeSlip,
        high: Boundary::FreeSlip,
    };
    let closed = || {
        let grid = Grid::with_moving_surface([axis(8), axis(18)]).unwrap();
        let fractions = (0..8 * 18).map(|c| f64::from(c < 8 * 16)).collect();
        let law = MuI::new(0.0, 0.0, 0.4, 0.1, 1.0, 1.0);
        SurfaceFlow::at_rest(grid, fractions, law, [0.0, -1.0], SurfaceOptions::default()).unwrap()
    };
    let mut flow = closed();
    while flow.state().time < until - 1e-12 {
        flow.step(until - flow.state().time).unwrap();
    }
    assert!(flow.max_speed() < 1e-12, "{:e}", flow.max_speed());
    for (cell, p) in flow.state().pressure.iter().enumerate().take(8 * 16) {
        let depth = 2.0 - ((cell / 8) as f64 + 0.5) / 8.0;
        assert!((p - depth).abs() < 1e-9, "{p} {depth}");
    }
    let said = |from: f64, to: f64| {
        let refused = closed().with_outlet(from, to).map(drop);
        refused.unwrap_err().to_string()
    };
    for (from, to, key) in [
        (0.3, 0.5, "outlet.from"),
        (0.25, 1.5, "outlet.to"),
        (-0.25, 0.5, "outlet.from"),
        (0.5, 0.5, "outlet.to"),
    ] {
        assert!(said(from, to).contains(key), "{}", said(from, to));
    }
    let twice = closed().with_outlet(0.0, 0.5).unwrap();
    let error = twice.with_outlet(0.5, 1.0).map(drop).unwrap_err();
    assert!(error.to_string().contains("closed"), "{error}");
}

/// A whole silo is its own mirror image, to what its equations are solved to, and half of it beside a smooth wall runs out as it does
/// but for the pressure on that wall, which is extrapolated.
#[test]
fn whole_and_half_silos_run_out_alike() {
    let half = silo(4.0, 1.0, 4);
    let whole = SiloCase {
        whole: true,
        ..half
    };
    let mut closely = SurfaceOptions::default();
    closely.solver.stress_tolerance = 1e-9;
    closely.solver.momentum_tolerance = 1e-9;
    closely.solver.divergence_tolerance = 1e-11;
    closely.solver.tolerance_in_motion = 1.0;
    let run = |case: &SiloCase, options: &SurfaceOptions, until: f64| {
        let mut silo = Silo::new(case, options).unwrap();
        let until = until * silo.units().time();
        while silo.time() < until * (1.0 - 1e-12) {
            silo.step(until).unwrap();
        }
        let (_, heights) = silo.profile();
        let skew = heights
            .iter()
            .zip(heights.iter().rev())
            .fold(0.0_f64, |most, (l, r)| most.max((l - r).abs()));
        (skew / WIDTH, silo.instant()[2])
    };
    let (skew, left) = run(&whole, &closely, 1.0);
    let (_, left_of_half) = run(&half, &closely, 1.0);
    println!("skew {skew:e}, left {left}, of half {left_of_half}");
    assert!(skew < 1e-12, "{skew:e}");
    assert!((left_of_half / left - 1.0).abs() < 5e-3);
}

/// One thread and two make the same bits, and so does a run that goes on from the state of another half way.
#[test]
fn threads_and_restarts_change_no_bit() {
    let case = SiloCase {
        whole: true,
        ..silo(4.0, 1.25, 8)
    };
    let fresh = || Silo::new(&case, &SurfaceOptions::default()).unwrap();
    let steps = 12;
    let advance = |silo: &mut Silo, count: usize| {
        for _ in 0..count {
            silo.step(f64::MAX).unwrap();
        }
    };
    let states = [1, 2].map(|threads| {
        let pool = ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| {
            let mut silo = fresh();
            advance(&mut silo, steps / 2);
            let mut resumed = fresh();
            resumed.set_state(silo.flow().state().clone()).unwrap();
            advance(&mut silo, steps / 2);
            advance(&mut resumed, steps / 2);
            assert!(silo.flow().state() == resumed.flow().state());
            silo.flow().state().clone()
        })
    });
    assert!(states[0] == states[1]);
    assert!(states[0].passed[1] > 0.0);
}

/// Walls and floors of every kind may stand beside an outlet: those of no friction are smooth ones, and those that bear more than the
/// material does are nearly rough ones.
#[test]
fn walls_and_floors_of_every_kind_may_be_there() {
    let coulomb = |friction: f64| {
        Contact::Coulomb(colluvium_continuum::wall_friction::WallFriction {
            friction,
            cohesion: 0.0,
        })
    };
    let left = |walls: Contact, floor: Contact| {
        let case = SiloCase {
            walls,
            floor,
            ..silo(3.0, 1.0, 4)
        };
        let found = instants(&case, 2.5);
        found[found.len() - 1][2] / (case.outlet * case.outlet)
    };
    let pairs = [
        [Contact::FreeSlip, coulomb(0.0)],
        [Contact::NoSlip, coulomb(2.0)],
    ]
    .map(|pair| pair.map(|contact| left(contact, contact)));
    println!("smooth, no friction; rough, much friction: {pairs:?}");
    let [smooth, rough] = pairs.map(|[a, b]| b / a - 1.0);
    assert!(smooth.abs() < 1e-4 && rough.abs() < 0.02, "{pairs:?}");
    // A rough floor makes a funnel of what rests on it: more runs out than over a smooth one (control).
    assert!(pairs[1][0] > 1.03 * pairs[0][0], "{pairs:?}");
}

#[test]
fn silos_out_of_range_are_refused_by_name() {
    let refused = |case: SiloCase| {
        let made = Silo::new(&case, &SurfaceOptions::default()).map(drop);
        made.unwrap_err().to_string()
    };
    let good = silo(4.0, 1.0, 8);
    for (case, key, allowed) in [
        (
            SiloCase {
                outlet: 91.0,
                ..good
            },
            "outlet",
            "at most the width",
        ),
        (SiloCase { cells: 2, ..good }, "grid.cells", "at least 4"),
        (SiloCase { cells: 7, ..good }, "grid.cells", "even"),
        (
            SiloCase {
                width: 91.0,
                ..good
            },
            "width",
            "whole cells",
        ),
        (
            SiloCase {
                height: 1.0,
                ..good
            },
            "height",
            "at least",
        ),
        (
            SiloCase {
                gravity: 0.0,
                ..good
            },
            "gravity",
            "greater than 0",
        ),
    ] {
        let error = refused(case);
        assert!(error.contains(key) && error.contains(allowed), "{error}");
    }
}

/// Beverloo: Q ∝ √g (L − k)^{3/2} over six outlets of 10 to 30 grains.
#[test]
#[ignore = "long: run by tests/validate.sh"]
fn rates_grow_as_beverloo_says() {
    let outlets = [9.0, 7.5, 6.0, 5.0, 4.0, 3.0].map(|ratio| {
        let case = silo(ratio, 1.2, 8);
        (case.outlet, steady(&case, 7.0).rate * case.rate_unit())
    });
    // Q^{2/3} is a line in L, which is zero at k.
    let line = |points: &[(f64, f64)]| {
        let n = points.len() as f64;
        let [mx, my] = [
            points.iter().map(|p| p.0).sum::<f64>() / n,
            points.iter().map(|p| p.1).sum::<f64>() / n,
        ];
        let sxy: f64 = points.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum();
        let sxx: f64 = points.iter().map(|p| (p.0 - mx).powi(2)).sum();
        let slope = sxy / sxx;
        let miss = |p: &(f64, f64)| (p.1 - my - slope * (p.0 - mx)).abs() / p.1;
        let worst = points.iter().map(miss).fold(0.0, f64::max);
        (slope, my - slope * mx, worst)
    };
    let (slope, at_zero, worst) = line(&outlets.map(|(l, q)| (l, q.powf(2.0 / 3.0))));
    let (exponent, ..) = line(&outlets.map(|(l, q)| (l.ln(), q.ln())));
    let (k, c) = (-at_zero / slope, slope.powf(1.5));
    println!(
        "L, Q: {outlets:?}\nC {c}, k {k} d, worst of Q^2/3 {worst}; exponent without k {exponent}"
    );
    assert!((1.45..1.75).contains(&exponent), "{exponent}");
    assert!(worst < 0.02 && k.abs() < 4.0, "{worst} {k}");
}

/// The rate does not depend on the height of the filling as a fluid's does (as √H: a factor of 1.41 from W to 2 W).
#[test]
#[ignore = "long: run by tests/validate.sh"]
fn rates_hardly_depend_on_the_height_of_the_filling() {
    let rates = [1.0, 1.5, 2.0].map(|depth| steady(&silo(4.0, depth, 8), 6.0));
    let fluid = [1.0, 2.0].map(|depth| steady(&frictionless(silo(4.0, depth, 8)), 5.0));
    println!("grains {rates:?}\nfluid {fluid:?}");
    for rate in &rates {
        assert!(rate.change().abs() < CONSTANT, "{rate:?}");
        assert!((rate.rate / rates[0].rate - 1.0).abs() < 0.05, "{rate:?}");
    }
    assert!(fluid[1].rate > 1.3 * fluid[0].rate);
}

/// The rate on 8, 16 and 32 cells across the outlet.
#[test]
#[ignore = "long: run by tests/validate.sh"]
fn rates_converge_with_the_grid() {
    let rates = [8, 16, 32].map(|cells| steady(&silo(4.0, 1.0, cells), 4.5).rate);
    let [a, b] = [rates[1] - rates[0], rates[2] - rates[1]];
    println!("{rates:?}: order {}", (a / b).log2());
    assert!(b.abs() < 0.75 * a.abs(), "{rates:?}");
    assert!(b.abs() < 0.02 * rates[2], "{rates:?}");
}
