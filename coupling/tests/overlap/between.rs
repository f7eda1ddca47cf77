//! A continuum between grains: both of its ends do what one edge does, each on its own axis.

use super::interval::{END, LENGTH, below, calm, collapse, go_on, joined, mirror, rests, settled};
use super::material::TRAVEL;
use colluvium_coupling::overlap::material_edge::{GrainZone, MaterialEdgeSpec, Side, Travel};
use colluvium_dem::Simulation;

/// The continuum lies between these.
const ENDS: [f64; 2] = [12.0, 22.0];

/// Grains up to one place and from another on.
fn core(uncoupled: bool, [from, to]: [f64; 2], travel: Option<Travel>) -> [MaterialEdgeSpec; 2] {
    let high = below(uncoupled, to, travel);
    let [_, overlap] = high.zones();
    let low = MaterialEdgeSpec {
        side: Side::Above,
        place: -from,
        wall: -END,
        back: -(to + overlap),
        ..high
    };
    let high = MaterialEdgeSpec {
        back: from - overlap,
        ..high
    };
    [low, high]
}

/// A level bed rests with continuum in its middle as with grains there, and its books close. With nothing exchanged grains of both
/// sides fall into it.
#[test]
fn a_continuum_in_the_middle_of_a_level_bed_stays_at_rest() {
    rests(&core(false, ENDS, None), &core(true, ENDS, None), 0.03);
}

/// All of the bed's mass is there once, whatever of it is grains: both copies are counted as grains alone.
#[test]
fn a_continuum_with_two_copies_is_counted_once() {
    let (_, _, _, rests) = calm(&core(false, ENDS, None));
    let zone = &rests.zone;
    let error = zone.mass_error(&rests.simulation);
    let solid: f64 = zone.parcels().iter().map(|[_, volume]| volume).sum();
    let copies = zone.continuum_mass() / (solid * rests.edge().spec().case.rheology.grain_density);
    println!("mass {error:.1e}, copies {copies:.3}");
    assert!(error.abs() < 0.02, "{error}");
    // 22 diameters of continuum, of which both handshake surfaces leave 16.
    assert!((copies / (22.0 / 16.0) - 1.0).abs() < 0.05, "{copies}");
    assert!(zone.parcels().iter().all(|[x, _]| (8.5..25.5).contains(x)));
    for (x, grains) in [(4.0, true), (17.0, false), (30.0, true)] {
        assert_eq!(zone.grains_height(x) > 0.0, grains, "{x}");
    }
}

/// A scene and its mirror image, whose grid begins at the other end as well.
#[test]
fn a_mirrored_continuum_bears_mirrored_loads() {
    let [from, to] = [11.0, 22.0];
    let mut own = core(false, [from, to], None);
    let mut image = core(false, [LENGTH - to, LENGTH - from], None);
    image[0].wall = -LENGTH;
    image[1].wall = LENGTH - END;
    // Newton's iterations end where the stress law is met to its tolerance, and round-off says after which: at that of a flow with a surface
    // loads are 2.5e-8 of the largest apart, at this 5e-12; surfaces 1e-15. Tighter linear systems change nothing.
    for spec in own.iter_mut().chain(&mut image) {
        spec.options.solver.stress_tolerance = 1e-8;
    }
    mirror(&own, &image, 1e-10);
}

/// A column that loses its gate through the grains in front of the continuum: both edges hand over strips, and every book closes.
#[test]
fn a_continuum_between_grains_keeps_its_books_while_a_column_collapses() {
    collapse(&core(false, [12.0, 24.0], Some(TRAVEL)));
}

#[test]
fn a_continuum_between_grains_goes_on_from_its_numbers() {
    go_on(&core(false, [12.0, 24.0], Some(TRAVEL)));
}

/// What leaves no continuum between two edges, or does not agree on where it ends, is refused by name.
#[test]
fn edges_that_enclose_no_continuum_are_refused() {
    let narrow = core(false, [12.0, 14.0], None);
    let mut odd = core(false, ENDS, None);
    odd[1].back -= 1.0;
    let mut simulation = joined(settled().to_vec(), true, &core(false, ENDS, None)).simulation;
    let mut refused = |specs: &[MaterialEdgeSpec]| {
        let simulation: &mut Simulation = &mut simulation;
        GrainZone::cut(specs, None, simulation)
            .err()
            .unwrap()
            .to_string()
    };
    assert!(refused(&narrow).contains("three cells between"));
    assert!(refused(&odd).contains("other end of the continuum"));
}
