//! Registers two scan files with the library: `cargo run --release --example two_scans -- SOURCE TARGET`.
#![allow(clippy::print_stdout, reason = "a program that prints")]

use congruent_geometry::Scan;
use congruent_io::{read_scan, write_pose};
use congruent_pipeline::{PipelineConfig, Verdict, register};
use std::error::Error;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    let files: Vec<String> = std::env::args().skip(1).collect();
    let [source, target] = &files[..] else { return Err("usage: two_scans SOURCE TARGET".into()) };
    let scan = |file: &String| -> Result<Scan, Box<dyn Error>> { Ok(Scan::new(&read_scan(Path::new(file))?)?) };
    let found = register(&scan(source)?, &scan(target)?, &PipelineConfig::default());
    match (&found.verdict, found.pose()) {
        (Verdict::Ok, Some(pose)) => {
            println!("registered, with a confidence of {:.3}; see target_from_source.txt", found.confidence());
            write_pose(Path::new("target_from_source.txt"), pose)?;
        }
        (Verdict::Ambiguous(others), _) => println!("{} other poses fit nearly as well", others.len()),
        (Verdict::Failed(reason), _) => println!("not registered: {reason}"),
        (Verdict::Ok, None) => unreachable!("what is ok has a pose"),
    }
    Ok(())
}
