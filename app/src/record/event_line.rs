//! An event as a line of text: names instead of numbers, SI with the units in the keys.

use crate::columns::Names;
use io_driver::device::run_time_s;
use serde_json::Value;
use world::events::Event;

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

/// What an event says, in the order of [`KEYS`]; null where it says nothing.
fn values(event: &Event, names: &Names, period_ns: u64) -> [Value; KEYS.len()] {
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
        life(|life| life.force_n),
        life(|life| life.peak_n),
        life(|life| life.impulse_W.x),
        life(|life| life.impulse_W.y),
        life(|life| life.impulse_W.z),
        lasted_s.into(),
        facts.number.into(),
        text(facts.text),
        space(|[from, _]| from),
        space(|[_, to]| to),
    ]
}

/// As an object without the keys of which it says nothing.
pub(super) fn json(event: &Event, names: &Names, period_ns: u64) -> String {
    let told = KEYS.iter().zip(values(event, names, period_ns)).filter(|(_, value)| !value.is_null());
    let members: Vec<String> = told.map(|(key, value)| format!("\"{key}\":{value}")).collect();
    format!("{{{}}}", members.join(","))
}

/// As a row of a table; names have neither commas nor quotes.
pub(super) fn csv(event: &Event, names: &Names, period_ns: u64) -> String {
    let cells = values(event, names, period_ns).map(|value| match value {
        Value::Null => String::new(),
        Value::String(text) => text,
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
