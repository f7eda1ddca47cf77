//! The time step of grains, and what limits it.

use colluvium_dem::{ContactLaw, timestep};

/// Share of the stability limit of one spring that a step may take: grains in a packing have
/// several contacts at once, and the dashpots lower the limit further.
const SHARE_OF_STABILITY: f64 = 0.3;

/// A time step and its reason.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// The step (s).
    pub seconds: f64,
    /// What limits it, `contact` or `stability`, in words.
    pub limit: String,
}

/// The smaller of contact time over steps per contact, and a share of the stability limit of the
/// smallest grain at an overlap (m; a linear spring does not care): a large β makes rolling springs faster than the contact.
pub fn choose(
    contact_time: f64,
    steps_per_contact: f64,
    law: &ContactLaw,
    smallest_mass: f64,
    smallest_radius: f64,
    overlap: f64,
) -> Step {
    let contact = contact_time / steps_per_contact;
    let stability = SHARE_OF_STABILITY
        * timestep::stability_limit(law, smallest_mass, smallest_radius, overlap);
    if contact <= stability {
        Step {
            seconds: contact,
            limit: format!("contact: undamped contact time over {steps_per_contact}"),
        }
    } else {
        Step {
            seconds: stability,
            limit: format!(
                "stability: {SHARE_OF_STABILITY} of the stability limit of the smallest grain's fastest spring; the contact time over {steps_per_contact} would be {contact:.3e} s"
            ),
        }
    }
}
