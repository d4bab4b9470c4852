//! A world in a box: entities, bodies and fingers that are stepped together, as the application does it.
#![allow(dead_code, non_snake_case, unreachable_pub)]

use haptics::{Entity, Finger, Friction, Plane, Shape};
use nalgebra::{Isometry3, Vector3};
use physics::{Body, FingerSettings, FingerTick, Made, Manipulation, MassProperties, Settings, Touch};

pub const DT: f64 = 1e-3;
pub const G: f64 = 9.81;

/// Fingers, entities and bodies.
pub struct World {
    pub entities: Vec<Entity>,
    pub manipulation: Manipulation,
    pub fingers: Vec<Finger>,
    pub touches: Vec<Touch>,
    /// What the fingers do besides touching; their HIPs are set by `step`.
    pub ticks: Vec<FingerTick>,
    pub made: Made,
    /// True: there is more room for contacts when it is needed.
    pub makes_room: bool,
}

impl World {
    pub fn new(entities: Vec<Entity>, bodies: &[(usize, Body)], settings: Settings, fingers: usize) -> Self {
        let manipulation = Manipulation::new(&entities, bodies, settings).unwrap();
        let finger = || Finger::new(0.0, entities.len()).unwrap().with_ramp_in(0.0).unwrap();
        let fingers: Vec<_> = (0..fingers).map(|_| finger()).collect();
        let ticks = vec![FingerTick::at(Vector3::zeros()); fingers.len()];
        Self {
            entities,
            manipulation,
            fingers,
            touches: Vec::new(),
            ticks,
            made: Made::default(),
            makes_room: true,
        }
    }

    /// With fingers that are more than points, all alike.
    pub fn with_fingers(mut self, settings: FingerSettings) -> Self {
        self.manipulation = self.manipulation.with_fingers(&vec![settings; self.fingers.len()]);
        self
    }

    /// One tick: the force on each finger, by its HIP.
    pub fn step(&mut self, hips: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
        self.step_in(hips, DT)
    }

    /// One tick of another length (s).
    pub fn step_in(&mut self, hips: &[Vector3<f64>], dt_s: f64) -> Vec<Vector3<f64>> {
        self.touches.clear();
        let mut forces = Vec::new();
        for (index, (finger, hip)) in self.fingers.iter_mut().zip(hips).enumerate() {
            self.ticks[index].hip_W = *hip;
            forces.push(finger.step(&self.entities, hip, dt_s).force_on_user_W);
            for contact in finger.contacts() {
                self.touches.push(Touch::of(contact, index));
            }
        }
        let rendered = self.touches.clone();
        if self.makes_room {
            self.manipulation.make_room(&self.entities);
        }
        self.made = self.manipulation.step_with(&mut self.entities, &mut self.touches, &mut self.ticks, dt_s);
        for (touch, was) in self.touches.iter().zip(rendered) {
            forces[touch.finger] += touch.force_on_user_W - was.force_on_user_W;
        }
        for (force, tick) in forces.iter_mut().zip(&self.ticks) {
            *force += tick.force_on_user_W;
        }
        forces
    }

    pub fn body(&self) -> &Body {
        &self.manipulation.bodies()[0]
    }
}

/// A half-space below `y = 0`, leaned about z by an angle (rad).
pub fn floor(lean: f64, stiffness: f64, mu: f64) -> Entity {
    let normal = Vector3::new(-lean.sin(), lean.cos(), 0.0);
    let plane = Plane::new(normal, 0.0).unwrap();
    Entity::new(plane, Isometry3::identity(), stiffness)
        .unwrap()
        .with_friction(Friction::coulomb(mu).unwrap())
        .unwrap()
}

/// An entity with Coulomb friction and the damping of what moves.
pub fn object(shape: impl Into<Shape>, X_WB: Isometry3<f64>, stiffness: f64, mu: f64) -> Entity {
    let entity =
        Entity::new(shape, X_WB, stiffness).unwrap().with_friction(Friction::coulomb(mu).unwrap()).unwrap();
    entity.with_damping(1.0).unwrap()
}

/// At rest where its entity is.
pub fn body(entity: &Entity, mass_kg: f64) -> Body {
    Body::at_rest(MassProperties::of_shape(&entity.shape, mass_kg).unwrap(), &entity.X_WB)
}
