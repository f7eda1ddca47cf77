//! The scenes that come with the program, one file each.

/// The names and texts of the bundled scenes.
pub const BUNDLED: [(&str, &str); 26] = [
    ("incline", include_str!("../../scenes/incline.toml")),
    (
        "incline-moderate",
        include_str!("../../scenes/incline-moderate.toml"),
    ),
    (
        "incline-gravel",
        include_str!("../../scenes/incline-gravel.toml"),
    ),
    (
        "incline-glass",
        include_str!("../../scenes/incline-glass.toml"),
    ),
    ("bagnold", include_str!("../../scenes/bagnold.toml")),
    ("plane-shear", include_str!("../../scenes/plane-shear.toml")),
    (
        "vertical-chute",
        include_str!("../../scenes/vertical-chute.toml"),
    ),
    ("two-spheres", include_str!("../../scenes/two-spheres.toml")),
    (
        "sphere-on-plane",
        include_str!("../../scenes/sphere-on-plane.toml"),
    ),
    ("chute", include_str!("../../scenes/chute.toml")),
    ("settle", include_str!("../../scenes/settle.toml")),
    ("grains", include_str!("../../scenes/grains.toml")),
    (
        "tensile-test",
        include_str!("../../scenes/tensile-test.toml"),
    ),
    (
        "boulder-drop",
        include_str!("../../scenes/boulder-drop.toml"),
    ),
    (
        "angle-of-repose",
        include_str!("../../scenes/angle-of-repose.toml"),
    ),
    (
        "cylinder-of-grains",
        include_str!("../../scenes/cylinder-of-grains.toml"),
    ),
    ("silo", include_str!("../../scenes/silo.toml")),
    ("ball-impact", include_str!("../../scenes/ball-impact.toml")),
    (
        "tumbling-box",
        include_str!("../../scenes/tumbling-box.toml"),
    ),
    (
        "column-collapse",
        include_str!("../../scenes/column-collapse.toml"),
    ),
    (
        "cylinder-collapse",
        include_str!("../../scenes/cylinder-collapse.toml"),
    ),
    ("open-chute", include_str!("../../scenes/open-chute.toml")),
    (
        "silo-discharge",
        include_str!("../../scenes/silo-discharge.toml"),
    ),
    ("cliff", include_str!("../../scenes/cliff.toml")),
    ("cliff-aswan", include_str!("../../scenes/cliff-aswan.toml")),
    ("cliff-plain", include_str!("../../scenes/cliff-plain.toml")),
];

/// The text of a bundled scene.
pub fn bundled(name: &str) -> Option<&'static str> {
    BUNDLED
        .iter()
        .find(|(n, _)| *n == name)
        .map(|(_, text)| *text)
}

/// What a scene of this kind builds on. A `grains` scene stands for itself: walls and grains of the
/// bundled example are nobody's defaults.
pub(super) fn base_of(name: &str) -> &'static str {
    match name {
        "grains" => "",
        _ => bundled(name).unwrap_or_default(),
    }
}
