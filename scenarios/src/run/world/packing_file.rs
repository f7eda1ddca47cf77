//! Packings in files: places, velocities, materials and contacts, with what they were made by.

use crate::failure::Failure;
use crate::results_file::{attribute, put_in_place, read_attribute, reason};
use crate::seal;
use crate::summary::Note;
use colluvium_dem::preparation::Packing;
use colluvium_dem::{Clump, Domain, Grain, MassProperties};
use nalgebra::{Matrix3, Vector3};
use std::path::Path;

const FORMAT: &str = "colluvium packing 1";
/// That of packings with clumps, which earlier versions would take for loose grains.
const WITH_CLUMPS: &str = "colluvium packing 2";
/// Numbers of a clump: mass, centre, inertia tensor by columns.
const OF_CLUMP: usize = 13;

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
    if !stored.packing.clumps.is_empty() {
        write_clumps(&file, &stored.packing.clumps)?;
    }
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
    let plain = stored.packing.clumps.is_empty();
    attribute(&file, "format", if plain { FORMAT } else { WITH_CLUMPS })?;
    file.flush()
}

fn write_clumps(file: &hdf5::File, clumps: &[Clump]) -> hdf5::Result<()> {
    let group = file.create_group("clumps")?;
    let mut numbers = Vec::with_capacity(OF_CLUMP * clumps.len());
    for clump in clumps {
        let Some(mass) = &clump.mass else {
            return Err(hdf5::Error::Internal("a clump without a mass".into()));
        };
        numbers.push(mass.mass);
        numbers.extend(mass.centre.iter().chain(mass.inertia.iter()));
    }
    let counts: Vec<u64> = clumps.iter().map(|c| c.grains.len() as u64).collect();
    let grains = clumps.iter().flat_map(|c| &c.grains);
    let grains: Vec<u64> = grains.map(|&grain| u64::from(grain)).collect();
    for (name, values) in [("count", &counts), ("grain", &grains)] {
        group.new_dataset_builder().with_data(values).create(name)?;
    }
    let dataset = group
        .new_dataset_builder()
        .with_data(&numbers)
        .create("mass")?;
    attribute(
        &dataset,
        "unit",
        "mass kg, centre m (3), inertia tensor kg m^2 (9)",
    )
}

fn read_clumps(file: &hdf5::File) -> hdf5::Result<Vec<Clump>> {
    if !file.link_exists("clumps") {
        return Ok(Vec::new());
    }
    let group = file.group("clumps")?;
    let counts = group.dataset("count")?.read_raw::<u64>()?;
    let grains = group.dataset("grain")?.read_raw::<u64>()?;
    let numbers = group.dataset("mass")?.read_raw::<f64>()?;
    let fit = counts.iter().try_fold(0_u64, |sum, &n| sum.checked_add(n))
        == Some(grains.len() as u64)
        && numbers.len() == OF_CLUMP * counts.len();
    if !fit {
        return Err("clumps whose arrays do not fit each other".into());
    }
    let mut rest = grains.iter().map(|&g| u32::try_from(g).unwrap_or(u32::MAX));
    let numbers = numbers.as_chunks::<OF_CLUMP>().0;
    let clump = |(&count, of): (&u64, &[f64; OF_CLUMP])| Clump {
        grains: rest.by_ref().take(count as usize).collect(),
        mass: Some(MassProperties {
            mass: of[0],
            centre: Vector3::from_column_slice(&of[1..4]),
            inertia: Matrix3::from_column_slice(&of[4..]),
        }),
    };
    Ok(counts.iter().zip(numbers).map(clump).collect())
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
        Ok(format) if [FORMAT, WITH_CLUMPS].contains(&format.as_str()) => {}
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
            clumps: read_clumps(file)?,
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
    let mut taken = vec![false; stored.packing.grains.len()];
    for (k, clump) in stored.packing.clumps.iter().enumerate() {
        let mass = clump.mass.map_or(Err("no mass".to_owned()), |mass| {
            mass.validate("mass").map_err(|error| error.to_string())
        });
        mass.map_err(|error| format!("clump {k}: {error}"))?;
        let mut fresh = |&grain: &u32| {
            let place = taken.get_mut(grain as usize);
            place.is_some_and(|taken| !std::mem::replace(taken, true))
        };
        if clump.grains.is_empty() || !clump.grains.iter().all(&mut fresh) {
            return Err(format!(
                "clump {k} has no grains, or some that are not there or in another clump"
            ));
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
                clumps: Vec::new(),
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

    #[test]
    fn clumps_read_back_to_the_bit_and_must_fit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("packing.h5");
        let mut stored = example();
        let balls = [
            (Vector3::zeros(), 0.01),
            (Vector3::new(0.01, 0.003, 0.0), 0.007),
        ];
        let mut mass = MassProperties::of_balls(&balls, 900.0);
        mass.centre += Vector3::new(0.1, -0.0, 1.0 / 3.0);
        stored.packing.clumps = vec![Clump {
            grains: vec![1, 0],
            mass: Some(mass),
        }];
        write(&path, "grains", &stored).unwrap();
        assert_eq!(read(&path).unwrap(), stored);
        let refused = |change: &dyn Fn(&mut Clump)| {
            let mut strange = stored.clone();
            change(&mut strange.packing.clumps[0]);
            write(&path, "grains", &strange).unwrap();
            let error = read(&path).unwrap_err();
            assert!(error.contains("clump 0"), "{error}");
        };
        refused(&|clump| clump.grains = vec![0, 3]);
        refused(&|clump| clump.grains = vec![1, 1]);
        refused(&|clump| clump.grains.clear());
        refused(&|clump| clump.mass = Some(mass.scaled_to(-1.0)));
    }
}
