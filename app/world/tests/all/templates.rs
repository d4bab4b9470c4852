//! Templates, grids and included files: one scene of many parts.

use std::fs;
use std::path::{Path, PathBuf};

use nalgebra::Vector3;
use tempfile::TempDir;
use world::{FrictionSpec, MassSpec, Scene, ShapeSpec};

fn parsed(text: &str) -> Scene {
    Scene::parse(text, Path::new("dir/s.toml")).unwrap_or_else(|error| panic!("{error}"))
}

#[track_caller]
fn refused(text: &str, message: &str) {
    let error = Scene::parse(text, Path::new("s.toml")).expect_err("it is wrong");
    assert_eq!(error.to_string(), message);
}

const CUP: &str = r#"
[[finger]]
[[template]]
name = "cup"
shape = { kind = "mesh", file = "cup.obj", scale = 0.5 }
mass_kg = 0.3
stiffness_n_per_m = 600.0
friction = { model = "stiction", mu_s = 0.7, mu_d = 0.3 }
"#;

#[test]
fn an_entity_has_its_templates_keys_but_the_name() {
    let scene = parsed(&format!("{CUP}\n[[entity]]\ntemplate = \"cup\"\nposition_m = [1, 0, 0]\n"));
    let cup = &scene.entities[0];
    assert_eq!((cup.name.as_str(), cup.stiffness_n_per_m), ("e0", 600.0));
    assert!(matches!(&cup.shape, ShapeSpec::Mesh(mesh) if mesh.file == Path::new("dir/cup.obj")));
    assert_eq!(cup.motion.map(|motion| motion.mass), Some(MassSpec::Mass(0.3)));
    assert_eq!(scene.templates[0].entities, 1);
}

#[test]
fn of_tables_an_entity_says_what_differs_unless_it_says_what_it_is() {
    let entity =
        |keys: &str| parsed(&format!("{CUP}\n[[entity]]\ntemplate = \"cup\"\n{keys}\n")).entities.remove(0);
    let ShapeSpec::Mesh(larger) = entity("shape = { scale = 2.0 }").shape else { panic!("no mesh") };
    assert_eq!((larger.file, larger.scale), (PathBuf::from("dir/cup.obj"), [2.0; 3]));
    let slippery = entity("friction = { mu_d = 0.1 }");
    assert_eq!(slippery.friction, FrictionSpec::Stiction { mu_s: 0.7, mu_d: 0.1 });
    let ball =
        entity("shape = { kind = \"sphere\", radius_m = 0.1 }\nfriction = { model = \"coulomb\", mu = 0.5 }");
    assert_eq!(ball.shape, ShapeSpec::Sphere { radius_m: 0.1 });
    assert_eq!(ball.friction, FrictionSpec::Coulomb { mu: 0.5 });
    let dense = entity("density_kg_m3 = 900.0");
    assert_eq!(dense.motion.map(|motion| motion.mass), Some(MassSpec::Density(900.0)), "it hides the mass");
    assert_eq!(entity("movable = false").motion, None, "a fixed one of what moves");
}

#[test]
fn a_damping_ratio_is_one_of_the_critical_damper_of_stiffness_and_mass() {
    let scene = parsed(
        "[[finger]]\n[[entity]]\nshape = { kind = \"sphere\", radius_m = 0.1 }\nmass_kg = 20.0\n\
         stiffness_n_per_m = 500.0\ndamping_ratio = 0.05\n",
    );
    // 2 * 0.05 * sqrt(500 * 20), to the rounding of a root.
    assert!((scene.entities[0].damping_n_s_per_m - 10.0).abs() < 1e-14);
}

#[test]
fn a_damping_ratio_of_a_template_is_hidden_by_what_excludes_it_and_hides_damping() {
    let scene = |of_template: &str, own: &str| {
        let text = format!(
            "[[finger]]\n[[template]]\nname = \"t\"\nshape = {{ kind = \"sphere\", radius_m = 0.1 }}\n{of_template}\n\
             [[entity]]\ntemplate = \"t\"\n{own}\n"
        );
        parsed(&text).entities[0].damping_n_s_per_m
    };
    let heavy = "mass_kg = 4.0\ndamping_ratio = 0.1";
    assert_eq!(scene(heavy, "damping_n_s_per_m = 2.0"), 2.0);
    assert_eq!(scene(heavy, "movable = false"), 0.0);
    assert_eq!(scene(heavy, "density_kg_m3 = 500.0"), 1.0);
    // Of 1000 N/m and 4 kg.
    let expected = 0.2 * 4000.0_f64.sqrt();
    assert!((scene("damping_n_s_per_m = 2.0", heavy) - expected).abs() < 1e-14);
}

#[test]
fn a_template_builds_on_another_and_need_not_have_a_shape() {
    let scene = parsed(
        "[[finger]]\n[[entity]]\ntemplate = \"rubber-ball\"\n\
         [[template]]\nname = \"rubber-ball\"\ntemplate = \"soft\"\nshape = { kind = \"sphere\", radius_m = 0.1 }\n\
         [[template]]\nname = \"soft\"\nstiffness_n_per_m = 90\ndamping_n_s_per_m = 3\n",
    );
    assert_eq!((scene.entities[0].stiffness_n_per_m, scene.entities[0].damping_n_s_per_m), (90.0, 3.0));
    let uses: Vec<_> =
        scene.templates.iter().map(|template| (template.name.as_str(), template.entities)).collect();
    assert_eq!(uses, [("rubber-ball", 1), ("soft", 1)]);
}

#[test]
fn a_grid_is_a_shelf_whose_items_are_called_by_their_places() {
    let scene = parsed(&format!(
        "{CUP}\n[[entity]]\nname = \"item\"\ntemplate = \"cup\"\nposition_m = [1, 2, 3]\n\
         grid = {{ count = [10, 100, 10], spacing_m = [0.1, 0.05, -0.1] }}\n"
    ));
    assert_eq!(scene.entities.len(), 10_000);
    let last = &scene.entities[9_999];
    assert_eq!(last.name, "item_9_99_9");
    // Sums of numbers below 10.
    assert!((last.pose.translation.vector - Vector3::new(1.9, 6.95, 2.1)).norm() < 1e-14);
    assert_eq!(scene.entities[1].name, "item_1_0_0", "x runs fastest");
    assert_eq!(scene.templates[0].entities, 10_000);
}

#[test]
fn what_is_wrong_with_templates_and_grids_is_told_with_line_and_key() {
    for (text, message) in [
        (
            format!("{CUP}[[entity]]\ntemplate = \"cupp\"\n"),
            "s.toml:10: entity[0].template: found \"cupp\", which no [[template]] is called (did you mean `cup`?); allowed: cup",
        ),
        (
            "[[finger]]\n[[template]]\nshape = { kind = \"sphere\", radius_m = 1 }\n".into(),
            "s.toml:2: template[0].name: missing; allowed: a name, by which entities call it",
        ),
        (
            "[[finger]]\n[[template]]\nname = \"a\"\ntemplate = \"b\"\n[[template]]\nname = \"b\"\ntemplate = \"a\"\n".into(),
            "s.toml:4: template[0].template: found templates that build on each other in a circle, or more than 8 deep; allowed: at most 8",
        ),
        (
            "[[finger]]\n[[template]]\nname = \"a\"\nmass = 1\n".into(),
            "s.toml:4: template[0].mass: unknown key (did you mean `mass_kg`?); allowed: name, shape, position_m, \
             orientation_wxyz, stiffness_n_per_m, damping_n_s_per_m, damping_ratio, friction, faces, algorithm, material, shading, height_map, \
             magnetism, vibration, movable, mass_kg, density_kg_m3, inertia_kg_m2, centre_of_mass_m, velocity_m_s, \
             angular_velocity_rad_s, rotation_locked, restitution, contact_stiffness_n_per_m, torsional_friction_m, rolling_friction_m, haptic, collidable, visual, template, grid, within",
        ),
        (
            // Nobody uses it, but somebody wrote it.
            "[[finger]]\n[[template]]\nname = \"a\"\nshape = { kind = \"sphere\", radius_m = 0 }\n".into(),
            "s.toml:4: template[0].shape.radius_m: found 0; allowed: a number above 0",
        ),
        (
            format!("{CUP}[[entity]]\ntemplate = \"cup\"\ngrid = {{ count = [1, 2], spacing_m = [1, 1, 1] }}\n"),
            "s.toml:11: entity[0].grid.count: found an array of length 2; allowed: an array of 3 whole numbers above 0, along x, y and z",
        ),
        (
            format!("{CUP}[[entity]]\ntemplate = \"cup\"\ngrid = {{ count = [1000, 1000, 1], spacing_m = [1, 1, 1] }}\n"),
            "s.toml:11: entity[0].grid.count: found an array of length 3; allowed: at most 100000 entities in all",
        ),
        (
            format!("{CUP}[[entity]]\nname = \"a_0_0_0\"\ntemplate = \"cup\"\n[[entity]]\nname = \"a\"\ntemplate = \"cup\"\n\
                     grid = {{ count = [1, 1, 1], spacing_m = [1, 1, 1] }}\n"),
            "s.toml:13: entity[1].name: found \"a_0_0_0\" (of the grid), already taken on line 10; allowed: a value used only once",
        ),
    ] {
        refused(&text, message);
    }
}

#[test]
fn a_mistake_in_a_template_is_told_once_however_many_use_it() {
    let text = format!(
        "{}{}",
        CUP.replace("mass_kg = 0.3", "mass_kg = -1"),
        "[[entity]]\ntemplate = \"cup\"\n".repeat(50)
    );
    let problems = Scene::examine(&text, Path::new("s.toml")).expect_err("it is wrong");
    let told: Vec<_> = problems.iter().map(ToString::to_string).collect();
    assert_eq!(told, ["s.toml:6: template[0].mass_kg: found -1; allowed: a number above 0"]);
}

#[test]
fn all_that_is_wrong_is_told_at_once() {
    let text = "nam = \"x\"\n[[finger]]\nradius_m = -1\n[[entity]]\nshape = { kind = \"sphere\", radius_m = 0 }\n\
                stiffness_n_per_m = 0\nmass = 2\n[[entity]]\n[[light]]\nkind = \"lamp\"\n";
    let problems = Scene::examine(text, Path::new("s.toml")).expect_err("it is wrong");
    let lines: Vec<_> = problems.iter().map(ToString::to_string).collect();
    let places: Vec<_> =
        lines.iter().map(|line| line.split(": ").take(2).collect::<Vec<_>>().join(" ")).collect();
    assert_eq!(
        places,
        [
            "s.toml:1 nam",
            "s.toml:3 finger[0].radius_m",
            "s.toml:7 entity[0].mass",
            "s.toml:5 entity[0].shape.radius_m",
            "s.toml:6 entity[0].stiffness_n_per_m",
            "s.toml:8 entity[1].shape",
            "s.toml:10 light[0].kind",
        ]
    );
}

/// Files in a directory of their own.
fn written(files: &[(&str, &str)]) -> TempDir {
    let dir = tempfile::tempdir().expect("a temporary directory");
    for (name, text) in files {
        let file = dir.path().join(name);
        fs::create_dir_all(file.parent().expect("a directory")).expect("create");
        fs::write(file, text).expect("write");
    }
    dir
}

/// What is said of the scene `s.toml`; the directory is called dir.
fn said(files: &[(&str, &str)]) -> Vec<String> {
    let dir = written(files);
    let problems = Scene::load_whole(dir.path().join("s.toml")).expect_err("it is wrong");
    let name = dir.path().display().to_string();
    problems.iter().map(|problem| problem.to_string().replace(&name, "dir")).collect()
}

#[test]
fn included_files_add_to_the_scene_and_name_files_relative_to_themselves() {
    let dir = written(&[
        ("s.toml", "include = [\"things/cups.toml\"]\n[[finger]]\n[[entity]]\ntemplate = \"cup\"\n"),
        (
            "things/cups.toml",
            "include = [\"more.toml\"]\n[[template]]\nname = \"cup\"\nshape = { kind = \"mesh\", file = \"cup.obj\" }\n",
        ),
        (
            "things/more.toml",
            "[[entity]]\nshape = { kind = \"sphere\", radius_m = 1 }\n[[light]]\nkind = \"ambient\"\n",
        ),
    ]);
    let scene = Scene::load(dir.path().join("s.toml")).unwrap_or_else(|error| panic!("{error}"));
    let ShapeSpec::Mesh(mesh) = &scene.entities[0].shape else { panic!("no mesh") };
    assert_eq!(mesh.file, dir.path().join("things/cup.obj"));
    assert_eq!(mesh.at.file, dir.path().join("things/cups.toml"));
    assert_eq!((scene.entities[1].name.as_str(), scene.entities[1].line), ("e1", 1));
    assert_eq!(*scene.entities[1].file, *dir.path().join("things/more.toml"));
    assert_eq!(scene.lights.len(), 1);
    assert_eq!(scene.included.len(), 2);
}

#[test]
fn circles_doubles_depth_and_missing_files_are_refused_with_file_and_line() {
    let finger = "[[finger]]\n";
    assert_eq!(
        said(&[
            ("s.toml", &format!("include = [\"a.toml\"]\n{finger}")),
            ("a.toml", "\ninclude = [\"./s.toml\"]\n")
        ]),
        [
            "dir/a.toml:2: include[0]: found dir/./s.toml, which is the scene itself; allowed: each file once, since two things \
          alike are two entities of a template"
        ]
    );
    assert_eq!(
        said(&[("s.toml", &format!("include = [\n\"a.toml\",\n\"a.toml\"]\n{finger}")), ("a.toml", "")]),
        [
            "dir/s.toml:3: include[1]: found dir/a.toml, which is included by dir/s.toml:2 already; allowed: each file once, since two things \
          alike are two entities of a template"
        ]
    );
    assert_eq!(
        said(&[("s.toml", &format!("include = [\"no.toml\"]\n{finger}"))]),
        ["dir/s.toml:1: include[0]: dir/no.toml: no such file; name an existing TOML file"]
    );
    let names: Vec<String> = (0..10).map(|i| format!("{i}.toml")).collect();
    let texts: Vec<String> = (1..11).map(|i| format!("include = [\"{i}.toml\"]\n")).collect();
    let mut files: Vec<(&str, &str)> =
        names.iter().zip(&texts).map(|(name, text)| (name.as_str(), text.as_str())).collect();
    let scene = format!("include = [\"0.toml\"]\n{finger}");
    files.push(("s.toml", &scene));
    assert_eq!(
        said(&files),
        ["dir/7.toml:1: include[0]: found a file included more than 8 deep; allowed: at most 8"]
    );
}

#[test]
fn names_are_used_once_in_all_files_and_a_run_is_described_by_one() {
    let ball = "[[entity]]\nname = \"ball\"\nshape = { kind = \"sphere\", radius_m = 1 }\n";
    let scene = format!("include = [\"a.toml\"]\n[[finger]]\n{ball}");
    assert_eq!(
        said(&[("s.toml", &scene), ("a.toml", ball)]),
        [
            "dir/a.toml:2: entity[0].name: found \"ball\", already taken in dir/s.toml:4; allowed: a value used only once"
        ]
    );
    assert_eq!(
        said(&[("s.toml", &scene), ("a.toml", "\nhand = \"h.csv\"\n")]),
        [
            "dir/a.toml:2: hand: found in an included file, but it is for the scene's own file; allowed here: include, template, \
          entity, environment, light, camera"
        ]
    );
}
