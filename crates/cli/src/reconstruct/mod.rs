//! The parts of `congruent reconstruct`: what the rows propose, what the surfaces say to it, and what is written.

mod files;
mod model;
mod outcome;
mod page;
mod proposals;
mod surfaces;
mod words;

pub(crate) use files::write;
pub(crate) use outcome::Outcome;
pub(crate) use proposals::proposals;
pub(crate) use surfaces::Surfaces;
