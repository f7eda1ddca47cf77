//! Preparations in scenes of one's own: every step, every law of sizes, regions of any shape, and what is said of them.

use super::grains;
use crate::command::{Columns, colluvium, succeed, summary, value};
use serde_json::Value;
use std::path::Path;

/// A law, kinds of grains to come.
pub const BASE: &str = r#"
scene = "grains"
seed = 5
duration = 0.001
output = { rows = 2, pictures = 0 }

[contact]
normal = "hertz"
youngs_modulus = 1.0e6
poissons_ratio = 0.3
restitution = 0.4
friction = 0.4
cohesion = "dmt"
work_of_adhesion = 0.1

"#;

/// A tube with a floor under gravity.
pub const TUBE: &str = r#"
[gravity]
uniform = [0.0, 0.0, -9.81]

[walls.floor]
shape = "plane"
axis = [0.0, 0.0, 1.0]

[walls.tube]
shape = "cylinder"
axis = [0.0, 0.0, 1.0]
radius = 0.03
"#;

pub const EQUAL: &str =
    "[grains.ball]\ndensity = 1000.0\nsizes = { law = \"equal\", radius = 0.005 }\n";

fn run(folder: &Path, out: &str, sections: &[&str]) -> Value {
    std::fs::write(folder.join("own.toml"), sections.concat()).unwrap();
    succeed(folder, &["run", "own.toml", "--out", out]);
    summary(&folder.join(out))
}

/// All notes of a step of the preparation.
fn notes(found: &Value, step: &str) -> Vec<String> {
    let all = found["preparation"].as_array().unwrap().iter();
    let own = all.filter(|note| note["step"] == step);
    own.map(|note| note["text"].as_str().unwrap().to_owned())
        .collect()
}

/// Every preparation ends with these.
fn check_report(found: &Value, of: &str) {
    let packing = notes(found, "packing");
    assert_eq!(packing.len(), 1, "{of}");
    for word in [
        "solid fraction",
        "contacts a grain",
        "kinetic energy",
        "unbalanced force",
    ] {
        assert!(packing[0].contains(word), "{of}: {packing:?}");
    }
    let sizes = notes(found, "sizes");
    assert!(!sizes.is_empty(), "{of}");
    for text in sizes {
        assert!(
            text.contains("asked for in brackets") && text.contains("Kolmogorov"),
            "{of}: {text}"
        );
    }
}

#[test]
fn every_step_says_what_it_has_come_to() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let above = "within = [{ shape = \"cylinder\", axis = [0.0, 0.0, 1.0], point = [0.0, 0.0, 0.0], radius = 0.029 }, \
                 { shape = \"block\", lower = [-1.0, -1.0, 0.05], upper = [1.0, 1.0, 0.12] }]\n";
    let poured = format!("\n[[prepare]]\ndo = \"pour\"\ncount = 80\n{above}");
    let inserted = format!(
        "\n[[prepare]]\ndo = \"insert\"\nsolid_fraction = 0.2\n{above}\n[[prepare]]\ndo = \"relax\"\n"
    );
    let staged = format!("{poured}\n[[prepare]]\ndo = \"stages\"\ngravities = [9.81, 1.0e-2]\n");
    let low = "\n[[prepare]]\ndo = \"glue\"\nwithin = [{ shape = \"block\", upper = [1.0, 1.0, 0.006] }]\n";
    for (name, steps, words) in [
        ("poured", poured.clone(), &["pour"][..]),
        ("inserted", inserted, &["insert", "relax"]),
        ("staged", staged, &["pour", "stage"]),
        ("glued", format!("{poured}{low}"), &["glue"]),
    ] {
        let found = run(at, name, &[BASE, EQUAL, TUBE, &steps]);
        check_report(&found, name);
        for word in words {
            assert!(!notes(&found, word).is_empty(), "{name}: {word}");
        }
        if name == "staged" {
            // Stiffness and step follow gravity from stage to stage.
            let stages = notes(&found, "stage");
            assert_eq!(stages.len(), 2, "{stages:?}");
            assert!(
                stages[0] != stages[1] && stages[1].contains("1.000e-2"),
                "{stages:?}"
            );
        }
    }
    let cloud = "\n[[prepare]]\ndo = \"insert\"\nsolid_fraction = 0.2\n\
                 within = [{ shape = \"ball\", point = [0.0, 0.0, 0.0], radius = 0.06 }]\n\
                 \n[[prepare]]\ndo = \"compact\"\nsolid_fraction = 0.52\nradius = 0.025\naccelerations = [0.1, 10.0]\ntolerance = 0.1\n";
    let jam = "\n[[prepare]]\ndo = \"jam\"\ncount = 100\n";
    let grow = "\n[[prepare]]\ndo = \"grow\"\ncount = 128\n\n[[prepare]]\ndo = \"scale\"\nfactor = 2.0\n\
                \n[[prepare]]\ndo = \"place\"\npoint = [1.0, 0.0, 0.0]\nturn_degrees = [0.0, 90.0, 0.0]\n";
    let dry = BASE.replace("cohesion = \"dmt\"\nwork_of_adhesion = 0.1\n", "");
    for (name, base, steps, word) in [
        ("compacted", BASE, cloud, "compact"),
        ("jammed", dry.as_str(), jam, "jam"),
        ("grown", BASE, grow, "grow"),
    ] {
        let found = run(at, name, &[base, EQUAL, steps]);
        check_report(&found, name);
        assert_eq!(notes(&found, word).len(), 1, "{name}");
    }
    let centre = value(&summary(&at.join("grown")), "centre_of_mass_x");
    assert!((centre - 1.0).abs() < 0.05, "{centre}");
    // What was doubled is not what was asked for, and the report says so.
    let sizes = notes(&summary(&at.join("grown")), "sizes");
    assert!(sizes[0].contains("1.0000e-2 (5.0000e-3)"), "{sizes:?}");
}

#[test]
fn every_law_of_sizes_is_met_as_well_as_chance_allows() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let cloud = "\n[[prepare]]\ndo = \"insert\"\ncount = 600\n\
                 within = [{ shape = \"block\", lower = [0.0, 0.0, 0.0], upper = [0.2, 0.2, 0.2] }]\n";
    for (k, (law, mean)) in [
        (
            "law = \"uniform\", smallest = 0.003, largest = 0.005",
            0.004,
        ),
        (
            "law = \"uniform\", smallest = 0.003, largest = 0.005, by = \"mass\"",
            f64::NAN,
        ),
        (
            "law = \"gaussian\", radius = 0.004, relative_deviation = 0.2, cut = 1.0",
            0.004,
        ),
        (
            "law = \"power-law\", smallest = 0.003, largest = 0.006, index = 2.5",
            f64::NAN,
        ),
        (
            "law = \"binned-power-law\", smallest = 0.003, largest = 0.006, index = 2.5, bins = 8",
            f64::NAN,
        ),
        (
            "law = \"list\", radii = [0.003, 0.005], shares = [3.0, 1.0]",
            0.0035,
        ),
    ]
    .into_iter()
    .enumerate()
    {
        let kind = format!("[grains.ball]\ndensity = 1000.0\nsizes = {{ {law} }}\n");
        let found = run(at, &format!("law{k}"), &[BASE, &kind, cloud]);
        check_report(&found, law);
        let text = notes(&found, "sizes").concat();
        // "Kolmogorov distance D, by chance up to C"
        let (_, rest) = text.split_once("Kolmogorov distance ").unwrap();
        let (distance, chance) = rest.split_once(", by chance up to ").unwrap();
        let [distance, chance]: [f64; 2] =
            [distance, chance].map(|word| word.trim().parse().unwrap());
        assert!(distance < 1.2 * chance, "{law}: {text}");
        let radii = grains(&at.join(format!("law{k}")), ["radius"]);
        let found = radii.iter().map(|[r]| r).sum::<f64>() / 600.0;
        assert!(
            mean.is_nan() || (found / mean - 1.0).abs() < 0.03,
            "{law}: {found}"
        );
    }
}

/// A cube of edge 2 about the origin, as OBJ with squares.
const CUBE: &str = "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n\
                    f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

#[test]
fn regions_of_any_shape_trim_glue_and_bond() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::write(at.join("cube.obj"), CUBE).unwrap();
    std::fs::write(at.join("open.obj"), CUBE.replace("f 5 6 7 8\n", "")).unwrap();
    let block = "\n[[prepare]]\ndo = \"insert\"\nsolid_fraction = 0.25\n\
                 within = [{ shape = \"block\", lower = [-0.1, -0.1, -0.1], upper = [0.1, 0.1, 0.1] }]\n";
    let trim = |within: &str| format!("{block}\n[[prepare]]\ndo = \"trim\"\nwithin = [{within}]\n");
    let half = "{ shape = \"block\", lower = [-0.05, -0.05, -0.05], upper = [0.05, 0.05, 0.05] }";
    let left = |name: &str, within: &str| {
        run(at, name, &[BASE, EQUAL, &trim(within)]);
        grains(&at.join(name), ["x", "y", "z"])
    };
    // The same cube as a block and as a mesh in units of 5 cm; a mesh and what it leaves out are all of it.
    let by_block = left("block", half);
    let by_mesh = left(
        "mesh",
        "{ shape = \"mesh\", file = \"cube.obj\", unit = 0.05 }",
    );
    assert!(by_block.len() > 20);
    assert_eq!(by_block, by_mesh);
    let rest = left(
        "rest",
        "{ shape = \"mesh\", file = \"cube.obj\", unit = 0.05, outside = true }",
    );
    let all = left("all", "{ shape = \"block\" }");
    assert_eq!(rest.len() + by_mesh.len(), all.len());
    // Either of two balls, not what lies in neither.
    let balls = "{ shape = \"any\", of = [{ shape = \"ball\", point = [0.05, 0.0, 0.0], radius = 0.04 }, \
                 { shape = \"ball\", point = [-0.05, 0.0, 0.0], radius = 0.03 }] }";
    let either = left("either", balls);
    let inside = |[x, y, z]: &[f64; 3]| {
        let far = |c: f64| ((x - c).powi(2) + y * y + z * z).sqrt();
        far(0.05) <= 0.04 || far(-0.05) <= 0.03
    };
    assert_eq!(either.len(), all.iter().filter(|x| inside(x)).count());
    assert!(either.iter().all(inside));

    // Bonds in a layer alone, a crack across it, boulders with a law of their sizes.
    let dense = "\n[[prepare]]\ndo = \"insert\"\nsolid_fraction = 0.29\n\
                 within = [{ shape = \"block\", lower = [-0.12, -0.12, -0.03], upper = [0.12, 0.12, 0.03] }]\n";
    let glue = |within: &str| {
        format!(
            "\n[bonds.glue]\ngap = 0.25\nyoungs_modulus = 1.0e6\nstiffness_ratio = 3.5\nradius_ratio = 0.3\nwithin = [{within}]\n"
        )
    };
    let layer = glue(
        "{ shape = \"slab\", point = [0.0, 0.0, 0.0], axis = [0.0, 0.0, 1.0], thickness = 0.03 }",
    );
    let crack = "\n[cracks.one]\nwithin = [{ shape = \"slab\", point = [0.0, 0.0, 0.0], axis = [1.0, 0.0, 0.0], thickness = 0.022 }]\n";
    let bonds = |name: &str, more: &[&str]| {
        let found = run(at, name, &[&[BASE, EQUAL][..], more, &[dense]].concat());
        (
            value(&found, "bonds"),
            value(&found, "boulders"),
            value(&found, "largest_boulder"),
        )
    };
    let (everywhere, ..) = bonds("everywhere", &[&glue("")]);
    let (in_layer, boulders, largest) = bonds("layer", &[&layer]);
    let (cracked, _, smaller) = bonds("cracked", &[&layer, crack]);
    assert!(
        in_layer > 20.0 && in_layer < 0.8 * everywhere,
        "{in_layer} {everywhere}"
    );
    assert!(
        cracked < in_layer && smaller <= largest,
        "{cracked} {in_layer}"
    );
    let seen = Columns::read(&at.join("layer/boulders.csv"));
    assert_eq!(seen.of("grains").len() as f64, boulders);
    assert!(seen.of("grains").iter().all(|n| *n >= 2.0));
    assert!(seen.of("mass").is_sorted_by(|a, b| a >= b));
    assert!(boulders >= 10.0);
    let index = value(&summary(&at.join("layer")), "boulder_size_index");
    assert!(index > 0.0, "{index}");

    for (within, words) in [
        (
            "{shape=\"mesh\"}",
            &["prepare[1].within[0].file", "missing"][..],
        ),
        (
            "{shape=\"mesh\",file=\"none.stl\"}",
            &["prepare[1].within[0].file", "none.stl"],
        ),
        (
            "{shape=\"mesh\",file=\"open.obj\"}",
            &["prepare[1].within[0].file", "closed"],
        ),
        ("{shape=\"any\"}", &["prepare[1].within[0].of", "missing"]),
        (
            "{shape=\"ball\",point=[0,0,0],radius=1,of=[{shape=\"block\"}]}",
            &["prepare[1].within[0].of", "ball"],
        ),
        (
            "{shape=\"any\",of=[{shape=\"ball\",radius=1}]}",
            &["prepare[1].within[0].of[0].point"],
        ),
    ] {
        std::fs::write(at.join("bad.toml"), [BASE, EQUAL, &trim(within)].concat()).unwrap();
        let done = colluvium(at, &["run", "bad.toml", "--out", "bad"]);
        let message = String::from_utf8_lossy(&done.stderr).into_owned();
        assert_eq!(done.status.code(), Some(2), "{within}: {message}");
        for word in words {
            assert!(
                message.contains(word),
                "{within}: no `{word}` in: {message}"
            );
        }
        assert!(!at.join("bad").exists(), "{within}");
    }
}

#[test]
fn grains_lie_where_a_list_or_a_file_has_them() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::write(
        at.join("bed.csv"),
        "radius,x,y,z\n0.005,0.1,0.2,0.3\n0.004,-0.1,0,0.05\n",
    )
    .unwrap();
    let put = |keys: &str| format!("\n[[prepare]]\ndo = \"put\"\n{keys}\n");
    let by_list = put("points = [[0.1, 0.2, 0.3], [-0.1, 0.0, 0.05]]\nradii = [0.005, 0.004]");
    let wanted = [[0.005, 0.1, 0.2, 0.3], [0.004, -0.1, 0.0, 0.05]];
    for (name, steps) in [("list", by_list), ("file", put("file = \"bed.csv\""))] {
        run(at, name, &[BASE, EQUAL, &steps]);
        assert_eq!(grains(&at.join(name), ["radius", "x", "y", "z"]), wanted);
    }
    // Without radii they have their kind's.
    run(
        at,
        "usual",
        &[BASE, EQUAL, &put("points = [[0.0, 0.0, 0.0]]")],
    );
    assert_eq!(grains(&at.join("usual"), ["radius"]), [[0.005]]);
    for (keys, words) in [
        ("", &["prepare[0].points", "missing"][..]),
        ("points = []", &["prepare[0].points", "nothing"]),
        (
            "points = [[0.0, 0.0, 0.0]]\nradii = [1.0, 2.0]",
            &["prepare[0].radii", "as many"],
        ),
        (
            "points = [[0.0, 0.0, 0.0]]\nradii = [-1.0]",
            &["prepare[0].points", "-1"],
        ),
        (
            "points = [[0.0, 0.0, 0.0]]\nmaterial = \"mud\"",
            &["prepare[0].material", "mud"],
        ),
        ("file = \"none.csv\"", &["prepare[0].file", "none.csv"]),
        ("file = \"bed.csv\"\nradii = [1.0]", &["prepare[0].radii"]),
        (
            "points = [[0.0, 0.0, 0.0]]\ncount = 1",
            &["prepare[0].count", "put"],
        ),
    ] {
        std::fs::write(at.join("bad.toml"), [BASE, EQUAL, &put(keys)].concat()).unwrap();
        let done = colluvium(at, &["run", "bad.toml", "--out", "bad"]);
        let message = String::from_utf8_lossy(&done.stderr).into_owned();
        assert_eq!(done.status.code(), Some(2), "{keys}: {message}");
        for word in words {
            assert!(message.contains(word), "{keys}: no `{word}` in: {message}");
        }
        assert!(!at.join("bad").exists(), "{keys}");
    }
}
