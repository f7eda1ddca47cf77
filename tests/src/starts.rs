//! Start states of the comparisons with other codes, from `data/` (see its README).

use colluvium_dem::Grain;
use flate2::read::GzDecoder;
use nalgebra::Vector3;
use serde::Deserialize;

/// Type number of frozen grains.
const FROZEN: u32 = 2;

/// What is wrong with a start file.
#[derive(Debug, thiserror::Error)]
#[error("{file}: {source}")]
pub struct StartError {
    file: String,
    source: csv::Error,
}

/// A line of a start file.
#[derive(Deserialize)]
struct Row {
    r#type: Option<u32>,
    radius: f64,
    density: f64,
    x: f64,
    y: f64,
    z: f64,
    vx: f64,
    vy: f64,
    vz: f64,
    omegax: Option<f64>,
    omegay: Option<f64>,
    omegaz: Option<f64>,
}

/// Grains of a gzipped CSV in memory; `file` is only named in errors.
///
/// # Errors
/// If the data is not gzip, a column is missing or a number cannot be read.
pub fn read_start(file: &str, gzipped: &[u8]) -> Result<Vec<Grain>, StartError> {
    let spin = |w: Option<f64>| w.unwrap_or(0.0);
    csv::Reader::from_reader(GzDecoder::new(gzipped))
        .deserialize()
        .map(|row| {
            let row: Row = row?;
            Ok(Grain {
                position: Vector3::new(row.x, row.y, row.z),
                velocity: Vector3::new(row.vx, row.vy, row.vz),
                spin: Vector3::new(spin(row.omegax), spin(row.omegay), spin(row.omegaz)),
                radius: row.radius,
                density: row.density,
                fixed: row.r#type == Some(FROZEN),
                material: 0,
            })
        })
        .collect::<Result<_, csv::Error>>()
        .map_err(|source| StartError {
            file: file.into(),
            source,
        })
}

/// A file that is part of the program: it was read by this crate's tests.
fn shipped(file: &str, gzipped: &[u8]) -> Vec<Grain> {
    match read_start(file, gzipped) {
        Ok(grains) => grains,
        Err(error) => panic!("{error}"),
    }
}

/// 32 000 equal spheres of d = m = 1, 1 024 of them frozen, on a base of 40 × 20, periodic.
pub fn chute_start() -> Vec<Grain> {
    shipped(
        "tests/data/chute_start.csv.gz",
        include_bytes!("../data/chute_start.csv.gz"),
    )
}

/// 10 000 spheres of 2.5 mm ± 20 % at rest in a box of 0.1 × 0.1 m.
pub fn settled_start() -> Vec<Grain> {
    shipped(
        "tests/data/settled_start.csv.gz",
        include_bytes!("../data/settled_start.csv.gz"),
    )
}

/// The same spheres before they were poured.
pub fn settle_start() -> Vec<Grain> {
    shipped(
        "tests/data/settle_start.csv.gz",
        include_bytes!("../data/settle_start.csv.gz"),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    #[test]
    fn the_chute_has_a_frozen_base_and_unit_masses() {
        let grains = chute_start();
        assert_eq!(grains.len(), 32_000);
        assert_eq!(grains.iter().filter(|g| g.fixed).count(), 1024);
        for g in &grains {
            assert!((g.mass() - 1.0).abs() < 1e-10 && g.radius == 0.5);
            assert!((0.0..40.0).contains(&g.position.x) && (0.0..20.0).contains(&g.position.y));
            assert!(!g.fixed || (g.velocity.norm() == 0.0 && g.position.z < 1.28));
        }
    }

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

    #[test]
    fn a_bad_number_is_named_with_its_file_and_line() {
        let mut gz = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        let text = b"radius,density,x,y,z,vx,vy,vz\n1,1,0,0,0,0,0,0\n1,heavy,0,0,0,0,0,0\n";
        gz.write_all(text).unwrap();
        let error = read_start("a.csv.gz", &gz.finish().unwrap()).unwrap_err();
        let text = error.to_string();
        assert!(
            text.contains("a.csv.gz") && text.contains("line: 3"),
            "{text}"
        );
    }
}
