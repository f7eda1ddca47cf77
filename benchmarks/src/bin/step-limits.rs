//! The step at which each contact law blows up, measured, beside the estimate, as a Markdown table.
//!
//! `cargo run --release -p colluvium-benchmarks --bin step-limits`

use colluvium_dem::SetupError;
use colluvium_tests::blow_up::{Packings, bisect, trials};

fn main() -> Result<(), SetupError> {
    println!(
        "| law | dashpots | wall: estimate (s) | set by | measured | ratio | packing: pair estimate (s) | measured | ratio | chosen (s) | bound by | share of the packing's limit |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|");
    let mut packings = Packings::default();
    for dashpots in [false, true] {
        for trial in trials(dashpots) {
            let (estimate, name) = trial.wall_estimate();
            let wall = bisect(0.5 * estimate, 2.0 * estimate, |dt| trial.wall_blows_up(dt))?;
            let packing = packings.of(&trial)?;
            let pair = trial.pair_estimate(&packing);
            let packed = bisect(0.05 * pair, 2.0 * pair, |dt| {
                trial.packing_blows_up(&packing, dt)
            })?;
            let (chosen, binding) = trial.chosen(&packing)?;
            let show = |limit: Option<f64>, estimate: f64| match limit {
                Some(limit) => format!("{limit:.3e} | {:.3}", limit / estimate),
                None => "none found | –".into(),
            };
            println!(
                "| {} | {} | {estimate:.3e} | {name} | {} | {pair:.3e} | {} | {chosen:.3e} | {binding} | {} |",
                trial.name,
                if dashpots { "yes" } else { "no" },
                show(wall, estimate),
                show(packed, pair),
                packed.map_or("–".into(), |limit| format!("{:.2}", chosen / limit)),
            );
        }
    }
    Ok(())
}
