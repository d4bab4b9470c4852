//! Output files beside one that is refused, fails, or is read no further: nothing of theirs is lost.

use super::{BALL, PRECIOUS, SCENE, assert_says, refused, with_recordings, workplace};
use std::fs;
use std::process::Command;
use system_tests::faults::scarcity::{mounted_twice, on_small_disk};
use system_tests::workplace::{Running, Workplace};

/// Of two devices, a tenth of a metre apart.
const PAIRS: &str = "0 0 0 0.1 0 0\n0.1 0 0 0.2 0 0\n0 0.1 0 0.1 0.1 0\n0 0 0.1 0.1 0 0.1\n";

/// A recording and its table, of more than a megabyte.
fn with_long_recording() -> (Workplace, Vec<u8>) {
    let place = workplace();
    let arguments =
        ["--clock", "virtual", "--seconds", "20", "--record", "long.mcap", "--record", "long.csv"];
    let said = place.run(["run", "scene.toml"].iter().chain(&arguments));
    assert_eq!(said.status, Some(0), "{}", said.err);
    let table = fs::read(place.path("long.csv")).expect("a table");
    (place, table)
}

fn is_whole_parquet(place: &Workplace, name: &str) -> bool {
    let bytes = fs::read(place.path(name)).unwrap_or_default();
    bytes.len() > 1000 && bytes.starts_with(b"PAR1") && bytes.ends_with(b"PAR1")
}

#[test]
fn a_reader_who_has_seen_enough_of_an_export_costs_the_other_tables_nothing() {
    let (place, table) = with_long_recording();
    let script = "{ \"$0\" export long.mcap all.csv all.parquet -; echo \"status $?\" >&2; } | head -n 1";
    let said = place.shell(script, &[]);
    assert_says(&said.err, &["status 0\n", "all.csv (20000 rows)", "all.parquet (20000 rows)"]);
    assert!(!said.err.contains("standard output ("), "a table that was not read is not told: {}", said.err);
    assert_eq!(said.out.lines().count(), 1);
    assert!(fs::read(place.path("all.csv")).expect("a table") == table);
    assert!(is_whole_parquet(&place, "all.parquet"));
}

#[test]
fn a_table_of_an_export_that_cannot_be_written_costs_the_others_nothing() {
    let (place, table) = with_long_recording();
    // The disk of the first is full; no file of the second may have a megabyte.
    for bad in ["/dev/full", "bad.csv"] {
        let script = "trap '' XFSZ; [ \"$1\" = /dev/full ] || ulimit -f 1000; \
            exec \"$0\" export long.mcap \"$4\" all.parquet";
        let said = place.shell(script, &["", bad]);
        let begins = bad == "bad.csv";
        assert_eq!(said.status, Some(if begins { 3 } else { 2 }), "{bad}: {}", said.err);
        assert_says(&said.err, &[bad]);
        assert_eq!(is_whole_parquet(&place, "all.parquet"), begins, "{bad}: {}", said.err);
        assert_eq!(said.out.contains("all.parquet (20000 rows)"), begins, "{}", said.out);
    }
    assert!(table.len() > 1 << 20, "longer than the limit: {}", table.len());
}

#[test]
fn a_table_of_an_export_that_cannot_be_made_leaves_the_others_as_they_were() {
    let place = workplace();
    with_recordings(&place);
    for bad in ["none/x.csv", "none/x.parquet", "/dev/full"] {
        let said = refused(&place, &["export", "good.mcap", "out.csv", "new.csv", bad]);
        assert_says(&said, &[bad]);
    }
    assert_eq!(fs::read_to_string(place.path("out.csv")).expect("a file"), PRECIOUS);
}

#[test]
fn recordings_of_later_scenes_never_take_the_name_of_another_output_or_of_an_input() {
    let place = workplace();
    place.write("next.toml", SCENE.replace("table", "ground"));
    place.write("orders.txt", "at 0.1 swap next.toml\nat 0.3 swap next.toml\n");
    // An input that is called as the second scene of `v.csv` would be.
    let hand = "t,f0_x,f0_y,f0_z\n0,0,0,0\n1,0,0,0\n";
    place.write("v.2.csv", hand);
    let said = place.run([
        "run",
        "scene.toml",
        "--clock",
        "virtual",
        "--seconds",
        "0.5",
        "--orders",
        "orders.txt",
        "--hand",
        "v.2.csv",
        "--record",
        "w.csv",
        "--record",
        "w.2.csv",
        "--record",
        "v.csv",
        "--record",
        "x.csv",
        "--events",
        "x.2.csv",
    ]);
    assert_eq!(said.status, Some(0), "{}", said.err);
    assert_eq!(fs::read_to_string(place.path("v.2.csv")).expect("the hand"), hand);
    let read =
        |name: &str| fs::read_to_string(place.path(name)).unwrap_or_else(|_| panic!("{name} is there"));
    assert!(
        read("w.2.csv").starts_with("t,") && read("w.2.csv") == read("w.csv"),
        "both are of the first scene"
    );
    assert!(read("x.2.csv").lines().any(|line| line.contains("scene")), "{}", read("x.2.csv"));
    // Of three scenes each recording has three files, and each file is told.
    let scenes = [
        ["w.csv", "w.3.csv", "w.4.csv"],
        ["w.2.csv", "w.2.2.csv", "w.2.3.csv"],
        ["v.csv", "v.3.csv", "v.4.csv"],
        ["x.csv", "x.3.csv", "x.4.csv"],
    ];
    for files in scenes {
        let rows = files.map(|file| read(file).lines().count() - 1);
        assert!(
            rows.iter().sum::<usize>() == 500 && rows.iter().all(|rows| *rows > 50),
            "{files:?}: {rows:?}"
        );
        assert_eq!(files.map(&read), scenes[0].map(&read), "the same three scenes");
        assert_says(&said.out, &files);
    }
}

/// A list of one ball, and the ball.
fn with_list(place: &Workplace) {
    place.write("objects.ini", "GameObject ball\n");
    place.write("ball.ini", BALL);
}

#[test]
fn a_scene_is_not_converted_onto_one_of_its_own_files() {
    let place = workplace();
    with_list(&place);
    for out in ["objects.ini", "ball.ini"] {
        let said = refused(&place, &["convert", "objects.ini", "--out", out]);
        assert_says(&said, &["--out", "would overwrite the input", out]);
    }
}

/// A picture of heights, 16 x 16 points.
fn height_map() -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 16, 16);
    encoder.set_color(png::ColorType::Grayscale);
    let mut writer = encoder.write_header().expect("memory");
    writer.write_image_data(&[7; 256]).expect("memory");
    writer.finish().expect("memory");
    bytes
}

/// A scene with a hand, an included file and a picture of heights in a directory of pictures.
fn with_everything(place: &Workplace, name: &str) {
    fs::create_dir_all(place.path("film")).expect("a directory");
    place.write("film/frame-000003.png", height_map());
    place.write(format!("{name}-room.toml"), "");
    place.write(format!("{name}-hand.csv"), "t,f0_x,f0_y,f0_z\n0,0,0,0\n1,0,0,0\n");
    let rough =
        "height_map = { file = \"film/frame-000003.png\", size_m = [0.1, 0.1], amplitude_m = 0.001 }\n";
    let head = format!("hand = \"{name}-hand.csv\"\ninclude = [\"{name}-room.toml\"]\n");
    place.write(format!("{name}.toml"), head + SCENE + rough);
}

#[test]
fn no_output_takes_the_place_of_a_file_that_the_run_its_settings_or_its_orders_name() {
    let place = workplace();
    with_everything(&place, "first");
    with_everything(&place, "second");
    place.write("keys.csv", "");
    place.write("settings.csv", "[input]\nbindings = \"keys.csv\"\n");
    place.write("orders.csv", "at 0.1 swap second.toml\n");
    // By another name of the same bytes.
    fs::hard_link(place.path("second-hand.csv"), place.path("linked.csv")).expect("a link");
    let run = ["run", "first.toml", "--clock", "virtual", "--seconds", "0.2", "--settings", "settings.csv"];
    let cases: [&[&str]; 9] = [
        &["--record", "first-hand.csv"],
        &["--record", "second-hand.csv"],
        &["--record", "linked.csv"],
        &["--events", "second-hand.csv"],
        &["--record", "settings.csv"],
        &["--record", "keys.csv"],
        &["--record", "orders.csv"],
        &["--snapshot", "0.1:film/frame-000003.png"],
        &["--frames", "film"],
    ];
    for outputs in cases {
        let arguments = [&run[..], &["--orders", "orders.csv"], outputs].concat();
        let said = refused(&place, &arguments);
        assert_says(&said, &[outputs[0], "would overwrite the input"]);
    }
    let said = refused(
        &place,
        &[&run[..], &["--frames", "new", "--snapshot", "0.1:./new/frame-000001.png"]].concat(),
    );
    assert_says(&said, &["--frames new", "would both write to", "frame-000001.png"]);
    std::os::unix::fs::symlink(".", place.path("here")).expect("a link");
    let said = refused(&place, &[&run[..], &["--record", "x.csv", "--record", "here/x.csv"]].concat());
    assert_says(&said, &["--record here/x.csv is given twice"]);
}

#[test]
fn a_plot_never_takes_the_place_of_a_recording_nor_that_of_objects_the_one_of_forces() {
    let place = workplace();
    with_recordings(&place);
    fs::rename(place.path("good.csv"), place.path("p.svg")).expect("our own");
    fs::copy(place.path("p.svg"), place.path("q.png")).expect("room");
    fs::create_dir(place.path("by")).expect("a directory");
    fs::copy(place.path("p.svg"), place.path("by/table.svg")).expect("room");
    for arguments in [
        &["plot", "p.svg", "--out", "p"][..],
        &["plot", "p.svg"],
        &["plot", "q.png"],
        &["plot", "good.mcap", "--against", "q.png", "--out", "q"],
    ] {
        let said = refused(&place, arguments);
        assert_says(&said, &["the picture", "would overwrite the input"]);
    }
    place.write("ball.toml", "[[finger]]\n[[entity]]\nname = \"ball\"\nshape = { kind = \"sphere\", radius_m = 0.02 }\nmass_kg = 1\n");
    let run = ["run", "ball.toml", "--clock", "virtual", "--seconds", "0.1", "--record", "b.csv"];
    assert_eq!(place.run(run).status, Some(0));
    assert_eq!(place.run(["plot", "b.csv"]).status, Some(0));
    let forces = ["b.svg", "b.png"].map(|name| fs::read(place.path(name)).expect("a picture"));
    let said = place.run(["plot", "b.csv", "--objects"]);
    assert_eq!(said.status, Some(0), "{}", said.err);
    assert!(said.out.contains("b-objects.svg, .png"), "{}", said.out);
    assert_eq!(["b.svg", "b.png"].map(|name| fs::read(place.path(name)).expect("a picture")), forces);
    assert!(place.path("b-objects.png").exists());
}

#[test]
fn a_model_that_is_sound_can_be_felt_also_where_it_cannot_be_written() {
    let place = workplace();
    place.write("cube.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
    let said = place.run(["check", "cube.obj", "--repair", "none/out.obj"]);
    assert_eq!(said.status, Some(3), "{}", said.err);
    assert!(
        said.out.contains("cube.obj: can be felt") && !said.out.contains("cannot be felt"),
        "{}",
        said.out
    );
    assert!(!said.out.contains("written"), "{}", said.out);
    assert_says(&said.err, &["cannot write none/out.obj: No such file", "the model itself can be felt"]);
    let said = place.run(["check", "cube.obj", "--repair", "none/out.obj", "--json"]);
    assert_eq!(said.status, Some(3));
    assert_says(&said.out, &["cannot write none/out.obj", "\"ok\": false", "\"written\": null", "\"mesh\""]);
}

/// As old Macintoshes wrote them: all commands that read tables say the same.
#[test]
fn a_table_whose_lines_end_in_carriage_returns_alone_is_refused_by_all_in_the_same_words() {
    let place = workplace();
    with_recordings(&place);
    let text = fs::read_to_string(place.path("good.csv")).expect("a table");
    place.write("mac.csv", text.replace('\n', "\r"));
    place.write("windows.csv", text.replace('\n', "\r\n"));
    place.write("mac-hand.csv", "t,f0_x,f0_y,f0_z\r0,0,0,0\r1,0,0,0\r");
    for command in [
        &["export", "mac.csv", "new.csv"][..],
        &["replay", "mac.csv", "--scene", "scene.toml"],
        &["plot", "mac.csv", "--out", "new"],
        &["run", "scene.toml", "--hand", "mac-hand.csv"],
    ] {
        assert_says(&refused(&place, command), &["its lines end in carriage returns alone", "save it"]);
    }
    let said = place.run(["plot", "windows.csv", "--svg-only"]);
    assert_eq!((said.status, said.err.as_str()), (Some(0), ""));
}

/// A result that cannot be written is a fault, of whichever command; full is the disk, not the name wrong.
#[test]
fn a_full_disk_ends_every_command_with_one_status_and_the_same_remedy() {
    let place = workplace();
    with_recordings(&place);
    place.write("pairs.csv", PAIRS);
    place.write("ball.ini", BALL);
    fs::create_dir(place.path("disk")).expect("a directory");
    let filled = "head -c 100000 /dev/zero > disk/all 2> /dev/null; exec \"$0\" \"$@\"";
    for (arguments, file) in [
        (&["convert", "ball.ini", "--out", "disk/out.toml"][..], "disk/out.toml"),
        (&["calibrate", "--pairs", "pairs.csv", "--write", "disk/layout.toml"], "disk/layout.toml"),
        (&["calibrate", "--pairs", "pairs.csv", "--plot", "disk/residuals.svg"], "disk/residuals.svg"),
        (&["plot", "good.csv", "--svg-only", "--out", "disk/out"], "disk/out.svg"),
    ] {
        let mut shell = Command::new("sh");
        shell.args(["-c", filled]).arg(place.phantom3().get_program()).args(arguments);
        let shell = place.prepare(shell);
        let Some(shell) = on_small_disk(&shell, &place.path("disk"), "size=16k") else { return };
        let said = Running::start(shell).wait();
        assert_eq!(said.status, Some(3), "{arguments:?}: {}{}", said.out, said.err);
        assert_says(&said.err, &[file, "No space left on device (os error 28); make room on that disk"]);
        assert!(!said.err.contains("can be written"), "{arguments:?}: {}", said.err);
    }
}

#[test]
fn a_file_of_events_that_a_full_disk_takes_not_is_called_so() {
    let place = workplace();
    fs::create_dir(place.path("disk")).expect("a directory");
    let filled = "head -c 100000 /dev/zero > disk/all 2> /dev/null; exec \"$0\" \"$@\"";
    let run = ["run", "scene.toml", "--clock", "virtual", "--seconds", "0.1", "--events", "disk/events.csv"];
    let mut shell = Command::new("sh");
    shell.args(["-c", filled]).arg(place.phantom3().get_program()).args(run);
    let Some(shell) = on_small_disk(&place.prepare(shell), &place.path("disk"), "size=16k") else { return };
    let said = Running::start(shell).wait();
    assert_says(&said.err, &["the file of events disk/events.csv: No space left on device"]);
    assert!(!said.err.contains("the recording"), "{}", said.err);
}

#[test]
fn help_and_version_that_are_lost_are_no_success() {
    let place = workplace();
    for arguments in ["run --help", "--version", "help", "driver --help"] {
        let script = format!("exec \"$0\" {arguments} > /dev/full");
        let said = place.shell(&script, &[]);
        assert_eq!(said.status, Some(3), "{arguments}: {}", said.err);
        assert_says(&said.err, &["cannot write the standard output: No space left on device"]);
        let said = place.shell(&format!("\"$0\" {arguments} | true; exec \"$0\" {arguments}"), &[]);
        assert_eq!((said.status, said.err.as_str()), (Some(0), ""), "{arguments}");
    }
}

/// A slash says that it is a directory.
#[test]
fn a_picture_into_a_directory_is_called_as_the_recording() {
    let place = workplace();
    with_recordings(&place);
    fs::create_dir(place.path("pictures")).expect("a directory");
    let said = place.run(["plot", "good.csv", "--svg-only", "--out", "pictures/"]);
    assert_eq!((said.status, said.err.as_str()), (Some(0), ""), "{}", said.out);
    assert!(place.path("pictures/good.svg").exists() && !place.path("pictures/.svg").exists());
    assert_says(
        &refused(&place, &["plot", "good.csv", "--out", "none/"]),
        &["cannot write pictures into none"],
    );
}

/// A shell leads a standard stream into a file that is read or written, too.
#[test]
fn no_standard_stream_is_a_file_that_is_read_or_written_besides() {
    let place = workplace();
    with_recordings(&place);
    place.write("orders.csv", "at 0.1 reset\n");
    with_list(&place);
    place.write("pairs.csv", PAIRS);
    let run = "run scene.toml --clock virtual --seconds 0.1";
    let live = "run scene.toml --clock lockstep --seconds 0.1 --orders -";
    let calibrate = "calibrate --pairs pairs.csv";
    place.write("p.svg", PRECIOUS);
    place.write("phantom3-demo.csv", PRECIOUS);
    let cases = [
        ("good.mcap", "export good.mcap - 1<>good.mcap".to_owned(), "the standard output would overwrite"),
        ("good.mcap", "export good.mcap /dev/stdout >>good.mcap".to_owned(), "would overwrite the input"),
        ("scene.toml", format!("{run} --record - >>scene.toml"), "the standard output would overwrite"),
        ("scene.toml", format!("{run} >>scene.toml"), "the standard output would overwrite"),
        ("out.csv", format!("{run} --record out.csv --record - >>out.csv"), "the standard output goes to"),
        ("out.csv", format!("{run} --record out.csv >>out.csv"), "the standard output goes to"),
        ("out.csv", format!("{run} --events out.csv 1<>out.csv"), "the standard output goes to"),
        ("orders.csv", format!("{live} --record orders.csv <orders.csv"), "the standard input comes from"),
        ("orders.csv", format!("{live} --record - <orders.csv >>orders.csv"), "would overwrite the input -"),
        ("objects.ini", "convert objects.ini >>objects.ini".into(), "the standard output would overwrite"),
        ("ball.ini", "convert objects.ini >>ball.ini".into(), "the standard output would overwrite"),
        ("pairs.csv", format!("{calibrate} >>pairs.csv"), "the standard output would overwrite the input"),
        ("out.csv", format!("{calibrate} --json --write out.csv >>out.csv"), "the standard output goes to"),
        (
            "p.svg",
            format!("{calibrate} --plot p.svg 1<>p.svg"),
            "--plot p.svg is the file that the standard output",
        ),
        ("phantom3-demo.csv", "--headless >>phantom3-demo.csv".into(), "the standard output goes to"),
    ];
    for (file, command, words) in cases {
        let before = fs::read(place.path(file)).expect("a file");
        let mut shell = Command::new("sh");
        shell.args(["-c", &format!("\"$0\" {command}")]).arg(place.phantom3().get_program());
        let said = Running::start(place.prepare(shell)).wait();
        assert_eq!(said.status, Some(2), "{command}: {}", said.err);
        assert_says(&said.err, &[words]);
        assert!(fs::read(place.path(file)).expect("a file") == before, "{command}");
    }
}

#[test]
fn a_layout_and_a_figure_whose_links_lead_to_one_place_are_refused() {
    let place = workplace();
    place.write("pairs.csv", PAIRS);
    std::os::unix::fs::symlink("h.svg", place.path("h.toml")).expect("a link");
    let arguments = ["calibrate", "--pairs", "pairs.csv", "--write", "h.toml", "--plot", "h.svg"];
    let said = place.run(arguments);
    assert_eq!(said.status, Some(2), "{}", said.err);
    assert_says(&said.err, &["--write and --plot name the same file"]);
    assert!(!place.path("h.svg").exists());
}

#[test]
fn recordings_of_later_scenes_are_written_through_no_link_and_over_no_other_file() {
    let place = workplace();
    place.write("next.toml", SCENE.replace("table", "ground"));
    place.write("orders.txt", "at 0.1 swap next.toml\n");
    place.write("precious.csv", PRECIOUS);
    place.write("p.2.csv", PRECIOUS);
    place.write("linked.csv", "t,f0_hip_x\n0,0\n");
    std::os::unix::fs::symlink("linked.csv", place.path("s.2.csv")).expect("a link");
    fs::hard_link(place.path("linked.csv"), place.path("h.2.csv")).expect("a link");
    let run = ["run", "scene.toml", "--clock", "virtual", "--seconds", "0.3", "--orders", "orders.txt"];
    let records = ["--record", "s.csv", "--record", "h.csv", "--record", "p.csv", "--record", "plain.csv"];
    // A rerun writes the same files again.
    for _ in 0..2 {
        let said = place.run([&run[..], &records].concat());
        assert_eq!(said.status, Some(0), "{}", said.err);
        let read =
            |name: &str| fs::read_to_string(place.path(name)).unwrap_or_else(|_| panic!("{name} is there"));
        assert_eq!(read("linked.csv"), "t,f0_hip_x\n0,0\n");
        assert_eq!(read("p.2.csv"), PRECIOUS);
        for name in ["s.3.csv", "h.3.csv", "p.3.csv"] {
            assert_eq!(read(name), read("plain.2.csv"), "{name}");
            assert_says(&said.out, &[name]);
        }
        assert!(
            ["s.4.csv", "h.4.csv", "p.4.csv", "plain.3.csv"].iter().all(|name| !place.path(name).exists())
        );
    }
}

#[test]
fn the_recording_of_a_later_scene_that_cannot_be_made_is_the_one_that_is_told() {
    let place = workplace();
    place.write("next.toml", SCENE.replace("table", "ground"));
    place.write("orders.txt", "at 0.1 swap next.toml\n");
    // As long as a name may be: there is no room for a number.
    let stem = "o".repeat(251);
    let out = format!("{stem}.csv");
    let run = ["run", "scene.toml", "--clock", "virtual", "--seconds", "0.3", "--orders", "orders.txt"];
    let said = place.run([&run[..], &["--record", &out, "--record", "other.csv"]].concat());
    assert_eq!(said.status, Some(3), "{}", said.err);
    assert_says(&said.err, &[&format!("{stem}.2.csv: File name too long")]);
    assert_says(&said.out, &[&format!("{stem}.2.csv (0 rows) NOT COMPLETE")]);
    for name in [&*out, "other.csv", "other.2.csv"] {
        let line = said.out.lines().find(|line| line.contains(&format!(" {name} (")));
        let line = line.unwrap_or_else(|| panic!("{name}: {}", said.out));
        assert!(!line.contains("NOT") && !line.contains("(0 rows)"), "{line}");
    }
}

/// A directory that is mounted twice gives each of its files two names, also those that are still to be made.
#[test]
fn outputs_that_are_one_file_over_two_mounts_are_told_so() {
    let place = workplace();
    for name in ["one", "two"] {
        fs::create_dir(place.path(name)).expect("room");
    }
    let run = ["run", "scene.toml", "--clock", "virtual", "--seconds", "0.1"];
    let cases: [(&[&str], &str); 3] = [
        (&["--record", "one/o.csv", "--record", "two/o.csv"], "--record two/o.csv is given twice"),
        (
            &["--record", "one/o.csv", "--events", "two/o.csv"],
            "--record one/o.csv and --events two/o.csv would both",
        ),
        (&["--frames", "one", "--snapshot", "0.05:two/frame-000001.png"], "would both write to"),
    ];
    for (outputs, words) in cases {
        let mut program = place.phantom3();
        program.args(run).args(outputs);
        let Some(program) = mounted_twice(&program, &place.path("one"), &place.path("two")) else { return };
        let before = place.snapshot();
        let said = Running::start(program).wait();
        assert_eq!(said.status, Some(2), "{outputs:?}: {}", said.err);
        assert_says(&said.err, &[words, "each needs a file of its own"]);
        assert!(place.snapshot() == before, "{outputs:?}: {}", said.err);
    }
}
