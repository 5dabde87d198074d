//! Turns the rows of a batch into the result of `congruent reconstruct`, and writes it.

mod files;
mod model;
mod outcome;
mod page;
mod rows;
mod words;

pub(crate) use files::write;
pub(crate) use outcome::{Outcome, Pairs};
pub(crate) use rows::registered;
