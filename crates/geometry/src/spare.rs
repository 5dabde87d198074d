//! What loops on several threads work in, used again instead of made anew.

use std::sync::{Mutex, PoisonError};

/// Places to work in that nobody is using; there come to be as many as threads work at a time. What is left in one is
/// what the last user left there.
///
/// An initial value for each piece of a loop would be made as often as the loop is cut, and memory that threads take and
/// give back in turn makes them wait for each other.
#[derive(Default)]
pub struct Spare<P>(Mutex<Vec<P>>);

impl<P: Default> Spare<P> {
    /// Lends one to `work`.
    pub fn with<T>(&self, work: impl FnOnce(&mut P) -> T) -> T {
        let mut place = self.lock().pop().unwrap_or_default();
        let made = work(&mut place);
        self.lock().push(place);
        made
    }

    /// Nothing is done while it is held that could leave the list half changed.
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
