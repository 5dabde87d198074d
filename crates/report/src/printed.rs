//! The text that an experiment prints, as blocks of a page: the headings, lists, tables and paragraphs of Markdown that
//! `Tally::markdown` writes, and no other Markdown.

use crate::page::{Block, Cell, Table};

/// Returns one block per heading, list, table or paragraph.
pub(crate) fn blocks_of(text: &str) -> Vec<Block> {
    let mut blocks = Vec::new();
    let mut heading = String::new();
    for part in text.split("\n\n").map(str::trim).filter(|part| !part.is_empty()) {
        // The text may follow a heading directly.
        for (kind, lines) in runs(part) {
            match kind {
                Kind::Heading => {
                    for line in lines {
                        let name = line.trim_start_matches('#').trim().to_owned();
                        let depth = line.len() - line.trim_start_matches('#').len();
                        if depth < 3 {
                            name.clone_into(&mut heading);
                        }
                        blocks.push(if depth == 1 { Block::Section(name) } else { Block::Subsection(name) });
                    }
                }
                Kind::Item => {
                    blocks.push(Block::List(lines.iter().map(|line| line[2..].trim().to_owned()).collect()));
                }
                Kind::Row => blocks.push(Block::Table(table(&lines, heading.contains("accuracy")))),
                Kind::Text => blocks.push(Block::Text(lines.join(" "))),
            }
        }
    }
    blocks
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Heading,
    Item,
    Row,
    Text,
}

fn runs(part: &str) -> Vec<(Kind, Vec<&str>)> {
    let mut runs: Vec<(Kind, Vec<&str>)> = Vec::new();
    for line in part.lines().filter(|line| !line.trim().is_empty()) {
        let kind = match line {
            _ if line.starts_with('#') => Kind::Heading,
            _ if line.starts_with("* ") => Kind::Item,
            _ if line.starts_with('|') => Kind::Row,
            _ => Kind::Text,
        };
        match runs.last_mut() {
            Some((last, lines)) if *last == kind => lines.push(line),
            _ => runs.push((kind, vec![line])),
        }
    }
    runs
}

/// Parses a table, whose second line is the rule. In tables of accuracies the largest of each column is marked as the
/// best.
fn table(lines: &[&str], mark_best: bool) -> Table {
    let cells = |line: &str| -> Vec<String> {
        line.trim().trim_matches('|').split('|').map(|cell| cell.trim().to_owned()).collect()
    };
    let columns = lines.first().map(|line| cells(line)).unwrap_or_default();
    let mut rows: Vec<Vec<Cell>> =
        lines.iter().skip(2).map(|line| cells(line).into_iter().map(Cell::from).collect()).collect();
    if mark_best && rows.len() > 1 {
        (1..columns.len()).for_each(|column| mark_largest(&mut rows, column));
    }
    Table { columns, rows, sortable: false }
}

/// Marks all cells that have the largest number of a column, unless all of them have it.
fn mark_largest(rows: &mut [Vec<Cell>], column: usize) {
    let number = |row: &Vec<Cell>| row.get(column).and_then(|cell| cell.text.parse::<f64>().ok());
    let largest = rows.iter().filter_map(number).fold(f64::NEG_INFINITY, f64::max);
    if rows.iter().all(|row| number(row).is_none_or(|v| v == largest)) {
        return;
    }
    for row in rows.iter_mut() {
        if number(row) == Some(largest) {
            row[column].best = true;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_part_of_the_text_becomes_its_block() {
        let text = "# Title\n\n3 pairs of set.\n\n* a note\n* another\n\n## Registration accuracy, %\n\n### t 1\n\n| m | 1 | 2 |\n|---|---:|---:|\n| A | 10.0 | 50.0 |\n| B | 30.0 | 50.0 |\n\nEnd.\n";
        let blocks = blocks_of(text);
        let [
            Block::Section(title),
            Block::Text(pairs),
            Block::List(notes),
            Block::Subsection(_),
            Block::Subsection(_),
            Block::Table(table),
            Block::Text(end),
        ] = &blocks[..]
        else {
            panic!("{blocks:?}")
        };
        assert_eq!((title.as_str(), pairs.as_str(), end.as_str()), ("Title", "3 pairs of set.", "End."));
        assert_eq!(notes, &["a note", "another"]);
        assert_eq!(table.columns, ["m", "1", "2"]);
        let best: Vec<bool> = table.rows.iter().flatten().map(|cell| cell.best).collect();
        assert_eq!(best, [false, false, false, false, true, false]);
    }
}
