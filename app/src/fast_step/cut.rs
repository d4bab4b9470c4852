//! Forces that finger and entity have not moved for, in the fast step: commanded cut, and told.

use super::*;
use bytemuck::Zeroable;
use haptics::{
    Algorithm, ContactAlgorithm, ContactMemory, Finger, Friction, Plane, SurfacePoint, Touch, TouchInput,
};
use nalgebra::Isometry3;
use world::events::{Kind, event_queue};

const PERIOD_NS: u64 = 1_000_000;
const K: f64 = 1000.0;
const DEPTH_M: f64 = 1e-3;

/// The frictionless god-object, but that right of x = 0 it is 0.2 m above the surface.
#[derive(Debug)]
struct Leaping;

impl ContactAlgorithm for Leaping {
    fn touch(&self, input: &TouchInput<'_>, _memory: &mut ContactMemory) -> Option<Touch> {
        let at = input.is_inside().then(|| input.nearest())??;
        let above_m = if input.cone.hip_B.x > 0.0 { 0.2 } else { 0.0 };
        let god_object = SurfacePoint { point_B: at.point_B + at.normal_B * above_m, ..at };
        Some(Touch::frictionless(god_object, above_m - input.cone.hip_B.y, &input.cone))
    }
}

#[test]
fn a_blow_is_not_commanded_and_told_with_finger_and_entity() {
    let floor = || Entity::new(Plane::new(Vector3::y(), 0.0).unwrap(), Isometry3::identity(), K).unwrap();
    let leaping = floor().with_friction(Friction::None).unwrap().with_algorithm(Algorithm::own(Leaping));
    let finger = |device| DeviceFinger {
        finger: Finger::new(0.0, 2).unwrap(),
        device,
        mount: Mount::new(Isometry3::identity()),
    };
    // Far below, so that it is never felt.
    let below = Entity { X_WB: Isometry3::translation(0.0, -1.0, 0.0), ..floor() };
    let mut step = FastStep::new(vec![finger(0), finger(1)], vec![below, leaping], PERIOD_NS);
    let mut teller = EventTeller::new(&mut step);
    let (mut send, mut told) = event_queue(64);
    let mut row = Row::empty();
    for tick in 1..40_u64 {
        let mut frame = Frame::zeroed();
        (frame.tick, frame.run_tick, frame.device_count) = (tick, i64::try_from(tick).unwrap(), 2);
        for device in &mut frame.devices[..2] {
            device.flags = DEVICE_POSITION_VALID;
        }
        // The second finger goes down, and to the right.
        let t = tick as f64;
        let x = if tick > 20 { -5e-4 + 1e-4 * (t - 20.0) } else { -5e-4 };
        frame.devices[0].position_m_measured[1] = 0.1;
        frame.devices[1].position_m_measured = [x, (1e-3 - 1e-4 * t).max(-DEPTH_M), 0.0];
        let mut command = Command::zero(tick, 1, 2);
        step.step(&frame, &mut command, &mut row);
        teller.tell(&step, &row, &mut send);
        // What it was, and a tenth of a millimetre for each tick on the right; 200 N otherwise.
        let moved_m = 1e-4 * (t - 25.0).max(0.0);
        let most_n = K * (DEPTH_M + moved_m) + 1e-9;
        assert!(command.devices[1].force_on_user_n[1] <= most_n, "tick {tick}: {command:?}");
        assert_eq!(command.devices[0].force_on_user_n, [0.0; 3]);
    }
    let mut cuts = Vec::new();
    while let Some(event) = told.receive(u64::MAX) {
        if let Kind::Cut { finger, entity, force_n } = event.kind {
            // The spring of 0.2 m.
            assert!((force_n - K * 0.2).abs() < 1.0, "{force_n} N");
            cuts.push((event.run_tick, finger, entity));
        }
    }
    assert_eq!(cuts, [(26, 1, Some(1))]);
}

/// What a finger is commanded (N) and what is told, tick by tick on its way.
struct Felt {
    forces: Vec<Vector3<f64>>,
    told: Vec<(u64, Cut)>,
}

impl Felt {
    fn on(step: &mut FastStep, way: impl IntoIterator<Item = Vector3<f64>>) -> Self {
        let (mut felt, mut row) = (Self { forces: Vec::new(), told: Vec::new() }, Row::empty());
        for (tick, hip) in (1..).zip(way) {
            let mut frame = Frame::zeroed();
            (frame.tick, frame.run_tick, frame.device_count) = (tick, i64::try_from(tick).unwrap(), 1);
            frame.devices[0].flags = DEVICE_POSITION_VALID;
            frame.devices[0].position_m_measured = hip.into();
            let mut command = Command::zero(tick, 1, 1);
            step.step(&frame, &mut command, &mut row);
            felt.told.extend(step.cuts().map(|cut| (tick, cut)));
            felt.forces.push(command.devices[0].force_on_user_n.into());
        }
        felt
    }

    /// The largest change of the force that is no fall (N).
    fn most_blow_n(&self) -> f64 {
        let pairs = self.forces.windows(2);
        let blows = pairs.map(|pair| (pair[1] - pair[0] * 0.5).norm() - 0.5 * pair[0].norm());
        blows.fold(0.0, f64::max)
    }
}

fn one_finger(entities: Vec<Entity>) -> FastStep {
    let finger = DeviceFinger {
        finger: Finger::new(0.0, 2).unwrap().with_ramp_in(0.0).unwrap(),
        device: 0,
        mount: Mount::new(Isometry3::identity()),
    };
    FastStep::new(vec![finger], entities, PERIOD_NS)
}

/// What becomes of the frictionless god-object's force in one tick, counted since the contact began.
#[derive(Debug)]
struct Spoilt {
    in_tick: f64,
    how: fn(Vector3<f64>) -> Vector3<f64>,
    for_good: bool,
}

impl ContactAlgorithm for Spoilt {
    fn touch(&self, input: &TouchInput<'_>, memory: &mut ContactMemory) -> Option<Touch> {
        let at = input.is_inside().then(|| input.nearest())??;
        let mut touch = Touch::frictionless(at, (at.point_B - input.cone.hip_B).norm(), &input.cone);
        memory.words[0] += 1.0;
        let is_now = memory.words[0] == self.in_tick;
        if is_now || self.for_good && memory.words[0] > self.in_tick {
            touch.force_on_user_B = (self.how)(touch.force_on_user_B);
        }
        Some(touch)
    }
}

fn spoilt_floor(spoilt: Spoilt) -> Entity {
    let floor = Entity::new(Plane::new(Vector3::y(), 0.0).unwrap(), Isometry3::identity(), K).unwrap();
    floor.with_algorithm(Algorithm::own(spoilt))
}

/// Down by a tenth of a millimetre a tick, to this depth (m), where it stays.
fn pressing(depth_m: f64) -> impl Iterator<Item = Vector3<f64>> {
    let down = move |tick: i32| (1e-4 - 1e-4 * f64::from(tick)).max(-depth_m);
    (0..400).map(move |tick| Vector3::new(0.0, down(tick), 0.0))
}

#[test]
fn a_force_that_drops_out_for_a_tick_comes_back_slowly_and_is_told_once() {
    let floor = spoilt_floor(Spoilt { in_tick: 250.0, how: |_| Vector3::zeros(), for_good: false });
    let felt = Felt::on(&mut one_finger(vec![floor]), pressing(0.019));
    let [(tick, cut)] = felt.told[..] else { panic!("{:?}", felt.told) };
    assert_eq!((tick, cut.finger, cut.entity), (252, 0, Some(0)));
    assert!((cut.force_n - 19.0).abs() < 0.1, "{cut:?}");
    assert_eq!(felt.forces[250], Vector3::zeros(), "a fall is free");
    // 19 N in 20 ms are 0.95 N in a tick, and a hundredth of what there is.
    assert!(felt.most_blow_n() < 1.2, "{} N", felt.most_blow_n());
    assert_eq!(felt.forces[275], Vector3::new(0.0, K * 0.019, 0.0));
}

#[test]
fn a_force_that_turns_over_is_cut_and_comes_on_slowly() {
    let floor = spoilt_floor(Spoilt { in_tick: 250.0, how: |force| -force, for_good: true });
    let felt = Felt::on(&mut one_finger(vec![floor]), pressing(0.005));
    let [(251, Cut { finger: 0, entity: Some(0), force_n })] = felt.told[..] else {
        panic!("{:?}", felt.told)
    };
    // Half a newton beyond zero comes at once, and some hundredths.
    assert!((force_n - 4.45).abs() < 0.05, "{force_n} N");
    assert!(felt.most_blow_n() < 0.6, "{} N", felt.most_blow_n());
    assert_eq!(felt.forces[300], Vector3::new(0.0, -K * 0.005, 0.0), "in the end it is what it is");
}

#[test]
fn a_magnet_that_changes_sides_is_cut_and_told_of_no_contact() {
    let limits = haptics::Limits::at(1e-3).unwrap();
    let ring = Entity::new(haptics::Torus::new(0.03, 0.01).unwrap(), Isometry3::identity(), K).unwrap();
    let ring = ring.with_magnetism(haptics::Magnetism::new(5.0, 0.04, &limits).unwrap());
    // Through the hole's middle, where all of the ring is equally near.
    let mut step = one_finger(vec![ring]).with_effects(Vec::new(), Vec::new());
    let across = (0..200).map(|tick| Vector3::new(-0.01 + 1e-4 * (f64::from(tick) + 0.5), 0.0, 0.0));
    let felt = Felt::on(&mut step, across);
    let [(101, Cut { finger: 0, entity: None, force_n })] = felt.told[..] else { panic!("{:?}", felt.told) };
    // 4.2 N on either side; one of them is let go, and of the other half a newton comes at once, and what the way explains.
    assert!((force_n - 3.5).abs() < 0.1, "{force_n} N");
    assert!(felt.most_blow_n() < 0.8, "{} N", felt.most_blow_n());
}

#[test]
fn what_is_cut_from_a_finger_its_body_does_not_get_either() {
    const MASS_KG: f64 = 0.2;
    let pose = Isometry3::identity();
    let ball = Entity::new(haptics::Sphere::new(0.02).unwrap(), pose, K).unwrap();
    let spoilt = Spoilt { in_tick: 20.0, how: |_| Vector3::zeros(), for_good: false };
    let ball = ball.with_algorithm(Algorithm::own(spoilt));
    let mass = physics::MassProperties::of_shape(&ball.shape, MASS_KG).unwrap();
    let body = Body::at_rest(mass, &pose).with_rotation_locked();
    let settings = physics::Settings { gravity_W: Vector3::zeros(), ..physics::Settings::default() };
    let mut step = one_finger(vec![ball])
        .with_objects(&[(0, body)], settings, ListSettings::default(), &[HandFinger::default()], false)
        .unwrap();
    // In by 0.3 mm a tick, and after a while gone.
    let way = (0..200).map(|tick: i32| {
        let y = if tick < 100 { 0.0203 - 3e-4 * f64::from(tick.min(30)) } else { 0.5 };
        Vector3::new(0.0, y, 0.0)
    });
    let felt = Felt::on(&mut step, way);
    let [(_, Cut { entity: Some(0), force_n, .. })] = felt.told[..] else { panic!("{:?}", felt.told) };
    assert!(force_n > 1.0, "{force_n} N");
    let felt_n_s = felt.forces.iter().sum::<Vector3<f64>>() * 1e-3;
    let got_n_s = step.bodies()[0].velocity * MASS_KG;
    assert!(got_n_s.norm() > 1e-3, "it was pushed");
    // Roundings of 0.1 N s in 200 sums.
    assert!((got_n_s + felt_n_s).norm() < 1e-13, "{got_n_s} {felt_n_s}");
}
