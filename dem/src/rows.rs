//! Rows of all grains, moved in place while others read them.

use crate::lanes::Row;
use std::cell::Cell;

/// State of all grains in a pass: (x, R), (v, 1/m), (R ω, 1/R), and the dummy behind the last grain.
#[derive(Clone, Copy)]
pub(crate) struct Rows<'a> {
    pub place: &'a [Cell<[f64; 4]>],
    pub motion: &'a [Cell<[f64; 4]>],
    pub turn: &'a [Cell<[f64; 4]>],
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
    ) -> Self {
        Rows {
            place: Cell::from_mut(place).as_slice_of_cells(),
            motion: Cell::from_mut(motion).as_slice_of_cells(),
            turn: Cell::from_mut(turn).as_slice_of_cells(),
        }
    }
}

impl Rows<'_> {
    /// Asks for rows that will be read soon.
    #[inline(always)]
    pub fn fetch(&self, grains: std::ops::Range<usize>) {
        for rows in [self.place, self.motion, self.turn] {
            // Two rows a cache line.
            for row in rows[grains.clone()].iter().step_by(2) {
                fetch(row);
            }
        }
    }
}

/// Asks for what will be read soon.
#[inline(always)]
fn fetch(row: &Cell<[f64; 4]>) {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: every x86-64 processor has it, and it changes nothing but caches.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(row.as_ptr().cast()) };
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = row;
}

// SAFETY: whoever made them has promised that no row is written while another thread uses it.
unsafe impl Send for Rows<'_> {}
// SAFETY: see above.
unsafe impl Sync for Rows<'_> {}

impl Row for Cell<[f64; 4]> {
    #[inline(always)]
    fn read(&self) -> [f64; 4] {
        self.get()
    }
}
