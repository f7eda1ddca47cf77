//! VTK's XML files of unstructured grids (`vtu`) and poly data (`vtp`).
//!
//! An array is ASCII, or base64 with a header: the number of bytes, or for zlib the number of blocks, the size of
//! a block, that of the last one, and the compressed sizes. Appended arrays start behind the underscore.

use super::vtk::{Cell, Cells};
use super::{Surface, triangle_lines, vertex_lines};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::read::ZlibDecoder;
use roxmltree::{Document, Node};
use std::io::Read;

/// No array that is decompressed may be longer (bytes): a few hundred million points.
const LARGEST: u64 = 1 << 33;

/// What an array is read with.
struct Format<'a> {
    big_endian: bool,
    zlib: bool,
    /// Bytes of a number in a header.
    header: usize,
    /// Appended data in base64.
    appended: Option<&'a str>,
}

fn child<'a, 'i>(node: Node<'a, 'i>, name: &str) -> Option<Node<'a, 'i>> {
    node.children().find(|n| n.has_tag_name(name))
}

/// A number of any type at the start of some bytes.
fn decode(kind: &str, bytes: &[u8], big_endian: bool) -> Option<f64> {
    let mut raw = [0; 8];
    for (k, to) in raw[..bytes.len()].iter_mut().enumerate() {
        *to = bytes[if big_endian { bytes.len() - 1 - k } else { k }];
    }
    let word = u64::from_le_bytes(raw);
    Some(match kind {
        "Int8" => f64::from(word as i8),
        "Int16" => f64::from(word as i16),
        "Int32" => f64::from(word as i32),
        "Int64" => word as i64 as f64,
        "UInt8" | "UInt16" | "UInt32" | "UInt64" => word as f64,
        "Float32" => f64::from(f32::from_bits(word as u32)),
        "Float64" => f64::from_bits(word),
        _ => return None,
    })
}

fn size_of(kind: &str) -> Option<usize> {
    let bits = kind.trim_start_matches(|c: char| c.is_ascii_alphabetic());
    let known = decode(kind, &[0; 1], false).is_some();
    known.then(|| bits.parse::<usize>().ok().map(|bits| bits / 8))?
}

/// Decodes as much base64 as makes at least `bytes` bytes; the text behind it.
fn unpack(text: &str, bytes: usize) -> Result<(Vec<u8>, &str), String> {
    let letters = bytes.div_ceil(3).checked_mul(4);
    let part = letters.and_then(|letters| text.get(..letters));
    let part = part.ok_or_else(|| format!("base64 data end before {bytes} bytes"))?;
    let decoded = STANDARD.decode(part).map_err(|e| format!("base64: {e}"))?;
    Ok((decoded, &text[part.len()..]))
}

impl Format<'_> {
    /// Numbers of a header.
    fn header(&self, text: &str, count: usize) -> Result<Vec<usize>, String> {
        let length = count
            .checked_mul(self.header)
            .ok_or("a header is too long")?;
        let (bytes, _) = unpack(text, length)?;
        let kind = if self.header == 8 { "UInt64" } else { "UInt32" };
        let numbers = bytes.chunks_exact(self.header).take(count);
        let numbers = numbers.filter_map(|b| decode(kind, b, self.big_endian));
        Ok(numbers.map(|x| x as usize).collect())
    }

    /// The bytes of an array in base64.
    fn bytes(&self, text: &str) -> Result<Vec<u8>, String> {
        let first = self.header(text, 1)?.first().copied().unwrap_or(0);
        if !self.zlib {
            let length = first
                .checked_add(self.header)
                .ok_or("an array is too long")?;
            let (bytes, _) = unpack(text, length)?;
            let bytes = bytes.get(self.header..length).unwrap_or_default();
            return Ok(bytes.to_vec());
        }
        let count = first.checked_add(3).ok_or("a header is too long")?;
        let header = self.header(text, count)?;
        let (_, rest) = unpack(text, count * self.header)?;
        let sizes = header.get(3..).unwrap_or_default();
        let total = sizes.iter().try_fold(0_usize, |sum, &s| sum.checked_add(s));
        let (packed, _) = unpack(rest, total.ok_or("an array is too long")?)?;
        let (mut bytes, mut at) = (Vec::new(), 0);
        for &size in sizes {
            let block = packed
                .get(at..at + size)
                .ok_or("compressed data end too early")?;
            let left = LARGEST.saturating_sub(bytes.len() as u64);
            let read = ZlibDecoder::new(block).take(left).read_to_end(&mut bytes);
            read.map_err(|e| format!("zlib: {e}"))?;
            at += size;
        }
        Ok(bytes)
    }

    /// The numbers of a `DataArray`.
    fn numbers(&self, array: Node) -> Result<Vec<f64>, String> {
        let kind = array.attribute("type").unwrap_or_default();
        let size =
            size_of(kind).ok_or_else(|| format!("numbers of type `{kind}` are not known"))?;
        let text = array.text().unwrap_or_default().trim();
        let bytes = match array.attribute("format").unwrap_or("ascii") {
            "ascii" => {
                let number = |word: &str| {
                    word.parse()
                        .map_err(|_| format!("`{word}` is not a number"))
                };
                return text.split_ascii_whitespace().map(number).collect();
            }
            "binary" => self.bytes(text)?,
            "appended" => {
                let data = self.appended.ok_or("there is no appended data in base64")?;
                let offset = array
                    .attribute("offset")
                    .and_then(|o| o.parse::<usize>().ok());
                let data = offset.and_then(|offset| data.get(offset..));
                self.bytes(data.ok_or("an array's offset lies beyond the appended data")?)?
            }
            other => return Err(format!("format `{other}` of an array is not known")),
        };
        let numbers = bytes.chunks_exact(size);
        Ok(numbers
            .filter_map(|b| decode(kind, b, self.big_endian))
            .collect())
    }

    fn whole(&self, parent: Node, name: &str) -> Result<Vec<u64>, String> {
        let array = parent
            .children()
            .find(|n| n.attribute("Name") == Some(name));
        let array =
            array.ok_or_else(|| format!("`{}` has no array `{name}`", parent.tag_name().name()))?;
        let whole = |x: f64| {
            let good = x >= 0.0 && x.fract() == 0.0 && x.is_finite();
            good.then_some(x as u64)
                .ok_or_else(|| format!("array `{name}`: {x} is no number of a point or cell"))
        };
        self.numbers(array)?.into_iter().map(whole).collect()
    }

    fn cells(&self, parent: Node) -> Result<Cells, String> {
        Ok(Cells {
            ends: self.whole(parent, "offsets")?,
            points: self.whole(parent, "connectivity")?,
        })
    }

    /// Adds the surface of one piece of a file.
    fn add_piece(&self, piece: Node, surface: &mut Surface) -> Result<(), String> {
        let mut part = Surface::default();
        if let Some(points) = child(piece, "Points") {
            let array = child(points, "DataArray").ok_or("`Points` has no array")?;
            for &xyz in self.numbers(array)?.as_chunks::<3>().0 {
                part.add_vertex(xyz);
            }
        }
        if let Some(cells) = child(piece, "Cells") {
            let kinds = self.whole(cells, "types")?;
            let kind = |k: usize| kinds.get(k).map_or(Cell::Other, |&kind| Cell::of(kind));
            self.cells(cells)?.add_to(&mut part, kind)?;
        }
        for (name, kind) in [("Polys", Cell::Polygon), ("Strips", Cell::Strip)] {
            let cells = child(piece, name).filter(|c| child(*c, "DataArray").is_some());
            if let Some(cells) = cells {
                self.cells(cells)?.add_to(&mut part, |_| kind)?;
            }
        }
        let (first, count) = (surface.vertices.len(), part.vertices.len());
        let moved = |v: u32| {
            let known = (v as usize) < count;
            let moved = u32::try_from(first + v as usize).ok().filter(|_| known);
            moved.ok_or_else(|| format!("a cell names point {v} of {count}"))
        };
        for [a, b, c] in part.triangles {
            surface.triangles.push([moved(a)?, moved(b)?, moved(c)?]);
        }
        surface.vertices.extend(part.vertices);
        Ok(())
    }
}

pub(super) fn read(bytes: &[u8]) -> Result<Surface, String> {
    let text = std::str::from_utf8(bytes).map_err(
        |_| "not text: appended raw data are not read, save the file as ASCII or base64",
    )?;
    let document = Document::parse(text).map_err(|e| format!("XML: {e}"))?;
    let root = document.root_element();
    let kind = root.attribute("type").unwrap_or_default();
    if !root.has_tag_name("VTKFile") || !["UnstructuredGrid", "PolyData"].contains(&kind) {
        return Err("must be a VTKFile of type UnstructuredGrid or PolyData".into());
    }
    let zlib = match root.attribute("compressor") {
        None => false,
        Some("vtkZLibDataCompressor") => true,
        Some(other) => return Err(format!("compressor `{other}`: only zlib is read")),
    };
    let appended = child(root, "AppendedData");
    let appended = appended.filter(|a| a.attribute("encoding") == Some("base64"));
    let appended = appended.and_then(|a| a.text()?.trim().strip_prefix('_'));
    let format = Format {
        big_endian: root.attribute("byte_order") == Some("BigEndian"),
        zlib,
        header: if root.attribute("header_type") == Some("UInt64") {
            8
        } else {
            4
        },
        appended,
    };
    let mut surface = Surface::default();
    let data = child(root, kind).ok_or_else(|| format!("there is no `{kind}`"))?;
    for piece in data.children().filter(|n| n.has_tag_name("Piece")) {
        format.add_piece(piece, &mut surface)?;
    }
    Ok(surface)
}

pub(super) fn write(surface: &Surface) -> Vec<u8> {
    let (points, cells) = (surface.vertices.len(), surface.triangles.len());
    let ends: String = (1..=cells).map(|k| format!("{}\n", 3 * k)).collect();
    let array = |kind: &str, name: &str, more: &str, numbers: &str| {
        format!(
            "<DataArray type=\"{kind}\" Name=\"{name}\"{more} format=\"ascii\">\n{numbers}</DataArray>\n"
        )
    };
    let text = format!(
        "<?xml version=\"1.0\"?>\n\
         <VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\">\n<UnstructuredGrid>\n\
         <Piece NumberOfPoints=\"{points}\" NumberOfCells=\"{cells}\">\n<Points>\n{}</Points>\n\
         <Cells>\n{}{}{}</Cells>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n",
        array(
            "Float64",
            "Points",
            " NumberOfComponents=\"3\"",
            &vertex_lines(surface, "")
        ),
        array("Int64", "connectivity", "", &triangle_lines(surface, "", 0)),
        array("Int64", "offsets", "", &ends),
        array("UInt8", "types", "", &"5\n".repeat(cells)),
    );
    text.into_bytes()
}
