//! A virtual range scanner, built-in shapes and nuisances: scans with known ground truth.
//!
//! A [`Mesh`] from [`shapes`] is scanned by a [`scanner::VirtualScanner`]; two such scans make a [`pair::ScanPair`],
//! whose true motion is known exactly. [`nuisances`] degrade scans by measured amounts, and [`correspondences`]
//! generates matched point pairs without any scan. [`ambiguous`] has pairs of scans that no program can register with
//! certainty, and [`testing`] has small surfaces for tests. Everything random takes a seed, and the same seed gives the
//! same result on any number of threads.

pub mod ambiguous;
pub mod benchmark;
pub mod correspondences;
mod mesh;
pub mod nuisances;
pub mod pair;
pub mod scanner;
pub mod shapes;
pub mod testing;

pub use mesh::Mesh;
