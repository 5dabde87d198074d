//! Every scan format through the program.

use congruent_geometry::RawScan;
use congruent_simulation::pair::{PairOptions, ScanPair, figurine_pair};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn congruent(arguments: &[&Path]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_congruent")).args(arguments).output().unwrap()
}

fn text(bytes: &[u8]) -> &str {
    str::from_utf8(bytes).unwrap()
}

/// Both scans of a pair in one format, made by `convert` from PLY; points that STL can hold need a face each.
fn written(folder: &Path, pair: &ScanPair, extension: &str) -> [PathBuf; 2] {
    let with_faces = |scan: &RawScan| {
        let last = scan.points.len() as u32 - 1;
        let face = |i: u32| [i, (i + 1).min(last), (i + 2).min(last)];
        RawScan { triangles: (0..=last).map(face).collect(), ..scan.clone() }
    };
    [("source", &pair.source), ("target", &pair.target)].map(|(name, scan)| {
        let ply = folder.join(name).with_extension("ply");
        let scan = if extension == "stl" { with_faces(scan) } else { scan.clone() };
        congruent_io::write_scan(&ply, &scan).unwrap();
        let path = ply.with_extension(extension);
        if extension != "ply" {
            let output = congruent(&["convert".as_ref(), &ply, &path]);
            assert_eq!(output.status.code(), Some(0), "{extension}: {}", text(&output.stderr));
            let counts = format!("{} points", scan.points.len());
            assert!(text(&output.stdout).contains(&counts), "{extension}: {}", text(&output.stdout));
        }
        path
    })
}
