//! A table of pairs: CSV with a header, JSONL or, if built in, Parquet.

use anyhow::{Result, anyhow};
use congruent_io::{DatasetFault, Motion, PairEntry, pair_table};
use std::path::Path;

/// The pairs of a table.
#[derive(Debug)]
pub(super) struct Table {
    pub(super) pairs: Vec<PairEntry>,
    /// What is wrong with the lines that cannot be used.
    pub(super) faults: Vec<String>,
    /// Remarks on anything unusual.
    pub(super) remarks: Vec<String>,
}

/// What the lines say, or what is wrong with them.
type Lines = Vec<Result<PairEntry, String>>;

impl Table {
    pub(super) fn read(path: &Path) -> Result<Table> {
        let shown = path.display();
        let is = |extension: &str| path.extension().is_some_and(|e| e.eq_ignore_ascii_case(extension));
        let lines = if is("parquet") {
            parquet(path)
        } else {
            let text = std::fs::read_to_string(path)
                .map_err(|error| anyhow!("{shown}: cannot be read as a folder or a table of pairs: {error}"))?;
            if is("jsonl") { Ok(jsonl(&text)) } else { csv(&text) }
        };
        let (mut pairs, mut faults) = (Vec::new(), Vec::new());
        for line in lines.map_err(|error| anyhow!("{shown}: {error}"))? {
            match line {
                Ok(pair) => pairs.push(pair),
                Err(fault) => faults.push(format!("{shown}: {fault}")),
            }
        }
        let poses = pairs.iter().flat_map(|pair| [pair.truth, pair.init]).flatten();
        let (n_skewed, bound) = (poses.filter(Motion::is_skewed).count(), Motion::WARN_ABOVE);
        let remark = format!(
            "{shown}: {n_skewed} poses are more than {bound} away from a rigid motion; the nearest rigid motion is used"
        );
        Ok(Table { pairs, faults, remarks: Vec::from_iter((n_skewed > 0).then_some(remark)) })
    }
}

fn said(line: Result<PairEntry, DatasetFault>) -> Result<PairEntry, String> {
    line.map_err(|fault| fault.to_string())
}

fn csv(text: &str) -> Result<Lines> {
    Ok(pair_table(text)?.into_iter().map(said).collect())
}

#[cfg(feature = "parquet")]
fn parquet(path: &Path) -> Result<Lines> {
    use congruent_io::PairColumns;
    let (header, rows) = super::parquet::read(path, &PairColumns::names())?;
    let columns = PairColumns::find(&header)?;
    Ok((1..).zip(rows).map(|(number, fields)| said(columns.entry(number, &fields))).collect())
}

#[cfg(not(feature = "parquet"))]
fn parquet(_: &Path) -> Result<Lines> {
    anyhow::bail!(
        "this program was built without Parquet; build it with --features parquet, or write the table as CSV or JSONL"
    )
}

fn jsonl(text: &str) -> Lines {
    let text = text.trim_start_matches('\u{feff}');
    let lines = (1..).zip(text.lines()).filter(|(_, line)| !line.trim().is_empty());
    lines.map(|(line, text)| object(line, text)).collect()
}

fn object(line: usize, text: &str) -> Result<PairEntry, String> {
    #[derive(serde::Deserialize)]
    struct Object {
        id: Option<String>,
        source: String,
        target: String,
        overlap: Option<f64>,
        truth: Option<[[f64; 4]; 4]>,
        init: Option<[[f64; 4]; 4]>,
    }
    let Object { id, source, target, overlap, truth, init } =
        serde_json::from_str(text).map_err(|error| format!("line {line}: {error}"))?;
    let motion = |rows: Option<[[f64; 4]; 4]>, pose: &'static str| {
        let motion = rows.map(|rows| Motion::nearest(&rows, Motion::REFUSE_ABOVE)).transpose();
        motion.map_err(|fault| DatasetFault::Pose { line, pose, fault }.to_string())
    };
    let (truth, init) = (motion(truth, "true pose")?, motion(init, "initial pose")?);
    said(PairEntry { line, id, source, target, overlap, truth, init }.checked())
}

#[cfg(test)]
mod tests {
    use super::*;

    const IDENTITY: &str = "source,target,r00,r01,r02,tx,r10,r11,r12,ty,r20,r21,r22,tz\na,b,1,0,0,5,0,1,0,0,0,0,1,0\n";

    /// Reads the text from a file of this name.
    fn table(name: &str, text: &str) -> Result<Table> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        Table::read(&path)
    }

    #[test]
    fn tables_are_read_in_both_forms_with_any_line_ends_and_marks() {
        let csv = "source,target,id\nthe a.ply,\"b,1.ply\",first\n";
        let json = "{\"source\":\"the a.ply\",\"target\":\"b,1.ply\",\"id\":\"first\"}\n";
        for (name, text) in [("t.csv", csv), ("t.jsonl", json)] {
            for text in [text.to_owned(), format!("\u{feff}{}", text.replace('\n', "\r\n")), format!("{text}\n")] {
                let Table { pairs, faults, remarks } = table(name, &text).unwrap();
                let pair = &pairs[0];
                assert_eq!((pair.source.as_str(), pair.target.as_str()), ("the a.ply", "b,1.ply"));
                assert!(pair.id.as_deref() == Some("first") && pair.truth.is_none());
                assert!(pairs.len() == 1 && faults.is_empty() && remarks.is_empty());
            }
        }
    }

    #[test]
    fn a_true_pose_is_read_may_be_left_out_and_is_made_rigid() {
        let with = table("t.csv", &format!("{IDENTITY}c,d,,,,,,,,,,,,\n")).unwrap().pairs;
        assert_eq!(with[0].truth.unwrap().pose.translation.vector.x, 5.0);
        assert!(with[1].truth.is_none());
        let Table { pairs: skewed, remarks, .. } = table("t.csv", &IDENTITY.replace("1,0,0,5", "1.01,0,0,5")).unwrap();
        assert_eq!(skewed[0].truth.unwrap().pose.rotation, nalgebra::UnitQuaternion::identity());
        assert!(remarks[0].contains("1 poses are more than 0.001 away"), "{remarks:?}");
    }

    #[test]
    fn an_initial_pose_is_read_in_both_forms() {
        let csv = "source,target,init_r00,init_r01,init_r02,init_tx,init_r10,init_r11,init_r12,init_ty,init_r20,init_r21,\
                   init_r22,init_tz\na,b,1,0,0,5,0,1,0,0,0,0,1,0\nc,d,,,,,,,,,,,,\n";
        let json = r#"{"source":"a","target":"b","init":[[1,0,0,5],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}"#;
        for (name, text) in [("t.csv", csv), ("t.jsonl", json)] {
            let pairs = table(name, text).unwrap().pairs;
            assert_eq!(pairs[0].init.unwrap().pose.translation.vector.x, 5.0);
            assert!(pairs[0].truth.is_none() && pairs.get(1).is_none_or(|pair| pair.init.is_none()));
        }
    }

    #[test]
    fn a_fault_of_a_line_is_kept_with_file_and_line_and_one_of_the_table_is_an_error() {
        let missing = "{\"source\":\"a\"}\n{\"source\":\"a\",\"target\":\"b\"}";
        let no_name = "{\"source\":\"a\",\"target\":\"b\",\"id\":\"\"}\n{\"source\":\"a\",\"target\":\"b\"}";
        let scaled = "{\"source\":\"a\",\"target\":\"b\",\"init\":[[2,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}\n\
                      {\"source\":\"a\",\"target\":\"b\"}";
        for (name, text, expected) in [
            ("t.csv", "source,target\na,\na,b\n", "line 2: source, target"),
            ("t.jsonl", missing, "line 1: missing field"),
            ("t.jsonl", no_name, "line 1: source, target and id must not be empty"),
            ("t.jsonl", scaled, "line 1: the initial pose"),
        ] {
            let Table { pairs, faults, .. } = table(name, text).unwrap();
            assert!(pairs.len() == 1 && faults.len() == 1, "{faults:?}");
            assert!(faults[0].contains(&format!("{name}: {expected}")), "{faults:?}");
        }
        let message = table("t.csv", "source,traget\n").unwrap_err().to_string();
        assert!(message.contains("t.csv: there is no column `target`"), "{message}");
    }

    #[cfg(not(feature = "parquet"))]
    #[test]
    fn a_program_without_parquet_says_so() {
        let message = table("t.parquet", "PAR1").unwrap_err().to_string();
        assert!(message.contains("t.parquet: ") && message.contains("--features parquet"), "{message}");
    }
}
