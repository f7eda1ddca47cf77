//! Heights of terrain in files, read by extension.
//!
//! | extension | format |
//! |---|---|
//! | `asc` | ESRI ASCII grid |
//! | `tif`, `tiff` | GeoTIFF (`tiff`): one band of numbers, uncompressed, deflate or LZW, with pixel scale and tie point |
//!
//! Heights and positions are metres; files in degrees are refused, and so are rasters with holes. Files
//! start in the north; a [`HeightRaster`] starts at its smallest y.

mod esri;
mod geotiff;

use colluvium_continuum::terrain::HeightRaster;
use std::path::Path;

/// What is wrong with a file of heights.
#[derive(Debug, thiserror::Error)]
pub enum HeightFileError {
    /// It cannot be read.
    #[error("{file}: cannot read this file of heights: {source}")]
    Unreadable {
        /// The file.
        file: String,
        /// Why.
        source: std::io::Error,
    },
    /// Its name says nothing that is known.
    #[error("{file}: the name of a file of heights must end in asc, tif or tiff")]
    Extension {
        /// The file.
        file: String,
    },
    /// It is not what its name says.
    #[error("{file}: {reason}")]
    Malformed {
        /// The file.
        file: String,
        /// What is wrong.
        reason: String,
    },
}

/// Reads heights.
///
/// # Errors
/// A file that cannot be read, whose extension is unknown, or whose content is not a raster of heights
/// without holes.
pub fn read(path: &Path) -> Result<HeightRaster, HeightFileError> {
    let file = path.display().to_string();
    let extension = path.extension().and_then(|e| e.to_str());
    let parse = match extension.unwrap_or_default().to_ascii_lowercase().as_str() {
        "asc" => esri::parse,
        "tif" | "tiff" => geotiff::parse,
        _ => return Err(HeightFileError::Extension { file }),
    };
    let bytes = std::fs::read(path).map_err(|source| HeightFileError::Unreadable {
        file: file.clone(),
        source,
    })?;
    let malformed = |reason| HeightFileError::Malformed {
        file: file.clone(),
        reason,
    };
    let raster = parse(&bytes).map_err(malformed)?;
    raster
        .validate()
        .map_err(|error| malformed(error.to_string()))?;
    Ok(raster)
}

/// A raster from rows that start in the north.
///
/// `no_data` is the number that stands for a hole.
fn from_the_north(
    origin: [f64; 2],
    spacing: [f64; 2],
    [columns, rows]: [usize; 2],
    heights: &[f64],
    no_data: Option<f64>,
) -> Result<HeightRaster, String> {
    let is_hole = |height: f64| !height.is_finite() || no_data == Some(height);
    if let Some(hole) = heights.iter().position(|h| is_hole(*h)) {
        return Err(format!(
            "no height in row {}, column {} (counted from 1, from the north): terrain must have no holes",
            hole / columns + 1,
            hole % columns + 1
        ));
    }
    let mut sorted = Vec::with_capacity(heights.len());
    for row in heights.chunks_exact(columns).rev() {
        sorted.extend_from_slice(row);
    }
    Ok(HeightRaster {
        origin,
        spacing,
        points: [columns, rows],
        heights: sorted,
    })
}

#[cfg(test)]
mod tests;
