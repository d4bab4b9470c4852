//! A scripted run in a directory of its own, watched from outside.

use crate::driver::wait_or_kill;
use crate::programs;
use crate::recording::{Sample, Table};
use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::fmt::Write as _;
use std::fs::File;
use std::io::{Read, Seek};
use std::path::{Path, PathBuf};
use std::process::{Child, Command};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;
use tempfile::TempDir;

/// Marks the processes that descend from a workplace's program.
const MARK: &str = "PHANTOM3_TEST_WORKPLACE";

/// A directory for files, one for the program's own temporary files, and no driver in sight.
#[derive(Debug)]
pub struct Workplace {
    directory: TempDir,
    temporary: TempDir,
    mark: String,
}

/// A program's end and everything it said.
#[derive(Debug)]
pub struct Said {
    /// Exit status; `None` if a signal killed it.
    pub status: Option<i32>,
    /// Standard output.
    pub out: String,
    /// Standard error.
    pub err: String,
}

impl Workplace {
    /// An empty one.
    #[expect(clippy::new_without_default, reason = "it makes directories, which nobody expects of a default")]
    pub fn new() -> Self {
        static COUNT: AtomicU64 = AtomicU64::new(0);
        let count = COUNT.fetch_add(1, Ordering::Relaxed);
        Self {
            directory: tempfile::tempdir().expect("a directory"),
            temporary: tempfile::tempdir().expect("a directory"),
            mark: format!("{}-{count}", std::process::id()),
        }
    }

    /// Where a file of this name lies.
    pub fn path(&self, name: impl AsRef<Path>) -> PathBuf {
        self.directory.path().join(name)
    }

    /// Writes a file; returns where it lies.
    pub fn write(&self, name: impl AsRef<Path>, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.path(name);
        std::fs::write(&path, bytes).expect("a file");
        path
    }

    /// `phantom3`, to be started in this directory.
    pub fn phantom3(&self) -> Command {
        self.prepare(programs::phantom3())
    }

    /// Another program, to be started in this directory with the same surroundings.
    pub fn prepare(&self, command: Command) -> Command {
        let mut command = command;
        command
            .current_dir(self.directory.path())
            .env("TMPDIR", self.temporary.path())
            .env("PHANTOM3_SOCKET", self.path("no-driver.sock"))
            .env(MARK, &self.mark)
            .env_remove("XDG_RUNTIME_DIR")
            .env_remove("RUNTIME_DIRECTORY");
        command
    }

    /// Runs a shell script with the program as `$0`, and `run scene.toml` and these arguments as `"$@"`, to its end.
    pub fn shell(&self, script: &str, arguments: &[&str]) -> Said {
        let mut shell = self.prepare(Command::new("sh"));
        let program = self.phantom3();
        shell.arg("-c").arg(script).arg(program.get_program()).args(["run", "scene.toml"]).args(arguments);
        Running::start(shell).wait()
    }

    /// Runs `phantom3` to its end.
    pub fn run<I: IntoIterator<Item = S>, S: AsRef<OsStr>>(&self, arguments: I) -> Said {
        let mut program = self.phantom3();
        program.args(arguments);
        Running::start(program).wait()
    }

    /// Plays a scene with a hand (none if empty) on the virtual clock and returns the recording.
    pub fn play(&self, scene: &str, hand: &str, arguments: &[&str]) -> Table {
        self.write("scene.toml", scene);
        let mut all = vec!["run", "scene.toml", "--clock", "virtual", "--headless", "--record", "out.csv"];
        if !hand.is_empty() {
            self.write("hand.csv", hand);
            all.extend(["--hand", "hand.csv"]);
        }
        all.extend(arguments);
        let said = self.run(all);
        // On a busy machine it tells how far it has come.
        let is_progress = |line: &str| line.contains("phantom3: reading ") || line.trim_end().ends_with(" %");
        let told: Vec<&str> = said.err.lines().filter(|line| !is_progress(line)).collect();
        assert_eq!((said.status, told.as_slice()), (Some(0), &[][..]), "{scene}");
        Table::read(&self.path("out.csv"))
    }

    /// Every file here and among the temporary files, with its content.
    pub fn snapshot(&self) -> BTreeMap<PathBuf, Vec<u8>> {
        let mut files = BTreeMap::new();
        collect(self.directory.path(), &mut files);
        collect(self.temporary.path(), &mut files);
        files
    }

    /// Processes that the program left behind.
    pub fn processes(&self) -> Vec<u32> {
        let mark = format!("{MARK}={}\0", self.mark);
        let is_ours =
            |environment: Vec<u8>| environment.windows(mark.len()).any(|window| window == mark.as_bytes());
        let entries = std::fs::read_dir("/proc").expect("/proc").flatten();
        entries
            .filter(|entry| std::fs::read(entry.path().join("environ")).is_ok_and(is_ours))
            .filter_map(|entry| entry.file_name().to_str()?.parse().ok())
            .collect()
    }
}

impl Drop for Workplace {
    /// What a failing test leaves behind must not disturb the next one.
    fn drop(&mut self) {
        for process in self.processes() {
            let pid = rustix::process::Pid::from_raw(process.cast_signed());
            let _ = pid.map(|pid| rustix::process::kill_process(pid, rustix::process::Signal::KILL));
        }
    }
}

/// A program whose words go into files: a pipe would be held open by whatever it left behind, and waiting
/// for the pipe's end would hang the test instead of failing it.
#[derive(Debug)]
pub struct Running {
    /// The process.
    pub child: Child,
    out: File,
    err: File,
}

impl Running {
    /// Starts it.
    pub fn start(command: Command) -> Self {
        let mut command = command;
        let [out, err] = [(); 2].map(|()| tempfile::tempfile().expect("a file"));
        let same = |file: &File| file.try_clone().expect("the same file");
        command.stdout(same(&out)).stderr(same(&err));
        Self { child: spawn(&mut command), out, err }
    }

    /// What it has said on standard error until now.
    pub fn said_so_far(&self) -> String {
        use std::os::unix::fs::FileExt;
        let mut bytes = vec![0; 1 << 16];
        let length = self.err.read_at(&mut bytes, 0).expect("our own file");
        String::from_utf8_lossy(&bytes[..length]).into_owned()
    }

    /// Waits for its end.
    pub fn wait(self) -> Said {
        let Self { mut child, out, err } = self;
        let status = wait_or_kill(&mut child).code();
        let text = |mut file: File| {
            let mut bytes = Vec::new();
            file.rewind().and_then(|()| file.read_to_end(&mut bytes)).expect("our own file");
            String::from_utf8_lossy(&bytes).into_owned()
        };
        Said { status, out: text(out), err: text(err) }
    }
}

/// One play of one finger, `f0`, with [`check`](Sample::check) made on every row.
pub fn felt(scene: &str, hand: &str, arguments: &[&str]) -> Vec<Sample> {
    let samples = Workplace::new().play(scene, hand, arguments).finger("f0");
    assert!(!samples.is_empty());
    samples.iter().for_each(Sample::check);
    samples
}

/// A hand file for `f0`; numbers are printed so that they read back the same.
pub fn hand(rows: impl IntoIterator<Item = (f64, [f64; 3])>) -> String {
    let mut text = String::from("t,f0_x,f0_y,f0_z\n");
    for (t, [x, y, z]) in rows {
        let _ = writeln!(text, "{t:?},{x:?},{y:?},{z:?}");
    }
    text
}

fn collect(directory: &Path, files: &mut BTreeMap<PathBuf, Vec<u8>>) {
    for entry in std::fs::read_dir(directory).expect("a directory").flatten() {
        let path = entry.path();
        if path.is_dir() {
            collect(&path, files);
            files.insert(path, Vec::new());
        } else {
            let content = std::fs::read(&path).unwrap_or_default();
            files.insert(path, content);
        }
    }
}

/// A copy of a program may still be open for writing in a child that another thread is just starting, which has not yet
/// got to where such files are closed: the kernel then refuses to run the copy, for a moment.
pub(crate) fn spawn(command: &mut Command) -> Child {
    for _ in 0..100 {
        match command.spawn() {
            Err(error) if error.kind() == std::io::ErrorKind::ExecutableFileBusy => {
                std::thread::sleep(Duration::from_millis(10));
            }
            started => return started.expect("the program starts"),
        }
    }
    command.spawn().expect("the program starts")
}
