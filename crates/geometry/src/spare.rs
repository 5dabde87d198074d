//! Workspaces for loops on several threads, reused instead of created anew.

use std::sync::{Mutex, PoisonError};

/// Workspaces that are not in use; their number grows to that of the threads that work at a time. A workspace holds
/// what its last user left in it.
///
/// An initial value for each piece of a loop would be created as often as the loop is split, and memory that threads
/// allocate and free in turn makes them wait for each other.
#[derive(Default)]
pub struct Spare<P>(Mutex<Vec<P>>);

impl<P: Default> Spare<P> {
    /// Lends a workspace to `work`.
    pub fn with<T>(&self, work: impl FnOnce(&mut P) -> T) -> T {
        let mut place = self.lock().pop().unwrap_or_default();
        let made = work(&mut place);
        self.lock().push(place);
        made
    }

    /// Locks the list; nothing that is done meanwhile could leave it half changed.
    fn lock(&self) -> std::sync::MutexGuard<'_, Vec<P>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_after_the_other_works_in_the_same_place_and_one_within_in_another() {
        let spare = Spare::<Vec<u8>>::default();
        spare.with(|outer| {
            outer.push(1);
            spare.with(|inner| assert!(inner.is_empty()));
        });
        assert_eq!(spare.with(|again| again.clone()), [1]);
    }
}
