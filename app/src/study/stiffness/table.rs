//! The study's answers as a table for people and as CSV.

use super::Answer;
use super::kept::Kept;
use super::search::{Found, LEAST_N_PER_M, MOST_N_PER_M};
use super::trial::Bench;
use rt_core::replacement;
use std::fmt::Write as _;
use std::io;
use std::path::Path;
use thiserror::Error;

/// The results could not be written.
#[derive(Debug, Error)]
#[error("cannot write {file}: {source}; name a directory that can be written with --out")]
pub struct TableError {
    file: std::path::PathBuf,
    source: io::Error,
}

/// What the columns mean and why they differ.
const EXPLANATION: &str = "\
All in N/m; the first three are the largest below the first that fails, within 1 %; tried in steps of 25 % on the way up.
settled   no counter moves by two counts or more from 2 s after the push on
quiet     and none flickers between two counts, either
linear    the sampled linear loop of this arm and this hand, without friction and encoder steps
damped    (b + b1 + B) / (T/2 + td): the phase that holding and delay cost, against all damping; a rule of thumb
passive   (b - B) / (T/2 + td): passive under any hand whatever; 0: the wall damps more than the arm
friction  2 f_c / count: below it friction takes more than a step of the encoder gives
          b, f_c: of the arm; b1: of the grasp; B: of the wall; T: a tick; td: from reading to force, amplifier included

Why they differ. `settled` is above `linear`, because friction holds what the loop would blow up: up to an amplitude
of 4 f_c / (pi w b'), with b' the damping that is missing, which is about a count here. Without friction and encoder
steps the simulation ends where `linear` does. `quiet` hardly depends on rate and delay: what flickers is a single
count, whose force, stiffness times count, has to move the arm against friction both ways; `friction` promises
that it cannot, and this arm stands about twice as much, as it depends on where between two counts it comes to rest. `passive` has to
hold for every hand and has nothing but the arm's own damping; `damped` takes the grasp for a damper to the ground. Wall
damping helps the linear loop, with the plain difference for a velocity, more than the system, whose estimate is
calmer and some milliseconds late.
";

/// The same for the columns of a controller.
const EXPLANATION_KEPT: &str = "\
With a finger that is kept passive, by a bound of 8.5 N times what a tick can surprise it with:
kept      as settled
half      by how much the controller changes the force of a wall half as stiff as is quiet without: N rms
twice     the same for one twice as stiff as settles without
fed       the most that this one ever feeds into the hand, without and with the controller: mJ
";

/// For people.
pub fn text(bench: &Bench, answers: &[Answer]) -> String {
    let plant = &bench.plant;
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = writeln!(
        text,
        "arm along {:?}: {:.0} g with rotors, viscous {:.3} N s/m, friction {:.0} mN, a count is {:.4} mm, amplifiers {:.0} Hz\n",
        bench.axis,
        plant.mass_kg * 1e3,
        plant.viscous_n_s_per_m,
        plant.coulomb_n * 1e3,
        plant.count_m * 1e3,
        plant.amplifier_hz
    );
    let _ = writeln!(
        text,
        "{:<16} {:>7} {:<12} {:>6} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8}",
        "hand", "damping", "reply", "Hz", "settled", "quiet", "linear", "damped", "passive", "friction"
    );
    for Answer { case, settled, quiet, theory, .. } in answers {
        let _ = writeln!(
            text,
            "{:<16} {:>7.1} {:<12} {:>6.0} {:>8} {:>8} {:>8} {:>8.0} {:>8.0} {:>8.0}",
            case.hand.name(),
            case.damping_n_s_per_m,
            case.mode.name(),
            case.rate_hz,
            shown(*settled),
            shown(*quiet),
            shown(theory.linear),
            theory.damped,
            theory.passive,
            theory.friction
        );
    }
    text += "\n";
    if answers.iter().any(|answer| answer.kept.is_some()) {
        text += &kept_text(answers);
        text += "\n";
        text += EXPLANATION_KEPT;
        text += "\n";
    }
    text + EXPLANATION
}

fn kept_text(answers: &[Answer]) -> String {
    let mut text = format!(
        "{:<16} {:>7} {:<12} {:>6} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8}\n",
        "hand", "damping", "reply", "Hz", "settled", "kept", "half", "twice", "fed", "kept fed"
    );
    for Answer { case, settled, kept, .. } in answers {
        let Some(kept) = kept else { continue };
        let _ = writeln!(
            text,
            "{:<16} {:>7.1} {:<12} {:>6.0} {:>8} {:>8} {:>8.4} {:>8.4} {:>8.2} {:>8.2}",
            case.hand.name(),
            case.damping_n_s_per_m,
            case.mode.name(),
            case.rate_hz,
            shown(*settled),
            shown(kept.settled),
            kept.half.kept.changed_rms_n,
            kept.twice.kept.changed_rms_n,
            kept.twice.bare.fed_most_j * 1e3,
            kept.twice.kept.fed_most_j * 1e3
        );
    }
    text
}

fn shown(found: Found) -> String {
    match found {
        Found::Limit(stiffness) => format!("{stiffness:.0}"),
        Found::None => format!("<{LEAST_N_PER_M:.0}"),
        Found::All => format!(">={MOST_N_PER_M:.0}"),
    }
}

/// For programs. A limit that was not reached is empty where none is stable, the largest tried where all are.
///
/// # Errors
/// If it cannot be written.
pub fn write_csv(file: &Path, bench: &Bench, answers: &[Answer]) -> Result<(), TableError> {
    replacement::write(file, csv(bench, answers)).map_err(|source| TableError { file: file.into(), source })
}

fn csv(bench: &Bench, answers: &[Answer]) -> String {
    let mut text = String::from(
        "hand,axis,damping_n_s_per_m,reply,rate_hz,settled_n_per_m,quiet_n_per_m,linear_n_per_m,damped_n_per_m,passive_n_per_m,friction_n_per_m",
    );
    let has_kept = answers.iter().any(|answer| answer.kept.is_some());
    text += if has_kept { KEPT_COLUMNS } else { "" };
    text.push('\n');
    let number = |found: Found| found.n_per_m().map_or_else(String::new, |n| n.to_string());
    for Answer { case, settled, quiet, theory, kept } in answers {
        let _ = write!(
            text,
            "{},{:?},{},{},{},{},{},{},{},{},{}",
            case.hand.name(),
            bench.axis,
            case.damping_n_s_per_m,
            case.mode.name(),
            case.rate_hz,
            number(*settled),
            number(*quiet),
            number(theory.linear),
            theory.damped,
            theory.passive,
            theory.friction
        );
        if let Some(Kept { settled, half, twice }) = kept {
            let _ = write!(
                text,
                ",{},{},{},{},{},{},{}",
                number(*settled),
                half.kept.changed_rms_n,
                half.kept.changed_most_n,
                twice.kept.changed_rms_n,
                twice.kept.changed_most_n,
                twice.bare.fed_most_j,
                twice.kept.fed_most_j
            );
        }
        text.push('\n');
    }
    text
}

/// Only where they were asked for.
const KEPT_COLUMNS: &str = ",kept_n_per_m,half_changed_rms_n,half_changed_most_n,twice_changed_rms_n,\
    twice_changed_most_n,twice_fed_j,twice_kept_fed_j";
