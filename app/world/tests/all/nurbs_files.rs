//! Files of rational patches: what is read, and what is refused with which words.

use haptics::nurbs::make;
use haptics::{Nurbs, NurbsPatch, Surface};
use nalgebra::Vector3;
use std::fmt::Write;
use std::path::Path;
use world::model::{read_free_form, read_nurbs, read_patches, write_patches};

fn all() -> Vec<(&'static str, Vec<NurbsPatch>)> {
    vec![
        ("ball", make::sphere(0.04)),
        ("ring", make::torus(0.03, 0.01)),
        ("vase", make::vase(0.08)),
        ("mouse", make::mouse(0.08)),
        ("sheet", make::sheet(3, 0.08, 0.004)),
    ]
}

/// As a modeller writes it.
fn free_form(patches: &[NurbsPatch]) -> String {
    let mut text = String::from("# made for a test\n");
    let list = |numbers: &[f64]| numbers.iter().map(|x| format!("{x:?}")).collect::<Vec<_>>().join(" ");
    for patch in patches {
        patch.points.iter().for_each(|point| writeln!(text, "v {}", list(point)).unwrap());
        let [p, q] = patch.degree;
        let ends = |d: usize| {
            let knots = &patch.knots[d];
            [knots[patch.degree[d]], knots[knots.len() - 1 - patch.degree[d]]]
        };
        let count = patch.points.len() as i64;
        let corners: Vec<String> = (-count..0).map(|k| format!("{k}/1/1")).collect();
        let range = list(&[ends(0), ends(1)].concat());
        writeln!(
            text,
            "vt 0 0\nvn 0 0 1\ncstype rat bspline\ndeg {p} {q}\nsurf {range} \\\n {}",
            corners.join(" ")
        )
        .unwrap();
        writeln!(text, "parm u {}\nparm v {}\nend", list(&patch.knots[0]), list(&patch.knots[1])).unwrap();
    }
    text
}

#[test]
fn what_is_written_is_read_to_the_last_bit() {
    for (name, patches) in all() {
        let file = Path::new("x.toml");
        assert_eq!(read_nurbs(file, write_patches(&patches).as_bytes()).unwrap(), patches, "{name}");
        let text = free_form(&patches);
        assert_eq!(read_nurbs(Path::new("X.OBJ"), text.as_bytes()).unwrap(), patches, "{name}");
        // Without `rat`, and without weights, all are one.
        let plain = read_free_form(text.replace("rat ", "").as_bytes()).unwrap();
        assert!(plain.iter().flat_map(|patch| &patch.points).all(|point| point[3] == 1.0), "{name}");
    }
}

#[test]
fn curves_and_hints_beside_a_surface_are_passed_over() {
    let text = free_form(&make::sphere(0.04));
    let more = "curv2 1 2 3\nparm u 0 1 2\nend\nstech curv 1 1\nusemtl none\ng a\ncon 1 0 1 1 2 0 1 1\n";
    assert_eq!(read_free_form(format!("{more}{text}{more}").as_bytes()).unwrap(), make::sphere(0.04));
}

#[test]
fn the_models_in_config_are_what_the_program_writes_and_can_be_touched() {
    for (name, patches) in [
        ("ball", make::sphere(0.04)),
        ("ring", make::torus(0.03, 0.01)),
        ("vase", make::vase(0.08)),
        ("mouse", make::mouse(0.08)),
    ] {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../config/nurbs/{name}.toml"));
        let bytes = std::fs::read(&file).unwrap();
        assert_eq!(read_nurbs(&file, &bytes).unwrap(), patches, "{name}");
        let (nurbs, report) = Nurbs::build(&patches).unwrap();
        assert_eq!((report.rims, report.creases), (0, 0), "{name}: {report}");
        let far = Vector3::new(0.3, 0.5, -0.2);
        assert!(nurbs.surface(0.0).signed_distance(&far) > 0.1);
    }
}

#[track_caller]
fn toml_refused(text: &str, message: &str) {
    let error = read_patches(Path::new("p.toml"), text.as_bytes()).expect_err("the file is wrong");
    assert_eq!(error.to_string(), message, "{text}");
}

const PATCH: &str = "[[patch]]\ndegree = [1, 1]\nknots_u = [0, 0, 1, 1]\nknots_v = [0, 0, 1, 1]\n\
                     points = [[0, 0, 0], [1, 0, 0],\n  [0, 0, 1], [1, 0, 1, 2.0]]\n";

#[test]
fn what_is_wrong_with_a_toml_file_is_told_with_line_and_key() {
    assert_eq!(
        read_patches(Path::new("p.toml"), PATCH.as_bytes()).unwrap()[0].points[3],
        [1.0, 0.0, 1.0, 2.0]
    );
    let with = |from: &str, to: &str| {
        assert!(PATCH.contains(from));
        PATCH.replace(from, to)
    };
    toml_refused("", "p.toml:1: patch: missing; allowed: one table or more, each under its own [[patch]]");
    toml_refused(
        &with("degree = [1, 1]", "degree = [1, 8]"),
        "p.toml:2: patch[0].degree: found degree v: 8; allowed: 1 to 7",
    );
    toml_refused(
        &with("degree = [1, 1]", "degree = [1.5, 1]"),
        "p.toml:2: patch[0].degree: found degree u: 0; allowed: 1 to 7",
    );
    toml_refused(
        &with("knots_v = [0, 0, 1, 1]", "knots_v = [0, 1, 0.5, 1]"),
        "p.toml:4: patch[0].knots_v: found 0.5 after 1; allowed: numbers none of which is below the one before",
    );
    toml_refused(
        &with("knots_u = [0, 0, 1, 1]", "knots_u = [0, 0, 0, 1]"),
        "p.toml:3: patch[0].knots_u: found all of them 0; allowed: knots that leave a stretch in the middle",
    );
    toml_refused(
        &with("knots_u = [0, 0, 1, 1]", "knots_u = [0, 0, 0.5, 0.5, 1, 1]"),
        "p.toml:3: patch[0].knots_u: found 0.5 more than 1 times; allowed: at most 1 times, or the surface is torn there",
    );
    toml_refused(
        &with("knots_u = [0, 0, 1, 1]", "knots_u = [0, 0, 0.5, 1, 1]"),
        "p.toml:5: patch[0].points: found 4 points; allowed: 3 x 2 = 6, since that many go with the knots and degrees",
    );
    toml_refused(
        &with("[1, 0, 1, 2.0]", "[1, 0, 1, 0.0]"),
        "p.toml:5: patch[0].points: found points[3]: [1.0, 0.0, 1.0, 0.0]; \
         allowed: finite numbers, of which the fourth, the weight, is above 0",
    );
    toml_refused(
        &with("[1, 0, 1, 2.0]", "[1, 0, nan]"),
        "p.toml:6: patch[0].points[3][2]: found nan, which is not a finite number; allowed: a number",
    );
    toml_refused(
        &with("knots_u", "knot_u"),
        "p.toml:3: patch[0].knot_u: unknown key (did you mean `knots_u`?); allowed: degree, knots_u, knots_v, points",
    );
    let error = read_nurbs(Path::new("p.step"), b"").unwrap_err().to_string();
    assert_eq!(
        error,
        "neither TOML nor OBJ by its name; allowed: a file of patches that ends in .toml or .obj"
    );
}

#[track_caller]
fn obj_refused(text: &str, message: &str) {
    let error = read_free_form(text.as_bytes()).expect_err("the file is wrong");
    assert_eq!(error.to_string(), message, "{text}");
}

const PLANE: &str = "v 0 0 0\nv 1 0 0\nv 0 0 1\nv 1 0 1\ncstype bspline\ndeg 1 1\nsurf 0 1 0 1 1 2 3 4\n\
                     parm u 0 0 1 1\nparm v 0 0 1 1\nend\n";

/// By the knots that the format's description gives a Bezier surface: a segment between any two of `parm`.
#[test]
fn a_bezier_surface_is_the_b_spline_of_its_segments() {
    let plane = PLANE.replace("bspline", "bezier").replace("0 0 1 1\n", "0 1\n");
    assert_eq!(read_free_form(plane.as_bytes()).unwrap(), read_free_form(PLANE.as_bytes()).unwrap());
    let rows = (0..7).flat_map(|u| (0..2).map(move |v| format!("v {u} {} {v} 2\n", u * u)));
    let corners: String = (1..=14).map(|corner| format!(" {corner}")).collect();
    // The first direction runs first.
    let of_two = format!(
        "{}cstype rat bezier\ndeg 1 3\nsurf 5 6 0 4{corners}\nparm u 5 6\nparm v 0 1 4\nend\n",
        rows.collect::<String>()
    );
    let [patch] = &read_free_form(of_two.as_bytes()).unwrap()[..] else { panic!("one patch") };
    let knots = [vec![5.0, 5.0, 6.0, 6.0], vec![0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 4.0, 4.0, 4.0, 4.0]];
    assert_eq!((patch.degree, &patch.knots), ([1, 3], &knots));
    assert!(patch.points.iter().all(|point| point[3] == 2.0));
    obj_refused(
        &plane.replace("parm v 0 1", "parm v 0"),
        "line 9: found 1 parameters of a Bezier surface of degree 1; allowed: one for each end of a segment, two or more; \
         and a degree of 1 or more",
    );
    obj_refused(
        &plane.replace("parm v 0 1", "parm v 0 1 2"),
        "line 7: found points: 4 points; allowed: 2 x 3 = 6, since that many go with the knots and degrees",
    );
}

#[test]
fn what_is_wrong_with_an_obj_file_is_told_with_its_line() {
    assert_eq!(read_free_form(PLANE.as_bytes()).unwrap().len(), 1);
    let with = |from: &str, to: &str| {
        assert!(PLANE.contains(from));
        PLANE.replace(from, to)
    };
    obj_refused("v 0 0 0\n", "found no free-form surface in it; allowed: at least one");
    obj_refused(
        &with("end\n", "trim 0 1 1\nend\n"),
        "line 10: found `trim`; allowed: whole surfaces: export the model without trimming",
    );
    obj_refused(
        &with("end\n", ""),
        "line 7: found a surface without an end; allowed: `end` behind its `parm` statements",
    );
    obj_refused(
        &with("cstype bspline", "cstype rat cardinal"),
        "line 5: found `rat cardinal`; allowed: `cstype bspline` or `cstype bezier`, with `rat` before the name where \
         weights count",
    );
    obj_refused(&with("1 2 3 4", "1 2 3 5"), "line 7: found vertex `5`; allowed: 1 to 4, or -4 to -1");
    obj_refused(
        &with("surf 0 1 0 1", "surf 0 0.5 0 1"),
        "line 7: found a part of a surface, [0.0, 0.5, 0.0, 1.0]; allowed: all of it, [0.0, 1.0, 0.0, 1.0]",
    );
    obj_refused(
        &with("parm v 0 0 1 1", "parm v 0 0 1"),
        "line 9: found knots v: 3 knots; allowed: 4 or more at degree 1",
    );
    obj_refused(
        &with("parm v 0 0 1 1\n", ""),
        "line 9: found a surface without knots; allowed: `parm u` and `parm v` before `end`",
    );
    obj_refused(
        &with("deg 1 1\n", ""),
        "line 6: found a surface of no kind; allowed: `cstype` and `deg` before the first surface",
    );
    obj_refused(&with("v 1 0 1", "v 1 0 nan"), "line 4: found `nan`; allowed: a finite number");
    obj_refused(
        &with("end\n", "end\nf 1 2 3\n"),
        "line 11: found a polygon; allowed: free-form surfaces only; polygons are a shape of kind \"mesh\"",
    );
    obj_refused(
        &with("end\n", "end\nwhatever\n"),
        "line 11: found `whatever`; allowed: statements of OBJ, or a comment after `#`",
    );
}

#[test]
fn no_cut_or_bitten_file_makes_a_reader_panic() {
    let toml = write_patches(&make::sphere(0.04));
    let obj = free_form(&make::mouse(0.08));
    let mut state = 1u64;
    for round in 0..4000 {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let text = if round % 2 == 0 { toml.as_bytes() } else { obj.as_bytes() };
        let at = (state >> 33) as usize % text.len();
        let mut bytes = if round % 3 == 0 { text[..at].to_vec() } else { text.to_vec() };
        if let Some(byte) = bytes.get_mut(at) {
            *byte = (state >> 20) as u8;
        }
        let patches =
            if round % 2 == 0 { read_patches(Path::new("p.toml"), &bytes) } else { read_free_form(&bytes) };
        // What is let through can be built, or is refused there.
        if let Ok(patches) = patches {
            let _ = Nurbs::build(&patches);
        }
    }
}
