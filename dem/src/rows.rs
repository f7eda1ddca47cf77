//! Rows of all grains, moved in place while others read them.

use std::cell::Cell;

/// State of all grains in a pass: (x, R), (v, 1/m), (R ω, 1/R); behind the last grain the dummy, and then
/// copies of grains for the chunks that do not move them.
#[derive(Clone, Copy)]
pub(crate) struct Rows<'a> {
    pub place: &'a [Cell<[f64; 4]>],
    pub motion: &'a [Cell<[f64; 4]>],
    pub turn: &'a [Cell<[f64; 4]>],
    /// For each row of cells, the square of the largest speed against its drift (m²/s²).
    pub fastest: &'a [Cell<f64>],
    /// Momentum that each fixed grain has taken from free ones (N s).
    pub taken: &'a [Cell<[f64; 4]>],
}

impl<'a> Rows<'a> {
    /// The rows in these slices.
    ///
    /// # Safety
    /// As cells do, rows let the same numbers be read and written, and yet they may be sent to other
    /// threads. Whoever does that must see to it that no row is written while another thread reads or
    /// writes it.
    pub unsafe fn of(
        place: &'a mut [[f64; 4]],
        motion: &'a mut [[f64; 4]],
        turn: &'a mut [[f64; 4]],
        fastest: &'a mut [f64],
        taken: &'a mut [[f64; 4]],
    ) -> Self {
        Rows {
            place: Cell::from_mut(place).as_slice_of_cells(),
            motion: Cell::from_mut(motion).as_slice_of_cells(),
            turn: Cell::from_mut(turn).as_slice_of_cells(),
            fastest: Cell::from_mut(fastest).as_slice_of_cells(),
            taken: Cell::from_mut(taken).as_slice_of_cells(),
        }
    }
}

impl Rows<'_> {
    /// Copies the rows of grains to where others read them.
    #[inline(always)]
    pub fn copy(&self, grains: &[u32], first: usize) {
        for rows in [self.place, self.motion, self.turn] {
            for (copy, &grain) in rows[first..].iter().zip(grains) {
                copy.set(rows[grain as usize].get());
            }
        }
    }

    /// The first number of all centres and radii.
    #[inline(always)]
    pub fn place(&self) -> *const f64 {
        self.place.as_ptr().cast()
    }

    /// The first number of all velocities and inverse masses.
    #[inline(always)]
    pub fn motion(&self) -> *const f64 {
        self.motion.as_ptr().cast()
    }

    /// The first number of all turns and inverse radii.
    #[inline(always)]
    pub fn turn(&self) -> *const f64 {
        self.turn.as_ptr().cast()
    }

    /// Asks for rows that will be read soon.
    #[inline(always)]
    pub fn fetch(&self, grains: std::ops::Range<usize>) {
        for rows in [self.place, self.motion, self.turn] {
            fetch(&rows[grains.clone()]);
        }
    }
}

/// Bytes of a line of the cache.
const LINE: usize = 64;

/// Asks for what will be read soon.
#[inline(always)]
pub(crate) fn fetch<T>(values: &[T]) {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        let first = values.as_ptr().cast::<i8>();
        for line in (0..size_of_val(values)).step_by(LINE) {
            // SAFETY: every x86-64 processor has it, and it changes nothing but caches.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(first.add(line)) };
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = values;
}

// SAFETY: whoever made them has promised that no row is written while another thread uses it.
unsafe impl Send for Rows<'_> {}
// SAFETY: see above.
unsafe impl Sync for Rows<'_> {}
