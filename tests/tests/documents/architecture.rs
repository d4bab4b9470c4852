//! ARCHITECTURE.md names the sources that hold unsafe code and those that a new thing touches; the lists are complete.

use crate::root;
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

/// Paths, from the project's root, of all Rust sources of programs and libraries: no tests, benches or examples.
fn program_sources() -> Vec<String> {
    let is_program = |path: &String| {
        let mut parts = path.split('/').skip_while(|part| *part != "src");
        parts.next().is_some() && !parts.any(|part| part == "tests" || part == "tests.rs")
    };
    sources().into_iter().filter(is_program).collect()
}

/// Paths, from the project's root, of all Rust sources.
fn sources() -> Vec<String> {
    let mut found = Vec::new();
    collect(&root(), &mut found);
    let below_root =
        |path: &String| path.strip_prefix(&format!("{}/", root().display())).expect("below").to_owned();
    found.iter().map(below_root).collect()
}

fn collect(directory: &Path, found: &mut Vec<String>) {
    for entry in fs::read_dir(directory).expect("a directory").flatten() {
        let (path, name) = (entry.path(), entry.file_name().to_string_lossy().into_owned());
        if path.is_dir() && name != "target" && !name.starts_with('.') {
            collect(&path, found);
        } else if name.ends_with(".rs") {
            found.push(path.display().to_string());
        }
    }
}

fn read(path: &str) -> String {
    fs::read_to_string(root().join(path)).unwrap_or_else(|error| panic!("{path}: {error}"))
}

/// Sources with one of these words outside of comments.
fn sources_with(words: &[&str]) -> BTreeSet<String> {
    let has_word = |path: &String| {
        read(path).lines().any(|line| {
            let code = line.split("//").next().unwrap_or_default();
            words.iter().any(|word| code.contains(word))
        })
    };
    program_sources().into_iter().filter(has_word).collect()
}

/// The part of the document from a line that begins so up to the next of its kind.
fn part(document: &str, beginning: &str, end: &str) -> String {
    let at = document.find(beginning).unwrap_or_else(|| panic!("ARCHITECTURE.md has no {beginning:?}"));
    let rest = &document[at + beginning.len()..];
    rest[..rest.find(end).unwrap_or(rest.len())].to_owned()
}

/// The names in a text that stand between backticks and are paths.
fn paths_in(text: &str) -> BTreeSet<String> {
    text.split('`').skip(1).step_by(2).filter(|name| name.contains('/')).map(str::to_owned).collect()
}

fn architecture() -> String {
    read("ARCHITECTURE.md")
}

#[test]
fn unsafe_code_stands_where_the_document_says_and_nowhere_else() {
    let table: String = part(&architecture(), "\n## Unsafe code\n", "\n## ")
        .lines()
        .filter(|line| line.starts_with("| `"))
        .map(|line| format!("{line}\n"))
        .collect();
    let listed = paths_in(&table);
    let found = sources_with(&["unsafe {", "unsafe fn", "unsafe impl", "unsafe extern"]);
    let is_listed = |path: &str| {
        listed.iter().any(|entry| path == entry || entry.ends_with('/') && path.starts_with(entry))
    };
    for path in &found {
        assert!(is_listed(path), "{path} has unsafe code, which ARCHITECTURE.md does not tell");
    }
    for entry in &listed {
        let is_used =
            found.iter().any(|path| path == entry || path.starts_with(entry) && entry.ends_with('/'));
        assert!(is_used, "ARCHITECTURE.md tells of unsafe code in {entry}, which has none");
    }
}

#[test]
fn every_crate_forbids_unsafe_code_or_denies_it_but_where_it_is_needed() {
    let roots = program_sources()
        .into_iter()
        .filter(|path| path.ends_with("src/lib.rs") || path.ends_with("src/main.rs"));
    let mut seen = 0;
    for path in roots {
        let text = read(&path);
        let allowed = sources_with(&["unsafe {", "unsafe impl"]);
        let folder = path.trim_end_matches("lib.rs").trim_end_matches("main.rs");
        let has_some = allowed.iter().any(|source| source.starts_with(folder)) && path.ends_with("lib.rs");
        let lint = if has_some { "#![deny(unsafe_code)]" } else { "#![forbid(unsafe_code)]" };
        assert!(text.contains(lint), "{path} lacks {lint}");
        seen += 1;
    }
    assert!(seen >= 10, "{seen} crates");
}

#[test]
fn the_lists_of_how_a_thing_is_added_name_every_source_that_names_one_of_its_kind() {
    let document = architecture();
    let cases: [(&str, &[&str]); 4] = [
        ("\n- A new shape with a closed form", &["Shape::Torus", "ShapeSpec::Torus"]),
        ("\n- A new friction law", &["::Dahl"]),
        ("\n- A new back end of devices", &["Backend::Replay"]),
        (
            "\n- A new mechanism",
            &[
                "Kinematics::WoodenHaptics",
                "Self::WoodenHaptics",
                "for WoodenHaptics",
                "wooden_haptics::Linkage",
            ],
        ),
    ];
    for (beginning, words) in cases {
        let listed = paths_in(&part(&document, beginning, "\n- "));
        let found = sources_with(words);
        assert!(found.len() >= 3, "{words:?}: {found:?}");
        for path in found {
            assert!(listed.contains(&path), "{path} names {words:?}; the list {beginning:?} does not tell");
        }
        for path in listed {
            assert!(root().join(&path).exists(), "{beginning:?}: {path} is not there");
        }
    }
}

#[test]
fn all_files_are_there_that_the_lists_of_how_a_thing_is_added_name() {
    let lists = part(&architecture(), "\n## How a thing is added\n", "\n## ");
    let names = lists.split('`').skip(1).step_by(2).filter(|name| name.ends_with(".rs"));
    let sources = sources();
    let mut count = 0;
    for name in names {
        let ending = format!("/{name}");
        let is_there = root().join(name).exists() || sources.iter().any(|path| path.ends_with(&ending));
        assert!(is_there, "ARCHITECTURE.md tells of {name}, which is not there");
        count += 1;
    }
    assert!(count > 30, "{count}");
}

#[test]
fn the_table_of_haptics_names_every_source() {
    const DIRECTORY: &str = "app/haptics/src/";
    let table = part(&architecture(), "\n| files in `app/haptics/src` | hold |\n|---|---|\n", "\n\n");
    let sources: BTreeSet<String> = program_sources()
        .iter()
        .filter_map(|path| path.strip_prefix(DIRECTORY))
        .filter(|path| !path.ends_with("error.rs") && *path != "lib.rs")
        .map(str::to_owned)
        .collect();
    let is_there = |path: &String| {
        sources.contains(path) || path.ends_with('/') && root().join(DIRECTORY).join(path).is_dir()
    };
    let mut listed = BTreeSet::new();
    for row in table.lines() {
        // A name is one of the directory that the name before it is in, or of one above.
        let mut directory = String::new();
        for name in
            row.split('|').nth(1).unwrap_or_default().split('`').skip(1).step_by(2).flat_map(alternatives)
        {
            let above = std::iter::successors(Some(directory.clone()), |below| {
                let parent = below.strip_suffix('/')?;
                Some(parent.rfind('/').map_or(String::new(), |end| parent[..=end].to_owned()))
            });
            let found = above.map(|place| place + &name).find(is_there);
            let found =
                found.unwrap_or_else(|| panic!("ARCHITECTURE.md tells of {name}, which is not there"));
            directory = found[..found.rfind('/').map_or(0, |end| end + 1)].to_owned();
            listed.insert(found);
        }
    }
    for path in sources {
        let is_listed = listed.contains(&path)
            || listed.iter().any(|entry| entry.ends_with('/') && path.starts_with(entry.as_str()));
        assert!(is_listed, "{DIRECTORY}{path} is not in ARCHITECTURE.md's table");
    }
}

/// `{a,b}.rs` stands for two names.
fn alternatives(name: &str) -> Vec<String> {
    match name.split_once('{').and_then(|(before, rest)| Some((before, rest.split_once('}')?))) {
        Some((before, (each, after))) => each.split(',').map(|one| format!("{before}{one}{after}")).collect(),
        None => vec![name.to_owned()],
    }
}

#[test]
fn the_table_of_recordings_names_every_source_in_their_directory() {
    const DIRECTORY: &str = "app/src/record";
    let table = part(&architecture(), &format!("\n| files in `{DIRECTORY}` | hold |\n"), "\n\n");
    let cells = table.lines().filter_map(|row| row.split('|').nth(1));
    let listed: BTreeSet<&str> = cells.flat_map(|cell| cell.split('`').skip(1).step_by(2)).collect();
    let entries = fs::read_dir(root().join(DIRECTORY)).expect("a directory").flatten();
    let names = entries.map(|entry| {
        let name = entry.file_name().to_string_lossy().into_owned();
        if entry.path().is_dir() { name + "/" } else { name }
    });
    let found: BTreeSet<String> = names.filter(|name| name != "mod.rs").collect();
    assert_eq!(found.iter().map(String::as_str).collect::<BTreeSet<_>>(), listed);
}

/// Names of the packages of this workspace on which this one depends, but for its tests.
fn own_dependencies(package: &str) -> BTreeSet<String> {
    let manifest: toml::Table = read(&format!("{package}/Cargo.toml")).parse().expect("a manifest");
    let workspace: toml::Table = read("Cargo.toml").parse().expect("a manifest");
    let own = workspace["workspace"]["dependencies"].as_table().expect("a table");
    let is_own = |name: &&String| own.get(*name).is_some_and(|found| found.get("path").is_some());
    manifest["dependencies"].as_table().expect("a table").keys().filter(is_own).cloned().collect()
}

#[test]
fn whoever_steps_what_moves_is_said_to_by_the_table_of_crates_and_nobody_is_said_to_move_nothing() {
    let document = architecture();
    assert!(!document.contains("moves nothing"), "`world` steps bodies");
    let table = part(&document, "\n| crate | holds | may not know |\n|---|---|---|\n", "\n\n");
    for package in ["app/calibration", "app/haptics", "app/physics", "app/plot", "app/view", "app/world"] {
        let beginning = format!("| `{package}` |");
        let row = table.lines().find(|row| row.starts_with(&beginning));
        let row = row.unwrap_or_else(|| panic!("the table of crates has no row of {package}"));
        let is_told = row.contains("by `physics`") || package == "app/physics";
        let steps = own_dependencies(package).contains("physics") || package == "app/physics";
        assert_eq!(is_told, steps, "{package} depends on physics: {steps}; its row: {row}");
    }
}
