//! Frames written and read back.

use super::*;

fn frame(time: f64, points: usize, cells: Cells) -> Frame {
    let count = points / cells.points_each();
    let scalars = (0..count).map(|k| time + k as f64).collect();
    Frame {
        time,
        cells,
        points: (0..points).map(|k| [k as f64, time, -1.0]).collect(),
        fields: vec![
            Field {
                name: "id".into(),
                unit: "1".into(),
                values: Values::Counts((0..count as i64).collect()),
            },
            Field {
                name: "orientation".into(),
                unit: "1".into(),
                values: Values::Quaternions(vec![[0.5, time, 0.5, -0.5]; count]),
            },
            Field {
                name: "radius".into(),
                unit: "m".into(),
                values: Values::Scalars(scalars),
            },
            Field {
                name: "velocity".into(),
                unit: "m/s".into(),
                values: Values::Vectors(vec![[time, 2.0, 3.0]; count]),
            },
        ],
    }
}

#[test]
fn a_frame_reads_back() {
    let folder = tempfile::tempdir().unwrap();
    for (cells, points) in [
        (Cells::Points, 8),
        (Cells::Lines, 8),
        (Cells::Lines, 0),
        (Cells::Triangles, 9),
        (Cells::Quadrilaterals, 8),
        (Cells::Quadrilaterals, 0),
        (Cells::Hexahedra, 16),
        (Cells::Hexahedra, 0),
    ] {
        let path = folder.path().join("frame.vtkhdf");
        write(&path, [Ok(frame(0.5, points, cells))]).unwrap();
        assert_eq!(read_frame(&path).unwrap(), frame(0.5, points, cells));
    }
}

#[test]
fn a_failing_frame_leaves_the_file_before() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("grains.vtkhdf");
    write(&path, [Ok(frame(0.5, 8, Cells::Points))]).unwrap();
    let lost = Err(Failure::Run("lost".into()));
    let error = write(&path, [Ok(frame(1.0, 4, Cells::Points)), lost]).unwrap_err();
    assert!(error.to_string().contains("lost"), "{error}");
    assert_eq!(read_frame(&path).unwrap().time, 0.5);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn a_series_is_not_a_frame_and_neither_is_rubbish() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("grains.vtkhdf");
    let both = [0.0, 1.0].map(|t| Ok(frame(t, 6, Cells::Points)));
    write(&path, both).unwrap();
    assert!(
        read_frame(&path)
            .unwrap_err()
            .to_string()
            .contains("2 steps")
    );
    std::fs::write(&path, "rubbish").unwrap();
    assert!(read_frame(&path).is_err());
}

/// A series whose first instant holds no cells is one of those that follow.
#[test]
fn a_series_may_begin_with_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("continuum.vtkhdf");
    let frames = [(0.0, 0), (1.0, 8)].map(|(t, n)| frame(t, n, Cells::Quadrilaterals));
    write(&path, frames.clone().map(Ok)).unwrap();
    assert_eq!(read_series(&path).unwrap(), frames);
}
