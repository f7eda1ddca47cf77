//! Running the binary and reading what it wrote.

use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};
use std::time::Duration;

/// A cliff of some 250 parcels; softer grains than the paper's allow longer steps.
pub const SMALL_COMET_CLIFF: &[&str] = &[
    "coarse_graining=960",
    "material.smallest_diameter=1.5e-3",
    "material.largest_diameter=3e-3",
    "shape.width=9",
    "shape.behind=9",
    "timestep.safety=1",
    "standing=300",
    "output.pictures=1",
    "packing=small",
];

/// With these a hybrid cliff in small hands over two instalments, and some of it stands to the end.
pub const INSTALMENTS: &[&str] = &[
    "model=hybrid",
    "runout.least_share=0.02",
    "runout.steepest_degrees=50",
    "runout.kinetic_share=0.5",
];

/// A bed of 3 800 soft grains, 17 diameters wide and 12 deep.
pub const BED: &[&str] = &[
    "scale=1",
    "speed=2",
    "duration=0.02",
    "ball.radius=0.0025",
    "ball.height=0.004",
    "container.length=0.034",
    "container.width=0.034",
    "container.floor=-0.026",
    "container.grains=3800",
    "contact.youngs_modulus=1e7",
    "surfaces.steel.contact.youngs_modulus=1e8",
    "output.pictures=0",
    "packing=bed",
];

/// Settings of the scene `incline` that take a second: 500 grains' mass, 9 of 16 diameters grains in the hybrid.
pub const SMALL_HYBRID: &[&str] = &[
    "scale=0.85",
    "grains.count=700",
    "overlap.height_diameters=9",
    "contact.stiffness_scaled=2e3",
    "time.relax=0.3",
    "time.average=0.3",
    "time.limit=0.6",
    "slope_degrees=33",
];

/// Settings of the scene `column-collapse` that take seconds: grains in front of a continuum, 10 diameters high.
pub const SMALL_JOINED_COLUMN: &[&str] = &[
    "model=hybrid",
    "aspect=0.36",
    "duration_scaled=4",
    "grid.cells=64",
    "grains.diameter=0.1",
    "grains.width_diameters=4",
    "grains.stiffness_scaled=2e3",
    "grains.packing=small",
    "output.pictures=0",
];

/// With these its edge begins far behind the front and goes out over what rests.
pub const MOVING_EDGE: &[&str] = &[
    "zones.moving=true",
    "zones.edge_scaled=1.2",
    "zones.rest_speed_scaled=0.25",
    "zones.hold_scaled=0.1",
];

/// With these it is wider, and grains lie between a continuum at its wall and one that holds its front.
pub const INTERVAL: &[&str] = &[
    "aspect=0.25",
    "grid.length_scaled=6",
    "grains.packing=wide",
    "zones.x=[0.8, 3.2]",
];

/// With these grains lie at its wall and at its front, and a continuum between them.
pub const CORE: &[&str] = &[
    "aspect=0.25",
    "grid.length_scaled=6",
    "grains.packing=wide",
    "zones.x=[[0, 1], [2.6, 99]]",
];

/// With these grains lie at its wall, and a continuum with its front runs down a slope.
pub const FRONT_ON_A_SLOPE: &[&str] = &[
    "grid.length_scaled=7",
    "grains.packing=slope",
    "zones.x=[[0, 1.5]]",
    "terrain.profile=[[0, 1], [3, 1], [5, 0.45], [8, 0.45]]",
];

/// Every step of a continuum run stands in `steps.csv`, and what the summary says of the steps follows from it.
pub fn steps_say_what_the_summary_says(run: &Path) {
    let (header, rows) = table(&run.join("steps.csv"));
    let column = |name: &str| -> Vec<f64> {
        let at = header.iter().position(|h| h == name).unwrap();
        rows.iter().map(|row| row[at]).collect()
    };
    let sum = |name: &str| column(name).iter().sum::<f64>();
    let most = |name: &str| column(name).into_iter().fold(0.0, f64::max);
    let found = summary(run);
    assert_eq!(rows.len() as f64, value(&found, "steps"));
    assert_eq!(sum("iterations"), value(&found, "newton_iterations"));
    assert_eq!(sum("halvings"), value(&found, "steps_cut"));
    for name in ["momentum", "divergence", "stress"].map(|of| format!("{of}_residual")) {
        let largest = value(&found, &name);
        assert!(largest > 0.0 && most(&name) == largest, "{name} {largest}");
    }
    // Each step was accepted at the floor that was asked for, and begins where the one before ended.
    let asked = value(&found, "strain_rate_floor");
    assert!((most("strain_rate_floor") / asked - 1.0).abs() < 1e-9);
    let (times, lengths) = (column("t"), column("dt"));
    for (n, (t, dt)) in times.iter().zip(&lengths).enumerate() {
        let before = if n == 0 { 0.0 } else { times[n - 1] };
        assert!((before + dt - t).abs() < 1e-9 * t, "{n}: {before} {dt} {t}");
    }
    assert!(column("volume_error").iter().all(|v| v.abs() < 1e-12));
    assert_eq!(
        column("largest_speed").last(),
        Some(&value(&found, "largest_speed"))
    );
}

/// What flows where the equations are ill posed is part of what flows, and the summary tells the largest shares.
pub fn shares_say_what_the_summary_says(run: &Path) {
    let (header, rows) = table(&run.join("flowing.csv"));
    assert_eq!(header, ["t", "flowing_share", "ill_posed_share"]);
    assert!(rows.iter().all(|row| (0.0..=1.0).contains(&row[1])));
    assert!(rows.iter().all(|row| (0.0..=row[1]).contains(&row[2])));
    let most = |at: usize| rows.iter().map(|row| row[at]).fold(0.0, f64::max);
    let found = summary(run);
    assert_eq!(most(1), value(&found, "largest_flowing_share"));
    assert_eq!(most(2), value(&found, "largest_ill_posed_share"));
    assert!(most(1) > 0.3, "{}", most(1));
}

/// Commands that compute.
const WORK: [&str; 4] = ["run", "calibrate", "validate", "pareto"];

/// Runs `colluvium` in a folder; on one thread where nothing else is asked for, as other tests have the other cores.
pub fn colluvium(folder: &Path, arguments: &[&str]) -> Output {
    let works = arguments.first().is_some_and(|first| WORK.contains(first));
    let one = ["--threads", "1"];
    let threads = if works && !arguments.contains(&"--threads") {
        &one[..]
    } else {
        &[]
    };
    Command::new(env!("CARGO_BIN_EXE_colluvium"))
        .args(arguments)
        .args(threads)
        .current_dir(folder)
        .output()
        .unwrap()
}

/// Runs it and expects success; gives stdout.
pub fn succeed(folder: &Path, arguments: &[&str]) -> String {
    let done = colluvium(folder, arguments);
    let message = String::from_utf8_lossy(&done.stderr);
    assert!(done.status.success(), "{arguments:?}: {message}");
    assert!(
        message.is_empty(),
        "not quiet without a terminal: {message}"
    );
    String::from_utf8(done.stdout).unwrap()
}

/// Between two looks at a run that goes on: whoever looks without a pause takes a core from it.
pub fn pause() {
    std::thread::sleep(Duration::from_micros(100));
}

/// The summary of a run directory.
pub fn summary(directory: &Path) -> Value {
    let text = std::fs::read_to_string(directory.join("summary.json")).unwrap();
    serde_json::from_str(&text).unwrap()
}

/// The hash of the final state of a finished run.
pub fn hash(directory: &Path) -> String {
    let summary = summary(directory);
    assert_eq!(summary["status"], "done");
    summary["state_hash"].as_str().unwrap().to_owned()
}

/// The value of a result.
pub fn value(summary: &Value, name: &str) -> f64 {
    summary["results"][name]["value"]
        .as_f64()
        .unwrap_or(f64::NAN)
}

/// A CSV table: header and rows.
pub fn table(path: &Path) -> (Vec<String>, Vec<Vec<f64>>) {
    let mut reader = csv::Reader::from_path(path).unwrap();
    let header = reader.headers().unwrap().iter().map(String::from).collect();
    let rows = reader
        .records()
        .map(|r| {
            r.unwrap()
                .iter()
                .map(|x| x.parse().unwrap_or(f64::NAN))
                .collect()
        })
        .collect();
    (header, rows)
}

/// Columns of a CSV table by name.
#[derive(Debug)]
pub struct Columns(Vec<(String, Vec<f64>)>);

impl Columns {
    /// Of a file.
    pub fn read(path: &Path) -> Columns {
        let (header, rows) = table(path);
        let column = |k: usize| rows.iter().map(|row| row[k]).collect();
        let named = header.into_iter().enumerate();
        Columns(named.map(|(k, name)| (name, column(k))).collect())
    }

    /// A column, where there is one of that name.
    pub fn find(&self, name: &str) -> Option<&[f64]> {
        let found = self.0.iter().find(|(known, _)| known == name);
        found.map(|(_, values)| values.as_slice())
    }

    /// A column.
    pub fn of(&self, name: &str) -> &[f64] {
        let found = self.find(name);
        found.unwrap_or_else(|| panic!("no column {name}"))
    }

    /// Its last value.
    pub fn last(&self, name: &str) -> f64 {
        *self.of(name).last().unwrap()
    }
}
