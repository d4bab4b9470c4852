//! Orders in words: what a line of a script, or of the standard input, asks for.
//!
//! ```text
//! reset
//! stiffness 1.1             all entities; `stiffness 1.1 of table` one
//! damping 0.9
//! move table to 0 0.1 0 in 0.5
//! swap other.toml
//! ```
//! In a script each line begins with when: `at 2.5 reset`. What follows a `#` is for people.

use nalgebra::Vector3;
use std::path::PathBuf;

use super::gradual::MOST_TIMES;
use super::order::Which;

/// What a line says; names are those of entities.
#[derive(Debug, Clone, PartialEq)]
pub enum Words {
    /// Everything is to be where it began.
    Reset,
    /// Stiffness or damping, so many times what it is, of an entity or of all.
    Scale(Which, f64, Option<String>),
    /// An entity is to go there \[m\], within a time \[s\].
    Move(String, Vector3<f64>, f64),
    /// Another scene is to be played.
    Swap(PathBuf),
}

/// Farther away nothing is put \[m\].
const FARTHEST_M: f64 = 100.0;
const LONGEST_S: f64 = 3600.0;
const KNOWN: &str = "reset; stiffness FACTOR [of ENTITY]; damping FACTOR [of ENTITY]; \
                     move ENTITY to X Y Z in SECONDS; swap SCENE.toml";

/// What a line says after the comment is cut off; `None`: nothing.
///
/// # Errors
/// What is wrong with it, and what is allowed.
pub fn parse(line: &str) -> Result<Option<Words>, String> {
    let words: Vec<&str> = without_comment(line).split_whitespace().collect();
    let words = match words[..] {
        [] => return Ok(None),
        ["reset"] => Words::Reset,
        [which @ ("stiffness" | "damping"), by] => scale(which, by, None)?,
        [which @ ("stiffness" | "damping"), by, "of", entity] => scale(which, by, Some(entity))?,
        ["move", entity, "to", x, y, z, "in", over] => {
            let [x, y, z] = [x, y, z].map(|text| number(text, "m", -FARTHEST_M, FARTHEST_M));
            Words::Move(entity.into(), Vector3::new(x?, y?, z?), number(over, "s", 0.0, LONGEST_S)?)
        }
        ["swap", scene] => Words::Swap(scene.into()),
        _ => return Err(format!("found {}, allowed: {KNOWN}", words.join(" "))),
    };
    Ok(Some(words))
}

/// A line of a script: when (s), and what.
///
/// # Errors
/// As of [`parse`]; a line that does not say when.
pub fn parse_timed(line: &str) -> Result<Option<(f64, Words)>, String> {
    let line = without_comment(line).trim();
    if line.is_empty() {
        return Ok(None);
    }
    let timed = line.strip_prefix("at ").and_then(|rest| rest.trim_start().split_once(char::is_whitespace));
    let Some((at, order)) = timed else {
        return Err(format!("found {line}, allowed: at SECONDS ORDER, such as `at 2.5 reset`"));
    };
    let at_s = number(at, "s", 0.0, 24.0 * LONGEST_S)?;
    Ok(parse(order)?.map(|words| (at_s, words)))
}

fn without_comment(line: &str) -> &str {
    line.split('#').next().unwrap_or_default()
}

fn scale(which: &str, by: &str, entity: Option<&str>) -> Result<Words, String> {
    let which = if which == "stiffness" { Which::Stiffness } else { Which::Damping };
    Ok(Words::Scale(which, number(by, "times", MOST_TIMES.recip(), MOST_TIMES)?, entity.map(String::from)))
}

fn number(text: &str, unit: &str, min: f64, max: f64) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if (min..=max).contains(&number) => Ok(number),
        _ => Err(format!("found {text}, allowed: {min} to {max} {unit}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_are_read_as_they_are_told() {
        let good = [
            ("reset", Words::Reset),
            ("  stiffness 1.1 # harder", Words::Scale(Which::Stiffness, 1.1, None)),
            ("damping 0.5 of table", Words::Scale(Which::Damping, 0.5, Some("table".into()))),
            (
                "move plate to 0 0.1 -0.2 in 0.5",
                Words::Move("plate".into(), Vector3::new(0.0, 0.1, -0.2), 0.5),
            ),
            ("swap other.toml", Words::Swap("other.toml".into())),
        ];
        for (line, words) in good {
            assert_eq!(parse(line), Ok(Some(words.clone())), "{line}");
            assert_eq!(parse_timed(&format!("at 2.5 {line}")), Ok(Some((2.5, words))), "{line}");
        }
        assert_eq!((parse(" # nothing"), parse_timed("")), (Ok(None), Ok(None)));
    }

    #[test]
    fn what_is_no_order_is_refused_with_what_is() {
        for line in ["reset all", "stiffness", "stiffness 1 table", "move plate 0 0 0 in 1", "Reset", "swap"]
        {
            let said = parse(line).unwrap_err();
            assert!(said.contains(line) && said.contains("move ENTITY to X Y Z in SECONDS"), "{said}");
        }
        assert_eq!(parse("stiffness 0").unwrap_err(), "found 0, allowed: 0.1 to 10 times");
        assert_eq!(parse("damping nan").unwrap_err(), "found nan, allowed: 0.1 to 10 times");
        assert_eq!(parse("move a to 0 inf 0 in 1").unwrap_err(), "found inf, allowed: -100 to 100 m");
        assert_eq!(parse("move a to 0 0 0 in -1").unwrap_err(), "found -1, allowed: 0 to 3600 s");
        assert!(parse_timed("reset").unwrap_err().contains("at SECONDS ORDER"));
        assert_eq!(parse_timed("at -1 reset").unwrap_err(), "found -1, allowed: 0 to 86400 s");
    }
}
