//! `config/system/install.sh`: what it puts where, and that it takes away no more than it brought.

mod fix_plan;

use io_driver::config::DriverConfig;
use patience::prelude::*;
use std::collections::BTreeSet;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Command, Stdio};
use system_tests::lab::{Lab, PREFIX, sources, succeed, tool, walk};
use system_tests::programs::{io_driver, phantom3, said};

const DRIVER_TOML: &str = "/etc/phantom3/driver.toml";
const MACHINE_CONF: &str = "/etc/phantom3/machine.conf";

#[test]
fn installing_a_second_time_changes_nothing() {
    let lab = Lab::bare();
    let first = lab.install(&["--cpu", "1"]);
    let before = lab.files("/");
    let second = lab.install(&[]);
    assert!(first.contains("installed ") && first.contains("reboot"), "{first}");
    assert!(second.contains("everything is in its place already"), "{second}");
    assert_eq!(before, lab.files("/"));
}

#[test]
fn uninstalling_leaves_nothing_but_what_was_there_before() {
    let lab = Lab::bare();
    lab.write("/etc/udev/rules.d/10-others.rules", "# somebody else's\n");
    let before = lab.files("/");
    lab.install(&["--cpu", "1"]);
    assert!(lab.files("/").len() > before.len() + 15);
    lab.install(&["--uninstall"]);
    assert_eq!(before, lab.files("/"));
}

#[test]
fn an_edited_file_is_kept_and_a_newer_version_put_beside_it() {
    let lab = Lab::bare();
    lab.install(&["--cpu", "1"]);
    let edited = lab.read(DRIVER_TOML).replace("rate_hz = 1000", "rate_hz = 2000");
    lab.write(DRIVER_TOML, &edited);
    let new = format!("{DRIVER_TOML}.new");

    let said = lab.install(&[]);
    assert!(!lab.path(&new).exists(), "there is nothing new");
    assert!(said.contains("kept (edited) ") && said.contains("remove it and install again"), "{said}");
    assert!(!said.contains("everything is in its place"), "{said}");
    // Another CPU makes for a new version of the file.
    for _ in 0..2 {
        lab.install(&["--cpu", "2"]);
        assert_eq!(lab.read(DRIVER_TOML), edited);
        assert!(lab.read(&new).contains("\ncpu = 2\n") && lab.read(&new).contains("rate_hz = 1000"));
    }
    let said = lab.install(&["--uninstall"]);
    assert!(said.contains("kept (edited)") && said.contains("driver.toml"), "{said}");
    let left: Vec<String> = lab.files("/etc").into_keys().collect();
    assert_eq!(left, ["/etc/phantom3", DRIVER_TOML]);
    assert_eq!(lab.read(DRIVER_TOML), edited);
    // It is remembered what that is.
    lab.install(&["--uninstall", "--purge"]);
    assert!(lab.files("/").is_empty());
}

#[test]
fn what_was_never_ours_is_not_overwritten_either() {
    let lab = Lab::bare();
    lab.write(MACHINE_CONF, "LOOP_CPU=2\n");
    lab.install(&[]);
    assert_eq!(lab.read(MACHINE_CONF), "LOOP_CPU=2\n");
    assert!(lab.read(DRIVER_TOML).contains("\ncpu = 2\n"), "the number was taken from what was there");
    lab.install(&["--uninstall"]);
    assert_eq!(lab.read(MACHINE_CONF), "LOOP_CPU=2\n");
}

#[test]
fn purging_removes_what_was_edited_as_well() {
    let lab = Lab::bare();
    lab.install(&["--cpu", "1"]);
    lab.write(DRIVER_TOML, "# edited\n");
    lab.install(&["--uninstall", "--purge"]);
    assert!(lab.files("/").is_empty());
}

#[test]
fn a_newer_version_replaces_what_was_not_edited_and_removes_what_it_no_longer_has() {
    let newer = tempfile::tempdir().expect("a directory");
    succeed(Command::new("cp").arg("-R").arg(sources()).arg(newer.path()));
    let newer = newer.path().join("system");
    let installer = fs::read_to_string(newer.join("install.sh")).expect("there");
    let without: String = installer
        .lines()
        .filter(|line| !line.contains("/tuned.conf"))
        .map(|line| format!("{line}\n"))
        .collect();
    fs::write(newer.join("install.sh"), without).expect("a file");
    fs::write(newer.join("modprobe.d/phantom3.conf"), "# newer\n").expect("a file");

    let lab = Lab::bare();
    lab.install(&["--cpu", "1"]);
    succeed(&mut lab.installer_of(&newer));
    assert_eq!(lab.read("/etc/modprobe.d/phantom3.conf"), "# newer\n");
    assert!(!lab.path("/etc/tuned/phantom3/tuned.conf").exists());
    lab.install(&["--uninstall"]);
    assert!(lab.files("/").is_empty(), "directories of files that went before are remembered");
}

#[test]
fn a_dry_run_names_every_file_and_changes_nothing() {
    let lab = Lab::bare();
    let said = lab.install(&["--dry-run", "--cpu", "1"]);
    assert!(lab.files("/").is_empty());
    lab.install(&["--cpu", "1"]);
    let (before, would) = (lab.files("/"), lab.install(&["--uninstall", "--dry-run"]));
    assert_eq!(before, lab.files("/"));
    for file in installed_files(&lab).filter(|file| !file.ends_with("/installed")) {
        let real = lab.path(&file).display().to_string();
        assert!(said.contains(&format!("would: installed {real}\n")), "{file}: {said}");
        assert!(would.contains(&format!("would: removed {real}\n")), "{file}: {would}");
    }
}

#[test]
fn every_file_of_the_sources_is_installed_and_explained() {
    let installer = fs::read_to_string(sources().join("install.sh")).expect("there");
    let readme = fs::read_to_string(sources().join("README.md")).expect("there");
    walk(&sources(), &mut |path| {
        let name = path.strip_prefix(sources()).expect("below").display().to_string();
        if path.is_file() && name != "install.sh" {
            assert!(installer.contains(&format!("$source_dir/{name}\"")), "{name} is not installed");
            assert!(
                name == "README.md" || readme.contains(&name),
                "the README does not tell what {name} is for"
            );
        }
    });
}

#[test]
fn every_path_that_an_installed_file_names_is_there_under_any_prefix() {
    for prefix in [PREFIX, "/opt/phantom3"] {
        let lab = Lab::bare();
        lab.install(&["--cpu", "1", "--prefix", prefix]);
        let mut seen = 0;
        // The manifest names the directories as well.
        let is_text = |file: &String| !file.ends_with(".md") && !file.ends_with("/installed");
        for file in installed_files(&lab).filter(is_text) {
            let text = lab.read(&file);
            assert!(prefix == PREFIX || !text.contains(PREFIX), "{file} names the default prefix");
            for path in paths_below(&text, prefix).chain(paths_below(&text, "/etc/phantom3/")) {
                assert!(lab.path(path).is_file(), "{file} names {path:?}, which is not installed");
                seen += 1;
            }
        }
        // Four programs in the units and rules, and the configuration, at the least.
        assert!(seen > 10, "{seen}");
    }
}

#[test]
fn programs_may_be_executed_and_configuration_read_by_everybody() {
    let lab = Lab::bare();
    lab.install(&["--cpu", "1"]);
    for file in installed_files(&lab) {
        let mode = fs::metadata(lab.path(&file)).expect("installed").permissions().mode() & 0o777;
        let is_program = file.contains("/bin/") || file.contains("/libexec/");
        // The manifest takes its mode from the umask.
        if !file.ends_with("/installed") {
            assert_eq!(mode, if is_program { 0o755 } else { 0o644 }, "{file}");
        }
    }
}

#[test]
fn the_driver_and_the_machine_agree_on_the_cpu() {
    let lab = Lab::bare();
    let cpu_of_driver =
        || DriverConfig::load(&lab.path(DRIVER_TOML)).expect("a good configuration").real_time.cpu;
    for (arguments, cpu) in
        [(&["--cpu", "3"][..], 3), (&[][..], 3), (&["--cpu", "2", "--fast-cpu", "1"][..], 2)]
    {
        lab.install(arguments);
        assert_eq!(cpu_of_driver(), Some(cpu));
        assert!(lab.read(MACHINE_CONF).contains(&format!("\nLOOP_CPU={cpu}\n")));
    }
    assert!(lab.read(MACHINE_CONF).contains("\nFAST_CPU=1\n"));
    // Somebody edits one of the two; the next installation brings the other into line.
    lab.write(MACHINE_CONF, "LOOP_CPU=7\n");
    lab.install(&[]);
    assert_eq!(cpu_of_driver(), Some(7));
}

#[test]
fn bad_usage_is_refused_before_anything_is_changed() {
    let empty = tempfile::tempdir().expect("a directory");
    let empty = empty.path().to_str().expect("plain");
    let own =
        "--fast-cpu: found 7, which is the CPU of the driver's loop; choose another one, or leave it out";
    let cases: [(&[&str], &str); 12] = [
        (&["--binaries", empty], "cargo build --release --workspace"),
        (&["--cpu", "two"], "--cpu: found `two`, allowed: a number, such as 3"),
        (&["--cpu", "03"], "--cpu: found `03`, allowed: a number, such as 3"),
        (&["--cpu", "8"], "--cpu: found CPU 8, allowed: 1 to 7, those of this machine but CPU 0"),
        (&["--cpu", "0"], "--cpu: found CPU 0, allowed: 1 to 7"),
        (&["--cpu", "7", "--fast-cpu", "7"], own),
        (&["--cpus", "1"], "the driver's loop needs a CPU of its own, and there is one CPU only"),
        (&["--purge"], "--purge belongs to --uninstall"),
        (&["--prefix", "here"], "--prefix: found `here`, allowed: an absolute path"),
        (&["--prefix", "/a|b"], "--prefix: found `/a|b`, allowed: an absolute path"),
        (&["--frobnicate"], "unknown option --frobnicate"),
        (&["--uninstall"], "nothing is installed"),
    ];
    for (arguments, expected) in cases {
        let lab = Lab::bare();
        let (status, _, err) = said(&lab.installer().args(arguments).bounded_output().expect("it runs"));
        assert_eq!(status, Some(2), "{arguments:?}: {err}");
        assert!(err.contains(expected), "{arguments:?}: {err}");
        assert!(lab.files("/").is_empty());
    }
}

#[test]
fn a_cpu_that_this_machine_does_not_have_is_refused() {
    let lab = Lab::bare();
    let mut installer = lab.installer_for_this_machine(&sources());
    let (status, _, err) =
        said(&installer.args(["--dry-run", "--cpu", "9999"]).bounded_output().expect("it runs"));
    assert!(status == Some(2) && err.contains("--cpu: found CPU 9999"), "{err}");
}

#[test]
fn a_destination_that_is_not_there_is_made_and_taken_away_again() {
    let lab = Lab::bare();
    let outside = tempfile::tempdir().expect("a directory");
    let destination = outside.path().join("not/yet/there");
    let programs = lab.installer().get_args().map(ToOwned::to_owned).collect::<Vec<_>>();
    let with_destination = |more: &[&str]| {
        // The installer once called itself without end here: a hang is a failure, too.
        let mut command = Command::new("timeout");
        command.args(["60", "sh"]).args(&programs).arg("--destdir").arg(&destination).args(more);
        succeed(&mut command)
    };
    with_destination(&["--cpu", "1"]);
    assert!(destination.join("etc/phantom3/driver.toml").is_file());
    with_destination(&["--uninstall"]);
    let left = || fs::read_dir(outside.path()).expect("it is ours").count();
    assert_eq!(left(), 0, "what it was in is taken away, too");

    // What others have put there stays.
    with_destination(&["--cpu", "1"]);
    fs::write(outside.path().join("not/yet/mine"), "").expect("written");
    with_destination(&["--uninstall"]);
    assert!(!destination.exists() && outside.path().join("not/yet/mine").exists());
}

#[test]
fn an_installation_that_is_interrupted_can_be_taken_away_again() {
    let lab = Lab::bare();
    let mut installer = lab.installer();
    let mut child = installer.args(["--cpu", "1"]).stdout(Stdio::piped()).spawn().expect("it runs");
    // Whoever listened goes away, as `| head` does: what is said next ends the installer.
    drop(child.stdout.take());
    assert!(!child.bounded_wait().success());
    lab.install(&["--uninstall"]);
    assert!(lab.files("/").is_empty());
}

#[test]
fn what_is_left_to_undo_by_hand_is_told_alike_by_the_installer_and_the_readme() {
    let lab = Lab::bare();
    lab.install(&["--cpu", "1"]);
    let said = lab.install(&["--uninstall"]);
    let readme = fs::read_to_string(sources().join("README.md")).expect("there");
    // Members keep a group alive when its user goes.
    for command in ["update-grub", "userdel phantom3", "groupdel phantom3"] {
        assert!(said.contains(command) && readme.contains(command), "{command}: {said}");
    }
}

#[test]
fn the_kernel_that_runs_here_has_what_sysctl_is_to_set() {
    let text = fs::read_to_string(sources().join("sysctl.d/70-phantom3.conf")).expect("there");
    let settings = text.lines().filter(|line| !line.is_empty() && !line.starts_with('#'));
    for line in settings {
        let key = line.trim_start_matches('-').split(" = ").next().expect("a key");
        let path = Path::new("/proc/sys").join(key.replace('.', "/"));
        // Debian's sysctl complains of a key that is not there, and of one that can only be read.
        let mode = fs::metadata(&path).unwrap_or_else(|error| panic!("{key}: {error}")).permissions().mode();
        assert!(mode & 0o200 != 0, "{key} can only be read on this kernel");
    }
}

#[test]
fn the_scripts_are_plain_posix_shell() {
    let scripts = ["install.sh", "libexec/phantom3-machine", "libexec/phantom3-card", "grub.d/phantom3.cfg"];
    for script in scripts.map(|name| sources().join(name)) {
        succeed(Command::new("sh").arg("-n").arg(&script));
        if let Some(mut shellcheck) = tool("shellcheck", "the other tests here run the scripts") {
            succeed(shellcheck.args(["--shell", "sh"]).arg(&script));
        }
    }
}

#[test]
fn every_command_of_the_readme_exists() {
    let readme = fs::read_to_string(sources().join("README.md")).expect("there");
    let mut tried = BTreeSet::new();
    for line in readme.split("```").skip(1).step_by(2).flat_map(str::lines) {
        let line = line.strip_prefix("sudo ").unwrap_or(line).split('#').next().unwrap_or("");
        let words: Vec<&str> = line.split_whitespace().collect();
        let (program, rest) = match words[..] {
            ["io-driver", ref rest @ ..] => (io_driver(), rest),
            ["phantom3", ref rest @ ..] => (phantom3(), rest),
            ["taskset", "--cpu-list", _, "phantom3", ref rest @ ..] => (phantom3(), rest),
            ["config/system/install.sh", ref rest @ ..] => (Lab::bare().installer(), rest),
            _ => continue,
        };
        let mut program = program;
        let help = succeed(
            program.args(rest.iter().take_while(|word| !word.starts_with('-')).take(1)).arg("--help"),
        );
        for option in rest.iter().filter(|word| word.starts_with("--")) {
            assert!(help.contains(option), "{line}: {option} is unknown");
        }
        tried.insert(line.trim().to_owned());
    }
    assert!(tried.len() >= 5, "{tried:?}");
}

fn installed_files(lab: &Lab) -> impl Iterator<Item = String> + '_ {
    lab.files("/").into_keys().filter(|file| lab.path(file).is_file())
}

/// The paths in a text that begin like this, as far as they are more than the beginning.
fn paths_below<'a>(text: &'a str, beginning: &'a str) -> impl Iterator<Item = &'a Path> {
    text.match_indices(beginning).filter_map(move |(at, _)| {
        let rest = &text[at..];
        let end = rest.find(|c: char| c.is_whitespace() || "\"';:`)".contains(c)).unwrap_or(rest.len());
        (end > beginning.len() + 1).then(|| Path::new(&rest[..end]))
    })
}
