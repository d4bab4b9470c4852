//! Whatever the bytes, a model file ends in triangles with valid indices or in a short message.

use haptics::mesh::TriangleSoup;
use proptest::prelude::*;
use world::model::{
    ModelError, line_of_face, read_ase, read_gltf, read_obj, read_ply, read_stl, read_three_ds,
};

use crate::made::{self, Ply};
use crate::written;

fn ends_well(bytes: &[u8]) {
    for read in [read_obj, read_stl, read_ply, read_ase, read_three_ds] {
        check(read(bytes));
    }
    check(read_gltf(bytes, None));
    if let Ok(soup) = read_obj(bytes) {
        assert!(line_of_face(bytes, soup.faces.len() - 1).is_some());
        assert_eq!(line_of_face(bytes, soup.faces.len()), None);
    }
}

fn check(read: Result<TriangleSoup, ModelError>) {
    match read {
        Ok(soup) => {
            assert!(!soup.faces.is_empty());
            assert!(soup.vertices.iter().flatten().all(|x| x.is_finite()));
            assert!(soup.faces.iter().flatten().all(|index| (*index as usize) < soup.vertices.len()));
        }
        Err(error) => {
            let message = error.to_string();
            assert!(message.len() < 400 && !message.contains('\n'), "{message}");
        }
    }
}

/// A small mesh in each format.
fn good() -> impl Strategy<Value = Vec<u8>> {
    let formats = [written::Format::Obj, written::Format::Stl, written::Format::StlText];
    let (_, number, make) = written::KINDS[5];
    let soup = make(number, 0.04);
    let mut all = formats.map(|format| format.write(&soup)).to_vec();
    all.extend([Ply::Text, Ply::LittleEndian, Ply::BigEndian].map(|how| made::ply(&soup, how)));
    all.extend([made::gltf(&soup), made::glb(&made::gltf_text(&soup, ""), &made::buffer(&soup))]);
    all.extend([made::ase(&soup).into_bytes(), made::three_ds(&soup)]);
    prop::sample::select(all)
}

fn piece() -> impl Strategy<Value = Vec<u8>> {
    let words = "v |f |vt |solid |facet |normal |outer |loop |vertex |endloop |endfacet |endsolid |0 |1 |-1 |2/1 |3//3 |\
                 1e308 |-1e308 |5e-324 |nan |ply\n|element vertex |property float |end_header\n|*MESH_FACE |*MESH {|}|{|[|\"count\":|\"mode\":5|4000000000|\n|\r\n|\\\n|#|/|\0|\u{feff}|-99 |12345678901234567890 ";
    let words: Vec<Vec<u8>> = words.split('|').map(|word| word.as_bytes().to_vec()).collect();
    prop_oneof![4 => prop::sample::select(words), 1 => prop::collection::vec(any::<u8>(), 0..9)]
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(1000) })]

    #[test]
    fn any_bytes_end_in_triangles_or_a_message(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        ends_well(&bytes);
    }

    #[test]
    fn any_row_of_pieces_ends_in_triangles_or_a_message(pieces in prop::collection::vec(piece(), 0..60)) {
        ends_well(&pieces.concat());
    }

    #[test]
    fn a_good_model_spoilt_anywhere_ends_in_triangles_or_a_message(
        bytes in good(),
        changes in prop::collection::vec((any::<prop::sample::Index>(), 0usize..9, piece()), 1..4),
    ) {
        let spoilt = changes.iter().fold(bytes, |bytes, (at, cut, with)| {
            let at = at.index(bytes.len() + 1);
            let rest = bytes.get(at + cut..).unwrap_or_default();
            [&bytes[..at], with, rest].concat()
        });
        ends_well(&spoilt);
    }

    #[test]
    fn a_good_model_cut_anywhere_ends_in_triangles_or_a_message(
        bytes in good(),
        at in any::<prop::sample::Index>(),
    ) {
        ends_well(&bytes[..at.index(bytes.len())]);
    }
}

/// Patches in TOML, with numbers of them that are ugly: what is read is joined, too.
fn patches(degree: [usize; 2], extra: [usize; 2], numbers: &[f64]) -> String {
    let counts = [0, 1].map(|d| degree[d] + 1 + extra[d]);
    let knots = |d: usize| -> Vec<f64> { (0..counts[d] + degree[d] + 1).map(|k| k as f64).collect() };
    let number = |k: usize| numbers[k % numbers.len()];
    let points: Vec<[f64; 3]> =
        (0..counts[0] * counts[1]).map(|k| [k as f64, number(k), number(k / 2)]).collect();
    format!(
        "[[patch]]\ndegree = {degree:?}\nknots_u = {:?}\nknots_v = {:?}\npoints = {points:?}\n",
        knots(0),
        knots(1)
    )
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(30) })]

    #[test]
    fn any_patches_end_in_a_surface_or_a_message(
        degree in [1usize..8, 1usize..8],
        extra in [0usize..4, 0usize..4],
        numbers in prop::collection::vec(prop::sample::select(vec![0.0, 1.0, -1.0, 1e-3, 1e99, -1e-99, 1e150]), 1..5),
    ) {
        let text = patches(degree, extra, &numbers);
        let file = std::path::Path::new("any.toml");
        match world::model::read_patches(file, text.as_bytes()).map(|patches| haptics::Nurbs::build(&patches)) {
            Ok(Ok((nurbs, report))) => assert!(nurbs.extent_m().is_finite() && !report.to_string().contains('\n')),
            Ok(Err(error)) => assert!(!error.to_string().contains('\n')),
            Err(error) => assert!(!error.to_string().contains('\n')),
        }
    }
}
