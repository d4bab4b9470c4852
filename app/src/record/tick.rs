//! A row as a `phantom3.Tick` message, and back.
//!
//! Invariant: what is written reads back bit for bit, but for what a recording of this scene does not tell
//! ([`Names`]): that is as in an empty row.

use super::foxglove;
use super::schema::{finger, object, tick};
use super::wire::{Message, Value, each_field};
use crate::columns::{Names, feature_name, feature_named, friction_name, friction_named};
use crate::row::{BodyRow, FingerRow, Row};
use io_driver::device::run_time_s;
use nalgebra::{Quaternion, Vector3};
use physics::GraspQuality;
use shm_abi::MAX_DEVICES;

/// So many objects are written in every tick.
pub(super) const ALWAYS: usize = 64;

/// Writes a row and its bodies into an empty message: of more than [`ALWAYS`] those of the numbers `changed`, which ascend, or
/// all.
pub(super) fn write(
    out: &mut Message,
    row: &Row,
    (bodies, changed): (&[BodyRow], Option<&[u32]>),
    names: &Names,
    period_ns: u64,
) {
    out.whole(tick::TICK, row.run_tick);
    out.double(tick::T, run_time_s(row.run_tick.cast_signed(), period_ns));
    for (index, (_, finger)) in names.fingers.iter().zip(&row.fingers).enumerate() {
        out.message(tick::of_finger(index), |out| write_finger(out, finger, index, names));
    }
    let mut changed = changed.filter(|_| bodies.len() > ALWAYS);
    for (number, part) in tick::parts(bodies.len()).enumerate() {
        let here = changed.map(|all| {
            let (here, later) = all.split_at(all.partition_point(|&at| (at as usize) < part.end));
            changed = Some(later);
            here
        });
        let begin = part.start;
        let write_object = |out: &mut Message, index: usize| {
            out.message(tick::of_object(index - begin), |out| write_body(out, &bodies[index], names));
        };
        let write_part = |out: &mut Message| match here {
            None => part.for_each(|index| write_object(out, index)),
            Some(here) => here.iter().for_each(|&index| write_object(out, index as usize)),
        };
        match number {
            0 => write_part(out),
            _ if here.is_none_or(|here| !here.is_empty()) => {
                out.message(tick::of_part(number), write_part);
            }
            _ => {}
        }
    }
}

fn write_finger(out: &mut Message, row: &FingerRow, index: usize, names: &Names) {
    foxglove::vector(out, finger::HIP, &row.hip);
    foxglove::vector(out, finger::GOD, &row.god_object);
    foxglove::vector(out, finger::FORCE, &row.force_on_user);
    foxglove::vector(out, finger::APPLIED, &row.applied_on_user);
    out.text(finger::ENTITY, names.entity(row.entity));
    out.text(finger::FEATURE, feature_name(row.feature));
    out.text(finger::FRICTION, friction_name(row.friction));
    foxglove::vector(out, finger::VELOCITY, &row.velocity);
    let extras = names.extras_of(index);
    if names.has_torque(index) {
        foxglove::vector(out, finger::TORQUE, &row.torque_on_user);
    }
    if extras.orientation {
        let [w, x, y, z] = row.orientation_wxyz;
        foxglove::quaternion(out, finger::ORIENTATION, &Quaternion::new(w, x, y, z));
    }
    if extras.buttons {
        out.whole(finger::BUTTONS, row.buttons);
    }
    if names.is_passive(index) {
        out.double(finger::ENERGY, row.energy_j).double(finger::CONTROLLED, row.controlled_n);
    }
    if names.ties(index) {
        out.text(finger::ATTACHED, names.entity(row.attached));
    }
    if names.spaces.is_some() {
        out.text(finger::SPACE, names.space(row.space));
    }
    if row.normal != Vector3::zeros() {
        foxglove::vector(out, finger::NORMAL, &row.normal);
        out.double(finger::FRICTION_RADIUS, row.friction_radius_m);
    }
}

fn write_body(out: &mut Message, body: &BodyRow, names: &Names) {
    foxglove::vector(out, object::POSITION, &body.position);
    foxglove::quaternion(out, object::ORIENTATION, &body.orientation);
    foxglove::vector(out, object::VELOCITY, &body.velocity);
    foxglove::vector(out, object::ANGULAR_VELOCITY, &body.angular_velocity);
    if names.grasp_quality {
        let GraspQuality { contacts, rank, residual, has_force_closure } = body.grasp;
        out.whole(object::CONTACTS, contacts as u64)
            .whole(object::RANK, rank as u64)
            .double(object::RESIDUAL, residual)
            .whole(object::CLOSURE, u64::from(has_force_closure));
    }
    if names.lists {
        out.whole(object::LIST, u64::from(body.is_slow));
    }
    if let Some(tick) = body.as_of.filter(|_| names.as_of) {
        out.given(object::AS_OF, tick);
    }
}

/// Reads a row and its bodies, of which those that are not told are as `before`; `None` if the message is none, or not of this
/// scene.
pub(super) fn read(message: &[u8], names: &Names, before: Option<&[BodyRow]>) -> Option<(Row, Vec<BodyRow>)> {
    let mut row = Row::empty();
    let before = before.filter(|before| before.len() == names.bodies.len());
    let mut bodies = before.map_or_else(|| vec![BodyRow::default(); names.bodies.len()], <[BodyRow]>::to_vec);
    let (mut fingers, mut objects) = (0, 0);
    each_field(message, |field, value| {
        if field == tick::TICK {
            row.run_tick = value.whole()?;
        } else if let Some(index) = tick::finger(field) {
            *row.fingers.get_mut(index)? = read_finger(value.bytes()?, index, names)?;
            fingers += 1;
        } else if let Some(index) = tick::object(field) {
            *bodies.get_mut(index)? = read_body(value.bytes()?)?;
            objects += 1;
        } else if let Some(first) = tick::first_of_part(field) {
            each_field(value.bytes()?, |field, value| {
                *bodies.get_mut(first + tick::object(field)?)? = read_body(value.bytes()?)?;
                objects += 1;
                Some(())
            })?;
        }
        Some(())
    })?;
    let are_all = objects == bodies.len() || (before.is_some() && objects < bodies.len());
    (fingers == names.fingers.len().min(MAX_DEVICES) && are_all).then_some((row, bodies))
}

fn read_finger(message: &[u8], index: usize, names: &Names) -> Option<FingerRow> {
    let mut row = FingerRow { has_orientation: names.extras_of(index).orientation, ..FingerRow::default() };
    let entity = |value: Value<'_>| {
        let name = value.text()?;
        Some(names.entities.iter().position(|other| other == name)? as u32)
    };
    // The world has no name, and is not written.
    let space = |value: Value<'_>| {
        let name = value.text()?;
        Some(names.spaces.as_ref()?.iter().position(|other| other == name)? as u32 + 1)
    };
    each_field(message, |field, value| {
        match field {
            finger::HIP => row.hip = vector(value)?,
            finger::GOD => row.god_object = vector(value)?,
            finger::FORCE => row.force_on_user = vector(value)?,
            finger::APPLIED => row.applied_on_user = vector(value)?,
            finger::ENTITY => row.entity = Some(entity(value)?),
            finger::FEATURE => row.feature = feature_named(value.text()?)?,
            finger::FRICTION => row.friction = friction_named(value.text()?)?,
            finger::VELOCITY => row.velocity = vector(value)?,
            finger::TORQUE => row.torque_on_user = vector(value)?,
            finger::ORIENTATION => {
                let q = quaternion(value)?;
                row.orientation_wxyz = [q.w, q.i, q.j, q.k];
            }
            finger::BUTTONS => row.buttons = value.whole()?,
            finger::ENERGY => row.energy_j = value.double()?,
            finger::CONTROLLED => row.controlled_n = value.double()?,
            finger::ATTACHED => row.attached = Some(entity(value)?),
            finger::SPACE => row.space = space(value)?,
            finger::NORMAL => row.normal = vector(value)?,
            finger::FRICTION_RADIUS => row.friction_radius_m = value.double()?,
            // Of a later version.
            _ => {}
        }
        Some(())
    })?;
    Some(row)
}

fn read_body(message: &[u8]) -> Option<BodyRow> {
    let mut body =
        BodyRow { orientation: Quaternion::from_parts(0.0, Vector3::zeros()), ..BodyRow::default() };
    each_field(message, |field, value| {
        match field {
            object::POSITION => body.position = vector(value)?,
            object::ORIENTATION => body.orientation = quaternion(value)?,
            object::VELOCITY => body.velocity = vector(value)?,
            object::ANGULAR_VELOCITY => body.angular_velocity = vector(value)?,
            object::CONTACTS => body.grasp.contacts = usize::try_from(value.whole()?).ok()?,
            object::RANK => body.grasp.rank = usize::try_from(value.whole()?).ok()?,
            object::RESIDUAL => body.grasp.residual = value.double()?,
            object::CLOSURE => body.grasp.has_force_closure = value.whole()? != 0,
            object::LIST => body.is_slow = value.whole()? != 0,
            object::AS_OF => body.as_of = Some(value.whole()?),
            _ => {}
        }
        Some(())
    })?;
    Some(body)
}

fn numbers(value: Value<'_>) -> Option<[f64; 4]> {
    let mut numbers = [0.0; 4];
    each_field(value.bytes()?, |field, value| {
        if let Some(number) = (field as usize).checked_sub(1).and_then(|index| numbers.get_mut(index)) {
            *number = value.double()?;
        }
        Some(())
    })?;
    Some(numbers)
}

fn vector(value: Value<'_>) -> Option<Vector3<f64>> {
    let [x, y, z, _] = numbers(value)?;
    Some(Vector3::new(x, y, z))
}

fn quaternion(value: Value<'_>) -> Option<Quaternion<f64>> {
    let [x, y, z, w] = numbers(value)?;
    Some(Quaternion::new(w, x, y, z))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::columns::{Cell, each_cell};
    use haptics::{ContactState, Feature};
    use io_driver::device::Extras;

    fn names() -> Names {
        Names {
            fingers: vec!["a".into(), "b-c".into()],
            extras: vec![Extras::default(), Extras { orientation: true, buttons: true }],
            passive: vec![true, false],
            torques: vec![false, true],
            entities: vec!["table".into(), "cube".into()],
            bodies: vec!["cube".into()],
            ties: vec![false, true],
            grasp_quality: true,
            spaces: Some(vec!["hall".into(), "inside".into()]),
            lists: true,
            as_of: true,
        }
    }

    fn cells(row: &Row, bodies: &[BodyRow]) -> Vec<String> {
        let mut cells = Vec::new();
        each_cell(row, bodies, &names(), 1_000_000, |cell| {
            cells.push(match cell {
                Cell::Number(number) => format!("{:x}", number.to_bits()),
                other => format!("{other:?}"),
            });
        });
        cells
    }

    #[test]
    fn every_column_of_a_row_comes_back_bit_for_bit() {
        let mut row = Row { run_tick: 12_345, ..Row::empty() };
        let number = |index: usize| Vector3::new(0.1 * index as f64, -0.0, -1e-300);
        for (index, finger) in row.fingers.iter_mut().take(2).enumerate() {
            *finger = FingerRow {
                hip: number(index + 1),
                velocity: number(2),
                god_object: number(3),
                force_on_user: number(4),
                torque_on_user: if index == 1 { number(5) } else { Vector3::zeros() },
                applied_on_user: number(6),
                entity: (index == 1).then_some(1),
                feature: Feature::Edge,
                friction: ContactState::Slip,
                ..FingerRow::default()
            };
        }
        (row.fingers[0].energy_j, row.fingers[0].controlled_n) = (-1.5e-3, 0.25);
        let b = &mut row.fingers[1];
        (b.orientation_wxyz, b.has_orientation) = ([0.5, -0.5, 0.5, -0.0], true);
        (b.buttons, b.attached, b.space) = (u64::MAX, Some(1), 2);
        (b.normal, b.friction_radius_m) = (Vector3::new(0.6, 0.0, -0.8), 1e-3);
        let bodies = [None, Some(0), Some(12_340)].map(|as_of| BodyRow {
            position: number(7),
            orientation: Quaternion::new(0.5, -0.5, 0.5, 0.5),
            velocity: number(8),
            angular_velocity: number(9),
            grasp: GraspQuality { contacts: 3, rank: 6, residual: 1e-9, has_force_closure: true },
            is_slow: true,
            as_of,
        });
        for body in bodies {
            let mut message = Message::new();
            write(&mut message, &row, (&[body], None), &names(), 1_000_000);
            let (back, bodies_back) = read(message.bytes(), &names(), None).expect("a tick");
            assert_eq!((back, &bodies_back[..]), (row, &[body][..]));
            assert_eq!(cells(&back, &bodies_back), cells(&row, &[body]), "negative zeros among them");
        }
    }

    #[test]
    fn of_many_bodies_a_tick_tells_those_that_changed_and_needs_the_one_before() {
        for count in [ALWAYS, 1000, 16_000] {
            let bodies: Vec<String> = (0..count).map(|body| format!("body{body}")).collect();
            let names = Names { fingers: Vec::new(), bodies, ..names() };
            let body = |x: f64| BodyRow { position: Vector3::new(x, 1.0, -0.0), ..BodyRow::default() };
            let first: Vec<_> = (0..count).map(|number| body(number as f64)).collect();
            let mut second = first.clone();
            let changed = [0, 17, count - 1];
            changed.into_iter().for_each(|changed| second[changed] = body(-1.5));
            let message = |bodies: &[BodyRow], changed: Option<&[u32]>| {
                let mut message = Message::new();
                write(&mut message, &Row::empty(), (bodies, changed), &names, 1_000_000);
                message.bytes().to_vec()
            };
            let changed = changed.map(|number| number as u32);
            let [whole, changes] = [message(&first, None), message(&second, Some(&changed))];
            assert_eq!(changes.len() < 500, count > ALWAYS, "{count}: {} of {}", changes.len(), whole.len());
            let all = read(&whole, &names, None).expect("all").1;
            assert_eq!(all, first, "{count}");
            assert_eq!(read(&changes, &names, Some(&all)).expect("changes").1, second, "{count}");
            assert_eq!(read(&changes, &names, None).is_none(), count > ALWAYS, "{count}");
        }
    }

    #[test]
    fn a_message_of_another_scene_or_cut_short_is_no_row() {
        let mut message = Message::new();
        write(&mut message, &Row::empty(), (&[BodyRow::default()], None), &names(), 1_000_000);
        assert!(read(message.bytes(), &names(), None).is_some());
        let fewer = Names { bodies: Vec::new(), ..names() };
        assert!(read(message.bytes(), &fewer, None).is_none());
        let more = Names { bodies: vec!["cube".into(), "ball".into()], ..names() };
        assert!(read(message.bytes(), &more, None).is_none());
        assert!(read(&message.bytes()[..message.bytes().len() - 1], &names(), None).is_none());
    }
}
