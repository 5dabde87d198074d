//! Registers pairs of scans in one process, from files to pose, for `scripts/peers`.
//!
//!     register ROUNDS SOURCE TARGET [SOURCE TARGET …]
//!
//! Registers with the default settings and prints one line per pair and round,
//! `{"pair": …, "seconds": …, "target_from_source": …}`; a first round is not counted.

use congruent_geometry::{Scan, to_rows};
use congruent_io::read_scan;
use congruent_pipeline::{PipelineConfig, Registration, register};
use std::error::Error;
use std::io::Write;
use std::path::Path;
use std::time::Instant;

fn main() -> Result<(), Box<dyn Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let usage = "usage: register ROUNDS SOURCE TARGET [SOURCE TARGET …]";
    let (rounds, files) = words.split_first().ok_or(usage)?;
    let rounds: usize = rounds.parse().map_err(|_| usage)?;
    let mut out = std::io::stdout().lock();
    for (pair, [source, target]) in files.as_chunks().0.iter().enumerate() {
        for round in 0..=rounds {
            let start = Instant::now();
            let found = registered(Path::new(source), Path::new(target))?;
            let seconds = start.elapsed().as_secs_f64();
            if round > 0 {
                let pose = found.pose().map(to_rows);
                let line = serde_json::json!({"pair": pair, "seconds": seconds, "target_from_source": pose});
                writeln!(out, "{line}")?;
            }
        }
    }
    Ok(())
}

fn registered(source: &Path, target: &Path) -> Result<Registration, Box<dyn Error>> {
    let (source, target) = (Scan::new(&read_scan(source)?)?, Scan::new(&read_scan(target)?)?);
    Ok(register(&source, &target, &PipelineConfig::default()))
}
