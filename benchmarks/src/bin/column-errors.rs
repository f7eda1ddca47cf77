//! Speed against error of collapsing columns: how far the heap at rest lies from that on twice as many cells, and the processor
//! time that it took, beside a peer's by the same measure.
//!
//! ```text
//! change(N) = ∫|h_N − h_2N| dx / A
//! ```
//! Ours is the heap at rest, the peer's that at t = 6 √(H/g), when it still moves.
//!
//! `cargo run --release -p colluvium-benchmarks --bin column-errors` runs the column of a = 0.5 on 32 to 256 cells along x;
//! `--aspect 1.42 --from 32 --doublings 3` another. Prints Markdown; `--svg FILE` draws it.

use std::error::Error;
use std::path::{Path, PathBuf};

use clap::Parser;
use colluvium_benchmarks::columns::{COLUMNS, Column, Profile};
use colluvium_benchmarks::peers::machine::processor_time;
use colluvium_continuum::column_collapse::Collapse;
use colluvium_continuum::free_surface::SurfaceOptions;
use plotters::prelude::*;

type Outcome<T> = Result<T, Box<dyn Error>>;

/// Last time at which a column may come to rest, in √(H/g).
const LONGEST: f64 = 15.0;
/// Courant number of the scene.
const COURANT: f64 = 0.9;

#[derive(Parser)]
struct Arguments {
    /// Aspect ratio H/L: 0.5, 1.42 or 6.26.
    #[arg(long, default_value_t = 0.5)]
    aspect: f64,
    /// Fewest cells along x.
    #[arg(long, default_value_t = 32, value_parser = clap::value_parser!(u32).range(8..=4096))]
    from: u32,
    /// How often they are doubled.
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=6))]
    doublings: u32,
    /// Picture to draw.
    #[arg(long)]
    svg: Option<PathBuf>,
}

/// The heap at rest on so many cells, the time of rest and the processor time (s).
fn heap(column: &Column, cells: usize) -> Outcome<(Profile, f64, f64)> {
    let options = SurfaceOptions {
        courant: COURANT,
        ..SurfaceOptions::default()
    };
    let now = || processor_time().ok_or("no processor time on this system");
    let start = now()?;
    let mut collapse = Collapse::new(&column.case(cells), &options)?;
    while collapse.time() < LONGEST {
        let step = collapse.step(LONGEST)?;
        if collapse.is_at_rest(&step) {
            let time = collapse.time();
            return Ok((Profile::of(&collapse), time, now()? - start));
        }
    }
    Err(format!("{cells} cells: no rest until t = {LONGEST}").into())
}

/// Changes against processor time, by cells.
type Changes = Vec<(usize, f64, f64)>;

fn draw(path: &Path, aspect: f64, curves: &[(&str, Changes)]) -> Outcome<()> {
    let canvas = SVGBackend::new(path, (640, 400)).into_drawing_area();
    canvas.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&canvas)
        .caption(
            format!("heap of a column, a = {aspect}"),
            ("sans-serif", 15),
        )
        .margin(12)
        .x_label_area_size(42)
        .y_label_area_size(64)
        .build_cartesian_2d((0.1..1000.0).log_scale(), (1e-4..0.1).log_scale())?;
    chart
        .configure_mesh()
        .x_desc("processor time (s)")
        .y_desc("change on twice as many cells, of the area")
        .draw()?;
    for (n, (name, changes)) in curves.iter().enumerate() {
        let colour = Palette99::pick(n).to_rgba();
        let points: Vec<_> = changes.iter().map(|(_, s, change)| (*s, *change)).collect();
        chart
            .draw_series(LineSeries::new(points.iter().copied(), &colour))?
            .label(*name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], colour));
        chart.draw_series(points.iter().map(|p| Circle::new(*p, 3, colour.filled())))?;
        chart.draw_series(changes.iter().map(|(cells, s, change)| {
            Text::new(
                cells.to_string(),
                (*s * 1.12, *change * 1.04),
                ("sans-serif", 12),
            )
        }))?;
    }
    chart
        .configure_series_labels()
        .background_style(WHITE.mix(0.8))
        .border_style(BLACK)
        .draw()?;
    canvas.present()?;
    Ok(())
}

fn main() -> Outcome<()> {
    let arguments = Arguments::parse();
    let column = COLUMNS
        .iter()
        .find(|column| column.aspect == arguments.aspect)
        .ok_or_else(|| format!("--aspect {}: 0.5, 1.42 or 6.26", arguments.aspect))?;
    let area = 1.0 / column.aspect;
    println!("# Heap of a column, a = {}\n", column.aspect);
    println!("| cells | time of rest, √(H/g) | CPU s | change on twice as many, of the area |");
    println!("|---|---|---|---|");
    let mut changes = Changes::new();
    let mut coarse: Option<(usize, Profile, f64, f64)> = None;
    for doubling in 0..=arguments.doublings {
        let cells = (arguments.from as usize) << doubling;
        let (profile, rest, seconds) = heap(column, cells)?;
        if let Some((cells, before, rest, seconds)) = coarse {
            let change = before.apart(&profile) / area;
            println!("| {cells} | {rest:.2} | {seconds:.2} | {change:.2e} |");
            changes.push((cells, seconds, change));
        }
        coarse = Some((cells, profile, rest, seconds));
    }
    if let Some((cells, _, rest, seconds)) = coarse {
        println!("| {cells} | {rest:.2} | {seconds:.2} | – |");
    }
    for (cells, seconds, change) in column.peer_changes {
        println!("| Basilisk, {cells} | – | {seconds} | {change:.2e} |");
    }
    if let Some(path) = &arguments.svg {
        let peer = column.peer_changes.to_vec();
        draw(
            path,
            column.aspect,
            &[("Basilisk, air beside it", peer), ("Colluvium", changes)],
        )?;
    }
    Ok(())
}
