//! What several tests begin from, made once for all of them by the first that asks: packings by name, and runs of grains
//! alone that others are set beside.

use crate::command::{BED, INTERVAL, SMALL_COMET_CLIFF, SMALL_JOINED_COLUMN, succeed};
use std::path::Path;
use std::sync::OnceLock;

/// Files that a run leaves.
#[derive(Debug)]
pub struct Kept {
    scene: &'static str,
    sets: &'static [&'static [&'static str]],
    out: &'static str,
    files: &'static [&'static str],
    packing: Option<&'static Kept>,
    made: OnceLock<Vec<Vec<u8>>>,
}

impl Kept {
    /// The packing that a run keeps in a file; settings should end it soon.
    const fn packing(
        scene: &'static str,
        file: &'static [&'static str; 1],
        sets: &'static [&'static [&'static str]],
    ) -> Kept {
        Kept {
            scene,
            sets,
            out: "made",
            files: file,
            packing: None,
            made: OnceLock::new(),
        }
    }

    /// Puts the files into a folder, where a run there would have left them.
    pub fn put(&self, folder: &Path) {
        let contents = self.made.get_or_init(|| self.make());
        for (file, bytes) in self.files.iter().zip(contents) {
            let path = folder.join(file);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, bytes).unwrap();
        }
    }

    fn make(&self) -> Vec<Vec<u8>> {
        let folder = tempfile::tempdir().unwrap();
        if let Some(packing) = self.packing {
            packing.put(folder.path());
        }
        let mut arguments = vec!["run", self.scene, "--out", self.out];
        for set in self.sets.iter().copied().flatten() {
            arguments.extend(["--set", set]);
        }
        succeed(folder.path(), &arguments);
        let read = |file: &&str| std::fs::read(folder.path().join(file)).unwrap();
        self.files.iter().map(read).collect()
    }
}

/// Of [`SMALL_COMET_CLIFF`].
pub static COMET_CLIFF: Kept = Kept::packing(
    "cliff",
    &["packings/small.h5"],
    &[
        SMALL_COMET_CLIFF,
        &[
            "standing=1",
            "duration=1",
            "output.frames=0",
            "output.pictures=0",
        ],
    ],
);

/// What the same cliff does as grains.
pub static CLIFF_OF_GRAINS: Kept = Kept {
    scene: "cliff",
    sets: &[SMALL_COMET_CLIFF, &["output.frames=0"]],
    out: "c",
    files: &["c/summary.json"],
    packing: Some(&COMET_CLIFF),
    made: OnceLock::new(),
};

/// Of [`SMALL_JOINED_COLUMN`].
pub static JOINED_COLUMN: Kept = Kept::packing(
    "column-collapse",
    &["packings/small.h5"],
    &[
        SMALL_JOINED_COLUMN,
        &["model=dem", "duration_scaled=0.01", "output.frames=0"],
    ],
);

/// Of [`INTERVAL`] and [`CORE`](crate::command::CORE).
pub static WIDE_COLUMN: Kept = Kept::packing(
    "column-collapse",
    &["packings/wide.h5"],
    &[
        SMALL_JOINED_COLUMN,
        INTERVAL,
        &["model=dem", "duration_scaled=0.01", "output.frames=0"],
    ],
);

/// Of [`BED`].
pub static SETTLED_BED: Kept = Kept::packing(
    "ball-impact",
    &["packings/bed.h5"],
    &[BED, &["duration=1e-6", "output.frames=0"]],
);

/// A ball that falls into it as grains alone.
pub static BED_OF_GRAINS: Kept = Kept {
    scene: "ball-impact",
    sets: &[BED],
    out: "grains",
    files: &["grains/summary.json", "grains/ball.csv"],
    packing: Some(&SETTLED_BED),
    made: OnceLock::new(),
};
