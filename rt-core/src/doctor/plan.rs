//! The fix plan: a shell script for this machine that does what the remedies say.
//!
//! Model: all steps of all findings, each once, sorted by kind; kinds that share a file (kernel command
//! line, sysctl, udev, ...) go into one of the plan's own name, so that undoing is removing it. Every
//! section says in comments what it does and how to undo it. What `config/system/install.sh` has installed is used:
//! its unit is restarted for what it sets, and a line that another file says already is not said twice.
//! Invariants: valid for `sh -n` whatever lies in the machine's files, since foreign text goes into
//! comments as one harmless line, or is quoted. A plan only adds: to files that fix plans made, which the script
//! itself makes sure of when it runs, never lines that are there; to the boot line, never a key that is there.
//! Nothing is removed or replaced, but values under `/sys` and `/proc`.

mod boot;
mod by_installation;
mod file;
mod rights;
mod settings;
#[cfg(test)]
mod tests;

use super::Finding;
use super::machine::{LoopSpec, Machine, one_line};
use super::step::{Action, Step};

/// Names that the script uses for files of its own.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlanNames {
    /// Begins the names of all files that the script makes. Nothing that is installed has such a name.
    pub prefix: String,
    /// The program that runs it, for `setcap`.
    pub program: String,
    /// Systemd units of the loop, if they are installed, get a drop-in when their name begins so.
    pub unit_prefixes: Vec<String>,
}

/// Writes the script.
#[must_use]
pub fn script(machine: &Machine<'_>, findings: &[Finding], names: &PlanNames) -> String {
    let (by_installation, steps) = by_installation::part(machine, steps_of(findings));
    let mut script = Script::new(machine.spec);
    if steps.is_empty() && by_installation.is_empty() {
        script.comment("Nothing to do.");
        return script.text;
    }
    script.preamble();
    by_hand(&mut script, &steps);
    by_installation::write(&mut script, &by_installation);
    boot::write(&mut script, machine, &steps, names);
    settings::write(&mut script, machine, &steps, names);
    rights::write(&mut script, machine, &steps, names);
    script.section("Last");
    script.comment("The kernel's command line takes effect at the next boot, a new group at the next login.");
    script.comment("Then ask the doctor again.");
    script.text
}

/// Each step once, in the order of the findings.
fn steps_of(findings: &[Finding]) -> Vec<Step> {
    let all = findings.iter().filter_map(|finding| finding.judgement.remedy.as_ref());
    let mut steps: Vec<Step> = Vec::new();
    for step in all.flat_map(|remedy| &remedy.steps) {
        if !steps
            .iter()
            .any(|other| other.action == step.action && other.action != Action::ByHand || other == step)
        {
            steps.push(step.clone());
        }
    }
    steps
}

fn by_hand(script: &mut Script, steps: &[Step]) {
    let manual: Vec<&Step> = steps.iter().filter(|step| step.action == Action::ByHand).collect();
    if manual.is_empty() {
        return;
    }
    script.section("By hand: no script should do these");
    for step in manual {
        script.comment(&format!("- {}", step.what));
    }
}

/// A shell script that grows.
struct Script {
    text: String,
}

impl Script {
    fn new(spec: &LoopSpec) -> Self {
        let mut script = Self { text: "#!/bin/sh\n".to_owned() };
        script.comment(&format!("Prepares this machine for a real-time loop on CPU {}.", spec.cpu));
        script.comment("Nothing has been changed yet. Read it, keep what you want, run it as root.");
        script
    }

    fn preamble(&mut self) {
        self.line("set -eu");
        self.line("[ \"$(id -u)\" = 0 ] || { echo 'run this as root' >&2; exit 1; }");
        self.comment(
            "Writes a value to a file of the kernel, which may refuse it (a managed interrupt, a lockdown).",
        );
        self.line("put() { printf '%s\\n' \"$1\" > \"$2\" || echo \"not taken: $1 > $2\" >&2; }");
        self.text.push_str(file::ADD);
    }

    fn section(&mut self, title: &str) {
        self.text.push('\n');
        self.comment(&format!("== {title}"));
    }

    /// What the next lines do, and how to undo that.
    fn explain(&mut self, what: &str, undo: &str) {
        self.comment(&format!("{what}; undo: {undo}"));
    }

    fn comment(&mut self, text: &str) {
        self.text.push_str("# ");
        self.text.push_str(&one_line(text, 400));
        self.text.push('\n');
    }

    fn line(&mut self, line: &str) {
        self.text.push_str(line);
        self.text.push('\n');
    }
}

/// Whether this machine runs systemd.
fn has_systemd(machine: &Machine<'_>) -> bool {
    machine.exists("/run/systemd/system")
}

/// A word as the shell takes it literally.
fn quoted(word: &str) -> String {
    match is_plain(word) {
        true => word.to_owned(),
        false => format!("'{}'", word.replace('\'', "'\\''")),
    }
}

/// Whether a word means itself to the shell, to systemd and to the boot loader.
fn is_plain(word: &str) -> bool {
    let plain = |c: char| c.is_ascii_alphanumeric() || "_./:=,+-@".contains(c);
    !word.is_empty() && word.chars().all(plain)
}
