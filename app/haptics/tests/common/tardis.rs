//! A hull of 0.1 m, and behind its door a room of 0.4 m.
#![allow(dead_code)]

use haptics::{
    CsgPart, CsgTree, Cuboid, Door, Entity, Finger, FingerOutput, Form, Friction, Passage, Plane, Shape,
};
use nalgebra::{Isometry3, Vector3};

use crate::common::{DT, entity};
use crate::trees::{built, v};

/// The space behind the door.
pub(crate) const INSIDE: u32 = 1;
/// Of the door, which lies in the hull's face at z = 0.05.
pub(crate) const DOOR_Z: f64 = 0.05;
pub(crate) const HALF: [f64; 2] = [0.02, 0.03];

pub(crate) fn solid_hull() -> Shape {
    Shape::Form(Form::from(Cuboid::new([0.1; 3]).unwrap()))
}

/// With a niche as wide as the door, 9 cm deep.
pub(crate) fn open_hull() -> Shape {
    let niche = CsgPart::at(Cuboid::new([0.04, 0.06, 0.1]).unwrap(), v(0.0, 0.0, 0.01));
    built(&CsgTree::difference([CsgPart::from(Cuboid::new([0.1; 3]).unwrap()), niche])).into()
}

/// From -0.2 to 0.2 along x, from `floor_m` up, and from -0.35 to the door's plane.
pub(crate) fn room(floor_m: f64) -> Vec<Entity> {
    let walls = [
        (Vector3::y(), floor_m),
        (-Vector3::y(), -(floor_m + 0.4)),
        (Vector3::x(), -0.2),
        (-Vector3::x(), -0.2),
        (Vector3::z(), -0.35),
        (-Vector3::z(), -DOOR_Z),
    ];
    let wall =
        |(normal, offset_m)| entity(Plane::new(normal, offset_m).unwrap(), Friction::None).within(INSIDE);
    walls.map(wall).into()
}

pub(crate) fn door(hull: usize, walls: std::ops::Range<u32>) -> Door {
    let at = Isometry3::translation(0.0, 0.0, DOOR_Z);
    Door::new(hull, at, [2.0 * HALF[0], 2.0 * HALF[1]], [0, INSIDE], walls).unwrap()
}

/// A finger, and where it may go.
pub(crate) struct Visit {
    pub(crate) finger: Finger,
    pub(crate) passage: Passage,
    pub(crate) entities: Vec<Entity>,
    pub(crate) doors: Vec<Door>,
    /// Which of the entities move.
    pub(crate) moves: fn(usize) -> bool,
}

impl Visit {
    /// The hull is the first entity, the room's walls are the next six.
    pub(crate) fn new(hull: Shape, friction: &Friction, radius_m: f64) -> Self {
        let mut entities = vec![entity(hull, friction.clone())];
        entities.extend(room(-0.2).into_iter().map(|wall| wall.with_friction(friction.clone()).unwrap()));
        Self::of(entities, radius_m)
    }

    pub(crate) fn of(entities: Vec<Entity>, radius_m: f64) -> Self {
        let doors = vec![door(0, 1..7)];
        Self {
            finger: Finger::new(radius_m, entities.len()).unwrap(),
            passage: Passage::new(&doors),
            entities,
            doors,
            moves: |_| false,
        }
    }

    pub(crate) fn step(&mut self, hip: Vector3<f64>) -> FingerOutput {
        let Self { finger, passage, entities, doors, moves } = self;
        let step = |finger: &mut Finger| finger.step(entities, &hip, DT);
        passage.step(finger, (entities, doors), DT, *moves, step).0
    }

    /// Straight there in steps of half a millimetre; the last output and the largest change of the force in a tick.
    pub(crate) fn go(&mut self, to: Vector3<f64>) -> (FingerOutput, f64) {
        let from = self.finger.last_hip_W().unwrap_or(to);
        let ticks = ((to - from).norm() / 5e-4).ceil().max(1.0) as u32;
        let mut out = self.step(from);
        let mut largest = 0.0f64;
        for tick in 1..=ticks {
            let next = self.step(from + (to - from) * (f64::from(tick) / f64::from(ticks)));
            largest = largest.max((next.force_on_user_W - out.force_on_user_W).norm());
            out = next;
        }
        (out, largest)
    }

    pub(crate) fn space(&self) -> u32 {
        self.finger.space()
    }
}
