//! Surfaces there and back, samples as other programs write them, and files that are broken.

#![allow(clippy::unwrap_used)]

use super::*;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::io::Write;

const WRITTEN: [&str; 6] = ["stl", "obj", "ply", "vtk", "vtu", "msh"];

/// A tetrahedron; its coordinates have no short form in binary, but are single precision.
fn tetrahedron() -> Surface {
    let third = f64::from(1.0_f32 / 3.0);
    Surface {
        vertices: vec![
            Vector3::zeros(),
            Vector3::new(third, 0.0, 0.0),
            Vector3::new(0.0, 1e-3_f32.into(), 0.0),
            Vector3::new(0.0, 0.0, -2.5e4),
        ],
        triangles: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]],
    }
}

/// Corners of all triangles.
fn corners(surface: &Surface) -> Vec<[Vector3<f64>; 3]> {
    let triangles = surface.triangles.iter();
    triangles
        .map(|t| t.map(|v| surface.vertices[v as usize]))
        .collect()
}

#[test]
fn every_format_reads_back_what_it_wrote() {
    let folder = tempfile::tempdir().unwrap();
    for extension in WRITTEN {
        let path = folder.path().join(format!("surface.{extension}"));
        let mut surface = tetrahedron();
        if extension != "stl" {
            // No more digits than a double has, and all of them.
            surface.vertices[0].x = 0.1 + 0.2;
        }
        write_surface(&path, &surface).unwrap();
        let read = read_surface(&path).unwrap();
        assert_eq!(corners(&read), corners(&surface), "{extension}");
        let mesh = read_mesh(&path, 2.0).unwrap();
        assert_eq!(mesh.triangles().len(), 4, "{extension}");
        assert_eq!(mesh.bounds()[0].z, -5e4);
    }
}

/// Two triangles over the unit square.
fn square(extension: &str, bytes: &[u8]) {
    let surface = parse(extension, bytes).unwrap();
    let mut area = 0.0;
    for [a, b, c] in corners(&surface) {
        let twice = (b - a).cross(&(c - a));
        assert_eq!(twice.z, twice.norm(), "{extension}: upside down");
        area += 0.5 * twice.z;
    }
    assert_eq!(surface.triangles.len(), 2, "{extension}");
    assert_eq!(area, 1.0, "{extension}");
}

#[test]
fn samples_of_text_formats() {
    square(
        "obj",
        b"o a\nv 0 0 0\nv 1 0 0\nvt 0 0\nv 1 1 0\nv 0 1 0\nf 1/1 2/1 3/1 4/1\nl 1 2\n",
    );
    square(
        "stl",
        b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\nendloop\nendfacet\n\
          facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 1 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid a\n",
    );
    let points = "POINTS 4 float\n0 0 0 1 0 0\n1 1 0 0 1 0\n";
    let head = "# vtk DataFile Version 5.1\nx\nASCII\nDATASET";
    square(
        "vtk",
        format!(
            "{head} POLYDATA\n{points}METADATA\nINFORMATION 0\n\nPOLYGONS 2 4\nOFFSETS vtktypeint64\n0 4\n\
             CONNECTIVITY vtktypeint64\n0 1 2 3\nCELL_DATA 1\nSCALARS a float\n"
        )
        .as_bytes(),
    );
    square(
        "vtk",
        format!(
            "# vtk DataFile Version 2.0\nx\nASCII\nDATASET UNSTRUCTURED_GRID\n{points}CELLS 3 11\n\
             4 0 1 2 3\n2 0 1\n2 1 2\nCELL_TYPES 3\n9 3 3\n"
        )
        .as_bytes(),
    );
    square(
        "vtk",
        format!("{head} POLYDATA\n{points}TRIANGLE_STRIPS 2 4\nOFFSETS int\n0 4\nCONNECTIVITY int\n0 1 3 2\n")
            .as_bytes(),
    );
    square(
        "msh",
        b"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n7 0 0 0\n2 1 0 0\n3 1 1 0\n9 0 1 0\n$EndNodes\n$Elements\n3\n\
          1 15 2 0 1 7\n2 2 2 0 1 7 2 3\n3 2 2 0 1 7 3 9\n$EndElements\n",
    );
    square(
        "msh",
        b"$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Entities\n0 0 0 0\n$EndEntities\n$Nodes\n2 4 1 9\n0 1 0 1\n9\n0 1 0\n\
          2 1 1 3\n1\n2\n3\n0 0 0 0.5 0.5\n1 0 0 0.5 0.5\n1 1 0 0.5 0.5\n$EndNodes\n$Elements\n2 2 1 2\n0 1 15 1\n1 9\n\
          2 1 3 1\n2 1 2 3 9\n$EndElements\n",
    );
    square(
        "msh",
        b"$MeshFormat\n4 0 8\n$EndMeshFormat\n$Nodes\n1 4\n1 2 0 4\n1 0 0 0\n2 1 0 0\n3 1 1 0\n4 0 1 0\n$EndNodes\n\
          $Elements\n1 1\n1 2 3 1\n1 1 2 3 4\n$EndElements\n",
    );
}

const CORNERS: [f64; 12] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0];

fn binary_vtk() -> Vec<u8> {
    let mut bytes =
        b"# vtk DataFile Version 3.0\nx\nBINARY\nDATASET POLYDATA\nPOINTS 4 double\n".to_vec();
    bytes.extend(CORNERS.iter().flat_map(|x| x.to_be_bytes()));
    bytes.extend(b"\nPOLYGONS 1 5\n");
    bytes.extend([4_i32, 0, 1, 2, 3].iter().flat_map(|x| x.to_be_bytes()));
    bytes
}

fn binary_ply(big: bool) -> Vec<u8> {
    let order = if big { "big" } else { "little" };
    let head = format!(
        "ply\nformat binary_{order}_endian 1.0\ncomment x\nelement vertex 4\nproperty float x\nproperty float y\n\
         property float z\nproperty uchar red\nelement face 1\nproperty list uchar int vertex_index\nend_header\n"
    );
    let mut bytes = head.into_bytes();
    for corner in CORNERS.as_chunks::<3>().0 {
        for x in corner.map(|x| x as f32) {
            bytes.extend(if big {
                x.to_be_bytes()
            } else {
                x.to_le_bytes()
            });
        }
        bytes.push(200);
    }
    bytes.push(4);
    for k in 0..4_i32 {
        bytes.extend(if big {
            k.to_be_bytes()
        } else {
            k.to_le_bytes()
        });
    }
    bytes
}

fn packed(numbers: Vec<u8>, zlib: bool) -> String {
    let length = numbers.len() as u32;
    if !zlib {
        let all = [length.to_le_bytes().to_vec(), numbers].concat();
        return STANDARD.encode(all);
    }
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(&numbers).unwrap();
    let block = encoder.finish().unwrap();
    let header = [1, length, 0, block.len() as u32];
    let header: Vec<u8> = header.iter().flat_map(|x| x.to_le_bytes()).collect();
    STANDARD.encode(header) + &STANDARD.encode(block)
}

fn vtu(zlib: bool, appended: bool) -> Vec<u8> {
    let longs = |list: &[i64]| {
        list.iter()
            .flat_map(|x| x.to_le_bytes())
            .collect::<Vec<u8>>()
    };
    let mut behind = String::new();
    let mut array = |kind: &str, name: &str, numbers: Vec<u8>| {
        let data = packed(numbers, zlib);
        let start = format!("<DataArray type=\"{kind}\" Name=\"{name}\" ");
        if appended {
            let offset = behind.len();
            behind += &data;
            format!("{start} format=\"appended\" offset=\"{offset}\"/>")
        } else {
            format!("{start} format=\"binary\">\n  {data}\n</DataArray>")
        }
    };
    let points = array(
        "Float64",
        "Points",
        CORNERS.iter().flat_map(|x| x.to_le_bytes()).collect(),
    );
    let list = array("Int64", "connectivity", longs(&[0, 1, 2, 3]));
    let ends = array("Int64", "offsets", longs(&[4]));
    let types = array("UInt8", "types", vec![9]);
    let compressor = if zlib {
        " compressor=\"vtkZLibDataCompressor\""
    } else {
        ""
    };
    format!(
        "<VTKFile type=\"UnstructuredGrid\" byte_order=\"LittleEndian\"{compressor}><UnstructuredGrid><Piece \
         NumberOfPoints=\"4\" NumberOfCells=\"1\"><Points>{points}</Points><Cells>{list}{ends}{types}</Cells></Piece>\
         </UnstructuredGrid><AppendedData encoding=\"base64\">_{behind}</AppendedData></VTKFile>"
    )
    .into_bytes()
}

#[test]
fn samples_of_binary_formats() {
    square("vtk", &binary_vtk());
    square("ply", &binary_ply(false));
    square("ply", &binary_ply(true));
    for (zlib, appended) in [(false, false), (true, false), (false, true), (true, true)] {
        square("vtu", &vtu(zlib, appended));
    }
    // A binary file whose title begins like an ASCII one.
    let mut stl = stl::write(&tetrahedron());
    stl[..6].copy_from_slice(b"solid ");
    assert_eq!(
        corners(&parse("stl", &stl).unwrap()),
        corners(&tetrahedron())
    );
}

/// Breaks a file somewhere: cuts it off, changes bytes, drops, doubles or replaces a word.
fn broken(bytes: &[u8], random: &mut ChaCha8Rng) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    let at = random.random_range(0..bytes.len());
    let word = |bytes: &[u8], from: usize| {
        let blank = |b: &u8| b.is_ascii_whitespace() || b"<>\"=".contains(b);
        let start = bytes[..from].iter().rposition(blank).map_or(0, |k| k + 1);
        let end = bytes[from..]
            .iter()
            .position(blank)
            .map_or(bytes.len(), |k| from + k);
        start..end.max(start)
    };
    let odd: [&[u8]; 10] = [
        b"nan",
        b"-1",
        b"4294967296",
        b"99999999999999999999",
        b"1e400",
        b"inf",
        b"\xff\xfe",
        b"",
        b"3000000000",
        b"x",
    ];
    match random.random_range(0..6) {
        0 => bytes.truncate(at),
        1 => bytes[at] ^= 1 << random.random_range(0..8),
        2 => bytes[at..].iter_mut().take(4).for_each(|b| *b = 0xff),
        3 => drop(bytes.splice(word(&bytes, at), [])),
        4 => {
            let copy = bytes[word(&bytes, at)].to_vec();
            drop(bytes.splice(at..at, copy));
        }
        _ => {
            let new = odd[random.random_range(0..odd.len())].to_vec();
            drop(bytes.splice(word(&bytes, at), new));
        }
    }
    bytes
}

#[test]
fn broken_files_are_refused_or_read_but_never_panic() {
    let mut samples: Vec<(&str, Vec<u8>)> = vec![
        ("stl", stl::write(&tetrahedron())),
        ("obj", obj::write(&tetrahedron())),
        ("ply", ply::write(&tetrahedron())),
        ("vtk", vtk::write(&tetrahedron())),
        ("vtu", vtk_xml::write(&tetrahedron())),
        ("msh", gmsh::write(&tetrahedron())),
        ("vtk", binary_vtk()),
        ("ply", binary_ply(true)),
        ("vtu", vtu(true, false)),
        ("vtu", vtu(false, true)),
    ];
    samples.push((
        "msh",
        b"$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 3 1 3\n2 1 0 3\n1\n2\n3\n0 0 0\n1 0 0\n1 1 0\n$EndNodes\n\
          $Elements\n1 1 1 1\n2 1 2 1\n2 1 2 3\n$EndElements\n"
            .to_vec(),
    ));
    let mut random = ChaCha8Rng::seed_from_u64(11);
    for (extension, sample) in samples {
        let (mut refused, mut kinds) = (0, std::collections::BTreeSet::new());
        for _ in 0..400 {
            let bytes = broken(&sample, &mut random);
            let read = parse(extension, &bytes).and_then(|surface| {
                let made = Mesh::new(surface.vertices, &surface.triangles);
                made.map_err(|e| e.to_string())
            });
            if let Err(message) = read {
                assert!(message.len() < 200, "{message}");
                refused += 1;
                kinds.insert(message);
            }
        }
        println!(
            "{extension}: {refused} of 400 refused, {} messages",
            kinds.len()
        );
        assert!(
            refused > 60 && kinds.len() > 5,
            "{extension}: {refused} {}",
            kinds.len()
        );
    }
}

#[test]
fn what_is_wrong_is_said_with_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let says = |file: &str, text: &str, words: &str| {
        let path = folder.path().join(file);
        std::fs::write(&path, text).unwrap();
        let message = read_mesh(&path, 1.0).unwrap_err().to_string();
        assert!(
            message.contains(file) && message.contains(words),
            "{message}"
        );
    };
    says("a.txt", "", "must end in stl, obj, ply");
    says(
        "a.vtk",
        "# vtk DataFile Version 3.0\nx\nASCII\nDATASET POLYDATA\nPOINTS 9 double\n0 1",
        "the file ends",
    );
    says("a.msh", "$MeshFormat\n4.1 1 8\n", "gmsh -bin 0");
    says("a.obj", "v 0 0 0\nv 1 0 0\nv nan 1 0\nf 1 2 3\n", "finite");
    says("b.obj", "v 0 0 0\n", "at least one triangle");
    says(
        "a.vtu",
        "<VTKFile type=\"ImageData\"/>",
        "UnstructuredGrid or PolyData",
    );
    let missing = read_mesh(&folder.path().join("none.stl"), 1.0).unwrap_err();
    assert!(missing.to_string().contains("cannot read"));
    let mut surface = tetrahedron();
    surface.triangles[2] = [0, 1, 9];
    let error = write_surface(&folder.path().join("a.stl"), &surface).unwrap_err();
    assert!(error.to_string().contains("triangle 2"), "{error}");
}
