//! Models that others made, from the directory that `MODELS` names: OBJ files of triangles, as `phantom3 check MODEL --repair`
//! writes them. Each is made 0.1 m long.
#![allow(dead_code)]

use std::fs;
use std::path::Path;

use haptics::mesh::TriangleSoup;
use nalgebra::Vector3;

const LENGTH_M: f64 = 0.1;

/// All models of the directory, by name; none if no directory is named.
pub(crate) fn models() -> Vec<(String, TriangleSoup)> {
    let Some(directory) = std::env::var_os("MODELS") else {
        println!("passed over: MODELS names no directory");
        return Vec::new();
    };
    let mut files: Vec<_> = fs::read_dir(directory).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.retain(|file| file.extension().is_some_and(|ending| ending == "obj"));
    files.sort();
    assert!(!files.is_empty(), "there is no OBJ file in the directory that MODELS names");
    files.iter().map(|file| (file.display().to_string(), read(file))).collect()
}

fn read(file: &Path) -> TriangleSoup {
    let mut soup = TriangleSoup::default();
    for line in fs::read_to_string(file).unwrap().lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words[..] {
            ["v", ref xyz @ ..] => {
                soup.vertices.push(Vector3::from_fn(|axis, _| xyz[axis].parse().expect("a coordinate")));
            }
            ["f", a, b, c] => {
                let vertex = |word: &str| {
                    word.split('/').next().unwrap().parse::<u32>().expect("the number of a vertex, from 1")
                        - 1
                };
                soup.faces.push([a, b, c].map(vertex));
            }
            ["f", ..] => panic!("{}: a face that is no triangle: {line}", file.display()),
            _ => {}
        }
    }
    let (low, high) =
        soup.vertices.iter().fold(
            (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY)),
            |(low, high), vertex| (low.inf(vertex), high.sup(vertex)),
        );
    let (middle, scale) = (0.5 * (low + high), LENGTH_M / (high - low).max());
    soup.vertices.iter_mut().for_each(|vertex| *vertex = (*vertex - middle) * scale);
    soup
}
