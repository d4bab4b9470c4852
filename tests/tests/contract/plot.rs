//! `phantom3 plot`: recordings become pictures, and what is wrong is told.

use system_tests::workplace::Workplace;

const SCENE: &str = "\
[[entity]]
name = \"table\"
shape = { kind = \"plane\", normal = [0.0, 1.0, 0.0], offset_m = 0.0 }
friction = { model = \"coulomb\", mu = MU }
[[finger]]
start_m = [0.0, 0.01, 0.0]
";

/// Down to 2 mm under the table and 40 mm along it.
const HAND: &str = "t,f0_x,f0_y,f0_z\n0,0,0.01,0\n0.2,0,-0.002,0\n0.6,0.04,-0.002,0\n0.8,0.04,0.01,0\n";

fn recorded(place: &Workplace, name: &str, mu: f64) {
    place.write(format!("{name}.toml"), SCENE.replace("MU", &mu.to_string()));
    place.write("hand.csv", HAND);
    let (scene, csv) = (format!("{name}.toml"), format!("{name}.csv"));
    let said = place.run(["run", &scene, "--hand", "hand.csv", "--clock", "virtual", "--record", &csv]);
    assert_eq!(said.status, Some(0), "{}", said.err);
}

#[test]
fn a_recording_and_another_one_become_a_picture_per_entity() {
    let place = Workplace::new();
    recorded(&place, "rough", 0.5);
    recorded(&place, "smooth", 0.1);
    let said =
        place.run(["plot", "rough.csv", "--against", "smooth.csv", "--by-entity", "--out", "pictures"]);
    assert_eq!(said.status, Some(0), "{}", said.err);
    let svg = std::fs::read_to_string(place.path("pictures/table.svg")).expect("a picture");
    // Force along the motion and along the normal, in both; nothing acts across. The legend is text.
    for word in ["table", ">x<", ">y<", ">x, smooth<", ">y, smooth<", "way of the finger (mm)"] {
        assert!(svg.replace("\n", "").contains(word), "no {word} in {svg}");
    }
    assert!(!svg.replace("\n", "").contains(">z<"), "what is always zero is not drawn");
    let png = std::fs::read(place.path("pictures/table.png")).expect("a picture");
    assert_eq!(png[1..4], *b"PNG");
    // Who names the file with its ending gets that file.
    assert_eq!(place.run(["plot", "rough.csv", "--svg-only", "--out", "named.svg"]).status, Some(0));
    assert!(place.path("named.svg").exists() && !place.path("named.svg.svg").exists());
    let again = place.run(["plot", "rough.csv", "--from", "0.3", "--to", "0.5", "--svg-only"]);
    assert_eq!(again.status, Some(0), "{}", again.err);
    let svg = std::fs::read_to_string(place.path("rough.svg")).expect("beside the recording");
    assert!(svg.contains("time (s)"));
    assert!(!place.path("rough.png").exists());
}

#[test]
fn what_moves_is_drawn_with_its_way_and_its_turn() {
    let place = Workplace::new();
    place.write("drop.toml", "[[finger]]\n[[entity]]\nname = \"ball\"\nshape = { kind = \"sphere\", radius_m = 0.02 }\nmass_kg = 1\n");
    let said =
        place.run(["run", "drop.toml", "--clock", "virtual", "--seconds", "0.1", "--record", "drop.csv"]);
    assert_eq!(said.status, Some(0), "{}", said.err);
    let said = place.run(["plot", "drop.csv", "--objects", "--svg-only"]);
    assert_eq!(said.status, Some(0), "{}", said.err);
    let svg = std::fs::read_to_string(place.path("drop-objects.svg")).expect("a picture").replace('\n', "");
    for word in ["ball", ">y<", "moved (mm)", "turned (deg)", "time (s)"] {
        assert!(svg.contains(word), "no {word} in {svg}");
    }
    // All in one panel, of what is asked for.
    for (what, quantity, other) in
        [("moved", "moved along y (mm)", "turned"), ("turned", "turned (deg)", "moved")]
    {
        let said =
            place.run(["plot", "drop.csv", "--objects", "--together", what, "--svg-only", "--out", what]);
        assert_eq!(said.status, Some(0), "{}", said.err);
        let svg =
            std::fs::read_to_string(place.path(format!("{what}.svg"))).expect("a picture").replace('\n', "");
        assert!(
            svg.contains(quantity) && svg.contains("ball") && !svg.contains(&format!("{other} (")),
            "{svg}"
        );
    }
    assert_eq!(place.run(["plot", "drop.csv", "--together", "moved"]).status, Some(2), "of objects only");
    recorded(&place, "rough", 0.5);
    let said = place.run(["plot", "rough.csv", "--objects"]);
    assert_eq!(said.status, Some(2));
    assert!(said.err.contains("nothing moves in this recording"), "{}", said.err);
}

#[test]
fn a_recording_looks_the_same_in_every_format_and_as_far_as_it_is_whole() {
    let place = Workplace::new();
    recorded(&place, "rough", 0.5);
    let run = ["run", "rough.toml", "--hand", "hand.csv", "--clock", "virtual", "--record", "all.mcap"];
    assert_eq!(place.run(run).status, Some(0));
    assert_eq!(place.run(["export", "all.mcap", "columns.parquet"]).status, Some(0));
    std::fs::copy(place.path("all.mcap"), place.path("renamed.dat")).expect("a copy");
    let drawn = |recording: &str| {
        let said = place.run(["plot", recording, "--svg-only", "--out", "picture"]);
        assert_eq!((said.status, said.err.as_str()), (Some(0), ""), "{recording}");
        std::fs::read(place.path("picture.svg")).expect("a picture")
    };
    let table = drawn("rough.csv");
    for recording in ["all.mcap", "columns.parquet", "renamed.dat"] {
        assert!(drawn(recording) == table, "{recording}");
    }
    // A killed process leaves half a row.
    let whole = std::fs::read(place.path("rough.csv")).expect("a table");
    place.write("cut.csv", &whole[..whole.len() - 3]);
    let said = place.run(["plot", "cut.csv", "--svg-only"]);
    assert_eq!(said.status, Some(0), "{}", said.err);
    assert!(
        said.err.contains("cut.csv: the last row is not complete and is left out; 999 rows are drawn"),
        "{}",
        said.err
    );
}

#[test]
fn what_cannot_be_drawn_is_told_with_the_file_and_what_there_is() {
    let place = Workplace::new();
    recorded(&place, "rough", 0.5);
    place.write(
        "free.csv",
        "t,f0_hip_x,f0_hip_y,f0_hip_z,f0_force_x,f0_force_y,f0_force_z,f0_entity\n0,0,0,0,0,0,0,\n",
    );
    for (arguments, says) in [
        (&["plot", "nowhere.csv"][..], "nowhere.csv"),
        (&["plot", "rough.toml"], "is this a recording"),
        (&["plot", "rough.csv", "--finger", "thumb"], "there are: f0"),
        (&["plot", "rough.csv", "--from", "7"], "it lasts from 0 s to"),
        (&["plot", "rough.csv", "--from", "-2", "--to", "-1"], "no row between -2 s and -1 s"),
        (&["plot", "rough.csv", "--out", "none/x"], "cannot write pictures into none: No such file"),
        (&["plot", "rough.csv", "--against", "hand.csv"], "hand.csv: no column f0_hip_x"),
        (&["plot", "free.csv", "--by-entity"], "touches nothing"),
        (&["plot", "rough.csv", "--by-entity", "--out", "rough.csv"], "cannot make the directory rough.csv"),
    ] {
        let said = place.run(arguments);
        assert_eq!(said.status, Some(2), "{arguments:?}: {}", said.err);
        assert!(said.err.contains(says), "{arguments:?}: {}", said.err);
    }
}

#[test]
fn pictures_of_entities_lie_in_their_directory_whatever_a_recording_calls_them() {
    let place = Workplace::new();
    let away = place.path("away");
    let names = [away.to_str().expect("plain"), "../away", "..", "entity-1", "a b", "", "ball"];
    let header = "t,f0_hip_x,f0_hip_y,f0_hip_z,f0_force_x,f0_force_y,f0_force_z,f0_entity\n";
    let row = |(index, name): (usize, &&str)| format!("{index},0,0,0,0,1,0,{name}\n");
    place.write("led.csv", names.iter().enumerate().map(row).fold(header.to_owned(), |all, row| all + &row));
    let said = place.run(["plot", "led.csv", "--by-entity", "--svg-only", "--out", "pictures"]);
    assert_eq!(said.status, Some(0), "{}", said.err);
    let files: Vec<String> = place
        .snapshot()
        .into_keys()
        .filter(|file| file.extension().is_some_and(|ending| ending == "svg"))
        .map(|file| file.strip_prefix(place.path("")).expect("inside").display().to_string())
        .collect();
    let expected = ["ball", "entity-1", "entity-2", "entity-3", "entity-4", "entity-5"];
    assert_eq!(files, expected.map(|name| format!("pictures/{name}.svg")));
    let title = std::fs::read_to_string(place.path("pictures/entity-3.svg")).expect("a picture");
    assert!(title.contains("../away"), "it is called by its name in the picture: {title}");
}

#[test]
fn a_picture_replaces_earlier_charts_alone_and_tells_it() {
    let place = Workplace::new();
    recorded(&place, "lift", 0.5);
    // A height map that is called as the picture would be: 2 x 2, flat.
    let mut heights = Vec::new();
    let mut encoder = png::Encoder::new(&mut heights, 2, 2);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.write_header().and_then(|mut writer| writer.write_image_data(&[9; 4])).expect("a picture");
    std::fs::write(place.path("lift.png"), &heights).expect("room");
    let map = "height_map = { file = \"lift.png\", amplitude_m = 0.001, size_m = [0.5, 0.5] }\n[[finger]]";
    place.write("lift.toml", SCENE.replace("MU", "0.5").replace("[[finger]]", map));
    let said =
        place.run(["run", "lift.toml", "--hand", "hand.csv", "--clock", "virtual", "--record", "lift.mcap"]);
    assert_eq!(said.status, Some(0), "{}", said.err);
    assert_eq!(place.run(["export", "lift.mcap", "lift.csv"]).status, Some(0));
    std::fs::create_dir(place.path("made.png")).expect("room");
    for (arguments, says) in [
        (
            &["plot", "lift.mcap"][..],
            "lift.png would take the place of a file that is not known as a chart of this program",
        ),
        (
            &["plot", "lift.csv"],
            "lift.png would take the place of a file that is not known as a chart of this program",
        ),
        (&["plot", "lift.csv", "--out", "made"], "made.png would take the place of a directory"),
    ] {
        let said = place.run(arguments);
        assert_eq!(said.status, Some(2), "{arguments:?}: {}", said.err);
        assert!(said.err.contains(says), "{arguments:?}: {}", said.err);
    }
    assert_eq!(std::fs::read(place.path("lift.png")).expect("there"), heights);
    assert!(
        !["lift.svg", "made.svg"].map(|file| place.path(file).exists()).contains(&true),
        "nothing is written"
    );

    let first = place.run(["plot", "lift.mcap", "--out", "felt"]);
    assert_eq!(
        (first.status, first.out.contains("replaced")),
        (Some(0), false),
        "{}{}",
        first.out,
        first.err
    );
    let again = place.run(["plot", "lift.mcap", "--out", "felt"]);
    assert_eq!(again.status, Some(0), "{}", again.err);
    assert!(again.out.contains("replaced     felt.svg\nreplaced     felt.png\n"), "{}", again.out);
}
