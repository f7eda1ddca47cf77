//! Error and processor time of the continuum's layers beside a peer's, creep at rest, and the growth of
//! short waves: one Markdown report with two plots.
//!
//! `cargo run --release -p colluvium-benchmarks --bin continuum-errors -- results/continuum-errors`
//!
//! The peer is Basilisk C 25-02-26 (own runs, serial, one core of an EPYC under load, ±30 %, from the
//! exact profile to a steady state on N × N cells). Ours are one thread from rest to the steady state;
//! times on another machine compare orders of magnitude only.

use std::error::Error;
use std::fmt::Write;
use std::ops::ControlFlow;
use std::path::PathBuf;

use colluvium_benchmarks::bagnold;
use colluvium_benchmarks::peers::machine::processor_time;
use colluvium_continuum::bagnold::BagnoldCase;
use colluvium_continuum::flow::YieldMethod;
use colluvium_continuum::free_surface::{SurfaceFlow, SurfaceOptions};
use colluvium_continuum::grid::{Axis, Boundary, Grid};
use colluvium_continuum::layer::Options;
use colluvium_continuum::plane_wave::PlaneWaveCase;
use colluvium_continuum::rheology::{BarkerGray, MuI, Rheology, ShearLaw};
use colluvium_continuum::vertical_chute::VerticalChuteCase;
use colluvium_continuum::yield_step::{PrimalDualOptions, RegularisedOptions};
use plotters::prelude::*;

type Outcome<T> = Result<T, Box<dyn Error>>;

/// Cells, relative L2 error and processor time (s) of the peer, on a fixed flat surface.
const PEER_BAGNOLD: [(usize, f64, f64); 4] = [
    (16, 7.22e-3, 0.29),
    (32, 1.97e-3, 0.88),
    (64, 5.21e-4, 2.85),
    (128, 1.39e-4, 11.3),
];
/// The same for the half chute, with the better of its two means of viscosity. On 64 cells it ran with a smaller largest
/// viscosity (10 for 30) and half as long.
const PEER_CHUTE: [(usize, f64, f64); 3] =
    [(16, 5.20e-2, 0.7), (32, 1.95e-2, 1.9), (64, 8.1e-3, 1.6)];
/// The same for a layer under air, in a box higher by a quarter, so that the surface lies inside a cell: the better of a
/// sharp and a filtered interface, 3000 steps.
const PEER_SURFACE: [(usize, f64, f64); 3] =
    [(16, 1.54e-2, 0.9), (32, 6.22e-3, 3.0), (64, 3.75e-3, 11.5)];
/// Processor time (s) for which a case is repeated.
const SAMPLE: f64 = 0.3;

/// A solution and the processor time of one of its runs (s).
fn timed<S>(solve: impl Fn() -> Result<S, colluvium_continuum::Error>) -> Outcome<(S, f64)> {
    let solution = solve()?;
    let start = processor_time().ok_or("no processor time on this system")?;
    let mut runs = 0;
    loop {
        solve()?;
        runs += 1;
        let spent = processor_time().ok_or("no processor time on this system")? - start;
        if spent > SAMPLE {
            return Ok((solution, spent / f64::from(runs)));
        }
    }
}

fn without_progress(_: colluvium_continuum::layer::Progress) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

fn chute(cells: usize, columns: Option<usize>) -> VerticalChuteCase {
    VerticalChuteCase {
        half_width: 1.0,
        load: 1.0,
        gravity: 0.5,
        rheology: bagnold(cells).rheology,
        cells,
        columns,
    }
}

/// Relative L2 error of the velocity of a layer whose surface is found in the cells, from rest to the steady flow.
fn under_a_surface(
    cells: usize,
    columns: Option<usize>,
) -> Result<f64, colluvium_continuum::Error> {
    let case = bagnold(cells);
    let h = 1.25 / cells as f64;
    let across = Axis::Bounded {
        length: 1.25,
        cells,
        low: Boundary::NoSlip { velocity: 0.0 },
        high: Boundary::FreeSlip,
    };
    let along = columns.map_or(Axis::Flat, |cells| Axis::Periodic {
        length: cells as f64 * h,
        cells,
    });
    let width = columns.unwrap_or(1);
    let fractions = (0..cells).flat_map(|k| {
        let fraction = (case.depth / h - k as f64).clamp(0.0, 1.0);
        std::iter::repeat_n(fraction, width)
    });
    let mut options = SurfaceOptions::default();
    options.solver.strain_rate_floor = 1e-7;
    options.solver.momentum_tolerance = 1e-9;
    let mut flow = SurfaceFlow::at_rest(
        Grid::with_moving_surface([along, across])?,
        fractions.collect(),
        case.rheology,
        [case.slope.sin(), -case.slope.cos()],
        options,
    )?;
    flow.accelerate_in_place(ENDLESS)?;
    let (mut miss, mut size) = (0.0, 0.0);
    for (k, row) in flow.state().velocity[0].chunks_exact(width).enumerate() {
        let z = (k as f64 + 0.5) * h;
        if z < case.depth {
            let exact = case.exact_velocity(z);
            miss += row.iter().map(|u| (u - exact).powi(2)).sum::<f64>();
            size += exact * exact * width as f64;
        }
    }
    Ok((miss / size).sqrt())
}

/// A step as long as this leads to the steady flow.
const ENDLESS: f64 = 1e8;

/// (time, error) of one curve.
type Curve = Vec<(f64, f64)>;

/// Rows of one case, on the peer's grids and finer ones; gives the curves of the peer, of ours along one axis and on N × N cells.
fn compare(
    page: &mut String,
    name: &str,
    peer: &[(usize, f64, f64)],
    finer: &[usize],
    solve: impl Fn(usize, Option<usize>) -> Result<f64, colluvium_continuum::Error>,
) -> Outcome<[Curve; 3]> {
    writeln!(
        page,
        "\n## {name}\n\n| cells | peer: error | s | ours: error | order | s, nothing along x | s, N × N |\n|---|---|---|---|---|---|---|"
    )?;
    let mut curves: [Curve; 3] = Default::default();
    let mut before: Option<f64> = None;
    let known = peer.iter().map(|row| (row.0, Some((row.1, row.2))));
    for (cells, theirs) in known.chain(finer.iter().map(|cells| (*cells, None))) {
        let (error, flat_time) = timed(|| solve(cells, None))?;
        let (_, square_time) = timed(|| solve(cells, Some(cells)))?;
        let order = before.map_or("–".into(), |b| format!("{:.2}", (b / error).log2()));
        let shown = theirs.map_or("– | –".into(), |(error, time)| {
            format!("{error:.2e} | {time}")
        });
        writeln!(
            page,
            "| {cells} | {shown} | {error:.2e} | {order} | {flat_time:.2e} | {square_time:.2e} |"
        )?;
        before = Some(error);
        curves[0].extend(theirs.map(|(error, time)| (time, error)));
        curves[1].push((flat_time, error));
        curves[2].push((square_time, error));
    }
    Ok(curves)
}

/// Speeds of a layer that should rest, on a slope of tan⁻¹ 0.25.
fn creep(page: &mut String) -> Outcome<()> {
    writeln!(
        page,
        "\n## Creep of a layer at rest (tan θ = 0.25, μ_s = 0.32; in √(g H))\n\n| method | surface speed | expected |\n|---|---|---|"
    )?;
    let case = BagnoldCase {
        slope: 0.25_f64.atan(),
        ..bagnold(64)
    };
    for largest_viscosity in [10.0, 100.0, 1e3, 1e4] {
        let options = Options {
            method: YieldMethod::Regularised(RegularisedOptions {
                largest_viscosity,
                passes: 1,
            }),
            ..Options::default()
        };
        let speed = case.solve(&options, &mut without_progress)?.max_speed;
        let expected = case.slope.sin() / (2.0 * largest_viscosity);
        writeln!(
            page,
            "| η_max = {largest_viscosity:e} ρ√(gH³) | {speed:.4e} | g sinθ H²/(2 η_max) = {expected:.4e} |"
        )?;
    }
    let ratio: f64 = 0.25 / 0.32;
    for strain_rate_floor in [1e-4, 1e-5, 1e-6, 1e-7] {
        let options = Options {
            method: YieldMethod::PrimalDual(PrimalDualOptions {
                strain_rate_floor,
                ..PrimalDualOptions::default()
            }),
            ..Options::default()
        };
        let speed = case.solve(&options, &mut without_progress)?.max_speed;
        let expected = strain_rate_floor * ratio / (1.0 - ratio * ratio).sqrt();
        writeln!(
            page,
            "| primal–dual, ε = {strain_rate_floor:e} √(g/H) | {speed:.4e} | ε r/√(1 − r²) = {expected:.4e} |"
        )?;
    }
    let cured = BagnoldCase {
        slope: case.slope,
        depth: case.depth,
        gravity: case.gravity,
        rheology: BarkerGray::of(case.rheology)?,
        cells: case.cells,
        columns: None,
    };
    let solution = cured.solve(&Options::default(), &mut without_progress)?;
    writeln!(
        page,
        "| Barker & Gray's law, ε = 1e-6 √(g/H) | {:.4e} | exact {:.4e} |",
        solution.max_speed,
        cured.exact_velocity(cured.depth)
    )?;
    Ok(())
}

/// An inertial number outside the well-posed window of the layers' material.
const ILL_POSED: f64 = 0.003;
/// Grids of the waves.
const WAVE_GRIDS: [usize; 4] = [16, 32, 64, 128];

fn wave_case<L: ShearLaw>(rheology: L, waves: usize, cells: usize) -> PlaneWaveCase<L> {
    let rate = ILL_POSED / 0.04;
    // The fastest direction of the bare law, for both.
    let direction = bagnold(4)
        .rheology
        .threshold(rate, 1.0)
        .fastest_direction()
        .unwrap_or(0.0);
    PlaneWaveCase {
        side: 1.0,
        rate,
        pressure: 1.0,
        direction,
        waves: [waves, 0],
        rheology,
        cells,
    }
}

/// (wavenumber, growth) of the waves that a grid resolves with four cells or more.
fn dispersion<L: ShearLaw + Clone>(rheology: L, cells: usize) -> Outcome<Curve> {
    (1..=cells / 4)
        .map(|waves| {
            let wave = wave_case(rheology.clone(), waves, cells).solve()?;
            Ok((wave.wavenumber, wave.growth))
        })
        .collect()
}

fn exact_dispersion<L: ShearLaw + Clone>(rheology: L) -> Curve {
    (1..=32)
        .map(|waves| {
            let wave = wave_case(rheology.clone(), waves, 128);
            (std::f64::consts::TAU * waves as f64, wave.exact_growth())
        })
        .collect()
}

fn waves(page: &mut String, folder: &std::path::Path) -> Outcome<()> {
    let bare: MuI = bagnold(4).rheology;
    let cured = BarkerGray::of(bare)?;
    writeln!(
        page,
        "\n## Growth of short waves at I = {ILL_POSED}, outside the well-posed window\n\nFastest growth (√(p/ρ)/L) among the waves that four cells or more resolve; amplification of all of them together after 0.1 L√(ρ/p).\n\n| cells | bare μ(I): fastest | amplification | Barker & Gray: fastest | amplification |\n|---|---|---|---|---|"
    )?;
    let fastest = |curve: &Curve| curve.iter().fold(f64::NEG_INFINITY, |m, (_, g)| m.max(*g));
    let mut curves = Vec::new();
    for cells in WAVE_GRIDS {
        let (raw, tame) = (dispersion(bare, cells)?, dispersion(cured, cells)?);
        let amplified = |value: Result<f64, colluvium_continuum::Error>| {
            value.map_or("no convergence".to_owned(), |a| format!("{a:.3e}"))
        };
        let (raw_gain, tame_gain) = if cells <= 64 {
            (
                amplified(wave_case(bare, 1, cells).amplification(0.1)),
                amplified(wave_case(cured, 1, cells).amplification(0.1)),
            )
        } else {
            ("–".into(), "–".into())
        };
        writeln!(
            page,
            "| {cells} | {:.3} | {raw_gain} | {:.4} | {tame_gain} |",
            fastest(&raw),
            fastest(&tame)
        )?;
        curves.push((format!("bare, {cells} cells"), raw));
        if cells == 128 {
            curves.push(("cured, 128 cells".into(), tame));
        }
    }
    curves.push(("bare, exact".into(), exact_dispersion(bare)));
    curves.push(("cured, exact".into(), exact_dispersion(cured)));
    let path = folder.join("wave_growth.svg");
    let canvas = SVGBackend::new(&path, (760, 480)).into_drawing_area();
    canvas.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&canvas)
        .margin(12)
        .x_label_area_size(42)
        .y_label_area_size(64)
        .build_cartesian_2d(0.0..210.0, -150.0..800.0)?;
    chart
        .configure_mesh()
        .x_desc("wavenumber k L")
        .y_desc("growth σ L √(ρ/p)")
        .draw()?;
    draw(&mut chart, &curves)?;
    canvas.present()?;
    Ok(())
}

/// Draws curves with a legend: exact ones as lines, measured ones with dots.
fn draw<'a, X, Y>(
    chart: &mut ChartContext<'a, SVGBackend<'a>, Cartesian2d<X, Y>>,
    curves: &[(String, Curve)],
) -> Outcome<()>
where
    X: plotters::coord::ranged1d::Ranged<ValueType = f64> + 'a,
    Y: plotters::coord::ranged1d::Ranged<ValueType = f64> + 'a,
{
    for (n, (label, curve)) in curves.iter().enumerate() {
        let colour = Palette99::pick(n).to_rgba();
        chart
            .draw_series(LineSeries::new(curve.iter().copied(), &colour))?
            .label(label)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], colour));
        if !label.contains("exact") {
            chart.draw_series(
                curve
                    .iter()
                    .map(|point| Circle::new(*point, 2, colour.filled())),
            )?;
        }
    }
    chart
        .configure_series_labels()
        .background_style(WHITE.mix(0.8))
        .border_style(BLACK)
        .draw()?;
    Ok(())
}

fn speed_against_error(folder: &std::path::Path, curves: &[(String, Curve)]) -> Outcome<()> {
    let path = folder.join("speed_error.svg");
    let canvas = SVGBackend::new(&path, (760, 480)).into_drawing_area();
    canvas.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&canvas)
        .margin(12)
        .x_label_area_size(42)
        .y_label_area_size(64)
        .build_cartesian_2d((1e-5..100.0).log_scale(), (1e-6..0.1).log_scale())?;
    chart
        .configure_mesh()
        .x_desc("processor time (s)")
        .y_desc("relative L2 error of velocity")
        .draw()?;
    draw(&mut chart, curves)?;
    canvas.present()?;
    Ok(())
}

fn main() -> Outcome<()> {
    let folder = PathBuf::from(
        std::env::args()
            .nth(1)
            .unwrap_or_else(|| "results/continuum-errors".into()),
    );
    std::fs::create_dir_all(&folder)?;
    let mut page = String::from("# Continuum: errors, processor time, creep, short waves\n");
    let options = Options::default();
    let layers = compare(
        &mut page,
        "Bagnold flow",
        &PEER_BAGNOLD,
        &[],
        |cells, columns| {
            BagnoldCase {
                columns,
                ..bagnold(cells)
            }
            .solve(&options, &mut without_progress)
            .map(|solution| solution.velocity_error_l2_relative)
        },
    )?;
    let surfaces = compare(
        &mut page,
        "Bagnold flow, its surface inside a cell",
        &PEER_SURFACE,
        &[128],
        under_a_surface,
    )?;
    let chutes = compare(
        &mut page,
        "Half chute with a plug",
        &PEER_CHUTE,
        &[],
        |cells, columns| {
            chute(cells, columns)
                .solve(&options, &mut without_progress)
                .map(|solution| solution.velocity_error_l2_relative)
        },
    )?;
    let named = |case: &str, curves: [Curve; 3]| {
        let names = ["Basilisk, N × N", "ours, one axis", "ours, N × N"];
        names
            .iter()
            .map(|name| format!("{case}: {name}"))
            .zip(curves)
            .collect::<Vec<_>>()
    };
    let mut curves = named("Bagnold", layers);
    curves.extend(named("surface", surfaces));
    curves.extend(named("chute", chutes));
    speed_against_error(&folder, &curves)?;
    creep(&mut page)?;
    waves(&mut page, &folder)?;
    std::fs::write(folder.join("report.md"), &page)?;
    println!("{page}");
    Ok(())
}
