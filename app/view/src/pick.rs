//! What lies in a direction: what people point at.
//!
//! Model: triangles are kept in bundles of neighbours with a box around each, and only those of boxes that the ray meets are
//! looked at. Both sides of a triangle count.

use crate::moment::Moment;
use crate::stage::{Stage, Thing};
use crate::triangles::Triangles;
use nalgebra::{Isometry3, Point3, Vector3};
use std::sync::Arc;

/// Triangles of a bundle.
const BUNDLE: usize = 32;

/// Half of a straight line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// Where it begins (m).
    pub origin: Point3<f64>,
    /// Where it goes; unit length.
    pub direction: Vector3<f64>,
}

/// What a ray meets first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Of which entity.
    pub entity: usize,
    /// Where, in the world (m).
    pub place: Point3<f64>,
    /// From the ray's beginning (m).
    pub distance_m: f64,
}

/// Finds what rays meet of a stage.
#[derive(Debug, Default)]
pub struct Picker {
    things: Vec<(Thing, Arc<Bundles>)>,
    /// Of each entity, whether fingers feel it.
    is_felt: Vec<bool>,
}

/// Of the same triangles all boxes, in the triangles' frame.
#[derive(Debug)]
struct Bundles {
    around_all: Extent,
    around: Vec<Extent>,
}

/// A box along the axes (m).
#[derive(Debug, Clone, Copy)]
struct Extent {
    least: Vector3<f64>,
    most: Vector3<f64>,
}

impl Picker {
    /// Of what can be seen of a stage.
    pub fn new(stage: &Stage) -> Self {
        let mut made: Vec<(*const Triangles, Arc<Bundles>)> = Vec::new();
        let things = stage.things.iter().map(|thing| {
            let of = Arc::as_ptr(&thing.triangles);
            let known = made.iter().rev().find(|(other, _)| *other == of).map(|(_, bundles)| bundles.clone());
            let bundles = known.unwrap_or_else(|| {
                made.push((of, Arc::new(Bundles::new(&thing.triangles))));
                made[made.len() - 1].1.clone()
            });
            (thing.clone(), bundles)
        });
        let is_felt = stage.known.iter().map(|known| known.is_felt).collect();
        Self { things: things.collect(), is_felt }
    }

    /// What a ray of the world meets first at this moment.
    pub fn pick(&self, moment: &Moment, ray: &Ray) -> Option<Hit> {
        self.pick_of(moment, ray, |_| true)
    }

    /// The same of what fingers feel, as far as it counts.
    pub fn pick_felt(&self, moment: &Moment, ray: &Ray, counts: impl Fn(usize) -> bool) -> Option<Hit> {
        let is_felt = |entity: usize| self.is_felt.get(entity).copied().unwrap_or(true);
        self.pick_of(moment, ray, |entity| is_felt(entity) && counts(entity))
    }

    /// The same of those entities only that count.
    pub fn pick_of(&self, moment: &Moment, ray: &Ray, counts: impl Fn(usize) -> bool) -> Option<Hit> {
        let mut nearest: Option<Hit> = None;
        let space = moment.seen_space();
        let things = self.things.iter().filter(|(thing, _)| thing.space == space && counts(thing.entity));
        for (thing, bundles) in things {
            let Some(frame) = moment.poses.get(thing.entity) else { continue };
            let within_m = nearest.map_or(f64::INFINITY, |hit| hit.distance_m);
            let own = ray.seen_from(&(frame * thing.pose));
            if let Some(distance_m) = bundles.meet(&thing.triangles, &own, within_m) {
                nearest = Some(Hit { entity: thing.entity, place: ray.at(distance_m), distance_m });
            }
        }
        nearest
    }
}

impl Ray {
    /// So far along it (m).
    pub fn at(&self, distance_m: f64) -> Point3<f64> {
        self.origin + distance_m * self.direction
    }

    fn seen_from(&self, frame: &Isometry3<f64>) -> Self {
        Self {
            origin: frame.inverse_transform_point(&self.origin),
            direction: frame.inverse_transform_vector(&self.direction),
        }
    }

    /// How far away it meets a triangle (after Moeller and Trumbore).
    fn meet(&self, [a, b, c]: [Point3<f64>; 3]) -> Option<f64> {
        let (ab, ac) = (b - a, c - a);
        let across = self.direction.cross(&ac);
        let volume = ab.dot(&across);
        let from = self.origin - a;
        let u = from.dot(&across) / volume;
        let along = from.cross(&ab);
        let v = self.direction.dot(&along) / volume;
        let distance_m = ac.dot(&along) / volume;
        // A ray within the plane has no volume: what is compared then is no number.
        (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && distance_m > 0.0).then_some(distance_m)
    }
}

impl Bundles {
    fn new(triangles: &Triangles) -> Self {
        let around: Vec<Extent> =
            triangles.corners.chunks(BUNDLE).map(|bundle| Extent::around(triangles, bundle)).collect();
        Self { around_all: Extent::around(triangles, &triangles.corners), around }
    }

    fn meet(&self, triangles: &Triangles, ray: &Ray, within_m: f64) -> Option<f64> {
        if !self.around_all.is_met(ray, within_m) {
            return None;
        }
        let mut nearest_m = within_m;
        for (bundle, around) in triangles.corners.chunks(BUNDLE).zip(&self.around) {
            if !around.is_met(ray, nearest_m) {
                continue;
            }
            for corners in bundle {
                let met = ray.meet(corners.map(|corner| triangles.places[corner as usize]));
                nearest_m = met.map_or(nearest_m, |met| nearest_m.min(met));
            }
        }
        (nearest_m < within_m).then_some(nearest_m)
    }
}

impl Extent {
    fn around(triangles: &Triangles, corners: &[[u32; 3]]) -> Self {
        let none = Self { least: Vector3::repeat(f64::INFINITY), most: Vector3::repeat(f64::NEG_INFINITY) };
        corners.as_flattened().iter().fold(none, |Self { least, most }, corner| {
            let place = triangles.places[*corner as usize].coords;
            Self { least: least.inf(&place), most: most.sup(&place) }
        })
    }

    /// Whether a ray comes into it before that distance (m).
    fn is_met(&self, ray: &Ray, within_m: f64) -> bool {
        let (mut from, mut to) = (0.0f64, within_m);
        for axis in 0..3 {
            let (origin, speed) = (ray.origin[axis], ray.direction[axis]);
            if speed == 0.0 {
                if origin < self.least[axis] || origin > self.most[axis] {
                    return false;
                }
                continue;
            }
            let (a, b) = ((self.least[axis] - origin) / speed, (self.most[axis] - origin) / speed);
            // What rounding takes from a flat box is given back.
            let margin = 1e-12 * (1.0 + a.abs().max(b.abs()));
            (from, to) = (from.max(a.min(b) - margin), to.min(a.max(b) + margin));
        }
        from <= to
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::UnitQuaternion;
    use std::time::Instant;

    /// A ball of rings.
    fn ball(radius_m: f64, around: u32) -> Triangles {
        let rings = (0..=around / 2).map(|ring| {
            let (sin, cos) = (std::f64::consts::PI * f64::from(ring) / f64::from(around / 2)).sin_cos();
            crate::triangles::Ring { place: [radius_m * sin, -radius_m * cos], normal: [sin, -cos] }
        });
        Triangles::revolved(&rings.collect::<Vec<_>>(), around)
    }

    fn stage(things: Vec<(Arc<Triangles>, usize)>) -> Stage {
        let things = things.into_iter().map(|(triangles, entity)| Thing {
            entity,
            triangles,
            pose: Isometry3::identity(),
            colour: [1.0; 4],
            is_coloured: true,
            texture: None,
            casts_shadow: false,
            space: 0,
        });
        Stage { things: things.collect(), ..Stage::default() }
    }

    #[test]
    fn the_nearest_thing_is_met_where_it_is_at_the_moment() {
        let triangles = Arc::new(ball(0.1, 64));
        let picker = Picker::new(&stage(vec![(triangles.clone(), 0), (triangles, 1)]));
        let turned = UnitQuaternion::from_euler_angles(0.3, -1.0, 0.2);
        let poses = vec![
            Isometry3::from_parts(Vector3::new(0.0, 0.0, -2.0).into(), turned),
            Isometry3::from_parts(Vector3::new(0.0, 0.05, -1.0).into(), turned),
        ];
        let mut moment = Moment { poses, ..Moment::default() };
        let ray = |x, y| Ray { origin: Point3::new(x, y, 0.0), direction: -Vector3::z() };
        let hit = picker.pick(&moment, &ray(0.0, 0.0)).expect("a ball");
        assert_eq!(hit.entity, 1);
        // The ball's own surface, less what 64 corners around cut off: r (1 - cos(pi / 64)) = 0.12 mm, over the slope.
        let expected_m = 1.0 - (0.1f64.powi(2) - 0.05f64.powi(2)).sqrt();
        assert!((hit.distance_m - expected_m).abs() < 3e-4, "{hit:?} {expected_m}");
        assert_eq!(picker.pick(&moment, &ray(0.0, -0.06)).map(|hit| hit.entity), Some(0), "past the nearer");
        assert_eq!(picker.pick(&moment, &ray(0.0, 0.2)), None);
        moment.poses[1].translation.vector.x = 1.0;
        assert_eq!(picker.pick(&moment, &ray(0.0, 0.0)).map(|hit| hit.entity), Some(0));
        assert_eq!(picker.pick(&moment, &ray(1.0, 0.05)).map(|hit| hit.entity), Some(1));
        let back = Ray { direction: Vector3::z(), ..ray(0.0, 0.0) };
        assert_eq!(picker.pick(&moment, &back), None, "what is behind is not met");
    }

    #[test]
    fn boxes_hide_no_triangle() {
        let triangles = ball(0.1, 40);
        let bundles = Bundles::new(&triangles);
        for k in 0..2000u32 {
            // Points of a spiral around, towards others within.
            let (a, y) = (f64::from(k) * 2.4, f64::from(k) / 1000.0 - 1.0);
            let origin = Point3::new(a.cos(), y, a.sin());
            let aim = Point3::new(0.11 * (3.0 * a).sin(), 0.11 * (5.0 * a).cos(), 0.05 * (7.0 * a).sin());
            let ray = Ray { origin, direction: (aim - origin).normalize() };
            let all = triangles
                .corners
                .iter()
                .filter_map(|corners| ray.meet(corners.map(|corner| triangles.places[corner as usize])));
            let nearest = all.reduce(f64::min);
            assert_eq!(bundles.meet(&triangles, &ray, f64::INFINITY), nearest, "{ray:?}");
        }
    }

    #[test]
    fn a_click_on_a_hundred_thousand_triangles_takes_no_picture_of_time() {
        let triangles = Arc::new(ball(0.1, 320));
        assert!(triangles.corners.len() > 100_000);
        let picker = Picker::new(&stage(vec![(triangles, 0)]));
        let moment = Moment { poses: vec![Isometry3::identity()], ..Moment::default() };
        let mut took: Vec<_> = (0..101)
            .map(|k| {
                let origin = Point3::new(0.0, 0.001 * f64::from(k - 50), 1.0);
                let begun = Instant::now();
                assert!(picker.pick(&moment, &Ray { origin, direction: -Vector3::z() }).is_some());
                begun.elapsed()
            })
            .collect();
        took.sort();
        println!("median {:?}", took[50]);
        // A picture of 60 a second has 16 ms; a busy machine and a slow build are in it.
        assert!(took[50].as_micros() < 4000, "{:?}", took[50]);
    }
}
