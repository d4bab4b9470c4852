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
    /// Of the first message with further objects; the others follow.
    const FIRST_PART: u32 = 3;
    /// Of the first finger; the others follow.
    const FIRST_FINGER: u32 = 16;
    /// Of the first object; the others follow.
    const FIRST_OBJECT: u32 = 64;
    /// Objects of one message: a common library takes messages of 64 KiB, and each field of one is 8 bytes.
    const MOST_IN_ONE: usize = 7000;
    /// Names of the messages with further objects, and of their fields.
    pub(in crate::record) const PARTS: [[&str; 3]; 13] = [
        ["More2", ".phantom3.More2", "more_2"],
        ["More3", ".phantom3.More3", "more_3"],
        ["More4", ".phantom3.More4", "more_4"],
        ["More5", ".phantom3.More5", "more_5"],
        ["More6", ".phantom3.More6", "more_6"],
        ["More7", ".phantom3.More7", "more_7"],
        ["More8", ".phantom3.More8", "more_8"],
        ["More9", ".phantom3.More9", "more_9"],
        ["More10", ".phantom3.More10", "more_10"],
        ["More11", ".phantom3.More11", "more_11"],
        ["More12", ".phantom3.More12", "more_12"],
        ["More13", ".phantom3.More13", "more_13"],
        ["More14", ".phantom3.More14", "more_14"],
    ];
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

    /// Objects of each message: of the tick itself, then of those with further ones; the last one has all the rest.
    pub(in crate::record) fn parts(objects: usize) -> impl Iterator<Item = std::ops::Range<usize>> {
        let count = objects.div_ceil(MOST_IN_ONE).clamp(1, PARTS.len() + 1);
        (0..count).map(move |part| {
            let end = if part + 1 == count { objects } else { MOST_IN_ONE * (part + 1) };
            MOST_IN_ONE * part..end
        })
    }

    /// The field of a message with further objects, the first of which is the second one.
    pub(in crate::record) fn of_part(part: usize) -> u32 {
        FIRST_PART + part as u32 - 1
    }

    /// Number of the first object of the message that a field is.
    pub(in crate::record) fn first_of_part(field: u32) -> Option<usize> {
        (FIRST_PART..FIRST_FINGER).contains(&field).then(|| MOST_IN_ONE * (field - FIRST_PART + 1) as usize)
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
    /// An earlier tick; what has none is as of this one.
    pub(in crate::record) const AS_OF: u32 = 10;
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
    )
    .with_optional(&[(object::AS_OF, "as_of", Uint64)]);
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
    let (fingers, bodies) = fields.split_at(names.fingers.len());
    let objects = |range: std::ops::Range<usize>| {
        let of_message = (0..).map(|index| (tick::of_object(index), Message(".phantom3.Object")));
        of_message.zip(&bodies[range]).map(|((number, kind), name)| (number, &**name, kind))
    };
    let mut parts = tick::parts(bodies.len());
    let own = parts.next().unwrap_or_default();
    let members = of_fingers.zip(fingers).map(|((number, kind), name)| (number, &**name, kind));
    let mut all: Vec<_> =
        [(tick::TICK, "tick", Uint64), (tick::T, "t", Double)].into_iter().chain(members).collect();
    all.extend(objects(own));
    let (mut more, mut of_parts) = (Vec::new(), Vec::new());
    for ((part, range), [name, full_name, field]) in (1..).zip(parts).zip(tick::PARTS) {
        more.push(MessageType::new(name, &objects(range).collect::<Vec<_>>()));
        of_parts.push((tick::of_part(part), field, Message(full_name)));
    }
    all.extend(of_parts);
    let tick = MessageType::new("Tick", &all);
    let mut files = foxglove::files();
    files.push(ProtoFile {
        name: "phantom3.proto",
        package: "phantom3",
        imports: &[foxglove::FILE],
        messages: [finger, object, tick, event, order].into_iter().chain(more).collect(),
    });
    descriptor_set(&files)
}

/// What the fields of `phantom3.Tick` are called: of the fingers, then of the objects.
pub(super) fn field_names(names: &Names) -> Vec<String> {
    let mut taken: std::collections::HashSet<String> = ["tick", "t"].map(Into::into).into();
    let parts = tick::parts(names.bodies.len()).count();
    taken.extend(tick::PARTS[..parts - 1].iter().map(|[.., field]| (*field).to_owned()));
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
        for objects in [0, 1, 7000, 7001, 50_000, 98_000, 200_000] {
            let parts: Vec<_> = tick::parts(objects).collect();
            assert!(parts[0].start == 0 && parts.last().is_some_and(|last| last.end == objects), "{objects}");
            for (part, range) in parts.iter().enumerate().skip(1) {
                assert_eq!(
                    (range.start, range.start),
                    (parts[part - 1].end, tick::first_of_part(tick::of_part(part)).unwrap())
                );
                assert!(range.len() <= 7000 || objects > 98_000);
            }
        }
        assert_eq!([2, 16].map(tick::first_of_part), [None, None]);
        assert_eq!(tick::finger(tick::of_object(0)), None);
    }
}
