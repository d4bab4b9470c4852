//! What is wrong with `[[entity.faces]]`.

use crate::{refused, with_entity};

fn of_a_mesh(faces: &str) -> String {
    format!(
        "[[finger]]\n[[entity]]\nshape = {{ kind = \"mesh\", file = \"a.obj\" }}\n[[entity.faces]]\n{faces}\n"
    )
}

#[test]
fn faces_say_what_they_lack_and_what_they_know() {
    let names = "the name of a group, an object or a material in the model's file, or a list of such names";
    refused(&of_a_mesh(""), &format!("s.toml:4: entity[0].faces[0].of: missing; allowed: {names}"));
    refused(&of_a_mesh("of = 7"), &format!("s.toml:5: entity[0].faces[0].of: found 7; allowed: {names}"));
    refused(
        &of_a_mesh("of = \"a\"\nstifness_n_per_m = 1"),
        "s.toml:6: entity[0].faces[0].stifness_n_per_m: unknown key (did you mean `stiffness_n_per_m`?); \
         allowed: of, material, friction, stiffness_n_per_m, damping_n_s_per_m, colour",
    );
    refused(
        &of_a_mesh("of = \"a\"\nstiffness_n_per_m = 0"),
        "s.toml:6: entity[0].faces[0].stiffness_n_per_m: found 0; allowed: a number above 0",
    );
    refused(
        &with_entity("[[entity.faces]]\nof = \"a\""),
        "s.toml:8: entity[0].faces: found faces of a sphere; allowed: faces of a mesh, whose file names them",
    );
}
