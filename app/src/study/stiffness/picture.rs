//! The study's answers as a picture: a panel for each hand and damping, stiffness against rate.

use super::Answer;
use super::case::{Case, Mode};
use super::trial::Bench;
use plot::{Axis, Chart, Figure, Look, Series};

/// The picture.
pub fn figure(bench: &Bench, answers: &[Answer]) -> Figure {
    let mut panels: Vec<(String, Vec<&Answer>)> = Vec::new();
    for answer in answers {
        let title = title(&answer.case);
        match panels.iter_mut().find(|(other, _)| *other == title) {
            Some((_, answers)) => answers.push(answer),
            None => panels.push((title, vec![answer])),
        }
    }
    let charts = panels.iter().map(|(title, answers)| chart(title, answers)).collect();
    Figure::new("The stiffest wall that does not buzz", charts).note(format!(
        "simulated arm of {:.0} g along {:?}; solid: the whole system settles below two counts; dashed: the linear loop",
        bench.plant.mass_kg * 1e3,
        bench.axis
    ))
}

fn title(case: &Case) -> String {
    format!("{}, wall damping {:.1} N s/m", case.hand.name(), case.damping_n_s_per_m)
}

fn chart(title: &str, answers: &[&Answer]) -> Chart {
    let empty = Chart::new(title, Axis::log("rate", "Hz"), Axis::log("stiffness", "N/m"));
    let modes = [Mode::SameTick, Mode::FixedPhase, Mode::NextTick];
    let with_modes = modes.into_iter().enumerate().fold(empty, |chart, (index, mode)| {
        let of_mode = || answers.iter().filter(|answer| answer.case.mode == mode);
        let measured: Vec<_> =
            of_mode().filter_map(|answer| Some((answer.case.rate_hz, answer.settled.n_per_m()?))).collect();
        let kept: Vec<_> = of_mode()
            .filter_map(|answer| Some((answer.case.rate_hz, answer.kept?.settled.n_per_m()?)))
            .collect();
        let linear: Vec<_> = of_mode()
            .filter_map(|answer| Some((answer.case.rate_hz, answer.theory.linear.n_per_m()?)))
            .collect();
        if measured.is_empty() && linear.is_empty() {
            return chart;
        }
        // A line through one rate is no line.
        let (whole, theory) =
            if measured.len() > 1 { (Look::Line, Look::Dashed) } else { (Look::Dots, Look::Dots) };
        let chart = if kept.is_empty() {
            chart
        } else {
            chart.with(
                Series::new(&format!("{}, kept passive", mode.name()), Look::Dots, kept).coloured(index),
            )
        };
        chart
            .with(Series::new(mode.name(), whole, measured).coloured(index))
            .with(Series::new(&format!("{}, linear", mode.name()), theory, linear).coloured(index))
    });
    let of_first = |answer: &&&Answer| answer.case.mode == answers[0].case.mode;
    let first = answers.iter().filter(of_first);
    let friction = first.map(|answer| (answer.case.rate_hz, answer.theory.friction)).collect();
    with_modes.with(Series::new("2 f_c / count", Look::Dashed, friction).coloured(modes.len()))
}
