//! What becomes of actions: the orders that they are, and how eyes and the sun change.

use crate::eyes::Eyes;
use crate::input::{Action, Bound};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use world::StereoMode;

/// A step of what is chosen, and a fine one (m).
const STEP_M: [f64; 2] = [0.005, 0.001];
/// A turn of it, and a fine one (degrees).
const TURN_DEG: [f64; 2] = [5.0, 1.0];
/// It takes so long (s).
const WAY_S: f64 = 0.1;
/// Steps that follow each other within this time go on from where the last one leads to (s).
const TOGETHER_S: f64 = 0.5;
/// Stiffness and damping change by this factor (Melder 7.2.12).
const FACTOR: f64 = 1.1;

/// Where what is chosen is on its way to.
#[derive(Debug, Clone, Default)]
pub struct Steering {
    /// Whether things stand still, as far as one knows.
    pub is_paused: bool,
    /// Which entity, where to (m), and when that was ordered (s).
    way: Option<(usize, Vector3<f64>, f64)>,
}

impl Steering {
    /// The order that moves or turns an entity, which is here now.
    pub fn order(
        &mut self,
        bound: Bound,
        (entity, name): (usize, &str),
        pose: &Isometry3<f64>,
        now_s: f64,
    ) -> Option<String> {
        let fine = usize::from(bound.is_fine);
        match bound.action {
            Action::Move(way) => {
                let goes_on = |(of, _, at_s): &(usize, _, f64)| *of == entity && now_s - at_s < TOGETHER_S;
                let from = self.way.filter(goes_on).map_or(pose.translation.vector, |(_, to, _)| to);
                let to = from + STEP_M[fine] * vector(way);
                self.way = Some((entity, to, now_s));
                // A tenth of a micrometre is enough for people who read it.
                Some(format!("move {name} to {:.7} {:.7} {:.7} in {WAY_S}", to.x, to.y, to.z))
            }
            Action::Turn([x, y, z]) => {
                let rad = TURN_DEG[fine].to_radians();
                Some(format!("turn {name} about {x} {y} {z} by {rad:.7} in {WAY_S}"))
            }
            _ => None,
        }
    }

    /// The order of an action that concerns the run, or the chosen entity of it.
    pub fn command(&mut self, action: Action, chosen: Option<&str>) -> Option<String> {
        let of = chosen.map(|name| format!(" of {name}")).unwrap_or_default();
        Some(match action {
            Action::Stiffness(step) => format!("stiffness {}{of}", step.times(1.0, FACTOR)),
            Action::Damping(step) => format!("damping {}{of}", step.times(1.0, FACTOR)),
            Action::Reset => "reset".into(),
            Action::Pause => {
                self.is_paused ^= true;
                if self.is_paused { "pause" } else { "resume" }.into()
            }
            _ => return None,
        })
    }
}

/// The order that tells where the camera is: devices that are attached to it go along.
pub fn camera_order(pose: &Isometry3<f64>) -> String {
    let (place, turned) = (pose.translation.vector, pose.rotation);
    // A tenth of a micrometre, and of a microradian.
    format!(
        "camera at {:.7} {:.7} {:.7} {:.8} {:.8} {:.8} {:.8}",
        place.x, place.y, place.z, turned.w, turned.i, turned.j, turned.k
    )
}

/// How an action that moves or turns what is chosen turns the sun: it goes over the sky where the arrow points.
pub fn turned_sun(bound: Bound) -> UnitQuaternion<f64> {
    let about = match bound.action {
        // What is above goes to x about -z, and to z about x.
        Action::Move([x, y, z]) => vector([z, y, -x]),
        Action::Turn(about) => vector(about),
        _ => Vector3::zeros(),
    };
    UnitQuaternion::new(TURN_DEG[usize::from(bound.is_fine)].to_radians() * about)
}

fn vector(way: [i8; 3]) -> Vector3<f64> {
    Vector3::from(way.map(f64::from))
}

/// The next way to serve two eyes that every window has.
pub fn next_mode(mode: StereoMode) -> StereoMode {
    match mode {
        StereoMode::Off => StereoMode::SideBySide,
        StereoMode::SideBySide => StereoMode::TopBottom,
        StereoMode::TopBottom => StereoMode::Anaglyph,
        StereoMode::Anaglyph | StereoMode::QuadBuffer => StereoMode::Off,
    }
}

/// What it is called.
pub fn stereo_word(mode: StereoMode) -> String {
    format!("stereo {}", mode.name())
}

impl Eyes {
    /// A step of what follows, as a factor.
    pub const STEP: f64 = 1.1;

    /// Farther apart, or nearer together: 1 mm to 0.5 m.
    pub fn separate(&mut self, times: f64) {
        self.separation_m = (self.separation_m * times).clamp(0.001, 0.5);
    }

    /// Agreeing farther away, or nearer: 5 cm to 10 m.
    pub fn converge(&mut self, times: f64) {
        self.convergence_m = (self.convergence_m * times).clamp(0.05, 10.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::Step;

    fn step(action: Action) -> Bound {
        Bound { action, is_fine: false }
    }

    const CUBE: (usize, &str) = (3, "cube");

    #[test]
    fn steps_are_orders_and_quick_ones_go_on_from_each_other() {
        let mut steering = Steering::default();
        let pose = Isometry3::translation(0.1, 0.2, -0.3);
        let mut order =
            |action, is_fine, now_s| steering.order(Bound { action, is_fine }, CUBE, &pose, now_s);
        let right = Action::Move([1, 0, 0]);
        assert_eq!(
            order(right, false, 1.0).as_deref(),
            Some("move cube to 0.1050000 0.2000000 -0.3000000 in 0.1")
        );
        // The cube is still where it was, for what is known.
        assert_eq!(
            order(right, true, 1.1).as_deref(),
            Some("move cube to 0.1060000 0.2000000 -0.3000000 in 0.1")
        );
        assert_eq!(
            order(Action::Move([0, -1, 0]), false, 2.0).as_deref(),
            Some("move cube to 0.1000000 0.1950000 -0.3000000 in 0.1")
        );
        assert_eq!(
            order(Action::Turn([0, 1, 0]), false, 2.0).as_deref(),
            Some("turn cube about 0 1 0 by 0.0872665 in 0.1")
        );
        let other = steering.order(step(right), (4, "ball"), &pose, 2.1);
        assert_eq!(other.as_deref(), Some("move ball to 0.1050000 0.2000000 -0.3000000 in 0.1"));
        assert_eq!(steering.order(step(Action::Reset), CUBE, &pose, 3.0), None);
    }

    #[test]
    fn stiffness_and_damping_are_of_all_or_of_what_is_chosen_and_ten_steps_back_undo_ten() {
        let mut steering = Steering::default();
        let mut command = |action, chosen| steering.command(action, chosen);
        assert_eq!(command(Action::Stiffness(Step::More), None).as_deref(), Some("stiffness 1.1"));
        assert_eq!(
            command(Action::Damping(Step::Less), Some("cube")).as_deref(),
            Some("damping 0.9090909090909091 of cube")
        );
        assert_eq!(command(Action::Pause, None).as_deref(), Some("pause"));
        assert_eq!(command(Action::Pause, None).as_deref(), Some("resume"));
        assert_eq!(command(Action::Reset, None).as_deref(), Some("reset"));
        assert_eq!(command(Action::Help, None), None);
        let less: f64 = Step::Less.times(1.0, FACTOR);
        // Twenty roundings.
        assert!((FACTOR.powi(10) * less.powi(10) - 1.0).abs() < 20.0 * f64::EPSILON);
    }

    #[test]
    fn the_sun_goes_where_the_arrow_points() {
        let above = Vector3::y();
        for way in [[1, 0, 0], [-1, 0, 0], [0, 0, 1], [0, 0, -1]] {
            let gone = turned_sun(step(Action::Move(way))) * above;
            let along = gone.dot(&vector(way));
            assert!((along - 5f64.to_radians().sin()).abs() < 1e-12, "{way:?} {gone}");
        }
        let fine = turned_sun(Bound { action: Action::Move([1, 0, 0]), is_fine: true });
        assert!((fine.angle() - 1f64.to_radians()).abs() < 1e-12);
    }

    #[test]
    fn eyes_are_served_in_all_ways_in_turn_and_stay_within_limits() {
        let mut mode = StereoMode::QuadBuffer;
        let turns: Vec<&str> = (0..5)
            .map(|_| {
                mode = next_mode(mode);
                mode.name()
            })
            .collect();
        assert_eq!(turns, ["off", "side-by-side", "top-bottom", "anaglyph", "off"]);
        let mut eyes = Eyes::default();
        eyes.separate(Eyes::STEP);
        eyes.converge(1.0 / Eyes::STEP);
        assert!((eyes.separation_m - 0.0693).abs() < 1e-12 && (eyes.convergence_m - 0.6 / 1.1).abs() < 1e-12);
        (0..100).for_each(|_| eyes.separate(Eyes::STEP));
        (0..100).for_each(|_| eyes.converge(1.0 / Eyes::STEP));
        assert_eq!((eyes.separation_m, eyes.convergence_m), (0.5, 0.05));
    }
}
