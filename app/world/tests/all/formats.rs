//! PLY, glTF, ASE and 3DS files: what is read, and what is refused with which words.

use crate::made::{self, Ply};
use crate::written;
use haptics::mesh::{Mesh, TriangleSoup};
use nalgebra::Vector3;
use std::path::Path;
use world::model::{self, Format, ModelError, read_ase, read_gltf, read_ply, read_three_ds};

type Read = Result<TriangleSoup, ModelError>;

fn gltf(bytes: &[u8]) -> Read {
    read_gltf(bytes, None)
}

/// Corners of all faces in single precision, which is all that some of these hold.
fn corners(soup: &TriangleSoup) -> Vec<[f32; 3]> {
    let corner = |index: &u32| soup.vertices[*index as usize];
    soup.faces.iter().flatten().map(|index| corner(index).data.0[0].map(|x| x as f32 + 0.0)).collect()
}

#[track_caller]
fn refused(read: Read, message: &str) {
    assert_eq!(read.expect_err("the file is wrong").to_string(), message);
}

/// Three vertices of a triangle and one more, of a square.
fn square() -> TriangleSoup {
    let vertices =
        [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]].map(Vector3::from).to_vec();
    TriangleSoup { vertices, faces: vec![[0, 1, 2], [0, 2, 3]] }
}

#[test]
fn every_kind_of_mesh_says_the_same_in_every_format() {
    for (name, number, make) in written::KINDS {
        let soup = model::read_obj(&written::Format::Obj.write(&make(number, 0.04))).expect("what we wrote");
        let mut ways = vec![
            ("ase", read_ase(made::ase(&soup).as_bytes())),
            ("3ds", read_three_ds(&made::three_ds(&soup))),
            ("gltf", gltf(&made::gltf(&soup))),
            ("glb", gltf(&made::glb(&made::gltf_text(&soup, ""), &made::buffer(&soup)))),
        ];
        ways.extend(
            [Ply::Text, Ply::LittleEndian, Ply::BigEndian]
                .map(|how| ("ply", read_ply(&made::ply(&soup, how)))),
        );
        for (way, read) in ways {
            let read = read.unwrap_or_else(|error| panic!("{name} as {way}: {error}"));
            assert!(corners(&read) == corners(&soup), "{name} as {way}");
            assert_eq!(read.vertices.len(), soup.vertices.len(), "{name} as {way}");
            Mesh::build(read).expect("a mesh");
        }
    }
}

#[test]
fn the_ending_says_the_format_and_where_it_does_not_the_content_does() {
    let soup = square();
    let glb = made::glb(&made::gltf_text(&soup, ""), &made::buffer(&soup));
    let files = [
        ("ply", Format::Ply, made::ply(&soup, Ply::Text)),
        ("PLY", Format::Ply, made::ply(&soup, Ply::BigEndian)),
        ("gltf", Format::Gltf, made::gltf(&soup)),
        ("Glb", Format::Gltf, glb),
        ("ase", Format::Ase, made::ase(&soup).into_bytes()),
        ("3DS", Format::ThreeDs, made::three_ds(&soup)),
    ];
    for (ending, format, bytes) in files {
        for name in ["a", "a.dat", ending] {
            assert_eq!(Format::of(Path::new(name), &bytes), Some(format), "{ending} by content");
            assert_eq!(model::read(Path::new(name), &bytes).expect("a square").faces.len(), 2);
        }
        assert_eq!(
            Format::of(Path::new(&format!("a.{ending}")), b"v 0 0 0\n"),
            Some(format),
            "the name wins"
        );
    }
}

#[test]
fn files_of_other_programs_are_refused_with_what_to_export() {
    let of =
        |name: &str, bytes: &[u8]| model::read(Path::new(name), bytes).expect_err("not read").to_string();
    let cases: [(&str, &[u8], &str, &str); 10] = [
        ("a.max", b"", "3D Studio MAX", "export (File, Export) as OBJ"),
        ("a", b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1 and more", "3D Studio MAX", "export"),
        ("a.blend", b"BLENDER-v300", "Blender", "export (File, Export) as glTF"),
        ("a.FBX", b"Kaydara FBX Binary  \0", "FBX", "export as glTF 2.0 (.glb)"),
        ("a.stp", b"ISO-10303-21;", "STEP", "export as STL"),
        ("a", b"ISO-10303-21;\nHEADER;", "STEP", "export as STL"),
        ("a.dae", b"<?xml", "COLLADA", "assimp export"),
        ("a", b"<?xml version=\"1.0\"?>\n<COLLADA xmlns", "COLLADA", "assimp export"),
        ("a.wrl", b"#VRML V2.0 utf8", "VRML", "MeshLab"),
        ("a.usdz", b"", "USD", "Blender"),
    ];
    for (name, bytes, kind, advice) in cases {
        let said = of(name, bytes);
        let begin = format!("found a file of {kind}");
        assert!(said.starts_with(&begin) && said.contains(advice) && said.len() < 300, "{name}: {said}");
    }
    assert_eq!(
        of("a.dat", b"hello"),
        "of no kind that is read, by its name and by its beginning; allowed: OBJ, STL, PLY, glTF, ASE or 3DS files"
    );
}

// PLY

const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
                   element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n";

fn ply(text: &str) -> TriangleSoup {
    read_ply(text.as_bytes()).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

#[test]
fn a_ply_header_may_have_very_many_elements() {
    // Compared each with each they would take minutes.
    let many: String = (0..500_000).map(|i| format!("element e{i} 0\n")).collect();
    let with_many = PLY.replace("element vertex", &(many + "element vertex"));
    assert_eq!(corners(&ply(&with_many)), corners(&square()));
}

#[test]
fn every_way_to_write_a_square_as_ply_is_the_same() {
    let expected = corners(&square());
    let faces_first = "ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int vertex_indices\nelement vertex 4\n\
                       property float x\nproperty float y\nproperty float z\nend_header\n4 0 1 2 3\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n";
    let ways = [
        PLY.to_owned(),
        PLY.replace('\n', "\r\n"),
        PLY.trim_end().to_owned(),
        PLY.replace("vertex_indices", "vertex_index"),
        PLY.replace("float", "float64").replace("uchar int", "uint8 uint32"),
        PLY.replace("element face", "comment element face 9\nobj_info any thing\nelement face"),
        PLY.replace("float y", "int y").replace("float z", "short z"),
        PLY.replace("property float y", "property list uchar float ten\nproperty float y").replace("0 0 0\n1 0 0\n1 1 0\n0 1 0", "0 2 7 8 0 0\n1 0 0 0\n1 1 5 1 0\n0 0 1 0"),
        PLY.replace("element face", "element edge 2\nproperty int a\nproperty list int float b\nelement empty 4000000000\nelement face")
            .replace("4 0 1 2 3", "1 0\n2 2 0.5 nan\n4 0 1 2 3"),
        PLY.replace("element face 1\n", "element face 0\n").replace("end_header", "element tristrips 1\nproperty list int int vertex_indices\nend_header").replace("4 0 1 2 3", "5 -1 0 1 2 -1\n").replace("element tristrips 1", "element tristrips 2").trim_end().to_owned() + "\n3 0 2 3\n",
        // A line for each, and more on it than the header says, as MeshLab writes colours of corners.
        PLY.replace("4 0 1 2 3", "4 0 1 2 3 9 1 1 1 1 1 1 1 1 1").replace("1 1 0", "1 1 0 255"),
        faces_first.to_owned(),
    ];
    for way in ways {
        assert_eq!(corners(&ply(&way)), expected, "{way}");
    }
}

#[test]
fn strips_of_ply_turn_every_second_triangle_and_begin_anew_after_minus_one() {
    let strip = |list: &str| {
        let text = PLY.replace("element face", "element tristrips").replace("uchar int", "int int");
        ply(&text.replace("4 0 1 2 3", list)).faces
    };
    assert_eq!(strip("4 0 1 3 2"), [[0, 1, 3], [3, 1, 2]]);
    assert_eq!(strip("7 0 1 3 -1 3 1 2"), [[0, 1, 3], [3, 1, 2]]);
    // A repeated vertex makes no triangle, and turns the strip all the same.
    assert_eq!(strip("5 0 1 1 3 2"), [[1, 3, 2]].map(|face: [u32; 3]| face));
}

#[test]
fn binary_ply_has_all_kinds_of_numbers_in_either_order() {
    for is_big in [false, true] {
        let order = if is_big { "big" } else { "little" };
        let mut bytes = format!(
            "ply\nformat binary_{order}_endian 1.0\nelement other 1\nproperty list ushort double skipped\nelement vertex 4\n\
             property double x\nproperty char y\nproperty short z\nelement face 1\nproperty list uint ushort vertex_indices\nend_header\n"
        )
        .into_bytes();
        let mut put = |number: &[u8]| {
            let mut number = number.to_vec();
            if is_big {
                number.reverse();
            }
            bytes.extend(number);
        };
        put(&2_u16.to_le_bytes());
        put(&f64::NAN.to_le_bytes());
        put(&1.0_f64.to_le_bytes());
        for (x, y, z) in [(0.5_f64, 0_i8, -3_i16), (1.5, 0, -3), (1.5, -128, -3), (0.5, -128, -3)] {
            put(&x.to_le_bytes());
            put(&y.to_le_bytes());
            put(&z.to_le_bytes());
        }
        put(&4_u32.to_le_bytes());
        (0..4_u16).for_each(|index| put(&index.to_le_bytes()));
        let soup = read_ply(&bytes).expect("a square");
        assert_eq!(soup.vertices[2], Vector3::new(1.5, -128.0, -3.0));
        assert_eq!(soup.faces, [[0, 1, 2], [0, 2, 3]]);
    }
}

#[test]
fn what_is_wrong_with_a_ply_is_told_with_its_line_or_byte() {
    let changed = |from: &str, to: &str| read_ply(PLY.replacen(from, to, 1).as_bytes());
    let cases = [
        ("ply", "plywood", "line 1: found `plywood`; allowed: `ply`, as every PLY file begins"),
        (
            "ascii",
            "utf8",
            "line 2: found `utf8`; allowed: `format ascii 1.0`, `format binary_little_endian 1.0` or `format \
             binary_big_endian 1.0`",
        ),
        (
            "float y",
            "real y",
            "line 5: found `real`; allowed: char, uchar, short, ushort, int, uint, float or double",
        ),
        (
            "property float y\n",
            "",
            "line 3: found an element `vertex` without exactly one number `y`; allowed: properties `x`, `y` and `z`",
        ),
        (
            "vertex_indices",
            "corners",
            "line 7: found an element `face` without exactly one list `vertex_indices`; allowed: `property list uchar int \
             vertex_indices`, or `vertex_index`",
        ),
        ("element vertex 4", "element vertex -4", "line 3: found `-4`; allowed: a number of instances"),
        (
            "element face",
            "element vertex",
            "line 7: found a second element `vertex`; allowed: one of each name",
        ),
        (
            "element face",
            "elements face",
            "line 7: found `elements face 1`; allowed: `format`, `comment`, `obj_info`, `element`, `property` or \
             `end_header`",
        ),
        (
            "end_header",
            "",
            "line 10: found `0 0 0`; allowed: `format`, `comment`, `obj_info`, `element`, `property` or `end_header`",
        ),
        (
            "element vertex 4",
            "element vertex 4000000000",
            "line 3: found 4000000000 of element `vertex`, for which 34 bytes are left; allowed: 6 bytes or more for each; \
             the file may be cut short",
        ),
        (
            "element vertex 4",
            "element vertex 18446744073709551615",
            "line 3: found 18446744073709551615 of element `vertex`, for which 34 bytes are left; allowed: 6 bytes or more \
             for each; the file may be cut short",
        ),
        ("1 1 0", "1 nan 0", "line 12: found y = NaN; allowed: finite numbers"),
        ("1 1 0", "1 1e999 0", "line 12: found y = inf; allowed: finite numbers"),
        ("1 1 0", "1 one 0", "line 12: found `one`; allowed: a number"),
        ("4 0 1 2 3", "4 0 1 2 4", "line 14: found vertex 4; allowed: 0 to 3, since there are 4 vertices"),
        ("4 0 1 2 3", "4 0 1 2 -1", "line 14: found vertex -1; allowed: 0 to 3, since there are 4 vertices"),
        (
            "4 0 1 2 3",
            "4 0 1 2 0.5",
            "line 14: found vertex 0.5; allowed: 0 to 3, since there are 4 vertices",
        ),
        ("4 0 1 2 3", "2 0 1", "line 14: found a face of 2 corners; allowed: three corners or more"),
        (
            "4 0 1 2 3",
            "-4 0 1 2 3",
            "line 14: found a list of -4 numbers; allowed: a whole number, 0 or more",
        ),
        (
            "4 0 1 2 3",
            "3000000000 0 1 2",
            "line 15: found the end of the file; it may be cut short; allowed: a number",
        ),
        (
            "4 0 1 2 3",
            "4 0 1 2 3\n3 0",
            "line 15: found `3`; allowed: the end of the file, or larger numbers in the header",
        ),
    ];
    for (from, to, message) in cases {
        refused(changed(from, to), message);
    }
    let cloud = PLY.replace("element face 1", "element face 0").replace("4 0 1 2 3\n", "");
    refused(
        read_ply(cloud.as_bytes()),
        "found no triangle in it, only 4 points, which have no surface until a program for meshes makes one through them; \
         allowed: at least one",
    );
    refused(read_ply(b""), "line 1: found ``; allowed: `ply`, and a header that ends in `end_header`");
    refused(read_ply(b"ply\n"), "line 2: found the end of the file; allowed: `end_header`");
    let binary = made::ply(&square(), Ply::LittleEndian);
    refused(
        read_ply(&[&binary[..], b"more"].concat()),
        &format!(
            "byte {}: found 4 bytes behind what the header promises; allowed: the end of the file, or larger numbers in the header",
            binary.len()
        ),
    );
    let mut with_nan = binary.clone();
    let begin = binary.len() - 2 * 17 - 4 * 13;
    with_nan[begin + 4..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
    refused(read_ply(&with_nan), &format!("byte {}: found y = NaN; allowed: finite numbers", begin + 4));
    refused(
        read_ply(&binary[..binary.len() - 1]),
        &format!(
            "byte {}: found the end of the file; it may be cut short; allowed: as many numbers as the header says",
            binary.len() - 1
        ),
    );
    let short = read_ply(&binary[..binary.len() - 40]).expect_err("cut short").to_string();
    assert!(short.starts_with("line 4: found 4 of element `vertex`, for which "), "{short}");
}

// glTF

/// A document around one buffer, whose parts are JSON.
struct Document {
    nodes: String,
    primitives: String,
    accessors: String,
    views: String,
    buffer: Vec<u8>,
    more: String,
}

impl Document {
    /// A square of four floats and six bytes.
    fn square() -> Self {
        let mut buffer: Vec<u8> =
            square().vertices.iter().flatten().flat_map(|x| (*x as f32).to_le_bytes()).collect();
        buffer.extend([0_u8, 1, 2, 0, 2, 3]);
        Self {
            nodes: "{\"mesh\":0}".into(),
            primitives: "{\"attributes\":{\"POSITION\":0},\"indices\":1}".into(),
            accessors: "{\"bufferView\":0,\"componentType\":5126,\"count\":4,\"type\":\"VEC3\"},\
                        {\"bufferView\":1,\"componentType\":5121,\"count\":6,\"type\":\"SCALAR\"}"
                .into(),
            views: "{\"buffer\":0,\"byteLength\":48},{\"buffer\":0,\"byteOffset\":48,\"byteLength\":6}"
                .into(),
            buffer,
            more: "\"scenes\":[{\"nodes\":[0]}]".into(),
        }
    }

    fn text(&self) -> String {
        let Self { nodes, primitives, accessors, views, buffer, more } = self;
        format!(
            "{{\"asset\":{{\"version\":\"2.0\"}},\n{more},\n\"nodes\":[{nodes}],\n\"meshes\":[{{\"primitives\":[{primitives}]}}],\n\
             \"accessors\":[{accessors}],\n\"bufferViews\":[{views}],\n\"buffers\":[{{\"byteLength\":{}}}]}}",
            buffer.len()
        )
    }

    fn read(&self) -> Read {
        gltf(&made::glb(&self.text(), &self.buffer))
    }

    fn soup(&self) -> TriangleSoup {
        self.read().unwrap_or_else(|error| panic!("{error}\n{}", self.text()))
    }

    /// With one thing in its text that is another.
    fn changed(&self, from: &str, to: &str) -> Read {
        let text = self.text();
        assert!(text.contains(from), "{from} is not in {text}");
        gltf(&made::glb(&text.replacen(from, to, 1), &self.buffer))
    }
}

#[test]
fn nodes_of_gltf_put_meshes_where_they_and_their_parents_say() {
    let quarter = std::f64::consts::FRAC_1_SQRT_2;
    let mut document = Document::square();
    document.nodes = format!(
        "{{\"mesh\":0,\"children\":[1,2],\"translation\":[10,0,0]}},\
         {{\"mesh\":0,\"rotation\":[0,0,{quarter},{quarter}],\"scale\":[2,1,1]}},\
         {{\"mesh\":0,\"matrix\":[-1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,5,1]}},{{\"mesh\":0}}"
    );
    let soup = document.soup();
    // The last node is in no scene.
    assert_eq!((soup.vertices.len(), soup.faces.len()), (12, 6));
    let corners: Vec<Vector3<f64>> =
        soup.faces.iter().flatten().map(|&corner| soup.vertices[corner as usize]).collect();
    let expected = [
        [10.0, 0.0, 0.0],
        [11.0, 0.0, 0.0],
        [11.0, 1.0, 0.0],
        [10.0, 0.0, 0.0],
        [11.0, 1.0, 0.0],
        [10.0, 1.0, 0.0],
        // Stretched along x, then turned from x to y, then moved.
        [10.0, 0.0, 0.0],
        [10.0, 2.0, 0.0],
        [9.0, 2.0, 0.0],
        [10.0, 0.0, 0.0],
        [9.0, 2.0, 0.0],
        [9.0, 0.0, 0.0],
        // Mirrored, and so wound the other way round: still seen from +z.
        [10.0, 0.0, 5.0],
        [9.0, 1.0, 5.0],
        [9.0, 0.0, 5.0],
        [10.0, 0.0, 5.0],
        [10.0, 1.0, 5.0],
        [9.0, 1.0, 5.0],
    ];
    for (corner, expected) in corners.iter().zip(expected) {
        // A quaternion of rounded numbers.
        assert!((corner - Vector3::from(expected)).amax() < 1e-15 * 16.0, "{corner} {expected:?}");
    }
    // Without scenes all nodes are read, each once.
    document.more = "\"scene\":0".into();
    assert_eq!(document.soup().faces.len(), 8);
    document.more = "\"scene\":1,\"scenes\":[{},{\"nodes\":[3]}]".into();
    assert_eq!(document.soup().faces.len(), 2);
}

#[test]
fn meshes_of_gltf_that_no_node_shows_are_a_library_and_read_as_they_are() {
    let mut document = Document::square();
    let shown = corners(&document.soup());
    for (nodes, more) in [("", "\"scenes\":[]"), ("", "\"scenes\":[{}]"), ("{}", "\"scene\":0")] {
        (document.nodes, document.more) = (nodes.into(), more.into());
        assert_eq!(corners(&document.soup()), shown, "{nodes} {more}");
    }
    // A scene in which nothing is shown, of meshes that others show.
    (document.nodes, document.more) = ("{\"mesh\":0}".into(), "\"scenes\":[{}]".into());
    refused(document.read(), "found no triangle in it; allowed: at least one");
}

#[test]
fn triangles_strips_and_fans_of_gltf_are_read_and_points_and_lines_are_not() {
    let faces = |mode: u32, indices: &[u8]| {
        let mut document = Document::square();
        document.primitives = format!("{{\"attributes\":{{\"POSITION\":0}},\"indices\":1,\"mode\":{mode}}}");
        document.accessors =
            document.accessors.replace("\"count\":6", &format!("\"count\":{}", indices.len()));
        document.buffer.truncate(48);
        document.buffer.extend(indices);
        document.views =
            document.views.replace("\"byteLength\":6", &format!("\"byteLength\":{}", indices.len()));
        document.read().map(|soup| corners(&soup))
    };
    let square = corners(&square());
    assert_eq!(faces(4, &[0, 1, 2, 0, 2, 3]).expect("triangles"), square);
    assert_eq!(faces(6, &[0, 1, 2, 3]).expect("a fan"), square);
    let strip = faces(5, &[1, 2, 0, 3]).expect("a strip");
    assert_eq!(
        strip,
        [[1, 2, 0], [0, 2, 3]]
            .into_iter()
            .flatten()
            .map(|i: usize| { self::square().vertices[i].data.0[0].map(|x| x as f32) })
            .collect::<Vec<_>>()
    );
    for mode in 0..4 {
        refused(
            faces(mode, &[0, 1, 2, 3]).map(|_| self::square()),
            "found no triangle in it; allowed: at least one",
        );
    }
    refused(
        faces(7, &[0, 1, 2]).map(|_| self::square()),
        "meshes[0].primitives[0].mode: found 7; allowed: 0 to 6",
    );
    refused(
        faces(4, &[0, 1, 2, 3]).map(|_| self::square()),
        "meshes[0].primitives[0]: found 4 corners of triangles; allowed: three for each",
    );
    let mut plain = Document::square();
    plain.primitives = "{\"attributes\":{\"POSITION\":0},\"mode\":6},{\"attributes\":{\"NORMAL\":0}}".into();
    assert_eq!(corners(&plain.soup()), square, "without indices");
}

/// Each position times this, and moved.
fn placed(factor: f64, by: [f64; 3]) -> Vec<[f32; 3]> {
    let mut soup = square();
    soup.vertices.iter_mut().for_each(|vertex| *vertex = *vertex * factor + Vector3::from(by));
    corners(&soup)
}

#[test]
fn morph_targets_of_gltf_are_added_by_the_weights_of_the_node_or_else_of_the_mesh() {
    let mut document = Document::square();
    document.primitives = document
        .primitives
        .replace("\"indices\"", "\"targets\":[{\"NORMAL\":0},{\"POSITION\":0}],\"indices\"");
    assert_eq!(corners(&document.soup()), placed(1.0, [0.0; 3]), "no weights");
    let of_mesh = document.changed("[{\"primitives\"", "[{\"weights\":[1,1],\"primitives\"");
    assert_eq!(corners(&of_mesh.expect("a square")), placed(2.0, [0.0; 3]));
    document.nodes = "{\"mesh\":0,\"weights\":[1,0.5],\"translation\":[5,0,0]}".into();
    let of_node = document.changed("[{\"primitives\"", "[{\"weights\":[1,1],\"primitives\"");
    assert_eq!(corners(&of_node.expect("a square")), placed(1.5, [5.0, 0.0, 0.0]));
    document.accessors += ",{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"}";
    document.primitives = document.primitives.replace("{\"POSITION\":0}]", "{\"POSITION\":2}]");
    refused(
        document.read(),
        "meshes[0].primitives[0].targets[1]: found 3 elements; allowed: one for each of its 4 positions",
    );
}

/// Two joints, one of them moved by 7 and turned inside out, the other one by 1; both were bound where they were half as large.
fn skinned(weights: [u8; 4]) -> Document {
    let mut document = Document::square();
    document.more =
        "\"scenes\":[{\"nodes\":[0,1,2]}],\"skins\":[{\"joints\":[1,2],\"inverseBindMatrices\":4}]".into();
    document.nodes = "{\"mesh\":0,\"skin\":0,\"translation\":[5,0,0]},\
                      {\"translation\":[0,0,7],\"scale\":[1,1,-1]},{\"translation\":[0,0,1]}"
        .into();
    document.primitives =
        document.primitives.replace("\"POSITION\":0", "\"POSITION\":0,\"JOINTS_0\":2,\"WEIGHTS_0\":3");
    document.accessors += ",{\"bufferView\":2,\"componentType\":5121,\"count\":4,\"type\":\"VEC4\"},\
        {\"bufferView\":2,\"byteOffset\":16,\"componentType\":5121,\"normalized\":true,\"count\":4,\"type\":\"VEC4\"},\
        {\"bufferView\":3,\"componentType\":5126,\"count\":2,\"type\":\"MAT4\"}";
    document.views += ",{\"buffer\":0,\"byteOffset\":54,\"byteLength\":32},{\"buffer\":0,\"byteOffset\":86,\"byteLength\":128}";
    (0..4).for_each(|_| document.buffer.extend([0, 1, 0, 0]));
    (0..4).for_each(|_| document.buffer.extend(weights));
    let bound = nalgebra::Matrix4::<f32>::new_scaling(2.0);
    (0..2).for_each(|_| document.buffer.extend(bound.as_slice().iter().flat_map(|x| x.to_le_bytes())));
    document
}

#[test]
fn skins_of_gltf_put_vertices_where_their_joints_are_and_not_their_node() {
    let other = corners(&skinned([0, 255, 0, 0]).soup());
    assert_eq!(other, placed(2.0, [0.0, 0.0, 1.0]));
    // The mean, whatever the weights sum up to.
    let both = corners(&skinned([100, 100, 0, 0]).soup());
    assert_eq!(both, placed(2.0, [0.0, 0.0, 4.0]));
    // Inside out, so that each face has the other order.
    let mut turned = placed(2.0, [0.0, 0.0, 7.0]);
    turned.chunks_mut(3).for_each(|face| face.swap(1, 2));
    assert_eq!(corners(&skinned([255, 0, 0, 0]).soup()), turned);
    let document = skinned([255, 0, 0, 0]);
    for (from, to, said) in [
        ("\"skin\":0", "\"skin\":1", "nodes[0].skin = 1: found a reference to nothing; allowed: 0 to 0"),
        (
            "\"joints\":[1,2]",
            "\"joints\":[9]",
            "skins[0]: found joint 9, which the scene does not have; allowed: nodes of the scene",
        ),
        (
            "\"joints\":[1,2]",
            "\"joints\":[1,2,1]",
            "skins[0]: found 2 inverseBindMatrices; allowed: one for each of its 3 joints",
        ),
        (
            "\"MAT4\"",
            "\"VEC3\"",
            "accessors[4].type: found \"VEC3\"; allowed: MAT4, since a skin has it for its inverse bind matrices",
        ),
    ] {
        refused(document.changed(from, to), said);
    }
    let mut beyond = skinned([0, 255, 0, 0]);
    beyond.buffer[55] = 2;
    refused(
        beyond.read(),
        "meshes[0].primitives[0]: found joint 2; allowed: joints of its skin, of which there are 2, from 0",
    );
}

#[test]
fn an_extension_that_a_file_requires_and_a_shape_may_depend_on_is_refused() {
    let requires = |name: &str| {
        let more = format!("\"extensionsRequired\":[\"{name}\"],\"nodes\":[");
        Document::square().changed("\"nodes\":[{", &format!("{more}{{"))
    };
    for known in ["KHR_mesh_quantization", "KHR_materials_unlit", "KHR_texture_transform"] {
        assert_eq!(corners(&requires(known).expect("a square")), corners(&square()), "{known}");
    }
    refused(
        requires("EXT_mesh_gpu_instancing"),
        "extensionsRequired: found EXT_mesh_gpu_instancing; allowed: what the shape does not depend on; export it without",
    );
}

#[test]
fn indices_and_positions_of_gltf_have_all_kinds_the_format_has() {
    let expected = corners(&square());
    for (code, bytes) in [(5121, 1), (5123, 2), (5125, 4)] {
        let mut document = Document::square();
        document.accessors = document.accessors.replace("5121", &code.to_string());
        document.views = document.views.replace("\"byteLength\":6", &format!("\"byteLength\":{}", 6 * bytes));
        document.buffer.truncate(48);
        document
            .buffer
            .extend([0_u32, 1, 2, 0, 2, 3].iter().flat_map(|index| index.to_le_bytes()[..bytes].to_vec()));
        assert_eq!(corners(&document.soup()), expected, "{code}");
    }
    // Positions with their normals between them.
    let mut document = Document::square();
    let positions: Vec<u8> =
        document.buffer[..48].chunks(12).flat_map(|position| [position, &[0x7f; 12]].concat()).collect();
    document.buffer = [&[9; 4], &positions[..], &[0, 1, 2, 0, 2, 3]].concat();
    document.views = "{\"buffer\":0,\"byteOffset\":4,\"byteLength\":96,\"byteStride\":24},{\"buffer\":0,\"byteOffset\":100,\"byteLength\":6}".into();
    assert_eq!(corners(&document.soup()), expected);
    // Two bytes of which 32767 is 1, and whole bytes.
    let quantised = |code: u32, one: &[u8], normalized: &str| {
        let mut document = Document::square();
        let positions = square()
            .vertices
            .iter()
            .flatten()
            .flat_map(|x| if *x == 0.0 { vec![0; one.len()] } else { one.to_vec() })
            .collect::<Vec<_>>();
        document.views = format!(
            "{{\"buffer\":0,\"byteLength\":{}}},{{\"buffer\":0,\"byteOffset\":{},\"byteLength\":6}}",
            positions.len(),
            positions.len()
        );
        document.buffer = [&positions[..], &[0, 1, 2, 0, 2, 3]].concat();
        document.accessors = document.accessors.replace("5126", &format!("{code}{normalized}"));
        corners(&document.soup())
    };
    assert_eq!(quantised(5122, &32767_i16.to_le_bytes(), ",\"normalized\":true"), expected);
    assert_eq!(quantised(5121, &[255], ",\"normalized\":true"), expected);
    assert_eq!(quantised(5123, &[1, 0], ""), expected);
    // What differs from zero, or from what is there.
    let mut sparse = Document::square();
    sparse.accessors = sparse.accessors.replacen("\"bufferView\":0,", "", 1).replacen(
        "\"VEC3\"",
        "\"VEC3\",\"sparse\":{\"count\":3,\"indices\":{\"bufferView\":2,\"componentType\":5121},\"values\":{\"bufferView\":0,\"byteOffset\":12}}",
        1,
    );
    sparse.views += ",{\"buffer\":0,\"byteOffset\":54,\"byteLength\":3}";
    sparse.buffer.extend([1, 2, 3]);
    assert_eq!(corners(&sparse.soup()), expected);
}

#[test]
fn buffers_of_gltf_are_in_it_beside_it_or_below_and_nowhere_else() {
    let soup = square();
    let directory = tempfile::tempdir().expect("a directory");
    let scene = directory.path().join("scene");
    std::fs::create_dir_all(scene.join("parts")).expect("a directory");
    for place in ["outside.bin", "scene/with space.bin", "scene/parts/a.bin"] {
        std::fs::write(directory.path().join(place), made::buffer(&soup)).expect("a file");
    }
    let read = |uri: &str| {
        let text = made::gltf_text(&soup, &format!("\"uri\":\"{uri}\","));
        std::fs::write(scene.join("a.gltf"), text).expect("a file");
        model::load(&scene.join("a.gltf"))
    };
    for uri in ["with%20space.bin", "with space.bin", "parts/a.bin"] {
        assert_eq!(corners(&read(uri).expect("a square")), corners(&soup), "{uri}");
    }
    let outside = directory.path().join("outside.bin").display().to_string();
    for uri in ["../outside.bin", "parts/../../outside.bin", "%2e%2e/outside.bin", &outside, ""] {
        let said = read(uri).expect_err("outside").to_string();
        assert!(
            said.starts_with("buffers[0].uri: found `") && said.contains("; allowed: a file beside this one"),
            "{said}"
        );
    }
    let said = read("http://example.org/a.bin").expect_err("not there").to_string();
    assert!(said.contains("no such file"), "{said}");
    let said = read("none.bin").expect_err("not there").to_string();
    assert_eq!(
        said,
        "buffers[0].uri: found `none.bin`; allowed: a file that can be read (no such file; name an existing one)"
    );
    std::fs::write(scene.join("short.bin"), b"short").expect("a file");
    let said = read("short.bin").expect_err("short").to_string();
    assert_eq!(said, "buffers[0]: found 5 bytes; allowed: 72, as its byteLength says; it may be cut short");
    for (uri, found) in [
        ("data:application/octet-stream,AAAA", "`application/octet-stream,AAAA`"),
        ("data:;base64,AA*A", "`*` as digit 9"),
    ] {
        let said = read(uri).expect_err("no base64").to_string();
        assert_eq!(said, format!("buffers[0].uri: found {found}; allowed: a data URI in base64"));
    }
}

#[test]
fn what_is_wrong_with_a_gltf_is_told_with_its_place() {
    let document = Document::square();
    for (version, found) in
        [("\"1.0\"", "\"1.0\""), ("1.0", "1.0"), ("1", "1"), ("null", "none"), ("[]", "none")]
    {
        let text =
            format!(r#"{{"accessors": {{"a": {{}}}}, "asset": {{"version": {version}}}, "meshes": {{}}}}"#);
        assert_eq!(
            gltf(text.as_bytes()).unwrap_err().to_string(),
            format!("asset.version: found {found}; allowed: \"2.0\"; export the model as glTF 2.0 or GLB")
        );
    }
    let cases = [
        (
            "\"2.0\"",
            "\"1.0\"",
            "asset.version: found \"1.0\"; allowed: \"2.0\"; export the model as glTF 2.0 or GLB",
        ),
        (
            "\"nodes\":[{\"mesh\":0}]",
            "\"extensionsRequired\":[\"KHR_draco_mesh_compression\"],\"nodes\":[]",
            "extensionsRequired: found KHR_draco_mesh_compression; allowed: geometry that is not compressed: export it \
             without, or unpack it (`gltf-transform copy`)",
        ),
        (
            "\"accessors\":[{\"bufferView\":0,",
            "\"extensionsUsed\":[\"KHR_draco_mesh_compression\"],\"accessors\":[{",
            "extensionsUsed: found KHR_draco_mesh_compression; allowed: geometry that is not compressed: export it \
             without, or unpack it (`gltf-transform copy`)",
        ),
        ("\"nodes\":[0]", "\"nodes\":[3]", "nodes[3]: found a reference to nothing; allowed: 0 to 0"),
        ("\"mesh\":0", "\"mesh\":1", "nodes[0].mesh = 1: found a reference to nothing; allowed: 0 to 0"),
        (
            "\"mesh\":0",
            "\"mesh\":0,\"children\":[0]",
            "nodes[0]: found a node that is reached in two ways; allowed: a tree: one parent for each",
        ),
        (
            "\"mesh\":0",
            "\"mesh\":0,\"rotation\":[0,0,0,0]",
            "nodes[0].rotation: found a quaternion of no length; allowed: one of length 1",
        ),
        (
            "\"mesh\":0",
            "\"mesh\":0,\"matrix\":[1,0,0,1,0,1,0,0,0,0,1,0,0,0,0,1]",
            "nodes[0].matrix: found a projection; allowed: a last row of 0, 0, 0, 1",
        ),
        (
            "\"mesh\":0",
            "\"mesh\":0,\"scale\":[1e308,1,1],\"translation\":[1e308,0,0]",
            "nodes[0]: found vertex 1 of meshes[0].primitives[0] beyond all numbers; allowed: a transform that leaves finite \
             coordinates",
        ),
        (
            "\"POSITION\":0",
            "\"POSITION\":5",
            "meshes[0].primitives[0].attributes.POSITION = 5: found a reference to nothing; allowed: 0 to 1",
        ),
        (
            "VEC3",
            "VEC2",
            "accessors[0].type: found \"VEC2\"; allowed: VEC3, since a primitive has it for its positions",
        ),
        (
            "SCALAR",
            "VEC2",
            "accessors[1].type: found \"VEC2\"; allowed: SCALAR, since a primitive has it for its indices",
        ),
        (
            "5126",
            "5125",
            "accessors[0].componentType: found 5125; allowed: 5120 to 5123 or 5126 for positions",
        ),
        ("5121", "5120", "accessors[1].componentType: found 5120; allowed: 5121, 5123 or 5125 for indices"),
        (
            "\"count\":4",
            "\"count\":5",
            "accessors[0]: found 5 elements of 12 bytes from byte 0, 12 apart; allowed: as many as 48 bytes of \
             bufferViews[0] hold",
        ),
        (
            "\"count\":4",
            "\"count\":4000000000",
            "accessors[0]: found 4000000000 elements, which makes more than 4194304 vertices, indices and primitives in all; allowed: at \
             most so many in a file of this size; leave repeated parts out",
        ),
        (
            "\"bufferView\":0,\"componentType\":5126,\"count\":4",
            "\"componentType\":5126,\"count\":18446744073709551615",
            "accessors[0]: found 18446744073709551615 elements, which makes more than 4194304 vertices, indices and primitives in all; \
             allowed: at most so many in a file of this size; leave repeated parts out",
        ),
        (
            "\"count\":4",
            "\"byteOffset\":18446744073709551615,\"count\":4",
            "accessors[0]: found 4 elements of 12 bytes from byte 18446744073709551615, 12 apart; allowed: as many as 48 bytes \
             of bufferViews[0] hold",
        ),
        (
            "\"count\":4",
            "\"count\":2",
            "accessors[1]: found element 2 = 2; allowed: indices of the 2 vertices of meshes[0].primitives[0], from 0",
        ),
        (
            "\"bufferView\":1",
            "\"bufferView\":2",
            "accessors[1].bufferView = 2: found a reference to nothing; allowed: 0 to 1",
        ),
        (
            "{\"buffer\":0,\"byteLength\":48}",
            "{\"buffer\":1,\"byteLength\":48}",
            "bufferViews[0].buffer = 1: found a reference to nothing; allowed: 0 to 0",
        ),
        (
            "\"byteLength\":48",
            "\"byteLength\":4800",
            "bufferViews[0]: found 4800 bytes from byte 0; allowed: a part of a buffer of 56 bytes",
        ),
        (
            "\"byteLength\":48",
            "\"byteStride\":8,\"byteLength\":48",
            "bufferViews[0]: found byteStride 8; allowed: 12 or more",
        ),
        (
            "\"nodes\":[{\"mesh\":0}]",
            "\"nodes\":[{\"mesh\":-1}]",
            "line 3: found invalid value: integer `-1`, expected a whole number, 0 or more; allowed: a text of glTF 2.0 (JSON)",
        ),
        (
            "\"mesh\":0",
            "\"mesh\":0,\"scale\":[1e999,1,1]",
            "line 3: found number out of range; allowed: a text of glTF 2.0 (JSON)",
        ),
    ];
    for (from, to, message) in cases {
        refused(document.changed(from, to), message);
    }
    let mut with_nan = Document::square();
    with_nan.buffer[16..20].copy_from_slice(&f32::INFINITY.to_le_bytes());
    refused(with_nan.read(), "accessors[0]: found element 1 at [1.0, inf, 0.0]; allowed: finite numbers");
    refused(
        gltf(b"{\"asset\":"),
        "line 1: found EOF while parsing a value; allowed: a text of glTF 2.0 (JSON)",
    );
}

#[test]
fn a_glb_that_is_cut_short_is_told_so() {
    let good = made::glb(&Document::square().text(), &Document::square().buffer);
    let cut = |length: usize| gltf(&good[..length]).expect_err("cut").to_string();
    assert_eq!(
        cut(good.len() - 1),
        format!(
            "byte 8: found a length of {} bytes, of which {} are there; allowed: the file's length; it may be cut short",
            good.len(),
            good.len() - 1
        )
    );
    assert_eq!(
        cut(10),
        "byte 10: found the end of the file; it may be cut short; allowed: a header of 12 bytes"
    );
    let mut one = good.clone();
    one[4] = 1;
    refused(gltf(&one), "byte 4: found version 1; allowed: version 2; export the model as glTF 2.0");
    let mut long_text = good.clone();
    long_text[15] = 1;
    refused(
        gltf(&long_text),
        "byte 12: found no whole chunk JSON; allowed: a GLB begins with one; the file may be cut short",
    );
}

#[test]
fn a_small_gltf_cannot_ask_for_much_time_or_memory() {
    // The same million vertices again and again.
    let mut document = Document::square();
    document.buffer = vec![0; 1 << 20];
    document.views = "{\"buffer\":0,\"byteLength\":1048576}".into();
    document.accessors =
        "{\"bufferView\":0,\"componentType\":5120,\"count\":300000,\"type\":\"VEC3\"}".into();
    document.primitives = vec!["{\"attributes\":{\"POSITION\":0}}"; 1000].join(",");
    let said = document.read().expect_err("too much").to_string();
    assert!(said.contains("more than 4194304 vertices, indices and primitives in all"), "{said}");
    // Three thousand nodes with a mesh of three thousand primitives, none of which has a vertex.
    let many = |one: &str| vec![one; 3000].join(",");
    let [nodes, primitives] = [many("{\"mesh\":0}"), many("{}")];
    let text = format!(
        "{{\"asset\":{{\"version\":\"2.0\"}},\"nodes\":[{nodes}],\"meshes\":[{{\"primitives\":[{primitives}]}}]}}"
    );
    let said = gltf(text.as_bytes()).expect_err("too many").to_string();
    assert!(said.contains("more than 4194304 vertices, indices and primitives in all"), "{said}");
    // Nothing but braces.
    let braces =
        format!("{{\"asset\":{{\"version\":\"2.0\"}},\"nodes\":[{}]}}", vec!["{}"; 300_000].join(","));
    let said = gltf(braces.as_bytes()).expect_err("too many").to_string();
    assert_eq!(
        said,
        "JSON: found a text of 300002 objects; allowed: 262144 at most: join its nodes and meshes"
    );
    // Brackets in brackets.
    assert!(gltf(format!("{{\"nodes\":{}", "[".repeat(1 << 20)).as_bytes()).is_err());
}

// ASE

#[test]
fn meshes_of_ase_are_put_together_and_their_animations_are_not() {
    let one = made::ase(&square());
    let object = &one[one.find("*GEOMOBJECT").expect("an object")..];
    let animated = object.replacen(
        "\t}\n\t*PROP",
        "\t}\n\t*MESH_ANIMATION {\n*MESH {\n*MESH_VERTEX_LIST {\n*MESH_VERTEX 0 1 1 1\n}\n*MESH_FACE_LIST {\n*MESH_FACE 0: A: 0 B: 0 C: 0\n}\n}\n}\n\t*PROP",
        1,
    );
    assert!(animated.contains("ANIMATION"));
    let both = read_ase(format!("{one}{animated}").as_bytes()).expect("two squares");
    assert_eq!(both.vertices.len(), 8);
    assert_eq!(both.faces, [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]]);
    let tight = one.replace(":  A: ", ": A:").replace(" B: ", " B:").replace("\t", " ").replace('\n', "\r\n");
    assert_eq!(corners(&read_ase(tight.as_bytes()).expect("a square")), corners(&square()));
}

#[test]
fn what_is_wrong_with_an_ase_is_told_with_its_line() {
    let good = made::ase(&square());
    let changed = |from: &str, to: &str| {
        assert!(good.contains(from), "{from}");
        read_ase(good.replacen(from, to, 1).as_bytes())
    };
    let cases = [
        (
            "*3DSMAX_ASCIIEXPORT",
            "3DSMAX",
            "line 1: found `3DSMAX`; allowed: `*3DSMAX_ASCIIEXPORT`, as every ASE file begins",
        ),
        ("*MESH_VERTEX 1\t1", "*MESH_VERTEX 1\tnan", "line 15: found `nan`; allowed: a finite number"),
        (
            "*MESH_VERTEX 1\t1",
            "*MESH_VERTEX 1\t1,5",
            "line 15: found `1,5`; allowed: a finite number, with a point: 1.5",
        ),
        (
            "*MESH_VERTEX 1\t",
            "*MESH_VERTEX 4000000000\t",
            "line 15: found `4000000000`; allowed: 1, the next vertex of the mesh",
        ),
        ("C: 2", "C: 4", "line 20: found `4`; allowed: 0 to 3, since the mesh has 4 vertices"),
        ("C: 2", "C: -1", "line 20: found `-1`; allowed: 0 to 3, since the mesh has 4 vertices"),
        ("C: 2", "D: 2", "line 20: found `D`; allowed: `C:` of a face"),
        (
            "*PROP_MOTIONBLUR 0\n}\n",
            "*PROP_MOTIONBLUR 0\n",
            "line 25: found the end of the file; it may be cut short; allowed: `}`, the end of `*GEOMOBJECT`",
        ),
        ("*PROP_MOTIONBLUR 0\n}\n", "}\n}\n}\n", "line 25: found `}`; allowed: `{` before it"),
    ];
    for (from, to, message) in cases {
        let said = changed(from, to).expect_err("the file is wrong").to_string();
        // What helps with a comma is said elsewhere.
        if to.contains("1,5") {
            assert!(said.starts_with("line 15: found `1,5`; allowed: a finite number"), "{said}");
        } else {
            assert_eq!(said, message);
        }
    }
    refused(read_ase(b"*3DSMAX_ASCIIEXPORT 200\n"), "found no triangle in it; allowed: at least one");
}

// 3DS

#[test]
fn what_is_wrong_with_a_3ds_is_told_with_its_byte() {
    let good = made::three_ds(&square());
    let find = |chunk: [u8; 2]| good.windows(2).position(|bytes| bytes == chunk).expect("a chunk");
    let (vertices, faces) = (find([0x10, 0x41]), find([0x20, 0x41]));
    let changed = |at: usize, bytes: &[u8]| {
        let mut changed = good.clone();
        changed[at..][..bytes.len()].copy_from_slice(bytes);
        read_three_ds(&changed)
    };
    refused(changed(0, b"NN"), "byte 0: found no chunk 0x4D4D; allowed: one, as every 3DS file begins");
    refused(
        changed(vertices + 6, &[255, 255]),
        &format!(
            "byte {}: found 65535 vertices in a chunk with room for 4; allowed: as many as there are; the file may be cut short",
            vertices + 6
        ),
    );
    refused(
        changed(vertices + 8 + 12, &f32::NAN.to_le_bytes()),
        &format!("byte {}: found a vertex at [NaN, 0.0, 0.0]; allowed: finite numbers", vertices + 8 + 12),
    );
    refused(
        changed(faces + 8, &[9, 0]),
        &format!(
            "byte {}: found vertex 9; allowed: indices of the 4 vertices of its mesh, from 0",
            faces + 8
        ),
    );
    let length = good.len();
    refused(
        read_three_ds(&good[..length - 1]),
        &format!(
            "byte 0: found a chunk 0x4d4d of {length} bytes; allowed: 6 to {}, as many as are left; the file may be cut short",
            length - 1
        ),
    );
    refused(
        changed(faces + 2, &[0, 0, 0, 0]),
        &format!(
            "byte {faces}: found a chunk 0x4120 of 0 bytes; allowed: 6 to {}, as many as are left; the file may be cut short",
            length - 6 - faces
        ),
    );
    // A second object counts its vertices anew.
    let editor = find([0x3D, 0x3D]);
    let object = &good[find([0x00, 0x40])..length - 6];
    let two = made::chunk(0x4D4D, &made::chunk(0x3D3D, &[object, object].concat()));
    assert_eq!(
        read_three_ds(&two).expect("two").faces,
        [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]],
        "{editor}"
    );
}
