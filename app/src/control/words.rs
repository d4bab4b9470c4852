//! Orders in words: what a line of a script, or of the standard input, asks for.
//!
//! ```text
//! reset
//! stiffness 1.1             all entities; `stiffness 1.1 of table` one
//! damping 0.9
//! friction table coulomb mu=0.3
//! move table to 0 0.1 0 in 0.5
//! turn table to 1 0 0 0 in 0.5           a quaternion w x y z
//! turn table about 0 1 0 by 1.57 in 0.5  an axis of the world, and an angle in rad
//! pose table at 0 0.1 0 1 0 0 0 in 0.5   both
//! camera at 0 0.2 0.4 1 0 0 0             devices that are attached to it go along
//! pause
//! resume
//! swap other.toml
//! key 32 down               it is told as of now; `key 32 down at 1.25` as of that time of the run
//! trial 7 begins
//! text 0.5 0.2 4 Press the red cube      at the window: shares of its width and height, seconds, what to read
//! ```
//! In a script each line begins with when: `at 2.5 reset`. What follows a `#` is for people.

use nalgebra::{Isometry3, Quaternion, Unit, UnitQuaternion, Vector3};
use rt_core::separators;
use std::path::PathBuf;
use view::Note;
use world::FrictionSpec;
use world::events::{Change, Kind};

use super::gradual::MOST_TIMES;
use super::order::{Turn, Which};

/// What a line says; names are those of entities.
#[derive(Debug, Clone, PartialEq)]
pub enum Words {
    /// Everything is to be where it began.
    Reset,
    /// Stiffness or damping, so many times what it is, of an entity or of all.
    Scale(Which, f64, Option<String>),
    /// An entity is to have this friction.
    Friction(String, FrictionSpec),
    /// An entity is to go there \[m\] and to be turned so, within a time \[s\].
    Move(String, Option<Vector3<f64>>, Turn, f64),
    /// The camera, and devices that go with it, are to be there.
    Camera(Isometry3<f64>),
    /// Things are not to move by themselves, or to do so again.
    Pause(bool),
    /// Another scene is to be played.
    Swap(PathBuf),
    /// Something is to be told among the events, as of this time of the run \[s\] if it is not of now.
    Tell(Kind, Option<f64>),
    /// Something is to be read at the window.
    Text(Note),
}

/// Farther away nothing is put \[m\].
const FARTHEST_M: f64 = 100.0;
const LONGEST_S: f64 = 3600.0;
const MOST_RUN_S: f64 = 1e9;
const MOST_TURN_RAD: f64 = std::f64::consts::PI;
const KNOWN: &str = "reset; stiffness FACTOR [of ENTITY]; damping FACTOR [of ENTITY]; friction ENTITY MODEL [KEY=VALUE]...; \
                     move ENTITY to X Y Z in SECONDS; turn ENTITY to W X Y Z in SECONDS; \
                     turn ENTITY about X Y Z by RAD in SECONDS; pose ENTITY at X Y Z W X Y Z in SECONDS; camera at X Y Z W X Y Z; \
                     pause; resume; \
                     swap SCENE.toml; key CODE down|up [at SECONDS]; trial NUMBER begins|ends; text X Y SECONDS WORDS...";

/// What a line says after the comment is cut off; `None`: nothing.
///
/// # Errors
/// What is wrong with it, and what is allowed.
pub fn parse(line: &str) -> Result<Option<Words>, String> {
    check_length(line)?;
    let words: Vec<&str> = without_comment(line).split_whitespace().collect();
    let words = match words[..] {
        [] => return Ok(None),
        ["reset"] => Words::Reset,
        [which @ ("stiffness" | "damping"), by] => scale(which, by, None)?,
        [which @ ("stiffness" | "damping"), by, "of", entity] => scale(which, by, Some(entity))?,
        ["friction", entity, model, ref keys @ ..] => Words::Friction(entity.into(), friction(model, keys)?),
        ["move", entity, "to", x, y, z, "in", over] => {
            Words::Move(entity.into(), Some(place([x, y, z])?), Turn::Not, seconds(over)?)
        }
        ["turn", entity, "to", w, x, y, z, "in", over] => {
            Words::Move(entity.into(), None, Turn::To(quaternion([w, x, y, z])?), seconds(over)?)
        }
        ["turn", entity, "about", x, y, z, "by", angle, "in", over] => {
            let angle = number(angle, "rad", -MOST_TURN_RAD, MOST_TURN_RAD)?;
            let turn = UnitQuaternion::from_axis_angle(&axis([x, y, z])?, angle);
            Words::Move(entity.into(), None, Turn::By(turn), seconds(over)?)
        }
        ["pose", entity, "at", x, y, z, w, i, j, k, "in", over] => {
            let turn = Turn::To(quaternion([w, i, j, k])?);
            Words::Move(entity.into(), Some(place([x, y, z])?), turn, seconds(over)?)
        }
        ["camera", "at", x, y, z, w, i, j, k] => {
            Words::Camera(Isometry3::from_parts(place([x, y, z])?.into(), quaternion([w, i, j, k])?))
        }
        ["pause"] => Words::Pause(true),
        ["resume"] => Words::Pause(false),
        ["swap", scene] => Words::Swap(scene.into()),
        ["key", code, change @ ("down" | "up")] => {
            Words::Tell(Kind::Key { code: whole(code)?, is_pressed: change == "down" }, None)
        }
        ["key", code, change @ ("down" | "up"), "at", at] => Words::Tell(
            Kind::Key { code: whole(code)?, is_pressed: change == "down" },
            Some(run_seconds(at)?),
        ),
        ["trial", trial, change @ ("begins" | "ends")] => {
            let change = if change == "begins" { Change::Begins } else { Change::Ends };
            Words::Tell(Kind::Trial { change, number: whole(trial)? }, None)
        }
        ["text", x, y, over, _, ..] => {
            let at = [share(x)?, share(y)?];
            Words::Text(Note { text: words[4..].join(" "), at, seconds: seconds(over)? })
        }
        _ => return Err(format!("found {}, allowed: {KNOWN}", words.join(" "))),
    };
    Ok(Some(words))
}

/// A line of a script: when (s), and the order.
///
/// # Errors
/// A line that does not say when.
pub fn split_time(line: &str) -> Result<Option<(f64, &str)>, String> {
    let line = without_comment(line).trim();
    if line.is_empty() {
        return Ok(None);
    }
    check_length(line)?;
    let timed = line.strip_prefix("at ").and_then(|rest| rest.trim_start().split_once(char::is_whitespace));
    let Some((at, order)) = timed else {
        return Err(format!("found {line}, allowed: at SECONDS ORDER, such as `at 2.5 reset`"));
    };
    Ok(Some((number(at, "s", 0.0, 24.0 * LONGEST_S)?, order.trim_start())))
}

/// A refusal repeats the line.
fn check_length(line: &str) -> Result<(), String> {
    if line.len() <= LONGEST_LINE_BYTES {
        return Ok(());
    }
    Err(format!("found a line of {} bytes, allowed: at most {LONGEST_LINE_BYTES}", line.len()))
}

/// Longer than any text that people can read in a window.
pub const LONGEST_LINE_BYTES: usize = 1000;

/// What stands before the `#`.
pub fn without_comment(line: &str) -> &str {
    line.split('#').next().unwrap_or_default()
}

fn scale(which: &str, by: &str, entity: Option<&str>) -> Result<Words, String> {
    let which = if which == "stiffness" { Which::Stiffness } else { Which::Damping };
    Ok(Words::Scale(which, number(by, "times", MOST_TIMES.recip(), MOST_TIMES)?, entity.map(String::from)))
}

/// As a scene says it, in words: `coulomb mu=0.3`.
fn friction(model: &str, keys: &[&str]) -> Result<FrictionSpec, String> {
    let is_pair =
        |key: &str| key.split_once('=').is_some_and(|(key, value)| !key.is_empty() && !value.is_empty());
    if let Some(found) = keys.iter().find(|key| !is_pair(key)) {
        return Err(format!("found {found}, allowed: KEY=VALUE, such as mu=0.3"));
    }
    let keys: String = keys.iter().map(|key| format!(", {key}")).collect();
    FrictionSpec::parse(&format!("{{ model = \"{model}\"{keys} }}")).map_err(|error| error.to_string())
}

fn place(words: [&str; 3]) -> Result<Vector3<f64>, String> {
    let [x, y, z] = words.map(|text| number(text, "m", -FARTHEST_M, FARTHEST_M));
    Ok(Vector3::new(x?, y?, z?))
}

fn axis(words: [&str; 3]) -> Result<Unit<Vector3<f64>>, String> {
    let [x, y, z] = words.map(|text| number(text, "", -1e3, 1e3));
    let given = Vector3::new(x?, y?, z?);
    Unit::try_new(given, 1e-3)
        .ok_or_else(|| format!("found {}, allowed: an axis, which has a length", words.join(" ")))
}

fn quaternion(words: [&str; 4]) -> Result<UnitQuaternion<f64>, String> {
    let [w, x, y, z] = words.map(|text| number(text, "", -1e3, 1e3));
    let given = Quaternion::new(w?, x?, y?, z?);
    UnitQuaternion::try_new(given, 1e-3)
        .ok_or_else(|| format!("found {}, allowed: a quaternion, which has a length", words.join(" ")))
}

fn seconds(text: &str) -> Result<f64, String> {
    number(text, "s", 0.0, LONGEST_S)
}

/// A time of the run.
fn run_seconds(text: &str) -> Result<f64, String> {
    number(text, "s", 0.0, MOST_RUN_S)
}

fn share(text: &str) -> Result<f64, String> {
    number(text, "of the window", 0.0, 1.0)
}

fn whole(text: &str) -> Result<u32, String> {
    text.parse().map_err(|_| format!("found {text}, allowed: a whole number from 0 to {}", u32::MAX))
}

fn number(text: &str, unit: &str, min: f64, max: f64) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if (min..=max).contains(&number) => Ok(number),
        _ => {
            let hint = separators::hint_for_cell(text);
            Err(format!("found {text}, allowed: {min} to {max} {unit}").trim_end().to_owned() + hint)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn turn(axis: Unit<Vector3<f64>>, angle_rad: f64) -> UnitQuaternion<f64> {
        UnitQuaternion::from_axis_angle(&axis, angle_rad)
    }

    /// Without the 6e-17 that the cosine of a rounded right angle is.
    fn half_a_turn(axis: Unit<Vector3<f64>>) -> UnitQuaternion<f64> {
        UnitQuaternion::new_unchecked(Quaternion::from_imag(axis.into_inner()))
    }

    #[test]
    fn orders_are_read_as_they_are_told() {
        let good = [
            ("reset", Words::Reset),
            ("  stiffness 1.1 # harder", Words::Scale(Which::Stiffness, 1.1, None)),
            ("damping 0.5 of table", Words::Scale(Which::Damping, 0.5, Some("table".into()))),
            (
                "move plate to 0 0.1 -0.2 in 0.5",
                Words::Move("plate".into(), Some(Vector3::new(0.0, 0.1, -0.2)), Turn::Not, 0.5),
            ),
            (
                "turn plate to 0 0 2 0 in 1",
                Words::Move("plate".into(), None, Turn::To(half_a_turn(Vector3::y_axis())), 1.0),
            ),
            (
                "turn plate about 0 0 3 by 0.5 in 1",
                Words::Move("plate".into(), None, Turn::By(turn(Vector3::z_axis(), 0.5)), 1.0),
            ),
            (
                "pose plate at 1 2 3 0 1 0 0 in 0",
                Words::Move(
                    "plate".into(),
                    Some(Vector3::new(1.0, 2.0, 3.0)),
                    Turn::To(half_a_turn(Vector3::x_axis())),
                    0.0,
                ),
            ),
            (
                "friction table coulomb mu=0.3",
                Words::Friction("table".into(), FrictionSpec::Coulomb { mu: 0.3 }),
            ),
            ("friction table none", Words::Friction("table".into(), FrictionSpec::None)),
            ("camera at 1 2 3 0 1 0 0", {
                let pose = Isometry3::from_parts([1.0, 2.0, 3.0].into(), half_a_turn(Vector3::x_axis()));
                Words::Camera(pose)
            }),
            ("pause", Words::Pause(true)),
            ("resume", Words::Pause(false)),
            ("key 32 down", Words::Tell(Kind::Key { code: 32, is_pressed: true }, None)),
            ("key 32 up at 1.25", Words::Tell(Kind::Key { code: 32, is_pressed: false }, Some(1.25))),
            ("trial 7 ends", Words::Tell(Kind::Trial { change: Change::Ends, number: 7 }, None)),
            (
                "text 0.5 0.25 4 Press  the cube # softly",
                Words::Text(Note { text: "Press the cube".into(), at: [0.5, 0.25], seconds: 4.0 }),
            ),
            ("swap other.toml", Words::Swap("other.toml".into())),
        ];
        for (line, words) in good {
            assert_eq!(parse(line), Ok(Some(words.clone())), "{line}");
            let timed = format!("at 2.5 {line}");
            let (at_s, order) = split_time(&timed).expect("timed").expect("an order");
            assert_eq!((at_s, parse(order)), (2.5, Ok(Some(words))), "{line}");
        }
        assert_eq!((parse(" # nothing"), split_time("")), (Ok(None), Ok(None)));
    }

    #[test]
    fn what_is_no_order_is_refused_with_what_is() {
        for line in [
            "reset all",
            "stiffness",
            "stiffness 1 table",
            "move plate 0 0 0 in 1",
            "Reset",
            "swap",
            "key 3 hit",
            "text 0.5 0.5 4",
        ] {
            let said = parse(line).unwrap_err();
            assert!(said.contains(line) && said.contains("move ENTITY to X Y Z in SECONDS"), "{said}");
        }
        assert_eq!(parse("stiffness 0").unwrap_err(), "found 0, allowed: 0.1 to 10 times");
        assert_eq!(parse("damping nan").unwrap_err(), "found nan, allowed: 0.1 to 10 times");
        assert_eq!(parse("move a to 0 inf 0 in 1").unwrap_err(), "found inf, allowed: -100 to 100 m");
        assert_eq!(parse("move a to 0 0 0 in -1").unwrap_err(), "found -1, allowed: 0 to 3600 s");
        assert_eq!(
            parse("turn a about 0 0 0 by 1 in 1").unwrap_err(),
            "found 0 0 0, allowed: an axis, which has a length"
        );
        assert_eq!(parse("key -1 up").unwrap_err(), "found -1, allowed: a whole number from 0 to 4294967295");
        let said = parse("friction table coulomb mu=-1").unwrap_err();
        assert!(said.contains("mu") && said.contains("-1"), "{said}");
        let said = parse("friction table glue").unwrap_err();
        assert!(said.contains("glue") && said.contains("coulomb"), "{said}");
        let comma = parse("stiffness 1,5").unwrap_err();
        assert_eq!(comma, "found 1,5, allowed: 0.1 to 10 times; a decimal number has a point, as in 0.1");
        let said = parse("friction table coulomb 0.2").unwrap_err();
        assert_eq!(said, "found 0.2, allowed: KEY=VALUE, such as mu=0.3");
        assert_eq!(parse("text 2 0 1 hello").unwrap_err(), "found 2, allowed: 0 to 1 of the window");
        assert!(split_time("reset").unwrap_err().contains("at SECONDS ORDER"));
        assert_eq!(split_time("at -1 reset").unwrap_err(), "found -1, allowed: 0 to 86400 s");
    }
}
