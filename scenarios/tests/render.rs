//! Pictures and animations of series.

#![allow(clippy::unwrap_used)] // a test may panic

use colluvium::failure::Failure;
use colluvium::render::{FOLDER, Request, remove, render};
use colluvium::report;
use colluvium::run_directory::{ANIMATION, SUMMARY, summary_text};
use colluvium::summary::Summary;
use colluvium::vtkhdf::{self, Cells, Field, Frame, Values};

fn field(name: &str, values: Values) -> Field {
    Field {
        name: name.into(),
        unit: "1".into(),
        values,
    }
}

/// A fixed grain, one at rest, and one that moves to the right by a radius an instant.
fn grains(k: usize) -> Frame {
    Frame {
        time: k as f64,
        cells: Cells::Points,
        points: vec![[0.0, 0.0, 0.0], [0.0, 0.0, 2.0], [3.0 + k as f64, 0.0, 2.0]],
        fields: vec![
            field("radius", Values::Scalars(vec![1.0; 3])),
            field("fixed", Values::Counts(vec![1, 0, 0])),
            field("cluster", Values::Counts(vec![0, 1, 2])),
            field(
                "velocity",
                Values::Vectors(vec![[0.0; 3], [0.0; 3], [1.0, 0.0, 0.0]]),
            ),
        ],
    }
}

fn run_directory(frames: Option<Vec<Frame>>) -> tempfile::TempDir {
    let directory = tempfile::tempdir().unwrap();
    let summary = Summary::begun("grains", "run");
    let text = summary_text(&summary).unwrap();
    std::fs::write(directory.path().join(SUMMARY), text).unwrap();
    if let Some(frames) = frames {
        let path = directory.path().join("grains.vtkhdf");
        vtkhdf::write(&path, frames.into_iter().map(Ok)).unwrap();
    }
    directory
}

#[test]
fn a_series_becomes_pictures_and_an_animation() {
    let run = run_directory(Some((0..4).map(grains).collect()));
    for _ in 0..2 {
        let animation = render(run.path(), &Request::default()).unwrap();
        let mut options = gif::DecodeOptions::new();
        options.set_color_output(gif::ColorOutput::RGBA);
        let file = std::fs::File::open(animation).unwrap();
        let mut film = options.read_info(file).unwrap();
        let mut pictures = Vec::new();
        while let Some(frame) = film.read_next_frame().unwrap() {
            pictures.push((
                frame.width,
                frame.height,
                frame.buffer.to_vec(),
                frame.delay,
            ));
        }
        assert_eq!(pictures.len(), 4);
        assert_eq!((pictures[0].3, pictures[3].3), (10, 110));
        // All instants reach from x = -1 to 7 and from z = -1 to 3.
        let (width, height) = (f64::from(pictures[0].0), f64::from(pictures[0].1));
        let scale = 720.0 / (8.0 * 1.08);
        assert!((width - 720.0).abs() <= 1.0 && (height - scale * 4.64).abs() <= 1.0);
        let colour = |k: usize, x: f64, z: f64| {
            let (column, row) = (scale * (x + 1.32), scale * (3.32 - z));
            let at = 4 * (row as usize * pictures[k].0 as usize + column as usize);
            pictures[k].2[at..at + 3].to_vec()
        };
        for k in 0..4 {
            let [plain, still, fast] = [
                colour(k, 0.0, 0.0),
                colour(k, 0.0, 2.0),
                colour(k, 3.0 + k as f64, 2.0),
            ];
            let spread = |c: &[u8]| c.iter().max().unwrap() - c.iter().min().unwrap();
            assert!(spread(&plain) < 12, "{plain:?}");
            assert!(
                still[2] > still[1] && still[0] > still[1],
                "violet: {still:?}"
            );
            assert!(fast[0] > 150 && fast[2] < 100, "yellow: {fast:?}");
        }
        assert_eq!(colour(3, 3.0, 2.0), [255, 255, 255], "it has gone on");
        assert_eq!(
            std::fs::read_dir(run.path().join(FOLDER)).unwrap().count(),
            4
        );
        let summary = report::read_summary(run.path()).unwrap();
        assert_eq!(summary.figures.len(), 1);
        let page = std::fs::read_to_string(run.path().join("report.html")).unwrap();
        assert_eq!(page.matches("data:image/gif;base64,").count(), 1);
    }
    remove(run.path()).unwrap();
    assert!(!run.path().join(FOLDER).exists());
}

#[test]
fn what_cannot_be_drawn_is_told() {
    let told = |run: &tempfile::TempDir| {
        let failure = render(run.path(), &Request::default()).unwrap_err();
        assert!(matches!(failure, Failure::Input(_)), "{failure}");
        assert!(!run.path().join(ANIMATION).exists());
        failure.to_string()
    };
    let without = told(&run_directory(None));
    assert!(without.contains("grains.vtkhdf") && without.contains("output.frames"));
    let mut old = grains(0);
    old.fields.remove(0);
    let old = told(&run_directory(Some(vec![old])));
    assert!(old.contains("`radius`"), "{old}");
    let nowhere = told(&tempfile::tempdir().unwrap());
    assert!(nowhere.contains("no run directory"), "{nowhere}");
}
