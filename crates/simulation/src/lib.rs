//! A virtual range scanner, built-in shapes and nuisances: scans with known truth.
