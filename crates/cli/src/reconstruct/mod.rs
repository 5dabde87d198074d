//! What `congruent reconstruct` makes of the rows of a batch, and what it writes.

mod files;
mod model;
mod outcome;
mod page;
mod rows;
mod words;

pub(crate) use files::write;
pub(crate) use outcome::{Outcome, Pairs};
pub(crate) use rows::registered;
