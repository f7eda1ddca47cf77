//! Beds as the penetration benchmark gives them: radius, x, y and z of each grain on a line (m), under a
//! line of names; plain or gzipped.

use colluvium_dem::Grain;
use flate2::read::GzDecoder;
use nalgebra::Vector3;
use std::io::Read;

/// First two bytes of a gzip file.
const GZIP: [u8; 2] = [0x1f, 0x8b];

/// Grains at rest of such a file, of a density (kg/m³) and a material.
pub fn read(path: &str, density: f64, material: u16) -> Result<Vec<Grain>, String> {
    let bytes = std::fs::read(path).map_err(|error| format!("cannot read the file: {error}"))?;
    parse(&bytes, density, material)
}

fn parse(bytes: &[u8], density: f64, material: u16) -> Result<Vec<Grain>, String> {
    let mut text = String::new();
    let read = if bytes.starts_with(&GZIP) {
        GzDecoder::new(bytes).read_to_string(&mut text)
    } else {
        (&mut &*bytes).read_to_string(&mut text)
    };
    read.map_err(|error| format!("cannot read the file: {error}"))?;
    let wanted = "wanted: radius, x, y and z (m) on each line";
    let mut grains = Vec::new();
    for (k, line) in text.lines().enumerate() {
        let words: Vec<&str> = line
            .split(|c: char| c.is_whitespace() || c == ',')
            .filter(|w| !w.is_empty())
            .collect();
        let first = words.first().and_then(|w| w.parse::<f64>().ok());
        if words.is_empty() || (k == 0 && first.is_none()) {
            continue;
        }
        let numbers: Option<Vec<f64>> = words.iter().map(|w| w.parse().ok()).collect();
        match numbers.as_deref() {
            Some(&[radius, x, y, z])
                if radius > 0.0 && [radius, x, y, z].iter().all(|v| v.is_finite()) =>
            {
                grains.push(Grain {
                    material,
                    ..Grain::at_rest(Vector3::new(x, y, z), radius, density)
                });
            }
            _ => return Err(format!("line {}: `{line:.60}`; {wanted}", k + 1)),
        }
    }
    if grains.is_empty() {
        return Err(format!("it holds no grain; {wanted}"));
    }
    Ok(grains)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_four_numbers_are_grains() {
        let text =
            b"Radius[m]\tPosX[m] PosY[m] PosZ[m]\n 0.001 -0.03 0.008 -0.08\n0.002 1e-2 0 0\n\n";
        let grains = parse(text, 2500.0, 1).unwrap();
        assert_eq!(grains.len(), 2);
        assert_eq!(grains[0].position, Vector3::new(-0.03, 0.008, -0.08));
        assert_eq!((grains[1].radius, grains[1].material), (0.002, 1));
        for (bad, word) in [
            (&b"Radius\n"[..], "no grain"),
            (b"r x y z\n0.001 1 2\n", "line 2"),
            (b"0.001 1 2 nan\n", "line 1"),
            (b"-0.001 1 2 3\n", "line 1"),
            (b"\xff\xfe", "cannot read"),
        ] {
            let message = parse(bad, 1.0, 0).unwrap_err();
            assert!(message.contains(word), "{message}");
        }
    }
}
