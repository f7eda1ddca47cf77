//! GeoTIFF: a raster with its place on the map in tags.

use super::from_the_north;
use colluvium_continuum::terrain::HeightRaster;
use std::io::Cursor;
use tiff::ColorType;
use tiff::decoder::{Decoder, DecodingResult};
use tiff::tags::Tag;

/// Numbers of geo keys: kind of coordinates, and whether a number belongs to a point or to an area.
const MODEL_TYPE: u16 = 1024;
const RASTER_TYPE: u16 = 1025;
/// Their values: latitude and longitude; numbers at points.
const GEOGRAPHIC: u16 = 2;
const PIXEL_IS_POINT: u16 = 2;

pub(super) fn parse(bytes: &[u8]) -> Result<HeightRaster, String> {
    let broken = |error: tiff::TiffError| error.to_string();
    let mut decoder = Decoder::new(Cursor::new(bytes)).map_err(broken)?;
    let (columns, rows) = decoder.dimensions().map_err(broken)?;
    let colour = decoder.colortype().map_err(broken)?;
    if !matches!(colour, ColorType::Gray(_)) {
        return Err(format!("{colour:?}: a raster of heights has one band"));
    }
    let numbers = |decoder: &mut Decoder<_>, tag: Tag, least: usize, name: &str| {
        let found = decoder.get_tag_f64_vec(tag).ok();
        found
            .filter(|values| values.len() >= least && values.iter().all(|v| v.is_finite()))
            .ok_or_else(|| format!("no {name}: the file does not say where its heights lie"))
    };
    let scale = numbers(&mut decoder, Tag::ModelPixelScaleTag, 2, "ModelPixelScale")?;
    let tie = numbers(&mut decoder, Tag::ModelTiepointTag, 6, "ModelTiepoint")?;
    let keys = decoder
        .get_tag_u16_vec(Tag::GeoKeyDirectoryTag)
        .unwrap_or_default();
    // Four numbers a key, after four of a header: key, place, count, value.
    let key = |wanted: u16| {
        let mut entries = keys.chunks_exact(4).skip(1);
        entries
            .find(|entry| entry[0] == wanted && entry[1] == 0)
            .map(|entry| entry[3])
    };
    if key(MODEL_TYPE) == Some(GEOGRAPHIC) {
        return Err("positions in degrees; wanted: a map projection in metres".into());
    }
    let spacing = [scale[0], scale[1]];
    if let Some(bad) = spacing.iter().find(|s| !(**s > 0.0)) {
        return Err(format!(
            "pixel scale {bad} is not allowed; allowed: greater than 0 m"
        ));
    }
    // An area's number belongs to its middle, half a pixel from the corner that the tie point means.
    let half = if key(RASTER_TYPE) == Some(PIXEL_IS_POINT) {
        0.0
    } else {
        0.5
    };
    let no_data = decoder
        .get_tag_ascii_string(Tag::GdalNodata)
        .ok()
        .and_then(|text| text.trim_matches(['\0', ' ']).parse().ok());
    let heights: Vec<f64> = match decoder.read_image().map_err(broken)? {
        DecodingResult::U8(v) => v.into_iter().map(f64::from).collect(),
        DecodingResult::U16(v) => v.into_iter().map(f64::from).collect(),
        DecodingResult::U32(v) => v.into_iter().map(f64::from).collect(),
        DecodingResult::I8(v) => v.into_iter().map(f64::from).collect(),
        DecodingResult::I16(v) => v.into_iter().map(f64::from).collect(),
        DecodingResult::I32(v) => v.into_iter().map(f64::from).collect(),
        DecodingResult::F32(v) => v.into_iter().map(f64::from).collect(),
        DecodingResult::F64(v) => v,
        _ => return Err("numbers of a kind that heights do not have".into()),
    };
    let points = [columns as usize, rows as usize];
    if points.iter().any(|n| *n < 2) || points[0].checked_mul(points[1]) != Some(heights.len()) {
        return Err(format!(
            "{} heights for {columns} x {rows} points",
            heights.len()
        ));
    }
    let origin = [
        tie[3] + (half - tie[0]) * spacing[0],
        tie[4] - (f64::from(rows) - 1.0 + half - tie[1]) * spacing[1],
    ];
    from_the_north(origin, spacing, points, &heights, no_data)
}
