//! Legacy VTK files with grains as points: LIGGGHTS' `dump custom/vtk`. ASCII or binary, of all versions up to 5.1.

use super::{Instant, Row};
use colluvium_dem::Domain;
use nalgebra::Vector3;
use std::collections::HashMap;
use std::path::Path;

/// Place in a file: by lines and words where it is text, by bytes where it is not.
struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
    binary: bool,
}

impl<'a> Cursor<'a> {
    fn line(&mut self) -> Option<&'a str> {
        loop {
            let rest = self.bytes.get(self.at..).filter(|r| !r.is_empty())?;
            let end = rest.iter().position(|b| *b == b'\n').unwrap_or(rest.len());
            self.at += end + 1;
            let line = std::str::from_utf8(&rest[..end])
                .unwrap_or("\u{fffd}")
                .trim();
            if !line.is_empty() {
                return Some(line);
            }
        }
    }

    fn word(&mut self) -> Option<&'a str> {
        let rest = self.bytes.get(self.at..)?;
        let start = rest.iter().position(|b| !b.is_ascii_whitespace())?;
        let end = rest[start..].iter().position(|b| b.is_ascii_whitespace());
        let end = end.map_or(rest.len(), |n| start + n);
        self.at += end;
        std::str::from_utf8(&rest[start..end]).ok()
    }

    /// `count` numbers of a VTK type; binary ones are big-endian.
    fn numbers(&mut self, count: usize, kind: &str) -> Result<Vec<f64>, String> {
        if !self.binary {
            return (0..count)
                .map(|_| {
                    let word = self.word().ok_or("the file ends within numbers")?;
                    word.parse()
                        .map_err(|_| format!("`{word}` is not a number"))
                })
                .collect();
        }
        let size = match kind {
            "float" | "int" | "unsigned_int" => 4,
            "double" | "long" | "vtkIdType" | "vtktypeint64" => 8,
            "short" => 2,
            "char" | "unsigned_char" => 1,
            other => return Err(format!("numbers of type {other} cannot be read")),
        };
        let end = count.checked_mul(size).and_then(|n| self.at.checked_add(n));
        let block = end.and_then(|end| self.bytes.get(self.at..end));
        let block = block.ok_or("the file ends within numbers")?;
        self.at += block.len();
        let read = |b: &[u8]| -> f64 {
            let mut wide = [0; 8];
            wide[8 - size..].copy_from_slice(b);
            let bits = u64::from_be_bytes(wide);
            match kind {
                "float" => f64::from(f32::from_bits(bits as u32)),
                "double" => f64::from_bits(bits),
                "int" => f64::from(bits as u32 as i32),
                "unsigned_int" => f64::from(bits as u32),
                "short" => f64::from(bits as u16 as i16),
                "char" => f64::from(bits as u8 as i8),
                "unsigned_char" => f64::from(bits as u8),
                _ => bits as i64 as f64,
            }
        };
        Ok(block.chunks_exact(size).map(read).collect())
    }
}

/// After the two lines of the header; also says whether cells stand as offsets and connectivity, as from version 5 on.
fn begin(bytes: &[u8]) -> Result<(Cursor<'_>, bool), String> {
    let mut cursor = Cursor {
        bytes,
        at: 0,
        binary: false,
    };
    let head = cursor.line().unwrap_or_default();
    if !head.starts_with("# vtk DataFile") {
        return Err("not a legacy VTK file: `# vtk DataFile` is missing".into());
    }
    let version = head.split_whitespace().last().unwrap_or_default();
    let major = version
        .split('.')
        .next()
        .and_then(|n| n.parse::<u32>().ok());
    cursor.line();
    cursor.binary = match cursor.line() {
        Some("ASCII") => false,
        Some("BINARY") => true,
        other => return Err(format!("ASCII or BINARY is expected, not {other:?}")),
    };
    Ok((cursor, major.is_some_and(|n| n >= 5)))
}

/// The box that LIGGGHTS writes beside `grains.100.vtk` as `grains.boundingBox_100.vtk`, and the step. Nothing is said there of
/// its periodic axes.
pub(super) fn beside(path: &Path) -> (Option<Domain>, Option<f64>) {
    let name = path.file_name().and_then(|n| n.to_str()).unwrap_or("");
    let stem = name.strip_suffix(".vtk").unwrap_or(name);
    let digits = stem.trim_end_matches(|c: char| c.is_ascii_digit()).len();
    let (head, step) = stem.split_at(digits);
    let Ok(number) = step.parse::<u64>() else {
        return (None, None);
    };
    let file = path.with_file_name(format!("{head}boundingBox_{step}.vtk"));
    let found = std::fs::read(file).ok().and_then(|bytes| corners(&bytes));
    (found, Some(number as f64))
}

/// The ends of a rectilinear grid.
fn corners(bytes: &[u8]) -> Option<Domain> {
    let (mut cursor, _) = begin(bytes).ok()?;
    let mut ends = [None; 3];
    while let Some(line) = cursor.line() {
        let words: Vec<&str> = line.split_whitespace().collect();
        let axis = match words[0] {
            "X_COORDINATES" => 0,
            "Y_COORDINATES" => 1,
            "Z_COORDINATES" => 2,
            _ => continue,
        };
        let values = cursor
            .numbers(words.get(1)?.parse().ok()?, words.get(2)?)
            .ok()?;
        ends[axis] = Some((*values.first()?, *values.last()?));
    }
    let [x, y, z] = [ends[0]?, ends[1]?, ends[2]?];
    Some(Domain {
        lower: Vector3::new(x.0, y.0, z.0),
        upper: Vector3::new(x.1, y.1, z.1),
        periodic: [false; 3],
    })
}

pub(super) fn read(bytes: &[u8]) -> Result<Vec<Instant>, String> {
    let (mut cursor, offsets) = begin(bytes)?;
    let mut positions = Vec::new();
    let mut fields: HashMap<String, (usize, Vec<f64>)> = HashMap::new();
    let mut over_points = false;
    let count_of = |words: &[&str], k: usize| -> Result<usize, String> {
        let word = words.get(k).ok_or("a count is missing")?;
        word.parse().map_err(|_| format!("`{word}` is not a count"))
    };
    let mut count = 0;
    while let Some(line) = cursor.line() {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words[0] {
            "POINTS" => {
                let n = count_of(&words, 1)?;
                let kind = words.get(2).copied().unwrap_or("float");
                positions = cursor.numbers(3 * n, kind)?;
            }
            "VERTICES" | "LINES" | "POLYGONS" | "CELLS" if offsets => {
                for k in [1, 2] {
                    let n = count_of(&words, k)?;
                    let line = cursor.line().ok_or("the file ends within cells")?;
                    let kind = line.split_whitespace().nth(1).unwrap_or("vtktypeint64");
                    cursor.numbers(n, kind)?;
                }
            }
            "VERTICES" | "LINES" | "POLYGONS" | "CELLS" => {
                let n = count_of(&words, 2)?;
                cursor.numbers(n, "int")?;
            }
            "CELL_TYPES" => {
                let n = count_of(&words, 1)?;
                cursor.numbers(n, "int")?;
            }
            "POINT_DATA" | "CELL_DATA" => {
                count = count_of(&words, 1)?;
                over_points = words[0] == "POINT_DATA";
            }
            "SCALARS" => {
                let parts = words.get(3).and_then(|w| w.parse().ok()).unwrap_or(1);
                cursor.line();
                let kind = words.get(2).copied().unwrap_or("float");
                let values = cursor.numbers(parts * count, kind)?;
                if over_points {
                    fields.insert(words.get(1).copied().unwrap_or("").into(), (parts, values));
                }
            }
            "VECTORS" | "NORMALS" => {
                let kind = words.get(2).copied().unwrap_or("float");
                let values = cursor.numbers(3 * count, kind)?;
                if over_points {
                    fields.insert(words.get(1).copied().unwrap_or("").into(), (3, values));
                }
            }
            "FIELD" => {
                for _ in 0..count_of(&words, 2)? {
                    let line = cursor.line().ok_or("the file ends within FIELD")?;
                    let own: Vec<&str> = line.split_whitespace().collect();
                    let (parts, rows) = (count_of(&own, 1)?, count_of(&own, 2)?);
                    let kind = own.get(3).copied().unwrap_or("float");
                    let values = cursor.numbers(parts * rows, kind)?;
                    if over_points {
                        fields.insert(own[0].into(), (parts, values));
                    }
                }
            }
            "LOOKUP_TABLE" => {
                let n = count_of(&words, 2)?;
                cursor.numbers(
                    4 * n,
                    if cursor.binary {
                        "unsigned_char"
                    } else {
                        "float"
                    },
                )?;
            }
            _ => {}
        }
    }
    let n = positions.len() / 3;
    let list = |names: &[&str], parts: usize| {
        let found = names.iter().find_map(|name| fields.get(*name));
        found.filter(|(p, values)| *p == parts && values.len() == parts * n)
    };
    let vector = |field: Option<&(usize, Vec<f64>)>, k: usize| {
        field.map_or_else(Vector3::zeros, |(_, v)| {
            Vector3::new(v[3 * k], v[3 * k + 1], v[3 * k + 2])
        })
    };
    let scalar = |field: Option<&(usize, Vec<f64>)>, k: usize| field.map(|(_, v)| v[k]);
    let (velocity, spin) = (list(&["v", "velocity"], 3), list(&["omega", "spin"], 3));
    let (radius, mass) = (list(&["radius"], 1), list(&["mass"], 1));
    let (id, kind) = (list(&["id"], 1), list(&["type"], 1));
    if radius.is_none() {
        let mut names: Vec<&str> = fields.keys().map(String::as_str).collect();
        names.sort_unstable();
        return Err(format!(
            "no field `radius` over the points; there are: {}",
            names.join(", ")
        ));
    }
    let density = list(&["density"], 1);
    let rows = (0..n)
        .map(|k| Row {
            id: scalar(id, k).map_or(k as i64, |x| x as i64),
            kind: scalar(kind, k).map_or(0, |x| x as i64),
            position: Vector3::new(positions[3 * k], positions[3 * k + 1], positions[3 * k + 2]),
            velocity: vector(velocity, k),
            spin: vector(spin, k),
            radius: scalar(radius, k),
            mass: scalar(mass, k),
            density: scalar(density, k),
            fixed: false,
            clump: None,
        })
        .collect();
    Ok(vec![Instant {
        rows,
        ..Instant::default()
    }])
}
