//! What the stage commands share: places of surface points, and files that belong together.

use crate::args::StageArgs;
use crate::output;
use anyhow::{Context, Result, bail};
use congruent_estimators::Hypothesis;
use congruent_geometry::{Neighbor, Point, Scan, Surface, narrow, uncentred, wide};
use congruent_io::{
    KeypointRow, MatchRow, Matrix, Place, PoseRow, keypoints_csv, matches_csv, places_csv, poses_csv, read_npy,
    read_places, write_file, write_npy,
};
use congruent_keypoints::Keypoint;
use congruent_pipeline::stages::{Prepared, prepare};
use congruent_pipeline::{Pair, PipelineConfig, Trace};
use nalgebra::Vector3;
use std::path::{Path, PathBuf};

/// One scan, ready for a stage.
pub(super) struct Single {
    pub(super) scan: Scan,
    pub(super) surface: Surface,
    pub(super) resolution: f64,
}

impl Single {
    /// Reads and prepares a scan; reports the length that `pr` stands for.
    pub(super) fn load(path: &Path, stage: &StageArgs, config: &PipelineConfig) -> Result<Single> {
        let scan = super::load(path)?.scan;
        let Prepared { mut surfaces, resolution, .. } =
            prepare(&[&scan], config, stage.resolution).with_context(|| path.display().to_string())?;
        let surface = surfaces.pop().expect("one scan in, one surface out");
        output::remark(&format!("{}: {} sampled points, 1pr = {resolution}u", path.display(), surface.len()));
        Ok(Single { scan, surface, resolution })
    }
}

/// Writes text to a file, or to stdout if none is named.
pub(super) fn put(output: Option<&Path>, text: &str) -> Result<()> {
    match output {
        Some(path) => write_file(path, text.as_bytes())?,
        None => output::data(text.trim_end())?,
    }
    Ok(())
}

/// Returns a surface point in file coordinates.
fn in_file(point: &Point, origin: &Vector3<f64>) -> [f64; 3] {
    (wide(*point) + origin).into()
}

/// Coordinates farther than this from the centre of the scan, data units, are a mistake; their squares could exceed the
/// range of `f32`.
const FARTHEST: f64 = 1e12;

/// Returns a place from a file as a centred point; `None` if it is absurdly far from the scan.
pub(super) fn centred(at: &[f64; 3], origin: &Vector3<f64>) -> Option<Point> {
    let offset = Vector3::from(*at) - origin;
    (offset.amax() <= FARTHEST).then(|| narrow(&offset))
}

fn place(surface: &Surface, index: u32, origin: &Vector3<f64>) -> Place {
    let i = index as usize;
    Place { at: in_file(&surface.points()[i], origin), normal: Some(surface.normals()[i]) }
}

pub(super) fn keypoint_rows(surface: &Surface, keypoints: &[Keypoint], origin: &Vector3<f64>) -> Vec<KeypointRow> {
    let at = |index: u32| in_file(&surface.points()[index as usize], origin);
    keypoints.iter().map(|k| KeypointRow { at: at(k.index), response: k.response, index: k.index }).collect()
}

/// Descriptors and the place of each row.
pub(super) struct Described {
    pub(super) matrix: Matrix,
    pub(super) places: Vec<Place>,
}

impl Described {
    pub(super) fn new(features: congruent_descriptors::Features, surface: &Surface, origin: &Vector3<f64>) -> Self {
        let places = features.keypoints.iter().map(|&index| place(surface, index, origin)).collect();
        let matrix = Matrix { rows: features.keypoints.len(), columns: features.dim, values: features.rows };
        Described { matrix, places }
    }

    pub(super) fn write(&self, path: &Path) -> Result<()> {
        write_file(&sibling(path)?, places_csv(&self.places).as_bytes())?;
        write_npy(path, &self.matrix)?;
        Ok(())
    }

    pub(super) fn read(path: &Path) -> Result<Described> {
        let beside = sibling(path)?;
        let matrix = read_npy(path)?;
        let places: Vec<Place> = read_places(&beside)?.into_iter().map(|(_, place)| place).collect();
        if places.len() != matrix.rows {
            bail!(
                "{}: has {} positions, but {} has {} rows; describe the scan again, or write one position per row",
                beside.display(),
                places.len(),
                path.display(),
                matrix.rows
            );
        }
        Ok(Described { matrix, places })
    }
}

/// Returns the file with the places of a matrix's rows: the same name with `.csv`.
pub(super) fn sibling(path: &Path) -> Result<PathBuf> {
    if path.extension().is_none_or(|extension| extension != "npy") {
        bail!(
            "{}: descriptors need a name that ends in .npy; the positions of the rows are beside it, in .csv",
            path.display()
        );
    }
    Ok(path.with_extension("csv"))
}

/// Places farther than this many resolutions from every sampled point belong to another scan.
const FARTHEST_PR: f64 = 4.0;

/// Returns the sampled points nearest to the places of a file, in the same order, each once.
pub(super) fn read_keypoints(path: &Path, single: &Single) -> Result<Vec<u32>> {
    let Single { scan, surface, resolution } = single;
    let mut taken = vec![false; surface.len()];
    let mut points = Vec::new();
    for (line, place) in read_places(path)? {
        let nearest = centred(&place.at, scan.origin()).and_then(|point| surface.index().nearest(&point));
        let is_near = |hit: &Neighbor| f64::from(hit.distance_sq).sqrt() < FARTHEST_PR * resolution;
        let Some(hit) = nearest.filter(is_near) else {
            bail!(
                "{}: line {line}: the keypoint {:?} is farther than {FARTHEST_PR} pr from every point of the scan; give \
                 the scan it was found on, in the same coordinates",
                path.display(),
                place.at
            );
        };
        if !std::mem::replace(&mut taken[hit.index as usize], true) {
            points.push(hit.index);
        }
    }
    Ok(points)
}

const MATCHES: &str = "matches.csv";
const POOL: &str = "pool.csv";

/// Returns where the keypoints and the descriptors of a scan are saved.
fn files_of_scan(directory: &Path, side: &str) -> [PathBuf; 2] {
    ["keypoints.csv", "features.npy"].map(|file| directory.join(format!("{side}-{file}")))
}

/// Returns the files that [`save`] writes.
pub(super) fn saved_files(directory: &Path) -> Result<Vec<PathBuf>> {
    let mut files = vec![directory.join(MATCHES), directory.join(POOL)];
    for side in ["source", "target"] {
        let [keypoints, features] = files_of_scan(directory, side);
        files.extend([keypoints, sibling(&features)?, features]);
    }
    Ok(files)
}

/// Writes what the stages produced, as files that the stage commands read. The directory must exist.
pub(super) fn save(directory: &Path, trace: Trace, scans: Pair<&Scan>) -> Result<()> {
    let Some(surfaces) = trace.surfaces else {
        output::remark(&format!("{}: nothing to write, because the scans could not be sampled", directory.display()));
        return Ok(());
    };
    let matches = match_rows(&trace.matches, &trace.features, &surfaces, &scans);
    let sides = [("source", scans.source), ("target", scans.target)];
    let of_each = surfaces.as_ref().zip(trace.keypoints.as_ref()).zip(trace.features);
    for ((side, scan), ((surface, keypoints), features)) in sides.into_iter().zip([of_each.source, of_each.target]) {
        let rows = keypoint_rows(surface, keypoints, scan.origin());
        let [keypoints_file, features_file] = files_of_scan(directory, side);
        put(Some(&keypoints_file), &keypoints_csv(&rows))?;
        Described::new(features, surface, scan.origin()).write(&features_file)?;
    }
    put(Some(&directory.join(MATCHES)), &matches_csv(&matches))?;
    put(Some(&directory.join(POOL)), &poses_csv(&pose_rows(&trace.pool, &scans)))
}

fn match_rows(
    matches: &[congruent_matching::Correspondence],
    features: &Pair<congruent_descriptors::Features>,
    surfaces: &Pair<Surface>,
    scans: &Pair<&Scan>,
) -> Vec<MatchRow> {
    let rows = features.as_ref().zip(surfaces.as_ref()).map(|(features, surface)| {
        let mut rows = vec![0u32; surface.len()];
        (0..).zip(&features.keypoints).for_each(|(row, &keypoint)| rows[keypoint as usize] = row);
        rows
    });
    let row = |m: &congruent_matching::Correspondence| MatchRow {
        source: place(&surfaces.source, m.source, scans.source.origin()),
        target: place(&surfaces.target, m.target, scans.target.origin()),
        source_row: rows.source[m.source as usize],
        target_row: rows.target[m.target as usize],
        distance: m.distance,
        score: m.score,
    };
    matches.iter().map(row).collect()
}

fn pose_rows(pool: &[Hypothesis], scans: &Pair<&Scan>) -> Vec<PoseRow> {
    let in_file = |h: &Hypothesis| uncentred(&h.target_from_source, scans.source.origin(), scans.target.origin());
    pool.iter().map(|h| PoseRow { score: h.score.value(), trial: h.trial, target_from_source: in_file(h) }).collect()
}
