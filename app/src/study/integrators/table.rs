//! The study's answers as tables for people, as CSV, and as a picture.

use super::spin;
use super::{Held, IntegratorsArgs, Leant, Spun};
use crate::study::stiffness::search::{Found, LEAST_N_PER_M, MOST_N_PER_M};
use physics::Integrator;
use plot::{Axis, Chart, Figure, Look, Series};
use std::fmt::Write as _;

const EXPLANATION: &str = "\
energy    largest error of the energy of a body of three different moments that nothing presses, as a share
momentum  the like of its angular momentum, direction included
fastest   how fast it turned at most, as a multiple of the first; more than 2.6 is impossible
lean      by what a tick multiplies the lean of a spinning disc that is turned a little, and what theory says: 1 where
          the angular momentum is carried; with Euler's method more, by the turn of a tick squared, of which the printed
          equation makes 1/J times as much
stays     the largest stiffness of two still fingers that hold a ball, below the first one that throws it by more than
          four times what they push it; within 1 %
implicit  contact forces of the end of the tick; angular momentum kept, axes at the tick's middle: the default
rk4       classical Runge-Kutta, contact points frozen for the tick
thesis-euler             forces of the tick's beginning, no gyroscopic torque (Melder eq. 5.9)
thesis-euler-gyroscopic  with it (eq. 5.8)
thesis-euler-printed     with it as eq. 5.15 and 8.1 print it, without its J: runs away (ch. 8.2.6)
Theory for Euler's method and two springs without damping: 2 k dt^2 / m < 4.
";

/// Errors that are drawn: what is exact has a place on the axis, too, and what runs away.
const LEAST_DRAWN: f64 = 1e-17;
const MOST_DRAWN: f64 = 1e3;

/// For people.
pub fn text(args: &IntegratorsArgs, spun: &[Spun], leant: &[Leant], held: &[Held]) -> String {
    let mut text = format!(
        "{:<24} {:>9} {:>11} {:>11} {:>9}\n",
        "turning freely", "rad/s", "energy", "momentum", "fastest"
    );
    for Spun { integrator, spin_rad_s, errors } in spun {
        // Writing to a string cannot fail.
        let _ = write!(
            text,
            "{:<24} {:>9} {:>11.2e} {:>11.2e} {:>9}",
            integrator.name(),
            spin_rad_s,
            errors.energy,
            errors.momentum,
            short(errors.fastest)
        );
        let lost =
            errors.lost_s.map_or_else(String::new, |at| format!("  no number any more after {at:.3} s"));
        let _ = writeln!(text, "{lost}");
    }
    let _ = writeln!(
        text,
        "over {} s at {} Hz\n\n{:<24} {:>9} {:>11} {:>11}",
        args.seconds, args.rate, "a spinning disc's lean", "rad/s", "a tick", "in theory"
    );
    for Leant { integrator, spin_rad_s, growth: [found, theory] } in leant {
        let _ = writeln!(text, "{:<24} {spin_rad_s:>9} {found:>11.6} {theory:>11.6}", integrator.name());
    }
    let _ = writeln!(text, "\n{:<24} {:>9} {:>15}", "held by two fingers", "kg", "stays to N/m");
    for Held { integrator, mass_kg, stiffness } in held {
        let _ = writeln!(text, "{:<24} {:>9} {:>15}", integrator.name(), mass_kg, shown(*stiffness));
    }
    let _ = writeln!(text, "at {} Hz, contact damping {} N s/m\n\n{EXPLANATION}", args.rate, args.damping);
    text
}

/// A few digits, whatever the size.
fn short(number: f64) -> String {
    if number < 1e4 { format!("{number:.3}") } else { format!("{number:.1e}") }
}

fn shown(found: Found) -> String {
    match found {
        Found::Limit(stiffness) => format!("{stiffness:.0}"),
        Found::None => format!("<{LEAST_N_PER_M:.0}"),
        Found::All => format!("beyond {MOST_N_PER_M:.0}"),
    }
}

/// For programs.
pub fn spin_csv(spun: &[Spun]) -> String {
    let mut text = String::from("integrator,spin_rad_s,energy_error,momentum_error,lost_s,fastest\n");
    for Spun { integrator, spin_rad_s, errors } in spun {
        let spin::Errors { energy, momentum, fastest, lost_s } = errors;
        let lost = lost_s.map_or_else(String::new, |at| at.to_string());
        let _ = writeln!(text, "{},{spin_rad_s},{energy},{momentum},{lost},{fastest}", integrator.name());
    }
    text
}

/// For programs.
pub fn lean_csv(leant: &[Leant]) -> String {
    let mut text = String::from("integrator,spin_rad_s,growth,growth_in_theory\n");
    for Leant { integrator, spin_rad_s, growth: [found, theory] } in leant {
        let _ = writeln!(text, "{},{spin_rad_s},{found},{theory}", integrator.name());
    }
    text
}

/// For programs: a limit that was not reached is the largest tried, with `beyond` 1; empty where none stays.
pub fn held_csv(held: &[Held]) -> String {
    let mut text = String::from("integrator,mass_kg,stays_n_per_m,beyond\n");
    for Held { integrator, mass_kg, stiffness } in held {
        let number = stiffness.n_per_m().map_or_else(String::new, |n| n.to_string());
        let beyond = u8::from(*stiffness == Found::All);
        let _ = writeln!(text, "{},{mass_kg},{number},{beyond}", integrator.name());
    }
    text
}

/// The picture.
pub fn figure(args: &IntegratorsArgs, spun: &[Spun], held: &[Held]) -> Figure {
    let energy =
        Chart::new("Energy of a body that turns freely", Axis::log("spin", "rad/s"), Axis::log("error", "1"));
    let momentum = Chart::new("Its angular momentum", Axis::log("spin", "rad/s"), Axis::log("error", "1"));
    let stiffness = Chart::new("Held by two fingers", Axis::log("mass", "kg"), Axis::log("stiffness", "N/m"));
    let on_axis = |error: f64| error.clamp(LEAST_DRAWN, MOST_DRAWN);
    let curve = |chart: Chart, of: &dyn Fn(&Spun) -> f64| {
        each(&args.integrators, chart, spun.len() / args.integrators.len().max(1), &|integrator| {
            let own = spun.iter().filter(|spun| spun.integrator == integrator);
            own.map(|spun| (spun.spin_rad_s, on_axis(of(spun)))).collect()
        })
    };
    let stays = each(&args.integrators, stiffness, args.masses.len(), &|integrator| {
        let own = held.iter().filter(|held| held.integrator == integrator);
        own.filter_map(|held| Some((held.mass_kg, held.stiffness.n_per_m()?))).collect()
    });
    let charts =
        vec![curve(energy, &|spun| spun.errors.energy), curve(momentum, &|spun| spun.errors.momentum), stays];
    Figure::new("Integrators", charts).note(format!(
        "{} s of turning, {} Hz; two still fingers, contact damping {} N s/m; up to {MOST_N_PER_M} N/m tried; errors below {LEAST_DRAWN:e} as {LEAST_DRAWN:e}, above {MOST_DRAWN:e} as {MOST_DRAWN:e}",
        args.seconds, args.rate, args.damping
    ))
}

fn each(
    integrators: &[Integrator],
    chart: Chart,
    count: usize,
    points: &dyn Fn(Integrator) -> Vec<(f64, f64)>,
) -> Chart {
    // A line through one point is no line.
    let look = if count > 1 { Look::Line } else { Look::Dots };
    integrators.iter().enumerate().fold(chart, |chart, (index, &integrator)| {
        let points = points(integrator);
        if points.is_empty() {
            return chart;
        }
        chart.with(Series::new(integrator.name(), look, points).coloured(index))
    })
}
