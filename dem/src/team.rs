//! Threads that stand by while a simulation steps.
//!
//! A step of some ten thousand grains takes a millisecond or less. A thread that has gone to sleep needs a
//! tenth of that to be woken, twice a step, so threads of the pool wait for work awake as long as a simulation
//! advances. Meanwhile they do what else there is in the pool, and give way to other programs.
//!
//! Whoever stands by waits for the end of the work, so the work must never wait for it. A thread may come to stand by
//! from within a part of the work that was given to the pool (it waits there for another part, and looks for something to
//! do); it would wait for the end of work that waits for its part. So a thread is taken on only while tasks of the team
//! are under way ([`Team::each`]): nothing of the work is in the pool then, as long as tasks give nothing to the pool.
//! Workers that stand by for each other in a circle are kept out by the same rule: one that stands by elsewhere is within
//! a call of the pool, and takes nobody on.

use rayon::prelude::*;
use std::cell::UnsafeCell;
use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};

/// A task by its number, for as long as a call lasts.
type Task = *const (dyn Fn(usize) + Sync + 'static);

/// Most tasks of a call.
const TASKS: usize = 32;

/// Looks at what is to be done between two looks at what the pool has.
const LOOKS: u32 = 32;

/// Looks in vain, some tens of microseconds of them, after which a thread that was not taken on goes.
const BRIEF: u32 = 3000;

/// Looks in vain after which a thread gives way to others.
const PATIENCE: u32 = 2000;

/// Numbers that different threads write lie in different lines of the cache.
#[derive(Debug, Default)]
#[repr(align(128))]
struct Apart<T>(T);

/// See the module.
pub(crate) struct Team {
    /// Number of the call, and which tasks are given out or are none, by bits: 32 each.
    call: Apart<AtomicU64>,
    /// Tasks done in this call.
    done: Apart<AtomicUsize>,
    /// Threads that stand by, and how many there are to be with the caller.
    helpers: AtomicUsize,
    threads: AtomicUsize,
    /// Whether others are taken on now: tasks are under way.
    takes_on: AtomicBool,
    /// Whether they may go.
    over: AtomicBool,
    task: UnsafeCell<Option<Task>>,
}

// SAFETY: the task is written by the caller alone, while none is given out; it is read by those who have been
// given one of a call's tasks, which the caller waits for.
unsafe impl Sync for Team {}
// SAFETY: see above; no task outlives its call.
unsafe impl Send for Team {}

impl Default for Team {
    /// Nothing is given out: tasks that were free before the first call would be taken, and done with the first call's
    /// task at places where it has none.
    fn default() -> Self {
        Self {
            call: Apart(AtomicU64::new(u64::from(u32::MAX))),
            done: Apart::default(),
            helpers: AtomicUsize::new(0),
            threads: AtomicUsize::new(0),
            takes_on: AtomicBool::new(false),
            over: AtomicBool::new(false),
            task: UnsafeCell::new(None),
        }
    }
}

impl fmt::Debug for Team {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.debug_struct("Team").finish_non_exhaustive()
    }
}

/// A simulation's own team: a copy of the simulation has another.
#[derive(Debug, Default)]
pub(crate) struct OwnTeam(Arc<Team>);

impl Clone for OwnTeam {
    fn clone(&self) -> Self {
        OwnTeam::default()
    }
}

impl OwnTeam {
    /// It, while the simulation is being changed.
    pub fn share(&self) -> Arc<Team> {
        Arc::clone(&self.0)
    }
}

/// Lets the helpers go, whatever happens.
struct Release<'a>(&'a Team);

impl Drop for Release<'_> {
    fn drop(&mut self) {
        self.0.over.store(true, Ordering::Release);
    }
}

/// Notes that a helper has gone, whatever happens.
struct Leave<'a>(&'a Team);

impl Drop for Leave<'_> {
    fn drop(&mut self) {
        self.0.helpers.fetch_sub(1, Ordering::AcqRel);
    }
}

impl Team {
    /// Does some work while at most so many threads of the pool stand by. Those that come while the work has given something
    /// to the pool are sent away until the next call.
    pub fn with_helpers<T: Send>(&self, helpers: usize, work: impl FnOnce() -> T + Send) -> T {
        if helpers == 0 {
            return work();
        }
        self.over.store(false, Ordering::Release);
        self.threads.store(helpers + 1, Ordering::Release);
        let work = || {
            let _release = Release(self);
            work()
        };
        rayon::join(work, || self.stand_by(helpers)).0
    }

    /// Waits for tasks, with others, until the work is over.
    fn stand_by(&self, helpers: usize) {
        if helpers > 1 {
            rayon::join(
                || self.wait_for_tasks(helpers),
                || self.stand_by(helpers - 1),
            );
        } else {
            self.wait_for_tasks(helpers);
        }
    }

    fn wait_for_tasks(&self, own: usize) {
        // See the module. What this thread may be within was given to the pool after others ceased to be taken on,
        // and they are not until it is done: it does not wait for long. One that comes before the first tasks does.
        let mut looks = 0;
        while !self.takes_on.load(Ordering::Acquire) {
            if looks >= BRIEF || self.over.load(Ordering::Acquire) {
                return;
            }
            looks += 1;
            std::hint::spin_loop();
        }
        self.helpers.fetch_add(1, Ordering::AcqRel);
        let _leave = Leave(self);
        let mut looks = 0;
        while !self.over.load(Ordering::Acquire) {
            if self.take(own) {
                looks = 0;
                continue;
            }
            wait(&mut looks);
            if looks % LOOKS == 0 && rayon::yield_now() == Some(rayon::Yield::Executed) {
                looks = 0;
            }
        }
    }

    /// Whether there is work for which others may stand by.
    fn is_at_work(&self) -> bool {
        self.threads.load(Ordering::Relaxed) > 1 && !self.over.load(Ordering::Relaxed)
    }

    /// Whether anybody stands by.
    #[cfg(test)]
    fn stands_by(&self) -> bool {
        self.helpers.load(Ordering::Acquire) > 0
    }

    /// Does one thing with each item, which gives nothing to the pool; if `parallel`, on all threads that stand by, or else in
    /// the pool. As far as may be, a thread gets the same items in every call: what they hold is in its cache.
    pub fn each<T: Send>(&self, parallel: bool, items: &mut [T], task: &(impl Fn(&mut T) + Sync)) {
        if !parallel || items.len() < 2 {
            items.iter_mut().for_each(task);
        } else if self.is_at_work() && items.len() <= TASKS {
            self.share_out(items, task);
        } else {
            items.par_iter_mut().for_each(task);
        }
    }

    fn share_out<T: Send>(&self, items: &mut [T], task: &(impl Fn(&mut T) + Sync)) {
        let count = items.len();
        let first = Items(items.as_mut_ptr());
        let on = |index: usize| {
            // SAFETY: every number below the count is given out once.
            task(unsafe { &mut *first.at(index) });
        };
        let on: &(dyn Fn(usize) + Sync) = &on;
        // SAFETY: it is called only before this function returns.
        let on: &(dyn Fn(usize) + Sync + 'static) = unsafe { std::mem::transmute(on) };
        // SAFETY: no task is given out now, so nobody reads.
        unsafe { *self.task.get() = Some(on) };
        self.done.0.store(0, Ordering::Relaxed);
        let number = self.call.0.load(Ordering::Relaxed) >> 32;
        let none = (u32::MAX as u64) << count & u64::from(u32::MAX);
        let call = number.wrapping_add(1) << 32 | none;
        self.call.0.store(call, Ordering::Release);
        self.takes_on.store(true, Ordering::Release);
        let _wait = Wait { team: self, count };
        while self.take(0) {}
    }

    /// Gives out no more tasks; says how many of this call's never were.
    fn close(&self) -> usize {
        let all = u64::from(u32::MAX);
        let before = self.call.0.fetch_or(all, Ordering::AcqRel) as u32;
        before.count_zeros() as usize
    }

    /// Takes a task and does it, if there is one: a thread's own if it can.
    fn take(&self, thread: usize) -> bool {
        let mut call = self.call.0.load(Ordering::Acquire);
        loop {
            let free = !(call as u32);
            if free == 0 {
                return false;
            }
            let threads = self.threads.load(Ordering::Relaxed).max(1);
            let tasks = TASKS - (call as u32).leading_ones() as usize;
            let own = ((thread * tasks).div_ceil(threads) % TASKS) as u32;
            let task = (free.rotate_right(own).trailing_zeros() + own) % TASKS as u32;
            let (order, other) = (Ordering::AcqRel, Ordering::Acquire);
            let taken = call | 1 << task;
            match self.call.0.compare_exchange_weak(call, taken, order, other) {
                Ok(_) => {
                    let _done = Done(self);
                    // SAFETY: the caller waits for this task, so it is still that of the call.
                    if let Some(on) = unsafe { *self.task.get() } {
                        // SAFETY: see above.
                        unsafe { (*on)(task as usize) };
                    }
                    return true;
                }
                Err(now) => call = now,
            }
        }
    }
}

/// The first of the items that tasks are about.
struct Items<T>(*mut T);

// SAFETY: each item is used by one thread, and may be sent to it.
unsafe impl<T: Send> Sync for Items<T> {}

impl<T> Items<T> {
    fn at(&self, index: usize) -> *mut T {
        self.0.wrapping_add(index)
    }
}

/// Counts a task as done, even if it panics.
struct Done<'a>(&'a Team);

impl Drop for Done<'_> {
    fn drop(&mut self) {
        self.0.done.0.fetch_add(1, Ordering::AcqRel);
    }
}

/// Waits for the tasks that were given out, even if one of the caller's own panics.
struct Wait<'a> {
    team: &'a Team,
    count: usize,
}

impl Drop for Wait<'_> {
    fn drop(&mut self) {
        self.team.takes_on.store(false, Ordering::Release);
        let given = self.count - self.team.close();
        let mut looks = 0;
        while self.team.done.0.load(Ordering::Acquire) < given {
            wait(&mut looks);
        }
    }
}

/// Waits for a moment, longer after many looks in vain.
fn wait(looks: &mut u32) {
    *looks = looks.saturating_add(1);
    if *looks > PATIENCE {
        std::thread::yield_now();
    } else {
        std::hint::spin_loop();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn in_pool<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build().unwrap().install(work)
    }

    #[test]
    fn every_item_is_seen_once_in_every_call() {
        for threads in [1, 2, 5] {
            let mut items = vec![0_u64; 37];
            let team = Team::default();
            in_pool(threads, || {
                team.with_helpers(threads - 1, || {
                    for call in 0..20_000 {
                        team.each(true, &mut items, &|item| *item += call);
                    }
                });
            });
            assert!(
                items.iter().all(|&item| item == 19_999 * 10_000),
                "{items:?}"
            );
            assert!(!team.stands_by());
        }
    }

    /// New teams, whose helpers come before, at or after the first call, and calls of few items.
    #[test]
    fn few_items_are_seen_once_from_the_first_call_on() {
        for round in 0..200 {
            let threads = 2 + round % 3;
            let team = Team::default();
            in_pool(threads, || {
                team.with_helpers(threads - 1, || {
                    for call in 0..200_usize {
                        let count = 2 + (call + round) % 5;
                        let mut items: Vec<[usize; 3]> = (0..count).map(|i| [i, call, 0]).collect();
                        team.each(true, &mut items, &|item| {
                            assert_eq!(item[1], call, "an item of another call");
                            item[2] += 1;
                        });
                        let seen = items
                            .iter()
                            .enumerate()
                            .all(|(i, item)| *item == [i, call, 1]);
                        assert!(seen, "call {call} of round {round}: {items:?}");
                    }
                });
            });
        }
    }

    /// Threads that wait for the pool, the worker or others within a part of its work, come to stand by, and are not taken
    /// on: they would wait for the end of work that waits for them. Taken on whenever they came, they hung in the first hundreds
    /// of these rounds.
    #[test]
    fn nobody_who_is_within_the_work_stands_by() {
        for threads in [2, 3, 8] {
            in_pool(threads, || {
                for round in 0..1500 {
                    let team = Team::default();
                    let half = || {
                        let roots = (0..64_usize).into_par_iter().map(|n| {
                            let root = |x: f64, _| (x + 1.0).sqrt();
                            (0..500).fold(n as f64, root)
                        });
                        assert!(roots.sum::<f64>() > 64.0);
                        let mut items = [0_u64; 6];
                        team.each(true, &mut items, &|item| *item += round);
                        assert_eq!(items, [round; 6]);
                    };
                    team.with_helpers(threads - 1, || {
                        half();
                        half();
                    });
                }
            });
        }
    }

    /// Two workers of one pool, each of which may come to stand by for the other.
    #[test]
    fn workers_do_not_wait_for_each_other() {
        in_pool(4, || {
            for _ in 0..300 {
                let sums: Vec<usize> = (0..3_usize)
                    .into_par_iter()
                    .with_max_len(1)
                    .map(|n| {
                        let team = Team::default();
                        team.with_helpers(3, || {
                            let sum: usize = (0..200_usize).into_par_iter().map(|k| k % 7).sum();
                            let mut items = [n; 6];
                            team.each(true, &mut items, &|item| *item += sum);
                            items.iter().sum()
                        })
                    })
                    .collect();
                let sum: usize = (0..200).map(|k| k % 7).sum();
                assert_eq!(sums, [6 * sum, 6 * (1 + sum), 6 * (2 + sum)]);
            }
        });
    }

    /// Waits until somebody stands by, but not for ever.
    fn wait_for_a_helper(team: &Team) {
        let start = std::time::Instant::now();
        while !team.stands_by() && start.elapsed().as_millis() < 100 {
            std::thread::yield_now();
        }
    }

    /// Somebody is taken on while tasks are under way, and does what else there is in the pool. One that comes too early is
    /// sent away, so there are several calls.
    #[test]
    fn a_thread_stands_by_and_does_what_else_there_is() {
        let team = Team::default();
        let mut stood_by = 0;
        in_pool(2, || {
            for _ in 0..50 {
                team.with_helpers(1, || {
                    team.each(true, &mut [0, 1], &|_| wait_for_a_helper(&team));
                    stood_by += u32::from(team.stands_by());
                    let (a, b) = rayon::join(|| 1, || 2);
                    assert_eq!(a + b, 3);
                });
                assert!(!team.stands_by());
            }
        });
        assert!(stood_by > 0);
    }

    #[test]
    fn a_panic_in_a_task_lets_the_helpers_go() {
        let team = Team::default();
        let caught = in_pool(2, || {
            std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
                team.with_helpers(1, || {
                    team.each(true, &mut [0, 1, 2, 3], &|item| assert!(*item < 2));
                });
            }))
        });
        assert!(caught.is_err());
        assert!(!team.stands_by());
    }
}
