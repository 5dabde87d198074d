//! What must be refused, and with which words. Nothing may panic or take more memory than the file justifies.

use super::*;
use congruent_geometry::random::Stream;

fn check(name: &str, file: &[u8], expected: &[&str]) {
    let message = scan_from(Path::new(name), file).unwrap_err().to_string();
    assert!(message.starts_with(name), "{message}");
    for fragment in expected {
        assert!(message.contains(fragment), "`{fragment}` is not in: {message}");
    }
}

#[test]
fn broken_texts_are_refused_with_their_line() {
    check("a.xyz", b"x y z\n1 2 3\n4 five 6\n", &["(XYZ)", "line 3", "`five`", "export"]);
    check("a.xyz", b"1 2 3\n\n4 5\n", &["line 3", "`4 5`", "expected 3 columns or more, found 2"]);
    check("a.csv", b"1,2,3\n4,,6\n", &["line 2", "``", "is not a number"]);
    check("a.csv", b"x y z\nbut no numbers\n", &["not in a supported format", "extension: csv"]);

    check("a.obj", b"v 0 0 0\nv 1 O 0\n", &["(OBJ)", "line 2", "`O`"]);
    check("a.obj", b"v 0 0 0\nv 1 0\n", &["line 2", "expected 3 numbers, found 2"]);
    for index in ["0", "2", "-2", "99999999999999999999", "x", "", "-9223372036854775808"] {
        check("a.obj", format!("v 0 0 0\nf 1 {index}/1 1\n").as_bytes(), &["line 2", "vertex index", "valid: 1 to 1"]);
        check("a.obj", format!("v 0 0 0\nvn 0 0 1\nf 1//1 1//{index}5 1\n").as_bytes(), &["line 3", "normal index"]);
    }

    check("a.off", b"OFF\n", &["(OFF)", "counts are missing", "cut short"]);
    check("a.off", b"OFF\nmany 1 0\n", &["line 2", "`many 1 0`", "numbers of vertices and faces"]);
    check("a.off", b"OFF\n99999999999 1 0\n0 0 0\n", &["promises 99999999999 vertices", "after 1", "cut short"]);
    check("a.off", b"OFF\n1 2 0\n0 0 0\n3 0 0 0\n", &["promises 2 faces", "after 1"]);
    check("a.off", b"OFF\n1 1 0\n0 0 0\n3 0 0 1\n", &["line 4", "vertex index 1", "0 to 1 exclusive"]);
    check("a.off", b"OFF\n1 1 0\n0 0 0\n4000000000 0 0\n", &["line 4", "expected 4000000000 corners, found 2"]);
    check("a.off", b"OFF\n1 1 0\n0 0 0\n3 0 -1 0\n", &["line 4", "`-1`", "not a whole number"]);
    check("a.off", b"OFF BINARY\n\0\0", &["binary OFF", "export it as text"]);
    check("a.off", b"4OFF\n1 0 0\n0 0 0 1\n", &["`4OFF`", "three dimensions"]);
}

#[test]
fn broken_stl_files_are_refused_with_their_facet() {
    let facet = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";
    let text = |facets: &str| format!("solid a\n{facet}{facets}endsolid a\n");
    check("a.stl", text(&facet.replace("1 0 0", "1 O 0")).as_bytes(), &["(STL)", "facet 2", "repair"]);
    check("a.stl", text("facet\n").as_bytes(), &["facet 2", "[\"facet\"]"]);
    check("a.stl", format!("solid a\n{facet}").as_bytes(), &["`endsolid`", "cut short"]);
    check("a.stl", b"solid", &["5 bytes", "84"]);
    let whole = file_of("stl");
    check("a.stl", &whole[..whole.len() - 1], &["promises 40 triangles", "holds 39", "cut short"]);
    check("a.dat", &whole[..whole.len() - 1], &["not in a supported format"]);
    check("a.stl", &[0xFF; 84], &["promises 4294967295", "holds 0"]);
}

/// The text of a PCD header with one entry replaced, and a body of nine words.
fn pcd(from: &str, to: &str) -> Vec<u8> {
    let text = "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 3\nHEIGHT 1\n\
                VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 3\nDATA ascii\n0 0 0\n1 0 0\n0 1 0\n";
    assert!(text.contains(from));
    text.replacen(from, to, 1).into_bytes()
}

#[test]
fn broken_pcd_files_are_refused() {
    assert_eq!(scan(&pcd("", "")).unwrap().points.len(), 3);
    check("a.pcd", &pcd("POINTS 3", "POINTS 4"), &["(PCD)", "promises 4 points", "cut short"]);
    for count in ["99999999999", "18446744073709551615"] {
        for data in ["ascii", "binary", "binary_compressed"] {
            let file = pcd("POINTS 3\nDATA ascii", &format!("POINTS {count}\nDATA {data}"));
            check("a.pcd", &file, &["promises", "cut short"]);
        }
        check("a.pcd", &pcd("COUNT 1 1 1", &format!("COUNT 1 {count} {count}")), &["promises 3", "cut short"]);
    }
    check("a.pcd", &pcd("1 0 0\n0 1", "1 O 0\n0 1"), &["point 2 of 3", "export"]);
    check("a.pcd", &pcd("x y z", "x y w"), &["no field `z`", "found: x, y, w"]);
    check("a.pcd", &pcd("x y z", "x y _"), &["no field `z`"]);
    check("a.pcd", &pcd("SIZE 4 4 4", "SIZE 4 4 3"), &["header", "size 3"]);
    check("a.pcd", &pcd("POINTS 3\n", ""), &["header", "POINTS"]);
    // An LZF block that promises more than it can hold.
    let mut file = pcd("POINTS 3\nDATA ascii", "POINTS 300000000\nDATA binary_compressed");
    let body = file.windows(11).position(|w| w == b"compressed\n").unwrap() + 11;
    file[body..body + 8].copy_from_slice(&[9, 0, 0, 0, 0x00, 0xA4, 0x93, 0xD6]);
    check("a.pcd", &file, &["promises 300000000", "cut short"]);
}

#[test]
fn broken_las_files_are_refused() {
    for extension in ["las", "laz"] {
        let name = format!("a.{extension}");
        let with = |at: usize, bytes: &[u8]| {
            let mut file = file_of(extension);
            file[at..at + bytes.len()].copy_from_slice(bytes);
            file
        };
        check(&name, b"LASF", &["(LAS)", "header", "cut short"]);
        check(&name, &with(107, &[0xFF; 4]), &["promises 4294967295 points", "cut short"]);
        check(&name, &with(104, &[0x3F]), &["header"]);
        check(&name, &with(100, &[0xFF; 4]), &["header"]);
        check(&name, &with(96, &[0xFF; 4]), &["promises 30", "holds 0 bytes"]);
    }
    // The table of chunks: its place stands before the points, its number of chunks four bytes into it.
    let whole = file_of("laz");
    let points = u32::from_le_bytes(whole[96..100].try_into().unwrap()) as usize;
    let table = u64::from_le_bytes(whole[points..points + 8].try_into().unwrap()) as usize;
    let mut file = whole.clone();
    file[table + 4..table + 8].fill(0xFE);
    check("a.laz", &file, &["chunk table"]);
    let mut file = whole.clone();
    file[points..points + 8].fill(0xFF);
    check("a.laz", &file, &["chunk table"]);
}

#[test]
fn broken_e57_files_are_refused() {
    check("a.e57", b"ASTM-E57", &["(E57)", "cut short"]);
    let whole = file_of("e57");
    check("a.e57", &whole[..whole.len() - 1024], &["header", "cut short"]);
    let mut file = whole.clone();
    file[32..40].fill(0x7F);
    check("a.e57", &file, &["description", "cut short"]);
    // Whole numbers that can have one value only take no bits, so any number of them fits.
    check("a.e57", &constant_e57(), &["scan 1 of 1", "3 points without data"]);
}

/// A file whose points take no bits.
fn constant_e57() -> Vec<u8> {
    use e57::{E57Writer, Record, RecordValue};
    let mut file = Vec::new();
    let mut writer = E57Writer::new(std::io::Cursor::new(&mut file), "file").unwrap();
    let fields = vec![Record::CARTESIAN_X_F64, Record::CARTESIAN_Y_F64, Record::CARTESIAN_Z_F64];
    let mut cloud = writer.add_pointcloud("scan", fields).unwrap();
    for _ in 0..3 {
        cloud.add_point(vec![RecordValue::Double(5.0); 3]).unwrap();
    }
    cloud.finalize().unwrap();
    let constant = |xml: String| {
        let (start, bounds) = xml.split_once("<prototype").unwrap();
        let (prototype, end) = bounds.split_once("</prototype>").unwrap();
        let prototype = prototype.replace("type=\"Float\"", "type=\"ScaledInteger\" minimum=\"5\" maximum=\"5\"");
        Ok(format!("{start}<prototype{prototype}</prototype>{end}"))
    };
    writer.finalize_customized_xml(constant).unwrap();
    drop(writer);
    file
}

/// A file cut at every length, by its extension.
#[test]
fn a_file_cut_anywhere_never_panics() {
    for extension in EXTENSIONS {
        let whole = file_of(extension);
        for length in 0..whole.len() {
            for name in ["scan.dat", "scan.stl"] {
                if let Err(error) = scan_from(Path::new(name), &whole[..length]) {
                    assert!(error.to_string().starts_with(name));
                }
            }
        }
        // What has a count knows that its last part is gone.
        if !["obj", "xyz", "csv"].contains(&extension) {
            assert!(scan(&whole[..whole.len() - 3]).is_err(), "{extension}");
        }
    }
}

/// Small files of every format and encoding, without what makes them long.
fn seeds() -> Vec<(&'static str, Vec<u8>)> {
    let compressed = crate::pcd::encode(&sheet(), pcd_rs::DataKind::BinaryCompressed);
    let mut seeds: Vec<(&str, Vec<u8>)> = EXTENSIONS.map(|extension| (extension, file_of(extension))).into();
    seeds.push(("pcd", compressed));
    seeds.push(("pcd", pcd("", "")));
    seeds.push(("stl", b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid a\n".to_vec()));
    seeds
}

#[test]
fn damaged_files_never_panic() {
    let mut stream = Stream::new(20, 5);
    for (extension, whole) in seeds() {
        let name = format!("scan.{extension}");
        let mut n_read = 0;
        for _ in 0..3000 {
            let mut file = whole.clone();
            // Half of the damage goes to the first part, where the header is.
            let reach = if stream.below(2) == 0 { file.len() } else { file.len().min(400) } as u32;
            for _ in 0..=stream.below(4) {
                let at = stream.below(reach) as usize;
                match stream.below(5) {
                    0 => file[at] = stream.below(256) as u8,
                    1 => file[at] = b"\r\n 0123456789-.eE"[stream.below(17) as usize],
                    2 => file[at] ^= 1 << stream.below(8),
                    3 => file.truncate(at.max(reach as usize)),
                    _ => file[at] = [0, 0xFF][stream.below(2) as usize],
                }
            }
            if extension == "e57" && stream.below(4) != 0 {
                seal(&mut file);
            }
            if let Ok(read) = scan_from(Path::new(&name), &file) {
                n_read += 1;
                assert!(read.triangles.iter().flatten().all(|&i| (i as usize) < read.points.len()), "{extension}");
                assert!(read.normals.is_none_or(|n| n.len() == read.points.len()), "{extension}");
            }
        }
        assert!((50..2990).contains(&n_read), "{extension}: {n_read}");
    }
}

/// Puts right checksums (CRC-32C, big-endian) behind each page, so that damage gets past them.
fn seal(file: &mut [u8]) {
    for page in file.chunks_exact_mut(1024) {
        let (content, checksum) = page.split_at_mut(1020);
        let crc = content.iter().fold(!0u32, |crc, &byte| {
            (0..8).fold(crc ^ u32::from(byte), |crc, _| (crc >> 1) ^ (0x82F6_3B78 & (crc & 1).wrapping_neg()))
        });
        checksum.copy_from_slice(&(!crc).to_be_bytes());
    }
}
