//! Series of this program: `grains.vtkhdf`, with `contacts.vtkhdf` beside it.

use super::{Instant, Link, Row};
use crate::vtkhdf::{self, Frame};
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

fn rows(frame: &Frame) -> Result<Vec<Row>, String> {
    let (id, fixed) = (frame.counts("id")?, frame.counts("fixed")?);
    let (radius, mass) = (frame.scalars("radius")?, frame.scalars("mass")?);
    let (velocity, spin) = (frame.vectors("velocity")?, frame.vectors("spin")?);
    // Series of older versions have none.
    let clump = frame.counts("clump").unwrap_or_default();
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
            clump: clump.get(k).and_then(|&number| u32::try_from(number).ok()),
        })
        .collect())
}

/// `kind` of a bond in a series of contacts.
const BOND: i64 = 2;

fn links(frame: &Frame) -> Result<Vec<Link>, String> {
    let (first, second) = (frame.counts("first")?, frame.counts("second")?);
    let (force, point) = (frame.vectors("force")?, frame.vectors("arm")?);
    let (torque, other) = (frame.vectors("torque")?, frame.vectors("other_torque")?);
    let kind = frame.counts("kind")?;
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
