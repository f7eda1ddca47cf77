//! The limits of the time step against steps that do blow up.

use colluvium_tests::blow_up::{Packings, bisect, trials};

#[test]
fn one_contact_blows_up_where_the_estimate_says() {
    for trial in trials(false).into_iter().chain(trials(true)) {
        let (estimate, name) = trial.wall_estimate();
        let blows_up = |step: f64| trial.wall_blows_up(step);
        let measured = bisect(0.5 * estimate, 2.0 * estimate, blows_up)
            .unwrap()
            .unwrap_or_else(|| panic!("{}: no limit near {estimate:e} s", trial.name));
        // The lever arm is 1 % short of the radius; growth slower than 10⁴ in 2000 steps is not seen.
        let ratio = measured / estimate;
        assert!(
            (0.98..1.06).contains(&ratio),
            "{}: {ratio} of the {name}'s",
            trial.name
        );
        assert!(blows_up(1.5 * measured).unwrap(), "{}", trial.name);
    }
}

#[test]
fn half_the_chosen_step_is_stable_in_a_dense_packing() {
    let mut packings = Packings::default();
    for trial in trials(false).into_iter().chain(trials(true)) {
        let packing = packings.of(&trial).unwrap();
        let (chosen, binding) = trial.chosen(&packing).unwrap();
        assert!(
            !trial.packing_blows_up(&packing, 0.5 * chosen).unwrap(),
            "{}: {chosen:e} s, bound by {binding}",
            trial.name
        );
        // One contact's limit is too long for many.
        let pair = trial.pair_estimate(&packing);
        assert!(
            trial.packing_blows_up(&packing, 1.5 * pair).unwrap(),
            "{}: {pair:e} s for one contact",
            trial.name
        );
    }
}
