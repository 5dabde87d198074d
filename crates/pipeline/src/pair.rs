//! A pair of values: one for the source and one for the target.

use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// One value for each scan; in files, a list of the two, the source's first.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pair<T> {
    /// The value of the source.
    pub source: T,
    /// The value of the target.
    pub target: T,
}

impl<T> Pair<T> {
    /// Applies a function to the source, then to the target.
    pub fn map<U>(self, mut of: impl FnMut(T) -> U) -> Pair<U> {
        Pair { source: of(self.source), target: of(self.target) }
    }

    /// Applies a function to both in parallel, on rayon's current thread pool.
    pub fn par_map<U: Send>(self, work: impl Fn(T) -> U + Sync) -> Pair<U>
    where
        T: Send,
    {
        let Pair { source, target } = self;
        let (source, target) = rayon::join(|| work(source), || work(target));
        Pair { source, target }
    }

    /// Makes a pair of a list of two: source, then target.
    ///
    /// # Panics
    /// If the list has any other length.
    #[must_use]
    pub fn of_two(list: Vec<T>) -> Pair<T> {
        let [source, target]: [T; 2] = list.try_into().ok().expect("a list of two");
        Pair { source, target }
    }

    /// Returns a pair of references.
    pub fn as_ref(&self) -> Pair<&T> {
        Pair { source: &self.source, target: &self.target }
    }

    /// Combines two pairs into a pair of tuples.
    pub fn zip<U>(self, other: Pair<U>) -> Pair<(T, U)> {
        Pair { source: (self.source, other.source), target: (self.target, other.target) }
    }
}

impl<T, U> Pair<(T, U)> {
    /// Splits a pair of tuples into two pairs.
    pub fn unzip(self) -> (Pair<T>, Pair<U>) {
        let ((a, b), (c, d)) = (self.source, self.target);
        (Pair { source: a, target: c }, Pair { source: b, target: d })
    }
}

impl<T, E> Pair<Result<T, E>> {
    /// Returns both values, or the first error.
    ///
    /// # Errors
    /// The source's error, else the target's.
    pub fn both(self) -> Result<Pair<T>, E> {
        Ok(Pair { source: self.source?, target: self.target? })
    }
}

impl<T: Serialize> Serialize for Pair<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        (&self.source, &self.target).serialize(serializer)
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Pair<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let (source, target) = Deserialize::deserialize(deserializer)?;
        Ok(Pair { source, target })
    }
}
