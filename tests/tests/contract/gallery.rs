//! The gallery's scenes: each object adds to the force what its page says, and the page has a picture of each.

use std::path::Path;
use system_tests::recording::Table;
use system_tests::workplace::Workplace;

fn project(path: &str) -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the project").join(path).display().to_string()
}

fn played(place: &Workplace, scene: &str) -> Table {
    let file = project(&format!("config/scenes/{scene}.toml"));
    let said = place.run(["run", &file, "--clock", "virtual", "--record", "r.csv"]);
    assert_eq!(said.status, Some(0), "{scene}: {}", said.err);
    Table::read(&place.path("r.csv"))
}

/// When the finger is at each object or place (s), and how much its force differs at least from that without (N).
const STATIONS: [(&str, [f64; 2], f64); 12] = [
    // A facet of 30 degrees leans by up to 15 degrees off the ball: a quarter of 3 N.
    ("coarse-ball", [0.4, 2.7], 0.4),
    ("soft-edges", [3.1, 5.4], 0.2),
    // Half a millimetre of 1000 N/m.
    ("relief", [5.8, 8.1], 0.3),
    ("relief-by-force", [8.5, 10.8], 0.3),
    ("mouse", [11.2, 13.5], 0.5),
    ("carved-block", [13.9, 16.2], 0.5),
    // The magnet's whole force of 1 N, the hum's 0.4 N.
    ("magnet", [16.6, 18.9], 0.9),
    ("humming-plate", [19.3, 21.6], 0.35),
    ("ice", [22.0, 24.3], 0.05),
    ("rubber", [24.7, 27.0], 0.5),
    // 50 mm in 0.8 s through 4 N s/m; a guide of 500 N/m some 3 mm away.
    ("honey", [27.4, 29.7], 0.2),
    ("rail", [30.1, 32.4], 1.0),
];

#[test]
fn what_each_object_of_the_gallery_adds_is_felt_there() {
    let place = Workplace::new();
    let [with, without] = ["gallery", "gallery-plain"].map(|scene| played(&place, scene));
    let times = with.numbers("t");
    assert_eq!(times, without.numbers("t"));
    let differences: Vec<f64> = with
        .vectors("f0_force")
        .iter()
        .zip(without.vectors("f0_force"))
        .map(|(with, without)| (with - without).norm())
        .collect();
    for (station, [from, to], least) in STATIONS {
        let there = times.iter().zip(&differences).filter(|(t, _)| (from..to).contains(*t));
        let largest = there.fold(0.0_f64, |largest, (_, difference)| largest.max(*difference));
        assert!(largest >= least, "{station}: {largest} N");
        // Nothing in a gallery throws a hand.
        assert!(largest < 8.0, "{station}: {largest} N");
    }
}

#[test]
fn a_fingertip_rolls_round_a_ray_without_a_jump_and_rests_on_two_walls() {
    let place = Workplace::new();
    let table = played(&place, "gallery-fingertip");
    let (times, forces) = (table.numbers("t"), table.vectors("f0_force"));
    let rolling: Vec<_> = times
        .iter()
        .zip(&forces)
        .filter(|(t, _)| (2.05..3.25).contains(*t))
        .map(|(_, force)| force)
        .collect();
    let turns = rolling.windows(2).map(|pair| pair[0].angle(pair[1]));
    // The force turns by 135 degrees in the 1.2 s of the arc; friction, which lags behind at its ends, doubles that.
    let most = turns.fold(0.0, f64::max);
    assert!(most < 2.0 * 135f64.to_radians() / 1200.0, "{most}");
    let last = times.iter().rposition(|t| *t <= 4.65).expect("a row");
    assert!(forces[last].y > 1.5 && forces[last].x > 1.0, "the second wall pushes up: {}", forces[last]);
}

#[test]
fn the_page_shows_a_picture_of_each() {
    let page = std::fs::read_to_string(project("docs/gallery.md")).expect("the page");
    for station in STATIONS.iter().map(|(station, ..)| *station).chain(["star"]) {
        assert!(page.contains(&format!("(gallery/{station}.svg)")), "{station}");
        let picture =
            std::fs::read_to_string(project(&format!("docs/gallery/{station}.svg"))).expect(station);
        assert!(picture.contains("force on the user (N)"), "{station}");
    }
}
