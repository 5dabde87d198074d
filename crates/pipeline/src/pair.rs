//! Two of a kind: what belongs to the source and what belongs to the target.

/// One thing for each scan.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pair<T> {
    /// The source's.
    pub source: T,
    /// The target's.
    pub target: T,
}

impl<T> Pair<T> {
    /// The same for both.
    pub fn map<U>(self, mut of: impl FnMut(T) -> U) -> Pair<U> {
        Pair { source: of(self.source), target: of(self.target) }
    }

    /// The same work for both scans, side by side where there are threads.
    pub fn par_map<U: Send>(self, work: impl Fn(T) -> U + Sync) -> Pair<U>
    where
        T: Send,
    {
        let Pair { source, target } = self;
        let (source, target) = rayon::join(|| work(source), || work(target));
        Pair { source, target }
    }

    /// The two that a list holds.
    ///
    /// # Panics
    /// For a list of any other length.
    #[must_use]
    pub fn of_two(list: Vec<T>) -> Pair<T> {
        let [source, target]: [T; 2] = list.try_into().ok().expect("a list of two");
        Pair { source, target }
    }

    /// Both by reference.
    pub fn as_ref(&self) -> Pair<&T> {
        Pair { source: &self.source, target: &self.target }
    }

    /// One pair of two.
    pub fn zip<U>(self, other: Pair<U>) -> Pair<(T, U)> {
        Pair { source: (self.source, other.source), target: (self.target, other.target) }
    }
}

impl<T, U> Pair<(T, U)> {
    /// Two pairs of one.
    pub fn unzip(self) -> (Pair<T>, Pair<U>) {
        let ((a, b), (c, d)) = (self.source, self.target);
        (Pair { source: a, target: c }, Pair { source: b, target: d })
    }
}

impl<T, E> Pair<Result<T, E>> {
    /// Both results, or the first error.
    ///
    /// # Errors
    /// The source's error, else the target's.
    pub fn both(self) -> Result<Pair<T>, E> {
        Ok(Pair { source: self.source?, target: self.target? })
    }
}
