//! `congruent inspect`: what a scan file holds.

use super::{Loaded, load_vertices};
use crate::args::InspectArgs;
use crate::output;
use anyhow::Result;
use congruent_geometry::{NeighborIndex, resolution, samples_of_coarse_mesh};
use congruent_pipeline::count_strays;
use congruent_report::{decimals, digits};
use serde::Serialize;
use std::process::ExitCode;

/// The content of a scan file; lengths in data units.
#[derive(Serialize)]
struct Inspection {
    file: String,
    /// Number of points after cleaning.
    points: usize,
    triangles: usize,
    dropped_non_finite: usize,
    dropped_duplicates: usize,
    dropped_far: usize,
    /// Isolated and distant points, which would be left out with `strays = "dropped"`.
    strays: usize,
    extent: [f64; 3],
    /// Centre of the bounding box, file coordinates.
    centre: [f64; 3],
    /// Mean distance from a point to its nearest other point (`pr`).
    resolution: f64,
    resolution_standard_error: f64,
    /// Where normals come from.
    normals: &'static str,
}

pub(super) fn run(args: &InspectArgs) -> Result<ExitCode> {
    let loaded = load_vertices(&args.file)?;
    let inspection = inspect(&args.file.display().to_string(), &loaded);
    if let Some(samples) = samples_of_coarse_mesh(&loaded.raw) {
        let n = samples.points.len();
        output::remark(&format!("{}: a mesh of large triangles; align uses {n} points on them", args.file.display()));
    }
    if args.json {
        output::data(&serde_json::to_string_pretty(&inspection)?)?;
    } else {
        output::data(&inspection.text())?;
    }
    Ok(ExitCode::SUCCESS)
}

fn inspect(file: &str, loaded: &Loaded) -> Inspection {
    let scan = &loaded.scan;
    let resolution =
        resolution(scan.points(), &NeighborIndex::new(scan.points())).expect("a scan has three distinct points");
    Inspection {
        file: file.to_owned(),
        points: scan.points().len(),
        triangles: scan.triangles().len(),
        dropped_non_finite: scan.dropped().non_finite,
        dropped_duplicates: scan.dropped().duplicates,
        dropped_far: scan.dropped().far,
        strays: count_strays(scan),
        extent: scan.extent().into(),
        centre: (*scan.origin()).into(),
        resolution: resolution.mean,
        resolution_standard_error: resolution.standard_error,
        normals: match (scan.triangles().is_empty(), scan.normals()) {
            (false, _) => "from the mesh",
            (true, Some(_)) => "in the file",
            (true, None) => "none (estimated when needed)",
        },
    }
}

impl Inspection {
    fn text(&self) -> String {
        let shown = |x: f64| format!("{x:.0$}", decimals(self.resolution / 100.0));
        [
            self.file.clone(),
            format!("  points      {}", self.points),
            format!("  triangles   {}", self.triangles),
            format!(
                "  dropped     {} not finite, {} duplicates, {} implausibly far away",
                self.dropped_non_finite, self.dropped_duplicates, self.dropped_far
            ),
            format!("  strays      {}", self.strays),
            format!("  extent      {}", self.extent.map(shown).join(" x ")),
            format!("  centre      {}", self.centre.map(shown).join(", ")),
            format!("  resolution  {} (pr: mean distance to the nearest other point)", digits(self.resolution, 4)),
            format!("  normals     {}", self.normals),
        ]
        .join("\n")
    }
}
