//! Whatever the text, the parser ends with a scene or with a one-line message that names the file.

use std::path::Path;

use proptest::prelude::*;
use world::{Layout, Scene};

const GOOD: &str = include_str!("../../../../config/scenes/default.toml");
/// One of each shape, and many models of friction.
const GALLERY: &str = include_str!("../../../../config/scenes/shapes.toml");

fn ends_well(text: &str) {
    let file = Path::new("any.toml");
    let scene = Scene::parse(text, file);
    if let Ok(scene) = &scene {
        assert!(is_sound(scene), "{scene:?}");
    }
    let errors = [scene.err(), Layout::parse(text, file).err()];
    for message in errors.into_iter().flatten().map(|error| error.to_string()) {
        assert!(message.starts_with("any.toml:"), "{message}");
        assert!(!message.contains('\n'), "{message}");
        assert!(message.len() < 600, "{message}");
    }
}

/// What the crate promises of every scene it returns.
fn is_sound(scene: &Scene) -> bool {
    let entity_is_sound = |entity: &world::SceneEntity| {
        entity.stiffness_n_per_m > 0.0
            && entity.damping_n_s_per_m >= 0.0
            && (entity.pose.rotation.norm() - 1.0).abs() < 1e-12
            && entity.pose.translation.vector.iter().all(|x| x.is_finite())
    };
    (1..=world::MAX_DEVICES).contains(&scene.fingers.len())
        && scene.fingers.iter().all(|finger| finger.radius_m >= 0.0 && finger.device < world::MAX_DEVICES)
        && scene.entities.iter().all(entity_is_sound)
}

/// Pieces that reach deep into the grammar, in senseless order.
fn piece() -> impl Strategy<Value = String> {
    let words = "[[finger]]|[[entity]]|[[device]]|[entity]|name|shape|kind|friction|model|normal|\
                 offset_m|radius_m|position_m|orientation_wxyz|device|hand|= |{|}|[|]|,|.|\n|\"|'|\"\"\"|\
                 \"sphere\"|\"plane\"|\"box\"|\"stiction\"|mu_s|mu_d|\"mesh\"|file|scale|\"torus\"|\"curve\"|speed_m_s|mu|algorithm|\"lugre\"|1|0|-1|1e308|5e-324|nan|inf|-inf|0x|\
                 true|1979-05-27|#|\\|\0|é|\u{feff}|[0,0,0]|[1,0,0,0]|[1e308,1e308,1e308]";
    let words: Vec<String> = words.split('|').map(str::to_owned).collect();
    prop_oneof![4 => prop::sample::select(words), 1 => any::<String>()]
}

/// Replaces `cut` characters of the good scene from position `at` (both wrapped) by `with`.
fn spoilt((at, cut, with): &(prop::sample::Index, usize, String), text: &str) -> String {
    let at = at.index(text.chars().count() + 1);
    let head: String = text.chars().take(at).collect();
    let tail: String = text.chars().skip(at + cut).collect();
    format!("{head}{with}{tail}")
}

/// The text with one number after the other, chosen by `which`, in place of its own.
fn with_numbers(text: &str, which: &[(prop::sample::Index, &str)]) -> String {
    let is_of_number = |c: char| c.is_ascii_digit() || "+-.eE".contains(c);
    // Digits stand in names, too; those are spoilt as well, which is as ugly.
    let mut parts: Vec<String> = Vec::new();
    for c in text.chars() {
        match parts.last_mut() {
            Some(part) if part.ends_with(is_of_number) == is_of_number(c) => part.push(c),
            _ => parts.push(c.into()),
        }
    }
    for (index, number) in which {
        let places: Vec<usize> = (0..parts.len()).filter(|i| parts[*i].parse::<f64>().is_ok()).collect();
        parts[places[index.index(places.len())]] = (*number).into();
    }
    parts.concat()
}

const EXTREMES: [&str; 12] = [
    "0",
    "-1",
    "1e308",
    "-1e308",
    "5e-324",
    "1e-160",
    "1e160",
    "nan",
    "inf",
    "-inf",
    "9223372036854775807",
    "255",
];

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(2000) })]

    #[test]
    fn any_text_ends_in_a_scene_or_a_message(text in any::<String>()) {
        ends_well(&text);
    }

    #[test]
    fn any_row_of_pieces_ends_in_a_scene_or_a_message(pieces in prop::collection::vec(piece(), 0..40)) {
        ends_well(&pieces.concat());
    }

    #[test]
    fn a_good_scene_spoilt_anywhere_ends_in_a_scene_or_a_message(
        changes in prop::collection::vec((any::<prop::sample::Index>(), 0usize..12, piece()), 1..4),
    ) {
        ends_well(&changes.iter().fold(GOOD.to_owned(), |text, change| spoilt(change, &text)));
    }

    #[test]
    fn a_gallery_spoilt_anywhere_ends_in_a_scene_or_a_message(
        changes in prop::collection::vec((any::<prop::sample::Index>(), 0usize..12, piece()), 1..4),
    ) {
        ends_well(&changes.iter().fold(GALLERY.to_owned(), |text, change| spoilt(change, &text)));
    }

    #[test]
    fn extreme_numbers_anywhere_end_in_a_scene_or_a_message(
        which in prop::collection::vec((any::<prop::sample::Index>(), prop::sample::select(&EXTREMES[..])), 1..4),
    ) {
        ends_well(&with_numbers(GALLERY, &which));
    }

    #[test]
    fn a_good_scene_cut_anywhere_and_twice_ends_in_a_scene_or_a_message(at in any::<prop::sample::Index>()) {
        let at = at.index(GALLERY.len());
        let at = (0..=at).rev().find(|at| GALLERY.is_char_boundary(*at)).unwrap_or(0);
        ends_well(&GALLERY[..at]);
        ends_well(&GALLERY[at..]);
        ends_well(&format!("{GALLERY}{}", &GALLERY[..at]));
    }

    #[test]
    fn values_within_values_end_in_a_message(depth in 1usize..4000, of in prop::sample::select(vec!["[", "{a=", "[[a]]\n[", "a."])) {
        ends_well(&format!("x = {}", of.repeat(depth)));
        ends_well(&of.repeat(depth));
    }

    #[test]
    fn a_good_scene_with_its_lines_shuffled_ends_in_a_scene_or_a_message(
        lines in Just(GOOD.lines().map(str::to_owned).collect::<Vec<_>>()).prop_shuffle(),
    ) {
        ends_well(&lines.join("\n"));
    }
}

#[test]
fn the_good_scene_is_good() {
    for text in [GOOD, GALLERY] {
        Scene::parse(text, Path::new("good.toml")).unwrap_or_else(|error| panic!("{error}"));
    }
}
