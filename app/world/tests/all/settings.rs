//! The settings of a workplace: what a file says lies over what was there, and of each value it is known who set it.

use std::path::{Path, PathBuf};

use world::{Settings, StereoMode};

const DEFAULT_FILE: &str = include_str!("../../../../config/settings.toml");

fn refused(text: &str) -> String {
    Settings::default().overlaid(text, Path::new("p.toml")).expect_err("it is wrong").to_string()
}

#[test]
fn each_value_is_that_of_the_last_file_that_says_it() {
    let system =
        "[window]\nsize_px = [1920, 1080]\nfullscreen = true\n[data]\nmeshes = [\"meshes\", \"/srv/m\"]\n";
    let user = "[window]\nfullscreen = false\n[stereo]\nmode = \"anaglyph\"\neye_separation_m = 0.06\n[driver]\nclock = \"virtual\"\n";
    let settings = Settings::default()
        .overlaid(system, Path::new("/etc/p/settings.toml"))
        .and_then(|settings| settings.overlaid(user, Path::new("u.toml")))
        .unwrap_or_else(|error| panic!("{error}"));
    assert_eq!((settings.window_size_px.value, settings.fullscreen.value), ([1920, 1080], false));
    assert_eq!((settings.stereo_mode.value, settings.clock.value), (StereoMode::Anaglyph, "virtual"));
    assert_eq!(settings.meshes.value, [PathBuf::from("/etc/p/meshes"), PathBuf::from("/srv/m")]);
    let from: Vec<_> =
        settings.rows().into_iter().map(|(key, value, from, _)| format!("{key} {value} {from}")).collect();
    assert_eq!(from[0], "window.size_px [1920, 1080] /etc/p/settings.toml:2");
    assert_eq!(from[2], "window.fullscreen false u.toml:2");
    assert_eq!(from[3], "window.shadows true built in");
}

#[test]
fn the_file_in_config_says_what_is_built_in_and_its_comments_are_settings_too() {
    let read = |text: &str| {
        Settings::default().overlaid(text, Path::new("c.toml")).unwrap_or_else(|error| panic!("{error}"))
    };
    let values = |settings: &Settings| -> Vec<String> {
        settings.rows().into_iter().map(|(key, value, ..)| format!("{key} = {value}")).collect()
    };
    assert_eq!(values(&read(DEFAULT_FILE)), values(&Settings::default()));
    // What is commented out, because it has no default that could be written down.
    let lines = DEFAULT_FILE.lines().map(|line| line.strip_prefix("#: ").unwrap_or(line));
    let whole = read(&lines.collect::<Vec<_>>().join("\n"));
    let unsaid: Vec<_> =
        whole.rows().into_iter().filter(|(_, _, from, _)| from.to_string() == "built in").collect();
    assert!(unsaid.is_empty(), "keys that the file does not explain: {unsaid:?}");
}

#[test]
fn what_is_wrong_is_told_with_line_and_key() {
    assert_eq!(
        refused("[window]\nsize_px = [10, 800]\n"),
        "p.toml:2: window.size_px: found an array of length 2; allowed: an array of 2 whole numbers from 64 to 16384, width and height"
    );
    assert_eq!(
        refused("[windows]\n"),
        "p.toml:1: windows: unknown key (did you mean `window`?); allowed: window, stereo, input, data, driver, recording"
    );
    assert_eq!(
        refused("[stereo]\nmode = \"3d\"\n"),
        "p.toml:2: stereo.mode: unknown stereo mode `3d`; allowed: off, side-by-side, top-bottom, anaglyph, quad-buffer"
    );
    assert_eq!(
        refused("[data]\nmeshes = \"here\"\n"),
        "p.toml:2: data.meshes: found the string \"here\"; allowed: an array of directories, relative to this file"
    );
}
