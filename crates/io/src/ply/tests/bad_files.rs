//! What must be refused, and with which words. Nothing may panic or ask for more memory than the file justifies.

use super::*;
use congruent_geometry::random::Stream;

fn check(file: &[u8], expected: &[&str]) {
    let message = scan(file).unwrap_err().to_string();
    assert!(message.starts_with("scan.ply: "), "{message}");
    for fragment in expected {
        assert!(message.contains(fragment), "`{fragment}` is not in: {message}");
    }
}

/// A file of three vertices and two triangles, with the first `from` in it replaced.
fn changed(from: &str, to: &str) -> Vec<u8> {
    let text = "ply\nformat ascii 1.0\ncomment c\n\
                element vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
                element face 2\nproperty list uchar int vertex_indices\nend_header\n\
                0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 2 1 0\n";
    assert!(text.contains(from), "nothing to change");
    text.replacen(from, to, 1).into_bytes()
}

#[test]
fn the_unchanged_file_is_read() {
    assert_eq!(scan(&changed("", "")).unwrap().triangles, [[0, 1, 2], [2, 1, 0]]);
}

#[test]
fn broken_headers_are_refused_with_line_and_text() {
    let format = "save the file as ascii 1.0";
    check(&changed("ascii 1.0", "ascii 2.0"), &["line 2", "`format ascii 2.0`", format]);
    check(&changed("ascii 1.0", "ascii 99999999.0"), &["line 2", format]);
    check(&changed("ascii 1.0", "ascii"), &["line 2", format]);
    check(&changed("ascii 1.0", "binary 1.0"), &["line 2", "`format binary 1.0`", format]);
    check(&changed("format ascii 1.0\n", ""), &["header line 9", "`end_header`", "expected a `format` line before it"]);
    check(&changed("comment c", "format binary_big_endian 1.0"), &["line 3", format]);
    check(&changed("comment c", "what is this"), &["line 3", "`what is this`", "expected format, element", "export"]);
    check(&changed("comment c", "ply"), &["line 3"]);
    check(&changed("comment c", "property float q"), &["line 3", "after an element"]);
    check(&changed("float y", "half y"), &["line 6", "`property half y`", "double"]);
    check(&changed("float y", "float"), &["line 6", "expected `property TYPE NAME`"]);
    check(&changed("list uchar int", "list uchar"), &["line 9"]);
    check(&changed("element face", "element vertex"), &["line 8", "declared above"]);
    check(&changed("end_header\n", ""), &["no `end_header` line"]);
    check(&changed("comment c", &"\x07".repeat(100)), &["…", "\\u{7}"]);
    check(b"ply", &["no `end_header` line"]);
    check(b"ply\nend_header", &["format"]);
    check(b"plywood\n", &["not in a supported format"]);
    check(b"", &["not in a supported format"]);
}

#[test]
fn counts_that_are_no_counts_are_refused() {
    for count in ["99999999999999999999999", "-1", "3.5", "many", "", "0x3", "18446744073709551616"] {
        check(&changed("vertex 3", &format!("vertex {count}")), &["line 4", "element vertex", "COUNT"]);
    }
}

#[test]
fn missing_parts_are_named_and_what_is_there_is_listed() {
    check(&changed("element vertex", "element point"), &["`vertex`", "found: point, face"]);
    check(b"ply\nformat ascii 1.0\nend_header\n", &["`vertex`", "found: none"]);
    check(&changed("float y", "float why"), &["`y`", "found: x, why, z"]);
    check(&changed("float z", "list uchar float z"), &["`z`", "found: x, y, z"]);
}

#[test]
fn broken_bodies_are_refused_with_their_place() {
    check(&changed("1 0 0", "1 O 0"), &["line 12", "`O`", "is not a number"]);
    check(&changed("1 0 0", "1,0 0 0"), &["line 12", "`1,0`"]);
    let returns = String::from_utf8(changed("1 0 0", "1 \u{e9} 0")).unwrap();
    check(returns.replace('\n', "\r").as_bytes(), &["line 12", "`é`"]);
    check(returns.replace('\n', "\r\n").as_bytes(), &["line 12", "`é`"]);
    check(&changed("3 2 1 0", "3 2 1 3"), &["face 2", "index 3", "0 to 3 exclusive"]);
    check(&changed("3 2 1 0", "3 2 -1 0"), &["face 2", "index -1"]);
    check(&changed("3 0 1 2", "3 0 nan 2"), &["face 1", "index NaN"]);
    check(&changed("3 0 1 2", "3 0 0.5 2"), &["face 1", "index 0.5"]);
    check(&changed("3 0 1 2", "-3 0 1 2"), &["`face` record 1", "length -3"]);
    check(&changed("3 0 1 2", "inf 0 1 2"), &["`face` record 1", "length inf"]);
    check(&changed("3 2 1 0", "3 2 1"), &["promises 2 `face`", "ends in record 2 after 1 whole", "cut short"]);
    check(&changed("face 2", "face 3"), &["promises 3 `face`", "after 2 whole"]);
}

#[test]
fn absurd_promises_end_with_the_file() {
    for encoding in ENCODINGS {
        for promise in ["4000000000", "18446744073709551615"] {
            let start = format!("ply\nformat {encoding} 1.0\n");
            let vertices =
                format!("element vertex {promise}\nproperty float x\nproperty double y\nproperty int z\nend_header\n");
            check(format!("{start}{vertices}").as_bytes(), &[promise, "`vertex`", "after 0 whole"]);
            check(format!("{start}{vertices}1 2 3  4 5 6  7 8 9  1 2 3  4 5 ").as_bytes(), &[promise, "`vertex`"]);
            for list in ["list uchar int vertex_index", "list int uchar vertex_index", "list uint double other"] {
                let faces = format!("element face {promise}\nproperty {list}\n");
                // In binary these letters are a length of 51 or of nearly a billion.
                let file = format!("{start}{faces}{vertices}3000000000");
                check(file.as_bytes(), &[promise, "`face`", "after 0 whole"]);
            }
        }
    }
}

#[test]
fn a_file_cut_anywhere_is_refused() {
    for encoding in ENCODINGS {
        let file = encoded(encoding, &busy_square());
        // Cutting the last number of an ASCII file may leave a number.
        let n_refused = if encoding == "ascii" { file.trim_ascii_end().len() - 1 } else { file.len() };
        for length in 0..n_refused {
            check(&file[..length], &[]);
        }
    }
}

#[test]
fn damaged_files_never_panic() {
    let mut stream = Stream::new(20, 4);
    for encoding in ENCODINGS {
        let whole = encoded(encoding, &busy_square());
        let mut n_read = 0;
        for _ in 0..3000 {
            let mut file = whole.clone();
            for _ in 0..=stream.below(4) {
                let at = stream.below(file.len() as u32) as usize;
                match stream.below(4) {
                    0 => file[at] = stream.below(256) as u8,
                    1 => file[at] = b"\r\n 0123456789-.eE"[stream.below(17) as usize],
                    2 => drop(file.remove(at)),
                    _ => file.insert(at, stream.below(256) as u8),
                }
            }
            match scan(&file) {
                Ok(read) => {
                    n_read += 1;
                    assert!(read.triangles.iter().flatten().all(|&i| (i as usize) < read.points.len()));
                }
                Err(error) => assert!(error.to_string().starts_with("scan.ply: ")),
            }
        }
        // The damage must be neither always harmless nor always caught at the first byte.
        assert!((100..2900).contains(&n_read), "{encoding}: {n_read}");
    }
}
