//! Described scans, kept as long as there is memory for them: the least recently used one is dropped first.

use congruent_pipeline::{DescribedScan, Variant};
use std::collections::HashMap;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// A described scan, or why there is none.
pub(crate) type Entry = Result<Arc<DescribedScan>, String>;

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct Key {
    /// Position among the scans.
    pub(super) scan: usize,
    pub(super) variant: Variant,
}

/// A cache bounded by bytes. A scan that a pair still uses stays alive even after it was dropped here.
pub(crate) struct Cache {
    capacity: usize,
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    slots: HashMap<Key, Slot>,
    /// Number of uses so far.
    now: u64,
}

struct Slot {
    entry: Arc<OnceLock<Entry>>,
    used: u64,
}

impl Slot {
    fn bytes(&self) -> usize {
        self.entry.get().and_then(|entry| entry.as_ref().ok()).map_or(0, |described| described.bytes())
    }
}

impl Cache {
    pub(super) fn new(capacity: usize) -> Self {
        Cache { capacity, state: Mutex::default() }
    }

    /// Returns the entry. One thread makes it, while others that want the same one wait.
    pub(super) fn get(&self, key: Key, make: impl FnOnce() -> Entry) -> Entry {
        let slot = {
            let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
            state.now += 1;
            let now = state.now;
            let slot = state.slots.entry(key).or_insert_with(|| Slot { entry: Arc::default(), used: now });
            slot.used = now;
            Arc::clone(&slot.entry)
        };
        let entry = slot.get_or_init(make).clone();
        self.state.lock().unwrap_or_else(PoisonError::into_inner).shrink(self.capacity);
        entry
    }
}

impl State {
    fn shrink(&mut self, capacity: usize) {
        let mut bytes: usize = self.slots.values().map(Slot::bytes).sum();
        while bytes > capacity {
            let filled = self.slots.iter().filter(|(_, slot)| slot.bytes() > 0);
            let Some((key, size)) = filled.min_by_key(|(_, slot)| slot.used).map(|(key, slot)| (*key, slot.bytes()))
            else {
                return;
            };
            self.slots.remove(&key);
            bytes -= size;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use congruent_geometry::Scan;
    use congruent_pipeline::{Collection, PipelineConfig, ScanSummary};
    use congruent_simulation::pair::{PairOptions, figurine_pair};

    #[test]
    fn what_was_used_longest_ago_is_forgotten_first() {
        let scan = Scan::new(&figurine_pair(&PairOptions { pixels: 60, ..PairOptions::default() }).source).unwrap();
        let config = PipelineConfig::default();
        let summary = ScanSummary::new(&scan, &config).unwrap();
        let collection = Collection::new(&[summary], &config).unwrap();
        let described = Arc::new(collection.describe(&scan, Variant::default()));
        let cache = Cache::new(2 * described.bytes());
        let was_made = |scan| {
            let mut made = false;
            let key = Key { scan, variant: Variant::default() };
            let entry = cache.get(key, || {
                made = true;
                Ok(Arc::clone(&described))
            });
            assert!(entry.is_ok());
            made
        };
        // The third scan evicts the second one, because the first was used since; the second one then evicts the third.
        assert_eq!([0, 1, 0, 2, 0, 1].map(was_made), [true, true, false, true, false, true]);
    }
}
