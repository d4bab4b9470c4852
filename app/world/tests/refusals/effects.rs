//! Fields, guides, magnetism, vibration and materials: what is wrong with them.

use crate::{refused, with_entity, with_top};

fn field(keys: &str) -> String {
    with_top(&format!("[[field]]\n{keys}"))
}

fn guide(keys: &str) -> String {
    with_top(&format!("[[guide]]\n{keys}"))
}

#[test]
fn a_field_says_what_it_lacks_and_what_it_knows() {
    refused(&field(""), "s.toml:2: field[0].kind: missing; allowed: viscous, inertial, constant");
    refused(
        &field("kind = \"viscos\""),
        "s.toml:3: field[0].kind: unknown field kind `viscos` (did you mean `viscous`?); \
         allowed: viscous, inertial, constant",
    );
    refused(
        &field("kind = \"viscous\""),
        "s.toml:2: field[0].damping_n_s_per_m: missing; allowed: a number, 0 or more, or an array of 3 numbers, 0 or more",
    );
    refused(
        &field("kind = \"viscous\"\ndamping_n_s_per_m = \"much\""),
        "s.toml:4: field[0].damping_n_s_per_m: found the string \"much\"; \
         allowed: a number, 0 or more, or an array of 3 numbers, 0 or more",
    );
    refused(
        &field("kind = \"viscous\"\ndamping_n_s_per_m = [1, -1, 1]"),
        "s.toml:4: field[0].damping_n_s_per_m[1]: found -1; allowed: a number, 0 or more",
    );
    refused(
        &field("kind = \"inertial\"\nmass_kg = 0.1\ncutoff_hz = 0"),
        "s.toml:5: field[0].cutoff_hz: found 0; allowed: a number above 0",
    );
    refused(
        &field("kind = \"constant\"\nforce_n = [0, nan, 0]"),
        "s.toml:4: field[0].force_n[1]: found nan, which is not a finite number; allowed: a number",
    );
    refused(
        &field("kind = \"constant\"\nforce_n = [0, 1, 0]\nmass_kg = 1"),
        "s.toml:5: field[0].mass_kg: unknown key; allowed: kind, force_n, shape, position_m, orientation_wxyz, rim_m",
    );
}

#[test]
fn a_field_is_bounded_by_a_closed_form_with_a_rim() {
    refused(
        &field("kind = \"viscous\"\ndamping_n_s_per_m = 1\nrim_m = 0"),
        "s.toml:5: field[0].rim_m: found 0; allowed: a number above 0",
    );
    refused(
        &field("kind = \"viscous\"\ndamping_n_s_per_m = 1\nshape = { kind = \"mesh\", file = \"a.obj\" }"),
        "s.toml:5: field[0].shape: found a table; \
         allowed: a shape with a closed form, such as { kind = \"box\", size_m = [0.1, 0.1, 0.1] }",
    );
    refused(
        &field("kind = \"viscous\"\ndamping_n_s_per_m = 1\ndevice_mass_kg = -1"),
        "s.toml:5: field[0].device_mass_kg: found -1; allowed: a number above 0",
    );
}

#[test]
fn a_guide_says_what_it_lacks_and_what_it_knows() {
    refused(&guide(""), "s.toml:2: guide[0].kind: missing; allowed: line, plane, segment, path");
    refused(
        &guide("kind = \"line\"\npoint_m = [0, 0, 0]"),
        "s.toml:2: guide[0].direction: missing; allowed: an array of 3 numbers",
    );
    refused(
        &guide("kind = \"line\"\npoint_m = [0, 0, 0]\ndirection = [0, 0, 0]"),
        "s.toml:5: guide[0].direction: found the zero vector; \
         allowed: a vector with a direction, of any length above 0",
    );
    refused(
        &guide("kind = \"plane\"\npoint_m = [0, 0, 0]\ndirection = [0, 0, 1]"),
        "s.toml:5: guide[0].direction: unknown key; allowed: kind, point_m, normal, stiffness_n_per_m, \
         damping_n_s_per_m, deadband_m, capture_m, break_away_n, force_limit_n, device_mass_kg",
    );
    refused(
        &guide("kind = \"segment\"\nfrom_m = [0, 1, 0]\nto_m = [0, 1, 0]"),
        "s.toml:5: guide[0].to_m: found an array of length 3; allowed: another point than from_m",
    );
    let path = "allowed: an array of 2 to 256 points of 3 numbers, no two in a row equal";
    for (points, found) in
        [("[]", "an array of length 0"), ("[[0, 0, 0], [0, 0, 0]]", "an array of length 2"), ("7", "7")]
    {
        refused(
            &guide(&format!("kind = \"path\"\npoints_m = {points}")),
            &format!("s.toml:4: guide[0].points_m: found {found}; {path}"),
        );
    }
    refused(
        &guide("kind = \"path\"\npoints_m = [[0, 0, 0], [0, 1]]"),
        "s.toml:4: guide[0].points_m[1]: found an array of length 2; allowed: an array of 3 numbers",
    );
    let line = "kind = \"line\"\npoint_m = [0, 0, 0]\ndirection = [1, 0, 0]\n";
    for key in ["stiffness_n_per_m", "capture_m", "break_away_n", "force_limit_n", "device_mass_kg"] {
        refused(
            &guide(&format!("{line}{key} = 0")),
            &format!("s.toml:6: guide[0].{key}: found 0; allowed: a number above 0"),
        );
    }
    refused(
        &guide(&format!("{line}deadband_m = -0.1")),
        "s.toml:6: guide[0].deadband_m: found -0.1; allowed: a number, 0 or more",
    );
}

#[test]
fn more_fields_or_guides_than_there_can_be_are_refused_at_the_first_too_many() {
    let fields = "[[field]]\nkind = \"constant\"\nforce_n = [0, 0, 0]\n".repeat(65);
    refused(&with_top(&fields), "s.toml:194: field[64]: found 65 entries; allowed: at most 64");
    let guides = "[[guide]]\nkind = \"line\"\npoint_m = [0, 0, 0]\ndirection = [1, 0, 0]\n".repeat(65);
    refused(&with_top(&guides), "s.toml:258: guide[64]: found 65 entries; allowed: at most 64");
}

#[test]
fn a_surfaces_effects_are_checked_key_by_key() {
    refused(
        &with_entity("magnetism = 1"),
        "s.toml:8: entity[0].magnetism: found 1; allowed: a table such as { force_n = 1.0, distance_m = 0.01 }",
    );
    refused(
        &with_entity("magnetism = { force_n = -1, distance_m = 0.01 }"),
        "s.toml:8: entity[0].magnetism.force_n: found -1; allowed: a number, 0 or more",
    );
    refused(
        &with_entity("magnetism = { force_n = 1, distance = 0.01 }"),
        "s.toml:8: entity[0].magnetism.distance: unknown key (did you mean `distance_m`?); \
         allowed: force_n, distance_m",
    );
    refused(
        &with_entity("vibration = { amplitude_n = 1 }"),
        "s.toml:8: entity[0].vibration.frequency_hz: missing; allowed: a number above 0",
    );
    refused(
        &with_entity("vibration = { frequency_hz = 100, amplitude_n = inf }"),
        "s.toml:8: entity[0].vibration.amplitude_n: found inf, which is not a finite number; \
         allowed: a number, 0 or more",
    );
}

#[test]
fn a_material_that_is_unknown_is_answered_with_those_that_are_known() {
    let known = "aluminium, steel, glass, ice, wood, paper, leather, vinyl, rubber, sandpaper, skin, foam";
    refused(
        &with_entity("material = \"aluminum\""),
        &format!(
            "s.toml:8: entity[0].material: unknown material `aluminum` (did you mean `aluminium`?); allowed: {known}"
        ),
    );
    refused(
        &with_entity("material = \"unobtainium\""),
        &format!("s.toml:8: entity[0].material: unknown material `unobtainium`; allowed: {known}"),
    );
    refused(
        &with_entity("material = 3"),
        &format!("s.toml:8: entity[0].material: found 3; allowed: {known}"),
    );
}
