//! Which pictures of a run are wanted: the command line's words for them.

use clap::{Args, ValueEnum};
use rt_core::separators;
use std::path::PathBuf;
use view::Eyes;
use world::{Settings, StereoMode};

/// Pictures of a run, drawn without a display.
#[derive(Debug, Clone, Default, Args)]
pub struct PictureArgs {
    /// Draw the moment T (s) into a file (PNG), as in 2.5:grasp.png; may be given several times
    #[arg(long, value_name = "T:FILE.png", value_parser = parse_shot)]
    snapshot: Vec<Shot>,
    /// Draw the whole run into this directory, picture by picture: frame-000000.png and so on
    #[arg(long, value_name = "DIR")]
    frames: Option<PathBuf>,
    /// With --frames: pictures per second of the run
    #[arg(long, value_name = "N", default_value_t = 25.0, value_parser = parse_fps, requires = "frames")]
    fps: f64,
    /// Width and height of pictures, in points
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = parse_size)]
    picture_size: [u32; 2],
    /// Which of the scene's cameras looks on [default: its first, or one that sees all that moves]
    #[arg(long, value_name = "NAME")]
    camera: Option<String>,
    /// Pictures for two eyes, as far apart as the settings say
    #[arg(long, value_name = "HOW", value_enum, default_value_t = Stereo::Off)]
    stereo: Stereo,
}

/// How two eyes get their pictures in one file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
enum Stereo {
    /// One eye
    #[default]
    Off,
    /// The left eye's on the left
    SideBySide,
    /// The left eye's above
    TopBottom,
    /// For red and cyan glasses
    Anaglyph,
}

/// What is wanted.
#[derive(Debug, Clone, PartialEq)]
pub struct Wanted {
    /// Single pictures.
    pub shots: Vec<Shot>,
    /// Pictures one after the other.
    pub film: Option<Film>,
    /// Columns and rows.
    pub size: [u32; 2],
    /// The camera's name.
    pub camera: Option<String>,
    /// Who looks.
    pub eyes: Eyes,
}

/// A single picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Shot {
    /// Since t = 0 (s).
    pub t_s: f64,
    /// Where to.
    pub file: PathBuf,
}

/// Pictures one after the other.
#[derive(Debug, Clone, PartialEq)]
pub struct Film {
    /// Where to.
    pub directory: PathBuf,
    /// So many a second of the run.
    pub fps: f64,
}

impl PictureArgs {
    /// `None`: none.
    pub fn wanted(&self, settings: &Settings) -> Option<Wanted> {
        let mode = match self.stereo {
            Stereo::Off => StereoMode::Off,
            Stereo::SideBySide => StereoMode::SideBySide,
            Stereo::TopBottom => StereoMode::TopBottom,
            Stereo::Anaglyph => StereoMode::Anaglyph,
        };
        let (separation_m, convergence_m) = (settings.eye_separation_m.value, settings.convergence_m.value);
        let film = self.frames.clone().map(|directory| Film { directory, fps: self.fps });
        (film.is_some() || !self.snapshot.is_empty()).then(|| Wanted {
            shots: self.snapshot.clone(),
            film,
            size: self.picture_size,
            camera: self.camera.clone(),
            eyes: Eyes { mode, separation_m, convergence_m },
        })
    }

    /// An option that says how pictures are drawn, where none is wanted.
    pub fn idle_option(&self) -> Option<&'static str> {
        if self.frames.is_some() || !self.snapshot.is_empty() {
            return None;
        }
        let given = [("--camera", self.camera.is_some()), ("--stereo", self.stereo != Stereo::Off)];
        given.into_iter().find_map(|(name, is_given)| is_given.then_some(name))
    }

    /// The files of single pictures.
    pub fn files(&self) -> impl Iterator<Item = &PathBuf> {
        self.snapshot.iter().map(|shot| &shot.file)
    }
}

fn parse_shot(text: &str) -> Result<Shot, String> {
    let wrong = || {
        format!("found {text}, allowed: a time in s from 0 on, a colon and a PNG file, as in 2.5:grasp.png")
    };
    let (t_s, file) = text.split_once(':').ok_or_else(wrong)?;
    let t_s: f64 = t_s.parse().map_err(|_| wrong() + separators::hint_for_cell(t_s))?;
    let file = PathBuf::from(file);
    let is_png = file.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("png"));
    if t_s.is_finite() && t_s >= 0.0 && is_png { Ok(Shot { t_s, file }) } else { Err(wrong()) }
}

fn parse_fps(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(fps) if (0.001..=1000.0).contains(&fps) => Ok(fps),
        _ => Err(format!("found {text}, allowed: 0.001 to 1000 pictures per second")),
    }
}

fn parse_size(text: &str) -> Result<[u32; 2], String> {
    let sides =
        text.split_once('x').and_then(|(width, height)| Some([width.parse().ok()?, height.parse().ok()?]));
    sides
        .filter(|sides: &[u32; 2]| sides.iter().all(|side| (16..=8192).contains(side)))
        .ok_or_else(|| format!("found {text}, allowed: width and height from 16 to 8192, as in 1280x720"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_snapshot_has_a_time_and_a_png() {
        assert_eq!(parse_shot("2.5:a:b.PNG").unwrap(), Shot { t_s: 2.5, file: "a:b.PNG".into() });
        for wrong in ["a.png", "-1:a.png", "nan:a.png", "1:a.jpg", "1:", ":a.png"] {
            assert!(parse_shot(wrong).unwrap_err().contains(wrong), "{wrong}");
        }
        assert!(parse_shot("1,5:a.png").unwrap_err().contains("a decimal number has a point"));
    }

    #[test]
    fn a_size_has_two_sides_within_reason() {
        assert_eq!(parse_size("640x480").unwrap(), [640, 480]);
        for wrong in ["640", "0x480", "640x9000", "-1x5", "640 x 480"] {
            assert!(parse_size(wrong).unwrap_err().contains(wrong), "{wrong}");
        }
    }
}
