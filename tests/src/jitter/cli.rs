//! The program `jitter`: what was asked for, in order, and with which exit status it ends.

use crate::jitter::bank::Bank;
use crate::jitter::compare::compare;
use crate::jitter::cyclictest;
use crate::jitter::document::{Document, Surroundings};
use crate::jitter::driver_slice::DriverSlice;
use crate::jitter::error::{EXIT_FAULT, EXIT_GATE, JitterError};
use crate::jitter::gate::{Gate, LEAST_RUNS};
use crate::jitter::live::Live;
use crate::jitter::options::{self, Command, Measure, Options};
use crate::jitter::origin::Origin;
use crate::jitter::plan::{Plan, Reference};
use crate::jitter::save::{RESULT, Saver};
use crate::jitter::session::{End, Session};
use crate::jitter::{machine, pictures, roles, sheets, table};
use clap::Parser;
use io_driver::say::say;
use rt_core::signals::StopSignals;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

/// The program.
pub fn main() -> ExitCode {
    if let Some(code) = roles::play() {
        return code;
    }
    let options = Options::parse();
    let result = match &options.command {
        None => measure(&options.measure),
        Some(Command::Compare(files)) => compare_files(files),
        Some(Command::Report(report)) => report_anew(report),
        Some(Command::Judge(files)) => judge_file(files),
    };
    result.unwrap_or_else(|error| {
        say(format_args!("jitter: {error}"));
        error.exit_code()
    })
}

fn measure(options: &Measure) -> Result<ExitCode, JitterError> {
    let signals = StopSignals::install().map_err(|error| JitterError::fault("catch signals", error))?;
    let gate = options.gate.as_deref().map(Gate::load).transpose()?;
    let plan = Plan::new(options)?;
    if let Some(gate) = &gate {
        refuse_a_hopeless_gate(gate, &plan)?;
    }
    let attached = plan.attach.as_deref().map(DriverSlice::attach).transpose()?;
    let cpu = match &attached {
        Some(driver) => driver.view().info().cpu,
        None => plan.config.real_time.cpu,
    };
    let origin = Origin::now();
    let out = options.out.clone().unwrap_or_else(|| PathBuf::from(format!("jitter-{}", origin.file_name())));
    let mut saver = Saver::new(&out, Duration::from_secs(options.save_every))?;
    let surroundings = surroundings(&plan, cpu);
    if !options.quiet {
        say(format_args!("jitter: {}", plan.announce()));
        surroundings.notes.iter().for_each(|note| say(format_args!("jitter: {note}")));
    }
    let cpus = roles::keep_off(cpu);
    let live = Live::new(options.quiet, plan.expected(), plan.runs);
    let bank = Bank::new(origin, options.worst);
    let (document, end) = {
        let mut session = Session::new(&plan, cpus, &signals, bank, surroundings, &mut saver, live);
        session.look_on_at(attached);
        let end = session.run();
        (Document::new(&session.bank, &session.surroundings, &end_words(&end)), end)
    };
    if !options.quiet {
        print(&table::text(&document));
    }
    if let Some(trouble) = saver.save(&document) {
        return Err(JitterError::Lost { file: out.join(RESULT), detail: trouble });
    }
    write_rest(&document, &out, &out.join(RESULT))?;
    if !options.quiet {
        print(&format!("results    {}\n", out.display()));
    }
    conclude(&document, gate.as_ref(), &end)
}

fn refuse_a_hopeless_gate(gate: &Gate, plan: &Plan) -> Result<(), JitterError> {
    use crate::jitter::metric::Style;
    if plan.runs < gate.runs_at_least {
        return Err(JitterError::Usage(format!(
            "--gate wants {} interleaved runs at least, {} were asked for; use --runs {} or more",
            gate.runs_at_least,
            plan.runs,
            gate.runs_at_least.max(LEAST_RUNS)
        )));
    }
    match [Style::Hybrid, Style::Reference].iter().find(|style| !plan.styles.contains(style)) {
        Some(style) => Err(JitterError::Usage(format!(
            "--gate compares hybrid with reference: add {} to --styles",
            style.name()
        ))),
        None => Ok(()),
    }
}

fn surroundings(plan: &Plan, cpu: Option<usize>) -> Surroundings {
    let mut machine = machine::describe(cpu);
    if matches!(plan.reference, Reference::Cyclictest(_))
        && let Some(version) = cyclictest::version()
    {
        machine.insert("cyclictest".into(), version);
    }
    Surroundings {
        machine,
        configuration: plan.describe(),
        notes: plan.notes.clone(),
        ..Surroundings::default()
    }
}

fn end_words(end: &End) -> String {
    match end {
        End::Completed => "completed".into(),
        End::Signal(signal) => format!("signal {signal}"),
        End::Fault(why) => why.clone(),
    }
}

fn conclude(document: &Document, gate: Option<&Gate>, end: &End) -> Result<ExitCode, JitterError> {
    match end {
        End::Fault(why) => {
            say(format_args!("jitter: {why}"));
            return Ok(ExitCode::from(EXIT_FAULT));
        }
        End::Signal(signal) => return Ok(ExitCode::from(128_u8.saturating_add(*signal as u8))),
        End::Completed => {}
    }
    match gate {
        None => Ok(ExitCode::SUCCESS),
        Some(gate) => judge(gate, document).map_err(JitterError::Fault),
    }
}

fn judge(gate: &Gate, document: &Document) -> Result<ExitCode, String> {
    let verdict = gate.judge(document).map_err(|why| format!("the gate cannot be judged: {why}"))?;
    print(&format!("{verdict}\n"));
    Ok(if verdict.passed() { ExitCode::SUCCESS } else { ExitCode::from(EXIT_GATE) })
}

fn judge_file(files: &options::Judge) -> Result<ExitCode, JitterError> {
    let (gate, document) = (Gate::load(&files.gate)?, Document::load(&files.result)?);
    judge(&gate, &document).map_err(|why| JitterError::Usage(format!("{}: {why}", files.result.display())))
}

fn compare_files(files: &options::Compare) -> Result<ExitCode, JitterError> {
    let (a, b) = (Document::load(&files.a)?, Document::load(&files.b)?);
    print(&format!("A {}\nB {}\n{}\n", files.a.display(), files.b.display(), compare(&a, &b)));
    if !files.no_chart {
        let stem = files.out.clone().unwrap_or_else(|| PathBuf::from("comparison"));
        let written = pictures::comparison(&a, &b).write(&stem);
        written.map_err(|error| JitterError::Write { file: stem.clone(), detail: error.to_string() })?;
        print(&format!("charts     {}.svg and .png\n", stem.display()));
    }
    Ok(ExitCode::SUCCESS)
}

fn report_anew(report: &options::Report) -> Result<ExitCode, JitterError> {
    let document = Document::load(&report.result)?;
    let beside = report.result.parent().unwrap_or(Path::new("."));
    let out = report.out.as_deref().unwrap_or(beside);
    std::fs::create_dir_all(out)
        .map_err(|error| JitterError::Write { file: out.into(), detail: error.to_string() })?;
    print(&table::text(&document));
    write_rest(&document, out, &report.result)?;
    Ok(ExitCode::SUCCESS)
}

/// Tables and pictures of what stands in `result`.
fn write_rest(document: &Document, out: &Path, result: &Path) -> Result<(), JitterError> {
    let written = sheets::write(document, out).and_then(|()| pictures::write(document, out));
    written.map_err(|failure| failure.beside(result))
}

/// A closed pipe is how `| head` says that it has seen enough.
fn print(text: &str) {
    let mut out = std::io::stdout().lock();
    let _ = out.write_all(text.as_bytes()).and_then(|()| out.flush());
}
