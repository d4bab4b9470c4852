//! `run --snapshot` and `--frames`: pictures of a run, where the machine has a graphics library; where it has none the run
//! says what is missing and goes on.

use nalgebra::{Point3, Vector3};
use system_tests::workplace::{Said, Workplace};

/// A ball that falls past a finger, before a camera that looks along -z.
const SCENE: &str = "\
[[finger]]
start_m = [0.0, 0.0, 0.0]
[[entity]]
name = \"ball\"
shape = { kind = \"sphere\", radius_m = 0.02 }
position_m = [0.05, 0.1, 0.0]
mass_kg = 0.1
visual = { colour = [0.8, 0.1, 0.1] }
[[camera]]
name = \"front\"
position_m = [0.0, 0.0, 0.5]
field_of_view_deg = 40.0
";

/// The run's own words where pictures cannot be had here.
pub(crate) fn are_missing(said: &Said) -> bool {
    let missing = said.err.lines().find(|line| line.contains("no pictures: "));
    if let Some(missing) = missing {
        println!("skipped: {missing}");
        assert!(missing.contains("apt install libegl1"), "it says what to install: {missing}");
    }
    missing.is_some()
}

fn place() -> Workplace {
    let place = Workplace::new();
    place.write("scene.toml", SCENE);
    place
}

/// Width and height as a PNG's header has them.
fn size(png: &[u8]) -> [u32; 2] {
    assert_eq!(png[1..4], *b"PNG");
    [16, 20].map(|at| u32::from_be_bytes(png[at..at + 4].try_into().expect("four bytes")))
}

#[test]
fn moments_are_drawn_while_the_run_is_what_it_was() {
    let place = place();
    let plain = ["run", "scene.toml", "--clock", "virtual", "--seconds", "0.2", "--record", "plain.csv"];
    assert_eq!(place.run(plain).status, Some(0));
    let said = place.run([
        "run",
        "scene.toml",
        "--clock",
        "virtual",
        "--seconds",
        "0.2",
        "--record",
        "drawn.csv",
        "--headless",
        "--snapshot",
        "0:first.png",
        "--snapshot",
        "0.15:later.png",
        "--snapshot",
        "9:never.png",
        "--picture-size",
        "320x240",
        "--camera",
        "front",
    ]);
    assert_eq!(said.status, Some(0), "{}", said.err);
    let read = |name: &str| std::fs::read(place.path(name)).expect(name);
    assert_eq!(read("plain.csv"), read("drawn.csv"), "pictures change nothing");
    if are_missing(&said) {
        return;
    }
    assert!(
        said.out.contains("pictures     2, drawn by ") && said.out.contains("1 NOT TAKEN"),
        "{}",
        said.out
    );
    let (first, later) = (read("first.png"), read("later.png"));
    assert_eq!([size(&first), size(&later)], [[320, 240]; 2]);
    assert_ne!(first, later, "it has fallen by 0.11 m");
    assert!(!place.path("never.png").exists());
}

#[test]
fn a_film_has_a_picture_for_each_of_its_moments() {
    let place = place();
    let said = place.run([
        "run",
        "scene.toml",
        "--clock",
        "virtual",
        "--seconds",
        "0.2",
        "--frames",
        "film",
        "--fps",
        "50",
        "--picture-size",
        "64x48",
    ]);
    if are_missing(&said) {
        return;
    }
    assert_eq!(said.status, Some(0), "{}", said.err);
    // At 0, 0.02, ... 0.18 s.
    let mut frames: Vec<_> = std::fs::read_dir(place.path("film"))
        .expect("a directory")
        .map(|entry| entry.expect("an entry").file_name().into_string().expect("a name"))
        .collect();
    frames.sort();
    assert_eq!(frames, (0..10).map(|frame| format!("frame-{frame:06}.png")).collect::<Vec<_>>());
}

#[test]
fn a_film_ends_links_in_its_directory_and_tells_what_an_earlier_one_left_there() {
    let place = place();
    std::fs::create_dir(place.path("film")).expect("a directory");
    let frame = |number: u32| place.path(format!("film/frame-{number:06}.png"));
    for (number, name) in [(0, "mine"), (1, "yours"), (3, "old"), (7, "older")] {
        std::fs::write(place.path(name), name).expect("a file");
        match number {
            0 => std::fs::hard_link(place.path(name), frame(0)).expect("a link"),
            1 => std::os::unix::fs::symlink(place.path(name), frame(1)).expect("a link"),
            _ => std::fs::write(frame(number), name).expect("a picture"),
        }
    }
    let film = ["--frames", "film", "--fps", "10", "--picture-size", "32x32"];
    let said =
        place.run(["run", "scene.toml", "--clock", "virtual", "--seconds", "0.3"].into_iter().chain(film));
    if are_missing(&said) {
        return;
    }
    assert_eq!(said.status, Some(0), "{}", said.err);
    assert!(said.out.contains(", 2 OLDER ones of another film behind them"), "{}", said.out);
    let read = |name: &str| std::fs::read(place.path(name)).expect(name);
    assert_eq!((&read("mine")[..], &read("yours")[..]), (&b"mine"[..], &b"yours"[..]));
    (0..3).for_each(|number| assert_eq!(size(&std::fs::read(frame(number)).expect("a picture")), [32; 2]));
}

#[test]
fn a_film_that_leaves_pictures_out_keeps_none_of_an_earlier_one_in_their_places() {
    let place = place();
    let run = |more: &[&str]| {
        let film =
            ["run", "scene.toml", "--seconds", "1", "--frames", "film", "--fps", "50", "--picture-size"];
        place.run([&film[..], more].concat())
    };
    let said = run(&["64x48", "--clock", "virtual"]);
    if are_missing(&said) {
        return;
    }
    assert_eq!(said.status, Some(0), "{}", said.err);
    // No processor draws these as fast as they are due; what a graphics card does leaves nothing out.
    let said = run(&["3840x2160", "--headless"]);
    assert_eq!(said.status, Some(0), "{}", said.err);
    println!("{}", said.out.lines().find(|line| line.starts_with("pictures")).expect("they are told"));
    assert!(!said.out.contains("OLDER"), "{}", said.out);
    let left = std::fs::read_dir(place.path("film")).expect("a directory");
    for entry in left.map(|entry| entry.expect("an entry").path()) {
        let found = size(&std::fs::read(&entry).expect("a picture"));
        assert_eq!(found, [3840, 2160], "{} is the earlier film's", entry.display());
    }
}

#[test]
fn a_directory_in_which_another_run_makes_a_film_is_refused() {
    let place = place();
    let film = [
        "run",
        "scene.toml",
        "--clock",
        "virtual",
        "--seconds",
        "0.1",
        "--frames",
        "film",
        "--record",
        "out.csv",
    ];
    std::fs::create_dir(place.path("film")).expect("room");
    let other = std::fs::File::open(place.path("film")).expect("it is there");
    other.try_lock().expect("nobody else");
    let said = place.run(film);
    assert_eq!(said.status, Some(2), "{}", said.err);
    assert!(said.err.contains("--frames film: somebody holds a lock on it"), "{}", said.err);
    assert!(!place.path("out.csv").exists(), "nothing runs");
    drop(other);
    let said = place.run(film);
    assert!(are_missing(&said) || said.status == Some(0), "{}", said.err);
}

#[test]
fn what_cannot_be_drawn_or_written_is_told() {
    let place = place();
    let run = |more: &[&str]| {
        place.run(["run", "scene.toml", "--clock", "virtual", "--seconds", "0.1"].iter().chain(more))
    };
    for (wrong, word) in [
        (["--snapshot", "early.png"], "allowed: a time in s"),
        (["--snapshot", "1:early.jpg"], "allowed: a time in s"),
        (["--picture-size", "huge"], "as in 1280x720"),
        (["--fps", "25"], "--frames"),
    ] {
        let said = run(&wrong);
        assert_eq!(said.status, Some(2), "{wrong:?}");
        assert!(said.err.contains(word), "{wrong:?}: {}", said.err);
    }
    let said = run(&["--snapshot", "0:a.png", "--camera", "side"]);
    assert!(said.status == Some(2) && said.err.contains("allowed: front"), "{}", said.err);
    let said = run(&["--snapshot", "0:scene.toml.png", "--snapshot", "0.05:scene.toml.png"]);
    assert!(said.status == Some(2) && said.err.contains("given twice"), "{}", said.err);
    let said = run(&["--snapshot", "0:no/such/place.png"]);
    if !are_missing(&said) {
        assert!(said.status == Some(3) && said.err.contains("no/such/place.png"), "{}", said.err);
        assert!(said.out.contains("pictures     0") && said.out.contains("NOT COMPLETE"), "{}", said.out);
    }
}

#[test]
fn a_disk_that_fills_up_has_whole_pictures_only() {
    let place = place();
    let mount = "mkdir small && mount -t tmpfs -o size=100k tmpfs small";
    let private = "unshare --user --map-root-user --mount sh -c";
    if place.shell(&format!("exec {private} '{mount}'"), &[]).status != Some(0) {
        eprintln!("skipped: no small disk can be mounted here");
        return;
    }
    std::fs::remove_dir(place.path("small")).expect("ours");
    // Only these processes see it.
    let inside = format!("{mount} && \"$0\" \"$@\"; end=$?; cp -r small/. film; exit $end");
    let script = format!("exec {private} '{inside}' \"$0\" \"$@\"");
    let seconds = ["--clock", "virtual", "--seconds", "2"];
    let said = place.shell(&script, &[&seconds[..], &["--frames", "small", "--fps", "50"]].concat());
    if are_missing(&said) {
        return;
    }
    assert!(said.status == Some(3) && said.err.contains("No space left"), "{:?} {}", said.status, said.err);
    let names = std::fs::read_dir(place.path("film"))
        .expect("copied")
        .map(|entry| entry.expect("an entry").file_name());
    let names: Vec<String> = names.map(|name| name.to_string_lossy().into_owned()).collect();
    assert!((1..100).contains(&names.len()), "{names:?}");
    for name in names {
        assert_eq!(Pixels::read(&place, &format!("film/{name}")).size, [1280.0, 720.0], "{name}");
    }
}

/// Red, green and blue of a picture.
struct Pixels {
    size: [f64; 2],
    bytes: Vec<u8>,
}

impl Pixels {
    fn read(place: &Workplace, name: &str) -> Self {
        let file = std::fs::File::open(place.path(name)).expect(name);
        let mut reader = png::Decoder::new(std::io::BufReader::new(file)).read_info().expect("PNG");
        let mut bytes = vec![0; reader.output_buffer_size().expect("a size")];
        let info = reader.next_frame(&mut bytes).expect("a picture");
        Self { size: [info.width, info.height].map(f64::from), bytes }
    }

    /// Where a camera that looks from `eye` at the origin, upright, sees a place.
    fn at(&self, eye: [f64; 3], field_of_view_deg: f64, place: [f64; 3]) -> [i32; 3] {
        let (eye, place) = (Point3::from(eye), Point3::from(place));
        let ahead = -eye.coords.normalize();
        let right = ahead.cross(&Vector3::y()).normalize();
        let (way, up) = (place - eye, right.cross(&ahead));
        let [across, half] = self.size.map(|side| 0.5 * side);
        let pixels = half / (0.5 * field_of_view_deg).to_radians().tan() / way.dot(&ahead);
        let (column, row) = (across + pixels * way.dot(&right), half - pixels * way.dot(&up));
        let at = 4 * (row as usize * self.size[0] as usize + column as usize);
        [0, 1, 2].map(|colour| i32::from(self.bytes[at + colour]))
    }
}

fn blueness([red, _, blue]: [i32; 3]) -> i32 {
    blue - red
}

fn greenness([red, green, _]: [i32; 3]) -> i32 {
    green - red
}

/// A virtual run of half a second or more with these arguments; `None`, and said so: there are no pictures here.
fn run(place: &Workplace, seconds: &str, arguments: &[&str]) -> Option<()> {
    let usual =
        ["run", "scene.toml", "--clock", "virtual", "--picture-size", "800x600", "--seconds", seconds];
    let said = place.run(usual.iter().chain(arguments));
    assert_eq!(said.status, Some(0), "{}", said.err);
    (!are_missing(&said)).then_some(())
}

/// Two centimetres deep in a plane, and four millimetres aside: it sticks.
const PRESSED: &str = "\
hand = \"hand.csv\"
[[finger]]
start_m = [0.0, 0.05, 0.0]
[[entity]]
name = \"floor\"
shape = { kind = \"plane\", normal = [0.0, 1.0, 0.0], offset_m = 0.0 }
stiffness_n_per_m = 100.0
friction = { model = \"coulomb\", mu = 0.5 }
visual = { colour = [0.3, 0.3, 0.35] }
[[camera]]
position_m = [0.0, 0.2, 0.25]
look_at_m = [0.0, 0.0, 0.0]
field_of_view_deg = 35.0
";
const HAND: &str = "t,f0_x,f0_y,f0_z\n0,0,0.05,0\n0.2,0,-0.02,0\n0.3,0.004,-0.02,0\n1,0.004,-0.02,0\n";

#[test]
fn a_runs_picture_has_the_friction_circle_and_the_normal_where_the_finger_presses() {
    let place = Workplace::new();
    place.write("scene.toml", PRESSED);
    place.write("hand.csv", HAND);
    let Some(()) = run(&place, "0.5", &["--snapshot", "0.02:free.png", "--snapshot", "0.4:pressed.png"])
    else {
        return;
    };
    let at = |pixels: &Pixels, place| blueness(pixels.at([0.0, 0.2, 0.25], 35.0, place));
    let (free, pressed) = (Pixels::read(&place, "free.png"), Pixels::read(&place, "pressed.png"));
    // Around the HIP's foot, with the radius mu times depth.
    for (x, z) in [(1.0, 0.0), (0.0, 1.0), (0.6, 0.8), (0.8, -0.6)] {
        let rim = |share: f64| [0.004 + share * 0.01 * x, 0.0, share * 0.01 * z];
        assert!(at(&pressed, rim(1.0)) > 60, "{x} {z}: {}", at(&pressed, rim(1.0)));
        for share in [0.8, 1.2] {
            assert!(at(&pressed, rim(share)) < 40, "{x} {z} {share}: {}", at(&pressed, rim(share)));
        }
        assert!(at(&free, rim(1.0)) < 40, "nothing is touched: {}", at(&free, rim(1.0)));
    }
    // The force leans aside, the normal does not: it stands on the god-object, which is where the finger came in.
    let (normal, beside) = ([0.0, 0.02, 0.0], [0.003, 0.02, 0.0]);
    assert!(at(&pressed, normal) > 60 && at(&pressed, beside) < 40, "{}", at(&pressed, normal));
}

const TABLE: &str = "\
[[finger]]
start_m = [0.0, 0.2, 0.0]
[[entity]]
name = \"table\"
shape = { kind = \"box\", size_m = [0.1, 0.02, 0.1] }
visual = { colour = [0.1, 0.7, 0.1] }
[[camera]]
position_m = [0.0, 0.0, 0.5]
field_of_view_deg = 40.0
";

#[test]
fn what_an_order_moved_is_drawn_where_it_is_and_after_a_reset_where_it_began() {
    let place = Workplace::new();
    place.write("scene.toml", TABLE);
    place.write("orders.txt", "at 0.1 move table to 0.12 0.03 0 in 0.6\nat 0.9 reset\n");
    let shots = [
        "--snapshot",
        "0.05:a.png",
        "--snapshot",
        "0.4:b.png",
        "--snapshot",
        "0.8:c.png",
        "--snapshot",
        "1.4:d.png",
    ];
    let Some(()) = run(&place, "1.5", &[&["--orders", "orders.txt"], &shots[..]].concat()) else { return };
    let is_there = |name: &str, place_m| {
        let seen = greenness(Pixels::read(&place, name).at([0.0, 0.0, 0.5], 40.0, place_m));
        assert!(!(15..60).contains(&seen), "{name}: {seen}");
        seen >= 60
    };
    let places = [[0.0, 0.0, 0.05], [0.06, 0.015, 0.05], [0.12, 0.03, 0.05]];
    // Halfway it is in the middle of its way.
    for (name, at) in [("a.png", 0), ("b.png", 1), ("c.png", 2), ("d.png", 0)] {
        let seen = is_there(name, places[at]);
        assert!(seen, "{name}");
    }
    assert!(!is_there("c.png", places[0]) && !is_there("d.png", places[2]));
}

#[test]
fn pictures_go_on_with_the_scene_that_takes_over() {
    let place = Workplace::new();
    place.write("scene.toml", SCENE);
    place.write("other.toml", TABLE);
    place.write("orders.txt", "at 0.1 swap other.toml\n");
    let shots = ["--orders", "orders.txt", "--snapshot", "0.05:a.png", "--snapshot", "0.5:b.png"];
    let Some(()) = run(&place, "0.6", &shots) else { return };
    let green =
        |name: &str| greenness(Pixels::read(&place, name).at([0.0, 0.0, 0.5], 40.0, [0.03, 0.0, 0.05]));
    assert!(green("a.png") < 15 && green("b.png") > 60, "{} {}", green("a.png"), green("b.png"));
}

/// Three faces on one edge, a sheet without an inside: what a finger would feel from both sides. All are seen from the front,
/// 12 cm wide.
const FAN: &str = "v -0.06 -0.06 0\nv 0.06 -0.06 0\nv 0 0.06 0\nv 0 0.06 -0.02\nv 0 0.06 -0.04\nf 1 2 3\nf 1 2 4\nf 1 2 5\n";

#[test]
fn what_is_only_seen_is_drawn_whatever_it_is_made_of_and_goes_where_orders_move_it() {
    let place = Workplace::new();
    place.write("fan.obj", FAN);
    place.write("orders.txt", "at 0.1 move table to 0.15 0.0 0 in 0.4\n");
    let seen_only = "haptic = false\ncollidable = false\nvisual = ";
    for shape in ["{ kind = \"box\", size_m = [0.1, 0.1, 0.1] }", "{ kind = \"mesh\", file = \"fan.obj\" }"] {
        let scene = TABLE.replace("{ kind = \"box\", size_m = [0.1, 0.02, 0.1] }", shape);
        place.write("scene.toml", scene.replace("visual = ", seen_only));
        let shots = ["--orders", "orders.txt", "--snapshot", "0.05:a.png", "--snapshot", "0.8:b.png"];
        let Some(()) = run(&place, "0.9", &shots) else { return };
        let green = |name: &str, x| {
            let eye = [0.0, 0.0, 0.5];
            greenness(Pixels::read(&place, name).at(eye, 40.0, [x, -0.01, 0.0]))
        };
        assert!(green("a.png", 0.0) > 40 && green("a.png", 0.15) < 15, "{shape}: it is not seen");
        assert!(green("b.png", 0.15) > 40 && green("b.png", 0.0) < 15, "{shape}: it was not moved");
    }
}

#[test]
fn what_is_only_seen_behind_a_door_is_seen_by_who_is_there() {
    let place = Workplace::new();
    let picture = |finger: &str| {
        let scene = format!(
            "[[finger]]\n{finger}\n[[entity]]\nname = \"hull\"\nshape = {{ kind = \"box\", size_m = [0.1, 0.12, 0.1] }}\n\
             visual = false\n[[environment]]\nname = \"inside\"\nkind = \"room\"\nsize_m = [0.4, 0.3, 0.4]\n\
             position_m = [0.0, 0.0, -0.15]\nvisual = false\n\
             door = {{ of = \"hull\", position_m = [0.0, 0.0, 0.05], size_m = [0.05, 0.1] }}\n\
             [[entity]]\nname = \"lamp\"\nwithin = \"inside\"\nshape = {{ kind = \"sphere\", radius_m = 0.05 }}\n\
             position_m = [0.0, 0.0, -0.1]\nhaptic = false\ncollidable = false\n\
             visual = {{ colour = [0.1, 0.7, 0.1] }}\n[[camera]]\nposition_m = [0.0, 0.0, 0.5]\nfield_of_view_deg = 40.0\n"
        );
        place.write("scene.toml", scene);
        run(&place, "0.2", &["--snapshot", "0.1:a.png"])?;
        Some(greenness(Pixels::read(&place, "a.png").at([0.0, 0.0, 0.5], 40.0, [0.01, 0.01, -0.1])))
    };
    let Some(inside) = picture("start_m = [0.1, 0.1, -0.2]\nwithin = \"inside\"") else { return };
    let outside = picture("start_m = [0.1, 0.1, 0.2]").expect("as before");
    assert!(inside > 40 && outside < 15, "{inside} {outside}");
}
