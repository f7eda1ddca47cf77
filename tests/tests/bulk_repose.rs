//! Angles of repose of the thesis' grains (Thuillet 2019, Tab. 2.2, from avalanches of Y. Zhang), as the scene
//! `angle-of-repose` finds them: μ_s = 1, μ_T = 1.3; ε is not stated there, 0.5 is that of Tab. 2.1.

use colluvium::report::read_summary;
use colluvium::run::{self, RunOptions};
use colluvium::scene::Scene;
use colluvium_tests::fit::mean_and_error;

/// μ_R, β, angle (degrees).
const TABLE: [[f64; 3]; 7] = [
    [1.05, 0.1, 25.0],
    [1.05, 0.2, 28.0],
    [1.05, 0.3, 31.0],
    [1.05, 1.0, 38.5],
    [2.0, 0.1, 26.5],
    [2.0, 0.2, 31.0],
    [2.0, 0.3, 33.0],
];

/// The angle that the scene finds with these settings, and the table's that it reports beside it.
fn angle(sets: &[String]) -> (f64, Option<f64>) {
    let folder = tempfile::tempdir().unwrap();
    let options = RunOptions {
        out: Some(folder.path().join("slope")),
        threads: Some(1),
        ..RunOptions::default()
    };
    let scene = Scene::load("angle-of-repose", sets).unwrap();
    let ended = run::run(&scene, &options).unwrap();
    let summary = read_summary(&ended.directory).unwrap();
    let found = &summary.results["angle_of_repose"];
    (found.value.unwrap(), found.reference)
}

fn settings(list: &str) -> Vec<String> {
    list.split_whitespace().map(String::from).collect()
}

/// A bed of a fifth of the grains, for quick trials.
const SMALL: &str = "floor.length_diameters=8 floor.width_diameters=5 output.pictures=0";

#[test]
fn avalanches_of_the_thesis_grains_rest_at_its_angles() {
    // Two entries, each between rest 2.5° below and motion 2.5° above.
    for [rolling, beta, angle_there] in [TABLE[0], TABLE[1]] {
        let sets = format!(
            "{SMALL} contact.rolling_friction={rolling} contact.beta={beta} search.low={} search.high={} \
             search.resolution=5.01",
            angle_there - 7.5,
            angle_there + 12.5
        );
        let (found, reported) = angle(&settings(&sets));
        assert!((found - angle_there).abs() < 1e-9, "β {beta}: {found}");
        assert_eq!(reported, Some(angle_there));
    }
}

#[test]
fn round_grains_do_not_rest_there() {
    // The control: the same friction without resistance to rolling does not rest at 25°.
    let sets =
        format!("{SMALL} contact.rolling=none search.low=15 search.high=35 search.resolution=12");
    let (found, reported) = angle(&settings(&sets));
    assert_eq!((found, reported), (20.0, None));
}

#[test]
#[ignore = "long: 10 min, seven materials, three seeds"]
fn the_whole_table() {
    for [rolling, beta, there] in TABLE {
        let angles: Vec<f64> = [1, 2, 3]
            .iter()
            .map(|seed| {
                let sets =
                    format!("seed={seed} contact.rolling_friction={rolling} contact.beta={beta}");
                angle(&settings(&sets)).0
            })
            .collect();
        let (mean, error) = mean_and_error(&angles);
        println!("μ_R {rolling} β {beta}: {mean:.1}° ± {error:.1} {angles:?}, table {there}");
        assert!((mean - there).abs() < 2.0, "{mean}");
    }
}
