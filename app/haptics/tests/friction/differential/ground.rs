//! A finger that is drawn along one line over a plane, over the same plane of triangles, or round a ball.

use crate::common::{DEPTH, K, ball, entity, point_finger, table};
use haptics::mesh::{Mesh, TriangleSoup};
use haptics::{ContactState, Entity, Finger, Friction, Shape};
use nalgebra::Vector3;
use std::sync::{Arc, OnceLock};

/// Radius of the ball (m).
pub(crate) const BALL_M: f64 = 0.1;

/// What the finger is drawn over, always at the depth of chapter 8.1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Ground {
    Plane,
    /// Crossed aslant: its triangles are 1.7 mm wide, and none has an edge along the way.
    Triangles,
    /// Along a great circle.
    Ball,
}

pub(crate) const GROUNDS: [Ground; 3] = [Ground::Plane, Ground::Triangles, Ground::Ball];

/// Geometry of the slide in its own plane: places are lengths along the way, `s` of the HIP and `g` of the god-object.
impl Ground {
    /// How far the surface point S is ahead of the god-object, along the tangent plane of that.
    pub(crate) fn gap_m(self, s: f64, g: f64) -> f64 {
        match self {
            Self::Ball => (BALL_M - DEPTH) * (s / (BALL_M - DEPTH) - g / BALL_M).sin(),
            _ => s - g,
        }
    }

    /// How deep the HIP is below that plane.
    pub(crate) fn load_m(self, s: f64, g: f64) -> f64 {
        match self {
            Self::Ball => BALL_M - (BALL_M - DEPTH) * (s / (BALL_M - DEPTH) - g / BALL_M).cos(),
            _ => DEPTH,
        }
    }

    /// How far apart two places of the god-object are, by the way between them.
    pub(crate) fn chord_m(self, way_m: f64) -> f64 {
        match self {
            Self::Ball => 2.0 * BALL_M * (0.5 * way_m / BALL_M).sin(),
            _ => way_m,
        }
    }

    /// Where the god-object is that has no gap.
    pub(crate) fn foot(self, s: f64) -> f64 {
        match self {
            Self::Ball => s / (BALL_M - DEPTH) * BALL_M,
            _ => s,
        }
    }

    fn entity(self, friction: Friction) -> Entity {
        match self {
            Self::Plane => table(friction),
            Self::Triangles => entity(Shape::from(triangles()), friction),
            Self::Ball => ball(BALL_M, friction),
        }
    }

    /// Where the HIP is, so far above (below if negative) the surface.
    fn place_W(self, s: f64, height_m: f64) -> Vector3<f64> {
        match self {
            Self::Ball => {
                let (sin, cos) = (s / (BALL_M - DEPTH)).sin_cos();
                Vector3::new(sin, cos, 0.0) * (BALL_M + height_m)
            }
            _ => WAY * s + Vector3::y() * height_m,
        }
    }

    /// How far along the way the god-object is, the way's direction there and the normal.
    fn along(self, god_object_W: &Vector3<f64>) -> (f64, Vector3<f64>, Vector3<f64>) {
        match self {
            Self::Ball => {
                let out = god_object_W.normalize();
                (BALL_M * out.x.atan2(out.y), Vector3::new(out.y, -out.x, 0.0), out)
            }
            _ => (WAY.dot(god_object_W), WAY, Vector3::y()),
        }
    }
}

/// Aslant over the triangles: 3, 4, 5.
const WAY: Vector3<f64> = Vector3::new(0.8, 0.0, 0.6);

fn triangles() -> Arc<Mesh> {
    static MESH: OnceLock<Arc<Mesh>> = OnceLock::new();
    MESH.get_or_init(|| Arc::new(Mesh::build(grid()).unwrap().0)).clone()
}

fn grid() -> TriangleSoup {
    const SIDE: i32 = 100;
    let corner = |i: i32, k: i32| Vector3::new(f64::from(i) * 1.7e-3, 0.0, f64::from(k) * 1.9e-3);
    // The way begins in the middle of a face.
    let vertices = (0..=SIDE)
        .flat_map(|k| {
            (0..=SIDE).map(move |i| corner(i - SIDE / 2, k - SIDE / 2) + Vector3::new(6e-4, 0.0, 7e-4))
        })
        .collect();
    let at = |i: i32, k: i32| (k * (SIDE + 1) + i) as u32;
    let faces = (0..SIDE)
        .flat_map(|k| {
            (0..SIDE).flat_map(move |i| {
                let [a, b, c, d] = [at(i, k), at(i, k + 1), at(i + 1, k + 1), at(i + 1, k)];
                if (i + k) % 2 == 0 { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] }
            })
        })
        .collect();
    TriangleSoup { vertices, faces }
}

/// What is felt in one tick.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Felt {
    /// Tangential force over stiffness, positive while it draws the finger back.
    pub(crate) spring_m: f64,
    /// Place of the god-object.
    pub(crate) god_m: f64,
    pub(crate) state: ContactState,
}

/// A finger in contact.
pub(crate) struct Drawn {
    ground: Ground,
    entity: [Entity; 1],
    finger: Finger,
    dt_s: f64,
}

impl Drawn {
    /// Enters from above, so that the god-object begins at place 0.
    pub(crate) fn begin(ground: Ground, friction: &Friction, dt_s: f64) -> Self {
        let entity = [ground.entity(friction.clone())];
        let mut drawn = Self { ground, entity, finger: point_finger(), dt_s };
        drawn.finger.step(&drawn.entity, &ground.place_W(0.0, 1e-3), dt_s);
        let felt = drawn.to(0.0);
        assert!(felt.god_m.abs() < 1e-17 && felt.spring_m.abs() < 1e-17, "{ground:?}: {felt:?}");
        drawn
    }

    /// One tick, with the HIP at this place.
    pub(crate) fn to(&mut self, s: f64) -> Felt {
        let out = self.finger.step(&self.entity, &self.ground.place_W(s, -DEPTH), self.dt_s);
        let contact = self.finger.contact(0).expect("in contact");
        let (god_m, way, normal) = self.ground.along(&contact.god_object_W);
        let load_m = self.ground.load_m(s, god_m);
        let force = out.force_on_user_W;
        assert!((force.dot(&normal) / K - load_m).abs() < 1e-14, "friction does not press");
        assert!(force.dot(&way.cross(&normal)).abs() / K < 1e-14, "nor draw aside");
        Felt { spring_m: -force.dot(&way) / K, god_m, state: out.friction }
    }
}
