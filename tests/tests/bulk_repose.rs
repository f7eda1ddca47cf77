//! Angles of repose of the thesis' grains (Thuillet 2019, Tab. 2.2, from avalanches of Y. Zhang):
//! μ_s = 1, μ_T = 1.3; ε is not stated there, 0.5 is that of Tab. 2.1.

#![allow(clippy::unwrap_used)]

use colluvium_tests::fit::mean_and_error;
use colluvium_tests::slope::{Slope, grains, rests};

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

#[test]
fn avalanches_of_the_thesis_grains_rest_at_its_angles() {
    // Two entries, each between rest 2.5° below and motion 2.5° above.
    for [rolling, beta, angle] in [TABLE[0], TABLE[1]] {
        let law = grains(rolling, beta);
        let slope = Slope {
            base: [8.0, 5.0],
            filling: 13.0,
            seed: 1,
        };
        let bed = slope.bed(law).unwrap();
        assert!(rests(&bed, law, angle - 2.5).unwrap(), "β {beta} too weak");
        assert!(
            !rests(&bed, law, angle + 2.5).unwrap(),
            "β {beta} too strong"
        );
    }
}

#[test]
fn round_grains_do_not_rest_there() {
    // The control: the same friction without resistance to rolling.
    let law = grains(0.0, 0.0);
    let slope = Slope {
        base: [8.0, 5.0],
        filling: 13.0,
        seed: 1,
    };
    assert!(!rests(&slope.bed(law).unwrap(), law, 25.0).unwrap());
}

#[test]
#[ignore = "long: 10 min, seven materials, three seeds"]
fn the_whole_table() {
    for [rolling, beta, angle] in TABLE {
        let angles: Vec<f64> = [1, 2, 3]
            .iter()
            .map(|&seed| {
                let slope = Slope {
                    base: [12.0, 6.0],
                    filling: 13.0,
                    seed,
                };
                let law = grains(rolling, beta);
                slope.angle_of_rest(law, [18.0, 50.0], 1.0).unwrap()
            })
            .collect();
        let (mean, error) = mean_and_error(&angles);
        println!("μ_R {rolling} β {beta}: {mean:.1}° ± {error:.1} {angles:?}, table {angle}");
        assert!((mean - angle).abs() < 2.0, "{mean}");
    }
}
