//! ESRI ASCII grids: a header of keys, then heights row by row from the north.

use super::from_the_north;
use colluvium_continuum::terrain::HeightRaster;
use std::collections::BTreeMap;

/// Keys of the header; either name of a pair serves.
const KEYS: &str =
    "ncols, nrows, xllcorner or xllcenter, yllcorner or yllcenter, cellsize (or dx and dy)";

pub(super) fn parse(bytes: &[u8]) -> Result<HeightRaster, String> {
    let text = std::str::from_utf8(bytes).map_err(|_| "not text".to_owned())?;
    let mut words = text.split_whitespace().peekable();
    let mut header: BTreeMap<String, f64> = BTreeMap::new();
    while let Some(key) = words.next_if(|word| word.starts_with(|c: char| c.is_ascii_alphabetic()))
    {
        if key.eq_ignore_ascii_case("nan") {
            return Err("a height that is no number".into());
        }
        let value = words.next().and_then(|word| word.parse().ok());
        let value = value.ok_or_else(|| format!("key `{key}` has no number"))?;
        header.insert(key.to_ascii_lowercase(), value);
    }
    let get = |key: &str| {
        let found = header.get(key).copied();
        found.ok_or_else(|| format!("key `{key}` is missing; an ESRI grid starts with {KEYS}"))
    };
    let count = |key: &str| {
        let value = get(key)?;
        if value >= 2.0 && value.fract() == 0.0 && value < 1e9 {
            Ok(value as usize)
        } else {
            Err(format!(
                "`{key}` = {value} is not allowed; allowed: whole numbers from 2"
            ))
        }
    };
    let points = [count("ncols")?, count("nrows")?];
    let spacing = match header.get("cellsize") {
        Some(size) => [*size; 2],
        None => [get("dx")?, get("dy")?],
    };
    if let Some(bad) = spacing.iter().find(|s| !(**s > 0.0 && s.is_finite())) {
        return Err(format!(
            "`cellsize` = {bad} is not allowed; allowed: greater than 0 m"
        ));
    }
    // A corner lies half a cell outside the first point.
    let origin = |axis: usize, letter: &str| match header.get(&format!("{letter}llcenter")) {
        Some(centre) => Ok(*centre),
        None => get(&format!("{letter}llcorner")).map(|corner| corner + 0.5 * spacing[axis]),
    };
    let origin = [origin(0, "x")?, origin(1, "y")?];
    let mut heights = Vec::new();
    for word in words {
        let height: f64 = word
            .parse()
            .map_err(|_| format!("`{word}` is no height (number {})", heights.len() + 1))?;
        heights.push(height);
    }
    let expected = points[0].checked_mul(points[1]);
    if Some(heights.len()) != expected {
        return Err(format!(
            "{} heights, but ncols x nrows = {} x {}",
            heights.len(),
            points[0],
            points[1]
        ));
    }
    let no_data = header.get("nodata_value").copied();
    from_the_north(origin, spacing, points, &heights, no_data)
}
