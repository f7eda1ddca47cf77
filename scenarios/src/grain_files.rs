//! Grains and contacts of runs that are already there, as snapshots to be coarse-grained: series of this program
//! (`grains.vtkhdf` with `contacts.vtkhdf` beside it), text dumps of LAMMPS and LIGGGHTS with a local dump of the
//! contacts, and legacy VTK files of LIGGGHTS.

mod dump;
mod legacy_vtk;
mod series;

use crate::failure::Failure;
use colluvium_dem::{
    BondSample, BondStress, ContactSample, Domain, GrainSample, Partner, Snapshot,
};
use nalgebra::Vector3;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// What files leave unsaid.
#[derive(Clone, Debug, Default)]
pub struct Unsaid {
    /// Local dump of the contacts beside a text dump.
    pub contacts: Option<PathBuf>,
    /// Names of the columns of the local dump that hold id1, id2, fx, fy, fz, then tx, ty, tz if there are torques;
    /// empty: the first five columns. Columns that are to be added stand with a plus between them: LAMMPS' `pair/local`
    /// gives the normal force of granular styles as fx, fy, fz and the tangential one as p1, p2, p3.
    pub contact_columns: Vec<String>,
    /// Lower and upper corner of the box (m), where the file has none or another is meant.
    pub domain: Option<[[f64; 3]; 2]>,
    /// Periodic axes, where the file does not say.
    pub periodic: Option<[bool; 3]>,
    /// Gravity (m/s²).
    pub gravity: [f64; 3],
    /// Density of the grains (kg/m³), where there are no masses.
    pub density: Option<f64>,
    /// Seconds of a step, where a file counts steps alone.
    pub timestep: Option<f64>,
    /// Types of grains that are held fixed: a base.
    pub fixed_types: Vec<i64>,
}

/// A grain as a file has it.
#[derive(Clone, Debug, Default)]
struct Row {
    id: i64,
    kind: i64,
    position: Vector3<f64>,
    velocity: Vector3<f64>,
    spin: Vector3<f64>,
    radius: Option<f64>,
    mass: Option<f64>,
    density: Option<f64>,
    fixed: bool,
    clump: Option<u32>,
}

/// A contact as a file has it; the second grain is none at a wall.
#[derive(Clone, Debug)]
struct Link {
    ids: [i64; 2],
    /// On the first grain (N).
    force: Vector3<f64>,
    /// Torques on both grains about their centres beyond those of the force at the contact point (N m).
    torques: Option<[Vector3<f64>; 2]>,
    /// From the centre of the first grain to the contact point (m), where the file knows it.
    arm: Option<Vector3<f64>>,
    /// A bond of two grains, which is no contact of theirs.
    bond: bool,
}

/// One instant of a file.
#[derive(Clone, Debug, Default)]
struct Instant {
    time: f64,
    domain: Option<Domain>,
    rows: Vec<Row>,
    links: Vec<Link>,
}

/// Reads all instants of a file and hands them on one by one; gives their number.
///
/// # Errors
/// Bad input that names the file and what is wrong; what `each` fails with.
pub fn read(
    path: &Path,
    unsaid: &Unsaid,
    each: &mut dyn FnMut(&Snapshot) -> Result<(), Failure>,
) -> Result<usize, Failure> {
    let refuse = |why: String| Failure::Input(format!("{}: {why}", path.display()));
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or("");
    let instants = match extension {
        "vtkhdf" => series::read(path),
        "vtk" => std::fs::read(path)
            .map_err(|e| format!("cannot read the file: {e}"))
            .and_then(|bytes| legacy_vtk::read(&bytes))
            .map(|instants| beside_vtk(instants, path, unsaid)),
        _ => dump::read(path, unsaid),
    }
    .map_err(refuse)?;
    if instants.is_empty() {
        return Err(refuse("it holds no instant".into()));
    }
    for instant in &instants {
        each(&snapshot(instant, unsaid).map_err(refuse)?)?;
    }
    Ok(instants.len())
}

/// With the box and the time that names of files tell.
fn beside_vtk(mut instants: Vec<Instant>, path: &Path, unsaid: &Unsaid) -> Vec<Instant> {
    let (domain, step) = legacy_vtk::beside(path);
    for instant in &mut instants {
        instant.domain = domain;
        instant.time = step.unwrap_or(0.0) * unsaid.timestep.unwrap_or(0.0);
    }
    instants
}

fn snapshot(instant: &Instant, unsaid: &Unsaid) -> Result<Snapshot, String> {
    let domain = domain(instant, unsaid)?;
    let mut grains = Vec::with_capacity(instant.rows.len());
    let mut place = HashMap::with_capacity(instant.rows.len());
    for row in &instant.rows {
        let radius = row
            .radius
            .filter(|r| *r > 0.0 && r.is_finite())
            .ok_or_else(|| format!("grain {} has no positive radius", row.id))?;
        let volume = 4.0 / 3.0 * std::f64::consts::PI * radius.powi(3);
        let density = row.density.or(unsaid.density);
        let mass = row
            .mass
            .or(density.map(|rho| rho * volume))
            .filter(|m| *m > 0.0 && m.is_finite())
            .ok_or_else(|| format!("grain {} has no positive mass: give --density", row.id))?;
        let numbers = [row.position, row.velocity, row.spin];
        if !numbers.iter().flat_map(|v| v.iter()).all(|x| x.is_finite()) {
            return Err(format!("grain {} has a number that is not finite", row.id));
        }
        if place.insert(row.id, grains.len()).is_some() {
            return Err(format!("two grains have the id {}", row.id));
        }
        grains.push(GrainSample {
            id: u32::try_from(row.id)
                .map_err(|_| format!("the id {} is no number of a grain", row.id))?,
            position: domain.wrap(row.position),
            velocity: row.velocity,
            spin: row.spin,
            radius,
            mass,
            fixed: row.fixed || unsaid.fixed_types.contains(&row.kind),
            clump: row.clump,
        });
    }
    let mut contacts = Vec::with_capacity(instant.links.len());
    let mut bonds = Vec::new();
    for link in &instant.links {
        let find = |id: i64| {
            place
                .get(&id)
                .copied()
                .ok_or_else(|| format!("a contact names the grain {id}, which is not there"))
        };
        let first = find(link.ids[0])?;
        let own = &grains[first];
        let plain = |arm: Vector3<f64>, force: Vector3<f64>| arm.cross(&force);
        if link.ids[1] < 0 {
            let arm = link.arm.ok_or("a wall contact has no contact point")?;
            let torque = link
                .torques
                .map_or_else(|| plain(arm, link.force), |t| t[0]);
            contacts.push(ContactSample {
                grain: first,
                partner: Partner::Wall(0),
                overlap: own.radius - arm.norm(),
                force: link.force,
                arm,
                partner_arm: Vector3::zeros(),
                torque,
                partner_torque: Vector3::zeros(),
            });
            continue;
        }
        let second = find(link.ids[1])?;
        let other = &grains[second];
        let branch = domain.nearest_image(other.position - own.position);
        let radii = own.radius + other.radius;
        let (arm, partner_arm) = match link.arm {
            Some(arm) => (arm, arm - branch),
            None => (
                branch * (own.radius / radii),
                -branch * (other.radius / radii),
            ),
        };
        if link.bond {
            bonds.push(BondSample {
                grains: [first, second],
                force: link.force,
                moment: link.torques.map_or_else(Vector3::zeros, |t| t[0]),
                arm,
                partner_arm,
                radius: 0.0,
                stress: BondStress::default(),
            });
            continue;
        }
        let both = [plain(arm, link.force), plain(partner_arm, -link.force)];
        let [torque, partner_torque] = match (link.torques, link.arm) {
            // A dump tells the torque on the first grain. What is beyond the force's, rolling and twisting, turns the
            // second the other way; the force's own goes by the arms.
            (Some([torque, _]), None) => [torque, both[1] - (torque - both[0])],
            (Some(told), Some(_)) => told,
            (None, _) => both,
        };
        contacts.push(ContactSample {
            grain: first,
            partner: Partner::Grain(second),
            overlap: radii - branch.norm(),
            force: link.force,
            arm,
            partner_arm,
            torque,
            partner_torque,
        });
    }
    refuse_pulling(&contacts)?;
    Ok(Snapshot {
        time: instant.time,
        domain,
        gravity: unsaid.gravity.into(),
        grains,
        contacts,
        bonds,
        bodies: Vec::new(),
        body_contacts: Vec::new(),
    })
}

/// Forces of dry grains press; where most of them pull, columns or signs are mixed up.
fn refuse_pulling(contacts: &[ContactSample]) -> Result<(), String> {
    let pulls = |c: &&ContactSample| c.force.dot(&c.arm) > 0.0;
    let pulling = contacts.iter().filter(pulls).count();
    if 2 * pulling > contacts.len() {
        return Err(format!(
            "{pulling} of {} contacts pull their grains together: the force must be that on the first grain; check --contact-columns",
            contacts.len()
        ));
    }
    Ok(())
}

fn domain(instant: &Instant, unsaid: &Unsaid) -> Result<Domain, String> {
    let around = || {
        let mut low = Vector3::repeat(f64::INFINITY);
        let mut high = -low;
        for row in &instant.rows {
            let r = Vector3::repeat(row.radius.unwrap_or(0.0));
            (low, high) = (low.inf(&(row.position - r)), high.sup(&(row.position + r)));
        }
        Domain {
            lower: low,
            upper: high,
            periodic: [false; 3],
        }
    };
    let mut domain = instant.domain.unwrap_or_else(around);
    if let Some([lower, upper]) = unsaid.domain {
        (domain.lower, domain.upper) = (lower.into(), upper.into());
    } else if instant.domain.is_none() && unsaid.periodic.is_some_and(|p| p.contains(&true)) {
        return Err("a periodic axis needs a box, which the file does not have: give --box".into());
    }
    if let Some(periodic) = unsaid.periodic {
        domain.periodic = periodic;
    }
    let lengths = domain.lengths();
    if !lengths.iter().all(|l| *l > 0.0 && l.is_finite()) {
        return Err(format!(
            "the box is {lengths:?} m long: all must be positive"
        ));
    }
    Ok(domain)
}

#[cfg(test)]
mod tests;
