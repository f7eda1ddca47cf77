//! PLY, through `ply-rs-bw`: elements `vertex` (x, y, z) and `face` (a list of vertices).

use super::{Surface, triangle_lines, vertex_lines};
use ply_rs_bw::parser::Parser;
use ply_rs_bw::ply::{DefaultElement, ElementDef, Property};

/// A scalar of any kind.
fn scalar(element: &DefaultElement, name: &str) -> Option<f64> {
    Some(match *element.get(name)? {
        Property::Char(x) => f64::from(x),
        Property::UChar(x) => f64::from(x),
        Property::Short(x) => f64::from(x),
        Property::UShort(x) => f64::from(x),
        Property::Int(x) => f64::from(x),
        Property::UInt(x) => f64::from(x),
        Property::Float(x) => f64::from(x),
        Property::Double(x) => x,
        _ => return None,
    })
}

/// A list of whole numbers of any kind.
fn list(property: &Property) -> Option<Vec<u32>> {
    fn whole<T: Copy + TryInto<u32>>(list: &[T]) -> Option<Vec<u32>> {
        list.iter().map(|&x| x.try_into().ok()).collect()
    }
    match property {
        Property::ListChar(list) => whole(list),
        Property::ListUChar(list) => whole(list),
        Property::ListShort(list) => whole(list),
        Property::ListUShort(list) => whole(list),
        Property::ListInt(list) => whole(list),
        Property::ListUInt(list) => whole(list),
        _ => None,
    }
}

/// The first line of what the parser says; others show the text it read.
fn refused(error: impl ToString) -> String {
    let message = error.to_string();
    format!("PLY: {}", message.lines().next().unwrap_or_default())
}

pub(super) fn read(bytes: &[u8]) -> Result<Surface, String> {
    let parser = Parser::<DefaultElement>::new();
    let header = parser.read_ply_header(&mut &*bytes).map_err(refused)?;
    // Elements without properties take no bytes: any number of them would fit.
    let too_many = |(_, element): &(_, &ElementDef)| element.count > bytes.len();
    if let Some((name, element)) = header.elements.iter().find(too_many) {
        let count = element.count;
        return Err(format!(
            "PLY: {count} of element `{name}` do not fit into the file"
        ));
    }
    let ply = parser.read_ply(&mut &*bytes).map_err(refused)?;
    let mut surface = Surface::default();
    let vertices = ply
        .payload
        .get("vertex")
        .ok_or("PLY: no element `vertex`")?;
    for (k, vertex) in vertices.iter().enumerate() {
        let xyz = ["x", "y", "z"].map(|name| scalar(vertex, name));
        let [Some(x), Some(y), Some(z)] = xyz else {
            return Err(format!("PLY: vertex {k} lacks one of x, y, z"));
        };
        surface.add_vertex([x, y, z]);
    }
    let faces = ply.payload.get("face").ok_or("PLY: no element `face`")?;
    for (k, face) in faces.iter().enumerate() {
        let corners = face
            .get("vertex_indices")
            .or_else(|| face.get("vertex_index"))
            .and_then(list)
            .ok_or_else(|| format!("PLY: face {k} has no list `vertex_indices` of vertices"))?;
        surface.add_polygon(&corners);
    }
    Ok(surface)
}

pub(super) fn write(surface: &Surface) -> Vec<u8> {
    let (vertices, faces) = (surface.vertices.len(), surface.triangles.len());
    let head = format!(
        "ply\nformat ascii 1.0\nelement vertex {vertices}\nproperty double x\nproperty double y\n\
         property double z\nelement face {faces}\nproperty list uchar uint vertex_indices\nend_header\n"
    );
    let text = head + &vertex_lines(surface, "") + &triangle_lines(surface, "3 ", 0);
    text.into_bytes()
}
