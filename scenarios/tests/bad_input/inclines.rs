//! Inclines of grains, of continuum, of both, and campaigns on them.

use super::Case;

/// Arguments, and what the message has to contain.
pub const CASES: &[Case] = &[
    (
        &["run", "incline", "--set", "model=grains"],
        &["model", "grains", "dem, continuum, hybrid"],
    ),
    (
        &["run", "incline-moderate", "--set", "model=hybrid"],
        &["rheology", "missing", "hybrid"],
    ),
    (
        &["run", "incline", "--set", "overlap.hight_diameters=9"],
        &["overlap.hight_diameters", "`overlap.height_diameters`"],
    ),
    (
        &["run", "incline", "--set", "overlap.height_diameters=5"],
        &["overlap.height_diameters", "5", "at least a cell"],
    ),
    (
        &["run", "incline", "--set", "overlap.height_diameters=90"],
        &["overlap.height_diameters", "90", "[7.0000, "],
    ),
    (
        &["run", "incline", "--set", "overlap.shell_diameters=4"],
        &["overlap.shell_diameters", "= 4", "buffer"],
    ),
    (
        &["run", "incline", "--set", "overlap.from=3"],
        &["overlap.from", "3", "time.relax"],
    ),
    (
        &["run", "incline", "--set", "overlap.load_time=0.01"],
        &["overlap.load_time", "0.01", "at most"],
    ),
    (
        &["run", "incline", "--set", "overlap.normal_motion=sinking"],
        &["overlap.normal_motion", "sinking", "held, riding"],
    ),
    (
        &["run", "incline", "--set", "overlap.impedance=-1"],
        &["overlap.impedance", "-1", "[0"],
    ),
    (
        &["run", "incline", "--set", "rheology.mu_2=0.1"],
        &["rheology.mu_2", "0.1", "mu_s"],
    ),
    (
        &["run", "incline", "--set", "rheology.file=\"nowhere.toml\""],
        &["rheology.file", "nowhere.toml", "moderate"],
    ),
    (
        &["run", "incline", "--set", "rheology.law=table"],
        &["rheology.law", "table", "mu-i"],
    ),
    (&["calibrate", "incline"], &["model", "hybrid", "dem"]),
    (
        &["run", "incline-moderate", "--set", "slope_degrees=90"],
        &["slope_degrees", "90", "[0, 90)"],
    ),
    (
        &["run", "incline-moderate", "--set", "slope_degrees=-1"],
        &["slope_degrees", "-1", "[0, 90)"],
    ),
    (
        &["run", "incline-moderate", "--set", "slope_degrees=nan"],
        &["slope_degrees", "nan", "[0, 90)"],
    ),
    (
        &["run", "incline-moderate", "--set", "slope_degrees=steep"],
        &["slope_degrees", "steep", "number"],
    ),
    (
        &["run", "incline-moderate", "--set", "slop_degrees=30"],
        &["slop_degrees", "did you mean `slope_degrees`"],
    ),
    (
        &["run", "incline-moderate", "--set", "contact.fricton=1"],
        &["contact.fricton", "`contact.friction`"],
    ),
    (
        &["run", "incline-moderate", "--set", "contact=3"],
        &["contact", "3", "table"],
    ),
    (
        &["run", "incline-moderate", "--set", "seed=1.5"],
        &["seed", "1.5", "integer"],
    ),
    (
        &["run", "incline-moderate", "--set", "seed=-1"],
        &["seed", "-1", "[0"],
    ),
    (
        &["run", "incline-moderate", "--set", "start=\"running\""],
        &["start", "running", "rest, flow"],
    ),
    (
        &["run", "incline-moderate", "--set", "scale=0"],
        &["scale", "0", "[0.84, 50]"],
    ),
    (
        &["run", "incline-moderate", "--set", "grains.diameter=-0.01"],
        &["grains.diameter", "-0.01", "(0, 10]"],
    ),
    (
        &[
            "run",
            "incline-moderate",
            "--set",
            "contact.restitution=1.5",
        ],
        &["contact.restitution", "1.5", "1]"],
    ),
    (
        &["run", "incline-moderate", "--set", "contact.friction=0"],
        &["contact.friction", "0", "rolling"],
    ),
    (
        &["run", "incline-moderate", "--set", "time.limit=0.1"],
        &["time.limit", "0.1", "2.56"],
    ),
    (
        &[
            "run",
            "incline-moderate",
            "--set",
            "calibration.stop.high=10",
        ],
        &["calibration.stop.high", "10", "24"],
    ),
    (
        &[
            "run",
            "incline-moderate",
            "--set",
            "calibration.flow_degrees=[30, 95]",
        ],
        &["calibration.flow_degrees[1]", "95", "90"],
    ),
    (
        &[
            "calibrate",
            "incline-moderate",
            "--set",
            "calibration.depth_choices=[0.5]",
        ],
        &["calibration.depth_choices", "0.5", "flow_degrees = []"],
    ),
    (
        &[
            "calibrate",
            "incline-moderate",
            "--set",
            "calibration.depth_choices=[5.0]",
        ],
        &["calibration.depth_choices[0]", "5", "4"],
    ),
    (
        &[
            "run",
            "incline-moderate",
            "--set",
            "contact.stiffness=1e5",
            "--set",
            "contact.stiffness_scaled=1e4",
        ],
        &["contact.stiffness", "contact.stiffness_scaled", "exclude"],
    ),
    (
        &["run", "incline-moderate", "--set", "slope_degrees"],
        &["KEY=VALUE", "slope_degrees"],
    ),
    (
        &["run", "incline-moderate", "--set", "scene=bagnold"],
        &["scene", "bagnold"],
    ),
    (
        &["pareto", "incline-glass", "--vary", "seed=1,2"],
        &["incline-glass", "--reference"],
    ),
    (
        &["run", "incline-moderate", "--set", "scale=0.5"],
        &["scale", "0.5", "[0.84, 50]"],
    ),
    (
        &[
            "calibrate",
            "incline-moderate",
            "--set",
            "calibration.flow_degrees=[0.0]",
        ],
        &["calibration.flow_degrees[0]", "0", "(0, 90)"],
    ),
    (
        &[
            "run",
            "incline-moderate",
            "--set",
            "grains.count=1000000",
            "--set",
            "scale=50",
        ],
        &["grains.count", "1000000", "at most 8000 at scale 50"],
    ),
    (
        &[
            "run",
            "incline-moderate",
            "--set",
            "floor.length_diameters=1000",
            "--set",
            "floor.width_diameters=1000",
            "--set",
            "scale=3",
        ],
        &["floor.length_diameters", "1000", "at most 222"],
    ),
    (
        &["run", "incline-moderate", "--set", "grains.diameter=1e-200"],
        &["grains.diameter", "heavier"],
    ),
    (
        &[
            "run",
            "incline-moderate",
            "--set",
            "seed=99999999999999999999",
        ],
        &[
            "seed",
            "100000000000000000000",
            "is not allowed",
            "9007199254740991",
        ],
    ),
    (
        &[
            "run",
            "incline-moderate",
            "--set",
            "timestep.steps_per_contact=10",
            "--set",
            "timestep.safety=9",
        ],
        &["timestep.safety", "9", "unstable", "1.0 would do"],
    ),
    (
        &[
            "calibrate",
            "incline-moderate",
            "--set",
            "timestep.safety=4",
            "--set",
            "timestep.steps_per_contact=10",
        ],
        &["timestep.safety", "4", "unstable", "would do"],
    ),
    (
        &["run", "incline-glass", "--set", "timestep.safety=0"],
        &["timestep.safety", "0", "[0.01, 10]"],
    ),
];
