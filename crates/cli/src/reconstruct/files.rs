//! Writes the files of the output folder.

use super::model;
use super::outcome::{Outcome, ScanLine};
use super::page::page;
use crate::args::ReconstructArgs;
use crate::batch::Ended;
use anyhow::{Context, Result};
use congruent_geometry::{RigidTransform, to_rows};
use congruent_io::{csv_line, write_file, write_pose};
use congruent_multiway::Edge;
use congruent_reconstruction::Surfaces;
use nalgebra::{Matrix6, Vector3};
use std::fmt::Write;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

const POSES: &str = "poses.csv";
const GRAPH: &str = "graph.g2o";
const PAGE: &str = "report.html";

/// Writes everything except the rows, which are already there. What an earlier result leaves without a meaning is
/// removed.
pub(crate) fn write(args: &ReconstructArgs, ended: &Ended<'_>, outcome: &Outcome, surfaces: &Surfaces) -> Result<()> {
    let folder = &args.output;
    let names = pose_names(&outcome.scans);
    if folder.join(POSES).exists() {
        remove(folder, &outdated(&outcome.scans, &names, outcome.components.len()))?;
    }
    write_file(&folder.join(POSES), poses_csv(&outcome.scans).as_bytes())?;
    for (scan, name) in outcome.scans.iter().zip(&names) {
        if let Some(pose) = &scan.frame_from_file {
            write_pose(&folder.join(name), pose)?;
        }
    }
    write_file(&folder.join(PAGE), page(outcome, surfaces).html().as_bytes())?;
    write_file(&folder.join(GRAPH), g2o(ended, outcome).as_bytes())?;
    for number in 1..=outcome.components.len() {
        let scans: Vec<(usize, PathBuf, RigidTransform)> = outcome
            .scans
            .iter()
            .enumerate()
            .filter(|(_, scan)| scan.component == Some(number))
            .filter_map(|(at, scan)| Some((at, ended.input.scans[at].path.clone(), scan.frame_from_file?)))
            .collect();
        model::write(&folder.join(model_name(number)), &scans, ended.input.reading, args.voxel)?;
    }
    Ok(())
}

/// Returns the name of the cloud of a component, which is counted from one.
fn model_name(component: usize) -> String {
    format!("model-{component}.ply")
}

/// Returns the names of the files that an earlier result may have written and this one does not: poses of scans that
/// have none now, and models beyond the last component.
fn outdated(scans: &[ScanLine], names: &[String], n_components: usize) -> Vec<String> {
    let without_pose = scans.iter().zip(names).filter(|(scan, _)| scan.frame_from_file.is_none());
    // A component has at least two scans.
    let models = (n_components + 1..=scans.len() / 2).map(model_name);
    without_pose.map(|(_, name)| name.clone()).chain(models).collect()
}

/// Removes files, as far as they exist.
fn remove(folder: &Path, names: &[String]) -> Result<()> {
    for path in names.iter().map(|name| folder.join(name)) {
        match std::fs::remove_file(&path) {
            Err(error) if error.kind() != ErrorKind::NotFound => {
                return Err(error).with_context(|| {
                    format!("{}: belongs to an earlier result and cannot be removed; remove it", path.display())
                });
            }
            _ => {}
        }
    }
    Ok(())
}

/// Returns one line per scan; for a scan without a place, component, pose and uncertainty are empty.
fn poses_csv(scans: &[ScanLine]) -> String {
    let matrix: Vec<String> = (0..16).map(|i| format!("m{}{}", i / 4, i % 4)).collect();
    let mut text = format!("scan,component,{},uncertainty,touches,overlap,problem\n", matrix.join(","));
    for scan in scans {
        let mut fields = vec![scan.scan.clone(), scan.component.map_or_else(String::new, |number| number.to_string())];
        match &scan.frame_from_file {
            Some(pose) => fields.extend(to_rows(pose).as_flattened().iter().map(|v| format!("{v:?}"))),
            None => fields.extend(std::iter::repeat_n(String::new(), 16)),
        }
        fields
            .push(scan.uncertainty.filter(|_| scan.component.is_some()).map_or_else(String::new, |v| format!("{v:?}")));
        fields.extend([scan.touches.to_string(), format!("{:?}", scan.overlap)]);
        fields.push(scan.problem.clone().unwrap_or_default());
        text += &(csv_line(fields) + "\n");
    }
    text
}

/// Returns the name of each scan's pose file in the output folder: the stem of the scan's name; its whole name, with
/// path separators replaced by `_`, if several scans have the same stem; preceded by the scan's number if that name is
/// taken, too.
fn pose_names(scans: &[ScanLine]) -> Vec<String> {
    let stem = |scan: &ScanLine| -> String {
        let name = Path::new(&scan.scan).file_stem().unwrap_or_default();
        name.to_string_lossy().into_owned()
    };
    let stems: Vec<String> = scans.iter().map(stem).collect();
    let is_shared = |stem: &String| stems.iter().filter(|other| *other == stem).count() > 1;
    let within = |name: &str| name.replace(['/', '\\', ':'], "_");
    let mut names: Vec<String> = Vec::new();
    for (number, (scan, stem)) in (1..).zip(scans.iter().zip(&stems)) {
        let name = within(if is_shared(stem) { &scan.scan } else { stem }) + ".xf";
        names.push(if names.contains(&name) { format!("{number}-{name}") } else { name });
    }
    names
}

/// Returns the graph for other solvers: one vertex per placed scan (numbered as in poses.csv, from zero), and one edge
/// per contact.
///
/// An edge `i j` holds `i_from_j`. Its information is for the translation and the vector part of the error's
/// quaternion, which is half of the rotation vector, in the frame of `j`: `Z⁻¹ X_i⁻¹ X_j`.
fn g2o(ended: &Ended<'_>, outcome: &Outcome) -> String {
    let mut text = String::new();
    for (at, scan) in outcome.scans.iter().enumerate() {
        if let Some(pose) = &scan.frame_from_file {
            writeln!(text, "VERTEX_SE3:QUAT {at} {}", seven(pose)).expect("strings take everything");
        }
    }
    for (edge, _) in &outcome.edges {
        let (source, target) = (origin(ended, edge.source), origin(ended, edge.target));
        let pose = congruent_geometry::uncentred(&edge.target_from_source, &source, &target);
        let upper = upper_triangle(&in_g2o_order(edge, &source)).join(" ");
        writeln!(text, "EDGE_SE3:QUAT {} {} {} {upper}", edge.target, edge.source, seven(&pose))
            .expect("strings take everything");
    }
    text
}

fn origin(ended: &Ended<'_>, at: usize) -> Vector3<f64> {
    ended.survey.scans[at].as_ref().map_or_else(|_| Vector3::zeros(), |scan| scan.centre)
}

/// Returns the translation, then the quaternion as x y z w.
fn seven(pose: &RigidTransform) -> String {
    let (t, q) = (pose.translation.vector, pose.rotation.coords);
    [t.x, t.y, t.z, q.x, q.y, q.z, q.w].map(|v| format!("{v:?}")).join(" ")
}

/// Returns the information of an edge with translation before rotation, for the source in its file's coordinates.
fn in_g2o_order(edge: &Edge, source_origin: &Vector3<f64>) -> Matrix6<f64> {
    let centred_from_file = RigidTransform::from_parts((-source_origin).into(), nalgebra::UnitQuaternion::identity());
    let ours = edge.information_in_source(&centred_from_file);
    // A rotation vector is twice the quaternion's vector part.
    let scale = |i: usize| if i < 3 { 1.0 } else { 2.0 };
    let other = |i: usize| (i + 3) % 6;
    Matrix6::from_fn(|i, j| scale(i) * scale(j) * ours[(other(i), other(j))])
}

fn upper_triangle(matrix: &Matrix6<f64>) -> Vec<String> {
    (0..6).flat_map(|i| (i..6).map(move |j| (i, j))).map(|(i, j)| format!("{:?}", matrix[(i, j)])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use congruent_geometry::random::Stream;
    use nalgebra::Vector6;

    /// Our error and that of g2o must give the same cost, for file coordinates far from the origin.
    #[test]
    fn g2o_sees_the_same_cost() {
        let mut stream = Stream::new(4, 0);
        let mut motion = |size: f64| {
            let v = Vector6::from_fn(|_, _| stream.between(-size, size));
            RigidTransform::new(v.fixed_rows::<3>(0).into(), v.fixed_rows::<3>(3).into())
        };
        let (measured, off, target_pose) = (motion(1.5), motion(1e-7), motion(2.0));
        let information = Matrix6::from_fn(|i, j| if i == j { 3.0 + i as f64 } else { 0.2 * (i + j) as f64 });
        let edge = Edge { source: 0, target: 1, target_from_source: measured, information };
        let poses = [target_pose * off * measured, target_pose];
        let origins = [Vector3::new(500.0, -300.0, 20.0), Vector3::new(-70.0, 10.0, 900.0)];
        let file =
            |pose: &RigidTransform, at: usize| congruent_geometry::uncentred(pose, &origins[at], &Vector3::zeros());
        let z = congruent_geometry::uncentred(&measured, &origins[0], &origins[1]);
        let error = z.inverse() * file(&poses[1], 1).inverse() * file(&poses[0], 0);
        let (t, q) = (error.translation.vector, error.rotation.imag());
        let vector = Vector6::new(t.x, t.y, t.z, q.x, q.y, q.z);
        let theirs = vector.dot(&(in_g2o_order(&edge, &origins[0]) * vector));
        let ours = edge.cost(&poses);
        assert!((theirs - ours).abs() < 1e-3 * ours, "{theirs} {ours}");
    }

    fn scan(name: &str) -> ScanLine {
        ScanLine {
            scan: name.to_owned(),
            component: None,
            frame_from_scan: None,
            uncertainty: None,
            touches: 0,
            overlap: 0.0,
            problem: Some("broken, quite".to_owned()),
            frame_from_file: None,
        }
    }

    #[test]
    fn only_what_an_earlier_result_wrote_is_removed() {
        let placed = |name| ScanLine { frame_from_file: Some(RigidTransform::identity()), ..scan(name) };
        let scans = [placed("a.ply"), placed("b.ply"), scan("c.ply"), scan("d.ply"), scan("e.ply")];
        let folder = tempfile::tempdir().unwrap();
        let (stay, go) = (["a.xf", "b.xf", "f.xf", "model-1.ply", "model-3.ply"], ["c.xf", "e.xf", "model-2.ply"]);
        stay.iter().chain(&go).for_each(|name| std::fs::write(folder.path().join(name), "").unwrap());
        remove(folder.path(), &outdated(&scans, &pose_names(&scans), 1)).unwrap();
        let exists = |name: &&str| folder.path().join(name).exists();
        assert!(stay.iter().all(exists) && !go.iter().any(exists));
    }

    #[test]
    fn scans_of_one_name_keep_their_endings() {
        let scans = [scan("a.ply"), scan("b.ply"), scan("a.obj")];
        assert_eq!(pose_names(&scans), ["a.ply.xf", "b.xf", "a.obj.xf"]);
        let scenes = ["one/cloud.ply", "two/cloud.ply", "../cloud.ply", "one_cloud.ply", "one:cloud.ply"].map(scan);
        let names = ["one_cloud.ply.xf", "two_cloud.ply.xf", ".._cloud.ply.xf", "one_cloud.xf", "5-one_cloud.xf"];
        assert_eq!(pose_names(&scenes), names);
        let table = poses_csv(&scans);
        assert!(table.lines().nth(1).is_some_and(|line| line.ends_with(",\"broken, quite\"")), "{table}");
    }
}
