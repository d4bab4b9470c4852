//! Entities that move, through scene file, hand file and recording alone, against closed forms.

use nalgebra::{UnitQuaternion, Vector3};
use std::f64::consts::PI;
use std::fmt::Write as _;
use system_tests::recording::Table;
use system_tests::workplace::Workplace;

type V = Vector3<f64>;

const G: f64 = 9.81;
const DT: f64 = 1e-3;
const MASS: f64 = 0.1;
const EDGE: f64 = 0.05;

/// A finger that touches nothing, and a hand that keeps it there for so long (s).
fn alone(seconds: f64) -> String {
    format!("t,f0_x,f0_y,f0_z\n0,1,1,1\n{seconds:?},1,1,1\n")
}

/// A table, leaned about z by an angle (rad), and a cube of 0.1 kg on it; `rest` belongs to the cube.
fn cube_on_table(lean: f64, mu: f64, rest: &str) -> String {
    let (k_table, k_cube) = (2000.0, 500.0);
    let weight = MASS * G * lean.cos();
    let sunk = weight / (4.0 * k_table * k_cube / (k_table + k_cube));
    let turn = UnitQuaternion::from_axis_angle(&V::z_axis(), lean);
    let (at, n) = (turn * V::new(0.0, EDGE / 2.0 - sunk, 0.0), turn * V::y());
    let q = turn.quaternion();
    format!(
        r#"
        [[finger]]
        [[entity]]
        name = "table"
        shape = {{ kind = "plane", normal = [{:?}, {:?}, 0.0], offset_m = 0.0 }}
        stiffness_n_per_m = {k_table:?}
        damping_n_s_per_m = 2.0
        friction = {{ model = "coulomb", mu = {mu:?} }}
        [[entity]]
        name = "cube"
        shape = {{ kind = "box", size_m = [{EDGE}, {EDGE}, {EDGE}] }}
        position_m = [{:?}, {:?}, 0.0]
        orientation_wxyz = [{:?}, {:?}, {:?}, {:?}]
        mass_kg = {MASS}
        stiffness_n_per_m = {k_cube:?}
        friction = {{ model = "coulomb", mu = {mu:?} }}
        {rest}"#,
        n.x, n.y, at.x, at.y, q.w, q.i, q.j, q.k
    )
}

fn played(scene: &str, hand: &str) -> Table {
    Workplace::new().play(scene, hand, &[])
}

#[test]
fn what_is_let_go_falls_and_turns_as_newton_says_from_the_first_row_on() {
    let scene = r#"
        [[finger]]
        [[entity]]
        name = "ball"
        shape = { kind = "sphere", radius_m = 0.02 }
        position_m = [0.0, 0.5, 0.0]
        velocity_m_s = [0.3, 0.0, 0.0]
        angular_velocity_rad_s = [0.0, 2.0, 0.0]
        mass_kg = 0.2"#;
    let table = played(scene, &alone(0.3));
    let ball = table.body("ball");
    for (row, (t, ball)) in table.numbers("t").into_iter().zip(&ball).enumerate() {
        let expected = V::new(0.3 * t, 0.5 - 0.5 * G * t * t, 0.0);
        // Velocities are summed up over 300 ticks, positions of 0.5 m from them.
        assert!((ball.position - expected).norm() < 1e-13, "row {row}: {ball:?}");
        assert!((ball.velocity - V::new(0.3, -G * t, 0.0)).norm() < 1e-13, "row {row}: {ball:?}");
        let turned = UnitQuaternion::from_axis_angle(&V::y_axis(), 2.0 * t);
        assert!(ball.orientation.angle_to(&turned) < 1e-7, "row {row}: {ball:?}");
        assert!((ball.angular_velocity - V::new(0.0, 2.0, 0.0)).norm() < 1e-13, "row {row}");
    }
}

#[test]
fn a_cube_that_is_pushed_off_slides_as_far_as_its_friction_lets_it() {
    let (mu, v) = (0.4, 0.5);
    let scene = cube_on_table(0.0, mu, "velocity_m_s = [0.5, 0.0, 0.0]");
    let table = played(&scene, &alone(1.0));
    let cube = table.body("cube");
    let slid = cube.last().unwrap().position.x;
    let stops_at_s = v / (mu * G);
    // The last tick's friction stops it within that tick, and then the springs of its corners, stretched by
    // mu m g / (4 k) = 0.25 mm, draw it back in their own time.
    assert!((slid - v * v / (2.0 * mu * G)).abs() < 0.3e-3 + v * DT, "{slid}");
    let rows = table.numbers("t").into_iter().zip(&cube);
    for (t, cube) in rows.filter(|(t, _)| *t > 0.05 && *t < stops_at_s - 0.01) {
        // It rocks on its springs at first, so that its corners carry different loads; their sum is the weight.
        assert!((cube.velocity.x - (v - mu * G * t)).abs() < 2e-3, "at {t} s: {cube:?}");
    }
    // It stands.
    assert!(cube.last().unwrap().velocity.norm() < 1e-6, "{:?}", cube.last());
}

/// `dw/dt = -2.5 s g / r^2`: as the scene, the material and nobody says.
#[test]
fn a_ball_that_spins_on_a_table_is_braked_by_its_torsional_friction() {
    let (radius, turns) = (0.02, 10.0);
    for (key, length) in [
        ("", 2e-4),
        ("torsional_friction_m = 3e-4", 3e-4),
        ("material = \"foam\"", 1e-3),
        ("torsional_friction_m = 0.0", 0.0),
    ] {
        let table_key = if length < 2e-4 { key } else { "" };
        let scene = format!(
            r#"
            [[finger]]
            [[entity]]
            shape = {{ kind = "plane", normal = [0.0, 1.0, 0.0], offset_m = 0.0 }}
            {table_key}
            [[entity]]
            name = "ball"
            shape = {{ kind = "sphere", radius_m = {radius} }}
            position_m = [0.0, {radius}, 0.0]
            angular_velocity_rad_s = [0.0, {turns:?}, 0.0]
            mass_kg = 0.1
            {key}"#
        );
        let played = played(&scene, &alone(1.0));
        let (times, ball) = (played.numbers("t"), played.body("ball"));
        let brakes = 2.5 * length * G / (radius * radius);
        for (t, ball) in times.iter().zip(&ball) {
            let expected = (turns - brakes * t).max(0.0);
            // It bobs on its soft contact at first, pressed by now more, now less than its weight; so long a spring of the patch
            // takes to wind up and to unwind.
            let slack = brakes * 0.05 + 1e-9;
            assert!((ball.angular_velocity.y - expected).abs() < slack, "{key} at {t}: {ball:?} {expected}");
        }
    }
}

#[test]
fn below_the_friction_angle_a_cube_stays_and_above_it_slides_with_what_is_left() {
    let mu: f64 = 0.5;
    let held = played(&cube_on_table((0.95 * mu).atan(), mu, ""), &alone(10.0)).body("cube");
    let crept = (held.last().unwrap().position - held[1000].position).norm();
    // What the solver leaves open: 1e-10 of the forces.
    assert!(crept < 1e-9, "{crept}");
    let lean: f64 = 0.6;
    let slides = played(&cube_on_table(lean, mu, ""), &alone(0.6)).body("cube");
    let acceleration = (slides[600 - 1].velocity - slides[300].velocity).norm() / (299.0 * DT);
    let expected = G * (lean.sin() - mu * lean.cos());
    assert!((acceleration - expected).abs() < 1e-6 * expected, "{acceleration} {expected}");
}

/// Two fingers close on the cube, lift it by 50 mm, hold it, put it down 30 mm aside and let it go.
fn pick_and_place(squeeze: f64) -> String {
    let mut hand = String::from("t,f0_x,f0_y,f0_z,f1_x,f1_y,f1_z\n");
    let smooth =
        |t: f64, from: f64, to: f64| 0.5 - 0.5 * (PI * ((t - from) / (to - from)).clamp(0.0, 1.0)).cos();
    for step in 0..=700 {
        let t = f64::from(step) * 0.01;
        let closed = smooth(t, 0.0, 1.0) - smooth(t, 6.0, 7.0);
        let x = EDGE / 2.0 + 0.01 - (0.01 + squeeze) * closed;
        let y = 0.025 + 0.05 * (smooth(t, 1.0, 2.5) - smooth(t, 4.0, 5.5));
        let z = 0.03 * smooth(t, 2.5, 4.0);
        let _ = writeln!(hand, "{t:?},{x:?},{y:?},{z:?},{:?},{y:?},{z:?}", -x);
    }
    hand
}

fn grasped() -> Table {
    let scene = cube_on_table(0.0, 0.5, "").replacen("[[finger]]", "[[finger]]\n[[finger]]", 1);
    played(&scene, &pick_and_place(0.004))
}

#[test]
fn a_grasped_cube_is_lifted_carried_and_put_down() {
    let table = grasped();
    let cube = table.body("cube");
    let at = |t: f64| cube[(t / DT) as usize];
    // Sunk in, 0.61 mm; carried by two springs across, mg / 2k = 0.98 mm.
    let hangs = MASS * G * (0.5 / 500.0 + 0.25 / 400.0);
    assert!((at(3.9).position.y - (0.075 - hangs)).abs() < 1e-4, "{:?}", at(3.9));
    assert!(
        (at(6.9).position - V::new(0.0, 0.025 - 0.25 * MASS * G / 400.0, 0.03)).norm() < 1e-3,
        "{:?}",
        at(6.9)
    );
    assert!(at(6.9).velocity.norm() < 1e-3 && table.finger("f0")[6990].entity.is_empty());
    for finger in ["f0", "f1"] {
        let rows = table.finger(finger);
        assert!(rows[1500..5000].iter().all(|s| s.entity == "cube" && s.friction == "stick"), "{finger}");
    }
}

#[test]
fn what_the_fingers_feel_is_what_moved_the_cube_in_every_tick() {
    let table = grasped();
    let (cube, f0, f1) = (table.body("cube"), table.finger("f0"), table.finger("f1"));
    let mut in_the_air = 0;
    for row in 2000..4000 {
        let on_users = f0[row].force + f1[row].force;
        let acceleration = (cube[row + 1].velocity - cube[row].velocity) / DT;
        // The velocity of the frame's origin is that of the centre of mass. Differences of numbers near 0.05 m/s over a
        // tick, times 0.1 kg.
        let wanted = (V::new(0.0, -G, 0.0) - acceleration) * MASS;
        assert!((on_users - wanted).norm() < 1e-12, "row {row}: {on_users:?}, {wanted:?}");
        in_the_air += 1;
    }
    assert_eq!(in_the_air, 2000);
    // At rest in the air: the weight, on both alike.
    assert!((f0[3990].force.y + 0.5 * MASS * G).abs() < 0.01, "{:?}", f0[3990]);
}

#[test]
fn a_run_with_objects_repeats_to_the_byte() {
    let scene = cube_on_table(0.0, 0.5, "").replacen("[[finger]]", "[[finger]]\n[[finger]]", 1);
    let bytes = || {
        let place = Workplace::new();
        let table = place.play(&scene, &pick_and_place(0.004), &[]);
        table.rows().to_vec()
    };
    assert!(bytes() == bytes());
}

#[test]
fn a_locked_body_never_turns_and_a_given_centre_of_mass_falls_straight() {
    // On a corner, where anything else would turn.
    let falls = |rest: &str| {
        let scene = cube_on_table(0.0, 0.5, rest)
            .replace("orientation_wxyz = [1.0, 0.0, 0.0, 0.0]", "orientation_wxyz = [0.9, 0.3, 0.1, 0.3]");
        assert!(scene.contains("0.9, 0.3"), "{scene}");
        played(&scene, &alone(0.5)).body("cube")
    };
    let locked = falls("rotation_locked = true");
    assert!(locked.iter().all(|cube| cube.orientation == locked[0].orientation), "{:?}", locked.last());
    let free = falls("");
    assert!(free.last().unwrap().orientation.angle_to(&free[0].orientation) > 0.1, "{:?}", free.last());
    // Thrown turning about z: its centre of mass, 10 mm from its middle, goes straight down.
    let scene = r#"
        [[finger]]
        [[entity]]
        name = "box"
        shape = { kind = "box", size_m = [0.05, 0.05, 0.05] }
        position_m = [0.0, 1.0, 0.0]
        centre_of_mass_m = [0.01, 0.0, 0.0]
        velocity_m_s = [0.0, -0.1, 0.0]
        angular_velocity_rad_s = [0.0, 0.0, 10.0]
        mass_kg = 0.1"#;
    let table = played(scene, &alone(0.3));
    for (t, cube) in table.numbers("t").into_iter().zip(table.body("box")) {
        let centre = cube.position + cube.orientation * V::new(0.01, 0.0, 0.0);
        // The frame's origin moves down at 0.1 m/s, and the centre, 10 mm aside, stands still: 10 rad/s times 10 mm.
        let expected = V::new(0.01, 1.0 - 0.5 * G * t * t, 0.0);
        assert!((centre - expected).norm() < 1e-12, "at {t} s: {centre:?}");
    }
}

#[test]
fn what_leaves_the_world_is_told_by_name_and_stands_still() {
    let place = Workplace::new();
    place.write(
        "scene.toml",
        "[[finger]]\n[[entity]]\nname = \"rocket\"\nshape = { kind = \"sphere\", radius_m = 0.02 }\n\
         position_m = [0, 95, 0]\nvelocity_m_s = [0, 20, 0]\nmass_kg = 1\n",
    );
    let said = place.run(["run", "scene.toml", "--clock", "virtual", "--headless", "--record", "out.csv"]);
    assert_eq!(said.status, Some(0), "{}", said.err);
    // 95 + 20 t - g t^2 / 2 = 100 m.
    assert!(said.out.contains("parked       rocket left the world at t = 0.26"), "{}", said.out);
    let rocket = Table::read(&place.path("out.csv")).body("rocket");
    let last = rocket.last().unwrap();
    assert!((last.position.y - 100.0).abs() < 0.05 && last.velocity == V::zeros(), "{last:?}");
}

#[test]
fn what_passes_through_something_because_nobody_finds_where_they_touch_is_told() {
    let place = Workplace::new();
    place.write(
        "scene.toml",
        "[[finger]]\n[[entity]]\nname = \"die\"\nshape = { kind = \"box\", size_m = [0.1, 0.1, 0.1] }\nmass_kg = 1\n\
         [[entity]]\nname = \"tray\"\nshape = { kind = \"csg\", op = \"union\", children = [\
         { shape = { kind = \"sphere\", radius_m = 0.1 } }, { shape = { kind = \"box\", size_m = [1, 0.1, 1] } }] }\n",
    );
    let said = place.run(["run", "scene.toml", "--clock", "virtual", "--headless"]);
    assert_eq!(said.status, Some(0), "{}", said.err);
    assert!(said.err.contains("die (box) passes through tray (csg)"), "{}", said.err);
}

#[test]
fn all_kinds_of_things_come_to_rest_on_a_table_and_weigh_what_they_weigh() {
    let kinds = [
        ("ball", "{ kind = \"sphere\", radius_m = 0.02 }"),
        ("block", "{ kind = \"box\", size_m = [0.04, 0.03, 0.05] }"),
        ("can", "{ kind = \"cylinder\", radius_m = 0.02, length_m = 0.05 }"),
        ("cone", "{ kind = \"cone\", radius_bottom_m = 0.025, radius_top_m = 0.0, length_m = 0.05 }"),
        ("pill", "{ kind = \"capsule\", radius_m = 0.015, length_m = 0.03 }"),
        ("ring", "{ kind = \"torus\", ring_radius_m = 0.025, tube_radius_m = 0.008 }"),
    ];
    let mut scene = String::from(
        "[[finger]]\n[[entity]]\nname = \"table\"\nshape = { kind = \"plane\", normal = [0, 1, 0], offset_m = 0 }\n\
         stiffness_n_per_m = 5000\ndamping_n_s_per_m = 5\nfriction = { model = \"coulomb\", mu = 0.5 }\n",
    );
    for (place, (name, shape)) in kinds.iter().enumerate() {
        let _ = write!(
            scene,
            "[[entity]]\nname = \"{name}\"\nshape = {shape}\nposition_m = [{}, 0.03, 0]\ndensity_kg_m3 = 1000\n\
             stiffness_n_per_m = 2000\nfriction = {{ model = \"coulomb\", mu = 0.5 }}\n",
            0.15 * place as f64
        );
    }
    let table = played(&scene, &alone(3.0));
    // Half of their height, less a weight on as many springs.
    for (name, height) in
        [("ball", 0.02), ("block", 0.015), ("can", 0.025), ("cone", 0.025), ("pill", 0.03), ("ring", 0.008)]
    {
        let body = *table.body(name).last().unwrap();
        assert!(body.velocity.norm() < 1e-6 && body.angular_velocity.norm() < 1e-4, "{name}: {body:?}");
        // 1000 kg/m^3 make 20 to 63 g: 0.2 to 0.6 N on one to eight springs of 1430 N/m.
        let sunk = height - body.position.y;
        assert!(sunk > 1e-5 && sunk < 4.5e-4, "{name}: {sunk}");
    }
}

/// A finger that stays where it is for so long (s).
fn still(at: V, seconds: f64) -> String {
    format!("t,f0_x,f0_y,f0_z\n0,{0:?},{1:?},{2:?}\n{seconds:?},{0:?},{1:?},{2:?}\n", at.x, at.y, at.z)
}

#[test]
fn a_magnetic_ball_hangs_under_a_finger_that_feels_its_weight() {
    let (radius, mass, force, reach) = (0.02, 0.03, 1.0, 0.01);
    // 27/4 F0 x (1 - x)^2 = m g, on the side where it holds: x < 1/3. Newton's way there.
    let mut x: f64 = 0.0;
    for _ in 0..50 {
        let slope = 6.75 * force * (1.0 - x) * (1.0 - 3.0 * x);
        x += (mass * G - 6.75 * force * x * (1.0 - x) * (1.0 - x)) / slope;
    }
    let scene = |below: f64| {
        format!(
            "[[finger]]\n[[entity]]\nname = \"ball\"\nshape = {{ kind = \"sphere\", radius_m = {radius} }}\n\
             position_m = [0.0, {below:?}, 0.0]\nmass_kg = {mass}\n\
             magnetism = {{ force_n = {force:?}, distance_m = {reach:?} }}\n"
        )
    };
    let table = played(&scene(-radius - x * reach), &still(V::zeros(), 2.0));
    let (ball, finger) = (table.body("ball"), table.finger("f0"));
    for (row, (ball, finger)) in ball.iter().zip(&finger).enumerate() {
        // Rounding of the gap, 1e-3 of 0.02 m, times the magnet's slope.
        assert!((finger.force + V::y() * mass * G).norm() < 1e-12, "row {row}: {finger:?}");
        assert!(finger.entity.is_empty() && ball.velocity.norm() < 1e-12, "row {row}: {ball:?}");
    }
    // One millimetre lower it swings, and in every tick moves by what the finger feels and its weight.
    let table = played(&scene(-radius - x * reach - 1e-3), &still(V::zeros(), 1.0));
    let (ball, finger) = (table.body("ball"), table.finger("f0"));
    for (pair, finger) in ball.windows(2).zip(&finger) {
        let got = ((pair[1].velocity - pair[0].velocity) / DT + V::y() * G) * mass;
        // Differences of numbers near 0.2 m/s over a tick, times 0.03 kg.
        assert!((got + finger.force).norm() < 1e-14, "{finger:?}: {got}");
    }
    assert!(ball.iter().any(|ball| ball.velocity.y > 0.05), "it swings");
}

#[test]
fn a_cube_that_hums_is_shaken_by_what_the_finger_feels_of_it() {
    let scene = "gravity_m_s2 = [0, 0, 0]\n[[finger]]\n[[entity]]\nname = \"cube\"\n\
        shape = { kind = \"box\", size_m = [0.05, 0.05, 0.05] }\nmass_kg = 0.1\nstiffness_n_per_m = 800\n\
        vibration = { frequency_hz = 100.0, amplitude_n = 0.4 }\n";
    // It is pushed off its middle, up and ahead.
    let hand = "t,f0_x,f0_y,f0_z\n0,0.005,-0.03,0.01\n0.1,0.005,-0.02,0.01\n1.0,0.005,0.07,0.01\n";
    let table = played(scene, hand);
    let (cube, finger) = (table.body("cube"), table.finger("f0"));
    let inertia = 0.1 * 0.05 * 0.05 / 6.0;
    let mut felt = 0;
    for (pair, finger) in cube.windows(2).zip(&finger) {
        let got = (pair[1].velocity - pair[0].velocity) * (0.1 / DT);
        // Rounding of 0.1 m/s over a tick, times 0.1 kg.
        assert!((got + finger.force).norm() < 1e-13, "{finger:?}: {got}");
        let turned = (pair[1].angular_velocity - pair[0].angular_velocity) * (inertia / DT);
        let torque = (finger.god - pair[0].position).cross(&-finger.force);
        // Of the cube all moments are the same. The same, of 10 rad/s.
        assert!((turned - torque).norm() < 1e-14, "{finger:?}: {turned} {torque}");
        felt += usize::from(finger.entity == "cube");
    }
    assert!(felt > 20, "{felt}");
}

#[test]
fn a_field_holds_back_the_finger_and_pushes_no_object() {
    let scene = "gravity_m_s2 = [0, 0, 0]\n[[finger]]\n[[field]]\nkind = \"constant\"\nforce_n = [1.0, 0.0, 0.0]\n\
        [[entity]]\nname = \"ball\"\nshape = { kind = \"sphere\", radius_m = 0.02 }\nmass_kg = 0.1\n";
    let table = played(scene, &still(V::new(0.1, 0.0, 0.0), 0.2));
    assert!(table.finger("f0").iter().all(|finger| finger.force == V::x()));
    assert!(table.body("ball").iter().all(|ball| ball.position == V::zeros()));
}

#[test]
fn each_of_three_balls_bounces_by_its_own_restitution_and_the_floors() {
    let mut scene = String::from(
        "contact_response = { kind = \"impulse\", restitution = 0.5 }\n[[finger]]\n[[entity]]\nname = \"floor\"\n\
         shape = { kind = \"plane\", normal = [0, 1, 0], offset_m = 0 }\nstiffness_n_per_m = 2000\n",
    );
    for (name, x, rest) in
        [("says_nothing", 0.0, ""), ("dead", 0.2, "restitution = 0.0"), ("lively", 0.4, "restitution = 0.9")]
    {
        let _ = write!(
            scene,
            "[[entity]]\nname = \"{name}\"\nshape = {{ kind = \"sphere\", radius_m = 0.02 }}\n\
             position_m = [{x:?}, 0.12, 0]\nmass_kg = 0.1\nstiffness_n_per_m = 500\n{rest}\n"
        );
    }
    let floors = scene.replacen("stiffness_n_per_m = 2000", "stiffness_n_per_m = 2000\nrestitution = 0.3", 1);
    // With a floor that says 0.3 the softer ball's 0.9 has 4/5 of the energy: 0.8 x 0.81 + 0.2 x 0.09.
    for (scene, shares) in [(scene, [0.25, 0.0, 0.81]), (floors, [0.09, 0.2 * 0.09, 0.8 * 0.81 + 0.2 * 0.09])]
    {
        let table = played(&scene, &alone(0.5));
        for (name, share) in ["says_nothing", "dead", "lively"].into_iter().zip(shares) {
            let ball = table.body(name);
            let met =
                ball.windows(2).position(|pair| pair[0].velocity.y < 0.0 && pair[1].velocity.y >= -1e-6);
            let highest = ball[met.unwrap()..].iter().map(|ball| ball.position.y - 0.02).fold(0.0, f64::max);
            // It is turned round in the tick before it would meet: up to 1.4 mm of the way is not fallen.
            assert!((highest - share * 0.1).abs() < 1.4e-3, "{name}: {highest} for {share}");
        }
    }
}

/// Three cubes on each other on a table, and a finger that after two seconds comes down on the uppermost.
fn touched_stack(top: &str) -> Table {
    let cube = |name: &str, y: f64| {
        format!(
            "[[entity]]\nname = \"{name}\"\nshape = {{ kind = \"box\", size_m = [0.05, 0.05, 0.05] }}\n\
             position_m = [0.0, {y:?}, 0.0]\nmass_kg = 0.1\nstiffness_n_per_m = 1000\ndamping_n_s_per_m = 5\n\
             friction = {{ model = \"coulomb\", mu = 0.5 }}\n"
        )
    };
    let scene = format!(
        "{top}\n[[finger]]\n[[entity]]\nname = \"table\"\ndamping_n_s_per_m = 5\n\
         shape = {{ kind = \"plane\", normal = [0, 1, 0], offset_m = 0 }}\n{}{}{}",
        cube("low", 0.025),
        cube("middle", 0.075),
        cube("top", 0.125)
    );
    let hand = "t,f0_x,f0_y,f0_z\n0,0.01,0.3,0\n2,0.01,0.16,0\n3,0.01,0.143,0\n4,0.01,0.143,0\n5,0.03,0.3,0\n6,0.03,0.3,0\n";
    played(&scene, hand)
}

#[test]
fn a_stack_that_slept_is_recorded_as_one_that_never_does() {
    let [sleeps, awake] = ["", "sleep = false"].map(touched_stack);
    let times = sleeps.numbers("t");
    let pressed = sleeps.numbers("f0_force_y").iter().filter(|force| **force > 0.5).count();
    assert!(pressed > 1000, "{pressed}");
    for name in ["low", "middle", "top"] {
        let both = sleeps.body(name).into_iter().zip(awake.body(name));
        let mut stood = 0;
        for (t, (one, other)) in times.iter().zip(both) {
            let apart = (one.position - other.position).norm();
            assert!(apart < 1e-9, "{name} at {t} s: {apart:e}");
            stood += usize::from(one.velocity == V::zeros());
        }
        // Asleep from about 1 s until it is touched at 2.8 s.
        assert!(stood > 1000, "{name}: {stood}");
    }
    let forces = |table: &Table| table.numbers("f0_force_y");
    for (t, (one, other)) in times.iter().zip(forces(&sleeps).into_iter().zip(forces(&awake))) {
        // 1e-9 m of 1000 N/m.
        assert!((one - other).abs() < 1e-6, "at {t} s: {one} {other}");
    }
}

/// Of a stack of three that are as heavy, the lowest carries three times as much as the highest, on points of 500 N/m.
#[test]
fn check_tells_by_what_stands_on_it_how_deep_each_of_a_stack_sinks_into_the_one_below() {
    let cube = |at: usize| {
        format!(
            "[[entity]]\nname = \"c{at}\"\nposition_m = [0, {}, 0]\nmass_kg = 1\nstiffness_n_per_m = 1000\n\
             shape = {{ kind = \"box\", size_m = [0.04, 0.02, 0.04] }}\n",
            0.01 + 0.02 * at as f64
        )
    };
    let floor = "[[entity]]\nname = \"floor\"\nstiffness_n_per_m = 1000\n\
                 shape = { kind = \"plane\", normal = [0, 1, 0], offset_m = 0 }\n";
    let place = Workplace::new();
    place.write(
        "scene.toml",
        format!("[[finger]]\nstart_m = [0, 1, 0]\n{floor}{}{}{}", cube(0), cube(1), cube(2)),
    );
    let said = place.run(["check", "scene.toml"]).out;
    for (pair, depth_mm) in [
        ("c0 sinks", "58.86 mm into floor"),
        ("c1 sinks", "39.24 mm into c0"),
        ("c2 sinks", "19.62 mm into c1"),
    ] {
        assert!(said.contains(&format!("{pair} {depth_mm}")), "{said}");
    }
    assert_eq!(said.matches(" sinks ").count(), 3, "{said}");
}

/// In the air, high above all of it; leaning, thicker in the world than it is; with nothing below; and rolling "coefficients".
#[test]
fn check_tells_what_falls_on_what_and_how_thin_it_is_whichever_way_it_is_turned() {
    let told = |things: &str| {
        let place = Workplace::new();
        place.write("scene.toml", format!("[[finger]]\nstart_m = [0, 3, 0]\n{things}"));
        place.run(["check", "scene.toml"]).out
    };
    let cube = |name: &str, at: [f64; 3], size: [f64; 3], more: &str| {
        format!(
            "[[entity]]\nname = \"{name}\"\nposition_m = {at:?}\nstiffness_n_per_m = 1000\n\
             shape = {{ kind = \"box\", size_m = {size:?} }}\n{more}\n"
        )
    };
    let table = cube("table", [0.0, -0.01, 0.0], [0.5, 0.02, 0.5], "");
    let said = told(
        &(table.clone()
            + &cube("c0", [0.0, 0.011, 0.0], [0.04, 0.02, 0.04], "mass_kg = 1")
            + &cube("c1", [0.0, 0.6, 0.0], [0.04, 0.02, 0.04], "mass_kg = 1")),
    );
    for line in ["c0 sinks 39.24 mm into table", "c1 sinks 19.62 mm into c0"] {
        assert!(said.contains(line) && said.matches(" sinks ").count() == 2, "{said}");
    }
    let leans = "mass_kg = 1\norientation_wxyz = [0.991444861, 0, 0, 0.130526192]";
    let said = told(&(table.clone() + &cube("plank", [0.0, 0.05, 0.0], [0.2, 0.02, 0.1], leans)));
    assert!(said.contains("plank sinks 19.62 mm into table"), "{said}");
    let said = told(&(table.clone() + &cube("lost", [2.0, 0.1, 0.0], [0.04; 3], "mass_kg = 0.1")));
    assert!(said.contains("nothing is below lost"), "{said}");
    // Through a ring's hole, past a wall that it touches, and beside a rod that is turned; and on that rod.
    let ring = "[[entity]]\nname = \"ring\"\nposition_m = [0, 0.1, 0]\nstiffness_n_per_m = 1000\n\
                shape = { kind = \"torus\", ring_radius_m = 0.05, tube_radius_m = 0.01 }\n";
    let wall = cube("wall", [0.1, 0.2, 0.0], [0.02, 0.2, 0.2], "");
    let turned = "orientation_wxyz = [0.923879533, 0, 0.382683432, 0]";
    let rod = cube("rod", [0.0, 0.1, 0.0], [0.4, 0.01, 0.01], turned);
    for (between, at, lower) in [
        (ring, [0.0, 0.3, 0.0], "table"),
        (ring, [0.05, 0.3, 0.0], "ring"),
        (&wall, [0.07, 0.2, 0.0], "table"),
        (&rod, [0.1, 0.3, 0.1], "table"),
        (&rod, [-0.1, 0.3, 0.1], "rod"),
    ] {
        let said = told(&(table.clone() + between + &cube("thing", at, [0.04; 3], "mass_kg = 1")));
        let sinks = said.lines().find(|line| line.contains("thing sinks")).unwrap_or("");
        assert!(sinks.contains(&format!("mm into {lower} ")), "{at:?} {said}");
    }
    // Of 1 kg, 40 mm wide, 0.0008 m^2 kg is all of it in a corner, seen from the middle; 0.0032 from another corner.
    for (spread, line) in [
        ("centre_of_mass_m = [0, 0.021, 0]", Some("thing: its centre of mass is 0.001 m outside of it")),
        ("centre_of_mass_m = [0, 0.02, 0]", None),
        (
            "inertia_kg_m2 = [0.00081, 0.0008, 0.0008]",
            Some("thing: inertia_kg_m2 about x is 0.00081, more than 0.0008"),
        ),
        ("inertia_kg_m2 = [0.00079, 0.00079, 0.00079]", None),
        ("centre_of_mass_m = [0.02, 0.02, 0.02]\ninertia_kg_m2 = [0.0031, 0.0031, 0.0031]", None),
    ] {
        let of = format!("mass_kg = 1\n{spread}");
        let said = told(&(table.clone() + &cube("thing", [0.0, 0.02, 0.0], [0.04; 3], &of)));
        let is_told = said.contains("its centre of mass") || said.contains("inertia_kg_m2 about");
        assert!(line.is_none_or(|line| said.contains(line)) && is_told == line.is_some(), "{spread}: {said}");
    }
    let rolls = "mass_kg = 0.1\nrolling_friction_m = 0.5";
    let said = told(&(table + &cube("roller", [0.0, 0.02, 0.0], [0.04; 3], rolls)));
    assert!(
        said.contains("rolling_friction_m is 0.5 m, larger than it is") && said.contains("0.01"),
        "{said}"
    );
}

/// A tower of a hundred is deep by mass: another kind is no advice.
#[test]
fn check_does_not_advise_what_is_so_already() {
    let cube = |at: usize| {
        format!(
            "[[entity]]\nname = \"b{at}\"\nposition_m = [0, {}, 0]\nmass_kg = 0.1\n\
             shape = {{ kind = \"box\", size_m = [0.004, 0.004, 0.004] }}\n",
            0.002 + 0.004 * at as f64
        )
    };
    let floor =
        "[[entity]]\nname = \"floor\"\nshape = { kind = \"plane\", normal = [0, 1, 0], offset_m = 0 }\n";
    let place = Workplace::new();
    let tower: String = (0..120).map(cube).collect();
    place.write("scene.toml", format!("[[finger]]\nstart_m = [0, 1, 0]\n{floor}{tower}"));
    let said = place.run(["check", "scene.toml"]).out;
    assert!(said.contains("make it thicker") && !said.contains("by-mass"), "{said}");
}

/// A gram on springs that a kilogram stands on: thrown away without the integrator that takes forces of the tick's end.
#[test]
fn check_tells_what_an_integrator_throws_away() {
    let scene = |integrator: &str, mass_kg: f64, height_m: f64, count: usize| {
        let cubes: String = (0..count)
            .map(|at| {
                let y = 2e-4 + height_m * (at as f64 + 0.5);
                format!(
                    "[[entity]]\nname = \"cube{at}\"\nposition_m = [{}, {y}, 0]\nmass_kg = {mass_kg}\n\
                     stiffness_n_per_m = 4000\nshape = {{ kind = \"box\", size_m = [0.04, {height_m}, 0.04] }}\n",
                    // Not quite above each other.
                    1e-4 * (at % 2) as f64,
                )
            })
            .collect();
        format!(
            "integrator = \"{integrator}\"\n[[finger]]\nstart_m = [0, 1, 0]\n\
             [[entity]]\nname = \"floor\"\nstiffness_n_per_m = 4000\n\
             shape = {{ kind = \"plane\", normal = [0, 1, 0], offset_m = 0 }}\n{cubes}"
        )
    };
    for (integrator, mass_kg, height_m, count, is_thrown) in [
        ("thesis-euler", 0.001, 0.04, 1, true),
        ("thesis-euler", 0.001, 0.005, 1, true),
        ("thesis-euler", 0.003, 0.04, 6, true),
        // A cube alone stands it; three swing faster.
        ("thesis-euler", 0.022, 0.04, 1, false),
        ("thesis-euler", 0.022, 0.04, 3, true),
        ("thesis-euler", 1.0, 0.04, 1, false),
        ("rk4", 0.0005, 0.04, 1, true),
        ("rk4", 1.0, 0.04, 1, false),
        ("implicit", 0.0005, 0.04, 1, false),
    ] {
        let scene = scene(integrator, mass_kg, height_m, count);
        let place = Workplace::new();
        place.write("scene.toml", &scene);
        let said = place.run(["check", "scene.toml"]).out;
        assert_eq!(said.contains("may throw away cube"), is_thrown, "{integrator} {mass_kg}: {said}");
        let run = played(&scene, &alone(2.0));
        let speeds = (0..count).flat_map(|at| run.body(&format!("cube{at}")));
        let fastest = speeds.map(|at| at.velocity.norm()).fold(0.0, f64::max);
        // It falls by 0.2 mm: 0.06 m/s.
        assert_eq!(fastest > 0.2, is_thrown, "{integrator} {mass_kg}: {fastest} m/s");
    }
}

/// As soft as fingers feel both, it sinks through; by mass it rests, and so does what says no stiffness.
#[test]
fn a_ball_of_steel_rests_on_a_thin_plate_where_contacts_are_stiff_and_check_tells_where_they_are_not() {
    let scene = "[[finger]]\n[[entity]]\nname = \"plate\"\nposition_m = [0, -0.005, 0]\n\
                 shape = { kind = \"box\", size_m = [0.2, 0.01, 0.2] }\n\
                 [[entity]]\nname = \"ball\"\nposition_m = [0, 0.041, 0]\nmaterial = \"steel\"\nmovable = true\n\
                 shape = { kind = \"sphere\", radius_m = 0.04 }\n";
    let rests_m = |scene: &str| played(scene, &alone(2.0)).body("ball").last().unwrap().position.y;
    let checked = |scene: &str| {
        let place = Workplace::new();
        place.write("scene.toml", scene);
        place.run(["check", "scene.toml"]).out
    };
    let says = "ball sinks ";
    let of_kind = |kind: &str, scene: &str| format!("contact_stiffness = {{ kind = \"{kind}\" }}\n{scene}");
    let said = format!("{scene}stiffness_n_per_m = 1000\n").replacen(
        "position_m = [0, -0.005, 0]",
        "position_m = [0, -0.005, 0]\nstiffness_n_per_m = 1000",
        1,
    );
    for soft in [of_kind("as-felt", scene), said.clone()] {
        assert!(rests_m(&soft) < -1.0 && checked(&soft).contains(says), "{}", checked(&soft));
    }
    for stiff in [scene.to_owned(), of_kind("by-mass", &said)] {
        assert!(!checked(&stiff).contains(says), "{}", checked(&stiff));
        let sunk_m = 0.04 - rests_m(&stiff);
        assert!((sunk_m - G / 1e6).abs() < 1e-9, "{sunk_m}");
    }
}
