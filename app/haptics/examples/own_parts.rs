//! A shape, a friction law and a contact algorithm of one's own: `cargo run -p haptics --example own_parts`.
//!
//! Each takes a page and plugs into the rest; none needs anything but this crate's public items. A finger is dragged
//! over an egg carton (own shape), over a table that holds the more firmly the longer it is touched (own law), and over
//! a ball through honey (own algorithm).
#![allow(non_snake_case)]

use haptics::{
    Algorithm, ContactAlgorithm, ContactMemory, Entity, Feature, Finger, Friction, FrictionLaw,
    FrictionMemory, FrictionQuery, FrictionState, ParameterError, Plane, Shape, Sphere, Surface,
    SurfacePoint, Touch, TouchInput,
};
use nalgebra::{Isometry3, Vector3};

pub(crate) fn main() -> Result<(), ParameterError> {
    let pose = Isometry3::identity();
    let carton = Entity::new(Shape::own(EggCarton { height_m: 2e-3, period_m: 0.03 }), pose, 500.0)?;
    let table = Entity::new(Plane::new(Vector3::y(), 0.0)?, pose, 500.0)?
        .with_friction(Friction::own(Ageing { mu_fresh: 0.2, mu_aged: 0.8, ageing_s: 0.05 }))?;
    let ball = Entity::new(Sphere::new(0.05)?, Isometry3::translation(0.02, -0.05, 0.0), 500.0)?
        .with_algorithm(Algorithm::own(Honey { time_constant_s: 0.02 }));
    for (name, entity) in [("egg carton", carton), ("ageing friction", table), ("honey", ball)] {
        println!(
            "{name}\n{:>8} {:>8} {:>8} {:>8} {:>8}  state",
            "t [ms]", "hip x", "god x", "F_x [N]", "F_y [N]"
        );
        for (tick, hip, out) in drag(&entity)?.into_iter().step_by(25) {
            let (god, force) = (out.god_object_W, out.force_on_user_W);
            println!(
                "{tick:>8} {:>8.5} {:>8.5} {:>8.4} {:>8.4}  {:?}",
                hip.x, god.x, force.x, force.y, out.friction
            );
        }
        println!();
    }
    Ok(())
}

/// Down to 3 mm below the plane y = 0, 0.15 s of rest, then sideways at 0.1 m/s for 0.3 s.
pub(crate) fn drag(
    entity: &Entity,
) -> Result<Vec<(i32, Vector3<f64>, haptics::FingerOutput)>, ParameterError> {
    let mut finger = Finger::new(0.0, 1)?;
    let step = |tick: i32| {
        let lowered = f64::from(tick.min(50)) / 50.0;
        let slid = 1e-4 * f64::from((tick - 200).max(0));
        let hip = Vector3::new(slid, 0.01 - 0.013 * lowered, 0.0);
        (tick, hip, finger.step(std::slice::from_ref(entity), &hip, 1e-3))
    };
    Ok((0..500).map(step).collect())
}

/// Everything below `y = h(x, z) = height sin(2 pi x / period) sin(2 pi z / period + pi / 2)`.
#[derive(Debug)]
pub(crate) struct EggCarton {
    pub(crate) height_m: f64,
    pub(crate) period_m: f64,
}

impl EggCarton {
    fn angles(&self, p: &Vector3<f64>) -> (f64, f64) {
        let per_m = std::f64::consts::TAU / self.period_m;
        (p.x * per_m, p.z * per_m + std::f64::consts::FRAC_PI_2)
    }

    /// How far above the surface, vertically \[m\].
    fn above(&self, p: &Vector3<f64>) -> f64 {
        let (u, v) = self.angles(p);
        p.y - self.height_m * u.sin() * v.sin()
    }

    /// The surface point straight above or below.
    fn at(&self, p: &Vector3<f64>) -> SurfacePoint {
        let (u, v) = self.angles(p);
        let slope = self.height_m * std::f64::consts::TAU / self.period_m;
        SurfacePoint {
            point_B: Vector3::new(p.x, p.y - self.above(p), p.z),
            normal_B: Vector3::new(-slope * u.cos() * v.sin(), 1.0, -slope * u.sin() * v.cos()).normalize(),
            feature: Feature::Surface,
            piece: 0,
        }
    }
}

impl Surface for EggCarton {
    /// Sign and zero are what counts; vertically measured it is a little too long.
    fn signed_distance(&self, point_B: &Vector3<f64>) -> f64 {
        self.above(point_B)
    }

    /// Foot on the tangent plane, and back onto the surface, a few times over.
    fn nearest(&self, point_B: &Vector3<f64>) -> SurfacePoint {
        (0..20).fold(self.at(point_B), |at, _| {
            let depth_m = at.normal_B.dot(&(at.point_B - point_B));
            self.at(&(point_B + at.normal_B * depth_m))
        })
    }

    /// In steps that miss no bump of a finger's usual tick; then by halving.
    fn entry(&self, from_B: &Vector3<f64>, to_B: &Vector3<f64>) -> Option<SurfacePoint> {
        const STEPS: i32 = 16;
        let along = |share: f64| from_B + (to_B - from_B) * share;
        let share = |step: i32| f64::from(step) / f64::from(STEPS);
        let first = (1..=STEPS).find(|&step| {
            self.above(&along(share(step - 1))) > 0.0 && self.above(&along(share(step))) <= 0.0
        })?;
        let (mut outside, mut inside) = (share(first - 1), share(first));
        for _ in 0..50 {
            let middle = 0.5 * (outside + inside);
            if self.above(&along(middle)) > 0.0 { outside = middle } else { inside = middle }
        }
        Some(self.at(&along(inside)))
    }

    fn settle(&self, _from: &SurfacePoint, on_tangent_plane_B: &Vector3<f64>) -> SurfacePoint {
        self.at(on_tangent_plane_B)
    }

    /// Fingers with a radius do not feel it.
    fn grown(&self, _radius_m: f64) -> Option<Self> {
        None
    }
}

/// Friction that grows while the contact rests: from a fresh coefficient to an aged one. Once it slides it is fresh.
#[derive(Debug)]
pub(crate) struct Ageing {
    pub(crate) mu_fresh: f64,
    pub(crate) mu_aged: f64,
    pub(crate) ageing_s: f64,
}

/// Which of a contact's numbers is its age \[s\].
const AGE: usize = 0;

impl FrictionLaw for Ageing {
    fn holds(&self, query: &FrictionQuery, memory: &mut FrictionMemory) -> bool {
        let holds = query.gap_m <= self.held_limit_m(query, memory);
        let age_s = &mut memory.words[AGE];
        *age_s = if holds { *age_s + query.dt_s } else { 0.0 };
        holds
    }

    fn slide(&self, query: &FrictionQuery, _memory: &FrictionMemory) -> f64 {
        query.gap_m - self.mu_fresh * query.load_m
    }

    /// The older the contact, the more it bears.
    fn held_limit_m(&self, query: &FrictionQuery, memory: &FrictionMemory) -> f64 {
        let mu = self.mu_aged + (self.mu_fresh - self.mu_aged) * (-memory.words[AGE] / self.ageing_s).exp();
        mu * query.load_m
    }
}

/// A god-object that follows the nearest surface point with a delay: sliding feels like honey on any shape.
#[derive(Debug)]
pub(crate) struct Honey {
    pub(crate) time_constant_s: f64,
}

/// Where things are in the contact's memory.
const PROXY: usize = 0;
const HAS_PROXY: usize = 3;

impl ContactAlgorithm for Honey {
    fn touch(&self, input: &TouchInput<'_>, memory: &mut ContactMemory) -> Option<Touch> {
        if !input.is_inside() {
            return None;
        }
        let at = input.nearest()?;
        let mut proxy_B = if memory.words[HAS_PROXY] > 0.0 { memory.vector(PROXY) } else { at.point_B };
        let dt_s = input.cone.dt_s;
        proxy_B += (at.point_B - proxy_B) * (dt_s / (self.time_constant_s + dt_s));
        memory.set_vector(PROXY, &proxy_B);
        memory.words[HAS_PROXY] = 1.0;
        let force_on_user_B = (proxy_B - input.cone.hip_B) * input.cone.stiffness_n_per_m;
        let normal_force_n = force_on_user_B.dot(&at.normal_B).max(0.0);
        Some(Touch {
            god_object: SurfacePoint { point_B: proxy_B, ..at },
            force_on_user_B,
            normal_force_n,
            friction: FrictionState::Slip,
        })
    }
}
