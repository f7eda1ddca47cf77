//! Ponds at rest over ground that cuts the cells: where a level surface meets a slope the pressure is ρ g times the depth.
use colluvium_continuum::free_surface::{Contact, SurfaceFlow, SurfaceOptions, Terrain};
use colluvium_continuum::grid::{Axis, Boundary, Grid};
use colluvium_continuum::rheology::MuI;
use colluvium_continuum::terrain::Profile;

const ROUGH: Boundary = Boundary::NoSlip { velocity: 0.0 };
const SMOOTH: Boundary = Boundary::FreeSlip;
const DIAMETER: f64 = 1.0 / 30.0;

fn precise() -> SurfaceOptions {
    let mut options = SurfaceOptions {
        growth: 1e9,
        ..SurfaceOptions::default()
    };
    options.solver.strain_rate_floor = 1e-7;
    options.solver.momentum_tolerance = 1e-9;
    options
}

fn pond(slope: f64, level: f64, shift: f64, law: MuI, contact: Contact, exactly: bool) {
    let [columns, rows] = [24, 12];
    let h = 1.0;
    let ground = Profile::new(vec![
        [-30.0, 1.3 + slope * (-30.0 - 12.0 - shift)],
        [60.0, 1.3 + slope * (60.0 - 12.0 - shift)],
    ])
    .unwrap();
    // not below grid: raise
    let ground = Profile::new(ground.points().iter().map(|p| [p[0], p[1]]).collect()).unwrap();
    let surface = Profile::new(vec![[-30.0, level], [60.0, level]]).unwrap();
    let fractions: Vec<f64> = (0..columns * rows)
        .map(|cell| {
            let low = [(cell % columns) as f64 * h, (cell / columns) as f64 * h];
            let high = low.map(|x| x + h);
            ((surface.area_in(low, high) - ground.area_in(low, high)) / (h * h)).max(0.0)
        })
        .collect();
    let bounded = |length, cells, low| Axis::Bounded {
        length,
        cells,
        low,
        high: SMOOTH,
    };
    let mut flow: SurfaceFlow<MuI> = SurfaceFlow::over_ground(
        Grid::with_moving_surface([
            bounded(columns as f64, columns, SMOOTH),
            bounded(rows as f64, rows, ROUGH),
        ])
        .unwrap(),
        &Terrain {
            shape: ground,
            origin: [0.0; 2],
            contact,
            rise: [0; 2],
        },
        fractions.clone(),
        law,
        [0.0, -1.0],
        precise(),
    )
    .unwrap();
    if exactly {
        let mut state = flow.state().clone();
        for (cell, p) in state.pressure.iter_mut().enumerate() {
            if *p > 0.0 {
                *p = (level - (cell / columns) as f64 - 0.5).max(1e-9);
            }
        }
        flow.set_state(state).unwrap();
    }
    for _ in 0..5 {
        flow.step(f64::INFINITY).unwrap();
    }
    let free = flow.free_parts().unwrap().to_vec();
    let mut worst = 0.0_f64;
    for (cell, p) in flow.state().pressure.iter().enumerate() {
        let z = (cell / columns) as f64 + 0.5;
        let exact = level - z;
        let f = flow.state().fractions[cell];
        if *p >= 0.0 && (p - exact).abs() > 2e-4 {
            println!(
                "    cell {} {}: free {:.3} filled {:.3} p {:.4} exact {:.4}",
                cell % columns,
                cell / columns,
                free[cell],
                f,
                p,
                exact
            );
            worst = worst.max((p - exact).abs());
        }
    }
    println!(
        "slope {slope} level {level} shift {shift}: worst {worst:.2e} speed {:.1e}",
        flow.max_speed()
    );
}

#[test]
fn explore() {
    let grains = MuI::new(0.32, 0.60, 0.4, DIAMETER, 1.0, 1.0);
    let without = MuI::new(0.0, 0.0, 0.4, DIAMETER, 1.0, 1.0);
    for (name, law, contact, exactly) in [
        ("grains", grains, Contact::NoSlip, false),
        ("exactly", grains, Contact::NoSlip, true),
        ("without", without, Contact::FreeSlip, false),
        ("without stuck", without, Contact::NoSlip, false),
    ] {
        println!("{name}");
        for slope in [0.2, 0.45, 0.8, 1.0, 1.7] {
            for level in [4.05, 4.3, 4.55, 4.8] {
                for shift in [0.0, 0.37] {
                    pond(slope, level, shift, law, contact, exactly);
                }
            }
        }
    }
}
