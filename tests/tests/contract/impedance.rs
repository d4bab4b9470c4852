//! `--hand-mode impedance`: a hand pulls simulated devices, whose weight, friction, counters and motors can be felt
//! in the recording.

use nalgebra::Vector3;
use system_tests::recording::{Sample, Table};
use system_tests::workplace::{Said, Workplace, hand};

/// Friction at the tip of a Premium (N), along each axis.
const FRICTION_N: f64 = 0.04;
/// Stiffness of the usual pen grip from the wish to the tip (N/m): grasp and arm in series, upwards.
const HAND_N_PER_M: f64 = 552.4 * 105.3 / (552.4 + 105.3);
/// A step of the converter (5.5 A / 2048 * 23.4 mN m/A) over the levers of an arm at home, half of it on each joint (N).
const HALF_CODE_N: [f64; 3] = [
    0.5 * 5.5 / 2048.0 * 0.0234 * 13.4615 / 0.215,
    0.5 * 5.5 / 2048.0 * 0.0234 * 11.3 / 0.215,
    0.5 * 5.5 / 2048.0 * 0.0234 * 11.3 / 0.170,
];
const WALL_N_PER_M: f64 = 1000.0;

/// A run begins when its authority is full. Until then the hand carries the arm's weight: up to 0.1 N upwards, where its
/// motors are heavier than it is, over the hand's stiffness.
const SUNK_M: f64 = 0.1 / HAND_N_PER_M;

/// A table at the height of 0.1 m, in the middle of the workspace.
const TABLE: &str = "[[finger]]\nstart_m = [0.0, 0.1, 0.0]\n[[entity]]\nname = \"table\"\n\
    shape = { kind = \"plane\", normal = [0.0, 1.0, 0.0], offset_m = 0.1 }\nstiffness_n_per_m = 1000.0\n\
    friction = { model = \"coulomb\", mu = 0.5 }\n";

/// From above the table to 10 mm below its surface, where the wish rests for three seconds.
fn pressing() -> String {
    hand([(0.0, [0.0, 0.11, 0.0]), (0.5, [0.0, 0.11, 0.0]), (1.5, [0.0, 0.09, 0.0]), (4.5, [0.0, 0.09, 0.0])])
}

/// Plays on this clock; everything must be in order.
fn record(place: &Workplace, clock: &str, name: &str, more: &[&str]) -> Said {
    let usual = ["run", "scene.toml", "--headless", "--hand-mode", "impedance", "--clock", clock];
    let said = place.run(usual.iter().chain(&["--record", name]).chain(more));
    assert_eq!(said.status, Some(0), "{clock} {more:?}: {}", said.err);
    said
}

fn workplace(scene: &str, hand: &str) -> Workplace {
    let place = Workplace::new();
    place.write("scene.toml", scene);
    if !hand.is_empty() {
        place.write("hand.csv", hand);
    }
    place
}

/// What one finger felt.
fn felt(scene: &str, hand: &str, clock: &str, more: &[&str]) -> Vec<Sample> {
    let place = workplace(scene, hand);
    let hand_file: &[&str] = if hand.is_empty() { &[] } else { &["--hand", "hand.csv"] };
    record(&place, clock, "out.csv", &[hand_file, more].concat());
    Table::read(&place.path("out.csv")).finger("f0")
}

fn bytes(place: &Workplace, name: &str) -> Vec<u8> {
    std::fs::read(place.path(name)).expect("a recording")
}

#[test]
fn two_virtual_runs_write_the_same_bytes_and_another_seed_trembles_otherwise() {
    let place = workplace(TABLE, &pressing());
    for (name, seed) in [("a.csv", "7"), ("b.csv", "7"), ("c.csv", "8")] {
        record(&place, "virtual", name, &["--hand", "hand.csv", "--seed", seed]);
    }
    assert!(bytes(&place, "a.csv") == bytes(&place, "b.csv"), "the same");
    assert!(bytes(&place, "a.csv") != bytes(&place, "c.csv"), "another seed");
    let after_wish = |name: &str| Table::read(&place.path(name)).finger("f0").last().unwrap().hip;
    // Both press into the same wall: what differs is tremor and where friction left the tip, tenths of a millimetre.
    assert!((after_wish("a.csv") - after_wish("c.csv")).norm() < 2e-3);
}

/// However long the driver waited for its commander before; with a damper, which feels what velocity the driver tells.
#[test]
fn lockstep_runs_and_a_virtual_one_write_the_same_bytes() {
    let damped = format!("{TABLE}damping_n_s_per_m = 1.0\n");
    let place = workplace(&damped, &pressing());
    let all = [("a.csv", "lockstep"), ("b.csv", "lockstep"), ("c.csv", "virtual")];
    for rate_hz in ["1000", "8000"] {
        for (name, clock) in all {
            record(&place, clock, name, &["--hand", "hand.csv", "--seconds", "1.2", "--rate-hz", rate_hz]);
        }
        for (name, clock) in all {
            assert!(bytes(&place, "a.csv") == bytes(&place, name), "{clock} {rate_hz} Hz");
        }
    }
}

/// On every clock, the wall's force on a hand that rests is that of two springs in series, hand and wall, within what
/// the friction of the arm takes from either: a tip that sticks may be anywhere where
/// |wall - hand| <= friction, so that |wall - k d| <= friction * k_wall / (k_wall + k_hand) < friction. In real time a
/// machine that keeps the application from answering has the driver take the force away, and the tip rests elsewhere
/// after that: one of five runs has to be left alone.
#[test]
fn a_hand_that_rests_in_a_wall_presses_with_its_own_stiffness_on_every_clock() {
    for (clock, runs) in [("virtual", 1), ("lockstep", 1), ("real", 5)] {
        let said: Vec<String> = (0..runs).map_while(|_| presses_otherwise(clock)).collect();
        assert!(said.len() < runs, "{said:?}");
    }
}

/// How the force of a hand that rests in the table differs from what it has to be, if it does.
fn presses_otherwise(clock: &str) -> Option<String> {
    let series = HAND_N_PER_M * WALL_N_PER_M / (HAND_N_PER_M + WALL_N_PER_M);
    let wanted = series * 0.01;
    let samples = felt(TABLE, &pressing(), clock, &[]);
    let resting: Vec<&Sample> = samples.iter().filter(|s| s.t > 2.5).collect();
    assert!(resting.len() > 100, "{clock}: {} rows", resting.len());
    let mean = resting.iter().map(|s| s.force.y).sum::<f64>() / resting.len() as f64;
    // The weight that is not compensated for is none; the compensation's own rounding is half a converter step.
    let band = FRICTION_N + HALF_CODE_N[1] * 2.0;
    let touches = resting.iter().all(|s| s.touches());
    let is_right = (mean - wanted).abs() <= band && touches;
    (!is_right).then(|| format!("{clock}: {mean} N of {wanted} N, allowed {band} off; touches: {touches}"))
}

#[test]
fn the_tip_lags_behind_the_wish_and_settles_on_it_within_what_friction_holds() {
    let scene = "[[finger]]\nstart_m = [0.0, 0.1, 0.0]\n";
    let wish = |t: f64| Vector3::new(0.04 * ((t - 0.5) / 0.5).clamp(0.0, 1.0), 0.1, 0.0);
    let path = hand([0.0, 0.5, 1.0, 4.0].map(|t| (t, wish(t).into())));
    let samples = felt(scene, &path, "virtual", &[]);
    let sunk = (samples[0].hip - wish(0.0)).norm();
    assert!(sunk < SUNK_M, "it begins on it: {:?}", samples[0]);
    let behind = samples.iter().map(|s| wish(s.t).x - s.hip.x).fold(0.0, f64::max);
    // 80 mm/s through a hand of 5 Hz, which alone lags by 2 / w = 41 ms: 3.3 mm.
    assert!((0.003..0.03).contains(&behind), "{behind}");
    // Sideways grasp and arm have 65 N/m in series. A tip that friction holds stays anywhere within friction over that;
    // the tremor, of 0.05 mm, comes on top.
    let series = 379.5 * 78.75 / (379.5 + 78.75);
    for s in samples.iter().filter(|s| s.t > 3.0) {
        let off = (s.hip - wish(s.t)).x.abs();
        assert!(off < FRICTION_N / series + 3e-4, "{off}: {s:?}");
        assert_eq!(s.force, Vector3::zeros());
    }
}

#[test]
fn what_is_applied_is_what_was_computed_but_for_the_converters_steps() {
    let samples = felt(TABLE, &pressing(), "virtual", &[]);
    let largest =
        samples.iter().map(|s| (s.applied - s.force).abs()).fold(Vector3::zeros(), |a, b| a.sup(&b));
    println!("{largest:?}");
    // Off home the levers differ by some percent, and a force has a share on each joint.
    let step = Vector3::from(HALF_CODE_N).norm() * 1.2;
    assert!(largest.norm() < 2.0 * step && largest.norm() > 0.1 * step, "{largest} {step}");
    assert!(samples.iter().any(|s| s.force.y > 0.5), "it was pressed");
}

#[test]
fn the_base_is_put_where_the_arm_reaches_the_path_and_that_is_said() {
    let far = "[[finger]]\nstart_m = [3.0, 0.0, 0.0]\n";
    let path = hand([(0.0, [3.0, 0.0, 0.0]), (1.0, [3.05, 0.02, 0.0])]);
    let place = workplace(far, &path);
    let said = record(&place, "virtual", "out.csv", &["--hand", "hand.csv"]);
    let words = "phantom3: the device of finger f0 stands at [";
    assert!(said.err.contains(words) && said.err.contains("--layout says otherwise"), "{}", said.err);
    let hip = Table::read(&place.path("out.csv")).vectors("f0_hip");
    assert!((hip[0] - Vector3::new(3.0, 0.0, 0.0)).norm() < SUNK_M, "{}", hip[0]);
    let near = workplace(TABLE, "");
    let said = record(&near, "virtual", "out.csv", &["--seconds", "0.1"]);
    assert_eq!(said.err, "", "where nothing had to be moved nothing is said");
}

#[test]
fn hands_and_devices_of_other_kinds_are_simulated() {
    let pressed = |more: &[&str]| {
        let samples = felt(TABLE, &pressing(), "virtual", more);
        let resting: Vec<f64> = samples.iter().filter(|s| s.t > 3.0).map(|s| s.force.y).collect();
        resting.iter().sum::<f64>() / resting.len() as f64
    };
    let usual = pressed(&[]);
    let light = pressed(&["--firmness", "light"]);
    let firm = pressed(&["--firmness", "firm"]);
    // In series 60 and 142 N/m instead of 88, less what the wall takes; friction is 0.04 N of 0.8.
    assert!(light < 0.85 * usual && firm > 1.25 * usual, "{light} {usual} {firm}");
    let fingertip = pressed(&["--hand-model", "fingertip"]);
    assert!((fingertip - usual).abs() > 0.05, "{fingertip} {usual}");
    let wooden = pressed(&["--device", "wooden-haptics"]);
    // The same hand in the same wall; that arm's friction is of the same size.
    assert!((wooden - usual).abs() < 0.3, "{wooden} {usual}");
    let mut model = std::fs::read_to_string(format!(
        "{}/../config/hands/models/pen-grip.toml",
        env!("CARGO_MANIFEST_DIR")
    ))
    .expect("it comes with the program");
    model = model.replace("name = \"Pen grip\"", "name = \"Mine\"");
    let place = workplace(TABLE, &pressing());
    place.write("mine.toml", model);
    record(
        &place,
        "real",
        "out.csv",
        &["--hand", "hand.csv", "--hand-model", "mine.toml", "--seconds", "0.2"],
    );
}

#[test]
fn nobody_lets_the_compensated_arm_hover() {
    let samples = felt("[[finger]]\nstart_m = [0.0, 0.1, 0.0]\n", "", "virtual", &["--hand-model", "nobody"]);
    // Until its motors come on, for 0.2 s, friction and inertia alone hold it.
    let last = samples.last().expect("rows");
    println!("{:?}", last.hip);
    assert!((last.hip - samples[0].hip).norm() < 0.05, "{last:?}");
}

#[test]
fn eight_fingers_run() {
    let mut scene = String::new();
    for finger in 0..8 {
        let x = 0.02 * f64::from(finger);
        scene += &format!("[[finger]]\nstart_m = [{x:?}, 0.1, 0.0]\n");
    }
    scene += &TABLE[TABLE.find("[[entity]]").unwrap()..];
    for clock in ["virtual", "lockstep"] {
        let place = workplace(&scene, "");
        record(&place, clock, "out.csv", &["--seconds", "0.5"]);
        let table = Table::read(&place.path("out.csv"));
        assert_eq!(table.len(), 500);
        for finger in 0..8 {
            let hip = table.finger(&format!("f{finger}"))[499].hip;
            // It rests on the table's surface, where its hand is.
            assert!(
                (hip - Vector3::new(0.02 * f64::from(finger), 0.1, 0.0)).norm() < 2e-3,
                "{finger}: {hip}"
            );
        }
    }
}

/// Two fingers hold a fixed ball between them, so large that it is flat to them, and are drawn up along it, where it is
/// more slippery than they believe.
#[test]
fn fingers_that_slip_press_harder_if_their_hand_minds() {
    let scene = "[[finger]]\nstart_m = [-0.52, 0.1, 0.0]\n[[finger]]\nstart_m = [0.52, 0.1, 0.0]\n\
        [[entity]]\nname = \"ball\"\nshape = { kind = \"sphere\", radius_m = 0.5 }\nposition_m = [0.0, 0.1, 0.0]\n\
        stiffness_n_per_m = 1000.0\nfriction = { model = \"coulomb\", mu = 0.25 }\n";
    let row = |t: f64, x: f64, y: f64| format!("{t},{},{y},0,{x},{y},0\n", -x);
    let wish: String =
        [(0.0, 0.52, 0.1), (0.5, 0.48, 0.1), (1.5, 0.48, 0.1), (2.0, 0.48, 0.115), (4.0, 0.48, 0.115)]
            .map(|(t, x, y)| row(t, x, y))
            .concat();
    let usual = io_driver::sim::hand::model_file::builtin("pen-grip").unwrap();
    let grip = |minds: bool| {
        let place = workplace(scene, &format!("t,f0_x,f0_y,f0_z,f1_x,f1_y,f1_z\n{wish}"));
        assert!(usual.contains("minds_slip = false"));
        place.write("hand.toml", usual.replace("minds_slip = false", &format!("minds_slip = {minds}")));
        record(&place, "virtual", "out.csv", &["--hand", "hand.csv", "--hand-model", "hand.toml"]);
        let table = Table::read(&place.path("out.csv"));
        ["f0", "f1"].map(|finger| {
            let samples = table.finger(finger);
            let pressed = |from: f64, to: f64| {
                let forces: Vec<f64> =
                    samples.iter().filter(|s| (from..to).contains(&s.t)).map(|s| s.force.x.abs()).collect();
                forces.iter().sum::<f64>() / forces.len() as f64
            };
            [pressed(1.2, 1.5), pressed(3.5, 4.0)]
        })
    };
    let (calm, minding) = (grip(false), grip(true));
    for (calm, minding) in calm.into_iter().zip(minding) {
        // Before anything slips both hold as their script says, within what friction holds.
        assert!((calm[0] - minding[0]).abs() < 2.0 * FRICTION_N, "{calm:?} {minding:?}");
        // Friction of 0.25 where 0.6 was believed asks for more than twice the grip.
        assert!(minding[1] > 1.5 * calm[1], "{calm:?} {minding:?}");
    }
}

#[test]
fn a_handle_that_the_hand_turns_is_recorded_as_its_encoders_measure_it() {
    let turned = "t,f0_x,f0_y,f0_z,f0_qw,f0_qx,f0_qy,f0_qz,f0_buttons\n0,0,0.11,0,1,0,0,0,0\n\
                  1,0,0.11,0,0.8,0,0.6,0,5\n2,0,0.11,0,0.8,0,0.6,0,5\n";
    let place = workplace(TABLE, turned);
    let gimbal = "[gimbal]\ncounts_per_rev = 4000\nreduction = [1.0, 1.0, 1.0]\nsign = [1, -1, 1]\n\
                  channel = [3, 4, 5]\nhome_angles_rad = [0.0, 0.0, 0.0]\n";
    let arm = format!("{}\n{gimbal}", io_driver::device_file::builtin("premium-1.5").unwrap());
    place.write("arm.toml", arm);
    record(&place, "virtual", "out.csv", &["--hand", "hand.csv", "--device", "arm.toml"]);
    let table = Table::read(&place.path("out.csv"));
    let last = |column: &str| -> f64 { table.texts(column).last().unwrap().parse().unwrap() };
    let found = ["f0_qw", "f0_qx", "f0_qy", "f0_qz"].map(last);
    // Half a count of each of the three, half of that in a quaternion; and the arm's own joints, which carry the
    // gimbal, by less.
    let most = 3.0 * 0.5 * std::f64::consts::TAU / 4000.0;
    for (found, wanted) in found.into_iter().zip([0.8, 0.0, 0.6, 0.0]) {
        assert!((found - wanted).abs() < most, "{found} {wanted}");
    }
    assert_eq!(last("f0_buttons"), 5.0);
    assert_eq!(table.texts("f0_buttons")[0], "0");
}

fn refused(place: &Workplace, more: &[&str]) -> String {
    let before = place.snapshot();
    let said = place.run([&["run", "scene.toml", "--hand-mode", "impedance"], more].concat());
    assert_eq!((said.status, said.out.as_str()), (Some(2), ""), "{more:?}: {}", said.err);
    assert!(place.snapshot() == before, "{more:?}: files have changed");
    said.err
}

#[test]
fn a_start_that_no_arm_reaches_is_refused_with_finger_place_and_remedy() {
    let place = workplace(TABLE, "");
    place.write("layout.toml", "[[device]]\nposition_m = [2.0, 0.0, 0.0]\n");
    for clock in ["virtual", "real"] {
        let said = refused(&place, &["--layout", "layout.toml", "--clock", clock, "--record", "out.csv"]);
        for words in ["f0", "[0.0, 0.1, 0.0]", "reach", "--layout"] {
            assert!(said.contains(words), "`{words}` is missing in: {said}");
        }
    }
}

#[test]
fn wrong_names_are_refused_with_what_is_allowed() {
    let place = workplace(TABLE, "");
    place.write("wrong.toml", "name = \"x\"\n");
    let cases: &[(&[&str], &[&str])] = &[
        (&["--hand-model", "pengrip"], &["hand's model pengrip", "pen-grip, fingertip, nobody"]),
        (&["--hand-model", "wrong.toml"], &["wrong.toml"]),
        (&["--firmness", "strong"], &["--firmness", "found strong", "light, usual, firm"]),
        (&["--device", "omni"], &["device's description omni", "premium-1.5", "wooden-haptics"]),
        (&["--device", "ideal"], &["ideal", "--hand-mode kinematic", "premium-1.5"]),
        (&["--device", "wrong.toml"], &["wrong.toml"]),
        (&["--attach", "none.sock"], &["--attach", "--hand-mode impedance", "exclude each other"]),
    ];
    for (more, parts) in cases {
        let said = refused(&place, more);
        for part in *parts {
            assert!(said.contains(part), "{more:?}: `{part}` is missing in: {said}");
        }
    }
}

/// Two fingers, a cube of 100 g, and a hand file that goes 4 mm into its sides and up by 50 mm.
#[test]
fn two_fingers_lift_the_cube_of_the_scene_that_comes_with_the_program() {
    let scene = format!("{}/../config/scenes/lift.toml", env!("CARGO_MANIFEST_DIR"));
    let lifted_m = |more: &[&str]| {
        let place = Workplace::new();
        let run = [
            "run",
            &scene,
            "--hand-mode",
            "impedance",
            "--clock",
            "virtual",
            "--headless",
            "--record",
            "out.csv",
        ];
        let said = place.run(run.iter().chain(more));
        assert_eq!(said.status, Some(0), "{more:?}: {}", said.err);
        let table = Table::read(&place.path("out.csv"));
        let (t, y) = (table.numbers("t"), table.numbers("cube_y"));
        // The hand is up from 2 s to 4 s; half a second later it has settled.
        let up = t.iter().zip(&y).filter(|(t, _)| (2.5..4.0).contains(*t)).map(|(_, up)| up - y[0]);
        up.fold(f64::INFINITY, f64::min)
    };
    for seed in ["0", "1", "2"] {
        // A fingertip's 548 N/m give way by 0.9 mm under half of the weight, and its contact by 1 mm.
        let lifted_m = lifted_m(&["--seed", seed]);
        assert!(lifted_m > 0.045, "{lifted_m} m with seed {seed}");
    }
    // Two pens are held by whole arms, which give way: 0.23 N in place of 0.7 N.
    assert!(lifted_m(&["--hand-model", "pen-grip"]) < 0.005);
}
