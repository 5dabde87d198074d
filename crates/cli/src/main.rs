//! The program `congruent`: registers raw 3D scans.
//!
//! Exit codes: 0 success; 1 the pair could not be registered (the verdict says why) or, in commands for many pairs or
//! scans, some of them have no result; 2 bad input or configuration; 130 a batch was interrupted. Results go to stdout,
//! everything else to stderr.

mod args;
mod batch;
mod calibration;
mod commands;
mod configuration;
mod evaluation_rows;
mod fingerprint;
mod guess;
mod journal;
mod layers;
mod output;
mod outputs;
mod progress;
mod reasons;
mod reconstruct;
mod result;

use clap::Parser;
use std::process::ExitCode;

/// Bad input, bad configuration, or a file that could not be written.
const UNUSABLE: u8 = 2;

fn main() -> ExitCode {
    match commands::run(args::Args::parse()) {
        Ok(code) => code,
        Err(error) => {
            output::complain(&format!("{error:#}"));
            ExitCode::from(UNUSABLE)
        }
    }
}
