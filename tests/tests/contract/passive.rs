//! `passivity` of a finger: what a scene says of it reaches the fingers, the recording tells the energy, and a wall that
//! buzzes is quiet.

use nalgebra::Vector3;
use system_tests::recording::Table;
use system_tests::workplace::{Workplace, hand};

/// A table at the height of 0.1 m of this stiffness (N/m), for a finger with this key.
fn scene(stiffness: f64, passivity: &str) -> String {
    format!(
        "[[finger]]\nstart_m = [0.0, 0.1, 0.0]\n{passivity}\n[[entity]]\nname = \"table\"\n\
         shape = {{ kind = \"plane\", normal = [0.0, 1.0, 0.0], offset_m = 0.1 }}\nstiffness_n_per_m = {stiffness:?}\n"
    )
}

/// From 10 mm above to 20 mm below, as the hand wants it.
fn pressing() -> String {
    hand([(0.0, [0.0, 0.11, 0.0]), (0.5, [0.0, 0.11, 0.0]), (0.7, [0.0, 0.08, 0.0]), (4.0, [0.0, 0.08, 0.0])])
}

fn record(scene: &str, hand: &str, more: &[&str]) -> Table {
    let place = Workplace::new();
    place.write("scene.toml", scene);
    place.write("hand.csv", hand);
    let usual = ["run", "scene.toml", "--headless", "--hand", "hand.csv", "--record", "out.csv"];
    let said = place.run(usual.iter().chain(more));
    assert_eq!(said.status, Some(0), "{}", said.err);
    Table::read(&place.path("out.csv"))
}

const HELD_LIGHTLY: [&str; 6] = ["--hand-mode", "impedance", "--clock", "virtual", "--firmness", "light"];

/// What the motors' force fed into the hand from row to row (J), from the recording alone.
fn fed(table: &Table) -> Vec<f64> {
    let (hip, applied) = (table.vectors("f0_hip"), table.vectors("f0_applied"));
    (1..table.len()).map(|k| applied[k - 1].dot(&(hip[k] - hip[k - 1]))).collect()
}

/// How much the tip moves, and the force changes, from the third second on (m, N).
fn ripple(table: &Table) -> (f64, f64) {
    let (t, hip, force) = (table.numbers("t"), table.vectors("f0_hip"), table.vectors("f0_force"));
    let span = |of: &dyn Fn(usize) -> f64| {
        let late = || (0..t.len()).filter(|&k| t[k] > 3.0).map(of);
        late().fold(f64::NEG_INFINITY, f64::max) - late().fold(f64::INFINITY, f64::min)
    };
    (span(&|k| hip[k].y), span(&|k| force[k].y))
}

#[test]
fn a_wall_that_buzzes_by_newtons_is_quiet_under_a_finger_that_is_kept_passive() {
    for stiffness in [8000.0, 16_000.0] {
        let bare = record(&scene(stiffness, ""), &pressing(), &HELD_LIGHTLY);
        let kept = record(&scene(stiffness, "passivity = true"), &pressing(), &HELD_LIGHTLY);
        let ((bare_m, bare_n), (kept_m, kept_n)) = (ripple(&bare), ripple(&kept));
        println!("{stiffness} N/m: {bare_m} m {bare_n} N, kept {kept_m} m {kept_n} N");
        assert!(bare_m > 0.8e-3 && bare_n > 3.0, "it buzzes: {bare_m} {bare_n}");
        // Two counts are 0.06 mm; the hand trembles by that, too.
        assert!(kept_m < 0.1e-3 && kept_n < 1.0, "{kept_m} {kept_n}");
        let most = |table: &Table| {
            let sum = |sum: &mut f64, fed: f64| {
                *sum += fed;
                Some(*sum)
            };
            fed(table).into_iter().scan(0.0, sum).fold(0.0, f64::max)
        };
        let (most_bare, most_kept) = (most(&bare), most(&kept));
        // At 1 kHz the bound is 8.5 N * 0.254 mm, the recovery of 4 s 0.4 of it, and 60 mm of 0.04 N are on top.
        assert!(most_bare > 20e-3 && most_kept < 2.16e-3 * 1.4 + 2.4e-3, "{most_bare} {most_kept}");
    }
}

/// From 10 mm above to 5 mm below, and then to and fro at 50 mm/s or not.
fn stroking(is_stroked: bool) -> String {
    let side = |at: usize| if is_stroked && at % 2 == 1 { 0.05 } else { 0.0 };
    let strokes = (0..4).map(|at| (1.0 + at as f64, [side(at), 0.095, 0.0]));
    hand([(0.0, [0.0, 0.11, 0.0]), (0.5, [0.0, 0.095, 0.0])].into_iter().chain(strokes))
}

/// How much the motors' force along the normal differs from its mean over 50 ms, in the mean square (N).
fn buzz(table: &Table) -> f64 {
    let (t, applied) = (table.numbers("t"), table.vectors("f0_applied"));
    let late: Vec<f64> = (0..t.len()).filter(|&k| t[k] > 1.5).map(|k| applied[k].y).collect();
    let squares = late.chunks_exact(50).map(|part| {
        let mean = part.iter().sum::<f64>() / 50.0;
        part.iter().map(|force| (force - mean).powi(2)).sum::<f64>() / 50.0
    });
    let squares: Vec<f64> = squares.collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

/// What the hand puts into sliding does not pay for what buzzes along the normal.
#[test]
fn a_rough_stiff_wall_is_as_quiet_when_it_is_stroked_as_when_it_is_pressed() {
    println!("N/mm  friction  pressed, bare and kept   stroked, bare and kept (N)");
    for (stiffness, mu) in [(10_000.0, 0.8), (20_000.0, 0.3), (20_000.0, 0.8), (50_000.0, 0.8)] {
        let rough = |passivity: &str| {
            let friction = format!("friction = {{ model = \"coulomb\", mu = {mu:?} }}\n");
            scene(stiffness, passivity) + &friction
        };
        let more = ["--hand-mode", "impedance", "--clock", "virtual"];
        let [pressed, stroked] = [false, true].map(|is_stroked| {
            ["", "passivity = true"]
                .map(|passivity| buzz(&record(&rough(passivity), &stroking(is_stroked), &more)))
        });
        println!(
            "{:>4}  {mu:>8}  {:>14.2} {:>8.2} {:>15.2} {:>8.2}",
            stiffness / 1000.0,
            pressed[0],
            pressed[1],
            stroked[0],
            stroked[1]
        );
        // A count of 0.03 mm along the normal is 0.6 N of 20 N/mm; the hand's own tremor is a part of what is left.
        assert!(stroked[1] < 0.15 && pressed[1] < 0.15, "{pressed:?} {stroked:?}");
        assert!(stiffness < 20_000.0 || (stroked[0] > 0.5 && pressed[0] > 0.5), "{pressed:?} {stroked:?}");
    }
}

#[test]
fn what_the_recording_says_of_energy_is_the_sum_over_its_own_rows() {
    let table = record(&scene(8000.0, "passivity = true"), &pressing(), &HELD_LIGHTLY);
    let energy = table.numbers("f0_energy");
    for (k, fed) in fed(&table).into_iter().enumerate() {
        // Differences of a sum of some millijoules.
        assert!((energy[k + 1] - energy[k] - fed).abs() < 1e-15, "row {k}");
    }
    assert!(energy.iter().any(|energy| energy.abs() > 1e-3), "something was fed or taken");
    let controlled = table.numbers("f0_controlled");
    assert!(controlled.iter().any(|change| *change > 0.5), "it had to act");
}

#[test]
fn an_ordinary_wall_is_rendered_to_the_bit_as_without_and_only_the_columns_are_new() {
    let path = hand([
        (0.0, [0.0, 0.11, 0.0]),
        (0.5, [0.0, 0.097, 0.0]),
        (1.0, [0.02, 0.097, 0.0]),
        (1.5, [0.02, 0.11, 0.0]),
    ]);
    for mode in [&HELD_LIGHTLY[..], &["--clock", "virtual"]] {
        let bare = record(&scene(1000.0, "passivity = false"), &path, mode);
        let kept = record(&scene(1000.0, "passivity = true"), &path, mode);
        let [columns, with_energy] = [bare.columns(), kept.columns()];
        assert_eq!(with_energy[..columns.len()], columns[..]);
        assert_eq!(with_energy[columns.len()..], ["f0_energy", "f0_controlled"]);
        for (row, with_energy) in bare.rows().iter().zip(kept.rows()) {
            assert_eq!(with_energy[..row.len()], row[..]);
        }
        assert!(kept.numbers("f0_controlled").iter().all(|change| *change == 0.0));
        assert!(kept.vectors("f0_force").iter().any(|force| force.y > 0.05), "it was felt");
    }
}

/// Kinematic, so that the energies are those of the script: 3 mm in and out at 20 mm/s leak k h d = 60 uJ, of which a
/// bound of 1 uJ without payments leaves nothing.
#[test]
fn the_numbers_of_the_scene_reach_the_finger() {
    let path = hand([(0.0, [0.0, 0.101, 0.0]), (0.2, [0.0, 0.097, 0.0]), (0.4, [0.0, 0.101, 0.0])]);
    let clock = ["--clock", "virtual", "--seconds", "0.5"];
    let energy = |passivity: &str| {
        let table = record(&scene(1000.0, passivity), &path, &clock);
        table.numbers("f0_energy").into_iter().fold(0.0, f64::max)
    };
    let strict = "passivity = { bound_j = 1e-6, recovery_w = 0.0, device_friction_n = 0.0, resolution_m = 0.0, \
                  acceleration_m_per_s2 = 40.0 }";
    // k h^2 n, with h = 20 um and 149 or 150 of these inside: where the path crosses the surface a step is cut.
    let leak = 1000.0 * 2e-5 * 3e-3;
    let usual = energy("passivity = true");
    assert!((0.98 * leak..1.02 * leak).contains(&usual), "{usual} {leak}");
    // The turn changes the way of a tick by 40 um, which are 40 m/s^2 at 1 kHz: nothing surprises it.
    let kept = energy(strict);
    assert!(kept <= 1e-6 + 1e-12, "{kept}");
    let paid = energy(&strict.replace("recovery_w = 0.0", "recovery_w = 1e-3"));
    // Credit lasts to the last k d^2 / 2 = 60 uJ, 0.35 mm or 17 ms below the surface; debts are paid from there on, and
    // count while there is a force left that could make new ones.
    assert!(paid > kept + 2e-6, "1 mW for some milliseconds: {paid}");
    let rubbed = energy(&strict.replace("device_friction_n = 0.0", "device_friction_n = 0.01"));
    assert!(rubbed > kept + 1e-6, "10 mN over some tenths of a millimetre: {rubbed}");
}

#[test]
fn fingers_without_it_are_told_nothing_of() {
    let two = format!("[[finger]]\n{}", scene(1000.0, "passivity = true"));
    let place = Workplace::new();
    place.write("scene.toml", two);
    let usual =
        ["run", "scene.toml", "--headless", "--clock", "virtual", "--record", "out.csv", "--seconds", "0.1"];
    assert_eq!(place.run(usual).status, Some(0));
    let table = Table::read(&place.path("out.csv"));
    assert!(table.columns().iter().any(|column| column == "f1_energy"));
    assert!(!table.columns().iter().any(|column| column == "f0_energy"));
    assert_eq!(table.vectors("f1_hip")[0], Vector3::new(0.0, 0.1, 0.0));
}

#[test]
fn what_is_wrong_is_told_with_line_and_key() {
    let place = Workplace::new();
    for (value, words) in [
        ("3", "finger[0].passivity: found 3; allowed: true, false, or a table such as { bound_j = 0.002 }"),
        ("{ bound_j = 0 }", "finger[0].passivity.bound_j: found 0; allowed: a number above 0"),
        ("{ bound = 1.0 }", "finger[0].passivity.bound"),
        ("{ recovery_w = -1.0 }", "finger[0].passivity.recovery_w: found -1.0; allowed: a number, 0 or more"),
    ] {
        place.write("scene.toml", scene(1000.0, &format!("passivity = {value}")));
        let said = place.run(["run", "scene.toml", "--clock", "virtual"]);
        assert_eq!(said.status, Some(2), "{value}: {}", said.err);
        assert!(said.err.contains("scene.toml:3: ") && said.err.contains(words), "{value}: {}", said.err);
    }
}
