//! A client in C, compiled against the committed headers, talks to the real server.

mod common;

use bytemuck::Zeroable;
use common::{HANG, frame, info, wait_until};
use patience::prelude::*;
use shm_abi::server::{Server, ServerEvent};
use shm_abi::{Command, CommanderView, DriverMemory};
use std::path::{Path, PathBuf};
use std::process::{Child, Output, Stdio};
use std::time::Duration;

const FLAGS: [&str; 6] = ["-std=c11", "-Wall", "-Wextra", "-Werror", "-O2", "-pedantic"];

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The C compiler, looking for today's headers; `None` if there is none.
fn compiler() -> Option<std::process::Command> {
    let mut compiler = common::c_compiler::compiler()?;
    compiler.arg("-I").arg(root().join("include"));
    Some(compiler)
}

fn compile(directory: &Path) -> Option<PathBuf> {
    let program = directory.join("c_client");
    let compiled = compiler()?
        .args(FLAGS)
        .arg(root().join("tests/c_client.c"))
        .arg("-o")
        .arg(&program)
        .bounded_output()
        .unwrap();
    assert!(compiled.status.success(), "{}", String::from_utf8_lossy(&compiled.stderr));
    Some(program)
}

struct Driver {
    memory: DriverMemory,
    server: Server,
    events: Vec<ServerEvent>,
    directory: tempfile::TempDir,
}

impl Driver {
    fn start() -> Self {
        let directory = tempfile::tempdir().unwrap();
        let server = Server::bind(&directory.path().join("driver.sock")).unwrap();
        Self { memory: DriverMemory::create(&info()).unwrap(), server, events: Vec::new(), directory }
    }

    /// `None` without a compiler.
    fn client(&self, arguments: &[&str]) -> Option<Child> {
        let mut program = std::process::Command::new(compile(self.directory.path())?);
        program.arg(self.server.path()).args(arguments).stdout(Stdio::piped()).stderr(Stdio::piped());
        Some(program.spawn().unwrap())
    }

    fn poll(&mut self) {
        self.server.poll(&self.memory, Duration::from_millis(1), &mut self.events).unwrap();
    }

    fn serve_until_it_ends(&mut self, mut client: Child) -> Output {
        wait_until("the client ends", || {
            self.poll();
            client.try_wait().unwrap().is_some()
        });
        client.bounded_output()
    }

    fn lease(&mut self) -> CommanderView {
        wait_until("the client commands", || {
            self.poll();
            !self.events.is_empty()
        });
        match self.events.remove(0) {
            ServerEvent::LeaseGranted { view, name, .. } => {
                assert_eq!(name, "c_client");
                view
            }
            other => panic!("{other:?}"),
        }
    }

    fn publish(&self, tick: u64, commander: Option<&CommanderView>) {
        self.memory.write_frame(&frame(tick));
        self.memory.ring(tick, commander);
    }
}

#[test]
fn a_c_commander_answers_every_tick_under_its_lease() {
    const TICKS: u64 = 6_000; // more than once round the ring of frames
    let mut driver = Driver::start();
    let Some(client) = driver.client(&["command", &TICKS.to_string()]) else { return };
    let view = driver.lease();
    let mut command = Command::zeroed();
    for tick in 0..TICKS {
        driver.publish(tick, Some(&view));
        wait_until("the answer is there", || {
            let newest = view.latest_tick();
            if newest != Some(tick) {
                view.sleep_for_command(newest, &driver.memory, HANG);
            }
            newest == Some(tick)
        });
        view.read_command(tick, &mut command).unwrap();
        command.validate(tick, view.lease(), 2).unwrap();
        for (device, found) in command.devices[..2].iter().enumerate() {
            let base = tick as f64 + 10.0 * device as f64;
            assert_eq!(found.force_on_user_n, [base, base + 1.0, base + 2.0]);
        }
    }
    drop(driver.server);
    let output = client.bounded_output();
    assert_eq!(String::from_utf8_lossy(&output.stdout), format!("{TICKS} ticks whole\n"), "{output:?}");
}

#[test]
fn a_c_observer_reads_frames_without_a_lease() {
    let mut driver = Driver::start();
    (0..10).for_each(|tick| driver.publish(tick, None));
    let Some(client) = driver.client(&["observe", "10"]) else { return };
    let output = driver.serve_until_it_ends(client);
    assert_eq!(String::from_utf8_lossy(&output.stdout), "10 ticks whole\n", "{output:?}");
    assert!(driver.events.is_empty(), "{:?}", driver.events);
}

#[test]
fn a_c_client_of_another_version_prints_both_versions_and_what_to_do() {
    let mut driver = Driver::start();
    let Some(client) = driver.client(&["version"]) else { return };
    let output = driver.serve_until_it_ends(client);
    assert_eq!(output.status.code(), Some(1));
    assert_eq!(
        String::from_utf8_lossy(&output.stderr),
        format!(
            "the driver speaks ABI version {}, this program 99.7; install both from the same release\n",
            shm_abi::handshake::own_version_text()
        )
    );
}

#[test]
fn the_headers_compile_on_their_own_and_as_cpp() {
    for header in ["phantom3_shm.h", "phantom3_client.h"] {
        for language in [["-x", "c", "-std=c11"], ["-x", "c++", "-std=c++17"]] {
            let Some(mut compiler) = compiler() else { return };
            let output = compiler
                .args(language)
                .args(["-Wall", "-Wextra", "-Werror", "-fsyntax-only", "-include"])
                .arg(root().join("include").join(header))
                .arg("/dev/null")
                .bounded_output()
                .unwrap();
            let errors = String::from_utf8_lossy(&output.stderr);
            if language[1] == "c++" && !output.status.success() && errors.contains("cc1plus") {
                println!("skipped: C++ check of {header}: this compiler has no C++ part");
                continue;
            }
            assert!(output.status.success(), "{header} as {}: {errors}", language[1]);
        }
    }
}
