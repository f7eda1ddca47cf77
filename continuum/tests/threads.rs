//! Flows have the same bits on 1, 2 and 3 threads, and where more than one is there they are used.

use colluvium_continuum::column_collapse::{Collapse, CollapseCase, CollapseGround};
use colluvium_continuum::cylinder_collapse::{CylinderCase, CylinderCollapse};
use colluvium_continuum::free_surface::{Contact, SurfaceOptions};
use colluvium_continuum::rheology::MuI;
use colluvium_continuum::terrain::Profile;
use colluvium_continuum::threads::tasks_taken;
use rayon::ThreadPoolBuilder;

/// What some work gives on so many threads, and how many tasks were taken from the one that began.
fn on<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> (T, u64) {
    let pool = ThreadPoolBuilder::new().num_threads(threads).build();
    let pool = pool.unwrap();
    let found = pool.install(work);
    (found, pool.broadcast(|_| tasks_taken()).iter().sum())
}

/// The same bits from 1, 2 and 3 threads, which are used where there is more than one.
fn same_on_all(flow: impl Fn() -> String + Sync) {
    let (one, none) = on(1, &flow);
    assert_eq!(none, 0, "one thread has nobody to share with");
    for threads in [2, 3] {
        let (found, taken) = on(threads, &flow);
        assert!(taken > 10, "{threads} threads: {taken} tasks shared");
        assert!(found == one, "{threads} threads: other bits");
    }
}

/// All numbers of a state, as text from which each is read back to the bit.
fn bits(state: &impl std::fmt::Debug) -> String {
    format!("{state:?}")
}

fn column(cells: usize) -> CollapseCase {
    CollapseCase {
        aspect: 1.42,
        height: 1.0,
        gravity: 1.0,
        rheology: MuI::new(0.32, 0.60, 0.4, 1.0 / 65.0, 1.0, 1.0),
        cells,
        length_scaled: 5.0,
        overhang_degrees: 0.0,
    }
}

fn go_on(collapse: &mut Collapse, steps: usize) {
    for _ in 0..steps {
        collapse.step(10.0).unwrap();
    }
}

#[test]
fn a_column_has_the_same_bits_on_any_number_of_threads() {
    same_on_all(|| {
        let mut collapse = Collapse::new(&column(220), &SurfaceOptions::default()).unwrap();
        go_on(&mut collapse, 8);
        bits(collapse.flow().state())
    });
}

#[test]
fn a_column_over_cut_ground_has_the_same_bits_on_any_number_of_threads() {
    same_on_all(|| {
        let ground = CollapseGround {
            profile: Profile::new(vec![[0.0, 0.0], [1.0, 0.07], [5.0, -0.6]]).unwrap(),
            contact: Contact::NoSlip,
        };
        let options = SurfaceOptions::default();
        let mut collapse = Collapse::over_ground(&column(220), &options, &ground, None).unwrap();
        go_on(&mut collapse, 8);
        bits(collapse.flow().state())
    });
}

#[test]
fn a_cylinder_has_the_same_bits_on_any_number_of_threads() {
    same_on_all(|| {
        let case = CylinderCase {
            aspect: 1.0,
            height: 1.0,
            gravity: 1.0,
            rheology: MuI::new(0.382, 0.643, 0.279, 0.02, 1.0, 1.0),
            cells: 28,
            length_scaled: 2.9,
            whole: false,
            floor: Contact::NoSlip,
        };
        let mut collapse = CylinderCollapse::new(&case, &SurfaceOptions::default()).unwrap();
        for _ in 0..3 {
            collapse.step(10.0).unwrap();
        }
        bits(collapse.flow().state())
    });
}

/// Half on two threads and half, begun anew from the state, on three: as on one in one go.
#[test]
fn a_column_that_is_begun_anew_on_other_threads_has_the_same_bits() {
    let begun = || Collapse::new(&column(200), &SurfaceOptions::default()).unwrap();
    let (whole, _) = on(1, || {
        let mut collapse = begun();
        go_on(&mut collapse, 10);
        bits(collapse.flow().state())
    });
    let (state, taken) = on(2, || {
        let mut collapse = begun();
        go_on(&mut collapse, 5);
        collapse.flow().state().clone()
    });
    assert!(taken > 10, "{taken} tasks shared");
    let (anew, _) = on(3, || {
        let mut collapse = begun();
        collapse.set_state(state).unwrap();
        go_on(&mut collapse, 5);
        bits(collapse.flow().state())
    });
    assert!(anew == whole);
}

/// A caller outside a pool has one thread, and small systems are not worth two.
#[test]
fn nobody_shares_without_a_pool_or_what_is_small() {
    let few = || {
        let mut collapse = Collapse::new(&column(40), &SurfaceOptions::default()).unwrap();
        go_on(&mut collapse, 3);
        bits(collapse.flow().state())
    };
    let (small, taken) = on(2, few);
    assert_eq!(taken, 0);
    assert!(small == few());
}
