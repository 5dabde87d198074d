//! Registers two scan files with the library: `cargo run --release --example two_scans -- SOURCE TARGET`.
#![allow(clippy::print_stdout, reason = "a program that prints")]

use congruent_geometry::Scan;
use congruent_io::{read_scan, write_pose};
use congruent_pipeline::{Outcome, PipelineConfig, register};
use std::error::Error;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    let files: Vec<String> = std::env::args().skip(1).collect();
    let [source, target] = &files[..] else { return Err("usage: two_scans SOURCE TARGET".into()) };
    let scan = |file: &String| -> Result<Scan, Box<dyn Error>> { Ok(Scan::new(&read_scan(Path::new(file))?)?) };
    let found = register(&scan(source)?, &scan(target)?, &PipelineConfig::default());
    match &found.outcome {
        Outcome::Ok(estimate) => {
            println!("registered, with a confidence of {:.3}; see target_from_source.txt", estimate.confidence);
            write_pose(Path::new("target_from_source.txt"), &estimate.target_from_source)?;
        }
        Outcome::Ambiguous(_, others) => println!("{} other poses fit nearly as well", others.len()),
        Outcome::Failed(reason, _) => println!("not registered: {reason}"),
    }
    Ok(())
}
