//! OBJ and STL files: what is read, and what is refused with which words.

use haptics::mesh::{Mesh, TriangleSoup};
use nalgebra::Vector3;
use std::path::Path;
use world::model::{self, Format, line_of_face, read_obj, read_stl};

use crate::written;

/// A tetrahedron, plainly.
const PLAIN: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";

fn obj(text: &str) -> TriangleSoup {
    read_obj(text.as_bytes()).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

#[track_caller]
fn obj_refused(text: &str, message: &str) {
    let error = read_obj(text.as_bytes()).expect_err("the file is wrong");
    assert_eq!(error.to_string(), message, "{text}");
}

#[track_caller]
fn stl_refused(bytes: impl AsRef<[u8]>, message: &str) {
    let error = read_stl(bytes.as_ref()).expect_err("the file is wrong");
    assert_eq!(error.to_string(), message);
}

#[test]
fn every_way_to_write_a_tetrahedron_as_obj_is_the_same() {
    let plain = obj(PLAIN);
    assert_eq!((plain.vertices.len(), plain.faces.len()), (4, 4));
    assert_eq!(plain.faces[1], [0, 1, 3]);
    let ways = [
        PLAIN.replace('\n', "\r\n"),
        format!("\u{feff}{PLAIN}"),
        PLAIN.trim_end().to_owned(),
        PLAIN.replace("v 0 0 1", "\t v  0.0 0e5 +1  "),
        PLAIN.replace("v 1 0 0", "v 1 0 0 1.0"),
        PLAIN.replace("v 1 0 0", "v 1 0 0 0.5 0.25 1 # a colour"),
        PLAIN.replace("v 1 0 0", "v 1 0 0 nan nan nan"),
        PLAIN.replace("f 1 2 4", "f 1/1 2/2 4/3"),
        PLAIN.replace("f 1 2 4", "f 1//1 2//-1 4//1"),
        PLAIN.replace("f 1 2 4", "f 1/1/1 2/2/2 4/3/3 # with all"),
        PLAIN.replace("f 1 2 4", "f -4 -3 -1"),
        PLAIN.replace("f 1 2 4", "f 1 2 \\\n 4"),
        PLAIN.replace(
            "f 1 2 4",
            "usemtl no such\nmtllib none.mtl # nobody needs it\ng a b c\no thing\ns off\nf 1 2 4",
        ),
        PLAIN.replace("f 1 2 4", "vt 0 0\nvn 0 0 1\nl 1 2\np 1\n\n   \n# f 9 9 9\nf 1 2 4"),
        // Faces first: what they name comes later.
        PLAIN
            .lines()
            .rev()
            .map(|line| format!("{line}\n"))
            .filter(|line| line.starts_with('f'))
            .collect::<String>()
            + &PLAIN
                .lines()
                .filter(|line| line.starts_with('v'))
                .map(|line| format!("{line}\n"))
                .collect::<String>(),
    ];
    let built = |soup: TriangleSoup| Mesh::build(soup).expect("a tetrahedron").0;
    let expected = built(plain);
    for way in ways {
        let mesh = built(obj(&way));
        assert_eq!((mesh.vertices(), mesh.faces()), (expected.vertices(), expected.faces()), "{way}");
    }
    assert_eq!(obj("# caf\u{e9}\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3").faces, [[0, 1, 2]]);
    let mut latin = b"o caf\xe9\n".to_vec();
    latin.extend(PLAIN.as_bytes());
    assert_eq!(read_obj(&latin).expect("names may be in any encoding").faces.len(), 4);
}

#[test]
fn polygons_become_triangles_of_the_same_outline() {
    let pentagon = "v 0 0 0\nv 2 0 0\nv 3 1 0\nv 1 3 0\nv -1 1 0\nf 1 2 3 4 5\n";
    assert_eq!(obj(pentagon).faces, [[0, 1, 2], [0, 2, 3], [0, 3, 4]]);
    // An arrowhead: the fan from its first corner would leave the outline.
    let arrowhead = "v 0 0 0\nv 2 -1 0\nv 0 2 0\nv -2 -1 0\nf 2 3 4 1\n";
    let faces = obj(arrowhead).faces;
    assert!(
        faces.iter().all(|face| face.contains(&0) && face.contains(&2)),
        "cut from dent to tip: {faces:?}"
    );
}

#[test]
fn what_is_wrong_with_an_obj_is_told_with_its_line() {
    let corner = "corners such as 7, 7/2, 7//3 or 7/2/3 in whole numbers";
    let after = |line: &str| format!("v 0 0 0\nv 1 0 0\nv 0 1 0\n{line}\nf 1 2 3\n");
    let cases = [
        (
            "v 1 2",
            "found a vertex of 2 numbers; allowed: three coordinates, and perhaps a weight or a colour behind them",
        ),
        (
            "v 1 2 3 4 5",
            "found a vertex of 5 numbers; allowed: three coordinates, and perhaps a weight or a colour behind them",
        ),
        ("v 1 two 3", "found `two`; allowed: a finite number"),
        ("v 1 nan 3", "found `nan`; allowed: a finite number"),
        ("v 1 2 1e999", "found `1e999`; allowed: a finite number"),
        ("v 1 2 3 inf", "found `inf`; allowed: a finite number"),
        ("f 1 2", "found a face of 2 corners; allowed: three corners or more"),
        ("f", "found a face of 0 corners; allowed: three corners or more"),
        ("f 1 2 0", "found vertex 0; allowed: 1 to 3, or -3 to -1, since there are 3 vertices"),
        ("f 1 2 -4", "found vertex -4; allowed: 1 to 3, or -3 to -1, since there are 3 vertices"),
        ("f 1 2 4", "found vertex 4; allowed: 1 to 3, or -3 to -1, since there are 3 vertices"),
        (
            "f 1 2 99999999999",
            "found vertex 99999999999; allowed: 1 to 3, or -3 to -1, since there are 3 vertices",
        ),
        ("f 1 2 x", &format!("found `x`; allowed: {corner}")),
        ("f 1 2 3.0", &format!("found `3.0`; allowed: {corner}")),
        ("f 1 2 3/1/1/1", &format!("found `3/1/1/1`; allowed: {corner}")),
        ("f 1 2 /3", &format!("found `/3`; allowed: {corner}")),
        ("f 1 2 3/x", &format!("found `3/x`; allowed: {corner}")),
        ("f 1 2 9999999999999999999", &format!("found `9999999999999999999`; allowed: {corner}")),
        (
            "curv 0 1 1 2",
            "found `curv`, which belongs to free-form curves and surfaces; allowed: polygons (`v` and `f`): export \
             the model as a mesh, or take `kind = \"nurbs\"`",
        ),
        (
            "cstype bspline",
            "found `cstype`, which belongs to free-form curves and surfaces; allowed: polygons (`v` and `f`): export \
             the model as a mesh, or take `kind = \"nurbs\"`",
        ),
        (
            "wobble\x07 1",
            "found `wobble\\x07`; allowed: statements of OBJ, such as `v`, `f`, `vn`, `g` or `usemtl`, or a comment \
             after `#`",
        ),
    ];
    for (line, message) in cases {
        obj_refused(&after(line), &format!("line 4: {message}"));
        obj_refused(&after(line).replace('\n', "\r\n"), &format!("line 4: {message}"));
    }
    obj_refused(
        "v 0 0 0\n",
        "found no triangle in it, only a point, which has no surface; allowed: at least one",
    );
    obj_refused(
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nl 1 2\np 3\n",
        "found no triangle in it, only 3 points, which have no surface until a program for meshes makes one through them; \
         allowed: at least one",
    );
    obj_refused("", "found no triangle in it; allowed: at least one");
    obj_refused("f 1 2 3\n", "line 1: found vertex 1; allowed: a vertex, but there is none");
    let bow_tie = "v 0 0 0\nv 1 1 0\nv 1 0 0\nv 0 1 0\nv 2 1 1\n\nf 1 2 3 4 5\n";
    let error = read_obj(bow_tie.as_bytes()).err().map(|error| error.to_string()).unwrap_or_default();
    assert!(
        error.is_empty() || error.starts_with("line 7: found a face of 5 corners that cannot"),
        "{error}"
    );
}

#[test]
fn a_triangle_of_an_obj_knows_its_line() {
    let text = format!("# two faces on one line each\n{PLAIN}f 1 2 3 4\nf 1 2 3\n");
    let lines: Vec<_> = (0..8).map(|face| line_of_face(text.as_bytes(), face)).collect();
    assert_eq!(lines, [6, 7, 8, 9, 10, 10, 11].map(Some).into_iter().chain([None]).collect::<Vec<_>>());
}

/// A tetrahedron as text.
fn stl_text() -> String {
    let bytes = written::Format::StlText.write(&obj(PLAIN));
    String::from_utf8(bytes).expect("a text")
}

#[test]
fn stl_as_text_is_read_whatever_its_case_spacing_and_normals() {
    let text = stl_text();
    let soup = read_stl(text.as_bytes()).expect("a tetrahedron");
    assert_eq!((soup.vertices.len(), soup.faces.len()), (12, 4));
    assert_eq!(soup.vertices[3..6], [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]].map(Vector3::from));
    let ways = [
        text.replace('\n', "\r\n"),
        text.to_uppercase(),
        text.replace('\n', "  \n\n\t"),
        text.replace("facet normal 0 0 0", "facet normal nan -nan(ind) 1e999"),
        text.replace("solid mesh", "solid"),
        text.replace("endsolid mesh\n", "endsolid\n\n"),
        text.replace("solid mesh\nfacet", "solid facet normal of caf\u{e9}\nfacet"),
        format!("\u{feff}  \n{text}"),
    ];
    for way in ways {
        assert!(read_stl(way.as_bytes()).unwrap_or_else(|error| panic!("{error}\n{way}")) == soup, "{way}");
    }
    let twice = read_stl(format!("{text}{text}").as_bytes()).expect("two solids");
    assert_eq!(twice.faces.len(), 8);
}

#[test]
fn a_binary_stl_is_known_by_its_length_even_if_it_says_solid() {
    let soup = obj(PLAIN);
    let mut binary = written::Format::Stl.write(&soup);
    let read = read_stl(&binary).expect("a tetrahedron");
    assert_eq!(read, read_stl(stl_text().as_bytes()).expect("a tetrahedron"));
    for header in ["solid made by a program that does not care", "SOLID", "  solid"] {
        binary[..80].fill(b' ');
        binary[..header.len()].copy_from_slice(header.as_bytes());
        assert_eq!(read_stl(&binary).expect("still binary"), read, "{header}");
    }
    // Cut short, its length says nothing; the zero bytes of its count do.
    binary.truncate(200);
    stl_refused(
        &binary,
        "byte 200: found the end of the file after 2 of the 4 triangles that byte 80 promises; it may be cut short; \
         allowed: 284 bytes for 4 triangles",
    );
}

#[test]
fn what_is_wrong_with_a_binary_stl_is_told_with_its_byte() {
    let good = written::Format::Stl.write(&obj(PLAIN));
    stl_refused(
        &good[..283],
        "byte 283: found the end of the file after 3 of the 4 triangles that byte 80 promises; it may be cut short; \
         allowed: 284 bytes for 4 triangles",
    );
    let with_count = |count: u32| [&good[..80], &count.to_le_bytes(), &good[84..]].concat();
    stl_refused(
        with_count(3),
        "byte 234: found 50 bytes behind the 3 triangles that byte 80 promises; allowed: the end of the file, or a \
         count of 4 triangles",
    );
    stl_refused(
        with_count(u32::MAX),
        "byte 284: found the end of the file after 4 of the 4294967295 triangles that byte 80 promises; it may be cut \
         short; allowed: 214748364834 bytes for 4294967295 triangles",
    );
    for short in [&good[..83], b"", b"short"] {
        let message = read_stl(short).expect_err("too short").to_string();
        assert!(
            message.starts_with(&format!("byte {}: found the end of the file", short.len())),
            "{message}"
        );
        assert!(message.contains("at least 84 bytes, or a text that begins with `solid`"), "{message}");
    }
    let mut empty = with_count(0);
    empty.truncate(84);
    stl_refused(&empty, "found no triangle in it; allowed: at least one");
    for (bad, shown) in [(f32::NAN, "NaN"), (f32::INFINITY, "inf"), (f32::NEG_INFINITY, "-inf")] {
        // The y of corner 1 of triangle 2.
        let at = 84 + 2 * 50 + 12 + 12 + 4;
        let bytes = [&good[..at], &bad.to_le_bytes(), &good[at + 4..]].concat();
        let corner = read_stl(&good).expect("good").vertices[7];
        stl_refused(
            bytes,
            &format!(
                "byte 208: found corner 1 of triangle 2 (counted from 0) at [{:?}, {shown}, {:?}]; allowed: finite numbers",
                corner.x, corner.z
            ),
        );
    }
}

#[test]
fn what_is_wrong_with_an_stl_text_is_told_with_its_line() {
    let text = stl_text();
    let end = "the end of the file; it may be cut short";
    let line_of = |what: &str| 1 + text[..text.find(what).expect("it is there")].matches('\n').count();
    let cut = &text[..text.rfind("endsolid").expect("an end")];
    stl_refused(cut, &format!("line 30: found {end}; allowed: `facet` or `endsolid`"));
    let cut = &text[..text.find("endloop").expect("a loop")];
    stl_refused(cut.trim_end(), &format!("line 6: found {end}; allowed: `endloop`"));
    assert_eq!(line_of("endloop"), 7);
    let cases = [
        ("endloop", "vertex 1 2 3\nendloop", "line 7: found `vertex`; allowed: `endloop`"),
        ("vertex 0 0 0", "vertex 0 0", "line 5: found `vertex`; allowed: a finite number"),
        ("vertex 0 0 0", "vertex 0 nan 0", "line 4: found `nan`; allowed: a finite number"),
        ("vertex 0 0 0", "vortex 0 0 0", "line 4: found `vortex`; allowed: `vertex`"),
        ("facet normal 0 0 0", "facet norm 0 0 0", "line 2: found `norm`; allowed: `normal`"),
        ("facet", "face\x1bt", "line 2: found `face\\x1bt`; allowed: `facet` or `endsolid`"),
    ];
    for (good, bad, message) in cases {
        stl_refused(text.replacen(good, bad, 1), message);
    }
    stl_refused(format!("{text}junk"), "line 31: found `junk`; allowed: `solid`, or the end of the file");
    stl_refused("solid empty\nendsolid empty\n", "found no triangle in it; allowed: at least one");
}

#[test]
fn decimal_commas_and_an_obj_under_the_name_of_an_stl_are_told_as_what_they_are() {
    obj_refused(
        "v 0,5 1 2\n",
        "line 1: found `0,5`; allowed: a finite number; a decimal number has a point, as in 0.1",
    );
    stl_refused(
        stl_text().replacen("vertex 0", "vertex 0,5", 1),
        "line 4: found `0,5`; allowed: a finite number; a decimal number has a point, as in 0.1",
    );
    let long = format!("{}{PLAIN}", "# made elsewhere\n".repeat(10));
    for text in [PLAIN, &*long] {
        let said = read_stl(text.as_bytes()).expect_err("an OBJ").to_string();
        assert!(said.contains("looks like OBJ") && said.contains("let its name end in .obj"), "{said}");
    }
}

#[test]
fn a_file_whose_content_is_not_what_its_name_says_is_told_as_both() {
    let ply = b"ply\nformat ascii 1.0\nelement vertex 0\nend_header\n";
    for (name, bytes, said) in [
        (
            "a.obj",
            &ply[..],
            "found PLY in a file whose name says OBJ; allowed: a name that ends in .ply for that",
        ),
        (
            "a.ply",
            PLAIN.as_bytes(),
            "found OBJ in a file whose name says PLY; allowed: a name that ends in .obj for that",
        ),
        (
            "a.3ds",
            PLAIN.as_bytes(),
            "found OBJ in a file whose name says 3DS; allowed: a name that ends in .obj for that",
        ),
        (
            "a.ase",
            b"glTF\x02",
            "found glTF in a file whose name says ASE; allowed: a name that ends in .gltf or .glb",
        ),
        (
            "a.obj",
            b"v 0 0 0\rv 1 0 0\rv 0 1 0\rf 1 2 3\r",
            "cannot be read: its lines end in carriage returns alone, as of old Macintoshes; save it with the line ends of \
             Unix or Windows",
        ),
        ("a.stl", b"solid a\rfacet normal 0 0 1\router loop\r", "its lines end in carriage returns alone"),
        ("a.ply", b"ply\rformat ascii 1.0\r", "its lines end in carriage returns alone"),
        ("a.3mf", b"PK\x03\x04", "found a file of 3MF, which is not read"),
        ("a.vtp", b"<VTKFile>", "found a file of VTK, which is not read"),
        ("a.obj", b"\xff\xfev\0 \0", "cannot be read: it is UTF-16 text; save the file as UTF-8"),
    ] {
        let found = model::read(Path::new(name), bytes).expect_err("refused").to_string();
        assert!(found.contains(said), "{found}");
    }
}

#[test]
fn a_message_stays_short_whatever_the_file_holds() {
    let long = "x".repeat(1_000_000);
    for text in [format!("v 0 0 {long}"), format!("f 1 2 {long}"), long.clone()] {
        let message = read_obj(text.as_bytes()).expect_err("nonsense").to_string();
        assert!(message.len() < 300 && !message.contains('\n'), "{message}");
    }
    for text in [format!("solid\n{long}"), format!("solid\nfacet normal 0 0 0 outer loop vertex {long}")] {
        let message = read_stl(text.as_bytes()).expect_err("nonsense").to_string();
        assert!(message.len() < 300 && !message.contains('\n'), "{message}");
    }
}

#[test]
fn the_ending_says_the_format_and_where_it_does_not_the_content_does() {
    let (binary, text, obj) = (written::Format::Stl.write(&obj(PLAIN)), stl_text(), PLAIN);
    let of = |name: &str, bytes: &[u8]| Format::of(Path::new(name), bytes);
    for name in ["a.obj", "a.OBJ", "b.c.Obj"] {
        assert_eq!(of(name, &binary), Some(Format::Obj), "the name wins");
    }
    for name in ["a.stl", "a.STL", "b.Stl"] {
        assert_eq!(of(name, obj.as_bytes()), Some(Format::Stl), "the name wins");
    }
    for name in ["a", "a.dat", "obj", ".stl"] {
        assert_eq!(of(name, &binary), Some(Format::Stl));
        assert_eq!(of(name, text.as_bytes()), Some(Format::Stl));
        assert_eq!(of(name, obj.as_bytes()), Some(Format::Obj));
        assert_eq!(of(name, b"\n# comment\n\nmtllib x\n"), Some(Format::Obj));
        assert_eq!(of(name, b"plyers\nformat ascii 1.0\n"), None);
        assert_eq!(of(name, b""), None);
    }
    let message = model::read(Path::new("a.csv"), b"t,x\n").expect_err("none of them").to_string();
    assert!(message.contains("of no kind that is read"), "{message}");
}

#[test]
fn files_that_cannot_be_read_are_refused() {
    let directory = tempfile::tempdir().expect("a directory");
    let refused = |file: &Path| model::load(file).expect_err("it cannot be read").to_string();
    assert_eq!(refused(&directory.path().join("none.stl")), "no such file; name an existing one");
    assert_eq!(refused(directory.path()), "it is a directory, no regular file; name a file");
    assert_eq!(refused(Path::new("/dev/zero")), "it is a device, no regular file; name a file");
    // A file of holes: it takes no room on the disk, and is not read.
    let large = directory.path().join("large.stl");
    std::fs::File::create(&large).and_then(|file| file.set_len((1 << 30) + 1)).expect("a file of holes");
    assert_eq!(refused(&large), "larger than 1073741824 bytes; allowed: at most so many");
}

/// Corners of all faces as single precision, which is all that binary STL holds.
fn corners(soup: &TriangleSoup) -> Vec<[f32; 3]> {
    let corner = |index: &u32| soup.vertices[*index as usize];
    soup.faces.iter().flatten().map(|index| corner(index).data.0[0].map(|x| x as f32)).collect()
}

#[test]
fn every_kind_of_mesh_says_the_same_in_every_format() {
    for (name, number, make) in written::KINDS {
        let soup = make(number, 0.04);
        let [obj, stl, text] = [
            read_obj(&written::Format::Obj.write(&soup)),
            read_stl(&written::Format::Stl.write(&soup)),
            read_stl(&written::Format::StlText.write(&soup)),
        ]
        .map(|read| read.expect("what we wrote"));
        assert!(corners(&obj) == corners(&stl) && corners(&obj) == corners(&text), "{name}");
        let is_one_sided = ["klein", "mobius"].contains(&name);
        for soup in [obj, stl, text] {
            let (mesh, report) = Mesh::build(soup).expect("a mesh");
            assert_eq!(report.is_clean(), !is_one_sided, "{name}: {report}");
            assert!(mesh.extent_m() > 0.0);
        }
    }
}

#[test]
fn the_committed_meshes_are_what_their_program_makes() {
    let committed = [
        ("cube.obj", "cuboid", None, written::Format::Obj),
        ("star.stl", "star", None, written::Format::StlText),
        ("bumpy.obj", "bumpy", None, written::Format::Obj),
        ("klein.stl", "klein", None, written::Format::Stl),
        ("coarse.obj", "sphere", Some(12), written::Format::Obj),
        ("bumpy-100k.stl", "bumpy", Some(316), written::Format::Stl),
    ];
    let meshes = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/meshes");
    for (file, kind, number, format) in committed {
        let (_, usual, make) = written::KINDS.into_iter().find(|(name, ..)| *name == kind).expect("a kind");
        let made = model::read(Path::new(file), &format.write(&make(number.unwrap_or(usual), 0.04)))
            .expect("what we wrote");
        let found = model::load(&meshes.join(file)).unwrap_or_else(|error| panic!("{file}: {error}"));
        assert_eq!(found.faces, made.faces, "{file}");
        for (found, made) in found.vertices.iter().zip(&made.vertices) {
            // Sines may differ in the last bit of an f32 between machines.
            assert!((found - made).amax() <= 2.0 * f64::from(f32::EPSILON) * 0.04, "{file}: {found} {made}");
        }
    }
    let count = meshes.read_dir().expect("the meshes").count();
    assert_eq!(count, committed.len(), "each has its program");
}
