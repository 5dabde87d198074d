//! Lengths and limits of a reconstruction.

/// Settings; lengths are in data units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Three poses around a triangle agree if they bring the probe points back to within this, on average; so do two
    /// poses that join the same two components.
    pub agreement: f64,
    /// A candidate is pruned if the solved poses separate its surfaces by more than this (root mean square).
    pub parting: f64,
    /// The same bound in the joint refinement, whose constraints are fresh.
    pub refined_parting: f64,
    /// Lower bound of the residual of a pair, however well its scans seem to fit.
    pub noise_floor: f64,
    /// The joint refinement ends when no scan moves by more than this, on average …
    pub tolerance: f64,
    /// … or after this many rounds.
    pub rounds: usize,
    /// Number of doubtful pairs that must agree before two components are joined by them.
    pub witnesses: usize,
}

impl Settings {
    /// Returns the usual multiples of the resolution.
    #[must_use]
    pub fn new(resolution: f64) -> Settings {
        Settings {
            agreement: 10.0 * resolution,
            parting: 4.0 * resolution,
            refined_parting: 1.5 * resolution,
            noise_floor: 0.1 * resolution,
            tolerance: 0.01 * resolution,
            rounds: 12,
            witnesses: 2,
        }
    }
}
