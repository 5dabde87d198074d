//! `congruent simulate`: a data set with exact ground truth.

use crate::args::{SimulateArgs, SimulatedKind};
use crate::fingerprint::hash;
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
/// Exit code if there are fewer pairs than were asked for.
const TOO_FEW: u8 = 1;

pub(super) fn run(args: &SimulateArgs) -> Result<ExitCode> {
    if args.pairs == 0 {
        bail!("a data set without pairs is of no use; ask for more than 0 with --pairs");
    }
    let shapes = args.mesh.iter().map(|file| Shape::read(file)).collect::<Result<Vec<Shape>>>()?;
    let description = description(args, &shapes);
    check_directory(&args.directory, &description)?;
    let scans = args.directory.join("scans");
    std::fs::create_dir_all(&scans).with_context(|| format!("{}: cannot be created", scans.display()))?;
    let meshes = shapes.into_iter().map(|shape| shape.mesh).collect();
    let benchmark = Benchmark::of_shapes(args.kind.into(), args.seed, meshes);
    let (lines, n_scans) = scanned(&benchmark, args.pairs, &scans)?;
    if lines.is_empty() {
        bail!(
            "no two scans share anything in {FRUITLESS_GROUPS} groups of scans; give meshes whose faces have an area"
        );
    }
    write_file(&args.directory.join(PAIRS), pairs_csv(&lines).as_bytes())?;
    write_file(&args.directory.join(DESCRIPTION), description.as_bytes())?;
    let (shown, n_pairs) = (args.directory.display(), lines.len());
    output::remark(&format!(
        "Wrote {n_pairs} pairs of {n_scans} scans into {shown}.\nNext: congruent evaluate {shown} -o evaluation"
    ));
    if n_pairs < args.pairs {
        output::remark(&format!(
            "warning: {n_pairs} pairs instead of {}: {FRUITLESS_GROUPS} further groups of scans had none",
            args.pairs
        ));
        return Ok(ExitCode::from(TOO_FEW));
    }
    Ok(ExitCode::SUCCESS)
}

/// Writes scans until there are enough pairs, or no more are expected. Returns the pairs and the number of scans.
fn scanned(benchmark: &Benchmark, wanted: usize, folder: &Path) -> Result<(Vec<PairLine>, usize)> {
    let bar = Bar::new(wanted as u64);
    let (mut lines, mut written, mut last_fruitful) = (Vec::new(), HashSet::new(), 0);
    for number in 0.. {
        if lines.len() >= wanted || number - last_fruitful > FRUITLESS_GROUPS {
            break;
        }
        let before = lines.len();
        add(&benchmark.group(number), wanted, folder, &mut lines, &mut written)?;
        if lines.len() > before {
            last_fruitful = number;
        }
        bar.at(lines.len() as u64, "");
    }
    Ok((lines, written.len()))
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

/// A surface to scan.
struct Shape {
    /// Of its file, without the folder.
    name: String,
    mesh: Mesh,
}

impl Shape {
    fn read(file: &Path) -> Result<Shape> {
        let raw = read_scan(file)?;
        if raw.triangles.is_empty() {
            bail!("{}: has no faces, so there is no surface to scan; give a triangle mesh", file.display());
        }
        if raw.points.iter().flatten().any(|v| !v.is_finite()) {
            bail!("{}: has vertices that are not finite; remove them", file.display());
        }
        let mesh = Mesh { points: raw.points.to_vec(), triangles: raw.triangles };
        if mesh.bounding_sphere().1 == 0.0 {
            bail!("{}: all vertices coincide; give a mesh with an extent", file.display());
        }
        let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
        Ok(Shape { name, mesh })
    }

    /// Returns a hash of the vertices and faces.
    fn content(&self) -> u64 {
        let points = self.mesh.points.iter().flatten().map(|v| v.to_bits());
        hash(points.chain(self.mesh.triangles.iter().flatten().map(|corner| u64::from(*corner))))
    }
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

/// Returns the `dataset.toml`. It has all that the data depend on, so that another one belongs to other data.
fn description(args: &SimulateArgs, shapes: &[Shape]) -> String {
    let kind = args.kind.name();
    let quoted = |text: String| toml::Value::String(text).to_string();
    // A name may contain anything, even a line break.
    let options: String = shapes.iter().map(|shape| format!(" --mesh {}", shape.name.escape_debug())).collect();
    let contents: String = shapes
        .iter()
        .map(|shape| format!("# {}: hash of vertices and faces {:016x}\n", shape.name.escape_debug(), shape.content()))
        .collect();
    let names: Vec<&str> = shapes.iter().map(|shape| shape.name.as_str()).collect();
    let subject = if names.is_empty() { "figurines".to_owned() } else { names.join(", ") };
    format!(
        "# Made by `congruent simulate {kind} DIR --pairs {} --seed {}{options}`; the truth is exact.\n{contents}name = \"{kind}\"\nabout = {}\nunit = \"hundredths of the object's longest side\"\nlicence = {}\nsource = \"congruent simulate\"\nscans = \"scans\"\n\n[truth]\nformat = \"pairs-csv\"\npath = \"pairs.csv\"\n",
        args.pairs,
        args.seed,
        quoted(args.kind.about(&subject)),
        quoted(if shapes.is_empty() { "CC0-1.0" } else { "that of the meshes" }.to_owned()),
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

    /// Returns what the data set shows; `subject` is what was scanned.
    fn about(self, subject: &str) -> String {
        match self {
            SimulatedKind::U3m => format!("laser scans of {subject} from all around"),
            SimulatedKind::Bmr => {
                format!("depth camera images of {subject}: noise that grows with range, steps, holes")
            }
            SimulatedKind::U3or => format!("whole {subject} in laser scans of several on a table"),
            SimulatedKind::Bod5 => format!("depth camera images of {subject} in images of several on a table"),
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
