//! Wrong values: types, ranges, directions, numbers of fingers; and layouts.

use std::path::Path;

use world::Scene;

use crate::{layout_refused, refused, with_entity, with_finger, with_shape, with_top};

#[test]
fn a_value_of_the_wrong_type_is_named_with_what_was_found() {
    refused(
        &with_shape("{ kind = \"sphere\", radius_m = \"0.05\" }"),
        "s.toml:4: entity[0].shape.radius_m: found the string \"0.05\"; allowed: a number above 0; a number stands \
         without quotes",
    );
    refused(
        &with_shape("{ kind = \"sphere\", radius_m = \"5 cm\" }"),
        "s.toml:4: entity[0].shape.radius_m: found the string \"5 cm\"; allowed: a number above 0; numbers have no units, \
         the name of the key tells the unit",
    );
    refused(
        &with_shape("{ kind = \"sphere\", radius_m = true }"),
        "s.toml:4: entity[0].shape.radius_m: found the boolean true; allowed: a number above 0",
    );
    refused(
        &with_shape("{ kind = 3 }"),
        "s.toml:4: entity[0].shape.kind: found 3; allowed: plane, sphere, box, cylinder, cone, torus, capsule, \
         ellipsoid, mesh, csg, nurbs",
    );
    refused(
        &with_shape("\"sphere\""),
        "s.toml:4: entity[0].shape: found the string \"sphere\"; allowed: a table such as { kind \
         = \"sphere\", radius_m = 0.05 }",
    );
    refused(
        &with_top("gravity_m_s2 = true"),
        "s.toml:2: gravity_m_s2: found the boolean true; allowed: an array of 3 numbers",
    );
    refused(
        "name = 1979-05-27\n[[finger]]\n",
        "s.toml:1: name: found the date 1979-05-27; allowed: a string that is not empty",
    );
    refused(
        &with_top("gravity_m_s2 = -9.81"),
        "s.toml:2: gravity_m_s2: found -9.81; allowed: an array of 3 numbers",
    );
    refused(
        &with_top("gravity_m_s2 = [0, -9.81]"),
        "s.toml:2: gravity_m_s2: found an array of length 2; allowed: an array of 3 numbers",
    );
    refused(
        &with_finger("start_m = [0, {}, 0]"),
        "s.toml:4: finger[0].start_m[1]: found a table; allowed: a number",
    );
    refused(
        &with_finger("device = 1.0"),
        "s.toml:4: finger[0].device: found 1.0; allowed: a whole number from 0 to 7",
    );
    refused(
        &with_entity("friction = \"none\""),
        "s.toml:8: entity[0].friction: found the string \"none\"; allowed: a table such as { \
         model = \"coulomb\", mu = 0.5 }",
    );
    refused(
        &with_entity("friction = { model = \"coulomb\", mu = [1] }"),
        "s.toml:8: entity[0].friction.mu: found an array of length 1; allowed: a number, 0 or more",
    );
    refused(
        "[finger]\n",
        "s.toml:1: finger: found a single table, as `[finger]` makes it; allowed: a list of tables, each under its own \
         [[finger]]: write it with two brackets, even if there is only one",
    );
    refused(
        "[[finger]]\n[entity]\nname = \"ball\"\n",
        "s.toml:2: entity: found a single table, as `[entity]` makes it; allowed: a list of tables, each under its own \
         [[entity]]: write it with two brackets, even if there is only one",
    );
    refused(
        "finger = [1]\n",
        "s.toml:1: finger[0]: found 1; allowed: a list of tables, each under its own [[finger]]",
    );
    refused(
        "hand = 5\n[[finger]]\n",
        "s.toml:1: hand: found 5; allowed: the path of a CSV file, relative to this file",
    );
    refused(
        "hand = \"a\\tb.csv\"\n[[finger]]\n",
        "s.toml:1: hand: found the string \"a\\tb.csv\"; \
         allowed: the path of a CSV file, relative to this file, without control characters",
    );
}

#[test]
fn a_number_that_is_not_finite_is_refused() {
    refused(
        &with_shape("{ kind = \"sphere\", radius_m = nan }"),
        "s.toml:4: entity[0].shape.radius_m: found nan, which is not a finite number; allowed: a \
         number above 0",
    );
    refused(
        &with_finger("start_m = [0.0, 0.0, -inf]"),
        "s.toml:4: finger[0].start_m[2]: found -inf, which is not a finite number; allowed: a \
         number",
    );
    refused(
        &with_entity("stiffness_n_per_m = 1e999"),
        "s.toml:8: entity[0].stiffness_n_per_m: found 1e999, which is not a finite number; \
         allowed: a number above 0",
    );
    refused(
        &with_entity("position_m = [1, 99999999999999999999, 1]"),
        "s.toml:8: entity[0].position_m[1]: found 99999999999999999999; allowed: an integer of \
         at most 64 bits, or a number with a point or an exponent",
    );
}

#[test]
fn a_number_outside_its_range_is_refused() {
    refused(
        &with_shape("{ kind = \"sphere\", radius_m = -0.05 }"),
        "s.toml:4: entity[0].shape.radius_m: found -0.05; allowed: a number above 0",
    );
    refused(
        &with_shape("{ kind = \"sphere\", radius_m = 0 }"),
        "s.toml:4: entity[0].shape.radius_m: found 0; allowed: a number above 0",
    );
    refused(
        &with_finger("radius_m = -1e-3"),
        "s.toml:4: finger[0].radius_m: found -1e-3; allowed: a number, 0 or more",
    );
    refused(
        &with_entity("stiffness_n_per_m = 0.0"),
        "s.toml:8: entity[0].stiffness_n_per_m: found 0.0; allowed: a number above 0",
    );
    refused(
        &with_entity("damping_n_s_per_m = -1"),
        "s.toml:8: entity[0].damping_n_s_per_m: found -1; allowed: a number, 0 or more",
    );
    refused(
        &with_entity("damping_ratio = 0.1"),
        "s.toml:5: entity[0].mass_kg: missing; allowed: a number above 0: a `damping_ratio` is one of stiffness and mass",
    );
    refused(
        &with_entity("mass_kg = 1\ndamping_ratio = 1.1"),
        "s.toml:9: entity[0].damping_ratio: found 1.1; allowed: a number from 0 to 1",
    );
    refused(
        &with_entity("mass_kg = 1\ndamping_ratio = 0.1\ndamping_n_s_per_m = 1"),
        "s.toml:9: entity[0].damping_ratio: found 0.1; allowed: either `damping_ratio` or `damping_n_s_per_m`, not both",
    );
    refused(
        &with_entity("friction = { model = \"coulomb\", mu = -0.5 }"),
        "s.toml:8: entity[0].friction.mu: found -0.5; allowed: a number, 0 or more",
    );
    refused(
        &with_entity("friction = { model = \"stiction\", mu_s = 0.3, mu_d = 0.7 }"),
        "s.toml:8: entity[0].friction.mu_d: found 0.7; allowed: a number from 0 to mu_s = 0.3",
    );
    refused(
        &with_finger("device = 8"),
        "s.toml:4: finger[0].device: found 8; allowed: a whole number from 0 to 7",
    );
    refused(
        &with_finger("device = -1"),
        "s.toml:4: finger[0].device: found -1; allowed: a whole number from 0 to 7",
    );
    refused(
        &with_top("hand = \"\""),
        "s.toml:2: hand: found the string \"\"; allowed: the path of a CSV file, relative to \
         this file",
    );
    refused(
        "name = \"\"\n[[finger]]\n",
        "s.toml:1: name: found the string \"\"; allowed: a string that is not empty",
    );
}

#[test]
fn a_number_that_no_physical_quantity_has_is_refused_with_the_range_of_its_unit() {
    for (keys, key, found, allowed) in [
        (
            "damping_n_s_per_m = 1e308",
            "damping_n_s_per_m",
            "1e308",
            "a number, 0 or more, 1e6 at most in size",
        ),
        ("stiffness_n_per_m = 1e10", "stiffness_n_per_m", "1e10", "a number above 0, 1e9 at most in size"),
        ("mass_kg = 1e12", "mass_kg", "1e12", "a number above 0, 1e9 at most in size"),
        ("position_m = [0, -1e300, 0]", "position_m[1]", "-1e300", "a number, 1e6 at most in size"),
    ] {
        refused(&with_entity(keys), &format!("s.toml:8: entity[0].{key}: found {found}; allowed: {allowed}"));
    }
    refused(
        &with_top("gravity_m_s2 = [0.0, -1e9, 0.0]"),
        "s.toml:2: gravity_m_s2[1]: found -1e9; allowed: a number, 1e6 at most in size",
    );
}

#[test]
fn a_colour_in_bytes_is_refused_with_the_shares_that_it_would_be() {
    refused(
        &with_entity("visual = { colour = [255, 128, 0] }"),
        "s.toml:8: entity[0].visual.colour: found [255.0, 128.0, 0.0], which looks like numbers from 0 to 255; allowed: \
         an array of 3 numbers from 0 to 1: write [1.0, 0.502, 0.0]",
    );
    for (colour, place, number) in
        [("[0, 1.5, 0]", 1, "1.5"), ("[0.5, 255, 0]", 1, "255"), ("[0.5, 0, 300.0, 256]", 2, "300.0")]
    {
        refused(
            &with_entity(&format!("visual = {{ colour = {colour} }}")),
            &format!(
                "s.toml:8: entity[0].visual.colour[{place}]: found {number}; allowed: a number from 0 to 1"
            ),
        );
    }
}

#[test]
fn a_plane_without_a_direction_is_refused() {
    refused(
        &with_shape("{ kind = \"plane\", normal = [0, 0.0, -0.0], offset_m = 0 }"),
        "s.toml:4: entity[0].shape.normal: found the zero vector; allowed: a vector with a \
         direction, of any length above 0",
    );
    refused(
        &with_shape("{ kind = \"plane\", normal = [0, 1e-320, 0], offset_m = 1 }"),
        "s.toml:4: entity[0].shape.offset_m: found 1; allowed: a number whose quotient by the \
         length of normal is 1e6 at most in size",
    );
}

#[test]
fn a_quaternion_that_is_no_rotation_is_refused() {
    refused(
        &with_entity("orientation_wxyz = [0, 0, 0, 0]"),
        "s.toml:8: entity[0].orientation_wxyz: found a quaternion of length 0; allowed: w, x, y, \
         z of length 1 (within 0.001): no turn is [1.0, 0.0, 0.0, 0.0]",
    );
    refused(
        &with_entity("orientation_wxyz = [1, 0, 1, 0]"),
        "s.toml:8: entity[0].orientation_wxyz: found a quaternion of length 1.4142135623730951; \
         allowed: w, x, y, z of length 1 (within 0.001): this direction is [0.707107, 0.000000, 0.707107, 0.000000]; \
         angles are not taken",
    );
    refused(
        &with_entity("orientation_wxyz = [0, 0, 1]"),
        "s.toml:8: entity[0].orientation_wxyz: found an array of length 3; allowed: an array of \
         4 numbers",
    );
}

#[test]
fn a_file_of_another_kind_is_told_as_what_it_is() {
    for (text, said) in [
        (
            "[[patch]]\ndegree = [1, 1]\n",
            "patch: found a file of rational patches, no scene; a scene names it",
        ),
        (
            "rate_hz = 1000\n[[device]]\nname = \"f0\"\n",
            "device: found a file of devices, no scene; a layout belongs",
        ),
        ("[window]\nfullscreen = true\n", "window: found a file of settings, no scene; it belongs"),
        ("[keys]\nhelp = \"F1\"\n", "keys: found a file of keys, no scene; the settings name it"),
    ] {
        let found = Scene::parse(text, Path::new("s.toml")).expect_err("no scene").to_string();
        assert!(found.contains(said), "{found}");
    }
    // With a scene's keys beside it, it is a key that a scene does not have.
    let found =
        Scene::parse("name = \"a\"\n[[device]]\n", Path::new("s.toml")).expect_err("no scene").to_string();
    assert!(found.starts_with("s.toml:2: device: unknown key; allowed: "), "{found}");
}

#[test]
fn a_scene_has_one_to_eight_fingers() {
    refused("name = \"a\"\n", "s.toml: no [[finger]]; allowed: 1 to 8 of them");
    refused("finger = []\n", "s.toml: no [[finger]]; allowed: 1 to 8 of them");
    refused(&"[[finger]]\n".repeat(9), "s.toml:9: finger[8]: found 9 entries; allowed: at most 8");
}

#[test]
fn a_layout_is_refused_in_the_same_way() {
    layout_refused(
        "[[devices]]\n",
        "l.toml:1: devices: unknown key (did you mean `device`?); allowed: device, master, \
         attached_to, camera",
    );
    layout_refused(
        "[[device]]\nposition = [0, 0, 0]\n",
        "l.toml:2: device[0].position: unknown key (did you mean `position_m`?); allowed: \
         position_m, orientation_wxyz, matrix",
    );
    layout_refused(
        "[[device]]\n[[device]]\nposition_m = [0, 0, nan]\n",
        "l.toml:3: device[1].position_m[2]: found nan, which is not a finite number; allowed: a \
         number",
    );
    layout_refused(
        "[[device]]\norientation_wxyz = [0, 0, 0, 2]\n",
        "l.toml:2: device[0].orientation_wxyz: found a quaternion of length 2; allowed: w, x, y, \
         z of length 1 (within 0.001): this direction is [0.000000, 0.000000, 0.000000, 1.000000]; angles are not taken",
    );
    layout_refused(&"[[device]]\n".repeat(9), "l.toml:9: device[8]: found 9 entries; allowed: at most 8");
    layout_refused(
        "device = 1\n",
        "l.toml:1: device: found 1; allowed: a list of tables, each under its own [[device]]",
    );
}

#[test]
fn a_matrix_must_be_one_that_a_device_can_have() {
    let device = |rest: &str| format!("[[device]]\n{rest}\n");
    layout_refused(
        &device("matrix = [[1, 0, 0], [0, 1, 0]]"),
        "l.toml:2: device[0].matrix: found an array of length 2; allowed: an array of 3 rows of 3 numbers",
    );
    layout_refused(
        &device("matrix = [[1, 0, 0], [0, 1, inf], [0, 0, 1]]"),
        "l.toml:2: device[0].matrix[1][2]: found inf, which is not a finite number; allowed: a number",
    );
    let stretches = "allowed: stretches from 0.5 to 2, and a positive volume (no reflection)";
    for (matrix, found) in [
        (
            "[[1, 0, 0], [0, 1, 0], [0, 0, 0]]",
            "stretches by 0.000 to 1.000 and makes a unit cube's volume 0.000",
        ),
        (
            "[[1, 0, 0], [0, 1, 0], [0, 0, -1]]",
            "stretches by 1.000 to 1.000 and makes a unit cube's volume -1.000",
        ),
        (
            "[[1000, 0, 0], [0, 1000, 0], [0, 0, 1000]]",
            "stretches by 1000.000 to 1000.000 and makes a unit cube's volume 1000000000.000",
        ),
        (
            "[[0.4, 0, 0], [0, 1, 0], [0, 0, 1]]",
            "stretches by 0.400 to 1.000 and makes a unit cube's volume 0.400",
        ),
    ] {
        layout_refused(
            &device(&format!("matrix = {matrix}")),
            &format!("l.toml:2: device[0].matrix: found a matrix that {found}; {stretches}"),
        );
    }
    layout_refused(
        &device("orientation_wxyz = [1, 0, 0, 0]\nmatrix = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]"),
        "l.toml:3: device[0].matrix: found beside `orientation_wxyz`; allowed: one of the two, a matrix holds the turn as well",
    );
}

#[test]
fn master_and_camera_go_together() {
    layout_refused("master = 8\n", "l.toml:1: master: found 8; allowed: a whole number from 0 to 7");
    layout_refused(
        "attached_to = \"camera\"\n",
        "l.toml:1: master: missing; allowed: the index of the device that is attached",
    );
    layout_refused(
        "master = 0\nattached_to = \"desk\"\n",
        "l.toml:2: attached_to: unknown place `desk`; allowed: world, camera",
    );
    layout_refused(
        "master = 0\n[camera]\n",
        "l.toml:1: attached_to: missing; allowed: \"camera\", since there is a [camera]",
    );
    layout_refused(
        "master = 0\nattached_to = \"camera\"\n[camera]\nmatrix = 1\n",
        "l.toml:4: camera.matrix: unknown key; allowed: position_m, orientation_wxyz",
    );
}

#[test]
fn a_size_that_no_shape_has_is_refused() {
    for (shape, message) in [
        ("{ kind = \"box\", size_m = [1, 0, 1] }", "size_m[1]: found 0; allowed: a number above 0"),
        (
            "{ kind = \"box\", size_m = [1, 1] }",
            "size_m: found an array of length 2; allowed: an array of 3 numbers above 0",
        ),
        ("{ kind = \"box\", size_m = 1 }", "size_m: found 1; allowed: an array of 3 numbers above 0"),
        (
            "{ kind = \"cylinder\", radius_m = -1, length_m = 1 }",
            "radius_m: found -1; allowed: a number above 0",
        ),
        (
            "{ kind = \"cylinder\", radius_m = 1, length_m = 0 }",
            "length_m: found 0; allowed: a number above 0",
        ),
        (
            "{ kind = \"cone\", radius_bottom_m = 1, radius_top_m = -0.1, length_m = 1 }",
            "radius_top_m: found -0.1; allowed: a number, 0 or more",
        ),
        (
            "{ kind = \"cone\", radius_bottom_m = 0, radius_top_m = 0, length_m = 1 }",
            "radius_top_m: found 0; allowed: a number above 0, since radius_bottom_m is 0",
        ),
        (
            "{ kind = \"torus\", ring_radius_m = 1, tube_radius_m = 1 }",
            "tube_radius_m: found 1; allowed: a number above 0 and below ring_radius_m = 1",
        ),
        (
            "{ kind = \"capsule\", radius_m = 1, length_m = -1 }",
            "length_m: found -1; allowed: a number, 0 or more",
        ),
        (
            "{ kind = \"capsule\", radius_m = 0, length_m = 1 }",
            "radius_m: found 0; allowed: a number above 0",
        ),
        (
            "{ kind = \"ellipsoid\", radii_m = [1, nan, 1] }",
            "radii_m[1]: found nan, which is not a finite number; allowed: a number above 0",
        ),
        (
            "{ kind = \"mesh\", file = 1 }",
            "file: found 1; allowed: the path of an OBJ, STL, PLY, glTF, ASE or 3DS file, relative to this file",
        ),
        (
            "{ kind = \"mesh\", file = \"\" }",
            "file: found the string \"\"; allowed: the path of an OBJ, STL, PLY, glTF, ASE or 3DS file, relative to this file",
        ),
        (
            "{ kind = \"mesh\", file = \"a\\nb\\u001b.obj\" }",
            "file: found the string \"a\\nb\\u{1b}.obj\"; \
             allowed: the path of an OBJ, STL, PLY, glTF, ASE or 3DS file, relative to this file, without control characters",
        ),
        ("{ kind = \"mesh\", file = \"a.obj\", scale = 0 }", "scale: found 0; allowed: a number above 0"),
        ("{ kind = \"sphere\", radius_m = 1, scale = -1 }", "scale: found -1; allowed: a number above 0"),
        (
            "{ kind = \"sphere\", radius_m = 1, scale = [1, 1, 0] }",
            "scale[2]: found 0; allowed: a number above 0",
        ),
        (
            "{ kind = \"sphere\", radius_m = 1, scale = [1, 1] }",
            "scale: found an array of length 2; allowed: a number above 0, or an array of 3 numbers above 0",
        ),
        (
            "{ kind = \"sphere\", radius_m = 1, scale = \"2\" }",
            "scale: found the string \"2\"; allowed: a number above 0, or an array of 3 numbers above 0; a number \
             stands without quotes",
        ),
        ("{ kind = \"csg\", op = \"union\" }", CHILDREN),
        (
            "{ kind = \"csg\", op = \"union\", children = [] }",
            &CHILDREN.replace("missing", "found an array of length 0"),
        ),
        (
            "{ kind = \"csg\", op = \"minus\", children = [] }",
            "op: unknown operation `minus`; allowed: union, intersection, difference",
        ),
        (
            "{ kind = \"csg\", op = \"union\", children = [{ shape = { kind = \"mesh\", file = \"a.obj\" } }] }",
            "children[0].shape.kind: found the string \"mesh\"; \
             allowed: in a csg: plane, sphere, box, cylinder, cone, torus, capsule, ellipsoid, csg",
        ),
        (
            "{ kind = \"csg\", op = \"union\", children = [{ shape = { kind = \"nurbs\", file = \"a.toml\" } }] }",
            "children[0].shape.kind: found the string \"nurbs\"; \
             allowed: in a csg: plane, sphere, box, cylinder, cone, torus, capsule, ellipsoid, csg",
        ),
        (
            "{ kind = \"csg\", op = \"union\", children = [{ shape = { kind = \"sphere\", radius_m = 1 }, pose = 1 }] }",
            "children[0].pose: unknown key; allowed: shape, position_m, orientation_wxyz",
        ),
    ] {
        refused(&with_shape(shape), &format!("s.toml:4: entity[0].shape.{message}"));
    }
}

const CHILDREN: &str = "children: missing; allowed: an array of tables such as { shape = { kind = \"sphere\", \
                        radius_m = 0.05 }, position_m = [0, 0, 0] }, at least one";

#[test]
fn a_friction_that_no_surface_has_is_refused() {
    for (friction, message) in [
        ("model = \"stribeck\", mu_s = 0.5, mu_d = 0.3", "v_s_m_s: missing; allowed: a number above 0"),
        (
            "model = \"stribeck\", mu_s = 0.5, mu_d = 0.3, v_s_m_s = 0",
            "v_s_m_s: found 0; allowed: a number above 0",
        ),
        (
            "model = \"stribeck\", mu_s = 0.2, mu_d = 0.3, v_s_m_s = 1",
            "mu_d: found 0.3; allowed: a number from 0 to mu_s = 0.2",
        ),
        ("model = \"karnopp\", mu_s = 0.5", "mu_d: missing; allowed: a number, 0 or more"),
        (
            "model = \"karnopp\", mu_s = 0.5, mu_d = 0.3, v_min_m_s = 0",
            "v_min_m_s: found 0; allowed: a number above 0",
        ),
        ("model = \"dahl\"", "mu: missing; allowed: a number, 0 or more"),
        ("model = \"dahl\", mu = 0.5, sigma = 1", "sigma: unknown key; allowed: model, mu"),
        (
            "model = \"lugre\", mu_s = 0.5, mu_d = 0.3, mu_v_s_per_m = -1",
            "mu_v_s_per_m: found -1; allowed: a number, 0 or more",
        ),
        ("model = \"curve\", mu = [1]", "speed_m_s: missing; allowed: an array of rising numbers, 0 or more"),
        (
            "model = \"curve\", speed_m_s = [0]",
            "mu: missing; allowed: an array with a coefficient for each speed",
        ),
        (
            "model = \"curve\", speed_m_s = [], mu = []",
            "speed_m_s: found an array of length 0; allowed: an array of numbers, 0 or more, with at least one of them",
        ),
        (
            "model = \"curve\", speed_m_s = [0, 1], mu = [1]",
            "mu: found an array of length 1; allowed: an array of 2 numbers, one for each of speed_m_s",
        ),
        (
            "model = \"curve\", speed_m_s = [0, 1, 1], mu = [1, 1, 1]",
            "speed_m_s: found an array of length 3; allowed: numbers, each larger than the one before",
        ),
        (
            "model = \"curve\", speed_m_s = [-1], mu = [1]",
            "speed_m_s[0]: found -1; allowed: a number, 0 or more",
        ),
        ("model = \"curve\", speed_m_s = [0], mu = [-1]", "mu[0]: found -1; allowed: a number, 0 or more"),
        (
            "model = \"curve\", speed_m_s = [0], mu = [0.5], mu_s = 0.4",
            "mu_s: found 0.4; allowed: a number from the first of mu, 0.5, up",
        ),
        (
            "model = \"bristle\", mu = 0.5, bonds = 21",
            "bonds: found 21; allowed: a whole number from 1 to 20",
        ),
        (
            "model = \"bristle\", mu = 0.5, bonds = 1.5",
            "bonds: found 1.5; allowed: a whole number from 1 to 20",
        ),
        (
            "model = \"hayward\", mu = 0.5, stick_fraction = 1",
            "stick_fraction: found 1; allowed: a number from 0 up, below 1",
        ),
        (
            "model = \"fixed-cone\", friction_n = 2, static_n = 1",
            "static_n: found 1; allowed: a number from friction_n = 2 up",
        ),
        ("model = \"fixed-cone\", mu = 2", "mu: unknown key; allowed: model, friction_n, static_n"),
    ] {
        refused(
            &with_entity(&format!("friction = {{ {friction} }}")),
            &format!("s.toml:8: entity[0].friction.{message}"),
        );
    }
    let rising: Vec<String> = (0..64).map(|i| i.to_string()).collect();
    refused(
        &with_entity(&format!(
            "friction = {{ model = \"curve\", speed_m_s = [{}], mu = [1] }}",
            rising.join(", ")
        )),
        "s.toml:8: entity[0].friction.speed_m_s: found an array of length 64; allowed: at most 63 numbers",
    );
}

#[test]
fn lists_have_four_numbers_and_let_go_farther_away_than_they_claim() {
    refused(
        &with_top("lists = 64"),
        "s.toml:2: lists: found 64; allowed: a table such as { near_m = 0.01, far_m = 0.05, ahead_s = 0.05, \
         fast_bodies = 64 }",
    );
    refused(
        &with_top("lists = { fast_bodies = -1 }"),
        "s.toml:2: lists.fast_bodies: found -1; allowed: a whole number from 0 to 100000",
    );
    refused(
        &with_top("lists = { ahead_s = 0 }"),
        "s.toml:2: lists.ahead_s: found 0; allowed: a number above 0",
    );
    refused(
        &with_top("lists = { near_m = 0.05 }"),
        "s.toml:2: lists.near_m: found 0.05; allowed: far_m has to be larger than near_m; usual are 0.05 and 0.01",
    );
    refused(&with_top("sleep = 1"), "s.toml:2: sleep: found 1; allowed: true or false");
}
