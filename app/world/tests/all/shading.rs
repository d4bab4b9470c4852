//! The `shading` of an entity, in order and spoilt.

use std::path::Path;

use world::{Scene, SceneError, ShadingFormSpec, ShadingSpec};

const MESH: &str = "{ kind = \"mesh\", file = \"m.obj\", scale = 2 }";
const BOX: &str = "{ kind = \"box\", size_m = [1, 2, 3] }";

fn parsed(shape: &str, shading: &str) -> Result<ShadingSpec, SceneError> {
    let text = format!("[[finger]]\n[[entity]]\nshape = {shape}\nshading = {shading}\n");
    Scene::parse(&text, Path::new("s.toml")).map(|scene| scene.entities[0].shading)
}

#[track_caller]
fn refused(shape: &str, shading: &str, message: &str) {
    assert_eq!(parsed(shape, shading).expect_err("it is wrong").to_string(), message);
}

#[test]
fn all_that_can_be_said_of_a_shading_arrives() {
    let interpolated = |crease_angle_deg, form| ShadingSpec::Interpolated { crease_angle_deg, form };
    let regions =
        |length_m, crease_angle_deg, form| ShadingSpec::Regions { length_m, crease_angle_deg, form };
    for (shape, text, expected) in [
        (MESH, "{ kind = \"none\" }", ShadingSpec::None),
        (MESH, "{ kind = \"interpolated\" }", interpolated(40.0, ShadingFormSpec::Rotate)),
        (
            MESH,
            "{ kind = \"interpolated\", crease_angle_deg = 25, form = \"bisect\" }",
            interpolated(25.0, ShadingFormSpec::Bisect),
        ),
        (MESH, "{ kind = \"regions\" }", regions(0.002, 180.0, ShadingFormSpec::Rotate)),
        (
            BOX,
            "{ kind = \"regions\", length_m = 0.01, crease_angle_deg = 180, form = \"rotate\" }",
            regions(0.01, 180.0, ShadingFormSpec::Rotate),
        ),
    ] {
        assert_eq!(parsed(shape, text).unwrap(), expected, "{text}");
    }
    let without = Scene::parse(&format!("[[finger]]\n[[entity]]\nshape = {MESH}\n"), Path::new("s.toml"));
    assert_eq!(without.unwrap().entities[0].shading, ShadingSpec::None);
}

#[test]
fn a_shape_without_facets_is_not_shaded() {
    let fit = "allowed: interpolated or regions on a mesh, regions on a box without scale";
    let sphere = "{ kind = \"sphere\", radius_m = 1 }";
    for (shape, kind, is_a) in [
        (sphere, "interpolated", "sphere"),
        (sphere, "regions", "sphere"),
        (BOX, "interpolated", "box"),
        ("{ kind = \"box\", size_m = [1, 1, 1], scale = 2 }", "regions", "scaled box"),
    ] {
        let message =
            format!("s.toml:4: entity[0].shading.kind: found the string \"{kind}\"; {fit}; this is a {is_a}");
        refused(shape, &format!("{{ kind = \"{kind}\" }}"), &message);
    }
    assert_eq!(parsed(sphere, "{ kind = \"none\" }").unwrap(), ShadingSpec::None);
}

#[test]
fn what_is_wrong_with_a_shading_is_told_with_its_place() {
    refused(
        MESH,
        "0.5",
        "s.toml:4: entity[0].shading: found 0.5; allowed: a table such as { kind = \"interpolated\" }",
    );
    refused(MESH, "{}", "s.toml:4: entity[0].shading.kind: missing; allowed: none, interpolated, regions");
    refused(
        MESH,
        "{ kind = \"phong\" }",
        "s.toml:4: entity[0].shading.kind: unknown shading kind `phong`; allowed: none, interpolated, regions",
    );
    refused(
        MESH,
        "{ kind = \"interpolated\", length_m = 0.1 }",
        "s.toml:4: entity[0].shading.length_m: unknown key; allowed: kind, crease_angle_deg, form",
    );
    refused(
        MESH,
        "{ kind = \"regions\", length_m = 0 }",
        "s.toml:4: entity[0].shading.length_m: found 0; allowed: a number above 0",
    );
    refused(
        MESH,
        "{ kind = \"regions\", crease_angle_deg = 181 }",
        "s.toml:4: entity[0].shading.crease_angle_deg: found 181; allowed: a number from 0 to 180",
    );
    refused(
        MESH,
        "{ kind = \"interpolated\", crease_angle_deg = -1 }",
        "s.toml:4: entity[0].shading.crease_angle_deg: found -1; allowed: a number, 0 or more",
    );
    refused(
        MESH,
        "{ kind = \"interpolated\", crease_angle_deg = nan }",
        "s.toml:4: entity[0].shading.crease_angle_deg: found nan, which is not a finite number; \
         allowed: a number, 0 or more",
    );
    refused(
        MESH,
        "{ kind = \"interpolated\", form = \"half\" }",
        "s.toml:4: entity[0].shading.form: unknown shading form `half`; allowed: rotate, bisect",
    );
}
