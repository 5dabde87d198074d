//! Tables of numbers as text: a line a row, parted by commas, semicolons or white space.
//!
//! A first line that does not begin with a number names the columns. Empty lines and lines that begin with `#` are
//! skipped. All numbers are finite.

use crate::IoError;
use crate::error::excerpt;
use crate::read::bytes_of;
use std::path::Path;

/// Why a text is no table, or not the one asked for. Lines count from one.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TableFault {
    /// The bytes are no text.
    #[error("line {line}: is not UTF-8 text; export the table as plain CSV")]
    NotText {
        /// Where.
        line: usize,
    },
    /// A field is no finite number.
    #[error("line {line}, field {field}: `{token}` is not a finite number; correct the line or remove it")]
    NotANumber {
        /// Where.
        line: usize,
        /// Counted from one.
        field: usize,
        /// The field.
        token: String,
    },
    /// Fields are missing, or too many.
    #[error("line {line}: has {found} fields, the lines before have {expected}; correct the line or remove it")]
    Width {
        /// Where.
        line: usize,
        /// Fields there are.
        found: usize,
        /// Fields there should be.
        expected: usize,
    },
    /// The header lacks a column.
    #[error("line {line}: there is no column `{missing}` among {found}; name the columns {expected}")]
    Column {
        /// Of the header.
        line: usize,
        /// The column.
        missing: &'static str,
        /// The header.
        found: String,
        /// The columns that are needed.
        expected: &'static str,
    },
    /// Without a header the number of fields says what they are, and this one says nothing.
    #[error("line {line}: {found} fields and no header; write {expected}, or name the columns in the first line")]
    Form {
        /// The first row.
        line: usize,
        /// Fields there are.
        found: usize,
        /// What would be understood.
        expected: &'static str,
    },
    /// A field should be the position of a point.
    #[error("line {line}: {value} is not a point index; the {scan} scan's points are numbered 0 to {last}")]
    Index {
        /// Where.
        line: usize,
        /// The field.
        value: f64,
        /// Which scan is meant.
        scan: &'static str,
        /// The highest position there is.
        last: usize,
    },
    /// A point that a position names has no coordinates.
    #[error("line {line}: point {index} of the {scan} scan has a coordinate that is not finite; remove the line")]
    Broken {
        /// Where.
        line: usize,
        /// The point.
        index: usize,
        /// Which scan is meant.
        scan: &'static str,
    },
    /// Pairs of positions mean nothing without the scans.
    #[error("contains pairs of point indices; give their scans with --source and --target")]
    NoScans,
}

/// Rows of equally many finite numbers.
#[derive(Debug, Default)]
pub(crate) struct Table {
    /// Line and names of the columns.
    header: Option<(usize, Vec<String>)>,
    width: usize,
    values: Vec<f64>,
    /// Of each row.
    lines: Vec<usize>,
}

impl Table {
    pub(crate) fn read(path: &Path) -> Result<Table, IoError> {
        Table::parse(&bytes_of(path)?).map_err(|fault| IoError::Table { path: path.to_owned(), fault })
    }

    pub(crate) fn parse(bytes: &[u8]) -> Result<Table, TableFault> {
        let text = std::str::from_utf8(bytes).map_err(|error| {
            let before = &bytes[..error.valid_up_to()];
            TableFault::NotText { line: 1 + before.iter().filter(|b| **b == b'\n').count() }
        })?;
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let mut table = Table::default();
        for (line, content) in (1..).zip(text.lines()) {
            let content = content.trim();
            if !content.is_empty() && !content.starts_with('#') {
                table.add(line, content)?;
            }
        }
        Ok(table)
    }

    /// Rows with their lines.
    pub(crate) fn rows(&self) -> impl Iterator<Item = (usize, &[f64])> {
        // A table without rows has no width.
        self.lines.iter().copied().zip(self.values.chunks_exact(self.width.max(1)))
    }

    pub(crate) fn is_named(&self) -> bool {
        self.header.is_some()
    }

    /// Fields of every row, and the first line.
    pub(crate) fn width(&self) -> (usize, usize) {
        (self.width, self.lines.first().copied().unwrap_or(1))
    }

    /// Where the header has a column of this name.
    pub(crate) fn column(&self, name: &str) -> Option<usize> {
        self.header.as_ref()?.1.iter().position(|column| column == name)
    }

    /// Where the header has these columns; `expected` is what to write.
    pub(crate) fn columns<const N: usize>(
        &self,
        names: [&'static str; N],
        expected: &'static str,
    ) -> Result<[usize; N], TableFault> {
        let mut places = [0; N];
        for (place, missing) in places.iter_mut().zip(names) {
            *place = self.column(missing).ok_or_else(|| {
                let (line, names) = self.header.as_ref().map_or((1, String::new()), |(l, n)| (*l, n.join(",")));
                TableFault::Column { line, missing, found: format!("`{}`", excerpt(names.as_bytes())), expected }
            })?;
        }
        Ok(places)
    }

    /// The same where all of them are there, else nothing.
    pub(crate) fn optional<const N: usize>(&self, names: [&'static str; N]) -> Option<[usize; N]> {
        self.columns(names, "").ok()
    }

    fn add(&mut self, line: usize, content: &str) -> Result<(), TableFault> {
        let is_first = self.header.is_none() && self.lines.is_empty();
        if is_first && fields(content).next().is_some_and(|field| field.parse::<f64>().is_err()) {
            let names: Vec<String> = fields(content).map(|name| name.trim_matches('"').to_ascii_lowercase()).collect();
            self.width = names.len();
            self.header = Some((line, names));
            return Ok(());
        }
        let before = self.values.len();
        for (field, token) in (1..).zip(fields(content)) {
            let value = token.parse::<f64>().ok().filter(|value| value.is_finite());
            let fault = || TableFault::NotANumber { line, field, token: excerpt(token.as_bytes()) };
            self.values.push(value.ok_or_else(fault)?);
        }
        let found = self.values.len() - before;
        if is_first {
            self.width = found;
        } else if found != self.width {
            return Err(TableFault::Width { line, found, expected: self.width });
        }
        self.lines.push(line);
        Ok(())
    }
}

/// The fields of a line: what stands between commas, else semicolons, else white space.
fn fields(line: &str) -> Box<dyn Iterator<Item = &str> + '_> {
    match [',', ';'].into_iter().find(|separator| line.contains(*separator)) {
        Some(separator) => Box::new(line.split(separator).map(str::trim)),
        None => Box::new(line.split_whitespace()),
    }
}

/// A table as text: the header, then a line for each row, every digit kept.
pub(crate) fn csv<R: IntoIterator<Item = String>>(header: &[&str], rows: impl Iterator<Item = R>) -> String {
    let mut text = header.join(",") + "\n";
    for row in rows {
        for (i, field) in row.into_iter().enumerate() {
            if i > 0 {
                text.push(',');
            }
            text.push_str(&field);
        }
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn separators_comments_and_headers_are_understood() {
        for text in [
            "1,2\n3,-4e1\n",
            "\u{feff}# made by hand\r\n1 ; 2\r\n\r\n3;-40\r\n",
            "a b\n1 2\n3\t-40.0",
            " \"A\", \"B\"\n1,2\n3,-40",
        ] {
            let table = Table::parse(text.as_bytes()).unwrap();
            let rows: Vec<&[f64]> = table.rows().map(|(_, row)| row).collect();
            assert_eq!(rows, [[1.0, 2.0], [3.0, -40.0]], "{text}");
            assert_eq!(table.column("b"), table.is_named().then_some(1));
        }
        assert_eq!(Table::parse(b"x,y,z\n").unwrap().rows().count(), 0);
    }

    #[test]
    fn faults_name_their_line_and_value() {
        for (text, expected) in [
            (&b"1,2\n3,4,5\n"[..], "line 2: has 3 fields, the lines before have 2"),
            (b"x,y\n\n1\n", "line 3: has 1 fields"),
            (b"1,2\n3,four\n", "line 2, field 2: `four` is not a finite number"),
            (b"1,2\n3,nan\n", "line 2, field 2: `nan`"),
            (b"1,,2\n", "line 1, field 2: ``"),
            (b"1,2\nx,y\n", "line 2, field 1: `x`"),
            (b"1,2\n3,\xff\n", "line 2: is not UTF-8 text"),
        ] {
            let message = Table::parse(text).unwrap_err().to_string();
            assert!(message.starts_with(expected), "{message}");
        }
    }
}
