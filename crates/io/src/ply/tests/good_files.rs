//! What must be read, and how.

use super::*;
use crate::{read_scan, write_ply};
use congruent_geometry::Coordinates;
use congruent_geometry::random::Stream;

const TYPES: [&str; 16] = [
    "char", "uchar", "short", "ushort", "int", "uint", "float", "double", //
    "int8", "uint8", "int16", "uint16", "int32", "uint32", "float32", "float64",
];

#[test]
fn coordinates_of_every_type_are_read_in_every_encoding() {
    for encoding in ENCODINGS {
        for kind in TYPES {
            let properties = ["x", "y", "z"].map(|name| format!("{kind} {name}"));
            let vertices =
                Records::new("vertex", &properties.each_ref().map(String::as_str), &[&[&[1.0], &[2.0], &[100.0]]]);
            assert_eq!(scan(&encoded(encoding, &[vertices])).unwrap().points, [[1.0, 2.0, 100.0]], "{encoding} {kind}");
        }
    }
}

#[test]
fn coordinates_stay_in_single_precision_where_the_file_has_no_more() {
    for encoding in ENCODINGS {
        for (kind, is_more) in [("float", false), ("short", false), ("double", true), ("int", true)] {
            for more in [&[][..], &["uchar red"]] {
                let y = format!("{kind} y");
                let properties = [&["float x", &y, "float z"], more].concat();
                let row: Vec<&[f64]> = vec![&[7.0]; properties.len()];
                let vertices = Records::new("vertex", &properties, &[&row, &row]);
                let points = scan(&encoded(encoding, &[vertices])).unwrap().points;
                let is_double = matches!(points, Coordinates::Double(_));
                // A text may have more digits than the type of its numbers.
                assert_eq!(is_double, is_more || encoding == "ascii", "{encoding} {kind} {more:?}");
                assert_eq!(points, [[7.0; 3]; 2]);
            }
        }
    }
}

#[test]
fn coordinates_are_found_among_other_properties_in_any_order() {
    let orders: [&[&str]; 5] = [
        &["uchar red", "float x", "float y", "float z", "short group"],
        &["float z", "float y", "float x", "double quality"],
        &["float x", "uchar red", "float y", "float z"],
        &["float x", "float y", "float z", "float nx"],
        &["float x", "double y", "float z"],
    ];
    let value = |property: &str, record: f64| match property.split(' ').nth(1) {
        Some("x") => 1.5 + record,
        Some("y") => -2.25 * record,
        Some("z") => 4.0,
        _ => 7.0,
    };
    for (encoding, properties) in ENCODINGS.iter().flat_map(|e| orders.iter().map(move |order| (e, *order))) {
        let mut vertices = Records::new("vertex", properties, &[]);
        let record = |i| properties.iter().map(|property| vec![value(property, f64::from(i))]).collect();
        vertices.records = (0..5).map(record).collect();
        let expected: Vec<[f64; 3]> = (0..5).map(|i| [1.5 + f64::from(i), -2.25 * f64::from(i), 4.0]).collect();
        assert_eq!(scan(&encoded(encoding, &[vertices])).unwrap().points, expected, "{encoding} {properties:?}");
    }
}

#[test]
fn signs_and_full_ranges_survive() {
    let rows =
        [("char", -128.0), ("short", -32768.0), ("ushort", 65535.0), ("int", -2147483648.0), ("uint", 4294967295.0)];
    for encoding in ENCODINGS {
        for (kind, v) in rows {
            let properties = ["x", "y", "z"].map(|name| format!("{kind} {name}"));
            let vertices = Records::new("vertex", &properties.each_ref().map(String::as_str), &[&[&[v], &[1.0], &[v]]]);
            assert_eq!(scan(&encoded(encoding, &[vertices])).unwrap().points, [[v, 1.0, v]], "{encoding} {kind}");
        }
    }
}

#[test]
fn faces_of_every_index_type_and_both_names_are_read() {
    let integers = TYPES.iter().filter(|kind| kind.contains("int") || kind.contains("char") || kind.contains("short"));
    for encoding in ENCODINGS {
        for kind in integers.clone() {
            for name in ["vertex_index", "vertex_indices"] {
                let mut elements = busy_square();
                elements[2].properties[1] = format!("list {kind} {kind} {name}");
                assert_eq!(
                    scan(&encoded(encoding, &elements)).unwrap(),
                    busy_square_scan(),
                    "{encoding} {kind} {name}"
                );
            }
        }
    }
}

#[test]
fn elements_come_in_any_order() {
    for encoding in ENCODINGS {
        let mut elements = busy_square();
        for _ in 0..elements.len() {
            elements.rotate_left(1);
            assert_eq!(scan(&encoded(encoding, &elements)).unwrap(), busy_square_scan(), "{encoding}");
        }
    }
}

#[test]
fn polygons_become_fans_and_those_without_an_area_nothing() {
    for encoding in ENCODINGS {
        let mut elements = busy_square();
        let corners: [&[f64]; 6] =
            [&[], &[3.0], &[0.0, 1.0], &[2.0, 1.0, 0.0], &[3.0, 2.0, 1.0, 0.0], &[0.0, 1.0, 2.0, 3.0, 1.0]];
        elements[2].records = corners.iter().map(|c| vec![vec![], c.to_vec(), vec![0.0]]).collect();
        let triangles = scan(&encoded(encoding, &elements)).unwrap().triangles;
        assert_eq!(triangles, [[2, 1, 0], [3, 2, 1], [3, 1, 0], [0, 1, 2], [0, 2, 3], [0, 3, 1]]);
    }
}

#[test]
fn normals_are_read_when_all_three_are_there() {
    for encoding in ENCODINGS {
        let mut vertices = Records::new(
            "vertex",
            &["double nz", "float x", "float y", "float ny", "float z", "float nx"],
            &[&[&[0.5], &[1.0], &[2.0], &[-0.5], &[3.0], &[0.25]]],
        );
        let read = scan(&encoded(encoding, &[vertices.clone()])).unwrap();
        assert_eq!(
            (read.points, read.normals),
            (vec![[1.0, 2.0, 3.0]].into(), Some(vec![[0.25, -0.5, 0.5]])),
            "{encoding}"
        );
        vertices.properties[3] = "float other".into();
        let read = scan(&encoded(encoding, &[vertices])).unwrap();
        assert_eq!((read.points, read.normals), (vec![[1.0, 2.0, 3.0]].into(), None), "{encoding}");
    }
}

#[test]
fn empty_clouds_and_trailing_bytes_are_fine() {
    for encoding in ENCODINGS {
        let empty = Records::new("vertex", &["float x", "float y", "float z"], &[]);
        let file = encoded(encoding, &[empty]);
        assert_eq!(scan(&file).unwrap(), RawScan::default());
        assert_eq!(scan(file.trim_ascii_end()).unwrap(), RawScan::default());
        let file = [encoded(encoding, &busy_square()), b"\n\0 left over".to_vec()].concat();
        assert_eq!(scan(&file).unwrap(), busy_square_scan());
    }
}

#[test]
fn records_without_properties_take_no_bytes_and_no_time() {
    let text = "ply\nformat ascii 1.0\nelement nothing 18446744073709551615\nelement vertex 1\n\
                property float x\nproperty float y\nproperty float z\nend_header\n1 2 3";
    assert_eq!(scan(text.as_bytes()).unwrap().points, [[1.0, 2.0, 3.0]]);
}

fn ascii_points(n: usize, body: &str) -> Vec<[f64; 3]> {
    let text = format!(
        "ply\nformat ascii 1.0\nelement vertex {n}\n\
         property float x\nproperty double y\nproperty int z\nend_header\n{body}"
    );
    scan(text.as_bytes()).unwrap().points.to_vec()
}

#[test]
fn ascii_numbers_come_in_every_spelling() {
    assert_eq!(ascii_points(2, "1.0E-05 .5 1.\n+3 -4e2 0005"), [[1e-5, 0.5, 1.0], [3.0, -400.0, 5.0]]);
    assert_eq!(ascii_points(1, "0.1 123456789.123456789 -0"), [[0.1, 123456789.12345679, 0.0]]);
    let odd = ascii_points(2, "nan NaN -nan\ninf -inf Infinity\n");
    assert!(odd[0].iter().all(|v| v.is_nan()));
    assert_eq!(odd[1], [f64::INFINITY, f64::NEG_INFINITY, f64::INFINITY]);
}

#[test]
fn ascii_rows_may_be_split_or_shared() {
    let expected = [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]];
    for body in ["1 2 3\n4 5 6\n", "1 2 3 4 5 6", "1\n2\n\n3 4\r\n5\t6", " 1  2 3 \r 4 5 6 \r", "1\r2\r3\r4\r5\r6"] {
        assert_eq!(ascii_points(2, body), expected, "{body:?}");
    }
}

#[test]
fn broken_coordinates_are_passed_on() {
    for encoding in ENCODINGS {
        let vertices = Records::new(
            "vertex",
            &["float x", "double y", "float z"],
            &[&[&[f64::NAN], &[f64::NEG_INFINITY], &[1.0]]],
        );
        let [x, y, z] = scan(&encoded(encoding, &[vertices])).unwrap().points.at(0);
        assert!(x.is_nan() && y == f64::NEG_INFINITY && z == 1.0, "{encoding}");
    }
}

#[test]
fn written_files_come_back_bit_for_bit() {
    let folder = tempfile::tempdir().unwrap();
    let mut stream = Stream::new(11, 0);
    for (as_float, normals, triangles) in
        [(false, false, false), (true, true, false), (false, true, true), (true, false, true)]
    {
        let mut coordinate = || {
            let v = stream.between(-1e6, 1e6);
            if as_float { f64::from(v as f32) } else { v }
        };
        let points: Coordinates = (0..50).map(|_| [coordinate(), coordinate(), coordinate()]).collect();
        let normals = normals.then(|| points.iter().map(|p| p.map(|v| (v / 1e6) as f32)).collect::<Vec<_>>());
        let triangles: Vec<[u32; 3]> = if triangles { (0..48).map(|i| [i, i + 1, i + 2]).collect() } else { vec![] };
        let path = folder.path().join("scan.ply");
        write_ply(&path, &points, normals.as_deref(), &triangles).unwrap();
        let header = String::from_utf8_lossy(&std::fs::read(&path).unwrap()).into_owned();
        assert_eq!(header.contains("property float x"), as_float);
        assert_eq!(read_scan(&path).unwrap(), RawScan { points, normals, triangles, ..RawScan::default() });
    }
}

#[test]
fn odd_values_are_written_as_floats_where_floats_hold_them() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scan.ply");
    for (v, kind) in
        [(f64::NAN, "float"), (f64::INFINITY, "float"), (-0.0, "float"), (1e300, "double"), (0.1, "double")]
    {
        write_ply(&path, &vec![[v, 0.0, 0.0]].into(), None, &[]).unwrap();
        let file = std::fs::read(&path).unwrap();
        assert!(String::from_utf8_lossy(&file).contains(&format!("property {kind} x")), "{v}");
        let back = read_scan(&path).unwrap().points.at(0)[0];
        assert!(back.to_bits() == v.to_bits() || (back.is_nan() && v.is_nan()), "{v}");
    }
}
