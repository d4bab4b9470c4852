//! Models in the formats that only tests write.

use haptics::mesh::TriangleSoup;
use std::fmt::Write;

/// Encodings of PLY.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Ply {
    Text,
    LittleEndian,
    BigEndian,
}

fn f32s(soup: &TriangleSoup) -> impl Iterator<Item = [f32; 3]> {
    soup.vertices.iter().map(|vertex| vertex.data.0[0].map(|x| x as f32))
}

/// With a colour and a quality that nobody asks for.
pub(crate) fn ply(soup: &TriangleSoup, how: Ply) -> Vec<u8> {
    let format = match how {
        Ply::Text => "ascii",
        Ply::LittleEndian => "binary_little_endian",
        Ply::BigEndian => "binary_big_endian",
    };
    let (vertices, faces) = (soup.vertices.len(), soup.faces.len());
    let mut bytes = format!(
        "ply\nformat {format} 1.0\ncomment made\nelement vertex {vertices}\nproperty float x\nproperty float y\n\
         property uchar red\nproperty float z\nelement face {faces}\nproperty float quality\n\
         property list uchar int vertex_indices\nend_header\n"
    )
    .into_bytes();
    if how == Ply::Text {
        let mut text = String::new();
        for [x, y, z] in f32s(soup) {
            let _ = writeln!(text, "{x} {y} 200 {z}");
        }
        for [a, b, c] in &soup.faces {
            let _ = writeln!(text, "nan 3 {a} {b} {c}");
        }
        bytes.extend(text.bytes());
        return bytes;
    }
    let word = |bits: u32| if how == Ply::BigEndian { bits.to_be_bytes() } else { bits.to_le_bytes() };
    for [x, y, z] in f32s(soup) {
        bytes.extend([x, y].into_iter().flat_map(|x| word(x.to_bits())));
        bytes.push(200);
        bytes.extend(word(z.to_bits()));
    }
    for face in &soup.faces {
        bytes.extend(word(f32::NAN.to_bits()));
        bytes.push(3);
        bytes.extend(face.iter().flat_map(|&index| word(index)));
    }
    bytes
}

/// Positions, then indices.
pub(crate) fn buffer(soup: &TriangleSoup) -> Vec<u8> {
    let positions = f32s(soup).flatten().flat_map(f32::to_le_bytes);
    positions.chain(soup.faces.iter().flatten().flat_map(|index| index.to_le_bytes())).collect()
}

/// The text of a glTF file; `buffer` is the inside of its buffer's object.
pub(crate) fn gltf_text(soup: &TriangleSoup, buffer: &str) -> String {
    let (positions, indices) = (12 * soup.vertices.len(), 12 * soup.faces.len());
    format!(
        "{{\"asset\":{{\"version\":\"2.0\"}},\"scene\":0,\"scenes\":[{{\"nodes\":[0]}}],\"nodes\":[{{\"mesh\":0}}],\
         \"meshes\":[{{\"primitives\":[{{\"attributes\":{{\"POSITION\":0}},\"indices\":1,\"material\":7}}]}}],\
         \"accessors\":[{{\"bufferView\":0,\"componentType\":5126,\"count\":{},\"type\":\"VEC3\"}},\
         {{\"bufferView\":1,\"componentType\":5125,\"count\":{},\"type\":\"SCALAR\"}}],\
         \"bufferViews\":[{{\"buffer\":0,\"byteLength\":{positions}}},\
         {{\"buffer\":0,\"byteOffset\":{positions},\"byteLength\":{indices}}}],\
         \"buffers\":[{{{buffer}\"byteLength\":{}}}]}}",
        soup.vertices.len(),
        3 * soup.faces.len(),
        positions + indices,
    )
}

pub(crate) fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::new();
    for part in bytes.chunks(3) {
        let bits =
            part.iter().fold(0_u32, |bits, &byte| bits << 8 | u32::from(byte)) << (8 * (3 - part.len()));
        for digit in 0..4 {
            let is_there = digit <= part.len();
            text.push(if is_there { DIGITS[(bits >> (18 - 6 * digit)) as usize & 63] as char } else { '=' });
        }
    }
    text
}

pub(crate) fn gltf(soup: &TriangleSoup) -> Vec<u8> {
    let data = base64(&buffer(soup));
    gltf_text(soup, &format!("\"uri\":\"data:application/octet-stream;base64,{data}\",")).into_bytes()
}

pub(crate) fn glb(text: &str, binary: &[u8]) -> Vec<u8> {
    let mut text = text.as_bytes().to_vec();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut binary = binary.to_vec();
    binary.resize(binary.len().next_multiple_of(4), 0);
    let length = 28 + text.len() + binary.len();
    let word = |number: usize| (number as u32).to_le_bytes();
    [
        &b"glTF"[..],
        &word(2),
        &word(length),
        &word(text.len()),
        b"JSON",
        &text,
        &word(binary.len()),
        b"BIN\0",
        &binary,
    ]
    .concat()
}

pub(crate) fn ase(soup: &TriangleSoup) -> String {
    let mut text = String::from(
        "*3DSMAX_ASCIIEXPORT\t200\n*COMMENT \"made { by a test\"\n*SCENE {\n\t*SCENE_FILENAME \"a\"\n}\n*GEOMOBJECT {\n\
         \t*NODE_NAME \"Thing\"\n\t*NODE_TM {\n\t\t*TM_POS 100.0 200.0 300.0\n\t}\n\t*MESH {\n\t\t*TIMEVALUE 0\n\t\t*MESH_VERTEX_LIST {\n",
    );
    for (index, [x, y, z]) in f32s(soup).enumerate() {
        let _ = writeln!(text, "\t\t\t*MESH_VERTEX {index}\t{x}\t{y}\t{z}");
    }
    text.push_str("\t\t}\n\t\t*MESH_FACE_LIST {\n");
    for (index, [a, b, c]) in soup.faces.iter().enumerate() {
        let _ = writeln!(
            text,
            "\t\t\t*MESH_FACE {index}:  A: {a} B: {b} C: {c} AB: 1 BC: 1 CA: 0\t *MESH_SMOOTHING 1 \t*MESH_MTLID 0"
        );
    }
    text + "\t\t}\n\t}\n\t*PROP_MOTIONBLUR 0\n}\n"
}

pub(crate) fn chunk(kind: u16, inner: &[u8]) -> Vec<u8> {
    [&kind.to_le_bytes()[..], &(inner.len() as u32 + 6).to_le_bytes(), inner].concat()
}

/// At most 65,535 vertices and faces.
pub(crate) fn three_ds(soup: &TriangleSoup) -> Vec<u8> {
    let half = |number: usize| (number as u16).to_le_bytes();
    let mut vertices = half(soup.vertices.len()).to_vec();
    vertices.extend(f32s(soup).flatten().flat_map(f32::to_le_bytes));
    let mut faces = half(soup.faces.len()).to_vec();
    for face in &soup.faces {
        faces.extend(face.iter().flat_map(|&index| half(index as usize)));
        faces.extend([7, 0]);
    }
    // Smoothing groups follow the faces.
    faces.extend(chunk(0x4150, &vec![0; 4 * soup.faces.len()]));
    let mesh = chunk(0x4100, &[chunk(0x4110, &vertices), chunk(0x4120, &faces)].concat());
    let editor = [chunk(0x3D3E, &[3, 0, 0, 0]), chunk(0x4000, &[b"thing\0", &mesh[..]].concat())].concat();
    chunk(0x4D4D, &[chunk(2, &[3, 0, 0, 0]), chunk(0x3D3D, &editor), chunk(0xB000, &[])].concat())
}
