//! Wrong words: syntax, keys, kinds and names.

use std::path::Path;

use world::{MassSpec, Scene};

use crate::{refused, with_entity, with_finger, with_shape, with_top};

const SCENE_KEYS: &str = "name, gravity_m_s2, integrator, contact_response, contact_stiffness, grasp_quality, sleep, lists, hand, finger, entity, field, guide, \
     include, template, environment, light, camera";
const FINGER_KEYS: &str = "name, radius_m, start_m, device, passivity, soft, attach, within";
const ENTITY_KEYS: &str = "name, shape, position_m, orientation_wxyz, stiffness_n_per_m, damping_n_s_per_m, damping_ratio, friction, faces, algorithm, \
                           material, shading, height_map, magnetism, vibration, movable, mass_kg, density_kg_m3, inertia_kg_m2, \
                           centre_of_mass_m, velocity_m_s, angular_velocity_rad_s, rotation_locked, restitution, contact_stiffness_n_per_m, torsional_friction_m, rolling_friction_m, haptic, collidable, \
                           visual, template, grid, within";

#[test]
fn text_that_is_not_toml_is_refused_with_line_and_column() {
    refused(
        "name = \"a\"\ngravity_m_s2 = [0.0, -9.81\n",
        "s.toml:2:27: not valid TOML: unclosed array, expected `]`",
    );
    refused("name = \"a\"\nname = \"b\"\n", "s.toml:2:1: not valid TOML: duplicate key");
    refused("name = \n", "s.toml:1:8: not valid TOML: found nothing behind =; allowed: a value");
    refused(
        "ä = 1\n",
        "s.toml:1:1: not valid TOML: invalid unquoted key, expected letters, numbers, `-`, `_`",
    );
    refused(
        "[[finger]]\nstart_m = [0.0 1.0, 0.0]\n",
        "s.toml:2:12: not valid TOML: string values must be quoted, expected literal string; between two numbers of an \
         array stands a comma, as in [0.0, 1.0]",
    );
    refused(
        "shape = { kind = \"sphere\" radius_m = 0.1 }\n",
        "s.toml:1:27: not valid TOML: missing comma between key-value pairs, expected `,`",
    );
    for text in ["shape = { radius_m = 0,1 }\n", "radius_m = 0,1\n"] {
        let message = Scene::parse(text, Path::new("s.toml")).expect_err("a comma").to_string();
        assert!(message.ends_with("; a decimal number has a point, as in 0.1"), "{message}");
    }
    refused("[[finger]\n", "s.toml:1:10: not valid TOML: unclosed array table, expected `]`");
}

#[test]
fn usual_slips_are_refused_with_what_to_write_and_not_with_what_the_parser_wanted_next() {
    for (text, says) in [
        (
            "name = table\n",
            "1:8: not valid TOML: found table without quotes; text stands in quotes, as in \"table\"",
        ),
        (
            "name = floor\n",
            "1:8: not valid TOML: found floor without quotes; text stands in quotes, as in \"floor\"",
        ),
        (
            "name = nail\n",
            "1:8: not valid TOML: found nail without quotes; text stands in quotes, as in \"nail\"",
        ),
        ("movable = True\n", "1:11: not valid TOML: found True, allowed: true, in small letters"),
        ("radius_m = .05\n", "1:12: not valid TOML: a number has a digit before its point, as in 0.05"),
        ("radius_m = 5.\n", "1:14: not valid TOML: a number has a digit behind its point, as in 5.0"),
        (
            "file = \"C:\\Users\\me.obj\"\n",
            "1:13: not valid TOML: between \" a backslash begins a special character; in a path write / for it, or put the \
             path between '",
        ),
        (
            "name = \u{201c}table\u{201d}\n",
            "1:8: not valid TOML: found typographic quotes; text stands between straight ones, as in \"table\"",
        ),
        (
            "radius_m = \u{2212}0.5\n",
            "1:12: not valid TOML: found \u{2212}0.5, whose minus is a typographic one; allowed: -0.5",
        ),
        (
            "radius_m = 1/3\n",
            "1:12: not valid TOML: found 1/3, allowed: a number that is worked out, as in 0.333",
        ),
        (
            "radius_m = 0.3kg\n",
            "1:15: not valid TOML: found 0.3kg, allowed: a number alone; numbers have no units, the name of the key tells \
             the unit",
        ),
    ] {
        refused(text, &format!("s.toml:{says}"));
    }
}

#[test]
fn an_unknown_key_is_refused_with_what_was_probably_meant() {
    for (scene, found, allowed) in [
        (
            with_top("gravity = [0.0, 0.0, 0.0]"),
            "s.toml:2: gravity: unknown key (did you mean `gravity_m_s2`?)",
            SCENE_KEYS,
        ),
        (
            with_finger("raduis_m = 0.01"),
            "s.toml:4: finger[0].raduis_m: unknown key (did you mean `radius_m`?)",
            FINGER_KEYS,
        ),
        (
            with_entity("colour = \"red\""),
            "s.toml:8: entity[0].colour: unknown key (did you mean `visual`?)",
            ENTITY_KEYS,
        ),
        (
            with_entity("rotation = [0, 0, 0]"),
            "s.toml:8: entity[0].rotation: unknown key (did you mean `orientation_wxyz`?)",
            ENTITY_KEYS,
        ),
        (with_entity("texture = \"a\""), "s.toml:8: entity[0].texture: unknown key", ENTITY_KEYS),
        (
            with_entity("stifness_n_per_m = 1"),
            "s.toml:8: entity[0].stifness_n_per_m: unknown key (did you mean `stiffness_n_per_m`?)",
            ENTITY_KEYS,
        ),
        (
            with_entity("mass = 0.1"),
            "s.toml:8: entity[0].mass: unknown key (did you mean `mass_kg`?)",
            ENTITY_KEYS,
        ),
        (with_entity("\"two words\" = 1"), "s.toml:8: entity[0].\"two words\": unknown key", ENTITY_KEYS),
        (
            with_shape("{ kind = \"sphere\", radius_m = 1, normal = [0, 1, 0] }"),
            "s.toml:4: entity[0].shape.normal: unknown key",
            "kind, radius_m, scale",
        ),
        (
            "[[finger]]\n[[entitys]]\n".into(),
            "s.toml:2: entitys: unknown key (did you mean `entity`?)",
            SCENE_KEYS,
        ),
    ] {
        refused(&scene, &format!("{found}; allowed: {allowed}"));
    }
}

#[test]
fn of_several_unknown_keys_the_first_in_the_file_is_named() {
    let message = format!("s.toml:1: zebra: unknown key; allowed: {SCENE_KEYS}");
    refused("zebra = 1\napple = 2\n[[finger]]\n", &message);
}

#[test]
fn what_only_an_entity_that_moves_can_have_is_refused_without_a_mass() {
    for key in [
        "velocity_m_s = [0, 0, 0]",
        "angular_velocity_rad_s = [0, 0, 0]",
        "inertia_kg_m2 = [1, 1, 1]",
        "rotation_locked = true",
        "centre_of_mass_m = [0, 0, 0]",
    ] {
        let name = key.split(' ').next().unwrap_or_default();
        let message = format!(
            "s.toml:5: entity[0].mass_kg: missing; allowed: a number above 0: an entity with `{name}` moves; \
             or leave out `{name}`"
        );
        refused(&with_entity(key), &message);
    }
}

#[test]
fn a_restitution_that_is_no_share_is_refused() {
    for (restitution, allowed) in [("1.5", "a number from 0 to 1"), ("-0.1", "a number, 0 or more")] {
        let entity = format!("s.toml:8: entity[0].restitution: found {restitution}; allowed: {allowed}");
        refused(&with_entity(&format!("restitution = {restitution}")), &entity);
        for kind in ["force", "impulse"] {
            let scene =
                format!("s.toml:1: contact_response.restitution: found {restitution}; allowed: {allowed}");
            let response =
                format!("contact_response = {{ kind = \"{kind}\", restitution = {restitution} }}\n");
            refused(&format!("{response}{}", with_entity("")), &scene);
        }
    }
    let read = Scene::parse(&with_entity("restitution = 0.5"), Path::new("s.toml")).unwrap();
    assert_eq!(read.entities[0].restitution, Some(0.5));
}

#[test]
fn a_contact_stiffness_that_is_none_or_does_not_fit_its_kind_is_refused() {
    let scene = |stiffness: &str| format!("contact_stiffness = {stiffness}\n{}", with_entity(""));
    for (stiffness, message) in [
        (
            "{ kind = \"hard\" }",
            "s.toml:1: contact_stiffness.kind: unknown contact stiffness `hard`; allowed: as-said, by-mass, as-felt, given",
        ),
        (
            "{ kind = \"given\", stiffness_n_per_m = 0 }",
            "s.toml:1: contact_stiffness.stiffness_n_per_m: found 0; allowed: a number above 0",
        ),
        (
            "{ kind = \"by-mass\", stiffness_n_per_m = 1e5 }",
            "s.toml:1: contact_stiffness.stiffness_n_per_m: found 1e5; allowed: none, but with kind = \"given\"",
        ),
        (
            "{ kind = \"by-mass\", damping_ratio = 1e18 }",
            "s.toml:1: contact_stiffness.damping_ratio: found 1e18; allowed: a number from 0 to 1000; 1 is critical",
        ),
        (
            "{ kind = \"as-felt\", damping_ratio = 1.0 }",
            "s.toml:1: contact_stiffness.damping_ratio: found 1.0; allowed: none with kind = \"as-felt\": dampers are the entities' own",
        ),
    ] {
        refused(&scene(stiffness), message);
    }
    let read =
        |stiffness: &str| Scene::parse(&scene(stiffness), Path::new("s.toml")).unwrap().dynamics.stiffness;
    use world::ContactStiffnessSpec::{AsFelt, AsSaid, ByMass, Given};
    assert_eq!(read("{ kind = \"as-said\", damping_ratio = 0.5 }"), AsSaid { damping_ratio: 0.5 });
    assert_eq!(read("{ kind = \"as-felt\" }"), AsFelt);
    assert_eq!(read("{ kind = \"by-mass\", damping_ratio = 0.5 }"), ByMass { damping_ratio: 0.5 });
    let given = Given { stiffness_n_per_m: 2e4, damping_ratio: 1.0 };
    assert_eq!(read("{ kind = \"given\", stiffness_n_per_m = 2e4 }"), given);
}

#[test]
fn what_is_movable_has_a_mass_a_density_or_a_material() {
    let motion = |keys: &str| {
        Scene::parse(&with_entity(keys), Path::new("s.toml"))
            .unwrap()
            .entities
            .remove(0)
            .motion
            .map(|is| is.mass)
    };
    assert_eq!(motion("material = \"ice\"\nmovable = true"), Some(MassSpec::Density(917.0)));
    assert_eq!(motion("material = \"ice\"\nmovable = true\nmass_kg = 2"), Some(MassSpec::Mass(2.0)));
    assert_eq!(motion("material = \"ice\"\ndensity_kg_m3 = 900"), Some(MassSpec::Density(900.0)));
    assert_eq!(motion("material = \"ice\""), None, "a material alone moves nothing");
    assert_eq!(motion("material = \"ice\"\nmovable = false"), None);
    refused(
        &with_entity("movable = true"),
        "s.toml:5: entity[0].mass_kg: missing; allowed: a number above 0, or `density_kg_m3`, or a `material`, which has \
         a density: an entity with `movable = true` has a mass",
    );
    for mass in ["mass_kg", "density_kg_m3"] {
        refused(
            &with_entity(&format!("movable = false\n{mass} = 1")),
            "s.toml:8: entity[0].movable: found the boolean false; allowed: true, or neither `mass_kg` nor `density_kg_m3`",
        );
    }
    refused(&with_entity("movable = 1"), "s.toml:8: entity[0].movable: found 1; allowed: true or false");
}

const KINDS: &str = "plane, sphere, box, cylinder, cone, torus, capsule, ellipsoid, mesh, csg, nurbs";
const MODELS: &str = "none, coulomb, stiction, viscous, coulomb-viscous, stribeck, karnopp, dahl, lugre, curve, bristle, \
                      reset-integrator, hayward, fixed-cone";

#[test]
fn a_shape_kind_that_this_version_lacks_is_told_apart_from_an_unknown_one() {
    let unknown =
        |found: &str| format!("s.toml:4: entity[0].shape.kind: unknown shape kind {found}; allowed: {KINDS}");
    refused(
        &with_shape("{ kind = \"shpere\", radius_m = 1 }"),
        &unknown("`shpere` (did you mean `sphere`?)"),
    );
    refused(&with_shape("{ kind = \"nurb\" }"), &unknown("`nurb` (did you mean `nurbs`?)"));
    refused(&with_shape("{ kind = \"Mesh\" }"), &unknown("`Mesh` (did you mean `mesh`?)"));
    refused(&with_shape("{ kind = \"a\\nb\" }"), &unknown("`a\\nb`"));
}

#[test]
fn an_unknown_friction_model_is_refused_with_what_was_probably_meant() {
    let unknown = |found: &str| {
        format!("s.toml:8: entity[0].friction.model: unknown friction model {found}; allowed: {MODELS}")
    };
    refused(
        &with_entity("friction = { model = \"Coulomb\", mu = 1 }"),
        &unknown("`Coulomb` (did you mean `coulomb`?)"),
    );
    refused(&with_entity("friction = { model = \"glue\" }"), &unknown("`glue`"));
}

#[test]
fn an_unknown_algorithm_is_refused_with_what_was_probably_meant() {
    refused(
        &with_entity("algorithm = \"vectorfield\""),
        "s.toml:8: entity[0].algorithm: unknown algorithm `vectorfield` (did you mean `vector-field`?); allowed: \
         friction-cone, vector-field, classic",
    );
    refused(
        &with_entity("algorithm = 1"),
        "s.toml:8: entity[0].algorithm: found 1; allowed: friction-cone, vector-field, classic",
    );
}

#[test]
fn each_shape_knows_its_own_keys() {
    for (shape, message) in [
        ("{ kind = \"box\", radius_m = 1 }", "radius_m: unknown key; allowed: kind, size_m, scale"),
        (
            "{ kind = \"cylinder\", radius_m = 1, length = 1 }",
            "length: unknown key (did you mean `length_m`?); allowed: kind, radius_m, length_m, scale",
        ),
        (
            "{ kind = \"cone\", radius_m = 1 }",
            "radius_m: unknown key; allowed: kind, radius_bottom_m, radius_top_m, length_m, scale",
        ),
        (
            "{ kind = \"torus\", radius_m = 1 }",
            "radius_m: unknown key; allowed: kind, ring_radius_m, tube_radius_m, scale",
        ),
        ("{ kind = \"ellipsoid\", size_m = 1 }", "size_m: unknown key; allowed: kind, radii_m, scale"),
        (
            "{ kind = \"mesh\", file = \"a.obj\", close_holes_m = -0.01 }",
            "close_holes_m: found -0.01; allowed: a number, 0 or more",
        ),
        (
            "{ kind = \"mesh\", path = \"a.obj\" }",
            "path: unknown key; allowed: kind, file, scale, hollow, close_holes_m",
        ),
        ("{ kind = \"cylinder\", radius_m = 1 }", "length_m: missing; allowed: a number above 0"),
        ("{ kind = \"cone\", radius_bottom_m = 1 }", "radius_top_m: missing; allowed: a number, 0 or more"),
        ("{ kind = \"torus\", ring_radius_m = 1 }", "tube_radius_m: missing; allowed: a number above 0"),
        ("{ kind = \"capsule\", radius_m = 1 }", "length_m: missing; allowed: a number, 0 or more"),
        ("{ kind = \"box\" }", "size_m: missing; allowed: an array of 3 numbers above 0"),
        ("{ kind = \"ellipsoid\" }", "radii_m: missing; allowed: an array of 3 numbers above 0"),
        (
            "{ kind = \"mesh\" }",
            "file: missing; allowed: the path of an OBJ, STL, PLY, glTF, ASE or 3DS file, relative to this file",
        ),
    ] {
        refused(&with_shape(shape), &format!("s.toml:4: entity[0].shape.{message}"));
    }
}

#[test]
fn a_missing_key_is_named_with_what_may_stand_there() {
    refused(
        "[[finger]]\n\n[[entity]]\nname = \"a\"\n",
        "s.toml:3: entity[0].shape: missing; allowed: a table such as { kind = \"sphere\", \
         radius_m = 0.05 }",
    );
    refused(
        &with_shape("{ radius_m = 1 }"),
        "s.toml:4: entity[0].shape.kind: missing; allowed: plane, sphere, box, cylinder, cone, torus, capsule, \
         ellipsoid, mesh, csg, nurbs",
    );
    refused(
        &with_shape("{ kind = \"sphere\" }"),
        "s.toml:4: entity[0].shape.radius_m: missing; allowed: a number above 0",
    );
    refused(
        &with_shape("{ kind = \"plane\", offset_m = 0 }"),
        "s.toml:4: entity[0].shape.normal: missing; allowed: an array of 3 numbers",
    );
    refused(
        &with_shape("{ kind = \"plane\", normal = [0, 1, 0] }"),
        "s.toml:4: entity[0].shape.offset_m: missing; allowed: a number",
    );
    refused(
        &with_entity("friction = { mu = 0.5 }"),
        "s.toml:8: entity[0].friction.model: missing; allowed: none, coulomb, stiction, viscous, \
         coulomb-viscous, stribeck, karnopp, dahl, lugre, curve, bristle, reset-integrator, hayward, fixed-cone",
    );
    refused(
        &with_entity("friction = { model = \"stiction\", mu_s = 0.5 }"),
        "s.toml:8: entity[0].friction.mu_d: missing; allowed: a number, 0 or more",
    );
    refused(
        &with_entity("friction = { model = \"coulomb-viscous\", mu = 0.5 }"),
        "s.toml:8: entity[0].friction.mu_v_s_per_m: missing; allowed: a number, 0 or more",
    );
}

#[test]
fn a_name_that_would_break_a_recording_is_refused() {
    refused(
        &with_finger("name = \"left hand\""),
        "s.toml:4: finger[0].name: found the name \"left hand\"; allowed: 1 to 64 of the \
         characters A-Z a-z 0-9 _ -",
    );
    refused(
        &with_finger("name = \"a,b\""),
        "s.toml:4: finger[0].name: found the name \"a,b\"; allowed: 1 to 64 of the characters \
         A-Z a-z 0-9 _ -",
    );
    refused(
        &with_finger("name = \"\""),
        "s.toml:4: finger[0].name: found the string \"\"; allowed: 1 to 64 of the characters A-Z \
         a-z 0-9 _ -",
    );
    refused(
        "[[finger]]\n[[entity]]\nname = \"kopf\\n\"\n",
        "s.toml:3: entity[0].name: found the name \"kopf\\n\"; allowed: 1 to 64 of the \
         characters A-Z a-z 0-9 _ -",
    );
    refused(
        &with_finger(&format!("name = \"{}\"", "n".repeat(65))),
        "s.toml:4: finger[0].name: found the name \
         \"nnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnn...\"; allowed: 1 to 64 \
         of the characters A-Z a-z 0-9 _ -",
    );
}

#[test]
fn a_name_or_device_given_twice_is_refused_with_the_line_of_the_first() {
    refused(
        "[[finger]]\nname = \"a\"\n[[finger]]\nname = \"a\"\n",
        "s.toml:4: finger[1].name: found \"a\", already taken on line 2; allowed: a value used \
         only once",
    );
    refused(
        "[[finger]]\nname = \"f1\"\n\n[[finger]]\n",
        "s.toml:4: finger[1].name: found \"f1\" (the default name), already taken on line 2; \
         allowed: a value used only once",
    );
    refused(
        "[[finger]]\ndevice = 2\n[[finger]]\ndevice = 2\n",
        "s.toml:4: finger[1].device: found 2, already taken on line 2; allowed: a value used \
         only once",
    );
    refused(
        "[[finger]]\ndevice = 1\n[[finger]]\n",
        "s.toml:3: finger[1].device: found 1 (the default, its position in the list), already \
         taken on line 2; allowed: a value used only once",
    );
    let entity = "[[entity]]\nname = \"e\"\nshape = { kind = \"sphere\", radius_m = 1 }\n";
    refused(
        &format!("[[finger]]\n{entity}{entity}"),
        "s.toml:6: entity[1].name: found \"e\", already taken on line 3; allowed: a value used \
         only once",
    );
}

#[test]
fn a_message_stays_one_short_line_whatever_the_file_holds() {
    let long = "x\\n".repeat(10_000);
    for text in [
        format!("\"{long}\" = 1\n"),
        format!("name = \"a\"\n[[finger]]\nname = \"{long}\"\n"),
        with_top(&format!("hand = {{ a = \"{}\" }}", "é".repeat(1000))),
        with_finger(&format!("name = \"a{}\"", "é".repeat(1000))),
        with_shape(&format!("{{ kind = \"{long}\" }}")),
        with_shape(&format!("{{ kind = \"sphere\", radius_m = \"{long}\" }}")),
        with_shape(&format!("{{ kind = \"sphere\", radius_m = -{} }}", "1".repeat(10_000))),
    ] {
        let error = Scene::parse(&text, Path::new("s.toml")).expect_err("the scene is wrong");
        let message = error.to_string();
        assert!(!message.contains('\n') && message.len() < 400, "{message}");
    }
}

#[test]
fn a_file_of_another_kind_is_told_by_its_name() {
    let said = |name: &str| Scene::parse("v 0 0 0\n", Path::new(name)).unwrap_err().to_string();
    assert_eq!(
        said("cup.obj"),
        "cup.obj:1:3: not valid TOML: by its name it is a model, which a scene names: shape = { kind = \"mesh\", file = \
         \"cup.obj\" }; `phantom3 check` says how a model is understood"
    );
    assert_eq!(
        said("run.csv"),
        "run.csv:1:3: not valid TOML: by its name it is a table, such as a hand (`--hand`) or a recording (`phantom3 \
         replay`)"
    );
    assert!(said("cup.txt").contains("expected `=`"));
}
