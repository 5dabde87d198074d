//! `congruent simulate`: a data set with exact ground truth.

use crate::args::{SimulateArgs, SimulatedKind};
use crate::output;
use crate::progress::Bar;
use anyhow::{Context, Result, bail};
use congruent_io::{PairLine, pairs_csv, read_scan, write_file, write_ply};
use congruent_simulation::Mesh;
use congruent_simulation::benchmark::{Benchmark, Group, Kind};
use std::collections::HashSet;
use std::path::Path;
use std::process::ExitCode;

const PAIRS: &str = "pairs.csv";
const DESCRIPTION: &str = "dataset.toml";
/// After this many consecutive groups without a pair, none is expected any more.
const FRUITLESS_GROUPS: u64 = 20;

pub(super) fn run(args: &SimulateArgs) -> Result<ExitCode> {
    check_directory(&args.directory, &description(args))?;
    let meshes = args.mesh.iter().map(|file| mesh(file)).collect::<Result<Vec<Mesh>>>()?;
    let scans = args.directory.join("scans");
    std::fs::create_dir_all(&scans).with_context(|| format!("{}: cannot be created", scans.display()))?;
    let benchmark = Benchmark::of_shapes(args.kind.into(), args.seed, meshes);
    let bar = Bar::new(args.pairs as u64);
    let (mut lines, mut written, mut last_fruitful) = (Vec::new(), HashSet::new(), 0);
    for number in 0.. {
        if lines.len() >= args.pairs || number - last_fruitful > FRUITLESS_GROUPS {
            break;
        }
        let group = benchmark.group(number);
        let before = lines.len();
        add(&group, args.pairs, &scans, &mut lines, &mut written)?;
        if lines.len() > before {
            last_fruitful = number;
        }
        bar.at(lines.len() as u64, "");
    }
    write_file(&args.directory.join(PAIRS), pairs_csv(&lines).as_bytes())?;
    write_file(&args.directory.join(DESCRIPTION), description(args).as_bytes())?;
    output::remark(&format!(
        "Wrote {} pairs of {} scans into {}.\nNext: congruent evaluate {} -o evaluation",
        lines.len(),
        written.len(),
        args.directory.display(),
        args.directory.display()
    ));
    Ok(ExitCode::SUCCESS)
}

/// Refuses a directory that holds another data set: its list would be replaced, and its scans would remain among the
/// new ones.
fn check_directory(directory: &Path, description: &str) -> Result<()> {
    let held = std::fs::read_to_string(directory.join(DESCRIPTION)).ok();
    if held.as_deref() == Some(description) || (held.is_none() && !directory.join(PAIRS).exists()) {
        return Ok(());
    }
    bail!("{}: contains another data set; choose another directory, or remove it", directory.display());
}

/// Reads a surface to scan.
fn mesh(file: &Path) -> Result<Mesh> {
    let raw = read_scan(file)?;
    if raw.triangles.is_empty() {
        bail!("{}: has no faces, so there is no surface to scan; give a triangle mesh", file.display());
    }
    if raw.points.iter().flatten().any(|v| !v.is_finite()) {
        bail!("{}: has vertices that are not finite; remove them", file.display());
    }
    let mesh = Mesh { points: raw.points, triangles: raw.triangles };
    if mesh.bounding_sphere().1 == 0.0 {
        bail!("{}: all vertices coincide; give a mesh with an extent", file.display());
    }
    Ok(mesh)
}

/// Writes the scans that the wanted pairs need, each once.
fn add(
    group: &Group,
    wanted: usize,
    folder: &Path,
    lines: &mut Vec<PairLine>,
    written: &mut HashSet<String>,
) -> Result<()> {
    for pair in group.pairs.iter().take(wanted - lines.len()) {
        let [source, target] = [pair.source, pair.target].map(|i| &group.scans[i]);
        for (name, scan) in [source, target] {
            if written.insert(name.clone()) {
                write_ply(&folder.join(name), &scan.points, None, &[])?;
            }
        }
        lines.push(PairLine {
            source: source.0.clone(),
            target: target.0.clone(),
            overlap: pair.overlap,
            target_from_source: pair.target_from_source,
        });
    }
    Ok(())
}

fn description(args: &SimulateArgs) -> String {
    let kind = args.kind.name();
    format!(
        "# Made by `congruent simulate {kind} DIR --pairs {} --seed {}`; the truth is exact.\nname = \"{kind}\"\nabout = \"{}\"\nunit = \"hundredths of the object's longest side\"\nlicence = \"CC0-1.0\"\nsource = \"congruent simulate\"\nscans = \"scans\"\n\n[truth]\nformat = \"pairs-csv\"\npath = \"pairs.csv\"\n",
        args.pairs,
        args.seed,
        args.kind.about()
    )
}

impl SimulatedKind {
    fn name(self) -> &'static str {
        match self {
            SimulatedKind::U3m => "u3m-like",
            SimulatedKind::Bmr => "bmr-like",
            SimulatedKind::U3or => "u3or-like",
            SimulatedKind::Bod5 => "bod5-like",
        }
    }

    fn about(self) -> &'static str {
        match self {
            SimulatedKind::U3m => "laser scans of figurines from all around",
            SimulatedKind::Bmr => "depth camera images of figurines: noise that grows with range, steps, holes",
            SimulatedKind::U3or => "whole figurines in laser scans of several on a table",
            SimulatedKind::Bod5 => "depth camera images of figurines in images of several on a table",
        }
    }
}

impl From<SimulatedKind> for Kind {
    fn from(kind: SimulatedKind) -> Kind {
        match kind {
            SimulatedKind::U3m => Kind::U3m,
            SimulatedKind::Bmr => Kind::Bmr,
            SimulatedKind::U3or => Kind::U3or,
            SimulatedKind::Bod5 => Kind::Bod5,
        }
    }
}
