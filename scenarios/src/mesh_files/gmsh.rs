//! Gmsh's `msh`, versions 2 and 4, ASCII: sections `$Nodes` and `$Elements`.
//!
//! ```text
//! 2    nodes     count, then  number x y z
//!      elements  count, then  number type tags-count tags… nodes…
//! 4.1  nodes     blocks count lowest highest, then  dim tag parametric count, numbers…, x y z [u [v [w]]]…
//!      elements  blocks count lowest highest, then  dim tag type count, then  number nodes…
//! 4.0  nodes     blocks count, then  tag dim parametric count, then  number x y z …
//!      elements  blocks count, then  tag dim type count, then  number nodes…
//! ```

use super::words::Words;
use super::{Surface, triangle_lines, vertex_lines};
use std::collections::BTreeMap;

/// Nodes of an element of a type; of those of higher order the corners come first.
fn nodes_of(kind: u32) -> Option<usize> {
    let nodes = [
        2, 3, 4, 4, 8, 6, 5, 3, 6, 9, 10, 27, 18, 14, 1, 8, 20, 15, 13, 9, 10, 12, 15, 15, 21, 4,
        5, 6, 20, 35, 56,
    ];
    nodes.get((kind as usize).checked_sub(1)?).copied()
}

/// Corners of an element that is a face: triangles of order 1 to 5 and quadrangles of order 1 and 2.
fn corners_of(kind: u32) -> usize {
    match kind {
        2 | 9 | 20..=25 => 3,
        3 | 10 | 16 => 4,
        _ => 0,
    }
}

/// A file half read.
struct Reader<'a> {
    words: Words<'a>,
    surface: Surface,
    /// Vertices by Gmsh's numbers.
    numbers: BTreeMap<u64, u32>,
}

pub(super) fn read(bytes: &[u8]) -> Result<Surface, String> {
    let mut words = Words::new(bytes);
    words.skip_to("$MeshFormat")?;
    let version: f64 = words.number("a version")?;
    let binary: u32 = words.number("0 for ASCII")?;
    if binary != 0 {
        return Err("binary msh is not read: save it as ASCII (gmsh -bin 0)".into());
    }
    if !(2.0..3.0).contains(&version) && !(4.0..5.0).contains(&version) {
        return Err(format!("msh version {version}: must be 2 or 4"));
    }
    words.skip_to("$Nodes")?;
    let mut reader = Reader {
        words,
        surface: Surface::default(),
        numbers: BTreeMap::new(),
    };
    if version < 3.0 {
        reader.nodes_2()?;
        reader.words.skip_to("$Elements")?;
        reader.elements_2()?;
    } else {
        reader.nodes_4(version > 4.05)?;
        reader.words.skip_to("$Elements")?;
        reader.elements_4(version > 4.05)?;
    }
    Ok(reader.surface)
}

impl Reader<'_> {
    fn whole(&mut self, what: &str) -> Result<u64, String> {
        self.words.number(what)
    }

    fn vertex(&mut self, number: u64) -> Result<(), String> {
        let place = u32::try_from(self.surface.vertices.len());
        let place = place.map_err(|_| "more than 2³² nodes")?;
        self.surface.add_vertex(self.words.three("a coordinate")?);
        self.numbers.insert(number, place);
        Ok(())
    }

    /// An element's nodes.
    fn element(&mut self, kind: u32) -> Result<(), String> {
        let nodes = nodes_of(kind).ok_or_else(|| format!("element type {kind} is not known"))?;
        let mut corners = Vec::with_capacity(4);
        for k in 0..nodes {
            let number = self.whole("a node's number")?;
            if k < corners_of(kind) {
                let known = self.numbers.get(&number);
                let known = known
                    .ok_or_else(|| format!("an element names node {number}, which is not there"))?;
                corners.push(*known);
            }
        }
        self.surface.add_polygon(&corners);
        Ok(())
    }

    fn nodes_2(&mut self) -> Result<(), String> {
        for _ in 0..self.whole("the number of nodes")? {
            let number = self.whole("a node's number")?;
            self.vertex(number)?;
        }
        Ok(())
    }

    fn elements_2(&mut self) -> Result<(), String> {
        for _ in 0..self.whole("the number of elements")? {
            self.whole("an element's number")?;
            let kind = self.words.number("an element's type")?;
            for _ in 0..self.whole("the number of tags")? {
                self.words.number::<i64>("a tag")?;
            }
            self.element(kind)?;
        }
        Ok(())
    }

    /// Blocks of a section; the bounds of numbers are there since 4.1.
    fn blocks(&mut self, bounds: bool) -> Result<u64, String> {
        let blocks = self.whole("the number of blocks")?;
        for _ in 0..if bounds { 3 } else { 1 } {
            self.whole("a number")?;
        }
        Ok(blocks)
    }

    fn nodes_4(&mut self, later: bool) -> Result<(), String> {
        for _ in 0..self.blocks(later)? {
            let first: i64 = self.words.number("a block's dimension")?;
            let second: i64 = self.words.number("a block's tag")?;
            let dimension = if later { first } else { second };
            let parametric = self.whole("0 or 1")?;
            let count = self.whole("the number of nodes")?;
            let further = if parametric == 0 {
                0
            } else {
                dimension.clamp(0, 3)
            };
            let mut numbers = Vec::new();
            for _ in 0..if later { count } else { 0 } {
                numbers.push(self.whole("a node's number")?);
            }
            for k in 0..count {
                let number = match numbers.get(k as usize) {
                    Some(&number) => number,
                    None => self.whole("a node's number")?,
                };
                self.vertex(number)?;
                for _ in 0..further {
                    self.words.number::<f64>("a parameter")?;
                }
            }
        }
        Ok(())
    }

    fn elements_4(&mut self, later: bool) -> Result<(), String> {
        for _ in 0..self.blocks(later)? {
            self.words.number::<i64>("a block's dimension")?;
            self.words.number::<i64>("a block's tag")?;
            let kind = self.words.number("an element's type")?;
            for _ in 0..self.whole("the number of elements")? {
                self.whole("an element's number")?;
                self.element(kind)?;
            }
        }
        Ok(())
    }
}

pub(super) fn write(surface: &Surface) -> Vec<u8> {
    let numbered = |lines: String, between: &str| -> String {
        let lines = lines.lines().enumerate();
        lines
            .map(|(k, line)| format!("{} {between}{line}\n", k + 1))
            .collect()
    };
    let (nodes, elements) = (surface.vertices.len(), surface.triangles.len());
    let text = format!(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n{nodes}\n{}$EndNodes\n$Elements\n{elements}\n{}$EndElements\n",
        numbered(vertex_lines(surface, ""), ""),
        numbered(triangle_lines(surface, "", 1), "2 2 1 1 "),
    );
    text.into_bytes()
}
