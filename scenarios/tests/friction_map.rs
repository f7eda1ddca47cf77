//! Laws from a map of friction: its file, scenes that read it, the campaigns it is made of.

use colluvium::map::{MapFile, campaign_scene};
use colluvium::rheology_file::RheologyFile;
use colluvium::scene::{Scene, SceneBody};
use colluvium_coupling::calibration::{Curve, FrictionMap, MapCell, WithError, mu_of_i};
use std::path::Path;

/// A map of two by two whose laws are made up.
fn made_up() -> MapFile {
    let i = [0.1, 0.25, 0.5];
    let mut cell = Vec::new();
    for (beta, mu_s, repose) in [(0.1, 0.45, 25.0), (1.0, 0.75, 38.0)] {
        for (mu_r, more) in [(0.5, 0.0), (2.0, 0.03)] {
            let law = |zz: f64| Curve {
                friction: i.map(|i| mu_of_i(mu_s + more - zz, 0.95 - zz, 0.4, i)),
                covariance: [[1e-6, 0.0, 0.0], [0.0, 1e-6, 0.0], [0.0, 0.0, 1e-6]],
            };
            let number = |value, error| WithError { value, error };
            cell.push(MapCell {
                beta,
                mu_r,
                curve: law(0.0),
                curve_zz: Some(law(0.04)),
                repose: number(repose + 30.0 * more, 0.5),
                solid_fraction: number(0.5, 0.002),
                valid_i: [0.05, 0.8],
            });
        }
    }
    MapFile {
        inertial_numbers: i,
        diameter: 0.01,
        grain_density: 2500.0,
        version: "0".into(),
        measured: "made up".into(),
        interpolation_error: FrictionMap::new(i, cell.clone()).unwrap().error(),
        cell,
    }
}

#[test]
fn a_map_in_a_file_gives_laws_inside_and_refuses_places_outside() {
    let file = made_up();
    let again: MapFile = toml::from_str(&file.to_toml().unwrap()).unwrap();
    assert_eq!(again, file);
    for (beta, mu_r) in [(0.1, 0.5), (1.0, 2.0), (0.3, 1.0)] {
        let law = file.rheology(beta, mu_r).unwrap();
        assert_eq!(law.check(), Ok(()));
        assert!(law.mu_s_error.unwrap() > 0.0 && law.covariance.is_some());
    }
    let why = file.rheology(3.0, 1.05).unwrap_err().to_string();
    assert!(
        why.contains("beta = 3") && why.contains("[0.1, 1]"),
        "{why}"
    );
}

#[test]
fn a_scene_takes_its_law_from_a_place_on_a_map() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.toml");
    std::fs::write(&path, made_up().to_toml().unwrap()).unwrap();
    let from = |beta: f64| {
        format!(
            "rheology.from={{beta={beta:?}, mu_r=1.0, map=\"{}\"}}",
            path.display()
        )
    };
    let load = |scene: &str, more: &[String]| Scene::load(scene, more);
    let scene = load("bagnold", &[from(0.3)]).unwrap();
    let SceneBody::Bagnold(body) = &scene.body else {
        panic!("{}", scene.name)
    };
    let law = made_up().rheology(0.3, 1.0).unwrap();
    assert_eq!(body.rheology.mu_s, Some(law.mu_s));
    assert_eq!(body.rheology.solid_fraction, 0.5);
    assert_eq!(body.rheology.valid_i, Some(vec![0.05, 0.8]));
    let source = body.rheology.source.clone().unwrap();
    assert!(
        source.contains("angle of repose 31.7") && source.contains('±'),
        "{source}"
    );
    // The resolved scene stands alone, and another size of grains is no other law.
    let text = scene.to_toml().unwrap();
    assert!(!text.contains("from"), "{text}");
    let set = [from(0.3), "rheology.diameter=0.002".to_owned()];
    let finer = load("bagnold", &set).unwrap();
    let SceneBody::Bagnold(body) = &finer.body else {
        panic!("{}", finer.name)
    };
    assert_eq!(
        (body.rheology.mu_s, body.rheology.diameter),
        (Some(law.mu_s), 0.002)
    );
    // Outside, two sources of one number, a misspelt key.
    let refused = |more: &[String]| load("bagnold", more).unwrap_err().to_string();
    let why = refused(&[from(1.5)]);
    assert!(
        why.contains("beta = 1.5") && why.contains("map.toml"),
        "{why}"
    );
    let why = refused(&[from(0.3), "rheology.mu_s=0.4".to_owned()]);
    assert!(why.contains("rheology.from"), "{why}");
    let why = refused(&["rheology.from={beta=0.3, mu_R=1.0}".to_owned()]);
    assert!(why.contains("mu_R") || why.contains("mu_r"), "{why}");
}

/// The map in `rheologies/`: sound, and near the campaigns of other beds that are no part of it.
#[test]
fn the_measured_map_is_near_campaigns_that_are_no_part_of_it() {
    let file = MapFile::bundled().unwrap();
    assert!(file.interpolation_error.friction.iter().all(|e| *e > 0.0));
    for cell in &file.cell {
        assert_eq!(file.rheology(cell.beta, cell.mu_r).unwrap().check(), Ok(()));
    }
    let moderate = RheologyFile::read(Path::new("moderate")).unwrap();
    let law = file.rheology(0.2, 1.05).unwrap();
    for (i, error) in file
        .inertial_numbers
        .iter()
        .zip(file.interpolation_error.friction)
    {
        let friction = |f: &RheologyFile| mu_of_i(f.mu_s, f.mu_2, f.i_0, *i);
        let off = friction(&law) - friction(&moderate);
        println!("β 0.2, μ_R 1.05, I {i}: map less campaign {off:+.4}, error told {error:.4}");
        assert!(off.abs() < 2.5 * error, "{off} {error}");
    }
}

#[test]
fn a_file_that_is_no_map_is_refused_with_its_name() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.toml");
    std::fs::write(&path, "inertial_numbers = [0.1, 0.2]\n").unwrap();
    let why = MapFile::read(&path).unwrap_err().to_string();
    assert!(why.contains("map.toml"), "{why}");
    let why = MapFile::read(&folder.path().join("none.toml"));
    assert!(why.unwrap_err().to_string().contains("none.toml"));
}

#[test]
fn a_cell_s_campaign_has_its_law_and_slopes_about_its_angle_of_repose() {
    let scene = Scene::load("incline-moderate", &[]).unwrap();
    let made = campaign_scene(&scene, 1.0, 2.0, 39.5).unwrap();
    let SceneBody::Incline(body) = &made.body else {
        panic!("{:?}", made.name)
    };
    let rolling = body.contact.rolling.as_ref().unwrap();
    assert_eq!((rolling.beta, rolling.rolling_friction), (1.0, 2.0));
    assert_eq!(
        body.calibration.flow_degrees,
        [38.5, 39.25, 40.0, 41.0, 42.25]
    );
    assert!(!body.calibration.search);
}
