//! A table of pairs: CSV with a header, JSONL or, if built in, Parquet.

use anyhow::{Result, anyhow, bail};
use congruent_geometry::RigidTransform;
use congruent_io::{Motion, MotionFault, csv_fields};
use std::path::Path;

/// Names of the columns of a true pose: the upper three rows of the matrix. Those of an initial pose have the prefix
/// [`INIT`].
const MATRIX: [&str; 12] = ["r00", "r01", "r02", "tx", "r10", "r11", "r12", "ty", "r20", "r21", "r22", "tz"];
const INIT: &str = "init_";
/// First letter of the columns for the rotation. They show that a pose is given, because no other column has such a
/// name.
const ROTATION: char = 'r';
/// What poses are called in messages.
const TRUE_POSE: &str = "true pose";
const INITIAL_POSE: &str = "initial pose";

/// A pair, as listed in a table.
#[derive(Debug)]
pub(super) struct Line {
    pub(super) id: Option<String>,
    pub(super) source: String,
    pub(super) target: String,
    pub(super) truth: Option<RigidTransform>,
    /// A pose that may be near the right one.
    pub(super) guess: Option<RigidTransform>,
    /// Number of its matrices that were not quite rigid.
    n_skewed: usize,
}

/// Rows of text under named columns.
pub(super) struct Columns {
    pub(super) names: Vec<String>,
    /// With their numbers, counted from one; as many fields as names. Fields without a value are empty.
    pub(super) rows: Vec<(usize, Vec<String>)>,
}

/// Reads the pairs, and remarks on anything unusual.
pub(super) fn read(path: &Path) -> Result<(Vec<Line>, Vec<String>)> {
    let is = |extension: &str| path.extension().is_some_and(|e| e.eq_ignore_ascii_case(extension));
    let lines = if is("parquet") {
        parquet(path).and_then(|columns| pairs(&columns))
    } else {
        let text = std::fs::read_to_string(path)
            .map_err(|error| anyhow!("{}: cannot be read as a folder or a table of pairs: {error}", path.display()))?;
        let text = text.trim_start_matches('\u{feff}');
        if is("jsonl") { jsonl(text) } else { csv(text).and_then(|columns| pairs(&columns)) }
    };
    let lines = lines.map_err(|error| anyhow!("{}: {error}", path.display()))?;
    let (n_skewed, bound): (usize, f64) = (lines.iter().map(|line| line.n_skewed).sum(), Motion::WARN_ABOVE);
    let remark = format!(
        "{}: {n_skewed} poses are more than {bound} away from a rigid motion; the nearest rigid motion is used",
        path.display()
    );
    Ok((lines, Vec::from_iter((n_skewed > 0).then_some(remark))))
}

#[cfg(feature = "parquet")]
fn parquet(path: &Path) -> Result<Columns> {
    let mut wanted = ["source", "target", "id"].map(str::to_owned).to_vec();
    wanted.extend(["", INIT].iter().flat_map(|prefix| MATRIX.map(|name| format!("{prefix}{name}"))));
    super::parquet::read(path, &wanted.iter().map(String::as_str).collect::<Vec<_>>())
}

#[cfg(not(feature = "parquet"))]
fn parquet(_: &Path) -> Result<Columns> {
    bail!(
        "this program was built without Parquet; build it with --features parquet, or write the table as CSV or JSONL"
    )
}

fn csv(text: &str) -> Result<Columns> {
    let mut rows = (1..).zip(text.lines()).filter(|(_, line)| !line.trim().is_empty() && !line.starts_with('#'));
    let (_, header) =
        rows.next().ok_or_else(|| anyhow!("is empty; name the columns source,target in the first line"))?;
    let names: Vec<String> = csv_fields(header).iter().map(|name| name.to_ascii_lowercase()).collect();
    let row = |(number, line): (usize, &str)| {
        let fields = csv_fields(line);
        if fields.len() != names.len() {
            bail!("line {number}: has {} fields, but the header has {}", fields.len(), names.len());
        }
        Ok((number, fields))
    };
    let rows = rows.map(row).collect::<Result<_>>()?;
    Ok(Columns { names, rows })
}

fn pairs(Columns { names, rows }: &Columns) -> Result<Vec<Line>> {
    let column = |wanted: &str| names.iter().position(|name| name == wanted);
    let needed = |wanted: &str| {
        column(wanted).ok_or_else(|| anyhow!("there is no column `{wanted}` among `{}`", names.join(",")))
    };
    let (source, target, id) = (needed("source")?, needed("target")?, column("id"));
    let matrix = |prefix: &str| -> Result<Vec<usize>> {
        let named = MATRIX.map(|name| format!("{prefix}{name}"));
        let is_there = MATRIX
            .iter()
            .zip(&named)
            .any(|(name, column_name)| name.starts_with(ROTATION) && column(column_name).is_some());
        if is_there { named.iter().map(|name| needed(name)).collect() } else { Ok(Vec::new()) }
    };
    let (truth, guess) = (matrix("")?, matrix(INIT)?);
    let row = |(number, fields): &(usize, Vec<String>)| {
        let text = |at: usize| fields[at].clone();
        let pose = |columns: &[usize], what: &str| {
            pose(&columns.iter().map(|&at| fields[at].as_str()).collect::<Vec<_>>(), what, *number)
        };
        let (truth, guess) = (pose(&truth, TRUE_POSE)?, pose(&guess, INITIAL_POSE)?);
        Written { id: id.map(text), source: text(source), target: text(target), truth, guess }.checked(*number)
    };
    rows.iter().map(row).collect()
}

/// Reads a pose from the upper three rows of its matrix; `None` if all fields are empty.
fn pose(fields: &[&str], what: &str, line: usize) -> Result<Option<Motion>> {
    if fields.iter().all(|field| field.is_empty()) {
        return Ok(None);
    }
    let number =
        |field: &&str| field.parse::<f64>().map_err(|_| anyhow!("line {line}: the {what}: `{field}` is not a number"));
    let numbers = fields.iter().map(number).collect::<Result<Vec<f64>>>()?;
    let rows = std::array::from_fn(|row| std::array::from_fn(|column| numbers[4 * row + column]));
    motion(Motion::nearest_upper(&rows, Motion::REFUSE_ABOVE), what, line).map(Some)
}

fn jsonl(text: &str) -> Result<Vec<Line>> {
    #[derive(serde::Deserialize)]
    struct Object {
        id: Option<String>,
        source: String,
        target: String,
        truth: Option<[[f64; 4]; 4]>,
        init: Option<[[f64; 4]; 4]>,
    }
    let rows = (1..).zip(text.lines()).filter(|(_, line)| !line.trim().is_empty());
    rows.map(|(number, text)| {
        let Object { id, source, target, truth, init } =
            serde_json::from_str(text).map_err(|error| anyhow!("line {number}: {error}"))?;
        let pose = |rows: Option<[[f64; 4]; 4]>, what: &str| {
            rows.map(|rows| motion(Motion::nearest(&rows, Motion::REFUSE_ABOVE), what, number)).transpose()
        };
        let (truth, guess) = (pose(truth, TRUE_POSE)?, pose(init, INITIAL_POSE)?);
        Written { id, source, target, truth, guess }.checked(number)
    })
    .collect()
}

/// The content of a line, in either format.
struct Written {
    id: Option<String>,
    source: String,
    target: String,
    truth: Option<Motion>,
    guess: Option<Motion>,
}

impl Written {
    fn checked(self, number: usize) -> Result<Line> {
        let Written { id, source, target, truth, guess } = self;
        if source.is_empty() || target.is_empty() || id.as_ref().is_some_and(String::is_empty) {
            bail!("line {number}: source, target and id must not be empty");
        }
        let n_skewed = [truth, guess].into_iter().flatten().filter(Motion::is_skewed).count();
        Ok(Line { id, source, target, truth: truth.map(|t| t.pose), guess: guess.map(|g| g.pose), n_skewed })
    }
}

fn motion(found: Result<Motion, MotionFault>, what: &str, line: usize) -> Result<Motion> {
    found.map_err(|fault| anyhow!("line {line}: the {what}: {fault}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    const IDENTITY: &str = "source,target,r00,r01,r02,tx,r10,r11,r12,ty,r20,r21,r22,tz\na,b,1,0,0,5,0,1,0,0,0,0,1,0\n";

    /// Reads the text from a file of this name.
    fn lines(name: &str, text: &str) -> Result<(Vec<Line>, Vec<String>)> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        read(&path)
    }

    #[test]
    fn tables_are_read_in_both_forms_with_any_line_ends_and_marks() {
        let csv = "source,target,id\nthe a.ply,\"b,1.ply\",first\n";
        let json = "{\"source\":\"the a.ply\",\"target\":\"b,1.ply\",\"id\":\"first\"}\n";
        for (name, text) in [("t.csv", csv), ("t.jsonl", json)] {
            for text in [text.to_owned(), format!("\u{feff}{}", text.replace('\n', "\r\n")), format!("{text}\n")] {
                let (lines, remarks) = lines(name, &text).unwrap();
                let line = &lines[0];
                assert_eq!((line.source.as_str(), line.target.as_str()), ("the a.ply", "b,1.ply"));
                assert!(line.id.as_deref() == Some("first") && line.truth.is_none() && remarks.is_empty());
            }
        }
    }

    #[test]
    fn a_true_pose_is_read_may_be_left_out_and_is_made_rigid() {
        let (with, _) = lines("t.csv", &format!("{IDENTITY}c,d,,,,,,,,,,,,\n")).unwrap();
        assert_eq!(with[0].truth.unwrap().translation.vector.x, 5.0);
        assert!(with[1].truth.is_none());
        let (skewed, remarks) = lines("t.csv", &IDENTITY.replace("1,0,0,5", "1.01,0,0,5")).unwrap();
        assert_eq!(skewed[0].truth.unwrap().rotation, nalgebra::UnitQuaternion::identity());
        assert!(remarks[0].contains("1 poses are more than 0.001 away"), "{remarks:?}");
    }

    #[test]
    fn an_initial_pose_is_read_in_both_forms() {
        let header = MATRIX.map(|name| format!("init_{name}")).join(",");
        let csv = format!("source,target,{header}\na,b,1,0,0,5,0,1,0,0,0,0,1,0\nc,d,,,,,,,,,,,,\n");
        let json = r#"{"source":"a","target":"b","init":[[1,0,0,5],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}"#;
        for (name, text) in [("t.csv", csv.as_str()), ("t.jsonl", json)] {
            let (lines, _) = lines(name, text).unwrap();
            assert_eq!(lines[0].guess.unwrap().translation.vector.x, 5.0);
            assert!(lines[0].truth.is_none() && lines.get(1).is_none_or(|line| line.guess.is_none()));
        }
    }

    #[test]
    fn faults_have_their_line() {
        for (name, text, expected) in [
            ("t.csv", "source,traget\n", "no column `target`"),
            ("t.csv", "source,target\na\n", "line 2: has 1 fields"),
            ("t.csv", "source,target\na,\n", "line 2: source, target"),
            ("t.csv", "", "is empty"),
            ("t.csv", &IDENTITY.replace("1,0,0,5", "2,0,0,5"), "line 2: the true pose"),
            ("t.csv", &IDENTITY.replace("1,0,0,5", "1,,0,5"), "line 2: the true pose: `` is not a number"),
            ("t.csv", &IDENTITY.replace("r01", "r0l"), "no column `r01`"),
            ("t.csv", "source,target,init_r00\na,b,1\n", "no column `init_r01`"),
            (
                "t.jsonl",
                "{\"source\":\"a\",\"target\":\"b\",\"init\":[[2,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}",
                "line 1: the initial pose",
            ),
            ("t.jsonl", "\n{}\n", "line 2: missing field"),
        ] {
            let message = lines(name, text).unwrap_err().to_string();
            assert!(message.contains(expected) && message.contains(name), "{message}");
        }
    }

    #[cfg(not(feature = "parquet"))]
    #[test]
    fn a_program_without_parquet_says_so() {
        let message = lines("t.parquet", "PAR1").unwrap_err().to_string();
        assert!(message.contains("t.parquet: ") && message.contains("--features parquet"), "{message}");
    }
}
