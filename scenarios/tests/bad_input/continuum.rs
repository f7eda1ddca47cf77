//! The layer of continuum and its rheologies.

use super::Case;

/// Arguments, and what the message has to contain.
pub const CASES: &[Case] = &[
    (
        &["run", "bagnold", "--set", "grid.cells=-3"],
        &["grid.cells", "-3", "[4, 4096]"],
    ),
    (
        &["run", "bagnold", "--set", "grid.columns=2"],
        &["grid.columns", "2", "3 to 256"],
    ),
    (
        &["run", "bagnold", "--set", "slope_degrees=60"],
        &["slope_degrees", "60", "39.18"],
    ),
    (
        &["run", "bagnold", "--set", "rheology.mu_2=0.1"],
        &["rheology.mu_2", "0.1", "0.506"],
    ),
    (
        &["run", "bagnold", "--set", "rheology.law=coulombe"],
        &["rheology.law", "coulombe", "barker-gray"],
    ),
    (
        &["run", "bagnold", "--set", "rheology.alpha=1.5"],
        &["rheology.alpha", "1.5", "mu-i", "mu_s, mu_2, i_0"],
    ),
    (
        &["run", "bagnold", "--set", "rheology.law=table"],
        &["rheology.table", "missing", "[[I, mu], ...]"],
    ),
    (
        &[
            "run",
            "bagnold",
            "--set",
            "rheology.law=table",
            "--set",
            "rheology.table=[[0, 0.5], [0.1, 0.4]]",
        ],
        &["rheology.table", "0.4", "the point before, 0.5"],
    ),
    (
        &["run", "bagnold", "--set", "rheology.law=coulomb"],
        &["slope_degrees", "33", "26.8394"],
    ),
    (
        &["run", "bagnold", "--set", "rheology.file=missing.toml"],
        &["rheology.file", "missing.toml", "cannot read"],
    ),
    (
        &[
            "run",
            "bagnold",
            "--set",
            "rheology.file=law.toml",
            "--set",
            "rheology.mu_s=0.4",
        ],
        &["rheology.file", "rheology.mu_s", "exclude"],
    ),
    (
        &["run", "bagnold", "--set", "rheology.file=law.toml"],
        &["rheology.file", "law.toml", "mu_2", "0.1"],
    ),
    (
        &["run", "bagnold", "--set", "rheology.file=not.toml"],
        &["rheology.file", "not.toml"],
    ),
    (
        &[
            "run",
            "bagnold",
            "--set",
            "grid.cells=4096",
            "--set",
            "grid.columns=256",
        ],
        &["grid.cells", "4096", "200000", "grid.columns"],
    ),
    (
        &["run", "bagnold", "--set", "rheology.valid_i=[0.5, 0.1]"],
        &["rheology.valid_i", "[0.5, 0.1]", "low < high"],
    ),
    (
        &["run", "bagnold", "--set", "rheology.file=steep.toml"],
        &["rheology.file", "steep.toml", "rheology.mu_s", "[0, 5]"],
    ),
    (
        &[
            "run",
            "column-collapse",
            "--set",
            "model=hybrid",
            "--set",
            "rheology.mu_s=0.5",
        ],
        &["rheology.mu_s", "grains.calibrated = \"moderate\""],
    ),
    (
        &[
            "run",
            "column-collapse",
            "--set",
            "model=hybrid",
            "--set",
            "grains.calibrated=none",
            "--set",
            "rheology.cohesion=10",
        ],
        &["rheology.cohesion", "10", "0 with model"],
    ),
    (
        &[
            "run",
            "column-collapse",
            "--set",
            "model=hybrid",
            "--set",
            "grains.calibrated=none",
            "--set",
            "rheology.law=coulomb",
            "--set",
            "rheology.viscosity=1",
        ],
        &["rheology.law", "coulomb", "mu-i with model"],
    ),
    (
        &["run", "column-collapse", "--set", "height=1e-3"],
        &[
            "rheology.diameter",
            "0.0333",
            "at most the height",
            "0.001 m",
        ],
    ),
];
