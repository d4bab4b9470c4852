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
        if let Kind::Cut { finger, entity } = event.kind {
            cuts.push((event.run_tick, finger, entity));
        }
    }
    assert_eq!(cuts, [(26, 1, 1)]);
}
