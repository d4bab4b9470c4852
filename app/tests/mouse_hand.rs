//! Somebody with a mouse picks up the cube of the built-in table: pointer, hand, file of wishes, driver with simulated arms,
//! fast step and back. Only the window, the second process and the waiting are left out.

use eframe::egui::{Pos2, Rect, Vec2, pos2, vec2};
use nalgebra::Vector3;
use phantom3::fast_loop::{FastLoop, Turn, WhenFull};
use phantom3::live::{LiveHandFile, LiveReins};
use phantom3::play;
use phantom3::rig::Rig;
use phantom3::row_queue::{RowReceiver, row_queue};
use phantom3::virtual_clock::VirtualDriver;
use shm_abi::Frame;
use shm_abi::segment::ClockMode;
use view::hand::{Cue, MouseHand, Seen};
use view::pick::Picker;
use view::{FingerMoment, Moment, Reins, Stage};
use world::{SceneCamera, Settings};

const PERIOD_NS: u64 = 1_000_000;
/// Between two pictures of a window, in ticks.
const PICTURE: u64 = 16;
const EDGE_M: f64 = 0.04;

/// Everything but the window.
struct Table {
    driver: VirtualDriver,
    fast: FastLoop,
    rows: RowReceiver,
    reins: LiveReins,
    hand: MouseHand,
    camera: SceneCamera,
    tick: u64,
    frame: Frame,
    /// What any device had to cut, and the warmest motor.
    limits: u64,
    heat: f64,
    /// Of each finger, the force on the user of the last tick (N).
    forces_n: Vec<f64>,
    /// What the window was told last.
    told: Moment,
}

impl Table {
    fn new() -> Self {
        let rig = play::rig(None, &Settings::default(), PERIOD_NS).expect("the built-in scene");
        let live = LiveHandFile::make().expect("a file");
        let mut config = rig.driver_config(ClockMode::Virtual);
        live.lead(&mut config);
        let driver = VirtualDriver::open(&config).expect("simulated arms");
        let reins = live.into_reins(&rig).expect("a reach");
        let step = rig.fast_step().expect("a step");
        let camera = Stage::new(&rig.scene, step.entities()).cameras[0].clone();
        let (sender, rows) = row_queue(step.bodies().len());
        let fast = FastLoop::new(step, sender, WhenFull::Wait, u64::MAX, PERIOD_NS);
        let hand = reins.hand();
        let (limits, heat) = (0, 0.0);
        let forces_n = vec![0.0; rig.scene.fingers.len()];
        assert_eq!(entity(&rig, "cube"), CUBE);
        let mut table = Self {
            driver,
            fast,
            rows,
            reins,
            hand,
            camera,
            tick: 0,
            frame: bytemuck::Zeroable::zeroed(),
            limits,
            heat,
            forces_n,
            told: Moment::default(),
        };
        table.wait(0.5);
        table
    }

    /// A picture's time goes by, in which the pointer was dragged by so much (points).
    fn picture(&mut self, by: Vec2) {
        let seen = Seen::new(&self.camera, window());
        self.hand.face(&seen);
        self.hand.feel(&self.told);
        self.hand.drag(by, &seen);
        self.reins.pull(self.hand.pass(PICTURE as f64 * 1e-3));
        for _ in 0..PICTURE {
            self.tick += 1;
            let turn = self.driver.tick(self.tick, &mut self.fast);
            assert!(!matches!(turn, Turn::Fault(_)), "a fault after {} ms", self.tick);
            self.driver.view().read_frame(self.tick, &mut self.frame).expect("our own frame");
            for device in self.frame.present_devices() {
                self.limits |= device.limits;
                self.heat = self.heat.max(device.motor_heat);
            }
            while let Some((row, _)) = self.rows.receive() {
                let fingers = self.forces_n.iter_mut().zip(&row.fingers);
                fingers.for_each(|(n, finger)| *n = finger.force_on_user.norm());
                let felt = row.fingers[..self.forces_n.len()].iter().map(|finger| FingerMoment {
                    force: finger.force_on_user,
                    entity: finger.entity.map(|entity| entity as usize),
                    ..FingerMoment::default()
                });
                self.told.fingers = felt.collect();
            }
        }
    }

    fn wait(&mut self, seconds: f64) {
        (0..pictures(seconds)).for_each(|_| self.picture(Vec2::ZERO));
    }

    /// The pointer goes evenly from one place in the window to another, left button down.
    fn drag(&mut self, from: Pos2, to: Pos2, seconds: f64) {
        let steps = pictures(seconds);
        (0..steps).for_each(|_| self.picture((to - from) / steps as f32));
    }

    fn at(&self, place: &Vector3<f64>) -> Pos2 {
        Seen::new(&self.camera, window()).project(place).expect("before the camera")
    }

    /// Of its middle over the table (m).
    fn height_m(&mut self) -> f64 {
        self.cube().y
    }

    fn cube(&mut self) -> Vector3<f64> {
        self.fast.step_mut().entities()[CUBE].X_WB.translation.vector
    }
}

fn window() -> Rect {
    Rect::from_min_size(pos2(0.0, 0.0), vec2(1280.0, 800.0))
}

fn pictures(seconds: f64) -> u64 {
    (seconds * 1e3 / PICTURE as f64).round() as u64
}

const CUBE: usize = 1;

fn entity(rig: &Rig, name: &str) -> usize {
    rig.scene.entities.iter().position(|entity| entity.name == name).expect("it is in the scene")
}

/// Lifts the cube by 6 cm, if fingers close on it, and asks what is true after that of its height.
fn lift(fingers: usize, turned_rad: f64, closes: bool) -> Table {
    let mut table = Table::new();
    table.hand.grip.set_fingers(fingers);
    table.hand.grip.turn(turned_rad);
    table.wait(0.5);
    let (hand, cube) = (table.hand.place(), table.cube());
    // It begins over the cube, as seen: dragging it down brings it there.
    let (from, to) = (table.at(&hand), table.at(&cube));
    assert!((from.x - to.x).abs() < 5.0, "{from:?} {to:?}");
    table.drag(from, to, 1.2);
    // What is over the cube in the picture's plane is so in the world, to some millimetres.
    assert!((table.hand.place() - cube).norm() < 5e-3, "{} {cube}", table.hand.place());
    if closes {
        table.hand.grip.close();
    }
    table.wait(1.2);
    let up = table.at(&(table.hand.place() + Vector3::y() * 0.066));
    table.drag(to, up, 1.0);
    table.wait(1.0);
    table
}

#[test]
fn a_mouse_lifts_the_cube_by_5_cm_and_holds_it() {
    for (fingers, turned_rad) in [(3, 0.0), (2, 0.0), (3, 0.6), (2, -0.3)] {
        let mut table = lift(fingers, turned_rad, true);
        let case = format!("{fingers} fingers, turned by {turned_rad}");
        for _ in 0..pictures(1.0) {
            table.picture(Vec2::ZERO);
            let height_m = table.height_m();
            assert!(height_m > 0.5 * EDGE_M + 0.05, "{case}: {height_m}");
            for n in &table.forces_n[..fingers] {
                assert!((0.3..1.8).contains(n), "{case}: {:?} N", table.forces_n);
            }
        }
        println!("{case}: {:.4} m, {:?} N, heat {:.2}", table.height_m(), table.forces_n, table.heat);
        assert_eq!(table.limits, 0, "{case}: a device had to cut something");
        // A driver that starts takes the housings for as warm as they may be: 0.82. From 0.9 on less is let through.
        assert!(table.heat < 0.88, "{case}: {}", table.heat);
        table.hand.grip.open();
        table.wait(1.0);
        let height_m = table.height_m();
        // Its weight presses it into the table by less than a millimetre.
        assert!((height_m - 0.5 * EDGE_M).abs() < 1e-3, "{case}: let go it is at {height_m}");
    }
}

#[test]
fn a_hand_that_stays_open_leaves_the_cube_where_it_is() {
    let mut table = lift(3, 0.0, false);
    assert!((table.height_m() - 0.5 * EDGE_M).abs() < 1e-3, "{}", table.height_m());
}

#[test]
fn a_hand_that_is_told_to_jump_goes_there_like_a_hand_and_nothing_has_to_be_cut() {
    let mut table = Table::new();
    let far = table.hand.place() + Vector3::new(0.1, 0.05, 0.05);
    table.hand.go(far - table.hand.place());
    let mut fastest = 0.0f64;
    for _ in 0..pictures(1.0) {
        table.picture(Vec2::ZERO);
        for device in table.frame.present_devices() {
            fastest = fastest.max(Vector3::from(device.velocity_m_per_s_estimated).norm());
        }
    }
    // A hand's top speed is 1 m/s; what swings behind it may be half as fast again. A Premium's limit is 2 m/s.
    assert!((0.2..1.5).contains(&fastest), "{fastest}");
    assert_eq!(table.limits, 0);
}

/// What a newcomer is shown of depth.
#[test]
fn what_is_below_the_hand_is_the_cube_at_first() {
    let mut table = Table::new();
    let rig = play::rig(None, &Settings::default(), PERIOD_NS).expect("the built-in scene");
    let picker = Picker::new(&Stage::new(&rig.scene, table.fast.step_mut().entities()));
    let poses = table.fast.step_mut().entities().iter().map(|entity| entity.X_WB).collect();
    let moment = Moment { poses, ..Moment::default() };
    let over = table.cube() + Vector3::new(0.005, 0.1, -0.005);
    let below = |is_held: fn(usize) -> bool| Cue::below(&picker, &moment, &[over], is_held).map(|cue| cue.to);
    let met = below(|_| false).expect("the cube");
    assert!((met - (table.cube() + Vector3::new(0.005, 0.5 * EDGE_M, -0.005))).norm() < 1e-6, "{met}");
    let met = below(|entity| entity == CUBE).expect("the table");
    assert!((met - Vector3::new(over.x, 0.0, over.z)).norm() < 1e-6, "what is held is left out: {met}");
}
