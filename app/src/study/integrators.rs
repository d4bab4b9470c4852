//! `phantom3 study integrators`: what each way of integrating makes of a spinning body and of a light one in stiff fingers.
//!
//! Problem: an integrator for haptics has to stand a gram between fingers of 5000 N/m at 1 kHz, and a spinning body without
//! symmetry for minutes. The thesis found Euler's method sufficient (its ch. 7.5.1), and a gyroscopic torque that shut the
//! simulation down (ch. 8.2.6): as printed (eq. 5.15, 8.1) the term lost a factor, which `thesis-euler-printed` shows.
//!
//! Model: [`spin`] lets a body of three different moments turn without torque for a minute; [`lean`] turns a spinning disc a
//! little and compares what each tick makes of that with its closed form; [`held`] lets two still fingers hold a ball that is
//! pushed once, and looks for the largest stiffness that does not throw it, by mass.
//! Cost: some ten seconds of one CPU.

pub mod held;
pub mod lean;
pub mod spin;
pub mod table;

use super::stiffness::search::{Found, Search};
use crate::outcome::{RunFailure, Stop};
use crate::outputs;
use crate::progress::StatusLine;
use clap::Args;
use io_driver::say::say;
use physics::Integrator;
use rt_core::plain_text::Plain;
use rt_core::replacement;
use rt_core::signals::StopSignals;
use std::path::PathBuf;

/// What is asked.
#[derive(Debug, Args)]
pub struct IntegratorsArgs {
    /// Which: implicit, rk4, thesis-euler, thesis-euler-gyroscopic, thesis-euler-printed
    #[arg(long, value_name = "NAME,...", value_delimiter = ',', default_values = ["implicit", "rk4", "thesis-euler", "thesis-euler-gyroscopic", "thesis-euler-printed"], value_parser = parse_integrator)]
    integrators: Vec<Integrator>,
    /// How fast the body spins (rad/s)
    #[arg(long, value_name = "RAD/S,...", value_delimiter = ',', default_values_t = [1.0, 10.0, 100.0, 1000.0], value_parser = parse_spin)]
    spins: Vec<f64>,
    /// For how long it spins (s)
    #[arg(long, value_name = "S", default_value = "60", value_parser = parse_seconds)]
    seconds: f64,
    /// Masses of the ball that is held (kg)
    #[arg(long, value_name = "KG,...", value_delimiter = ',', default_values_t = [0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0], value_parser = parse_mass)]
    masses: Vec<f64>,
    /// Its contact damping (N s/m)
    #[arg(long, value_name = "B", default_value = "0", value_parser = parse_damping)]
    damping: f64,
    /// Ticks per second (Hz)
    #[arg(long, value_name = "HZ", default_value = "1000", value_parser = parse_rate)]
    rate: f64,
    /// Where the results go: integrators-spin.csv, integrators-lean.csv, integrators-stiffness.csv, integrators.svg and .png
    #[arg(long, value_name = "DIR", default_value = "study-integrators")]
    out: PathBuf,
}

/// What a spinning body became.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spun {
    /// How it was integrated.
    pub integrator: Integrator,
    /// How fast it began (rad/s).
    pub spin_rad_s: f64,
    /// Largest errors.
    pub errors: spin::Errors,
}

/// What a tick makes of a spinning disc's lean.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Leant {
    /// How it was integrated.
    pub integrator: Integrator,
    /// How fast it spins (rad/s).
    pub spin_rad_s: f64,
    /// By what it is multiplied, measured and in theory.
    pub growth: [f64; 2],
}

/// How stiff a body may be held.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Held {
    /// How it was integrated.
    pub integrator: Integrator,
    /// Of the ball (kg).
    pub mass_kg: f64,
    /// Up to where it stays (N/m).
    pub stiffness: Found,
}

/// Does the study.
///
/// # Errors
/// Results that cannot be written.
pub fn execute(args: &IntegratorsArgs, signals: &StopSignals) -> Result<Stop, RunFailure> {
    // Before the work, not after it.
    let unusable = |error: &dyn std::fmt::Display| {
        let place = args.out.display();
        RunFailure::Start(format!(
            "cannot write into {place}: {error}; name a directory that can be written with --out"
        ))
    };
    std::fs::create_dir_all(&args.out).map_err(|error| unusable(&error))?;
    tempfile::tempfile_in(&args.out).map_err(|error| unusable(&error))?;
    let dt_s = args.rate.recip();
    let count = args.integrators.len() * (args.spins.len() + args.masses.len());
    say(format_args!("phantom3: {count} cases, a second each at most"));
    let mut line = StatusLine::default();
    let mut done = 0;
    let mut told = || {
        done += 1;
        line.show(|| format!("{done} of {count} cases"));
    };
    let (mut spun, mut leant, mut held) = (Vec::new(), Vec::new(), Vec::new());
    for &integrator in &args.integrators {
        for &spin_rad_s in &args.spins {
            let Some(errors) = spin::errors(integrator, spin_rad_s, args.seconds, dt_s, &|| stops(signals))
            else {
                return Ok(interrupted(signals));
            };
            spun.push(Spun { integrator, spin_rad_s, errors });
            let theory = lean::growth_in_theory(integrator, spin_rad_s, dt_s);
            let growth = lean::growth(integrator, spin_rad_s, dt_s).map(|found| [found, theory]);
            leant.extend(growth.map(|growth| Leant { integrator, spin_rad_s, growth }));
            told();
        }
        for &mass_kg in &args.masses {
            let mut search = Search::default();
            while let Some(stiffness) = search.next() {
                if stops(signals) {
                    return Ok(interrupted(signals));
                }
                search.learn(stiffness, held::stays(integrator, mass_kg, stiffness, args.damping, dt_s));
            }
            held.push(Held { integrator, mass_kg, stiffness: search.found() });
            told();
        }
    }
    line.end();
    outputs::print(&table::text(args, &spun, &leant, &held));
    write(args, &spun, &leant, &held)?;
    Ok(Stop::Finished)
}

fn write(args: &IntegratorsArgs, spun: &[Spun], leant: &[Leant], held: &[Held]) -> Result<(), RunFailure> {
    let tables = [
        ("integrators-spin.csv", table::spin_csv(spun)),
        ("integrators-lean.csv", table::lean_csv(leant)),
        ("integrators-stiffness.csv", table::held_csv(held)),
    ];
    for (name, text) in tables {
        let file = args.out.join(name);
        replacement::write(&file, text).map_err(|error| {
            let place = file.display();
            RunFailure::Results(format!(
                "cannot write {place}: {error}; name a directory that can be written with --out"
            ))
        })?;
    }
    table::figure(args, spun, held)
        .write(&args.out.join("integrators"))
        .map_err(|error| RunFailure::Results(format!("cannot write the picture: {error}")))?;
    let place = Plain(args.out.display());
    let said = format_args!(
        "written      {place}/integrators-spin.csv, integrators-lean.csv, integrators-stiffness.csv, integrators.svg, .png"
    );
    outputs::tell(&said, false);
    Ok(())
}

fn stops(signals: &StopSignals) -> bool {
    signals.requested().is_some()
}

fn interrupted(signals: &StopSignals) -> Stop {
    Stop::Signal(signals.requested().unwrap_or(rustix::process::Signal::INT.as_raw()))
}

fn parse_integrator(text: &str) -> Result<Integrator, String> {
    let names = || Integrator::NAMES.map(|(name, _)| name).join(", ");
    Integrator::from_name(text).ok_or_else(|| format!("found `{text}`, allowed: {}", names()))
}

fn parse_spin(text: &str) -> Result<f64, String> {
    within(text, 1e-3, 1e5, "rad/s")
}

fn parse_seconds(text: &str) -> Result<f64, String> {
    within(text, 0.1, 3600.0, "s")
}

fn parse_mass(text: &str) -> Result<f64, String> {
    within(text, 1e-4, 100.0, "kg")
}

fn parse_damping(text: &str) -> Result<f64, String> {
    within(text, 0.0, 100.0, "N s/m")
}

fn parse_rate(text: &str) -> Result<f64, String> {
    within(text, 100.0, 20_000.0, "Hz")
}

fn within(text: &str, least: f64, most: f64, unit: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if (least..=most).contains(&number) => Ok(number),
        _ => Err(format!("found {text}, allowed: {least} to {most} {unit}")),
    }
}
