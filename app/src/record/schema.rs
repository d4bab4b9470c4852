//! The messages of a recording: `phantom3.Tick` with a field for each finger and object, `phantom3.Event`.
//!
//! Model: the descriptor is made for the scene, so that a plot of `/tick.thumb.force.y` needs no index, and a reader in
//! any language has the scene's names. Names that are no identifiers are made such (`left-thumb`: `left_thumb`).
//! Units: SI; world frame; forces are forces on the user.

use super::descriptor::{Kind, MessageType, ProtoFile, descriptor_set};
use super::foxglove;
use crate::columns::Names;

/// A tick's message.
pub(super) const TICK: &str = "phantom3.Tick";
/// An event's.
pub(super) const EVENT: &str = "phantom3.Event";

/// An order's.
pub(super) const ORDER: &str = "phantom3.Order";

/// Fields of `phantom3.Tick`.
pub(super) mod tick {
    pub(in crate::record) const TICK: u32 = 1;
    pub(in crate::record) const T: u32 = 2;
    /// Of the first finger; the others follow.
    const FIRST_FINGER: u32 = 16;
    /// Of the first object; the others follow.
    const FIRST_OBJECT: u32 = 64;
    /// Numbers that the encoding keeps to itself.
    const RESERVED: std::ops::Range<u32> = 19_000..20_000;

    /// The field of a finger.
    pub(in crate::record) fn of_finger(index: usize) -> u32 {
        FIRST_FINGER + index as u32
    }

    /// The field of an object.
    pub(in crate::record) fn of_object(index: usize) -> u32 {
        let number = FIRST_OBJECT + index as u32;
        if number < RESERVED.start { number } else { number + RESERVED.len() as u32 }
    }

    /// Which finger a field is.
    pub(in crate::record) fn finger(field: u32) -> Option<usize> {
        (FIRST_FINGER..FIRST_OBJECT).contains(&field).then(|| (field - FIRST_FINGER) as usize)
    }

    /// Which object a field is.
    pub(in crate::record) fn object(field: u32) -> Option<usize> {
        let skipped = if field < RESERVED.end { 0 } else { RESERVED.len() as u32 };
        Some((field - skipped).checked_sub(FIRST_OBJECT)? as usize)
    }
}

/// Fields of `phantom3.Finger`.
pub(super) mod finger {
    pub(in crate::record) const HIP: u32 = 1;
    pub(in crate::record) const GOD: u32 = 2;
    pub(in crate::record) const FORCE: u32 = 3;
    pub(in crate::record) const APPLIED: u32 = 4;
    pub(in crate::record) const ENTITY: u32 = 5;
    pub(in crate::record) const FEATURE: u32 = 6;
    pub(in crate::record) const FRICTION: u32 = 7;
    pub(in crate::record) const VELOCITY: u32 = 8;
    pub(in crate::record) const TORQUE: u32 = 9;
    pub(in crate::record) const ORIENTATION: u32 = 10;
    pub(in crate::record) const BUTTONS: u32 = 11;
    pub(in crate::record) const ENERGY: u32 = 12;
    pub(in crate::record) const CONTROLLED: u32 = 13;
    pub(in crate::record) const ATTACHED: u32 = 14;
    pub(in crate::record) const SPACE: u32 = 15;
    pub(in crate::record) const NORMAL: u32 = 16;
    pub(in crate::record) const FRICTION_RADIUS: u32 = 17;
}

/// Fields of `phantom3.Object`.
pub(super) mod object {
    pub(in crate::record) const POSITION: u32 = 1;
    pub(in crate::record) const ORIENTATION: u32 = 2;
    pub(in crate::record) const VELOCITY: u32 = 3;
    pub(in crate::record) const ANGULAR_VELOCITY: u32 = 4;
    pub(in crate::record) const CONTACTS: u32 = 5;
    pub(in crate::record) const RANK: u32 = 6;
    pub(in crate::record) const RESIDUAL: u32 = 7;
    pub(in crate::record) const CLOSURE: u32 = 8;
    /// 0: the fast list, 1: the slow one.
    pub(in crate::record) const LIST: u32 = 9;
}

/// Fields of `phantom3.Event`.
pub(super) mod event {
    pub(in crate::record) const TICK: u32 = 1;
    pub(in crate::record) const T: u32 = 2;
    pub(in crate::record) const KIND: u32 = 3;
    pub(in crate::record) const FINGER: u32 = 4;
    pub(in crate::record) const ENTITY: u32 = 5;
    pub(in crate::record) const VALUE: u32 = 6;
    pub(in crate::record) const TEXT: u32 = 7;
    pub(in crate::record) const OTHER: u32 = 8;
    pub(in crate::record) const IMPULSE: u32 = 9;
    pub(in crate::record) const PEAK: u32 = 10;
}

/// Fields of `phantom3.Order`.
pub(super) mod order {
    pub(in crate::record) const TICK: u32 = 1;
    pub(in crate::record) const T: u32 = 2;
    pub(in crate::record) const WORDS: u32 = 3;
}

/// The descriptors of ticks and events of such a scene.
pub(super) fn descriptors(names: &Names) -> Vec<u8> {
    use Kind::{Bool, Double, Message, Text, Uint64};
    let (vector, quaternion) = (foxglove::VECTOR3, foxglove::QUATERNION);
    let finger = MessageType::new(
        "Finger",
        &[
            (finger::HIP, "hip", vector),
            (finger::GOD, "god", vector),
            (finger::FORCE, "force", vector),
            (finger::APPLIED, "applied", vector),
            (finger::ENTITY, "entity", Text),
            (finger::FEATURE, "feature", Text),
            (finger::FRICTION, "friction", Text),
            (finger::VELOCITY, "velocity", vector),
            (finger::TORQUE, "torque", vector),
            (finger::ORIENTATION, "orientation", quaternion),
            (finger::BUTTONS, "buttons", Uint64),
            (finger::ENERGY, "energy", Double),
            (finger::CONTROLLED, "controlled", Double),
            (finger::ATTACHED, "attached", Text),
            (finger::SPACE, "space", Text),
            (finger::NORMAL, "normal", vector),
            (finger::FRICTION_RADIUS, "friction_radius", Double),
        ],
    );
    let object = MessageType::new(
        "Object",
        &[
            (object::POSITION, "position", vector),
            (object::ORIENTATION, "orientation", quaternion),
            (object::VELOCITY, "velocity", vector),
            (object::ANGULAR_VELOCITY, "angular_velocity", vector),
            (object::CONTACTS, "contacts", Uint64),
            (object::RANK, "rank", Uint64),
            (object::RESIDUAL, "residual", Double),
            (object::CLOSURE, "closure", Bool),
            (object::LIST, "list", Uint64),
        ],
    );
    let event = MessageType::new(
        "Event",
        &[
            (event::TICK, "tick", Uint64),
            (event::T, "t", Double),
            (event::KIND, "kind", Text),
            (event::FINGER, "finger", Text),
            (event::ENTITY, "entity", Text),
            (event::VALUE, "value", Double),
            (event::TEXT, "text", Text),
            (event::OTHER, "other", Text),
            (event::IMPULSE, "impulse", vector),
            (event::PEAK, "peak", Double),
        ],
    );
    let order = MessageType::new(
        "Order",
        &[(order::TICK, "tick", Uint64), (order::T, "t", Double), (order::WORDS, "words", Text)],
    );
    let fields = field_names(names);
    let of_fingers =
        (0..names.fingers.len()).map(|index| (tick::of_finger(index), Message(".phantom3.Finger")));
    let of_objects =
        (0..names.bodies.len()).map(|index| (tick::of_object(index), Message(".phantom3.Object")));
    let members =
        of_fingers.chain(of_objects).zip(&fields).map(|((number, kind), name)| (number, &**name, kind));
    let all: Vec<_> =
        [(tick::TICK, "tick", Uint64), (tick::T, "t", Double)].into_iter().chain(members).collect();
    let tick = MessageType::new("Tick", &all);
    let mut files = foxglove::files();
    files.push(ProtoFile {
        name: "phantom3.proto",
        package: "phantom3",
        imports: &[foxglove::FILE],
        messages: vec![finger, object, tick, event, order],
    });
    descriptor_set(&files)
}

/// What the fields of `phantom3.Tick` are called: of the fingers, then of the objects.
pub(super) fn field_names(names: &Names) -> Vec<String> {
    let mut taken: std::collections::HashSet<String> = ["tick", "t"].map(Into::into).into();
    let mut claim = |name: &String| {
        let plain: String = name.replace('-', "_");
        let is_word = plain.starts_with(|first: char| first.is_ascii_alphabetic() || first == '_');
        let plain = if is_word { plain } else { format!("n{plain}") };
        let numbered = (2..).map(|number| format!("{plain}_{number}"));
        let free = std::iter::once(plain.clone()).chain(numbered).find(|name| !taken.contains(name));
        let free = free.unwrap_or(plain);
        taken.insert(free.clone());
        free
    };
    names.fingers.iter().chain(&names.bodies).map(&mut claim).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_becomes_an_identifier_of_its_own() {
        let names = |fingers: &[&str], bodies: &[&str]| Names {
            fingers: fingers.iter().map(|name| (*name).to_owned()).collect(),
            bodies: bodies.iter().map(|name| (*name).to_owned()).collect(),
            ..Names::default()
        };
        let fields = field_names(&names(&["f0", "left-thumb", "t"], &["f0", "left_thumb", "3rd"]));
        assert_eq!(fields, ["f0", "left_thumb", "t_2", "f0_2", "left_thumb_2", "n3rd"]);
    }

    #[test]
    fn numbers_of_fields_are_unique_and_lead_back() {
        for index in [0, 1, 7, 18_935, 18_936, 30_000] {
            assert_eq!(tick::object(tick::of_object(index)), Some(index));
            assert!(!(19_000..20_000).contains(&tick::of_object(index)));
        }
        assert_eq!(tick::finger(tick::of_finger(7)), Some(7));
        assert_eq!(tick::finger(tick::of_object(0)), None);
    }
}
