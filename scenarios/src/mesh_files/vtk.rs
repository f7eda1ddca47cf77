//! Legacy VTK files: poly data and unstructured grids.
//!
//! Binary numbers are big-endian. Since version 5, cells are two arrays, `OFFSETS` and `CONNECTIVITY`; before,
//! one with the number of points in front of each cell.

use super::words::Words;
use super::{Surface, triangle_lines, vertex_lines};

/// How cells of a list become triangles.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Cell {
    Polygon,
    Strip,
    Other,
}

impl Cell {
    /// By VTK's number of a cell type: triangle, polygon, pixel excepted, quad; strip.
    pub fn of(kind: u64) -> Cell {
        match kind {
            5 | 7 | 9 => Cell::Polygon,
            6 => Cell::Strip,
            _ => Cell::Other,
        }
    }
}

/// Cells as ends in a list of points.
#[derive(Clone, Debug, Default)]
pub(super) struct Cells {
    pub ends: Vec<u64>,
    pub points: Vec<u64>,
}

impl Cells {
    /// Adds the cells to a surface; `kind` says what cell k is.
    pub fn add_to(
        &self,
        surface: &mut Surface,
        kind: impl Fn(usize) -> Cell,
    ) -> Result<(), String> {
        let mut start = 0;
        for (k, &end) in self.ends.iter().enumerate() {
            let end = usize::try_from(end).unwrap_or(usize::MAX);
            let points = self.points.get(start..end);
            let points = points
                .ok_or_else(|| format!("cell {k} ends at point {end} of {}", self.points.len()))?;
            start = end;
            let corners: Result<Vec<u32>, _> = points.iter().map(|&p| u32::try_from(p)).collect();
            let corners = corners.map_err(|_| format!("cell {k} names a point beyond 2³²"))?;
            match kind(k) {
                Cell::Polygon => surface.add_polygon(&corners),
                Cell::Strip => surface.add_strip(&corners),
                Cell::Other => {}
            }
        }
        Ok(())
    }
}

/// A file half read.
struct Reader<'a> {
    words: Words<'a>,
    binary: bool,
}

/// Bytes of a number of a type, and how it is read.
fn decode(kind: &str, bytes: &[u8]) -> Option<f64> {
    fn all<const N: usize>(bytes: &[u8]) -> Option<[u8; N]> {
        bytes.try_into().ok()
    }
    Some(match kind {
        "char" | "vtktypeint8" => f64::from(i8::from_be_bytes(all(bytes)?)),
        "unsigned_char" | "vtktypeuint8" => f64::from(u8::from_be_bytes(all(bytes)?)),
        "short" | "vtktypeint16" => f64::from(i16::from_be_bytes(all(bytes)?)),
        "unsigned_short" | "vtktypeuint16" => f64::from(u16::from_be_bytes(all(bytes)?)),
        "int" | "vtktypeint32" => f64::from(i32::from_be_bytes(all(bytes)?)),
        "unsigned_int" | "vtktypeuint32" => f64::from(u32::from_be_bytes(all(bytes)?)),
        "long" | "vtktypeint64" | "vtkidtype" => i64::from_be_bytes(all(bytes)?) as f64,
        "unsigned_long" | "vtktypeuint64" => u64::from_be_bytes(all(bytes)?) as f64,
        "float" => f64::from(f32::from_be_bytes(all(bytes)?)),
        "double" => f64::from_be_bytes(all(bytes)?),
        _ => return None,
    })
}

fn size_of(kind: &str) -> Option<usize> {
    [1, 2, 4, 8]
        .into_iter()
        .find(|&size| decode(kind, &[0; 8][..size]).is_some())
}

impl Reader<'_> {
    /// `count` numbers of a type.
    fn numbers(&mut self, count: usize, kind: &str, what: &str) -> Result<Vec<f64>, String> {
        let kind = kind.to_ascii_lowercase();
        let size =
            size_of(&kind).ok_or_else(|| format!("numbers of type `{kind}` are not known"))?;
        if self.binary {
            let block = self.words.block(count, size, what)?;
            let numbers = block.chunks_exact(size).filter_map(|b| decode(&kind, b));
            return Ok(numbers.collect());
        }
        let mut numbers = Vec::new();
        for _ in 0..count {
            numbers.push(self.words.number(what)?);
        }
        Ok(numbers)
    }

    fn whole(&mut self, count: usize, kind: &str, what: &str) -> Result<Vec<u64>, String> {
        let numbers = self.numbers(count, kind, what)?;
        let bad = |x: &f64| *x < 0.0 || x.fract() != 0.0 || !x.is_finite();
        match numbers.iter().find(|x| bad(x)) {
            Some(x) => Err(format!(
                "{x} is not one of {what}: it must be 0 or a whole number above"
            )),
            None => Ok(numbers.iter().map(|&x| x as u64).collect()),
        }
    }

    /// Expects a word, in any case, and a type behind it; then the numbers on the next line.
    fn array(&mut self, name: &str, count: usize) -> Result<Vec<u64>, String> {
        let found = self.words.word().unwrap_or_default();
        if !found.eq_ignore_ascii_case(name) {
            return Err(format!("`{name}` should be where `{found}` is"));
        }
        let kind = self.words.word().unwrap_or_default();
        self.words.line();
        self.whole(count, kind, "numbers of cells")
    }

    fn cells(&mut self, version: f64) -> Result<Cells, String> {
        let (first, second): (usize, usize) = (
            self.words.number("a number of cells")?,
            self.words.number("their size")?,
        );
        self.words.line();
        if version >= 5.0 {
            let ends = self.array("OFFSETS", first)?;
            let points = self.array("CONNECTIVITY", second)?;
            self.words.line();
            return Ok(Cells {
                ends: ends.get(1..).unwrap_or_default().to_vec(),
                points,
            });
        }
        let flat = self.whole(second, "int", "numbers of cells")?;
        let (mut cells, mut at) = (Cells::default(), 0);
        for k in 0..first {
            let short = || format!("cell {k} of {first} goes beyond the list of cells");
            let count = *flat.get(at).ok_or_else(short)?;
            let end = usize::try_from(count)
                .ok()
                .and_then(|c| c.checked_add(at + 1));
            let points = end
                .and_then(|end| flat.get(at + 1..end))
                .ok_or_else(short)?;
            cells.points.extend_from_slice(points);
            cells.ends.push(cells.points.len() as u64);
            at += 1 + points.len();
        }
        Ok(cells)
    }
}

fn version(title: Option<&str>) -> Result<f64, String> {
    let number = title.and_then(|t| t.strip_prefix("# vtk DataFile Version "));
    let number = number.and_then(|n| n.trim().parse().ok());
    number.ok_or_else(|| "the first line must be `# vtk DataFile Version x.y`".into())
}

pub(super) fn read(bytes: &[u8]) -> Result<Surface, String> {
    let mut words = Words::new(bytes);
    let version = version(words.line())?;
    words.line();
    let binary = match words.word() {
        Some("ASCII") => false,
        Some("BINARY") => true,
        _ => return Err("the third line must be ASCII or BINARY".into()),
    };
    let mut reader = Reader { words, binary };
    let mut surface = Surface::default();
    let mut grid = Cells::default();
    while let Some(word) = reader.words.word() {
        match word.to_ascii_uppercase().as_str() {
            "DATASET" => match reader.words.word().unwrap_or_default() {
                "POLYDATA" | "UNSTRUCTURED_GRID" => {}
                other => {
                    return Err(format!(
                        "DATASET {other}: must be POLYDATA or UNSTRUCTURED_GRID"
                    ));
                }
            },
            "POINTS" => {
                let count: usize = reader.words.number("the number of points")?;
                let kind = reader.words.word().unwrap_or_default();
                reader.words.line();
                let count = count.checked_mul(3).ok_or("too many points")?;
                let numbers = reader.numbers(count, kind, "coordinates")?;
                for &xyz in numbers.as_chunks::<3>().0 {
                    surface.add_vertex(xyz);
                }
            }
            "VERTICES" | "LINES" => drop(reader.cells(version)?),
            "POLYGONS" => reader
                .cells(version)?
                .add_to(&mut surface, |_| Cell::Polygon)?,
            "TRIANGLE_STRIPS" => reader
                .cells(version)?
                .add_to(&mut surface, |_| Cell::Strip)?,
            "CELLS" => grid = reader.cells(version)?,
            "CELL_TYPES" => {
                let count = reader.words.number("the number of cells")?;
                reader.words.line();
                let kinds = reader.whole(count, "int", "types of cells")?;
                let kind = |k: usize| kinds.get(k).map_or(Cell::Other, |&kind| Cell::of(kind));
                grid.add_to(&mut surface, kind)?;
            }
            "METADATA" => {
                // To the next empty line.
                reader.words.line();
                while reader.words.line().is_some_and(|line| !line.is_empty()) {}
            }
            // Fields may stand before the points too, but no program that we know writes them there.
            "POINT_DATA" | "CELL_DATA" | "FIELD" => break,
            other => {
                return Err(format!(
                    "line {}: `{other}` is not known",
                    reader.words.line_number()
                ));
            }
        }
    }
    Ok(surface)
}

pub(super) fn write(surface: &Surface) -> Vec<u8> {
    let (points, cells) = (surface.vertices.len(), surface.triangles.len());
    let text = format!(
        "# vtk DataFile Version 3.0\nsurface\nASCII\nDATASET POLYDATA\nPOINTS {points} double\n{}POLYGONS {cells} {}\n{}",
        vertex_lines(surface, ""),
        4 * cells,
        triangle_lines(surface, "3 ", 0),
    );
    text.into_bytes()
}
