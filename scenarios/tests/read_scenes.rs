//! Scenes as they are read: keys, settings, laws from files.

use colluvium::calibrate::published_material;
use colluvium::rheology_file::RheologyFile;
use colluvium::run::incline;
use colluvium::scene::{BUNDLED, Scene, SceneBody};
use colluvium_coupling::calibration::mu_of_i;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use std::path::Path;

#[test]
fn every_bundled_scene_is_complete_and_survives_a_round_trip() {
    for (name, _) in BUNDLED {
        let scene = Scene::load(name, &[]).unwrap();
        assert_eq!(scene.name, name);
        let again = Scene::from_text(&scene.to_toml().unwrap(), "resolved").unwrap();
        assert_eq!(scene, again);
    }
}

#[test]
fn a_setting_reaches_its_key_and_drops_the_alternatives() {
    let settings = [
        "slope_degrees=31".to_owned(),
        "contact.stiffness=5e4".to_owned(),
    ];
    let scene = Scene::load("incline-moderate", &settings).unwrap();
    let SceneBody::Incline(incline) = scene.body else {
        panic!("wrong kind")
    };
    assert_eq!(incline.slope_degrees, 31.0);
    assert_eq!(incline.contact.stiffness, Some(5e4));
    assert_eq!(incline.contact.stiffness_scaled, None);
}

#[test]
fn mistakes_name_key_value_and_range() {
    let message = |set: &str| {
        Scene::load("incline-moderate", &[set.to_owned()])
            .unwrap_err()
            .to_string()
    };
    let m = message("slope_degrees=95");
    assert!(
        m.contains("slope_degrees") && m.contains("95") && m.contains("90"),
        "{m}"
    );
    let m = message("contact.fricton=0.3");
    assert!(
        m.contains("contact.fricton") && m.contains("contact.friction"),
        "{m}"
    );
    let m = message("seed=\"one\"");
    assert!(
        m.contains("seed") && m.contains("one") && m.contains("integer"),
        "{m}"
    );
}

#[test]
fn the_expected_mass_is_that_of_drawn_grains() {
    for sizes in ["gaussian", "uniform"] {
        let set = [
            format!("grains.sizes={sizes}"),
            "grains.spread=0.3".to_owned(),
        ];
        let SceneBody::Incline(scene) = Scene::load("incline", &set).unwrap().body else {
            panic!("wrong kind")
        };
        let law = incline::bed(&scene).radius;
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let draws = 100_000;
        let cubes: f64 = (0..draws).map(|_| law.draw(&mut random).powi(3)).sum();
        let radius = 0.5 * scene.grains.diameter;
        let drawn = cubes / f64::from(draws) / radius.powi(3) * scene.mean_mass();
        assert!(
            (scene.expected_mass() / drawn - 1.0).abs() < 5e-3,
            "{sizes}"
        );
    }
}

#[test]
fn a_slope_reads_it_and_other_scenes_do_not() {
    let file = RheologyFile::read(Path::new("moderate")).unwrap();
    let root = {
        let zz = file.mu_zz.clone().unwrap();
        let i = file.valid_i.map(|[a, b]| (a * b).sqrt()).unwrap();
        (mu_of_i(zz.mu_s, zz.mu_2, zz.i_0, i) / mu_of_i(file.mu_s, file.mu_2, file.i_0, i)).sqrt()
    };
    // The campaign's own mean of the points is 0.928 ± 0.013.
    assert!((root * root - 0.928).abs() < 0.013, "{root}");
    let SceneBody::Incline(body) = Scene::load("incline", &[]).unwrap().body else {
        panic!("no incline")
    };
    let keys = body.rheology.unwrap();
    let zz = file.mu_zz.clone().unwrap();
    assert_eq!(keys.mu_s, Some(zz.mu_s));
    assert_eq!(keys.i_0, Some(zz.i_0 * root));
    let set = ["rheology.file=moderate".to_owned()];
    let SceneBody::Bagnold(body) = Scene::load("bagnold", &set).unwrap().body else {
        panic!("no layer")
    };
    assert_eq!(body.rheology.i_0, Some(file.i_0));
}

#[test]
fn another_contact_law_is_another_material() {
    let of = |set: &str| {
        published_material(&Scene::load("incline-moderate", &[set.to_owned()]).unwrap())
    };
    assert_eq!(of("grains.count=900"), Some("moderate"));
    assert_eq!(of("slope_degrees=30"), Some("moderate"));
    assert_eq!(of("contact.friction=0.5"), None);
    assert_eq!(of("contact.stiffness_scaled=1e3"), None);
    assert_eq!(of("grains.spread=0.2"), None);
}
