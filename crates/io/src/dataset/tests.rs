//! Data sets in folders.

use super::*;
use std::fs;
use tempfile::TempDir;

fn folder(files: &[(&str, &str)]) -> TempDir {
    let folder = TempDir::new().unwrap();
    for (name, text) in files {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }
    folder
}

const HEADER: &str = "source,target,overlap,r00,r01,r02,tx,r10,r11,r12,ty,r20,r21,r22,tz";

#[test]
fn a_plain_folder_is_a_data_set() {
    let text = format!("{HEADER}\nb.ply,a.ply,0.25,0,-1,0,4,1,0,0,5,0,0,1,6\n");
    let folder = folder(&[("pairs.csv", &text)]);
    let dataset = read_dataset(folder.path(), None).unwrap();
    let pair = &dataset.pairs[0];
    assert_eq!((pair.source.as_str(), pair.target.as_str(), pair.overlap), ("b.ply", "a.ply", Some(0.25)));
    assert_eq!(pair.source_file, folder.path().join("scans/b.ply"));
    let image = pair.target_from_source * nalgebra_point(1.0, 0.0, 0.0);
    assert!((image.coords - nalgebra_point(4.0, 6.0, 6.0).coords).norm() < 1e-12);
    assert_eq!(dataset.read_from, [folder.path().join("pairs.csv")]);
    assert!(dataset.warnings.is_empty() && dataset.name == folder.path().file_name().unwrap().to_str().unwrap());
}

fn nalgebra_point(x: f64, y: f64, z: f64) -> nalgebra::Point3<f64> {
    nalgebra::Point3::new(x, y, z)
}

#[test]
fn a_description_says_where_things_are_and_which_way_the_truth_maps() {
    let toml = "name = 'set'\nunit = 'mm'\nlicence = 'free'\nsource = 'nowhere'\nscans = 'ply'\n\
                [truth]\nformat = 'pose-list'\npath = 'truth.txt'\ninverted = true\n";
    let described = folder(&[("dataset.toml", toml)]);
    let data = folder(&[("truth.txt", "a.ply b.ply 1 0 0 3 0 1 0 0 0 0 1 0 0 0 0 1\n")]);
    let dataset = read_dataset(described.path(), Some(data.path())).unwrap();
    assert_eq!(dataset.name, "set");
    assert_eq!(dataset.read_from, [described.path().join("dataset.toml"), data.path().join("truth.txt")]);
    assert_eq!(dataset.pairs[0].target_file, data.path().join("ply/b.ply"));
    assert_eq!(dataset.pairs[0].target_from_source.translation.vector.x, -3.0);
    let missing = read_dataset(described.path(), None).unwrap_err().to_string();
    assert!(missing.contains("truth.txt") && missing.contains("cannot be read"), "{missing}");
}

#[test]
fn skewed_truth_is_projected_with_a_warning_and_wild_truth_is_refused() {
    let with = |r00: &str| format!("{HEADER}\nb.ply,a.ply,0.5,{r00},0,0,0,0,1,0,0,0,0,1,0\n");
    let read = |text: &str| read_dataset(folder(&[("pairs.csv", text)]).path(), None);
    assert!(read(&with("1.0005")).unwrap().warnings.is_empty());
    let skewed = read(&with("1.002")).unwrap();
    assert!(skewed.warnings[0].contains("b.ply to a.ply") && skewed.warnings[0].contains("2.0e-3"));
    assert_eq!(skewed.pairs[0].target_from_source, RigidTransform::identity());
    let refused = read(&with("3")).unwrap_err().to_string();
    assert!(refused.contains("line 2") && refused.contains("rotation"), "{refused}");
}

#[test]
fn faults_name_file_line_and_way_out() {
    for (file, text, expected) in [
        ("pairs.csv", "source,traget\n".to_owned(), "no column `target`"),
        ("pairs.csv", "source,target\nb,a\n".to_owned(), "line 2: there is no true pose"),
        (
            "pairs.csv",
            format!("{HEADER}\nb,a,x,1,0,0,0,0,1,0,0,0,0,1,0\n"),
            "line 2: `x` in the column `overlap` is not a finite number",
        ),
        ("pairs.csv", format!("{HEADER}\nb,a,1\n"), "line 2: has 3 fields"),
        ("dataset.toml", "name = 'x'\nlicense = 'y'\n".to_owned(), "unknown field `license`"),
    ] {
        let folder = folder(&[(file, &text)]);
        let message = read_dataset(folder.path(), None).unwrap_err().to_string();
        assert!(message.contains(file) && message.contains(expected), "{message}");
    }
}

/// What a ground truth lists, if all of it can be used.
pub(super) fn whole<E: std::fmt::Debug>(listed: Listed<E>) -> Vec<Truth> {
    listed.into_iter().map(Result::unwrap).collect()
}

#[test]
fn a_bad_line_does_not_spoil_the_others() {
    let good = "b.ply,a.ply,0.5,1,0,0,0,0,1,0,0,0,0,1,0";
    let nan = good.replace("0.5,1", "0.5,NaN");
    let mirror = good.replace("0.5,1", "0.5,-1");
    let folder = folder(&[("pairs.csv", &format!("{HEADER}\n{nan}\n{good}\n{mirror}\n"))]);
    let dataset = read_dataset(folder.path(), None).unwrap();
    assert_eq!((dataset.pairs.len(), dataset.broken.len()), (1, 2));
    assert!(dataset.pairs[0].place.ends_with("pairs.csv: line 3"), "{}", dataset.pairs[0].place);
    for (message, what) in
        dataset.broken.iter().zip(["line 2: `NaN` in the column `r00`", "line 4: the true pose: the upper left 3x3"])
    {
        assert!(message.contains("pairs.csv") && message.contains(what), "{message}");
    }
}

#[test]
fn a_transposed_matrix_is_no_truth() {
    let (rows, columns) = ("0 -1 0 5 1 0 0 6 0 0 1 7 0 0 0 1", "0 1 0 0 -1 0 0 0 0 0 1 0 5 6 7 1");
    let toml = "name = 'set'\nscans = '.'\n[truth]\nformat = 'pose-list'\npath = 'truth.txt'\n";
    let folder = folder(&[("dataset.toml", toml), ("truth.txt", &format!("a b {rows}\nc d {columns}\n"))]);
    let dataset = read_dataset(folder.path(), None).unwrap();
    assert_eq!((dataset.pairs.len(), dataset.broken.len()), (1, 1));
    let message = &dataset.broken[0];
    assert!(message.contains("line 2: the last row is [5.0, 6.0, 7.0, 1.0]"), "{message}");
}

#[test]
fn scenes_are_read_one_after_the_other_and_one_may_be_missing() {
    let toml = "name = 'set'\nscenes = ['kitchen', 'gone', 'lab']\nscans = '{scene}'\n\
                [pairs]\nmin-overlap = 0.3\n[truth]\nformat = 'gt-log'\npath = '{scene}-evaluation/gt.log'\n";
    let log = "0 1 60\n1 0 0 5\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";
    let folder = folder(&[("dataset.toml", toml), ("kitchen-evaluation/gt.log", log), ("lab-evaluation/gt.log", log)]);
    let dataset = read_dataset(folder.path(), None).unwrap();
    let names: Vec<_> = dataset.pairs.iter().map(|p| (p.source.as_str(), p.target.as_str())).collect();
    assert_eq!(names, [("kitchen/1.ply", "kitchen/0.ply"), ("lab/1.ply", "lab/0.ply")]);
    assert_eq!(dataset.pairs[1].source_file, folder.path().join("lab/1.ply"));
    assert!(dataset.broken.len() == 1 && dataset.broken[0].contains("gone-evaluation"), "{:?}", dataset.broken);
    assert_eq!(dataset.min_overlap, 0.3);
}
