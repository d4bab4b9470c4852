//! Closed forms on slopes, edges and each other, against closed forms of mechanics.
#![allow(non_snake_case)]

use crate::{common, solids};

use common::*;
use haptics::{Capsule, Cone, Cuboid, Cylinder, Form, Sphere, Torus};
use nalgebra::{UnitQuaternion, Vector3};
use physics::Settings;
use solids::pose;

const MASS: f64 = 0.1;
/// Of object and floor: so stiff that what sinks in is a thousandth of the forms.
const STIFFNESS: f64 = 1e5;
const SERIES: f64 = STIFFNESS / 2.0;

/// A form on a slope; turned in its own frame first, then with the slope. x points up the slope.
fn on_slope(form: Form, turn: UnitQuaternion<f64>, height: f64, points: f64, lean: f64, mu: f64) -> World {
    damped_on_slope(form, turn, height, points, lean, mu, 1.0)
}

fn damped_on_slope(
    form: Form,
    turn: UnitQuaternion<f64>,
    height: f64,
    points: f64,
    lean: f64,
    mu: f64,
    damping: f64,
) -> World {
    let slope = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), lean);
    let sink = MASS * G * lean.cos() / (points * SERIES);
    let X = pose(slope * turn, slope * Vector3::new(0.0, height - sink, 0.0));
    let thing = object(form, X, STIFFNESS, mu).with_damping(damping).unwrap();
    let body = body(&thing, MASS);
    World::new(vec![floor(lean, STIFFNESS, mu), thing], &[(1, body)], Settings::default(), 0)
}

fn seconds(world: &mut World, seconds: f64) {
    (0..(seconds / DT).round() as u32).for_each(|_| drop(world.step(&[])));
}

#[test]
fn what_rolls_down_a_slope_does_so_with_its_share_of_inertia() {
    let lean = 0.05_f64;
    let lying = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2);
    let (ring, tube) = (0.03, 0.01);
    let of_ring = (ring * ring + 0.75 * tube * tube) / ((ring + tube) * (ring + tube));
    let rolling: [(&str, Form, f64, f64, f64); 3] = [
        ("ball", Sphere::new(0.02).unwrap().into(), 0.02, 1.0, 0.4),
        ("cylinder", Cylinder::new(0.02, 0.05).unwrap().into(), 0.02, 2.0, 0.5),
        ("ring", Torus::new(ring, tube).unwrap().into(), ring + tube, 1.0, of_ring),
    ];
    for (name, form, radius, points, inertia) in rolling {
        let mut world = on_slope(form, lying, radius, points, lean, 0.6);
        seconds(&mut world, 0.2);
        let v = world.body().velocity_W;
        seconds(&mut world, 0.3);
        let a = -(world.body().velocity_W - v).dot(&Vector3::new(lean.cos(), lean.sin(), 0.0)) / 0.3;
        let expected = G * lean.sin() / (1.0 + inertia);
        // In a tick it rolls by the sine of its angle, which at 9 rad/s is 1e-5 less and rises 4e-5 less; before, the
        // spring of the friction still swings when it was stretched for the first time.
        let off = (a / expected - 1.0).abs();
        assert!(off < 1e-4, "{name}: {a} {expected} {off}");
    }
}

#[test]
fn what_stands_on_a_slope_tips_when_its_centre_passes_the_lower_edge() {
    let none = UnitQuaternion::identity();
    // How far the lower edge is from the axis, and how high the centre of mass.
    let standing: [(&str, Form, f64, f64, f64, f64); 4] = [
        ("box", Cuboid::new([0.02, 0.06, 0.03]).unwrap().into(), 0.03, 4.0, 0.01, 0.03),
        ("cylinder", Cylinder::new(0.01, 0.06).unwrap().into(), 0.03, 4.0, 0.01, 0.03),
        ("cone", Cone::new(0.012, 0.0, 0.08).unwrap().into(), 0.04, 4.0, 0.012, 0.02),
        ("truncated cone", Cone::new(0.01, 0.02, 0.04).unwrap().into(), 0.02, 4.0, 0.01, 0.0),
    ];
    for (name, form, height, points, foot, centre) in standing {
        let world = on_slope(form, none, height, points, 0.1, 2.0);
        let centre = if centre > 0.0 { centre } else { world.body().mass.centre_B.y + height };
        let holds = |lean: f64| {
            // Critically damped: what the springs give back when the load shifts must not throw it over.
            let mut world = damped_on_slope(form, none, height, points, lean, 2.0, 2000.0);
            seconds(&mut world, 4.0);
            let up = world.body().orientation * Vector3::y();
            up.angle(&Vector3::new(-lean.sin(), lean.cos(), 0.0)) < 0.1
        };
        // The lower springs give 2e-5 m more than the upper ones before it tips: half a percent of such small angles.
        let threshold = (foot / centre).atan();
        assert!(holds(0.99 * threshold), "{name}");
        assert!(!holds(1.005 * threshold), "{name}");
    }
}

/// A box that lies still on boxes that do not move, or on others that do; `true` when it is there after some seconds.
fn stays(mut world: World, body: usize) -> bool {
    seconds(&mut world, 3.0);
    let start = world.manipulation.bodies()[body];
    seconds(&mut world, 5.0);
    let end = world.manipulation.bodies()[body];
    (end.centre_W - start.centre_W).norm() < 1e-7 && end.orientation.angle_to(&start.orientation) < 1e-6
}

fn box_of(size: [f64; 3], at: Vector3<f64>) -> haptics::Entity {
    object(Cuboid::new(size).unwrap(), pose(UnitQuaternion::identity(), at), STIFFNESS, 0.5)
        .with_damping(100.0)
        .unwrap()
}

#[test]
fn a_box_pushed_over_the_edge_of_another_tips_when_its_centre_passes_it() {
    for turn in [0.0, 0.4] {
        let over = |part: f64| {
            let table = box_of([0.2, 0.1, 0.2], Vector3::zeros());
            // So damped that what the springs give back when the load shifts does not throw it over.
            let at = Vector3::new(0.1 + part * 0.02, 0.06 - 1e-5, 0.0);
            let mut thing = box_of([0.04, 0.02, 0.03], at).with_damping(2000.0).unwrap();
            thing.X_WB.rotation = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), turn);
            let body = body(&thing, MASS);
            World::new(vec![table, thing], &[(1, body)], Settings::default(), 0)
        };
        // Before it tips, the springs at the edge give 1e-5 m, which leans it by less than 1e-3 and moves its centre by
        // 1e-5 m.
        assert!(stays(over(-0.01), 0), "{turn}");
        assert!(!stays(over(0.01), 0), "{turn}");
    }
}

#[test]
fn a_cylinder_and_a_cone_pushed_over_an_edge_tip_when_their_centre_passes_it() {
    let standing: [(Form, f64); 3] = [
        (Cylinder::new(0.02, 0.03).unwrap().into(), 0.015),
        (Cone::new(0.02, 0.01, 0.03).unwrap().into(), 0.015),
        (Torus::new(0.02, 0.008).unwrap().into(), 0.008),
    ];
    for (form, height) in standing {
        let over = |part: f64| {
            let table = box_of([0.2, 0.1, 0.2], Vector3::zeros());
            let at = Vector3::new(0.1 + part * 0.02, 0.05 + height, 0.0);
            let thing = object(form, pose(UnitQuaternion::identity(), at), STIFFNESS, 0.5);
            let thing = thing.with_damping(2000.0).unwrap();
            let body = body(&thing, MASS);
            World::new(vec![table, thing], &[(1, body)], Settings::default(), 0)
        };
        assert!(stays(over(-0.02), 0), "{form:?}");
        assert!(!stays(over(0.02), 0), "{form:?}");
    }
}

#[test]
fn a_stack_of_three_stands_and_carries_what_lies_on_it() {
    let sizes = [[0.06, 0.03, 0.05], [0.05, 0.03, 0.06], [0.03, 0.03, 0.03]];
    let mut entities = vec![floor(0.0, STIFFNESS, 0.5)];
    for (number, (size, turn)) in sizes.into_iter().zip([0.0, 0.3, 0.8]).enumerate() {
        let mut thing = box_of(size, Vector3::new(0.002 * number as f64, 0.015 + 0.03 * number as f64, 0.0));
        thing.X_WB.rotation = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), turn);
        entities.push(thing);
    }
    let bodies: Vec<_> = (1..4).map(|entity| (entity, body(&entities[entity], MASS))).collect();
    let mut world = World::new(entities, &bodies, Settings::default(), 0);
    seconds(&mut world, 2.0);
    let start: Vec<_> = world.manipulation.bodies().to_vec();
    seconds(&mut world, 10.0);
    for (number, (start, end)) in start.iter().zip(world.manipulation.bodies()).enumerate() {
        let crept = (end.centre_W - start.centre_W).norm();
        // What the solver leaves open of forces of 3 N over 1e5 N/m: 1e-15 m in each of 10,000 ticks.
        assert!(crept < 1e-9, "{number}: {crept}");
        assert!(end.orientation.angle_to(&start.orientation) < 1e-7, "{number}");
        // Each sinks into what is below by what it carries.
        let stands = 0.015 + 0.03 * number as f64;
        assert!(end.centre_W.y < stands && end.centre_W.y > stands - 1e-4, "{number}: {}", end.centre_W.y);
    }
    let on_floor: f64 =
        world.manipulation.rows().iter().filter(|row| row.other.is_none()).map(|row| row.force_W.y).sum();
    assert!((on_floor - 3.0 * MASS * G).abs() < 1e-6, "{on_floor}");
}

#[test]
fn a_bar_lies_across_the_edges_of_two_others() {
    // Their edges up: turned by 45 degrees about their length, 6 cm apart.
    let roof = |x: f64| {
        let mut roof = box_of([0.02, 0.02, 0.1], Vector3::new(x, 0.0, 0.0));
        roof.X_WB.rotation = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::FRAC_PI_4);
        roof.previous_X_WB = roof.X_WB;
        roof
    };
    let top = 0.01 * 2.0_f64.sqrt();
    for bar in [
        Form::from(Cuboid::new([0.1, 0.01, 0.01]).unwrap()),
        Capsule::new(0.005, 0.09).unwrap().into(),
        Cylinder::new(0.005, 0.1).unwrap().into(),
    ] {
        let lies = match bar {
            Form::Cuboid(_) => UnitQuaternion::identity(),
            _ => UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::FRAC_PI_2),
        };
        let at = pose(lies, Vector3::new(0.0, top + 0.005, 0.0));
        let thing = object(bar, at, STIFFNESS, 0.5).with_damping(100.0).unwrap();
        let body = body(&thing, MASS);
        let mut world =
            World::new(vec![roof(0.03), roof(-0.03), thing], &[(2, body)], Settings::default(), 0);
        seconds(&mut world, 2.0);
        assert!((world.body().centre_W.y - top - 0.005).abs() < 1e-4, "{bar:?} {:?}", world.body());
        let loads: Vec<f64> = world.manipulation.rows().iter().map(|row| row.force_W.y).collect();
        assert!((loads.iter().sum::<f64>() - MASS * G).abs() < 1e-6, "{bar:?} {loads:?}");
        assert!(world.body().velocity_W.norm() < 1e-9, "{bar:?} {:?}", world.body());
    }
}

#[test]
fn a_ring_hangs_on_a_peg_and_a_ball_lies_in_a_ring() {
    let still = |thing: Form,
                 X: nalgebra::Isometry3<f64>,
                 fixed: Form,
                 X_fixed: nalgebra::Isometry3<f64>,
                 height: f64| {
        let below = object(fixed, X_fixed, STIFFNESS, 0.5);
        let thing = object(thing, X, STIFFNESS, 0.5).with_damping(100.0).unwrap();
        let body = body(&thing, MASS);
        let mut world = World::new(vec![below, thing], &[(1, body)], Settings::default(), 0);
        seconds(&mut world, 3.0);
        let body = world.body();
        assert!(
            (body.centre_W.y - height).abs() < 1e-4,
            "{thing:?} {body:?}",
            thing = world.entities[1].shape
        );
        assert!(body.velocity_W.norm() < 1e-6, "{body:?}");
        let load: f64 = world.manipulation.rows().iter().map(|row| row.force_W.y).sum();
        assert!((load - MASS * G).abs() < 1e-5, "{load}");
    };
    let across = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2);
    let none = UnitQuaternion::identity();
    let (ring, peg): (Form, Form) =
        (Torus::new(0.03, 0.01).unwrap().into(), Capsule::new(0.008, 0.1).unwrap().into());
    let rod: Form = Cylinder::new(0.008, 0.1).unwrap().into();
    for peg in [peg, rod] {
        // The hole's top on the peg's top.
        let hangs = 0.008 - 0.02;
        still(ring, pose(across, Vector3::y() * hangs), peg, pose(across, Vector3::zeros()), hangs);
    }
    let ball: Form = Sphere::new(0.03).unwrap().into();
    let lies = (0.04_f64 * 0.04 - 0.03 * 0.03).sqrt();
    still(ball, pose(none, Vector3::new(0.0, lies, 0.0)), ring, pose(none, Vector3::zeros()), lies);
    // A ring about a ball, and on another ring.
    still(ring, pose(none, Vector3::new(0.0, lies, 0.0)), ball, pose(none, Vector3::zeros()), lies);
    still(ring, pose(none, Vector3::new(0.0, 0.02, 0.0)), ring, pose(none, Vector3::zeros()), 0.02);
}
