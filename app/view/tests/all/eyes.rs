//! What two eyes see of a small ball. Where there is no graphics library they say so and pass.

use crate::common;

use common::{SIZE, studio};
use haptics::{Entity, Sphere};
use std::path::Path;
use view::{Eyes, Moment, Picture, Stage};
use world::{Scene, SceneCamera, StereoMode};

const EYES: Eyes = Eyes { mode: StereoMode::SideBySide, separation_m: 0.06, convergence_m: 0.5 };
const FIELD_OF_VIEW_DEG: f64 = 30.0;

/// A dark ball on the camera's axis, so far away (m).
fn ball(away_m: f64) -> (Stage, Moment) {
    let scene = format!(
        r#"
name = "ball"
[[finger]]
start_m = [0.0, 0.0, 1.0]
[[entity]]
name = "ball"
shape = {{ kind = "sphere", radius_m = 0.004 }}
position_m = [0.0, 0.01, {}]
stiffness_n_per_m = 1000.0
visual = {{ colour = [0.0, 0.0, 0.0] }}
[[camera]]
position_m = [0.0, 0.0, 0.0]
look_at_m = [0.0, 0.0, -1.0]
field_of_view_deg = {FIELD_OF_VIEW_DEG}
"#,
        -away_m
    );
    let scene = Scene::parse(&scene, Path::new("ball.toml")).unwrap();
    let entity = Entity::new(Sphere::new(0.004).unwrap(), scene.entities[0].pose, 1000.0).unwrap();
    let poses = vec![entity.X_WB];
    (Stage::new(&scene, &[entity]), Moment { poses, ..Moment::default() })
}

/// `None`, and said so: there are none here.
fn taken(away_m: f64, size: [u32; 2], eyes: &Eyes) -> Option<Picture> {
    let (stage, moment) = ball(away_m);
    let mut studio = studio(&stage, size)?;
    studio.painter().with_overlay = false;
    Some(studio.take(&moment, camera(&stage), eyes))
}

fn camera(stage: &Stage) -> &SceneCamera {
    &stage.cameras[0]
}

/// Of what is dark among these columns and rows: its middle.
fn middle(picture: &Picture, columns: std::ops::Range<u32>, rows: std::ops::Range<u32>) -> [f64; 2] {
    let (mut sum, mut count) = ([0.0; 2], 0.0);
    for row in rows.clone() {
        for column in columns.clone().filter(|column| picture.at(*column, row)[1] < 110) {
            sum[0] += f64::from(column - columns.start);
            sum[1] += f64::from(row - rows.start);
            count += 1.0;
        }
    }
    assert!(count > 0.0, "no ball");
    sum.map(|sum| sum / count)
}

/// How much further right the left eye sees what is so far away (pixels), by the geometry of pinholes.
fn shift(eyes: &Eyes, away_m: f64, rows: u32) -> f64 {
    let pixels = 0.5 * f64::from(rows) / (0.5 * FIELD_OF_VIEW_DEG).to_radians().tan();
    pixels * eyes.separation_m * (1.0 / away_m - 1.0 / eyes.convergence_m)
}

// Middles of what is drawn are known to half a pixel each.
const PIXEL: f64 = 1.0;

#[test]
fn eyes_beside_each_other_see_a_ball_shifted_as_far_as_it_is_from_the_convergence_plane() {
    for away_m in [0.35, 0.5, 0.8] {
        let Some(picture) = taken(away_m, SIZE, &EYES) else { return };
        let (left, right) = (middle(&picture, 0..400, 0..600), middle(&picture, 400..800, 0..600));
        let expected = shift(&EYES, away_m, 600);
        assert!((left[0] - right[0] - expected).abs() < PIXEL, "{away_m}: {left:?} {right:?} {expected}");
        assert!((left[1] - right[1]).abs() < PIXEL, "nothing is shifted up or down");
        // The camera itself sees the ball in the middle, which lies between both.
        assert!((0.5 * (left[0] + right[0]) - 199.5).abs() < PIXEL);
        let sign = expected.abs().min(1.0).copysign(0.5 - away_m);
        assert!(sign * (left[0] - right[0]) >= 0.0);
    }
}

#[test]
fn the_left_eye_is_above_and_settings_hold_from_the_next_picture_on() {
    let (stage, moment) = ball(0.35);
    let Some(mut studio) = studio(&stage, SIZE) else { return };
    studio.painter().with_overlay = false;
    for (separation_m, convergence_m) in [(0.06, 0.5), (0.03, 0.5), (0.06, 0.3)] {
        let eyes = Eyes { mode: StereoMode::TopBottom, separation_m, convergence_m };
        let picture = studio.take(&moment, camera(&stage), &eyes);
        let (left, right) = (middle(&picture, 0..800, 0..300), middle(&picture, 0..800, 300..600));
        let expected = shift(&eyes, 0.35, 300);
        assert!((left[0] - right[0] - expected).abs() < PIXEL, "{left:?} {right:?} {expected}");
        assert!((left[1] - right[1]).abs() < PIXEL);
    }
}

#[test]
fn an_anaglyphs_red_is_the_left_eyes_and_its_green_and_blue_are_the_right_ones() {
    let Some(beside) = taken(0.35, [1600, 600], &EYES) else { return };
    let eyes = Eyes { mode: StereoMode::Anaglyph, ..EYES };
    let Some(anaglyph) = taken(0.35, SIZE, &eyes) else { return };
    let mut differing = 0;
    for row in 0..600 {
        for column in 0..800 {
            let (left, right) = (beside.at(column, row), beside.at(800 + column, row));
            let both = [left[0], right[1], right[2]];
            let near = |k: usize| anaglyph.at(column, row)[k].abs_diff(both[k]) <= 1;
            differing += u32::from(!(near(0) && near(1) && near(2)));
        }
    }
    // Half a picture is elsewhere in the target, and a rim's pixel may be rounded otherwise there.
    assert!(differing < 20, "{differing}");
    let red = |column: u32, row| anaglyph.at(column, row)[0] < 110 && anaglyph.at(column, row)[1] > 110;
    let some_red = (0..600).any(|row| (0..800).any(|column| red(column, row)));
    assert!(some_red, "both eyes see the ball at the same place");
}

#[test]
fn one_eye_sees_what_the_camera_sees() {
    let Some(picture) = taken(0.35, SIZE, &Eyes::default()) else { return };
    assert!((middle(&picture, 0..800, 0..600)[0] - 399.5).abs() < PIXEL);
}
