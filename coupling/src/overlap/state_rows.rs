//! The state of a continuum in a plane or in space as rows of numbers.

use colluvium_continuum::free_surface::SurfaceState;

/// Puts it row by row.
pub(super) fn write<const D: usize, const C: usize>(
    state: &SurfaceState<D, C>,
    put: &mut impl FnMut(&[f64]),
) {
    put(&state.fractions);
    for velocity in &state.velocity {
        put(velocity);
    }
    put(&state.pressure);
    put(state.stress.as_flattened());
    put(&[
        state.time,
        state.velocity_time,
        state.next_step,
        state.steps as f64,
    ]);
}

/// Takes it back; nothing if a row is missing.
pub(super) fn read<'a, const D: usize, const C: usize>(
    take: &mut impl FnMut() -> Option<&'a [f64]>,
) -> Option<SurfaceState<D, C>> {
    let mut state = SurfaceState {
        fractions: take()?.to_vec(),
        ..SurfaceState::default()
    };
    for velocity in &mut state.velocity {
        *velocity = take()?.to_vec();
    }
    state.pressure = take()?.to_vec();
    state.stress = take()?.as_chunks::<C>().0.to_vec();
    let &[time, velocity_time, next_step, steps] = take()? else {
        return None;
    };
    (state.time, state.velocity_time) = (time, velocity_time);
    (state.next_step, state.steps) = (next_step, steps as usize);
    Some(state)
}
