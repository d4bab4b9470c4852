//! Colours and textures that glTF files give their faces, for whoever draws them.

use crate::made::base64;
use std::path::Path;
use world::Scene;
use world::model::{self, Appearance, Wrap};
use world::seen::{Seen, SeenForm};

/// A picture of two places, red and green; red is on the left.
fn png() -> Vec<u8> {
    let mut made = Vec::new();
    let mut encoder = png::Encoder::new(&mut made, 2, 1);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header().expect("a header");
    writer.write_image_data(&[255, 0, 0, 0, 255, 0]).expect("written");
    writer.finish().expect("written");
    made
}

const MATERIALS: &str = r#"[
    {"name": "painted", "pbrMetallicRoughness": {"baseColorFactor": [1, 0.2140411, 0, 0.5],
        "baseColorTexture": {"index": 0, "extensions": {"KHR_texture_transform":
            {"offset": [0.5, 0], "rotation": 0, "scale": [0.5, 2]}}}}},
    {"alphaMode": "BLEND", "pbrMetallicRoughness": {"baseColorFactor": [0, 0, 1, 0.25]}},
    {"name": "says nothing"}]"#;

/// Three triangles and a fourth of no material, one above the other; the first has texture coordinates.
fn gltf(materials: &str, image: &str) -> String {
    let numbers = [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.25, 0.5, 1.0, 0.0, 0.0, 1.0];
    let bytes: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
    let primitive =
        |material: &str| format!("{{\"attributes\":{{\"POSITION\":0,\"TEXCOORD_0\":1}}{material}}}");
    let mesh = |index: usize, material: &str| {
        format!("{{\"name\":\"m{index}\",\"primitives\":[{}]}}", primitive(material))
    };
    let meshes = [",\"material\":0", ",\"material\":1", ",\"material\":2", ""];
    let meshes: Vec<String> = meshes.iter().enumerate().map(|(index, of)| mesh(index, of)).collect();
    let nodes: Vec<String> =
        (0..4).map(|mesh| format!("{{\"mesh\":{mesh},\"translation\":[0,0,{mesh}]}}")).collect();
    format!(
        "{{\"asset\":{{\"version\":\"2.0\"}},\"nodes\":[{}],\"meshes\":[{}],\"materials\":{materials},\
         \"textures\":[{{\"source\":0,\"sampler\":0}}],\"samplers\":[{{\"wrapS\":33071,\"wrapT\":33648}}],\"images\":[{image}],\
         \"accessors\":[{{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"}},\
         {{\"bufferView\":1,\"componentType\":5126,\"count\":3,\"type\":\"VEC2\"}}],\
         \"bufferViews\":[{{\"buffer\":0,\"byteLength\":36}},{{\"buffer\":0,\"byteOffset\":36,\"byteLength\":24}}],\
         \"buffers\":[{{\"byteLength\":60,\"uri\":\"data:;base64,{}\"}}]}}",
        nodes.join(","),
        meshes.join(","),
        base64(&bytes)
    )
}

fn in_a_uri() -> String {
    format!("{{\"uri\":\"data:image/png;base64,{}\"}}", base64(&png()))
}

/// To a quarter of what a screen can show.
fn rounded(colour: [f64; 4]) -> [f64; 4] {
    colour.map(|share| (1000.0 * share).round() / 1000.0)
}

fn appearance(text: &str) -> Appearance {
    let file = Path::new("a.gltf");
    model::read(file, text.as_bytes()).expect("felt");
    model::read_appearance(file, text.as_bytes()).expect("read").expect("glTF has materials")
}

#[test]
fn faces_have_the_colour_and_the_texture_of_their_material() {
    let told = appearance(&gltf(MATERIALS, &in_a_uri()));
    assert_eq!((told.of_face.as_slice(), told.unread.len()), (&[0, 1, 2, 3][..], 0));
    let colours: Vec<_> = told.finishes.iter().map(|finish| finish.colour.map(rounded)).collect();
    // A light of 0.214 looks half as bright as white; opacity counts where light goes through.
    assert_eq!(colours, [Some([1.0, 0.5, 0.0, 1.0]), Some([0.0, 0.0, 1.0, 0.25]), None, None]);
    let texture = told.finishes[0].texture.as_ref().expect("it has one");
    assert_eq!((texture.size, &texture.texels[..]), ([2, 1], &[[255, 0, 0, 255], [0, 255, 0, 255]][..]));
    assert_eq!(texture.wraps, [Wrap::Edge, Wrap::Mirror]);
    // Half as wide from the middle on, and twice as high.
    assert_eq!(told.uv[0], [[0.625, 1.0], [1.0, 0.0], [0.5, 2.0]]);
}

#[test]
fn light_goes_through_a_texture_as_its_material_says() {
    let half = |mode: &str| {
        let mut made = Vec::new();
        let mut encoder = png::Encoder::new(&mut made, 2, 1);
        encoder.set_color(png::ColorType::Rgba);
        encoder.set_depth(png::BitDepth::Eight);
        let mut writer = encoder.write_header().expect("a header");
        writer.write_image_data(&[255, 0, 0, 100, 0, 255, 0, 255]).expect("written");
        writer.finish().expect("written");
        let image = format!("{{\"uri\":\"data:;base64,{}\"}}", base64(&made));
        let materials =
            MATERIALS.replace("{\"name\": \"painted\",", &format!("{{\"name\": \"painted\",{mode}"));
        let told = appearance(&gltf(&materials, &image));
        let texture = told.finishes[0].texture.clone().expect("it has one");
        (texture.is_clear, texture.texels.iter().map(|texel| texel[3]).collect::<Vec<_>>())
    };
    assert_eq!(half(""), (false, vec![255, 255]));
    assert_eq!(half("\"alphaMode\":\"BLEND\","), (true, vec![100, 255]));
    assert_eq!(half("\"alphaMode\":\"MASK\","), (true, vec![0, 255]));
    assert_eq!(half("\"alphaMode\":\"MASK\",\"alphaCutoff\":0.3,"), (false, vec![255, 255]));
}

#[test]
fn texture_coordinates_that_are_none_leave_the_rest_of_a_model_as_it_looks() {
    let text = gltf(MATERIALS, &in_a_uri());
    for (from, to, words) in [
        (
            "\"index\": 0,",
            "\"index\": 0, \"texCoord\": 1,",
            "meshes[0].primitives[0]: found no texture coordinates of set 1",
        ),
        ("\"type\":\"VEC2\"", "\"type\":\"VEC3\"", "accessors[1].type: found \"VEC3\"; allowed: VEC2"),
        ("\"index\": 0,", "\"index\": 9,", "textures[9]: found no picture of its own"),
    ] {
        assert!(text.contains(from), "{from}");
        let told = appearance(&text.replace(from, to));
        assert!(told.unread.len() == 1 && told.unread[0].starts_with(words), "{words}: {:?}", told.unread);
        assert!(told.finishes[1].colour.is_some() && told.uv.len() == 4);
    }
}

#[test]
fn a_model_names_the_files_that_it_consists_of() {
    let place = tempfile::tempdir().expect("a directory");
    let text = gltf(MATERIALS, r#"{"uri":"a%20b/c.png"},{"uri":"../d.png"},{"bufferView":0}"#);
    let text = text.replace("\"buffers\":[", "\"buffers\":[{\"byteLength\":1,\"uri\":\"e.bin\"},");
    let file = place.path().join("a.gltf");
    std::fs::write(&file, text).expect("written");
    assert_eq!(model::files_beside(&file), ["e.bin", "a b/c.png"].map(std::path::PathBuf::from));
    assert_eq!(model::files_beside(&place.path().join("none.gltf")), Vec::<std::path::PathBuf>::new());
}

#[test]
fn what_is_wrong_with_looks_is_told_and_what_can_be_felt_stays() {
    let cases = [
        (
            MATERIALS,
            r#"{"uri":"data:image/webp;base64,UklGRgAAAABXRUJQ"}"#,
            "images[0]: found a WebP file; allowed: a PNG or JPEG file of",
        ),
        (
            MATERIALS,
            r#"{"bufferView":1}"#,
            "images[0]: found a file of another kind; allowed: a PNG or JPEG file of",
        ),
        (MATERIALS, r#"{"bufferView":9}"#, "bufferViews[9]: found a reference to nothing; allowed: 0 to 1"),
        (
            MATERIALS,
            r#"{"uri":"../a.png"}"#,
            "images[0].uri: found `../a.png`; allowed: a file beside this one",
        ),
    ];
    for (materials, image, words) in cases {
        let told = appearance(&gltf(materials, image));
        assert!(told.unread.len() == 1 && told.unread[0].starts_with(words), "{words}: {:?}", told.unread);
        // The colour is there all the same.
        assert!(told.finishes[0].texture.is_none() && told.finishes[0].colour.is_some());
    }
    // Of lists that are none nothing is believed.
    for (from, to) in [
        ("\"images\":[", "\"images\":7,\"x\":["),
        ("\"baseColorFactor\": [1,", "\"baseColorFactor\": [\"1\","),
    ] {
        let text = gltf(MATERIALS, &in_a_uri());
        assert!(text.contains(from));
        let told = appearance(&text.replace(from, to));
        assert!(told.finishes[0].texture.is_none(), "{to}");
    }
}

fn seen(text: &str, visual: &str) -> (Scene, tempfile::TempDir) {
    let place = tempfile::tempdir().expect("a directory");
    std::fs::write(place.path().join("a.gltf"), text).expect("written");
    let text = format!("[[finger]]\n[[entity]]\nshape = {{ kind = \"mesh\", file = \"a.gltf\" }}\n{visual}");
    let scene = Scene::parse(&text, &place.path().join("s.toml")).unwrap_or_else(|error| panic!("{error}"));
    (scene, place)
}

fn parts(seen: &Seen<'_>) -> Vec<([f64; 4], bool, usize, bool)> {
    let part = |part: &world::seen::SeenPart<'_>| {
        let SeenForm::Triangles { soup, painting, .. } = &part.form else { panic!("{:?}", part.form) };
        assert!(painting.as_ref().is_none_or(|painting| painting.uv.len() == soup.faces.len()));
        (rounded(part.colour), part.is_coloured, soup.faces.len(), painting.is_some())
    };
    seen.parts.iter().map(part).collect()
}

#[test]
fn a_file_says_how_it_looks_where_the_scene_does_not() {
    let text = gltf(MATERIALS, &in_a_uri());
    let grey = world::VisualSpec::DEFAULT_COLOUR;
    let (scene, _place) = seen(&text, "");
    let all = parts(&scene.seen());
    let [painted, clear, rest @ ..] = &all[..] else { panic!("{all:?}") };
    assert_eq!((painted.1, painted.2, painted.3), (true, 1, true));
    assert_eq!(*clear, ([0.0, 0.0, 1.0, 0.25], true, 1, false));
    assert_eq!(rest, [(grey, false, 1, false); 2]);
    // One that the scene says comes first.
    let (scene, _place) = seen(&text, "visual = { colour = [1, 0, 0] }\n");
    assert_eq!(parts(&scene.seen()), [([1.0, 0.0, 0.0, 1.0], true, 4, false)]);
    let (scene, _place) = seen(&text, "[[entity.faces]]\nof = \"m1\"\ncolour = [1, 0, 0]\n");
    assert_eq!(parts(&scene.seen()), [(grey, true, 3, false), ([1.0, 0.0, 0.0, 1.0], true, 1, false)]);
    // A file whose materials say nothing is one part.
    let (scene, _place) = seen(&gltf("[]", &in_a_uri()), "");
    assert_eq!(parts(&scene.seen()), [(grey, false, 4, false)]);
}

#[test]
fn a_texture_that_cannot_be_read_is_told_once_with_its_place() {
    let (scene, _place) =
        seen(&gltf(MATERIALS, "{}"), "grid = { count = [2, 1, 1], spacing_m = [3, 3, 3] }\n");
    let seen = scene.seen();
    let told: Vec<String> = seen.plain.iter().map(|(at, why)| format!("{}: {why}", at.line)).collect();
    assert_eq!(
        told,
        [
            "3: images[0]: found nothing; allowed: a PNG or JPEG file of at most 67 million places, 16384 on a side"
        ]
    );
    assert_eq!(seen.parts.len(), 8);
}
