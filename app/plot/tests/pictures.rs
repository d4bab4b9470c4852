//! Both formats from one description.

use plot::{Axis, Chart, Figure, Look, PlotError, Series};

fn chart() -> Chart {
    Chart::new("latency", Axis::log("latency", "us"), Axis::log("share of all", ""))
        .with(Series::new("ours", Look::Steps, vec![(0.02, 0.9), (0.05, 0.1), (1.0, 0.001), (2.0, 0.0)]))
        .with(Series::new(
            "a <reference> & more",
            Look::Dashed,
            vec![(10.0, 0.5), (40.0, 0.02), (900.0, 1e-5)],
        ))
}

#[test]
fn an_svg_holds_title_axes_with_units_and_legend_as_text() {
    let svg = Figure::new("Wake-up", vec![chart()]).note("on a quiet machine").svg().unwrap();
    for text in [
        "Wake-up",
        "on a quiet machine",
        "latency (us)",
        "share of all",
        "ours",
        "&lt;reference&gt; &amp; more",
    ] {
        assert!(svg.contains(text), "{text}\n{svg}");
    }
    assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"));
}

#[test]
fn a_png_has_twice_the_size_of_the_svg_and_ink_of_every_series() {
    let figure = Figure::new("Wake-up", vec![chart()]);
    let bytes = figure.png().unwrap();
    let mut reader = png::Decoder::new(std::io::Cursor::new(&bytes)).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut pixels).unwrap();
    let svg = figure.svg().unwrap();
    assert!(svg.contains(&format!("width=\"{}\" height=\"{}\"", info.width / 2, info.height / 2)));
    for (index, (r, g, b)) in plot::palette::COLOURS.iter().take(2).enumerate() {
        let ink = pixels.chunks(3).filter(|pixel| *pixel == [*r, *g, *b]).count();
        // A sample of the legend alone is some 60 x 5 pixels.
        assert!(ink > 600, "series {index}: {ink} pixels");
    }
}

#[test]
fn nothing_to_show_is_an_empty_chart_and_no_failure() {
    let empty = Chart::new("", Axis::linear("time", "s"), Axis::log("latency", "us"));
    let strange =
        empty.clone().with(Series::new("", Look::Line, vec![(f64::NAN, 1.0), (0.0, f64::INFINITY)]));
    for panels in [vec![], vec![empty], vec![strange]] {
        let figure = Figure::new("nothing", panels);
        assert!(figure.svg().is_ok() && figure.png().is_ok());
    }
}

#[test]
fn a_picture_beyond_reason_is_refused_with_its_size() {
    let figure = Figure { width: 100_000, panel_height: 100_000, ..Figure::new("huge", vec![chart()]) };
    assert!(matches!(figure.png(), Err(PlotError::TooLarge { width: 200_000, .. })));
}

#[test]
fn files_take_the_stem_even_if_it_holds_a_point() {
    let directory = tempfile::tempdir().unwrap();
    Figure::new("x", vec![chart()]).write(&directory.path().join("v1.2")).unwrap();
    assert!(directory.path().join("v1.2.svg").exists() && directory.path().join("v1.2.png").exists());
    let refused = Figure::new("x", vec![chart()]).write(&directory.path().join("none/x")).unwrap_err();
    assert!(refused.to_string().contains("none/x.svg"), "{refused}");
}
