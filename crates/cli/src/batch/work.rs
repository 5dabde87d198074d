//! The pairs, side by side: each worker has threads of its own and takes the next pair when there is room for it.

use super::board::Board;
use super::cache::Cache;
use super::hash_of;
use super::input::Input;
use super::pairs::Job;
use super::results::Results;
use super::row::{Row, Status};
use super::survey::Survey;
use crate::commands::on_threads;
use anyhow::{Context, Result};
use congruent_pipeline::{Pair, PipelineConfig, Prior, Stage, Variant};
use std::any::Any;
use std::collections::VecDeque;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::str::FromStr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Condvar, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// What a running pair takes at most, apart from its descriptors: per point of the two scans while they are read …
const BYTES_PER_POINT: u64 = 400;
/// … and whatever their size: surfaces, poses, the fields of nearest points.
const BYTES_PER_PAIR: u64 = 64 << 20;

/// The share of the pairs that this process has, counted from one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Share {
    pub(super) part: usize,
    pub(super) of: usize,
}

impl FromStr for Share {
    type Err = String;

    fn from_str(text: &str) -> Result<Share, String> {
        let parts = text.split_once('/').and_then(|(part, of)| Some((part.parse().ok()?, of.parse().ok()?)));
        match parts {
            Some((part, of)) if 1 <= part && part <= of => Ok(Share { part, of }),
            _ => Err("write i/n with i from 1 to n, as in 2/3".to_owned()),
        }
    }
}

impl Share {
    /// Every n-th of the pairs, which are sorted by id.
    pub(super) fn of(self, jobs: Vec<Job>) -> Vec<Job> {
        jobs.into_iter().enumerate().filter(|(at, _)| at % self.of == self.part - 1).map(|(_, job)| job).collect()
    }
}

/// What the work may take.
pub(super) struct Limits {
    pub(super) threads: usize,
    /// For running pairs, bytes.
    memory: u64,
    /// For one pair.
    time: Option<Duration>,
}

impl Limits {
    /// `memory` is the whole budget, bytes.
    pub(super) fn new(threads: usize, memory: u64, time: Option<Duration>) -> Limits {
        Limits { threads, memory: memory - (super::CACHE_SHARE * memory as f64) as u64, time }
    }
}

pub(super) struct Work<'a> {
    pub(super) input: &'a Input,
    pub(super) survey: &'a Survey,
    pub(super) cache: &'a Cache,
    pub(super) config: &'a PipelineConfig,
    pub(super) limits: Limits,
}

/// What unwinds a pair that took too long.
struct TimedOut;

impl Work<'_> {
    /// Runs the pairs, largest first, and writes their rows as they end.
    pub(super) fn run(&self, mut jobs: Vec<Job>, results: &Results, interrupted: &AtomicBool) -> Result<()> {
        // By the larger scan, so that its descriptors serve all its pairs while they are in the cache.
        jobs.sort_by_key(|job| {
            let size = |at: usize| (self.survey.points(at), at);
            let two = [size(job.source), size(job.target)];
            (std::cmp::Reverse(two.iter().max().copied()), std::cmp::Reverse(two.iter().min().copied()), job.id.clone())
        });
        let workers = self.limits.threads.min(jobs.len()).max(1);
        let board = Board::new(jobs.len(), workers);
        let (queue, room) = (Mutex::new(VecDeque::from(jobs)), Room::new(self.limits.memory));
        let configuration = hash_of(self.config);
        let one = |worker: usize| -> Result<()> {
            let threads = self.limits.threads / workers + usize::from(worker < self.limits.threads % workers);
            on_threads(u16::try_from(threads).ok(), || {
                while !interrupted.load(Ordering::Relaxed) {
                    let next = queue.lock().unwrap_or_else(PoisonError::into_inner).pop_front();
                    let Some(job) = next else { break };
                    let row = room.with(self.bytes(&job), || self.row(&job, &configuration, worker, &board));
                    board.ended(worker, &row.word());
                    results.append(&row).context("a row cannot be written")?;
                }
                Ok(())
            })?
        };
        let one = &one;
        std::thread::scope(|scope| {
            let all: Vec<_> =
                (0..workers).map(|worker| scope.spawn(move || one_of(one, worker, interrupted))).collect();
            all.into_iter().try_for_each(|worker| worker.join().expect("panics are caught in each pair"))
        })
    }

    /// What a pair takes while it runs.
    fn bytes(&self, job: &Job) -> u64 {
        let points = self.survey.points(job.source) + self.survey.points(job.target);
        BYTES_PER_PAIR + BYTES_PER_POINT * points as u64
    }

    fn row(&self, job: &Job, configuration: &str, worker: usize, board: &Board) -> Row {
        let start = Instant::now();
        let seed = job.seed(self.config.seed);
        let scan = |at: usize| &self.input.scans[at];
        let (pair, made_with) =
            ((job, [scan(job.source).name.as_str(), scan(job.target).name.as_str()]), (seed, configuration));
        let observe = |stage: Stage| {
            board.enter(worker, &job.id, stage);
            if self.limits.time.is_some_and(|limit| start.elapsed() > limit) {
                resume_unwind(Box::new(TimedOut));
            }
        };
        let registered = caught(|| {
            let supply = |at: usize| move |variant: Variant| self.survey.described(self.input, self.cache, at, variant);
            let (source, target) = (supply(job.source), supply(job.target));
            // An unusable scan is said before any work is done for its partner.
            let (first, second) = (&self.survey.scans[job.source], &self.survey.scans[job.target]);
            let centre = first.as_ref().map_err(Clone::clone)?.centre;
            second.as_ref().map_err(Clone::clone)?;
            let collection = self.survey.collection.as_ref().expect("usable scans make a collection");
            Ok((
                collection.register(Pair { source: &source, target: &target }, (seed, &Prior::default()), &observe)?,
                centre,
            ))
        });
        match registered {
            Ok(Ok((registration, centre))) => Row::done(pair, made_with, start.elapsed(), (&registration, centre)),
            Ok(Err(error)) => Row::failed(pair, made_with, start.elapsed(), (Status::Error, error)),
            Err(payload) if payload.is::<TimedOut>() => {
                let limit = self.limits.time.unwrap_or_default().as_secs_f64();
                let error = format!("not done after {limit} s; raise --time-limit");
                Row::failed(pair, made_with, start.elapsed(), (Status::TimedOut, error))
            }
            Err(payload) => Row::failed(pair, made_with, start.elapsed(), (Status::Error, internal(payload.as_ref()))),
        }
    }
}

/// A worker that cannot write stops the others.
fn one_of(work: &(dyn Fn(usize) -> Result<()> + Sync), worker: usize, interrupted: &AtomicBool) -> Result<()> {
    let result = work(worker);
    if result.is_err() {
        interrupted.store(true, Ordering::Relaxed);
    }
    result
}

/// Work whose panic is a value.
fn caught<T>(work: impl FnOnce() -> Result<T, String>) -> Result<Result<T, String>, Box<dyn Any + Send>> {
    catch_unwind(AssertUnwindSafe(work))
}

/// The same with the panic in words.
pub(super) fn guarded<T>(work: impl FnOnce() -> Result<T, String>) -> Result<Result<T, String>, String> {
    caught(work).map_err(|payload| internal(payload.as_ref()))
}

fn internal(payload: &(dyn Any + Send)) -> String {
    let message = payload.downcast_ref::<&str>().copied().map(str::to_owned);
    let message = message.or_else(|| payload.downcast_ref::<String>().cloned()).unwrap_or_default();
    format!("internal error: {message}")
}

/// From here on a panic is told by the row of its pair, and not on stderr.
pub(super) fn silence_panics() {
    std::panic::set_hook(Box::new(|_| {}));
}

/// Bytes that running pairs may take together.
struct Room {
    all: u64,
    free: Mutex<u64>,
    changed: Condvar,
}

impl Room {
    fn new(all: u64) -> Room {
        Room { all, free: Mutex::new(all), changed: Condvar::new() }
    }

    /// Waits until there is room. Work that is too large for the whole room has it alone.
    fn with<T>(&self, bytes: u64, work: impl FnOnce() -> T) -> T {
        let bytes = bytes.min(self.all);
        let free = || self.free.lock().unwrap_or_else(PoisonError::into_inner);
        let room = self.changed.wait_while(free(), |free| *free < bytes);
        *room.unwrap_or_else(PoisonError::into_inner) -= bytes;
        let result = work();
        *free() += bytes;
        self.changed.notify_all();
        result
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_parsed_and_part_the_pairs() {
        for text in ["0/3", "4/3", "3", "a/b", "1/0"] {
            assert!(text.parse::<Share>().is_err(), "{text}");
        }
        let jobs = |ids: &[&str]| -> Vec<Job> {
            ids.iter().map(|id| Job { id: (*id).to_owned(), source: 0, target: 1, truth: None }).collect()
        };
        let part = |text: &str| text.parse::<Share>().unwrap().of(jobs(&["a", "b", "c", "d", "e"]));
        assert_eq!(part("1/1").len(), 5);
        assert_eq!(part("1/2"), jobs(&["a", "c", "e"]));
        assert_eq!(part("2/2"), jobs(&["b", "d"]));
        assert!(part("6/6").is_empty());
    }

    #[test]
    fn a_panic_becomes_words() {
        silence_panics();
        let message = guarded::<()>(|| panic!("the sky fell on {}", "heads")).unwrap_err();
        assert_eq!(message, "internal error: the sky fell on heads");
        assert_eq!(guarded(|| Ok(3)), Ok(Ok(3)));
    }

    #[test]
    fn work_waits_until_there_is_room() {
        let (room, running, most) = (Room::new(10), Mutex::new(0), Mutex::new(0));
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| {
                    for bytes in [4, 5, 99] {
                        room.with(bytes, || {
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
                        });
                    }
                });
            }
        });
        assert!(*most.lock().unwrap() <= 10 && *room.free.lock().unwrap() == 10);
    }
}
