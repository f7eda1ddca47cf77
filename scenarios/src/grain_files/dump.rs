//! Text dumps of LAMMPS and LIGGGHTS: `dump custom` for grains, `dump local` for contacts.

use super::{Instant, Link, Row, Unsaid};
use colluvium_dem::Domain;
use nalgebra::Vector3;
use std::collections::BTreeMap;
use std::path::Path;

/// One snapshot of a dump: header and table.
#[derive(Debug, Default)]
struct Table {
    step: i64,
    time: Option<f64>,
    domain: Option<Domain>,
    columns: Vec<String>,
    rows: Vec<Vec<f64>>,
}

/// Reads a dump of grains and, where it is given, that of the contacts at the same steps.
pub(super) fn read(path: &Path, unsaid: &Unsaid) -> Result<Vec<Instant>, String> {
    let tables = tables(path, "ATOMS")?;
    let mut contacts: BTreeMap<i64, Vec<Link>> = BTreeMap::new();
    if let Some(local) = &unsaid.contacts {
        let named = |why: String| format!("contacts in {}: {why}", local.display());
        for table in self::tables(local, "ENTRIES").map_err(named)? {
            contacts.insert(table.step, links(&table, unsaid).map_err(named)?);
        }
    }
    tables
        .iter()
        .map(|table| {
            let links = contacts.remove(&table.step);
            if unsaid.contacts.is_some() && links.is_none() {
                return Err(format!(
                    "step {}: the contacts have no such step",
                    table.step
                ));
            }
            let time = match (table.time, unsaid.timestep) {
                (Some(time), _) => time,
                (None, step) => table.step as f64 * step.unwrap_or(1.0),
            };
            Ok(Instant {
                time,
                domain: table.domain,
                rows: rows(table)?,
                links: links.unwrap_or_default(),
            })
        })
        .collect()
}

fn tables(path: &Path, what: &str) -> Result<Vec<Table>, String> {
    let text = std::fs::read_to_string(path).map_err(|e| format!("cannot read the file: {e}"))?;
    let mut lines = text
        .lines()
        .enumerate()
        .map(|(k, line)| (k + 1, line.trim()));
    let mut list = Vec::new();
    let mut table = Table::default();
    let mut count = 0;
    let mut begun = false;
    while let Some((number, line)) = lines.next() {
        if line.is_empty() {
            continue;
        }
        let Some(item) = line.strip_prefix("ITEM: ") else {
            return Err(format!("line {number}: `ITEM: ` should stand here"));
        };
        let mut next = |wanted: &str| {
            lines
                .next()
                .map(|(_, line)| line)
                .ok_or_else(|| format!("the file ends where {wanted} should be"))
        };
        let parse = |text: &str, wanted: &str| {
            text.parse::<f64>()
                .map_err(|_| format!("behind line {number}: `{text}` is not {wanted}"))
        };
        match item {
            "TIMESTEP" => {
                table.step = parse(next("a step")?, "a step")? as i64;
                begun = true;
            }
            "TIME" => table.time = Some(parse(next("a time")?, "a time")?),
            "UNITS" => {
                let units = next("a name of units")?.trim();
                if units != "si" {
                    return Err(format!(
                        "behind line {number}: units `{units}` cannot be read; allowed: si, or a dump without `ITEM: UNITS` that is in SI units"
                    ));
                }
            }
            _ if item.starts_with("NUMBER OF") => {
                count = parse(next("a number")?, "a number of rows")? as usize;
            }
            _ if item.starts_with("BOX BOUNDS") => {
                let flags: Vec<&str> = item.split_whitespace().skip(2).collect();
                if flags
                    .iter()
                    .any(|f| ["xy", "xz", "yz", "abc", "origin"].contains(f))
                {
                    return Err("a box that is not rectangular cannot be read".into());
                }
                let mut domain = Domain {
                    lower: Vector3::zeros(),
                    upper: Vector3::zeros(),
                    periodic: [false; 3],
                };
                for axis in 0..3 {
                    let bounds: Vec<f64> = next("a bound of the box")?
                        .split_whitespace()
                        .map(|word| parse(word, "a bound of the box"))
                        .collect::<Result<_, _>>()?;
                    let [low, high] = bounds[..] else {
                        return Err(format!(
                            "behind line {number}: two bounds an axis are expected"
                        ));
                    };
                    (domain.lower[axis], domain.upper[axis]) = (low, high);
                    domain.periodic[axis] = flags.get(axis) == Some(&"pp");
                }
                table.domain = Some(domain);
            }
            _ if item.starts_with(what) => {
                table.columns = item[what.len()..]
                    .split_whitespace()
                    .map(String::from)
                    .collect();
                for _ in 0..count {
                    let row: Vec<f64> = next("a row")?
                        .split_whitespace()
                        .map(|word| word.parse().unwrap_or(f64::NAN))
                        .collect();
                    if row.len() != table.columns.len() {
                        return Err(format!(
                            "step {}: a row has {} values instead of {}",
                            table.step,
                            row.len(),
                            table.columns.len()
                        ));
                    }
                    table.rows.push(row);
                }
                if !begun {
                    return Err("`ITEM: TIMESTEP` is missing".into());
                }
                list.push(std::mem::take(&mut table));
                begun = false;
            }
            _ => {
                return Err(format!(
                    "line {number}: `ITEM: {item}` is not known; expected: TIMESTEP, BOX BOUNDS, {what}"
                ));
            }
        }
    }
    Ok(list)
}

fn rows(table: &Table) -> Result<Vec<Row>, String> {
    let column = |name: &str| table.columns.iter().position(|c| c == name);
    let first = |names: &[&str]| names.iter().find_map(|name| column(name));
    let need = |names: &[&str]| {
        first(names).ok_or_else(|| {
            format!(
                "no column {}; the dump has: {}",
                names.join(" or "),
                table.columns.join(", ")
            )
        })
    };
    let id = need(&["id"])?;
    let place = match first(&["x", "xu"]) {
        Some(_) => [
            need(&["x", "xu"])?,
            need(&["y", "yu"])?,
            need(&["z", "zu"])?,
        ],
        None => [
            need(&["xs", "x"])?,
            need(&["ys", "y"])?,
            need(&["zs", "z"])?,
        ],
    };
    let scaled = first(&["x", "xu"]).is_none();
    let (radius, diameter) = (column("radius"), column("diameter"));
    if radius.is_none() && diameter.is_none() {
        need(&["radius", "diameter"])?;
    }
    let three = |names: [&str; 3]| Some([column(names[0])?, column(names[1])?, column(names[2])?]);
    let velocity = [need(&["vx"])?, need(&["vy"])?, need(&["vz"])?];
    let spin = three(["omegax", "omegay", "omegaz"]);
    let (kind, mass, density) = (column("type"), column("mass"), column("density"));
    let unscale = |at: Vector3<f64>| match (scaled, &table.domain) {
        (true, Some(domain)) => domain.lower + at.component_mul(&domain.lengths()),
        _ => at,
    };
    Ok(table
        .rows
        .iter()
        .map(|row| {
            let vector = |at: [usize; 3]| Vector3::new(row[at[0]], row[at[1]], row[at[2]]);
            Row {
                id: row[id] as i64,
                kind: kind.map_or(0, |k| row[k] as i64),
                position: unscale(vector(place)),
                velocity: vector(velocity),
                spin: spin.map_or_else(Vector3::zeros, vector),
                radius: radius.map(|k| row[k]).or(diameter.map(|k| 0.5 * row[k])),
                mass: mass.map(|k| row[k]),
                density: density.map(|k| row[k]),
                fixed: false,
                clump: None,
            }
        })
        .collect())
}

fn links(table: &Table, unsaid: &Unsaid) -> Result<Vec<Link>, String> {
    let names = &unsaid.contact_columns;
    // For each number the columns that are added up to it.
    let columns: Vec<Vec<usize>> = if names.is_empty() {
        (0..5).map(|k| vec![k]).collect()
    } else {
        if names.len() != 5 && names.len() != 8 {
            return Err(format!(
                "--contact-columns names {} columns: id1,id2,fx,fy,fz and perhaps tx,ty,tz",
                names.len()
            ));
        }
        let find = |name: &str| {
            let place = table.columns.iter().position(|c| c == name);
            place.ok_or_else(|| {
                format!(
                    "no column {name}; the dump has: {}",
                    table.columns.join(", ")
                )
            })
        };
        let sum = |names: &String| names.split('+').map(find).collect();
        names.iter().map(sum).collect::<Result<_, _>>()?
    };
    if table.columns.len() < columns.len() {
        return Err(format!(
            "{} columns: at least 5 are needed",
            table.columns.len()
        ));
    }
    Ok(table
        .rows
        .iter()
        .map(|row| {
            let at = |k: usize| columns[k].iter().map(|&c| row[c]).sum::<f64>();
            Link {
                ids: [at(0) as i64, at(1) as i64],
                force: Vector3::new(at(2), at(3), at(4)),
                torques: (columns.len() == 8).then(|| {
                    // What files call the torque of a contact acts on the first grain; that on the second goes by the
                    // arms, which are not known here.
                    let torque = Vector3::new(at(5), at(6), at(7));
                    [torque, torque]
                }),
                arm: None,
                bond: false,
            }
        })
        .filter(|link| link.force.iter().all(|x| x.is_finite()))
        .collect())
}
