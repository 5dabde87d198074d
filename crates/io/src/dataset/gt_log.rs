//! The `gt.log` of Redwood and 3DMatch (Choi et al., 2015): `i j n`, then a matrix that maps scan j into the frame of i.

use super::lines::{lines, numbers};
use super::{DatasetFault, Motion, Truth};

/// `names` is what scans are called, `{}` being the number.
pub(super) fn parse(text: &str, names: &str) -> Result<Vec<Truth>, DatasetFault> {
    let mut lines = lines(text);
    let mut truths = Vec::new();
    while let Some((line, head)) = lines.next() {
        let head: Vec<&str> = head.split_whitespace().collect();
        let [i, j, ..] = head[..] else {
            let expected = "a pair begins with the numbers of its two scans";
            return Err(DatasetFault::Width { line, found: head.len(), expected });
        };
        let mut matrix = Vec::with_capacity(16);
        for _ in 0..4 {
            let (at, row) = lines.next().ok_or(DatasetFault::Cut { line })?;
            let row: Vec<&str> = row.split_whitespace().collect();
            if row.len() != 4 {
                let expected = "a row of the matrix is four numbers";
                return Err(DatasetFault::Width { line: at, found: row.len(), expected });
            }
            matrix.extend(numbers(&row, at)?);
        }
        let name = |number: &str| names.replace("{}", number);
        truths.push(Truth { source: name(j), target: name(i), overlap: None, motion: Motion::new(&matrix, line)? });
    }
    Ok(truths)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_second_scan_is_the_source() {
        let text = "0\t1\t60\n1 0 0 5\n0 1 0 0\n0 0 1 0\n0 0 0 1\n 4 9 60\n1 0 0 0\n0 0 -1 0\n0 1 0 2\n0 0 0 1\n";
        let read = parse(text, "cloud_bin_{}.ply").unwrap();
        assert_eq!((read[0].source.as_str(), read[0].target.as_str()), ("cloud_bin_1.ply", "cloud_bin_0.ply"));
        assert_eq!((read[0].motion.pose.translation.vector.x, read[1].motion.pose.translation.vector.z), (5.0, 2.0));
        assert_eq!(read[1].target, "cloud_bin_4.ply");
        assert_eq!(parse("0 1 60\n1 0 0 5\n", "{}"), Err(DatasetFault::Cut { line: 1 }));
    }
}
