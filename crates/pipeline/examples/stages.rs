//! Times every stage of the chain separately, for `scripts/peers`.
//!
//!     stages FOLDER [--scan SCAN] [--only NAME] [--rounds N]
//!
//! Prints one line per stage and round, `{"stage": …, "seconds": …, "cpu": …, "made": …}`; a first round is not
//! counted. With `--rounds 0` it writes the input of the stages to FOLDER as tables instead, so that other programs can
//! do the same work. Without SCAN a simulated scan is used.

#[path = "../benches/work/mod.rs"]
mod work;

use cpu_time::ProcessTime;
use std::error::Error;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;
use work::{Inputs, STAGES, Stage};

struct Arguments {
    folder: PathBuf,
    scan: Option<PathBuf>,
    only: Option<String>,
    rounds: usize,
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments = arguments()?;
    let inputs = Inputs::new(arguments.scan.as_deref(), &arguments.folder)?;
    if arguments.rounds == 0 {
        return write_tables(&inputs, &arguments.folder);
    }
    let mut out = std::io::stdout().lock();
    for stage in STAGES.iter().filter(|stage| arguments.only.as_ref().is_none_or(|name| name == stage.name)) {
        time(stage, &inputs, 1);
        for Spent { seconds, cpu, made } in time(stage, &inputs, arguments.rounds) {
            let line = serde_json::json!({"stage": stage.name, "seconds": seconds, "cpu": cpu, "made": made});
            writeln!(out, "{line}")?;
        }
    }
    Ok(())
}

/// The cost and the result of one round of a stage.
struct Spent {
    seconds: f64,
    /// CPU time of all threads, seconds: it remains comparable on a busy machine.
    cpu: f64,
    made: usize,
}

fn time(stage: &Stage, inputs: &Inputs, rounds: usize) -> Vec<Spent> {
    let once = |_| {
        let (start, cpu_start) = (Instant::now(), ProcessTime::now());
        let made = std::hint::black_box((stage.run)(inputs));
        Spent { seconds: start.elapsed().as_secs_f64(), cpu: cpu_start.elapsed().as_secs_f64(), made }
    };
    // On a thread of the pool, as in the program: getting there from another thread takes longer than the shortest
    // stages.
    rayon::scope(|_| (0..rounds).map(once).collect())
}

fn arguments() -> Result<Arguments, Box<dyn Error>> {
    let mut words = std::env::args().skip(1);
    let folder = words.next().ok_or("usage: stages FOLDER [--scan SCAN] [--only NAME] [--rounds N]")?.into();
    let mut arguments = Arguments { folder, scan: None, only: None, rounds: 3 };
    while let (Some(option), Some(value)) = (words.next(), words.next()) {
        match option.as_str() {
            "--scan" => arguments.scan = Some(value.into()),
            "--only" => arguments.only = Some(value),
            "--rounds" => arguments.rounds = value.parse()?,
            _ => return Err(format!("{option} is not an option; there are --scan, --only and --rounds").into()),
        }
    }
    Ok(arguments)
}

/// Writes the tables: little-endian, without headers; the README of `scripts/peers` lists them.
fn write_tables(inputs: &Inputs, folder: &Path) -> Result<(), Box<dyn Error>> {
    let floats = |name: &str, values: Vec<f32>| {
        std::fs::write(folder.join(name), values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>())
    };
    std::fs::write(folder.join("resolution.txt"), format!("{}\n", inputs.pr()))?;
    let keypoints: Vec<u8> = inputs.keypoints.iter().flat_map(|v| v.to_le_bytes()).collect();
    std::fs::write(folder.join("keypoints.u32"), keypoints)?;
    for (name, surface) in [
        ("points", &inputs.surface),
        ("thinned", &inputs.thinned),
        ("moving", &inputs.moving),
        ("fixed", &inputs.fixed),
    ] {
        floats(&format!("{name}.f32"), surface.points().as_flattened().to_vec())?;
        floats(&format!("{name}-normals.f32"), surface.normals().as_flattened().to_vec())?;
    }
    for (i, (long, short)) in inputs.long.iter().zip(&inputs.short).enumerate() {
        floats(&format!("long{i}.f32"), long.rows.clone())?;
        floats(&format!("short{i}.f32"), short.rows.clone())?;
    }
    let pairs = (0..inputs.evidence.len()).flat_map(|i| {
        let (p, q) = (inputs.evidence.source(i), inputs.evidence.target(i));
        [p.x, p.y, p.z, q.x, q.y, q.z].map(|v| v as f32)
    });
    floats("pairs.f32", pairs.collect())?;
    let poses = inputs.poses.iter().flat_map(|pose| pose.to_homogeneous().transpose().as_slice().to_vec());
    floats("poses.f32", poses.map(|v| v as f32).collect())?;
    Ok(())
}
