//! Start files: grains at one instant as CSV, gzipped or plain.
//!
//! Columns: `radius`, `density`, `x,y,z`, `vx,vy,vz` and, where they are, `type` (2 = frozen),
//! `omegax,omegay,omegaz`; others are passed over. SI units.

use colluvium_dem::Grain;
use flate2::read::GzDecoder;
use nalgebra::Vector3;
use serde::Deserialize;
use std::io::Read;
use std::path::Path;

/// Type number of frozen grains.
const FROZEN: u32 = 2;

/// First two bytes of a gzip file.
const GZIP: [u8; 2] = [0x1f, 0x8b];

/// The start of the scene `chute`.
const CHUTE: &[u8] = include_bytes!("../scenes/chute_start.csv.gz");

/// What is wrong with a start file.
#[derive(Debug, thiserror::Error)]
pub enum StartError {
    /// It cannot be read.
    #[error("{file}: cannot read this start file: {source}")]
    Unreadable {
        /// The file.
        file: String,
        /// Why.
        source: std::io::Error,
    },
    /// A column is missing, or a number cannot be read.
    #[error("{file}: {source}")]
    Malformed {
        /// The file.
        file: String,
        /// Line, column and reason.
        source: csv::Error,
    },
    /// It holds no grain.
    #[error("{file}: a start file must hold at least one grain")]
    Empty {
        /// The file.
        file: String,
    },
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

impl From<Row> for Grain {
    fn from(row: Row) -> Grain {
        let spin = |w: Option<f64>| w.unwrap_or(0.0);
        Grain {
            position: Vector3::new(row.x, row.y, row.z),
            velocity: Vector3::new(row.vx, row.vy, row.vz),
            spin: Vector3::new(spin(row.omegax), spin(row.omegay), spin(row.omegaz)),
            radius: row.radius,
            density: row.density,
            fixed: row.r#type == Some(FROZEN),
            material: 0,
        }
    }
}

/// Grains of a start file in memory; `file` is only named in errors.
///
/// # Errors
/// If the data is no CSV, a column is missing, a number cannot be read or there is no grain.
pub fn parse(file: &str, bytes: &[u8]) -> Result<Vec<Grain>, StartError> {
    let plain: Box<dyn Read + '_> = if bytes.starts_with(&GZIP) {
        Box::new(GzDecoder::new(bytes))
    } else {
        Box::new(bytes)
    };
    let grains = csv::Reader::from_reader(plain)
        .deserialize()
        .map(|row| row.map(|row: Row| Grain::from(row)))
        .collect::<Result<Vec<_>, csv::Error>>()
        .map_err(|source| StartError::Malformed {
            file: file.to_owned(),
            source,
        })?;
    if grains.is_empty() {
        return Err(StartError::Empty {
            file: file.to_owned(),
        });
    }
    Ok(grains)
}

/// Grains of a start file.
///
/// # Errors
/// If it cannot be read.
pub fn read(path: &Path) -> Result<Vec<Grain>, StartError> {
    let file = path.display().to_string();
    match std::fs::read(path) {
        Ok(bytes) => parse(&file, &bytes),
        Err(source) => Err(StartError::Unreadable { file, source }),
    }
}

/// 32 000 equal spheres of d = m = 1, 1 024 of them frozen, on a base of 40 × 20, periodic.
///
/// # Errors
/// Never, short of a damaged program: the file is part of it.
pub fn chute() -> Result<Vec<Grain>, StartError> {
    parse("chute_start.csv.gz", CHUTE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    const BAD: &[u8] = b"radius,density,x,y,z,vx,vy,vz\n1,1,0,0,0,0,0,0\n1,heavy,0,0,0,0,0,0\n";

    #[test]
    fn the_chute_has_a_frozen_base_and_unit_masses() {
        let grains = chute().unwrap();
        assert_eq!(grains.len(), 32_000);
        assert_eq!(grains.iter().filter(|g| g.fixed).count(), 1024);
        for g in &grains {
            assert!((g.mass() - 1.0).abs() < 1e-10 && g.radius == 0.5);
            assert!((0.0..40.0).contains(&g.position.x) && (0.0..20.0).contains(&g.position.y));
            assert!(!g.fixed || (g.velocity.norm() == 0.0 && g.position.z < 1.28));
        }
    }

    #[test]
    fn a_bad_number_is_named_with_its_file_and_line() {
        let mut gz = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        gz.write_all(BAD).unwrap();
        for (file, bytes) in [("a.csv.gz", gz.finish().unwrap()), ("a.csv", BAD.to_vec())] {
            let text = parse(file, &bytes).unwrap_err().to_string();
            assert!(text.contains(file) && text.contains("line: 3"), "{text}");
        }
        let header = parse("a.csv", &BAD[..30]).unwrap_err().to_string();
        assert!(header.contains("at least one grain"), "{header}");
    }
}
