//! Packings in files: places, velocities, materials and contacts, with what they were made by.

use crate::failure::Failure;
use crate::results_file::{attribute, put_in_place, read_attribute, reason};
use crate::seal;
use crate::summary::Note;
use colluvium_dem::preparation::Packing;
use colluvium_dem::{Domain, Grain};
use nalgebra::Vector3;
use std::path::Path;

const FORMAT: &str = "colluvium packing 1";

/// A packing and where it comes from.
#[derive(Clone, Debug, PartialEq)]
pub struct Stored {
    /// The packing.
    pub packing: Packing,
    /// Names of its materials, in the order of their numbers.
    pub materials: Vec<String>,
    /// Keys that its preparation went by.
    pub provenance: toml::Table,
    /// How the preparation went.
    pub notes: Vec<Note>,
    /// Steps times grains of the preparation.
    pub grain_steps: u64,
}

/// Columns of grains with their units.
const COLUMNS: [(&str, &str); 11] = [
    ("x", "m"),
    ("y", "m"),
    ("z", "m"),
    ("vx", "m/s"),
    ("vy", "m/s"),
    ("vz", "m/s"),
    ("wx", "rad/s"),
    ("wy", "rad/s"),
    ("wz", "rad/s"),
    ("radius", "m"),
    ("density", "kg/m^3"),
];

fn column(grain: &Grain, k: usize) -> f64 {
    match k {
        0..3 => grain.position[k],
        3..6 => grain.velocity[k - 3],
        6..9 => grain.spin[k - 6],
        9 => grain.radius,
        _ => grain.density,
    }
}

/// Writes a packing under a temporary name and renames it when it is whole.
pub fn write(path: &Path, scene: &str, stored: &Stored) -> Result<(), Failure> {
    let partial = path.with_extension("h5.partial");
    let done = write_arrays(&partial, scene, stored)
        .map_err(|error| reason(&error))
        .and_then(|()| seal::close(&partial).map_err(|error| error.to_string()))
        .and_then(|()| put_in_place(&partial, path).map_err(|error| error.to_string()));
    done.map_err(|error| {
        let _ = std::fs::remove_file(&partial);
        Failure::Run(format!(
            "cannot write the packing {}: {error}",
            path.display()
        ))
    })
}

fn write_arrays(path: &Path, scene: &str, stored: &Stored) -> hdf5::Result<()> {
    let file = hdf5::File::create(path)?;
    let group = file.create_group("grains")?;
    let grains = &stored.packing.grains;
    for (k, (name, unit)) in COLUMNS.into_iter().enumerate() {
        let values: Vec<f64> = grains.iter().map(|g| column(g, k)).collect();
        let dataset = group
            .new_dataset_builder()
            .with_data(&values)
            .create(name)?;
        attribute(&dataset, "unit", unit)?;
    }
    let material: Vec<u64> = grains.iter().map(|g| u64::from(g.material)).collect();
    let fixed: Vec<u64> = grains.iter().map(|g| u64::from(g.fixed)).collect();
    let contacts = stored.packing.contacts.iter().flatten();
    let contacts: Vec<u64> = contacts.map(|&i| u64::from(i)).collect();
    for (name, values) in [("material", &material), ("fixed", &fixed)] {
        group.new_dataset_builder().with_data(values).create(name)?;
    }
    file.new_dataset_builder()
        .with_data(&contacts)
        .create("contacts")?;
    let domain = &stored.packing.domain;
    let numbers: Vec<f64> = domain.lower.iter().chain(&domain.upper).copied().collect();
    file.new_dataset_builder()
        .with_data(&numbers)
        .create("box")?;
    let periodic = domain.periodic.map(u64::from);
    file.new_dataset_builder()
        .with_data(&periodic)
        .create("periodic")?;
    attribute(&file, "version", env!("CARGO_PKG_VERSION"))?;
    attribute(&file, "scene", scene)?;
    let text = |result: Result<String, String>| result.map_err(hdf5::Error::Internal);
    let materials = text(serde_json::to_string(&stored.materials).map_err(|e| e.to_string()))?;
    attribute(&file, "materials", &materials)?;
    let notes = text(serde_json::to_string(&stored.notes).map_err(|e| e.to_string()))?;
    attribute(&file, "notes", &notes)?;
    let provenance = text(toml::to_string(&stored.provenance).map_err(|e| e.to_string()))?;
    attribute(&file, "provenance", &provenance)?;
    file.new_attr::<u64>()
        .create("grain_steps")?
        .write_scalar(&stored.grain_steps)?;
    // Last, so that a file without it was not finished.
    attribute(&file, "format", FORMAT)?;
    file.flush()
}

/// Reads a packing; says what is wrong with a truncated or foreign file.
pub fn read(path: &Path) -> Result<Stored, String> {
    if !path.exists() {
        return Err("there is no such file".into());
    }
    seal::check(path)?;
    let file = hdf5::File::open(path)
        .map_err(|error| format!("not a whole HDF5 file ({})", reason(&error)))?;
    match read_attribute(&file, "format") {
        Ok(format) if format == FORMAT => {}
        Ok(format) => return Err(format!("not a packing of this program (format `{format}`)")),
        Err(_) => return Err("not a packing of this program (no format)".into()),
    }
    let stored = read_arrays(&file).map_err(|error| format!("damaged ({})", reason(&error)))?;
    check(&stored)?;
    Ok(stored)
}

fn read_arrays(file: &hdf5::File) -> hdf5::Result<Stored> {
    let bad = |what: &str| hdf5::Error::Internal(what.to_owned());
    let group = file.group("grains")?;
    let mut columns = Vec::new();
    for (name, _) in COLUMNS {
        columns.push(group.dataset(name)?.read_raw::<f64>()?);
    }
    let material = group.dataset("material")?.read_raw::<u64>()?;
    let fixed = group.dataset("fixed")?.read_raw::<u64>()?;
    let count = material.len();
    if fixed.len() != count || columns.iter().any(|c| c.len() != count) {
        return Err(bad("columns of different lengths"));
    }
    let three = |k: usize, i: usize| Vector3::from_fn(|c, _| columns[k + c][i]);
    let grains = (0..count).map(|i| Grain {
        position: three(0, i),
        velocity: three(3, i),
        spin: three(6, i),
        radius: columns[9][i],
        density: columns[10][i],
        fixed: fixed[i] != 0,
        material: material[i].min(u64::from(u16::MAX)) as u16,
    });
    let contacts = file.dataset("contacts")?.read_raw::<u64>()?;
    if contacts.iter().any(|&i| i >= count as u64) {
        return Err(bad("contacts of grains that are not there"));
    }
    let pairs = contacts.as_chunks::<2>().0.iter();
    let numbers = file.dataset("box")?.read_raw::<f64>()?;
    let periodic = file.dataset("periodic")?.read_raw::<u64>()?;
    let (&[a, b, c, d, e, f], &[p, q, r]) = (numbers.as_slice(), periodic.as_slice()) else {
        return Err(bad("a box of other than six numbers"));
    };
    let json = |name: &str| read_attribute(file, name);
    Ok(Stored {
        packing: Packing {
            domain: Domain {
                lower: Vector3::new(a, b, c),
                upper: Vector3::new(d, e, f),
                periodic: [p, q, r].map(|p| p != 0),
            },
            grains: grains.collect(),
            contacts: pairs.map(|pair| pair.map(|i| i as u32)).collect(),
        },
        materials: serde_json::from_str(&json("materials")?).map_err(|_| bad("materials"))?,
        provenance: json("provenance")?.parse().map_err(|_| bad("provenance"))?,
        notes: serde_json::from_str(&json("notes")?).map_err(|_| bad("notes"))?,
        grain_steps: file.attr("grain_steps")?.read_scalar()?,
    })
}

fn check(stored: &Stored) -> Result<(), String> {
    let known = stored.materials.len();
    for (k, grain) in stored.packing.grains.iter().enumerate() {
        let numbers = (0..COLUMNS.len()).map(|c| column(grain, c));
        if !numbers.clone().all(f64::is_finite) || grain.radius <= 0.0 || grain.density <= 0.0 {
            return Err(format!("grain {k} has a number that is not allowed"));
        }
        if usize::from(grain.material) >= known {
            return Err(format!("grain {k} is of a material without a name"));
        }
    }
    // A scene of bodies or clumps alone prepares none.
    if stored.packing.grains.is_empty() && !stored.provenance.is_empty() {
        return Err("it holds no grains".into());
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn example() -> Stored {
        let mut grains = vec![Grain::at_rest(Vector3::new(0.1, -0.0, 1.0 / 3.0), 0.01, 920.0); 3];
        grains[1].material = 1;
        grains[2].fixed = true;
        grains[2].spin = Vector3::new(5e-324, 1.0, 2.0);
        Stored {
            packing: Packing {
                domain: Domain {
                    lower: Vector3::zeros(),
                    upper: Vector3::repeat(1.0),
                    periodic: [true, false, false],
                },
                grains,
                contacts: vec![[0, 2], [1, 2]],
            },
            materials: vec!["dust".into(), "ice".into()],
            provenance: "seed = 1\n[grains.dust]\ndensity = 2000.0".parse().unwrap(),
            notes: vec![Note {
                step: "insert".into(),
                text: "three \"grains\"".into(),
            }],
            grain_steps: 7,
        }
    }

    #[test]
    fn reads_back_to_the_bit_and_refuses_what_is_not_whole() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("packing.h5");
        write(&path, "grains", &example()).unwrap();
        let again = read(&path).unwrap();
        assert_eq!(again, example());
        let zero = again.packing.grains[0].position.y;
        assert!(zero == 0.0 && zero.is_sign_negative());

        let bytes = std::fs::read(&path).unwrap();
        std::fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
        assert!(read(&path).unwrap_err().contains("damaged"));
        let mut flipped = bytes.clone();
        flipped[bytes.len() / 3] ^= 4;
        std::fs::write(&path, &flipped).unwrap();
        assert!(read(&path).unwrap_err().contains("damaged"));
        let mut strange = example();
        strange.packing.grains[0].radius = f64::NAN;
        write(&path, "grains", &strange).unwrap();
        assert!(read(&path).unwrap_err().contains("grain 0"));
    }
}
