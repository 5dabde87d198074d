//! Headers as they are found in the wild.

use super::*;

/// Reads the busy square behind a header that `change` has been at.
fn check(change: impl Fn(String) -> Vec<u8>, claim: &str) {
    for encoding in ENCODINGS {
        let file = [change(header(encoding, &busy_square())), body(encoding, &busy_square())].concat();
        match scan(&file) {
            Ok(read) => assert_eq!(read, busy_square_scan(), "{encoding}, {claim}"),
            Err(error) => panic!("{encoding}, {claim}: {error}"),
        }
    }
}

#[test]
fn line_ends_blanks_and_comments_do_not_matter() {
    check(|h| h.replace('\n', "\r\n").into(), "carriage return and line feed");
    check(|h| h.replace('\n', "\r").into(), "carriage return");
    check(|h| h.replace('\n', " \t\n").into(), "trailing blanks");
    check(|h| h.replace(' ', "\t ").into(), "tabs");
    check(|h| h.replace('\n', "\n\n").replace("end_header\n\n", "end_header\n").into(), "blank lines");
    check(|h| h.replace("element face", "  element face").into(), "leading blanks");
    check(|h| h.replace("element", "comment\ncomment a  b\nobj_info num_cols 512\nelement").into(), "comments");
    check(|h| h.replace("format", "comment before the format\nformat").into(), "comment first");
    let latin = |h: String| [b"ply\ncomment Universit\xE4t \xFF\x80\x00\n".as_slice(), &h.as_bytes()[4..]].concat();
    check(latin, "Latin-1 comment");
}

#[test]
fn names_may_hold_anything_and_come_twice() {
    check(|h| h.replace("group", "scalar field (PCV) [<1]").into(), "blanks and brackets");
    check(|h| h.replace("group", "größe").into(), "umlauts");
    check(|h| h.replace("vertex1", "vertex2").into(), "two of one name");
    check(|h| h.replace("camera", "2d-camera").into(), "leading digit");
    check(|h| h.replace("group", "n0").into(), "a name like an alias");
}

#[test]
fn a_body_may_start_with_a_line_feed() {
    for end in ["\n", "\r\n", "\r"] {
        let head = "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty uchar x\nproperty uchar y\n\
                    property uchar z\nend_header\n";
        for first in [b'\n', b'\r', b' '] {
            let file = [head.replace('\n', end).as_bytes(), &[first, 2, 3]].concat();
            // Behind a lone carriage return this line feed is a number, as the first line shows.
            assert_eq!(scan(&file).unwrap().points, [[f64::from(first), 2.0, 3.0]], "{end:?} {first}");
        }
    }
}
