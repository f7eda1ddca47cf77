//! Series of this program: `grains.vtkhdf`, with `contacts.vtkhdf` beside it.

use super::{Instant, Link, Row};
use crate::vtkhdf::{self, Field, Frame, Values};
use nalgebra::Vector3;
use std::path::Path;

pub(super) fn read(path: &Path) -> Result<Vec<Instant>, String> {
    let grains = vtkhdf::read_series(path).map_err(|e| e.to_string())?;
    let beside = path.with_file_name("contacts.vtkhdf");
    let contacts = if beside.exists() {
        vtkhdf::read_series(&beside).map_err(|e| format!("{}: {e}", beside.display()))?
    } else {
        Vec::new()
    };
    if !contacts.is_empty() && contacts.len() != grains.len() {
        return Err(format!(
            "{} instants, but {} has {}",
            grains.len(),
            beside.display(),
            contacts.len()
        ));
    }
    let mut instants = Vec::with_capacity(grains.len());
    for (k, frame) in grains.iter().enumerate() {
        instants.push(Instant {
            time: frame.time,
            domain: None,
            rows: rows(frame)?,
            links: contacts.get(k).map_or(Ok(Vec::new()), links)?,
        });
    }
    Ok(instants)
}

fn field<'a>(frame: &'a Frame, name: &str) -> Result<&'a Field, String> {
    let found = frame.fields.iter().find(|f| f.name == name);
    found.ok_or_else(|| format!("no field `{name}`: written by an older version?"))
}

fn scalars<'a>(frame: &'a Frame, name: &str) -> Result<&'a [f64], String> {
    match &field(frame, name)?.values {
        Values::Scalars(values) => Ok(values),
        _ => Err(format!("the field `{name}` is not of real numbers")),
    }
}

fn vectors<'a>(frame: &'a Frame, name: &str) -> Result<&'a [[f64; 3]], String> {
    match &field(frame, name)?.values {
        Values::Vectors(values) => Ok(values),
        _ => Err(format!("the field `{name}` is not of vectors")),
    }
}

fn counts<'a>(frame: &'a Frame, name: &str) -> Result<&'a [i64], String> {
    match &field(frame, name)?.values {
        Values::Counts(values) => Ok(values),
        _ => Err(format!("the field `{name}` is not of whole numbers")),
    }
}

fn rows(frame: &Frame) -> Result<Vec<Row>, String> {
    let (id, fixed) = (counts(frame, "id")?, counts(frame, "fixed")?);
    let (radius, mass) = (scalars(frame, "radius")?, scalars(frame, "mass")?);
    let (velocity, spin) = (vectors(frame, "velocity")?, vectors(frame, "spin")?);
    Ok((0..frame.points.len())
        .map(|k| Row {
            id: id[k],
            kind: 0,
            position: frame.points[k].into(),
            velocity: velocity[k].into(),
            spin: spin[k].into(),
            radius: Some(radius[k]),
            mass: Some(mass[k]),
            density: None,
            fixed: fixed[k] != 0,
        })
        .collect())
}

/// `kind` of a bond in a series of contacts.
const BOND: i64 = 2;

fn links(frame: &Frame) -> Result<Vec<Link>, String> {
    let (first, second) = (counts(frame, "first")?, counts(frame, "second")?);
    let (force, point) = (vectors(frame, "force")?, vectors(frame, "arm")?);
    let (torque, other) = (vectors(frame, "torque")?, vectors(frame, "other_torque")?);
    let kind = counts(frame, "kind")?;
    Ok((0..first.len())
        .map(|k| Link {
            ids: [first[k], second[k]],
            force: force[k].into(),
            torques: Some([Vector3::from(torque[k]), Vector3::from(other[k])]),
            arm: Some(point[k].into()),
            bond: kind[k] == BOND,
        })
        .collect())
}
