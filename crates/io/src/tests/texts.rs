//! Text files as other programs write them.

use super::*;

const SQUARE: [[f64; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.5]];

fn square(text: &str) -> RawScan {
    let read = scan(text.as_bytes()).unwrap_or_else(|error| panic!("{error}: {text}"));
    assert_eq!(read.points, SQUARE, "{text}");
    read
}

#[test]
fn lines_of_numbers_are_read_whatever_parts_them() {
    let rows = ["0 0 0", "1 0 0", "1 1 0", "0 1 .5"];
    for delimiter in [" ", "\t", ",", ";", ", ", "; ", "   "] {
        for end in ["\n", "\r\n", "\r"] {
            for head in ["", "x y z\n", "4\n", "# made by hand\n\n", "//X Y Z\n", "4\nx y z\n", "\u{feff}"] {
                for tail in ["", " 7", " 7 8 9 label"] {
                    let line = |row: &&str| format!("{row}{tail}").replace(' ', delimiter) + "\n";
                    let text = format!("{head}{}", rows.iter().map(line).collect::<String>()).replace('\n', end);
                    assert_eq!(square(&text).normals, None, "{text}");
                }
            }
        }
    }
    square("\"x\",\"y\",\"z\"\n\"0\",\"0\",\"0\"\n1,0,0,\n1,1,0,\n0,1,5e-1,\n");
}

#[test]
fn a_header_says_which_columns_are_the_coordinates() {
    let read =
        square("id,label,Z,\"Y\",x,nz,ny,nx\n7,a,0,0,0,1,0,0\n8,b,0,0,1,1,0,0\n9,c,0,1,1,0,1,0\n10,d,0.5,1,0,0,0,1\n");
    assert_eq!(read.normals.unwrap()[2..], [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]);
    // Without names that are known, the first three columns are.
    assert_eq!(square("east;north;up;id\n0;0;0;1\n1;0;0;2\n1;1;0;3\n0;1;.5;4\n").normals, None);
    assert_eq!(scan(b"x,y,z\n").unwrap().points, [[0.0; 3]; 0]);
    assert!(scan(b"id,x,y,z\n1,2,3,4\n1,2,3\n").unwrap_err().contains("expected 4 columns or more, found 3"));
}

#[test]
fn unit_columns_are_normals_and_colours_are_not() {
    let with = |tails: [&str; 4]| {
        let rows = ["0 0 0", "1 0 0", "1 1 0", "0 1 0.5"];
        let text: String = rows.iter().zip(tails).map(|(row, tail)| format!("{row} {tail}\n")).collect();
        square(&text).normals
    };
    let normals = with(["0 0 1", "0.71 0.71 0", "0 0 0", "-1 0 0 255"]).unwrap();
    assert_eq!((normals[0], normals[1], normals[3]), ([0.0, 0.0, 1.0], [0.71, 0.71, 0.0], [-1.0, 0.0, 0.0]));
    assert_eq!(with(["0 0 1", "0 0 1", "0 0 1", "0 0 2"]), None);
    assert_eq!(with(["0 0 1", "0 0 1", "0 0 1", "0 1"]), None);
    assert_eq!(with(["0 0 0", "0 0 0", "0 0 0", "0 0 0"]), None);
    assert_eq!(with(["12 200 40", "1 0 0", "0 0 1", "9 9 9"]), None);
}

#[test]
fn wavefront_files_of_all_dialects_are_read() {
    let vertices = "v 0 0 0\nv 1 0 0 0.5 0.5 0.5\nv 1 1 0\nv 0 1 .5\n";
    let faces = [[0, 1, 2], [0, 2, 3]];
    assert_eq!(square(vertices).triangles, [[0; 3]; 0]);
    for face in ["f 1 2 3 4", "f 1/1 2/1 3/1 4/1", "f -4 -3 -2 -1", "f 1 2 3\nf 1 3 4 # last"] {
        let read = square(&format!("# hand\nmtllib a.mtl\no thing\n{vertices}vt 0 0\ns off\n{face}\n"));
        assert_eq!((read.triangles.as_slice(), read.normals), (faces.as_slice(), None));
    }
    let normals = "vn 0 0 1\nvn 1 0 0\nvn 0 1 0\nvn 0 0 -1\n";
    let (up, x) = ([0.0, 0.0, 1.0], [1.0, 0.0, 0.0]);
    assert_eq!(square(&format!("{vertices}{normals}")).normals.unwrap()[1], x);
    let named = square(&format!("{vertices}{normals}f 1//2 2//2 3//1\nf 1//1 2//1 3//1\n"));
    assert_eq!(named.normals.unwrap(), [x, x, up, [0.0; 3]]);
    // Faces may come first where they count from the start.
    assert_eq!(square(&format!("g a\n{vertices}f 4 3 2\n")).triangles, [[3, 2, 1]]);
}

#[test]
fn off_files_of_all_dialects_are_read() {
    let body = "0 0 0\n1 0 0\n1 1 0\n0 1 .5\n4 0 1 2 3\n";
    for head in ["OFF\n4 1 0\n", "OFF 4 1 0\n", "OFF4 1 0\n", "# c\nOFF # c\n\n4 1 5 # c\n", "STOFF\n4 1 0\n"] {
        assert_eq!(square(&format!("{head}{body}")).triangles, [[0, 1, 2], [0, 2, 3]]);
    }
    let coloured = square("COFF\n4 0 0\n0 0 0 255 0 0 255\n1 0 0 1 1 1 1\n1 1 0 0 0 0 0\n0 1 0.5 9 9 9 9\n");
    assert_eq!(coloured.normals, None);
    let normals = square("NOFF\n4 1 0\n0 0 0 0 0 1\n1 0 0 0 0 1\n1 1 0 0 0 1\n0 1 .5 0 1 0\n3 0 1 2 255 0 0\n").normals;
    assert_eq!(normals.unwrap()[3], [0.0, 1.0, 0.0]);
}

/// Two triangles of text STL.
fn facets() -> String {
    let facet = |corners: [usize; 3]| {
        let vertices: String =
            corners.map(|i| format!("  vertex {:?} {:?} {:?}\n", SQUARE[i][0], SQUARE[i][1], SQUARE[i][2])).concat();
        format!("facet normal 0 0 0\n outer loop\n{vertices} endloop\nendfacet\n")
    };
    facet([0, 1, 2]) + &facet([0, 2, 3])
}

#[test]
fn stl_files_of_all_dialects_are_read() {
    let text = format!("solid thing\n{}endsolid thing\n", facets());
    let expected = [[0, 1, 2], [0, 2, 3]];
    assert_eq!(square(&text).triangles, expected);
    assert_eq!(square(&text.to_uppercase()).triangles, expected);
    assert_eq!(square(&text.replace(" thing", "")).triangles, expected);
    assert_eq!(square(&text.replace('\n', "\r\n")).triangles, expected);
    let two = text.replacen("endfacet\n", "endfacet\nendsolid a\n\nsolid b\n", 1);
    assert_eq!(square(&two).triangles, expected);

    let mut binary = crate::stl::encode(&square(&text));
    binary[..5].copy_from_slice(b"solid");
    assert_eq!(scan(&binary).unwrap().points, SQUARE);
    binary.extend(b"trailing");
    assert_eq!(scan_from(Path::new("scan.STL"), &binary).unwrap().points, SQUARE);
}

#[test]
fn pcd_files_of_other_writers_are_read() {
    let text = "VERSION .7\nCOLUMNS rgb x y z _ \nSIZE 4 4 4 4 1\nTYPE F F F F U\nCOUNT 1 1 1 1 3\nWIDTH 2\nHEIGHT 2\n\
                POINTS 4\nDATA ascii\n1e-30 0 0 0 1 2 3\n0 1 0 0 1 2 3\n0 1 1 0 1 2 3\nnan 0 1 .5 1 2 3\n";
    assert_eq!(square(text).viewpoint, None);
    for (told, expected) in
        [("0 0 0 1 0 0 0", None), ("1 2 3 1 0 0 0", Some([1.0, 2.0, 3.0])), ("0 0 0 0 1 0 0", Some([0.0; 3]))]
    {
        let text = text.replace("POINTS", &format!("VIEWPOINT {told}\nPOINTS"));
        assert_eq!(square(&format!("# by hand\n{text}")).viewpoint, expected);
    }
}

#[test]
fn ply_files_tell_the_viewpoint_in_comments_or_as_a_camera() {
    let text = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
                end_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0.5\n";
    assert_eq!(square(text).viewpoint, None);
    let comments = text.replace("element", "comment view_px 1.5\nobj_info view_py: -2\ncomment view_pz = 3\nelement");
    assert_eq!(square(&comments.replace("= ", "")).viewpoint, Some([1.5, -2.0, 3.0]));
    let element = "element camera 1\nproperty float view_px\nproperty float view_py\nproperty float view_pz\n\
                   property float x_axisx\nend_header";
    let camera = |place: &str| text.replace("end_header", element) + place + " 1\n";
    assert_eq!(square(&camera("1 2 3")).viewpoint, Some([1.0, 2.0, 3.0]));
    assert_eq!(square(&camera("0 0 0")).viewpoint, None);
}
