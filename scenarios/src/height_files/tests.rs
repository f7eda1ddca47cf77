use super::*;
use tiff::encoder::{TiffEncoder, colortype};
use tiff::tags::Tag;

fn esri(text: &str) -> Result<HeightRaster, String> {
    esri::parse(text.as_bytes())
}

const GRID: &str = "ncols 3\nnrows 2\nxllcorner 100.0\nyllcorner 200.0\ncellsize 2.0\n\
                    NODATA_value -9999\n1 2 3\n4 5 6.5\n";

/// Points lie half a cell inside the corner, and the first row of the file is the northern one.
fn expected() -> HeightRaster {
    HeightRaster {
        origin: [101.0, 201.0],
        spacing: [2.0, 2.0],
        points: [3, 2],
        heights: vec![4.0, 5.0, 6.5, 1.0, 2.0, 3.0],
    }
}

#[test]
fn esri_grid_is_read_from_the_south() {
    assert_eq!(esri(GRID).unwrap(), expected());
    let centred = GRID
        .replace("corner 100.0", "center 101")
        .replace("corner 200.0", "center 201");
    assert_eq!(esri(&centred).unwrap(), expected());
}

#[test]
fn broken_esri_grids_are_refused_with_the_reason() {
    for (from, to, words) in [
        ("6.5", "-9999", ["row 2, column 3", "holes"]),
        ("6.5", "", ["5 heights", "3 x 2"]),
        ("ncols 3\n", "", ["ncols", "missing"]),
        ("ncols 3", "ncols 1", ["ncols", "from 2"]),
        (
            "cellsize 2.0",
            "cellsize -2",
            ["cellsize", "greater than 0"],
        ),
        ("4 5", "4 five", ["`five`", "number 5"]),
        ("ncols 3", "ncols 3e8", ["6 heights", "300000000"]),
    ] {
        let reason = esri(&GRID.replace(from, to)).unwrap_err();
        assert!(words.iter().all(|word| reason.contains(word)), "{reason}");
    }
}

/// A GeoTIFF of the same raster, in single precision.
fn geotiff(keys: &[u16], with_place: bool) -> Vec<u8> {
    let mut file = std::io::Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut file).unwrap();
    let mut image = encoder.new_image::<colortype::Gray32Float>(3, 2).unwrap();
    let tags = image.encoder();
    if with_place {
        tags.write_tag(Tag::ModelPixelScaleTag, &[2.0_f64, 2.0, 0.0][..])
            .unwrap();
        // The north-western corner.
        tags.write_tag(
            Tag::ModelTiepointTag,
            &[0.0_f64, 0.0, 0.0, 100.0, 204.0, 0.0][..],
        )
        .unwrap();
    }
    tags.write_tag(Tag::GeoKeyDirectoryTag, keys).unwrap();
    tags.write_tag(Tag::GdalNodata, "-9999").unwrap();
    image.write_data(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.5]).unwrap();
    file.into_inner()
}

#[test]
fn geotiff_holds_the_same_raster() {
    let area = [1, 1, 0, 2, 1024, 0, 1, 1, 1025, 0, 1, 1];
    assert_eq!(geotiff::parse(&geotiff(&area, true)).unwrap(), expected());
    // Numbers at points: no half pixel.
    let point = [1, 1, 0, 1, 1025, 0, 1, 2];
    let raster = geotiff::parse(&geotiff(&point, true)).unwrap();
    assert_eq!(raster.origin, [100.0, 202.0]);
}

#[test]
fn geotiffs_without_place_or_in_degrees_are_refused() {
    let degrees = [1, 1, 0, 1, 1024, 0, 1, 2];
    let reason = geotiff::parse(&geotiff(&degrees, true)).unwrap_err();
    assert!(reason.contains("degrees"), "{reason}");
    let reason = geotiff::parse(&geotiff(&[1, 1, 0, 0], false)).unwrap_err();
    assert!(reason.contains("ModelPixelScale"), "{reason}");
    assert!(geotiff::parse(b"II*\0 not a tiff").is_err());
}

#[test]
fn files_are_read_by_their_extension() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("hill.asc");
    std::fs::write(&path, GRID).unwrap();
    assert_eq!(read(&path).unwrap(), expected());
    let unknown = read(&folder.path().join("hill.dem"))
        .unwrap_err()
        .to_string();
    assert!(
        unknown.contains("hill.dem") && unknown.contains("asc, tif"),
        "{unknown}"
    );
    let missing = read(&folder.path().join("no.tif")).unwrap_err().to_string();
    assert!(missing.contains("no.tif"), "{missing}");
}
