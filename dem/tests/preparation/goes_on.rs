//! Preparations that are stopped at a look go on from it to the same bits.

use super::*;
use crate::clumps::packings;

/// Stops a preparation at a look, or follows one to its end.
#[derive(Default)]
struct Watcher {
    from: Option<Midway>,
    looks: usize,
    stop_at: Option<usize>,
    kept: Option<Midway>,
}

impl Watch for Watcher {
    fn look(&mut self, look: &mut Look) -> ControlFlow<()> {
        self.looks += 1;
        if self.stop_at != Some(self.looks) {
            return ControlFlow::Continue(());
        }
        self.kept = look.state.as_mut().map(LookState::midway);
        ControlFlow::Break(())
    }

    fn goes_on(&self) -> Option<&Midway> {
        self.from.as_ref()
    }
}

/// What a preparation comes to: bits of its state, and what it reports.
type Made = (String, String);

/// A preparation under a watcher, from where it goes on.
type Prepare<'a> = &'a dyn Fn(&mut Watcher) -> Result<Made, SetupError>;

/// The state at a look (1, 2, …), if there are so many.
fn stopped(prepare: Prepare, look: usize) -> Midway {
    let mut watcher = Watcher {
        stop_at: Some(look),
        ..Watcher::default()
    };
    let error = prepare(&mut watcher).unwrap_err();
    assert!(matches!(error, SetupError::Interrupted), "{error}");
    watcher.kept.unwrap()
}

fn gone_on(prepare: Prepare, from: Midway) -> Result<Made, SetupError> {
    prepare(&mut Watcher {
        from: Some(from),
        ..Watcher::default()
    })
}

/// Stops it at looks all along, the first and the last among them; gives the states.
fn goes_on_from_everywhere(prepare: Prepare, times: usize) -> Vec<Midway> {
    let mut through = Watcher::default();
    let whole = prepare(&mut through).unwrap();
    assert!(through.looks > times, "{} looks", through.looks);
    let looks = (0..=times).map(|k| 1 + k * (through.looks - 1) / times);
    let states: Vec<Midway> = looks.map(|look| stopped(prepare, look)).collect();
    for (k, state) in states.iter().enumerate() {
        let again = gone_on(prepare, state.clone()).unwrap();
        assert!(again == whole, "from state {k}: {again:?} for {whole:?}");
    }
    states
}

/// A simulation as it begins, or as it was.
fn begin(setup: Setup, watcher: &Watcher) -> Result<Simulation, SetupError> {
    match &watcher.from {
        Some(midway) => Simulation::resume(setup, &midway.record),
        None => Simulation::new(setup),
    }
}

#[test]
fn a_relaxation_goes_on() {
    let setup = || Setup {
        timestep: 1e-5,
        ..gravel_cloud()
    };
    // Damping multiplies all velocities by what goes by the unit of time: its last bit is seen.
    let mut spec = Relaxation {
        damping: 4.0,
        ..Relaxation::under(9.81)
    };
    spec.rest.kinetic = 1e-2;
    spec.rest.unbalanced = 10.0;
    let prepare = |watcher: &mut Watcher| {
        let mut simulation = begin(setup(), watcher)?;
        let rest = relax(&mut simulation, &spec, watcher)?;
        Ok((simulation.state_hash(), rest.to_string()))
    };
    let states = goes_on_from_everywhere(&prepare, 2);
    let order = |state: &Midway| state.record.counts["grains/id"].clone();
    assert_ne!(
        order(&states[0]),
        order(&states[2]),
        "lists have sorted the grains"
    );
    let mut other = states[0].clone();
    other.loops[1] = (1.01 * f64::from_bits(other.loops[1])).to_bits();
    let [other, own] = [other, states[0].clone()].map(|state| gone_on(&prepare, state).unwrap());
    assert_ne!(
        other, own,
        "the unit of time that is kept is the one that is used"
    );
    // Patience counts from the beginning.
    let hasty = Relaxation {
        patience: 2.0,
        ..spec
    };
    let prepare = |watcher: &mut Watcher| {
        let mut simulation = begin(setup(), watcher)?;
        relax(&mut simulation, &hasty, watcher)?;
        Ok((simulation.state_hash(), String::new()))
    };
    let mut through = Watcher::default();
    let error = prepare(&mut through).unwrap_err();
    let again = gone_on(&prepare, stopped(&prepare, through.looks / 2)).unwrap_err();
    assert_eq!(again.to_string(), error.to_string());
}

#[test]
fn a_pouring_goes_on_with_its_random_numbers() {
    let (spec, relaxation) = pouring(5, 120);
    let prepare = |watcher: &mut Watcher| {
        let setup = floor(6.0, 30.0, Vec::new(), rough(0.5));
        let mut simulation = begin(setup, watcher)?;
        let report = pour(&mut simulation, &spec, &relaxation, watcher)?;
        Ok((simulation.state_hash(), report.to_string()))
    };
    let whole = prepare(&mut Watcher::default()).unwrap();
    let states = goes_on_from_everywhere(&prepare, 6);
    // Random numbers from their beginning pour another bed.
    let mut again = states[0].clone();
    again.loops[3..].fill(0);
    assert_ne!(gone_on(&prepare, again).unwrap().0, whole.0);
    // Loops of no pouring are refused.
    for loops in [
        vec![1, 1],
        vec![1_000_000, 1, 0, 0, 0],
        vec![1, u64::MAX, 0, 0, 0],
    ] {
        let mut damaged = states[0].clone();
        damaged.loops = loops;
        let error = gone_on(&prepare, damaged).unwrap_err();
        assert!(matches!(error, SetupError::Record(_)), "{error}");
    }
}

#[test]
fn a_pouring_of_clumps_goes_on() {
    let (setup, spec, relaxation) = packings::pouring();
    let prepare = |watcher: &mut Watcher| {
        let mut bed = begin(setup.clone(), watcher)?;
        let report = pour_clumps(&mut bed, &spec, &relaxation, watcher)?;
        Ok((bed.state_hash(), report.to_string()))
    };
    goes_on_from_everywhere(&prepare, 2);
}

#[test]
fn stages_go_on_with_their_laws_and_reports() {
    let mut stages = Stages::at(&[9.81, 1e-1]);
    stages.largest_overlap = 0.05;
    stages.rest.kinetic = 1e-4;
    let prepare = |watcher: &mut Watcher| {
        let (mut simulation, reports) = settle_in_stages(gravel_cloud(), &[], &stages, watcher)?;
        Ok((simulation.state_hash(), format!("{reports:?}")))
    };
    let states = goes_on_from_everywhere(&prepare, 2);
    assert_eq!((states[0].loops[0], states[2].loops[0]), (0, 1));
    // The second stage under the first one's stiffness is refused.
    let mut damaged = states[2].clone();
    damaged.loops[1] = states[0].loops[1];
    let error = gone_on(&prepare, damaged).unwrap_err();
    assert!(matches!(error, SetupError::Record(_)), "{error}");
}

#[test]
fn a_compaction_goes_on() {
    let aggregate = Aggregate {
        growth: Growth::ParticleCluster,
        grains: 300,
        sizes: dust(),
        density: 2000.0,
        material: 0,
        overlap: 2e-3,
        seed: 3,
    };
    let (grown, _) = grow(&aggregate).unwrap();
    let prepare = |watcher: &mut Watcher| {
        let mut simulation = match &watcher.from {
            Some(midway) => {
                let setup = sticking_setup(grown.grains.clone(), Threads::Serial);
                Simulation::resume(setup, &midway.record)?
            }
            None => sticking(grown.grains.clone(), Threads::Serial),
        };
        let report = compact(&mut simulation, &boulder(0.32, 0.036), watcher)?;
        Ok((simulation.state_hash(), report.to_string()))
    };
    let states = goes_on_from_everywhere(&prepare, 3);
    // It was let go at the last, and pulled at the first.
    let pulled = |state: &Midway| state.loops[3] == 1;
    assert!(!pulled(&states[0]) && pulled(&states[3]));
}

#[test]
fn what_begins_again_says_so() {
    let spec = Jamming {
        grains: 64,
        ingredients: vec![Ingredient::alone(equal(0.5), UNIT)],
        quench: 0.6,
        overlap: 1e-3,
        seed: 1,
    };
    struct Asks;
    impl Watch for Asks {
        fn look(&mut self, look: &mut Look) -> ControlFlow<()> {
            assert!(look.state.is_none());
            ControlFlow::Break(())
        }
    }
    let error = jam(&spec, &mut Asks).unwrap_err();
    assert!(matches!(error, SetupError::Interrupted), "{error}");
}
