//! Registers the pairs, each on its own; whatever happens to a pair is written to its row.

use super::board::Board;
use super::cache::Cache;
use super::crew::{Crew, Item};
use super::hash_of;
use super::input::Input;
use super::pairs::Job;
use super::results::Results;
use super::row::{Asked, NoVerdict, Row, Status};
use super::survey::Survey;
use anyhow::Result;
use congruent_pipeline::{Pair, PipelineConfig, Prior, Registration, Stage, Variant};
use nalgebra::Vector3;
use std::any::Any;
use std::cmp::Reverse;
use std::panic::{AssertUnwindSafe, PanicHookInfo, catch_unwind, resume_unwind};
use std::str::FromStr;
use std::time::{Duration, Instant};

/// Maximum memory of a running pair, apart from its descriptors: per point of the two scans while they are read …
const BYTES_PER_POINT: u64 = 400;
/// … and independently of their size: surfaces, poses, the fields of nearest points.
const BYTES_PER_PAIR: u64 = 64 << 20;

/// The part of the pairs that this process registers, counted from one.
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
    /// Returns every n-th of the pairs, which are sorted by id.
    pub(super) fn of(self, jobs: Vec<Job>) -> Vec<Job> {
        jobs.into_iter().enumerate().filter(|(at, _)| at % self.of == self.part - 1).map(|(_, job)| job).collect()
    }
}

pub(super) struct Work<'a> {
    pub(super) input: &'a Input,
    pub(super) survey: &'a Survey,
    pub(super) cache: &'a Cache,
    pub(super) config: &'a PipelineConfig,
    /// Time limit of one pair.
    pub(super) time_limit: Option<Duration>,
}

/// The payload with which a pair that took too long is unwound.
struct TimedOut;

impl Work<'_> {
    /// Registers the pairs, largest first, and writes their rows as they end.
    pub(super) fn run(&self, mut jobs: Vec<Job>, results: &Results, crew: &Crew<'_>) -> Result<()> {
        // Sorted by the larger scan, so that its descriptors serve all its pairs while they are in the cache.
        jobs.sort_by_cached_key(|job| {
            let size = |at: usize| (self.survey.points(at), at);
            let [one, other] = [size(job.source), size(job.target)];
            (Reverse(one.max(other)), Reverse(one.min(other)), job.id.clone())
        });
        let items: Vec<Item<Job>> = jobs.into_iter().map(|item| Item { bytes: self.bytes(&item), item }).collect();
        let board = Board::new(items.len(), "pairs", crew.workers(&items));
        let configuration = hash_of(self.config);
        crew.each(items, |worker, job| {
            let row = self.row(&job, &configuration, &|stage| board.enter(worker, &job.id, stage));
            results.append(&row)?;
            board.ended(worker, &row.word(), row.status != Status::Done);
            Ok(())
        })
    }

    /// Returns the memory of a pair while it runs.
    fn bytes(&self, job: &Job) -> u64 {
        let points = self.survey.points(job.source) + self.survey.points(job.target);
        BYTES_PER_PAIR + BYTES_PER_POINT * points as u64
    }

    fn row(&self, job: &Job, configuration: &str, enter: &dyn Fn(Stage)) -> Row {
        let seed = job.seed(self.config.seed);
        let start = Instant::now();
        let observe = |stage: Stage| {
            enter(stage);
            if self.time_limit.is_some_and(|limit| start.elapsed() > limit) {
                resume_unwind(Box::new(TimedOut));
            }
        };
        let registered = outcome(self.time_limit, || self.registered(job, seed, &observe));
        let asked = Asked { job, names: self.input.names(job), seed, configuration };
        match registered {
            Ok((registration, centre)) => Row::done(asked, start.elapsed(), &registration, centre),
            Err(why) => Row::failed(asked, start.elapsed(), why),
        }
    }

    /// Returns the registration, and the centre of the source.
    fn registered(
        &self,
        job: &Job,
        seed: u64,
        observe: &dyn Fn(Stage),
    ) -> Result<(Registration, Vector3<f64>), String> {
        let supply = |at: usize| move |variant: Variant| self.survey.described(self.input, self.cache, at, variant);
        let (source, target) = (supply(job.source), supply(job.target));
        // An unusable scan is reported before any work is done for its partner.
        let [first, second] = [job.source, job.target].map(|at| self.survey.scans[at].as_ref().map_err(Clone::clone));
        let centre = first?.centre;
        second?;
        let prior = job.guess.map(Prior::guess).unwrap_or_default();
        let collection = self.survey.collection.as_ref().expect("usable scans make a collection");
        Ok((collection.register(Pair { source: &source, target: &target }, seed, &prior, observe)?, centre))
    }
}

/// Returns the result of the work, or why there is none.
fn outcome<T>(time_limit: Option<Duration>, work: impl FnOnce() -> Result<T, String>) -> Result<T, NoVerdict> {
    let failed = |status: Status, error: String| NoVerdict { status, error };
    match catch_unwind(AssertUnwindSafe(work)) {
        Ok(result) => result.map_err(|error| failed(Status::Error, error)),
        Err(payload) if payload.is::<TimedOut>() => {
            let limit = time_limit.unwrap_or_default().as_secs_f64();
            Err(failed(Status::TimedOut, format!("not finished after {limit} s; raise --time-limit")))
        }
        Err(payload) => Err(failed(Status::Error, internal(payload.as_ref()))),
    }
}

/// Does work whose panic is an error like any other.
pub(super) fn guarded<T>(work: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|payload| Err(internal(payload.as_ref())))
}

fn internal(payload: &(dyn Any + Send)) -> String {
    let message = payload.downcast_ref::<&str>().copied().map(str::to_owned);
    let message = message.or_else(|| payload.downcast_ref::<String>().cloned()).unwrap_or_default();
    format!("internal error: {message}")
}

type Hook = Box<dyn Fn(&PanicHookInfo<'_>) + Send + Sync>;

/// While it exists, panics are not printed to stderr. A process has only one panic hook, so this affects all threads.
pub(super) struct PanicSilence {
    before: Option<Hook>,
}

impl PanicSilence {
    pub(super) fn begin() -> Self {
        let before = std::panic::take_hook();
        std::panic::set_hook(Box::new(|_| {}));
        PanicSilence { before: Some(before) }
    }
}

impl Drop for PanicSilence {
    fn drop(&mut self) {
        // A thread that is panicking cannot change the hook.
        if let Some(before) = self.before.take().filter(|_| !std::thread::panicking()) {
            std::panic::set_hook(before);
        }
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
            ids.iter().map(|id| Job { id: (*id).to_owned(), source: 0, target: 1, truth: None, guess: None }).collect()
        };
        let part = |text: &str| text.parse::<Share>().unwrap().of(jobs(&["a", "b", "c", "d", "e"]));
        assert_eq!(part("1/1").len(), 5);
        assert_eq!(part("1/2"), jobs(&["a", "c", "e"]));
        assert_eq!(part("2/2"), jobs(&["b", "d"]));
        assert!(part("6/6").is_empty());
    }

    #[test]
    fn a_panic_or_a_lack_of_time_in_one_pair_is_a_row_with_an_error() {
        let _silence = PanicSilence::begin();
        let row = |work: fn() -> Result<(), String>| {
            let job = Job { id: "b--a".to_owned(), source: 0, target: 1, truth: None, guess: None };
            let asked = Asked { job: &job, names: ["b", "a"], seed: 7, configuration: "0f" };
            let why = outcome(Some(Duration::from_secs(90)), work).unwrap_err();
            let row = Row::failed(asked, Duration::ZERO, why);
            (row.status, row.error.unwrap())
        };
        let fallen = "internal error: the sky fell on heads".to_owned();
        assert_eq!(row(|| panic!("the sky fell on {}", "heads")), (Status::Error, fallen.clone()));
        assert_eq!(row(|| Err("no points".to_owned())), (Status::Error, "no points".to_owned()));
        let late = "not finished after 90 s; raise --time-limit".to_owned();
        assert_eq!(row(|| resume_unwind(Box::new(TimedOut))), (Status::TimedOut, late));
        assert_eq!(outcome(None, || Ok(3)), Ok(3));
        assert_eq!(guarded::<()>(|| panic!("the sky fell on {}", "heads")), Err(fallen));
        assert_eq!(guarded(|| Ok(3)), Ok(3));
    }
}
