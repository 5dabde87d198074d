//! What the user knows about a pose, from arguments and files.

use crate::args::{LevelArgs, PriorArgs};
use anyhow::{Context, Result, anyhow, bail};
use congruent_geometry::RigidTransform;
use congruent_io::{Motion, read_pose};
use congruent_pipeline::{Guess, MAX_TILT, Prior, tilt};
use nalgebra::{Unit, Vector3};
use serde::Deserialize;
use std::path::Path;

/// The part of a result that holds the pose.
#[derive(Deserialize)]
struct WithPose {
    target_from_source: Option<[[f64; 4]; 4]>,
}

/// Returns what the command line says about the pose.
pub(crate) fn prior(args: &PriorArgs) -> Result<Prior> {
    let guess =
        args.init.as_deref().map(|path| level_pose(path, &args.level)).transpose()?.map(|target_from_source| Guess {
            target_from_source,
            max_rotation: args.max_rotation.map(f64::to_radians),
            max_translation: args.max_translation,
        });
    Ok(Prior { guess, up: up(&args.level) })
}

/// Returns the up axis if the scans are level.
pub(crate) fn up(args: &LevelArgs) -> Option<Unit<Vector3<f64>>> {
    args.yaw_only.then(|| Unit::new_normalize(args.up.unwrap_or([0.0, 0.0, 1.0]).into()))
}

/// Reads a pose like [`pose`], but refuses one that tilts level scans.
pub(crate) fn level_pose(path: &Path, args: &LevelArgs) -> Result<RigidTransform> {
    let guess = pose(path)?;
    let tilt = tilt(&guess, up(args));
    if tilt > MAX_TILT {
        bail!(
            "{}: tilts the source by {:.1} degrees, but --yaw-only allows at most {:.1}; omit --yaw-only, or give the up \
             axis with --up",
            path.display(),
            tilt.to_degrees(),
            MAX_TILT.to_degrees()
        );
    }
    Ok(guess)
}

/// Reads a 4×4 matrix, the pose in a JSON result, or the word `identity` if there is no such file.
pub(crate) fn pose(path: &Path) -> Result<RigidTransform> {
    if path.as_os_str() == "identity" && !path.exists() {
        return Ok(RigidTransform::identity());
    }
    let name = || path.display().to_string();
    let bytes = std::fs::read(path)
        .with_context(|| format!("{}: cannot be read; give a pose file, or identity", path.display()))?;
    if !bytes.trim_ascii_start().starts_with(b"{") {
        return Ok(read_pose(path)?);
    }
    let result: WithPose = serde_json::from_slice(&bytes).with_context(name)?;
    let Some(rows) = result.target_from_source else {
        bail!("{}: has no target_from_source; give a result with a pose", path.display());
    };
    let motion = Motion::nearest(&rows, Motion::WARN_ABOVE)
        .map_err(|fault| anyhow!("{}: target_from_source: {fault}", name()))?;
    Ok(motion.pose)
}

#[cfg(test)]
mod tests {
    use super::*;
    use congruent_io::write_pose;

    #[test]
    fn poses_are_read_from_matrices_and_from_results() {
        let folder = tempfile::tempdir().unwrap();
        let expected = RigidTransform::translation(1.0, -2.0, 3.5);
        let (matrix, result) = (folder.path().join("a.xf"), folder.path().join("a.json"));
        write_pose(&matrix, &expected).unwrap();
        let rows = congruent_geometry::to_rows(&expected);
        std::fs::write(&result, serde_json::json!({ "verdict": "ok", "target_from_source": rows }).to_string())
            .unwrap();
        for path in [&matrix, &result] {
            assert_eq!(pose(path).unwrap(), expected);
        }
        assert_eq!(pose(Path::new("identity")).unwrap(), RigidTransform::identity());
    }

    #[test]
    fn a_guess_that_tilts_level_scans_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("tilted.xf");
        let level = LevelArgs { yaw_only: true, up: None };
        for (tilt, is_fine) in [(0.0, true), (14.0, true), (16.0, false), (180.0, false)] {
            let turn = nalgebra::UnitQuaternion::from_axis_angle(&Vector3::x_axis(), f64::to_radians(tilt));
            write_pose(&path, &RigidTransform::from_parts(Vector3::zeros().into(), turn)).unwrap();
            let found = level_pose(&path, &level);
            assert_eq!(found.is_ok(), is_fine, "{tilt}");
            let message = found.err().map(|error| error.to_string());
            assert!(message.is_none_or(|m| m.contains("tilted.xf") && m.contains(&format!("{tilt:.1} degrees"))));
            assert!(level_pose(&path, &LevelArgs { yaw_only: false, up: None }).is_ok());
        }
    }

    #[test]
    fn what_is_no_pose_says_so() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bad");
        for (text, expected) in [
            ("{\"target_from_source\": null}", "no target_from_source"),
            ("{\"target_from_source\": [[2,0,0,0],[0,2,0,0],[0,0,2,0],[0,0,0,1]]}", "remove scale"),
            ("{\"target_from_source\"", "EOF"),
            ("1 2 3", "16"),
        ] {
            std::fs::write(&path, text).unwrap();
            let message = format!("{:#}", pose(&path).unwrap_err());
            assert!(message.contains(expected) && message.contains("bad"), "{message}");
        }
        assert!(format!("{:#}", pose(&folder.path().join("none")).unwrap_err()).contains("cannot be read"));
    }
}
