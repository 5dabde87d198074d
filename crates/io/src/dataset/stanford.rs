//! The `.conf` of the Stanford 3D Scanning Repository: a pose for each scan.
//!
//! A line is `bmesh FILE tx ty tz qx qy qz qw`. The quaternion is the conjugate of what the usual formula expects: a
//! scan's points go into the common frame by the inverse of the rotation it spells.

use super::lines::{at_line, lines, numbers};
use super::views::{View, all_pairs};
use super::{DatasetFault, Listed};
use congruent_geometry::RigidTransform;
use nalgebra::{Quaternion, Translation3, UnitQuaternion};

/// All pairs of scans.
pub(super) fn parse(text: &str) -> Listed {
    let scans = lines(text).filter(|(_, content)| matches!(content.split_whitespace().next(), Some("bmesh" | "mesh")));
    all_pairs(scans.map(|(line, content)| scan(line, content)))
}

fn scan(line: usize, content: &str) -> Result<View, DatasetFault> {
    let fields: Vec<&str> = content.split_whitespace().collect();
    if fields.len() != 9 {
        let expected = "a scan is `bmesh FILE tx ty tz qx qy qz qw`";
        return Err(DatasetFault::Width { line, found: fields.len(), expected });
    }
    let numbers = numbers(&fields[2..], line)?;
    let [tx, ty, tz, qx, qy, qz, qw] = numbers[..] else { unreachable!("nine fields less two") };
    let spelt = UnitQuaternion::try_new(Quaternion::new(qw, qx, qy, qz), 1e-6);
    let rotation = spelt.ok_or(DatasetFault::NoRotation { line })?.conjugate();
    let world_from_scan = RigidTransform::from_parts(Translation3::new(tx, ty, tz), rotation);
    Ok(View { name: fields[1].to_owned(), place: at_line(line), world_from_scan, skew: 0.0 })
}

#[cfg(test)]
mod tests {
    use super::super::tests::whole;
    use super::*;
    use nalgebra::{Point3, Vector3};

    #[test]
    fn quaternions_are_conjugated_and_all_pairs_are_made() {
        // What spells a quarter turn about z is its inverse.
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let text = format!(
            "camera 0 0 0 0 0 0 1\nmesh a.ply 0 0 0 0 0 0 1\nbmesh b.ply 1 2 3 0 0 {half} {half}\nbmesh c.ply 0 0 1 0 0 0 1\n"
        );
        let read = whole(parse(&text));
        let names: Vec<_> = read.iter().map(|t| (t.source.as_str(), t.target.as_str())).collect();
        assert_eq!(names, [("b.ply", "a.ply"), ("c.ply", "a.ply"), ("c.ply", "b.ply")]);
        let image = read[0].motion.pose * Point3::new(1.0, 0.0, 0.0);
        assert!((image.coords - Vector3::new(1.0, 1.0, 3.0)).norm() < 1e-12, "{image}");
    }

    #[test]
    fn a_quaternion_of_zeros_is_refused() {
        assert_eq!(parse("bmesh a.ply 0 0 0 0 0 0 0\n"), [Err(DatasetFault::NoRotation { line: 1 })]);
    }
}
