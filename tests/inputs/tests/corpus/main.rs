//! The committed corpora, bytes that once failed, and ugly ones made of these, through every fuzz target.
//!
//! Each target has a process of its own: one whose memory grows beyond the bound ends by a failed allocation, which the test
//! then tells. `INPUT_ROUNDS=100000 cargo test -p input-targets` spoils more inputs than the usual few, `INPUT_SECONDS=60`
//! as many for each target as a minute allows, and `INPUT_FROM=7000000` others.

mod spoil;

use input_targets::{TARGETS, Target};
use patience::BoundedChild;
use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
use spoil::{Random, spoilt};
#[cfg(feature = "application")]
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// What a target may take, of address space beyond what the test itself has: twice what the fuzzer allows of memory
/// (docs/testing.md), since addresses that are reserved and not used count as well.
const MOST_BYTES: u64 = 1 << 30;
/// For one input: a hundred times what the slowest takes, so that a busy machine does not fail.
const MOST_TIME: Duration = Duration::from_secs(20);
/// Spoilt inputs for each target.
const ROUNDS: u64 = 100;
/// Set in the process that runs one target.
const TARGET: &str = "INPUT_TARGET";

/// Which inputs are spoilt: those of these numbers, and no more than this time allows.
struct Spoiling {
    from: u64,
    rounds: u64,
    time: Option<Duration>,
}

impl Spoiling {
    fn asked() -> Self {
        let time = number("INPUT_SECONDS").map(Duration::from_secs);
        let rounds = number("INPUT_ROUNDS").unwrap_or(if time.is_some() { u64::MAX } else { ROUNDS });
        Self { from: number("INPUT_FROM").unwrap_or(0), rounds, time }
    }

    /// For all inputs of a target. One that hangs is killed, and the last name among its words is that of the input.
    fn longest_run(&self) -> Duration {
        let spoilt = self.time.unwrap_or_else(|| Duration::from_millis(100) * self.rounds as u32);
        Duration::from_secs(300) + spoilt
    }
}

/// # Panics
/// If the variable is there and holds no number.
fn number(variable: &str) -> Option<u64> {
    let text = std::env::var(variable).ok()?;
    Some(text.parse().unwrap_or_else(|_| panic!("{variable} is a whole number, not {text:?}")))
}

fn inputs(target: &str) -> Vec<PathBuf> {
    let of = |place: &str| Path::new(env!("CARGO_MANIFEST_DIR")).join("../fuzz").join(place).join(target);
    let files =
        |place: &str| std::fs::read_dir(of(place)).into_iter().flatten().flatten().map(|file| file.path());
    let mut all: Vec<PathBuf> = files("corpus").chain(files("crashes")).collect();
    all.sort();
    all
}

#[test]
fn every_target_has_a_corpus() {
    for (name, _) in TARGETS {
        assert!(!inputs(name).is_empty(), "tests/fuzz/corpus/{name} is empty or not there");
    }
}

/// Names in a folder of `tests/fuzz`, without their endings.
#[cfg(feature = "application")]
fn names_in(folder: &str) -> BTreeSet<String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fuzz").join(folder);
    let entries = std::fs::read_dir(&folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let stem = |path: PathBuf| path.file_stem().expect("a name").to_str().expect("a plain name").to_owned();
    entries.map(|entry| stem(entry.expect("an entry").path())).collect()
}

/// One that is struck from the list, or whose file is, would be tried by nobody any more.
#[cfg(feature = "application")]
#[test]
fn every_target_has_a_program_for_the_fuzzer_and_every_corpus_and_program_a_target() {
    let targets: BTreeSet<String> = TARGETS.iter().map(|(name, _)| (*name).to_owned()).collect();
    assert_eq!(names_in("fuzz_targets"), targets, "tests/fuzz/fuzz_targets and TARGETS");
    assert_eq!(names_in("corpus"), targets, "tests/fuzz/corpus and TARGETS");
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fuzz/Cargo.toml");
    let manifest = std::fs::read_to_string(manifest).expect("a manifest");
    let named = manifest
        .lines()
        .filter_map(|line| line.strip_prefix("path = \"fuzz_targets/")?.strip_suffix(".rs\""));
    assert_eq!(
        named.map(str::to_owned).collect::<BTreeSet<_>>(),
        targets,
        "tests/fuzz/Cargo.toml and TARGETS"
    );
}

/// Else nobody would try them.
#[cfg(feature = "application")]
#[test]
fn inputs_that_once_failed_lie_under_the_name_of_a_target() {
    let crashes = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fuzz/crashes");
    let directories: Vec<_> = std::fs::read_dir(crashes).expect("tests/fuzz/crashes").flatten().collect();
    assert!(!directories.is_empty(), "tests/fuzz/crashes is empty");
    for directory in directories {
        let name = directory.file_name().into_string().expect("a plain name");
        assert!(TARGETS.iter().any(|(target, _)| *target == name), "{name} is no target");
    }
}

#[test]
fn all_inputs_of_every_target_end_soon_and_within_their_memory() {
    let next = AtomicUsize::new(0);
    std::thread::scope(|threads| {
        for _ in 0..std::thread::available_parallelism().map_or(1, std::num::NonZero::get) {
            threads.spawn(|| {
                while let Some((name, _)) = TARGETS.get(next.fetch_add(1, Ordering::Relaxed)) {
                    run_in_a_process(name);
                }
            });
        }
    });
}

fn run_in_a_process(name: &str) {
    let mut child = Command::new(std::env::current_exe().expect("this test"));
    child.args(["--exact", "--ignored", "--nocapture", "one_target"]).env(TARGET, name);
    let child = child.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn();
    let out = child.expect("this test once more").output_within(Spoiling::asked().longest_run());
    let said = String::from_utf8_lossy(&out.stderr);
    assert!(out.status.success(), "{name}: {}\n{said}", out.status);
    println!("{name}: {}", said.lines().last().unwrap_or_default());
}

#[test]
#[ignore = "a part of all_inputs_of_every_target_end_soon_and_within_their_memory, which starts it"]
fn one_target() {
    let Ok(name) = std::env::var(TARGET) else { return };
    let (_, target) = TARGETS.iter().find(|(other, _)| *other == name).expect("a target");
    limit_memory();
    let mut corpus = Vec::new();
    for input in inputs(&name) {
        eprintln!("{}", input.display());
        let bytes = std::fs::read(&input).expect("our own file");
        try_soon(*target, &bytes);
        corpus.push(bytes);
    }
    // Kept until the next is tried, so that what failed is there.
    let kept = std::env::temp_dir().join(format!("phantom3-spoilt-{name}-{}", std::process::id()));
    eprintln!("spoilt inputs; the one that fails is left in {}", kept.display());
    let Spoiling { from, rounds, time } = Spoiling::asked();
    let began = Instant::now();
    let mut count = 0;
    while count < rounds && time.is_none_or(|time| began.elapsed() < time) {
        let round = from.wrapping_add(count);
        count += 1;
        let mut random = Random::of(&name, round);
        let [good, other] = [0; 2].map(|_| &corpus[random.below(corpus.len())]);
        let bytes = spoilt(good, other, &mut random);
        std::fs::write(&kept, &bytes).expect("a place for it");
        try_soon(*target, &bytes);
    }
    std::fs::remove_file(&kept).expect("our own file");
    eprintln!("{count} spoilt inputs from number {from} on, in {:.1?}", began.elapsed());
}

fn try_soon(target: Target, bytes: &[u8]) {
    let began = Instant::now();
    target(bytes);
    assert!(began.elapsed() < MOST_TIME, "it took {:?}", began.elapsed());
}

fn limit_memory() {
    let status = std::fs::read_to_string("/proc/self/status").expect("a process");
    let line = status.lines().find_map(|line| line.strip_prefix("VmSize:")).expect("its size");
    let kilobytes: u64 = line.trim().trim_end_matches(" kB").parse().expect("a number");
    let Rlimit { maximum, .. } = getrlimit(Resource::As);
    setrlimit(Resource::As, Rlimit { current: Some(kilobytes * 1024 + MOST_BYTES), maximum }).expect("less");
}
