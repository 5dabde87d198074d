//! The `gt.log` of Redwood and 3DMatch (Choi et al., 2015): `i j n`, then a matrix that maps scan j into the frame of i.

use super::lines::{at_line, lines, motion, numbers};
use super::{DatasetFault, Listed, Truth};

/// Lines of a pair.
const BLOCK: usize = 5;

/// `names` is what scans are called, `{}` being the number. A pair is five lines, whatever they hold, so that a bad one does
/// not spoil the next.
pub(super) fn parse(text: &str, names: &str) -> Listed {
    let lines: Vec<(usize, &str)> = lines(text).collect();
    lines.chunks(BLOCK).map(|block| pair(block, names)).collect()
}

fn pair(block: &[(usize, &str)], names: &str) -> Result<Truth, DatasetFault> {
    let (line, head) = block[0];
    let head: Vec<&str> = head.split_whitespace().collect();
    let [i, j, ..] = head[..] else {
        let expected = "a pair begins with the numbers of its two scans";
        return Err(DatasetFault::Width { line, found: head.len(), expected });
    };
    if block.len() < BLOCK {
        return Err(DatasetFault::Cut { line });
    }
    let mut matrix = Vec::with_capacity(16);
    for &(at, row) in &block[1..] {
        let row: Vec<&str> = row.split_whitespace().collect();
        if row.len() != 4 {
            let expected = "a row of the matrix is four numbers";
            return Err(DatasetFault::Width { line: at, found: row.len(), expected });
        }
        matrix.extend(numbers(&row, at)?);
    }
    let name = |number: &str| names.replace("{}", number);
    Ok(Truth {
        id: None,
        source: name(j),
        target: name(i),
        place: at_line(line),
        overlap: None,
        motion: motion(&matrix, line)?,
    })
}

#[cfg(test)]
mod tests {
    use super::super::tests::whole;
    use super::*;

    #[test]
    fn the_second_scan_is_the_source() {
        let text = "0\t1\t60\n1 0 0 5\n0 1 0 0\n0 0 1 0\n0 0 0 1\n 4 9 60\n1 0 0 0\n0 0 -1 0\n0 1 0 2\n0 0 0 1\n";
        let read = whole(parse(text, "cloud_bin_{}.ply"));
        assert_eq!((read[0].source.as_str(), read[0].target.as_str()), ("cloud_bin_1.ply", "cloud_bin_0.ply"));
        assert_eq!((read[0].motion.pose.translation.vector.x, read[1].motion.pose.translation.vector.z), (5.0, 2.0));
        assert_eq!(read[1].target, "cloud_bin_4.ply");
        assert_eq!(parse("0 1 60\n1 0 0 5\n", "{}"), [Err(DatasetFault::Cut { line: 1 })]);
        let broken = parse(&text.replace("0 0 1 0\n0 0 0 1\n 4", "0 0 nan 0\n0 0 0 1\n 4"), "{}");
        assert!(matches!(broken[..], [Err(DatasetFault::NotANumber { line: 4, .. }), Ok(_)]), "{broken:?}");
    }
}
