//! Parallel work within a memory budget: each worker has its own threads, takes the next item, and starts it when there
//! is memory for it.

use crate::commands::on_threads;
use anyhow::Result;
use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Condvar, Mutex, PoisonError};

/// The workers, and what they may use.
pub(super) struct Crew<'a> {
    pub(super) threads: usize,
    /// Memory for everything that runs at the same time, bytes.
    pub(super) memory: u64,
    /// If set, nothing new is started.
    pub(super) stop: &'a AtomicBool,
}

/// An item of work and its approximate memory, bytes.
pub(super) struct Item<T> {
    pub(super) bytes: u64,
    pub(super) item: T,
}

impl Crew<'_> {
    /// Returns how many items run side by side: no more than fit into memory, given their average size. Remaining
    /// threads are distributed among them.
    pub(super) fn workers<T>(&self, items: &[Item<T>]) -> usize {
        let all: u64 = items.iter().map(|item| item.bytes.min(self.memory)).sum();
        let mean = (all / items.len().max(1) as u64).max(1);
        let fitting = usize::try_from(self.memory / mean).unwrap_or(usize::MAX);
        self.threads.min(items.len()).min(fitting).max(1)
    }

    /// Processes all items in this order; `work` receives the number of its worker. An error stops the others.
    pub(super) fn each<T: Send>(
        &self,
        items: Vec<Item<T>>,
        work: impl Fn(usize, T) -> Result<()> + Sync,
    ) -> Result<()> {
        let workers = self.workers(&items);
        let (queue, room) = (Mutex::new(VecDeque::from(items)), Room::new(self.memory));
        let next = || queue.lock().unwrap_or_else(PoisonError::into_inner).pop_front();
        let stopped = || self.stop.load(Ordering::Relaxed);
        let one = |worker: usize| -> Result<()> {
            let threads = self.threads / workers + usize::from(worker < self.threads % workers);
            let ended = on_threads(u16::try_from(threads).ok(), || {
                while !stopped() {
                    let Some(Item { bytes, item }) = next() else { break };
                    // Everything may have been stopped while this item waited for memory.
                    room.with(bytes, || if stopped() { Ok(()) } else { work(worker, item) })?;
                }
                Ok(())
            });
            let ended = ended.and_then(|ended| ended);
            if ended.is_err() {
                self.stop.store(true, Ordering::Relaxed);
            }
            ended
        };
        let one = &one;
        std::thread::scope(|scope| {
            let all: Vec<_> = (0..workers).map(|worker| scope.spawn(move || one(worker))).collect();
            all.into_iter().try_for_each(|worker| worker.join().expect("panics are caught in each item"))
        })
    }
}

/// Memory that running work may use together, bytes.
struct Room {
    all: u64,
    free: Mutex<u64>,
    changed: Condvar,
}

impl Room {
    fn new(all: u64) -> Room {
        Room { all, free: Mutex::new(all), changed: Condvar::new() }
    }

    /// Waits until there is enough memory. Work that is too large for the whole budget runs alone.
    fn with<T>(&self, bytes: u64, work: impl FnOnce() -> T) -> T {
        let bytes = bytes.min(self.all);
        let free = || self.free.lock().unwrap_or_else(PoisonError::into_inner);
        let room = self.changed.wait_while(free(), |free| *free < bytes);
        *room.unwrap_or_else(PoisonError::into_inner) -= bytes;
        let _taken = Taken { room: self, bytes };
        work()
    }
}

/// Memory in use. It is returned even if the work panics, because others may be waiting for it.
struct Taken<'a> {
    room: &'a Room,
    bytes: u64,
}

impl Drop for Taken<'_> {
    fn drop(&mut self) {
        *self.room.free.lock().unwrap_or_else(PoisonError::into_inner) += self.bytes;
        self.room.changed.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::bail;

    fn items(sizes: &[u64]) -> Vec<Item<u64>> {
        sizes.iter().map(|&bytes| Item { bytes, item: bytes }).collect()
    }

    #[test]
    fn work_waits_until_there_is_room_and_the_too_large_goes_alone() {
        let stop = AtomicBool::new(false);
        let crew = Crew { threads: 4, memory: 10, stop: &stop };
        let (running, most, done) = (Mutex::new(0), Mutex::new(0), Mutex::new(0));
        let work = |_, bytes: u64| {
            let taken = bytes.min(10);
            let now = {
                let mut running = running.lock().unwrap();
                *running += taken;
                *running
            };
            let mut most = most.lock().unwrap();
            *most = now.max(*most);
            drop(most);
            *running.lock().unwrap() -= taken;
            *done.lock().unwrap() += 1;
            Ok(())
        };
        crew.each(items(&[4, 5, 99, 1, 4, 5, 99, 1, 4, 5]), work).unwrap();
        assert!(*most.lock().unwrap() <= 10 && *done.lock().unwrap() == 10);
    }

    #[test]
    fn no_more_workers_than_there_is_room_for() {
        let stop = AtomicBool::new(false);
        let workers = |threads, sizes: &[u64]| Crew { threads, memory: 10, stop: &stop }.workers(&items(sizes));
        assert_eq!(
            [workers(8, &[1; 20]), workers(8, &[1; 3]), workers(8, &[5; 20]), workers(8, &[99; 20])],
            [8, 3, 2, 1]
        );
        assert_eq!([workers(2, &[]), workers(8, &[0, 0])], [1, 2]);
    }

    #[test]
    fn an_error_or_a_stop_begins_nothing_new() {
        let stop = AtomicBool::new(false);
        let crew = Crew { threads: 1, memory: 10, stop: &stop };
        let done = Mutex::new(Vec::new());
        let failed = crew.each(items(&[1, 2, 3, 4]), |_, item| {
            done.lock().unwrap().push(item);
            if item == 2 { bail!("no more") } else { Ok(()) }
        });
        assert_eq!(failed.unwrap_err().to_string(), "no more");
        assert_eq!(*done.lock().unwrap(), [1, 2]);
        crew.each(items(&[1]), |_, _| bail!("was stopped before")).unwrap();
    }
}
