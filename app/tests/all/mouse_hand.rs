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
use rt_core::signals::StopSignals;
use shm_abi::Frame;
use shm_abi::segment::ClockMode;
use std::f64::consts::PI;
use std::path::Path;
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
    /// The largest that was in any tick (N), the first thing that any finger touched, and ticks of the run.
    most_n: f64,
    touched: Option<u32>,
    ticks: u64,
    /// What the window was told last.
    told: Moment,
}

impl Table {
    fn new() -> Self {
        let rig = play::rig(None, &Settings::default(), PERIOD_NS, &StopSignals::default())
            .expect("the built-in scene");
        assert_eq!(entity(&rig, "cube"), CUBE);
        let mut table = Self::of(&rig);
        table.wait(0.5);
        table
    }

    fn of(rig: &Rig) -> Self {
        let live = LiveHandFile::make().expect("a file");
        let mut config = rig.driver_config(ClockMode::Virtual);
        live.lead(&mut config);
        let driver = VirtualDriver::open(&config).expect("simulated arms");
        let reins = live.into_reins(rig).expect("a reach");
        let step = rig.fast_step().expect("a step");
        let camera = Stage::new(&rig.scene, step.entities()).cameras[0].clone();
        let (sender, rows) = row_queue(step.bodies().len());
        let fast = FastLoop::new(step, sender, WhenFull::Wait, u64::MAX, PERIOD_NS);
        let hand = reins.hand();
        let (limits, heat) = (0, 0.0);
        let forces_n = vec![0.0; rig.scene.fingers.len()];
        Self {
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
            most_n: 0.0,
            touched: None,
            ticks: 0,
            told: Moment::default(),
        }
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
                self.most_n = self.forces_n.iter().fold(self.most_n, |most, n| most.max(*n));
                let touches = row.fingers[..self.forces_n.len()].iter().find_map(|finger| finger.entity);
                self.touched = self.touched.or(touches);
                self.ticks = row.run_tick + 1;
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
    let rig = play::rig(None, &Settings::default(), PERIOD_NS, &StopSignals::default())
        .expect("the built-in scene");
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

/// Plays a scene for 300 ms without anybody doing anything; where the fingers began (m).
fn untouched(file: &Path) -> Vec<Vector3<f64>> {
    let rig =
        play::rig(Some(file), &Settings::default(), PERIOD_NS, &StopSignals::default()).expect("a scene");
    let mut table = Table::of(&rig);
    while table.ticks < 300 {
        table.picture(Vec2::ZERO);
        assert!(table.tick < 10_000, "{}: the run does not begin", file.display());
    }
    assert_eq!(table.touched, None, "{}: a finger touches something", file.display());
    let scene = &rig.scene;
    let pulls = scene.entities.iter().any(|entity| entity.magnetism.is_some());
    // A wind pulls wherever a finger begins.
    if scene.fields.is_empty() && scene.guides.is_empty() && !pulls {
        assert_eq!(table.most_n, 0.0, "{}: {} N", file.display(), table.most_n);
    }
    rig.scene.fingers.iter().map(|finger| finger.start_m.coords).collect()
}

const CONFIG: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../config");

#[test]
fn in_no_scene_that_comes_with_it_a_hand_begins_in_something_or_feels_anything() {
    let mut scenes = 0;
    for directory in ["scenes", "scenes/kinds", "scenes/thesis"] {
        for entry in std::fs::read_dir(format!("{CONFIG}/{directory}")).expect("scenes").flatten() {
            let path = entry.path();
            if path.extension().is_some_and(|ending| ending == "toml") {
                untouched(&path);
                scenes += 1;
            }
        }
    }
    assert!(scenes >= 13, "{scenes}");
}

/// Where two fingers begin that are to begin there (m), in a scene of these things.
fn begun(things: &str, starts: [[f64; 3]; 2]) -> Vec<Vector3<f64>> {
    let place = tempfile::tempdir().expect("a directory");
    let finger = |start: [f64; 3]| format!("[[finger]]\nradius_m = 0.005\nstart_m = {start:?}\n");
    let file = place.path().join("scene.toml");
    std::fs::write(&file, format!("{}{}{things}", finger(starts[0]), finger(starts[1]))).expect("a file");
    untouched(&file)
}

/// Half of it is the ball of the fingers here; the other half is what a finger that is put elsewhere keeps from all things,
/// along the axes (m).
const AWAY_M: f64 = 0.01;

#[test]
fn a_finger_that_would_begin_in_a_thing_begins_at_the_nearest_place_outside_of_all() {
    let free = [0.0, 0.3, 0.0];
    let mesh =
        |file| format!("[[entity]]\nshape = {{ kind = \"mesh\", file = \"{CONFIG}/meshes/{file}\" }}\n");
    let bored = "[[entity]]\nshape = { kind = \"csg\", op = \"difference\", children = \
        [{ shape = { kind = \"box\", size_m = [0.1, 0.1, 0.1] } }, { shape = { kind = \"cylinder\", radius_m = 0.02, length_m = 1.0 } }] }\n";
    let walls = [-0.0251, 0.0251].map(|x| {
        format!("[[entity]]\nshape = {{ kind = \"box\", size_m = [0.04, 0.1, 0.1] }}\nposition_m = [{x}, 0.0, 0.0]\n")
    });
    let in_star = [0.012, 0.004, 0.0];
    let cases = [
        // Up through the nearest face.
        (
            "[[entity]]\nshape = { kind = \"box\", size_m = [0.1, 0.1, 0.1] }\n",
            [0.01, 0.03, 0.0],
            0.02 + AWAY_M,
        ),
        (&mesh("cube.obj"), [0.0, 0.01, 0.0], 0.01 + AWAY_M),
        (&mesh("star.stl"), in_star, slow_way_m("star.stl", &in_star.into())),
        // Into the bore, of which 5 mm around its axis are wide enough.
        (bored, [0.03, 0.0, 0.0], 0.01 + AWAY_M),
        (
            "[[entity]]\nshape = { kind = \"plane\", normal = [0.0, 1.0, 0.0], offset_m = 0.0 }\n",
            [0.0, -0.04, 0.0],
            0.04 + AWAY_M,
        ),
        // A slot of 10.2 mm: the ball fits, and has nothing beside it. Out at an end, 5 mm beyond the rims: those places
        // count that lie 5 mm to either side.
        (&walls.concat(), [0.0, 0.0, 0.01], 0.04 + 0.5 * AWAY_M),
        // Between the axes, where the places 5 mm beside along both are 25 mm from the tube's middle: (20 + 5, 20) - (5, 0) mm.
        (
            "[[entity]]\nshape = { kind = \"torus\", ring_radius_m = 0.05, tube_radius_m = 0.02 }\n",
            [0.05, 0.0, 0.0],
            0.02 * 2f64.sqrt(),
        ),
    ];
    for (things, wanted, exact_m) in cases {
        let starts = begun(things, [wanted, free]);
        let way_m = (starts[0] - Vector3::from(wanted)).norm();
        assert!((way_m - exact_m).abs() < 1e-3, "{things}: {way_m} m, not {exact_m} m");
        assert_eq!(starts[1], Vector3::from(free), "what is free stays as the scene says");
    }
}

#[test]
fn a_finger_that_would_begin_within_a_millimetre_of_a_thing_begins_farther_away() {
    let plane = |offset_m: f64| {
        format!(
            "[[entity]]\nshape = {{ kind = \"plane\", normal = [0.0, 1.0, 0.0], offset_m = {offset_m} }}\n"
        )
    };
    let cube = format!("[[entity]]\nshape = {{ kind = \"mesh\", file = \"{CONFIG}/meshes/cube.obj\" }}\n");
    // Of a ball of 5 mm the lowest point is 0.5 mm above the thing, and then 1.5 mm.
    for (things, top_m) in [(plane(-0.1), -0.1), (cube, 0.02)] {
        let [near, far] = [0.5e-3, 1.5e-3].map(|gap_m| [0.0, top_m + 0.5 * AWAY_M + gap_m, 0.0]);
        let free = [0.0, 0.3, 0.0];
        assert_eq!(begun(&things, [far, free])[0], Vector3::from(far), "{things}: it is free");
        let begun = begun(&things, [near, free])[0];
        let exact = Vector3::new(0.0, top_m + AWAY_M, 0.0);
        assert!((begun - exact).norm() < 1e-3, "{things}: {begun}, not {exact}");
    }
}

/// How far the nearest free place is from one in a mesh (m): of all on a grid the nearest that is outside, and from whose
/// neighbours along the axes a ball touches none of the triangles. The grid's next place is 0.9 mm away at most.
fn slow_way_m(file: &str, wanted: &Vector3<f64>) -> f64 {
    const GRID_M: f64 = 0.5e-3;
    let soup = world::model::load(&Path::new(CONFIG).join("meshes").join(file)).expect("a mesh");
    let triangles: Vec<[Vector3<f64>; 3]> =
        soup.faces.iter().map(|face| face.map(|corner| soup.vertices[corner as usize])).collect();
    let is_clear = |place: &Vector3<f64>| {
        let is_far = |triangle: &[Vector3<f64>; 3]| distance_m(place, triangle) >= 0.5 * AWAY_M;
        triangles.iter().all(is_far)
            && triangles.iter().map(|it| solid_angle(place, it)).sum::<f64>().abs() < PI
    };
    let is_free = |place: &Vector3<f64>| {
        let beside = (0..3).flat_map(|axis| [-1.0, 1.0].map(|side| Vector3::ith(axis, side * 0.5 * AWAY_M)));
        std::iter::once(Vector3::zeros()).chain(beside).all(|by| is_clear(&(place + by)))
    };
    let counts = || (-40..=40).map(|count| f64::from(count) * GRID_M);
    let grid =
        counts().flat_map(|x| counts().flat_map(move |y| counts().map(move |z| Vector3::new(x, y, z))));
    let mut ways: Vec<Vector3<f64>> = grid.collect();
    ways.sort_by(|a, b| a.norm().total_cmp(&b.norm()));
    ways.iter().find(|way| is_free(&(wanted + *way))).expect("a free place within 2 cm").norm()
}

/// From a triangle (m): from its plane where the foot is in it, else from the nearest of its edges.
fn distance_m(place: &Vector3<f64>, corners: &[Vector3<f64>; 3]) -> f64 {
    let edges = [0, 1, 2].map(|at| (corners[at], corners[(at + 1) % 3] - corners[at]));
    let normal = edges[0].1.cross(&edges[1].1).normalize();
    if edges.iter().all(|(from, along)| along.cross(&(place - from)).dot(&normal) >= 0.0) {
        return (place - corners[0]).dot(&normal).abs();
    }
    let to_edge = |(from, along): &(Vector3<f64>, Vector3<f64>)| {
        let share = ((place - from).dot(along) / along.norm_squared()).clamp(0.0, 1.0);
        (place - (from + along * share)).norm()
    };
    edges.iter().map(to_edge).fold(f64::INFINITY, f64::min)
}

/// As which a triangle is seen (van Oosterom and Strackee); of a closed mesh 4 pi all together from within, 0 from without.
fn solid_angle(place: &Vector3<f64>, corners: &[Vector3<f64>; 3]) -> f64 {
    let [a, b, c] = corners.map(|corner| (corner - place).normalize());
    2.0 * a.dot(&b.cross(&c)).atan2(1.0 + a.dot(&b) + b.dot(&c) + c.dot(&a))
}

#[test]
fn a_hand_of_which_a_scene_says_nothing_begins_over_its_things() {
    let place = tempfile::tempdir().expect("a directory");
    let file = place.path().join("scene.toml");
    let scene = "[[finger]]\n[[finger]]\n[[finger]]\n\
        [[entity]]\nshape = { kind = \"plane\", normal = [0.0, 1.0, 0.0], offset_m = 0.4 }\n\
        [[entity]]\nshape = { kind = \"box\", size_m = [0.2, 0.1, 0.2] }\nposition_m = [1.0, 0.45, -0.5]\n";
    std::fs::write(&file, scene).expect("a file");
    let starts = untouched(&file);
    for start in &starts {
        assert!((start - Vector3::new(1.0, 0.56, -0.5)).norm() < 0.06, "{starts:?}");
    }
    assert!((starts[0] - starts[1]).norm() > 0.05, "as an open hand stands: {starts:?}");
}
