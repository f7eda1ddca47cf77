//! Triangle surfaces in files: read and written by extension.
//!
//! | extension | format | read | written |
//! |---|---|---|---|
//! | `stl` | stereolithography (`stl_io`) | ASCII, binary; single precision | binary |
//! | `obj` | Wavefront (`tobj`) | polygons | ASCII |
//! | `ply` | Stanford (`ply-rs-bw`) | ASCII, binary of both orders | ASCII |
//! | `vtk` | legacy VTK | poly data and unstructured grids, ASCII and binary, cells of version 2 to 5 | ASCII |
//! | `vtu`, `vtp` | VTK's XML | ASCII and base64 in place or appended, zlib or not | ASCII (`vtu`) |
//! | `msh` | Gmsh 2 and 4 | ASCII | 2.2 ASCII |
//!
//! Polygons become fans of triangles, which is right for convex ones. Volume cells, lines and points are
//! passed over. A count in a file is never trusted with memory before the file has shown as many numbers.

mod gmsh;
mod obj;
mod ply;
mod stl;
mod vtk;
mod vtk_xml;
mod words;

use colluvium_dem::walls::{Mesh, MeshError};
use nalgebra::Vector3;
use std::path::Path;

/// Extensions that have a format.
const EXTENSIONS: &str = "stl, obj, ply, vtk, vtu, vtp or msh";

/// What is wrong with a mesh file.
#[derive(Debug, thiserror::Error)]
pub enum MeshFileError {
    /// It cannot be read.
    #[error("{file}: cannot read this mesh file: {source}")]
    Unreadable {
        /// The file.
        file: String,
        /// Why.
        source: std::io::Error,
    },
    /// It cannot be written.
    #[error("{file}: cannot write this mesh file: {source}")]
    Unwritable {
        /// The file.
        file: String,
        /// Why.
        source: std::io::Error,
    },
    /// Its name says nothing that is known.
    #[error("{file}: a mesh file's name must end in {allowed}")]
    Extension {
        /// The file.
        file: String,
        /// What it may end in.
        allowed: &'static str,
    },
    /// It is not what its name says.
    #[error("{file}: {reason}")]
    Malformed {
        /// The file.
        file: String,
        /// What is wrong.
        reason: String,
    },
    /// Its triangles make no mesh.
    #[error("{file}: {source}")]
    Mesh {
        /// The file.
        file: String,
        /// Why.
        source: MeshError,
    },
}

/// Vertices (m) and triangles, as a file has them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Surface {
    /// Positions (m).
    pub vertices: Vec<Vector3<f64>>,
    /// Three vertices each, from 0.
    pub triangles: Vec<[u32; 3]>,
}

impl Surface {
    /// Adds a polygon as a fan of triangles; vertices are numbered from 0.
    fn add_polygon(&mut self, corners: &[u32]) {
        let rest = corners.get(1..).unwrap_or_default();
        for pair in rest.windows(2) {
            self.triangles.push([corners[0], pair[0], pair[1]]);
        }
    }

    /// Adds a strip of triangles, which turn round by turns.
    fn add_strip(&mut self, corners: &[u32]) {
        for (k, t) in corners.windows(3).enumerate() {
            let [a, b, c] = [t[0], t[1], t[2]];
            self.triangles
                .push(if k % 2 == 0 { [a, b, c] } else { [b, a, c] });
        }
    }

    /// Adds a vertex from the first three of some numbers.
    fn add_vertex(&mut self, xyz: [f64; 3]) {
        self.vertices.push(xyz.into());
    }
}

fn name(path: &Path) -> String {
    path.display().to_string()
}

fn extension(path: &Path) -> Result<String, MeshFileError> {
    let extension = path.extension().and_then(|e| e.to_str());
    let extension = extension.unwrap_or_default().to_ascii_lowercase();
    match extension.as_str() {
        "stl" | "obj" | "ply" | "vtk" | "vtu" | "vtp" | "msh" => Ok(extension),
        _ => Err(MeshFileError::Extension {
            file: name(path),
            allowed: EXTENSIONS,
        }),
    }
}

/// Reads a surface from the bytes of a file of this extension, or says what is wrong with them.
fn parse(extension: &str, bytes: &[u8]) -> Result<Surface, String> {
    match extension {
        "stl" => stl::read(bytes),
        "obj" => obj::read(bytes),
        "ply" => ply::read(bytes),
        "vtk" => vtk::read(bytes),
        "msh" => gmsh::read(bytes),
        _ => vtk_xml::read(bytes),
    }
}

/// Reads a surface.
///
/// # Errors
/// If the file cannot be read, or does not hold what its extension says.
pub fn read_surface(path: &Path) -> Result<Surface, MeshFileError> {
    let extension = extension(path)?;
    let bytes = std::fs::read(path).map_err(|source| MeshFileError::Unreadable {
        file: name(path),
        source,
    })?;
    parse(&extension, &bytes).map_err(|reason| MeshFileError::Malformed {
        file: name(path),
        reason,
    })
}

/// Reads a mesh for a wall, its lengths multiplied by `scale` to have metres.
///
/// # Errors
/// As [`read_surface`], or if its triangles make no mesh.
pub fn read_mesh(path: &Path, scale: f64) -> Result<Mesh, MeshFileError> {
    let surface = read_surface(path)?;
    let vertices = surface.vertices.iter().map(|v| v * scale).collect();
    Mesh::new(vertices, &surface.triangles).map_err(|source| MeshFileError::Mesh {
        file: name(path),
        source,
    })
}

/// Writes a surface in the format that the extension names.
///
/// # Errors
/// If the extension has no format that is written, or the file cannot be written.
pub fn write_surface(path: &Path, surface: &Surface) -> Result<(), MeshFileError> {
    let extension = extension(path)?;
    let known = |t: &[u32; 3]| t.iter().all(|&v| (v as usize) < surface.vertices.len());
    if let Some(triangle) = surface.triangles.iter().position(|t| !known(t)) {
        return Err(MeshFileError::Mesh {
            file: name(path),
            source: MeshError::Index {
                triangle,
                vertices: surface.vertices.len(),
            },
        });
    }
    let bytes = match extension.as_str() {
        "stl" => stl::write(surface),
        "obj" => obj::write(surface),
        "ply" => ply::write(surface),
        "vtk" => vtk::write(surface),
        "msh" => gmsh::write(surface),
        "vtu" => vtk_xml::write(surface),
        _ => {
            return Err(MeshFileError::Extension {
                file: name(path),
                allowed: "stl, obj, ply, vtk, vtu or msh to be written",
            });
        }
    };
    std::fs::write(path, bytes).map_err(|source| MeshFileError::Unwritable {
        file: name(path),
        source,
    })
}

/// Vertices as lines of three numbers that read back to the same bits, each line after `start`.
fn vertex_lines(surface: &Surface, start: &str) -> String {
    let line = |v: &Vector3<f64>| format!("{start}{:?} {:?} {:?}\n", v.x, v.y, v.z);
    surface.vertices.iter().map(line).collect()
}

/// Triangles as lines of three numbers, counted from `first`, each line after `start`.
fn triangle_lines(surface: &Surface, start: &str, first: u64) -> String {
    let line = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| u64::from(v) + first);
        format!("{start}{a} {b} {c}\n")
    };
    surface.triangles.iter().map(line).collect()
}

#[cfg(test)]
mod tests;
