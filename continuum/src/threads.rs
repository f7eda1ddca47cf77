//! Work side by side on the threads of the caller's pool.
//!
//! A caller inside a pool of rayon's (`ThreadPool::install`) gets its threads; any other has one. What is done side by
//! side is cut by what there is to do, never by the number of threads, and every sum has one order, so that the bits do
//! not depend on how many there are.

/// Does both, side by side where `pays` and there is a thread for it.
#[inline]
pub(crate) fn join<A: Send, B: Send>(
    pays: bool,
    a: impl FnOnce() -> A + Send,
    b: impl FnOnce() -> B + Send,
) -> (A, B) {
    if pays && are_many() {
        #[cfg(test)]
        let (a, b) = counted(a, b);
        rayon::join(a, b)
    } else {
        (a(), b())
    }
}

/// Whether the caller's pool has more threads than one.
pub(crate) fn are_many() -> bool {
    rayon::current_thread_index().is_some() && rayon::current_num_threads() > 1
}

/// Both, of which the second notes whether another thread has it.
#[cfg(test)]
fn counted<A: Send, B: Send>(
    a: impl FnOnce() -> A + Send,
    b: impl FnOnce() -> B + Send,
) -> (impl FnOnce() -> A + Send, impl FnOnce() -> B + Send) {
    let caller = rayon::current_thread_index();
    let b = move || {
        if rayon::current_thread_index() != caller {
            tests::TAKEN.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        }
        b()
    };
    (a, b)
}

#[cfg(test)]
mod tests;
