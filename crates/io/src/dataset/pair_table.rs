//! A table of pairs with named columns: the list of a data set, and the input of a batch.

use super::DatasetFault;
use super::lines::lines;
use crate::csv::csv_fields;
use crate::error::excerpt;
use crate::{Motion, MotionFault};

/// Columns of the true pose: the upper three rows of the matrix. Those of an initial pose have the prefix [`INIT`].
pub(super) const MATRIX: [&str; 12] = ["r00", "r01", "r02", "tx", "r10", "r11", "r12", "ty", "r20", "r21", "r22", "tz"];
const INIT: &str = "init_";
/// First letter of the columns for the rotation. They show that a pose is given, because no other column has such a
/// name.
const ROTATION: char = 'r';

/// What a table says about a pair.
#[derive(Clone, Debug, PartialEq)]
pub struct PairEntry {
    /// Line or row, counted from one.
    pub line: usize,
    /// Unique name of the pair, if the table has such a column.
    pub id: Option<String>,
    /// Scan to be moved.
    pub source: String,
    /// Scan that stays.
    pub target: String,
    /// Share of points that both have, where it is known.
    pub overlap: Option<f64>,
    /// True pose: maps the source into the frame of the target.
    pub truth: Option<Motion>,
    /// A pose that may be near the right one.
    pub init: Option<Motion>,
}

impl PairEntry {
    /// Returns the entry, if it names what it is about.
    ///
    /// # Errors
    /// A name is empty.
    pub fn checked(self) -> Result<PairEntry, DatasetFault> {
        let is_empty =
            self.source.is_empty() || self.target.is_empty() || self.id.as_ref().is_some_and(String::is_empty);
        if is_empty { Err(DatasetFault::NoName { line: self.line }) } else { Ok(self) }
    }
}

/// Reads a table as CSV: a header, then a line for each pair, in any order of columns. Lines that begin with `#` are skipped.
/// A line that cannot be used does not spoil the others.
///
/// # Errors
/// There is no header, or a column is missing.
pub fn pair_table(text: &str) -> Result<Vec<Result<PairEntry, DatasetFault>>, DatasetFault> {
    let mut lines = lines(text);
    let (_, header) = lines.next().ok_or(DatasetFault::NoHeader)?;
    let columns = PairColumns::find(&csv_fields(header))?;
    Ok(lines.map(|(line, content)| columns.entry(line, &csv_fields(content))).collect())
}

/// Which columns of a table say what.
#[derive(Clone, Debug, PartialEq)]
pub struct PairColumns {
    width: usize,
    id: Option<usize>,
    source: usize,
    target: usize,
    overlap: Option<usize>,
    truth: Option<[usize; 12]>,
    init: Option<[usize; 12]>,
}

impl PairColumns {
    /// The names of all columns that are read.
    #[must_use]
    pub fn names() -> Vec<String> {
        let mut names = ["source", "target", "id", "overlap"].map(str::to_owned).to_vec();
        names.extend(["", INIT].iter().flat_map(|prefix| MATRIX.map(|name| format!("{prefix}{name}"))));
        names
    }

    /// Finds the columns in a header, in capitals or not. `source` and `target` are needed, and all of a matrix if a part of
    /// its rotation is there.
    ///
    /// # Errors
    /// A column is missing.
    pub fn find(header: &[String]) -> Result<PairColumns, DatasetFault> {
        let column = |wanted: &str| header.iter().position(|name| name.eq_ignore_ascii_case(wanted));
        let needed = |missing: &str| {
            let found = || excerpt(header.join(",").as_bytes());
            column(missing).ok_or_else(|| DatasetFault::Column { missing: missing.to_owned(), found: found() })
        };
        let matrix = |prefix: &str| -> Result<Option<[usize; 12]>, DatasetFault> {
            let names = MATRIX.map(|name| format!("{prefix}{name}"));
            let of_rotation = MATRIX.iter().zip(&names).filter(|(name, _)| name.starts_with(ROTATION));
            if of_rotation.map(|(_, name)| name).all(|name| column(name).is_none()) {
                return Ok(None);
            }
            let mut places = [0; 12];
            for (place, name) in places.iter_mut().zip(&names) {
                *place = needed(name)?;
            }
            Ok(Some(places))
        };
        Ok(PairColumns {
            width: header.len(),
            id: column("id"),
            source: needed("source")?,
            target: needed("target")?,
            overlap: column("overlap"),
            truth: matrix("")?,
            init: matrix(INIT)?,
        })
    }

    /// Reads a line; a field without a value is empty.
    ///
    /// # Errors
    /// The fields are not as many as the columns, a name is empty, a number is none, or a matrix is no rigid motion.
    pub fn entry(&self, line: usize, fields: &[String]) -> Result<PairEntry, DatasetFault> {
        if fields.len() != self.width {
            let expected = "as many are needed as the header has";
            return Err(DatasetFault::Width { line, found: fields.len(), expected });
        }
        let text = |at: usize| fields[at].clone();
        let given = self.overlap.filter(|at| !fields[*at].is_empty());
        let truth = |fault| DatasetFault::Pose { line, pose: "true pose", fault };
        let init = |fault| DatasetFault::Pose { line, pose: "initial pose", fault };
        PairEntry {
            line,
            id: self.id.map(text),
            source: text(self.source),
            target: text(self.target),
            overlap: given.map(|at| number(&fields[at], "overlap", line)).transpose()?,
            truth: pose(fields, self.truth, "", line)?.transpose().map_err(truth)?,
            init: pose(fields, self.init, INIT, line)?.transpose().map_err(init)?,
        }
        .checked()
    }
}

/// The motion in these fields, or why it is none; `None` if all of them are empty.
fn pose(
    fields: &[String],
    places: Option<[usize; 12]>,
    prefix: &str,
    line: usize,
) -> Result<Option<Result<Motion, MotionFault>>, DatasetFault> {
    let Some(places) = places.filter(|places| places.iter().any(|at| !fields[*at].is_empty())) else {
        return Ok(None);
    };
    let mut rows = [[0.0; 4]; 3];
    for ((value, at), name) in rows.as_flattened_mut().iter_mut().zip(places).zip(MATRIX) {
        *value = number(&fields[at], &format!("{prefix}{name}"), line)?;
    }
    Ok(Some(Motion::nearest_upper(&rows, Motion::REFUSE_ABOVE)))
}

fn number(token: &str, column: &str, line: usize) -> Result<f64, DatasetFault> {
    let value = token.parse::<f64>().ok().filter(|value| value.is_finite());
    let fault = || DatasetFault::Field { line, column: column.to_owned(), token: excerpt(token.as_bytes()) };
    value.ok_or_else(fault)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Reads a table whose lines can all be used.
    fn whole(text: &str) -> Vec<PairEntry> {
        pair_table(text).unwrap().into_iter().map(Result::unwrap).collect()
    }

    #[test]
    fn columns_are_found_by_name_and_only_the_scans_are_needed() {
        let read = whole("\u{feff}# by hand\nnote,TARGET,Source\nx,\"a,1.ply\",b.ply\r\n\n");
        let (source, target) = ("b.ply".to_owned(), "a,1.ply".to_owned());
        let expected = PairEntry { line: 3, id: None, source, target, overlap: None, truth: None, init: None };
        assert_eq!(read, [expected]);
        let mut names = PairColumns::names();
        names.reverse();
        // From the last column, init_tz, to the first one, source.
        let identity = "0,1,0,0,0,0,1,0,0,0,0,1";
        let text = format!("{}\n{identity},3,1,0,0,2,0,1,0,1,0,0,1,0.5,p1,t.ply,s.ply\n", names.join(","));
        let read = whole(&text);
        assert_eq!((read[0].id.as_deref(), read[0].overlap, read[0].source.as_str()), (Some("p1"), Some(0.5), "s.ply"));
        assert_eq!(read[0].truth.unwrap().pose.translation.vector, nalgebra::Vector3::new(1.0, 2.0, 3.0));
        assert_eq!(read[0].init.unwrap().pose, congruent_geometry::RigidTransform::identity());
    }

    #[test]
    fn what_is_not_known_may_be_empty() {
        let header = format!("source,target,overlap,{},init_{}", MATRIX.join(","), MATRIX.join(",init_"));
        let read = whole(&format!("{header}\nb,a{}\n", ",".repeat(25)));
        assert!(read[0].overlap.is_none() && read[0].truth.is_none() && read[0].init.is_none());
    }

    #[test]
    fn a_fault_is_one_of_the_table_or_of_its_line() {
        let matrix = MATRIX.join(",");
        let header = |text: &str| pair_table(text).unwrap_err().to_string();
        assert!(header("# nothing\n").contains("is empty; name the columns source,target"));
        for (text, missing) in [
            ("source,traget\n".to_owned(), "no column `target` among `source,traget`"),
            (format!("source,target,{}\n", matrix.replace("r01", "r0l")), "no column `r01`"),
            ("source,target,init_r00\n".to_owned(), "no column `init_r01`"),
        ] {
            assert!(header(&text).contains(missing), "{}", header(&text));
        }
        let text = format!(
            "source,target,id,init_{}\na,b,1,1,0,0,0,0,1,0,0,0,0,1,0\na,b\na,,2{none}\na,b,{none}\n\
             a,b,3,1,,0,0,0,1,0,0,0,0,1,0\na,b,4,2,0,0,0,0,1,0,0,0,0,1,0\na,b,5{none}\n",
            MATRIX.join(",init_"),
            none = ",".repeat(12)
        );
        let read = pair_table(&text).unwrap();
        let faults: Vec<String> = read.iter().filter_map(|entry| Some(entry.as_ref().err()?.to_string())).collect();
        assert_eq!((read.len(), faults.len()), (7, 5), "{faults:?}");
        for (fault, expected) in faults.iter().zip([
            "line 3: has 2 fields",
            "line 4: source, target and id must not be empty",
            "line 5: source, target and id",
            "line 6: `` in the column `init_r01` is not a finite number",
            "line 7: the initial pose: the upper left 3x3",
        ]) {
            assert!(fault.starts_with(expected), "{fault}");
        }
    }
}
