//! An event as a line of text: names instead of numbers, SI with the units in the keys.

use crate::book::Book;
use crate::columns::Names;
use io_driver::device::run_time_s;
use serde_json::Value;
use shm_abi::FaultReason;
use world::events::{Event, Kind};

/// The keys, in order; a table's header.
pub(super) const KEYS: [&str; 17] = [
    "tick",
    "t_s",
    "kind",
    "finger",
    "entity",
    "other",
    "fingers",
    "force_n",
    "peak_n",
    "impulse_x_n_s",
    "impulse_y_n_s",
    "impulse_z_n_s",
    "lasted_s",
    "number",
    "text",
    "from",
    "to",
];

/// Meaning of the number of an order, of a fault or of a scene, in words.
pub(super) fn said(event: &Event, book: &Book) -> Said {
    match event.kind {
        Kind::Order { number } => (book.order(number), None),
        Kind::Fault { reason } => (FaultReason::sentence_for(reason).into_owned(), None),
        Kind::Scene { number } => {
            let scene = book.scene(number);
            (scene.as_ref().map_or_else(String::new, |(file, _)| file.clone()), scene)
        }
        _ => (String::new(), None),
    }
}

/// Words, and of a scene what it is called and whom its numbers mean.
pub(super) type Said = (String, Option<(String, Names)>);

/// What an event says, in the order of [`KEYS`]; null where it says nothing.
fn values(event: &Event, said: &str, names: &Names, period_ns: u64) -> [Value; KEYS.len()] {
    let facts = event.kind.facts();
    let life =
        |of: fn(&world::events::Life) -> f64| facts.life.as_ref().map_or(Value::Null, |life| of(life).into());
    let text = |text: &str| if text.is_empty() { Value::Null } else { text.into() };
    let entity = |entity: Option<u32>| text(names.entity(entity));
    // The world's name is empty.
    let space =
        |of: fn([u32; 2]) -> u32| facts.spaces.map_or(Value::Null, |spaces| names.space(of(spaces)).into());
    let lasted_s = facts.life.map(|life| life.lasted_s).or(facts.lasted_s);
    [
        event.run_tick.into(),
        run_time_s(event.run_tick.cast_signed(), period_ns).into(),
        facts.word.into(),
        text(facts.finger.map_or("", |finger| name(&names.fingers, finger))),
        entity(facts.entity),
        entity(facts.other),
        text(&holders(facts.holders, &names.fingers)),
        facts.life.map(|life| life.force_n).or(facts.force_n).into(),
        life(|life| life.peak_n),
        life(|life| life.impulse_W.x),
        life(|life| life.impulse_W.y),
        life(|life| life.impulse_W.z),
        lasted_s.into(),
        facts.number.into(),
        text(if said.is_empty() { facts.text } else { said }),
        space(|[from, _]| from),
        space(|[_, to]| to),
    ]
}

/// As an object without the keys of which it says nothing.
pub(super) fn json(event: &Event, said: &str, names: &Names, period_ns: u64) -> String {
    let told = KEYS.iter().zip(values(event, said, names, period_ns)).filter(|(_, value)| !value.is_null());
    let members: Vec<String> = told.map(|(key, value)| format!("\"{key}\":{value}")).collect();
    format!("{{{}}}", members.join(","))
}

/// As a row of a table; names have neither commas nor quotes, and what people wrote loses them.
pub(super) fn csv(event: &Event, said: &str, names: &Names, period_ns: u64) -> String {
    let cells = values(event, said, names, period_ns).map(|value| match value {
        Value::Null => String::new(),
        Value::String(text) => text.replace([',', '"'], " "),
        number => number.to_string(),
    });
    cells.join(",")
}

/// A name by its number; empty for none.
pub(super) fn name(names: &[String], number: u32) -> &str {
    names.get(number as usize).map_or("", String::as_str)
}

/// The fingers whose bits are set, joined by `+`.
pub(super) fn holders(bits: u32, fingers: &[String]) -> String {
    let held = fingers
        .iter()
        .enumerate()
        .filter(|(finger, _)| bits.checked_shr(*finger as u32).unwrap_or(0) & 1 == 1);
    held.map(|(_, name)| name.as_str()).collect::<Vec<_>>().join("+")
}
