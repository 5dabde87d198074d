//! The work that the benchmark and the comparison with other libraries time: one function per stage, on one scan.

mod inputs;
mod stages;

pub(crate) use inputs::Inputs;
pub(crate) use stages::{STAGES, Stage};
