//! A line a pair: `source target m00 … m33`, parted by white space.

use super::lines::{at_line, lines, motion, numbers};
use super::{DatasetFault, Listed, Truth};

pub(super) fn parse(text: &str) -> Listed {
    lines(text)
        .map(|(line, content)| {
            let fields: Vec<&str> = content.split_whitespace().collect();
            if fields.len() != 18 {
                let expected = "a pair is two file names and the 16 numbers of a 4x4 matrix, row by row";
                return Err(DatasetFault::Width { line, found: fields.len(), expected });
            }
            let motion = motion(&numbers(&fields[2..], line)?, line)?;
            Ok(Truth {
                id: None,
                source: fields[0].to_owned(),
                target: fields[1].to_owned(),
                place: at_line(line),
                overlap: None,
                motion,
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::tests::whole;
    use super::*;

    #[test]
    fn a_line_is_a_pair() {
        let read = whole(parse("a.xyz b.xyz 0 -1 0 7 1 0 0 8 0 0 1 9 0 0 0 1\n\n"));
        assert_eq!((read[0].source.as_str(), read[0].target.as_str()), ("a.xyz", "b.xyz"));
        assert_eq!(read[0].motion.pose.translation.vector.y, 8.0);
        assert!(matches!(parse("a b 1 2\n")[..], [Err(DatasetFault::Width { line: 1, found: 4, .. })]));
    }
}
