//! Lengths and limits.

/// Lengths in data units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Three poses around a triangle agree if they bring the probe points back to within this, on average; so do two poses
    /// that join the same two components.
    pub agreement: f64,
    /// A candidate whose surfaces the solved poses part by more than this (root mean square) is pruned.
    pub parting: f64,
    /// The same in the joint refinement, whose constraints are fresh.
    pub refined_parting: f64,
    /// Residuals of a pair count as no smaller than this, however well its scans seem to fit.
    pub noise_floor: f64,
    /// The joint refinement ends when no scan moves by more than this, on average …
    pub tolerance: f64,
    /// … or after so many rounds.
    pub rounds: usize,
    /// Doubtful pairs that must agree before two components are joined by them.
    pub witnesses: usize,
}

impl Settings {
    /// The usual multiples of the resolution.
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
