//! Start states of the comparisons with other codes: the scene's own, and `data/` (see its README).

use colluvium::start_file;
pub use colluvium::start_file::{StartError, parse as read_start};
use colluvium_dem::Grain;

/// A file that is part of the program: it was read by this crate's tests.
fn shipped(read: Result<Vec<Grain>, StartError>) -> Vec<Grain> {
    match read {
        Ok(grains) => grains,
        Err(error) => panic!("{error}"),
    }
}

/// 32 000 equal spheres of d = m = 1, 1 024 of them frozen, on a base of 40 × 20, periodic.
pub fn chute_start() -> Vec<Grain> {
    shipped(start_file::chute())
}

/// 10 000 spheres of 2.5 mm ± 20 % at rest in a box of 0.1 × 0.1 m.
pub fn settled_start() -> Vec<Grain> {
    shipped(read_start(
        "tests/data/settled_start.csv.gz",
        include_bytes!("../data/settled_start.csv.gz"),
    ))
}

/// The same spheres before they were poured.
pub fn settle_start() -> Vec<Grain> {
    shipped(read_start(
        "tests/data/settle_start.csv.gz",
        include_bytes!("../data/settle_start.csv.gz"),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_settled_grains_are_the_poured_ones_at_rest() {
        let (before, after) = (settle_start(), settled_start());
        assert_eq!((before.len(), after.len()), (10_000, 10_000));
        let energy = |grains: &[Grain]| -> f64 {
            let one = |g: &Grain| 0.5 * g.mass() * g.velocity.norm_squared();
            grains.iter().map(one).sum()
        };
        assert!(energy(&after) < 1e-3 * energy(&before));
        for (a, b) in before.iter().zip(&after) {
            assert!((a.radius - b.radius).abs() < 1e-10 && a.density == 2500.0);
            assert!(!b.fixed && b.position.z < a.position.z.max(0.12));
        }
    }
}
