//! Work side by side on the threads of the caller's pool.
//!
//! Threads of a pool go to sleep when there is nothing to do, and to wake one takes longer than most of what is done side by
//! side in a step. So one of them stands by awake during an iteration on a step's equations; others have to be
//! woken.
//!
//! A caller inside a pool of rayon's (`ThreadPool::install`) gets its threads; any other has one. What is done side by
//! side is cut by what there is to do, never by the number of threads, and every sum has one order, so that the bits do
//! not depend on how many there are.

use std::cell::Cell;
use std::sync::atomic::{AtomicBool, Ordering};

/// From so many unknowns on it pays to share what takes tens of microseconds.
pub(crate) const MANY: usize = 3000;
/// Items are shared from so many times on what is done at a time.
pub(crate) const WORTH_HALVING: usize = 3;
/// Looks for something to do before others are given way to.
const PATIENCE: u32 = 64;

thread_local! {
    /// Parts of others' work that this thread has done.
    static TAKEN: Cell<u64> = const { Cell::new(0) };
}

/// How many parts of others' work the calling thread has done: over the threads of a pool (`ThreadPool::broadcast`), whether
/// a flow had more than one thread to itself.
pub fn tasks_taken() -> u64 {
    TAKEN.get()
}

/// Does both, side by side where `pays` and there is a thread for it.
#[inline]
pub(crate) fn join<A: Send, B: Send>(
    pays: bool,
    a: impl FnOnce() -> A + Send,
    b: impl FnOnce() -> B + Send,
) -> (A, B) {
    if pays && are_many() {
        let giver = rayon::current_thread_index();
        let b = move || {
            if rayon::current_thread_index() != giver {
                TAKEN.set(TAKEN.get() + 1);
            }
            b()
        };
        rayon::join(a, b)
    } else {
        (a(), b())
    }
}

/// Whether the caller's pool has more threads than one.
pub(crate) fn are_many() -> bool {
    rayon::current_thread_index().is_some() && rayon::current_num_threads() > 1
}

/// Works on items side by side, so many of them at a time where there are several times as many, given the number of the
/// first.
pub(crate) fn over<T: Send>(
    items: &mut [T],
    at_a_time: usize,
    work: &(impl Fn(usize, &mut [T]) + Sync),
) {
    fn halve<T: Send>(
        items: &mut [T],
        first: usize,
        at_a_time: usize,
        work: &(impl Fn(usize, &mut [T]) + Sync),
    ) {
        if items.len() <= at_a_time {
            return work(first, items);
        }
        let middle = items.len().div_ceil(2 * at_a_time) * at_a_time;
        let (low, high) = items.split_at_mut(middle);
        join(
            true,
            || halve(low, first, at_a_time, work),
            || halve(high, first + middle, at_a_time, work),
        );
    }
    if items.len() >= WORTH_HALVING * at_a_time && are_many() {
        halve(items, 0, at_a_time, work);
    } else {
        work(0, items);
    }
}

/// Does some work while another thread of the pool stands by awake to take a share of it.
///
/// One, because what stands by is the oldest that the worker offers, so that no thread comes to it from within a part of the work. A second
/// one might be offered later, by the first: a thread that waits within a part of the work for another part would take it up and wait for the
/// end of work that waits for it.
pub(crate) fn with_help<T: Send>(pays: bool, work: impl FnOnce() -> T + Send) -> T {
    if !pays || !are_many() {
        return work();
    }
    let team = Team {
        worker: rayon::current_thread_index(),
        is_over: AtomicBool::new(false),
    };
    let work = || {
        let _release = Release(&team);
        work()
    };
    rayon::join(work, || team.help()).0
}

/// Who works, and who stands by.
struct Team {
    /// The thread that works.
    worker: Option<usize>,
    is_over: AtomicBool,
}

/// Lets the helper go, whatever happens.
struct Release<'a>(&'a Team);

impl Drop for Release<'_> {
    fn drop(&mut self) {
        self.0.is_over.store(true, Ordering::Release);
    }
}

impl Team {
    /// Does what there is to do in the pool until the work is over.
    fn help(&self) {
        // The worker, while it waits for a helper, may come to this itself, and would wait for its own end.
        if rayon::current_thread_index() == self.worker {
            return;
        }
        let mut looks = 0;
        while !self.is_over.load(Ordering::Acquire) {
            if rayon::yield_now() == Some(rayon::Yield::Executed) {
                looks = 0;
                continue;
            }
            looks += 1;
            if looks < PATIENCE {
                std::hint::spin_loop();
            } else {
                looks = 0;
                std::thread::yield_now();
            }
        }
    }
}
