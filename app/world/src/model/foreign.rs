//! Files of models that are not read, and what to export instead.

use std::path::Path;

/// A kind of file by its name or its first bytes, and what helps.
struct Kind {
    name: &'static str,
    endings: &'static [&'static str],
    begins: &'static [&'static [u8]],
    advice: &'static str,
}

/// Name of the file's kind, and the remedy.
pub(super) fn foreign(file: &Path, bytes: &[u8]) -> Option<(&'static str, &'static str)> {
    let ending = file.extension().unwrap_or_default();
    let is_named = |kind: &&Kind| kind.endings.iter().any(|other| ending.eq_ignore_ascii_case(other));
    let begins = |kind: &&Kind| {
        let text = bytes.trim_ascii_start();
        kind.begins.iter().any(|begin| text.starts_with(begin)) || is_xml_of(text, kind)
    };
    let kind = KINDS.iter().find(is_named).or_else(|| KINDS.iter().find(begins))?;
    Some((kind.name, kind.advice))
}

fn is_xml_of(text: &[u8], kind: &Kind) -> bool {
    let begin = &text[..text.len().min(1000)];
    kind.name == COLLADA && text.starts_with(b"<?xml") && begin.windows(8).any(|word| word == b"<COLLADA")
}

const COLLADA: &str = "COLLADA";

const KINDS: [Kind; 10] = [
    Kind {
        name: "3D Studio MAX",
        endings: &["max"],
        begins: &[b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"],
        advice: "open it in 3ds Max and export (File, Export) as OBJ, glTF, STL or ASE (ASCII scene export)",
    },
    Kind {
        name: "Blender",
        endings: &["blend", "blend1"],
        begins: &[b"BLENDER"],
        advice: "open it in Blender and export (File, Export) as glTF 2.0 (.glb), OBJ, PLY or STL",
    },
    Kind {
        name: "3MF",
        endings: &["3mf"],
        begins: &[],
        advice: "open it in a slicer (PrusaSlicer: File, Export, Export plate as STL) and export as STL or OBJ",
    },
    Kind {
        name: "VTK",
        endings: &["vtk", "vtp", "vtu"],
        begins: &[b"# vtk DataFile", b"<VTKFile"],
        advice: "convert it to PLY or OBJ (ParaView: File, Save Data; or `meshio convert`)",
    },
    Kind {
        name: "FBX",
        endings: &["fbx"],
        begins: &[b"Kaydara FBX Binary", b"; FBX "],
        advice: "import it in Blender and export as glTF 2.0 (.glb), or convert it with FBX2glTF or `assimp export`",
    },
    Kind {
        name: "STEP or IGES",
        endings: &["step", "stp", "iges", "igs"],
        begins: &[b"ISO-10303-21"],
        advice: "open it in a CAD program (FreeCAD: Mesh, Create mesh from shape) and export as STL, PLY or OBJ",
    },
    Kind {
        name: COLLADA,
        endings: &["dae"],
        begins: &[b"<COLLADA"],
        advice: "convert it to glTF or OBJ (`assimp export`, or Blender up to 4.5: import, then export)",
    },
    Kind {
        name: "USD",
        endings: &["usd", "usda", "usdc", "usdz"],
        begins: &[b"PXR-USDC", b"#usda"],
        advice: "import it in Blender and export as glTF 2.0 (.glb) or OBJ",
    },
    Kind {
        name: "VRML or X3D",
        endings: &["wrl", "x3d"],
        begins: &[b"#VRML", b"#X3D"],
        advice: "convert it to PLY or OBJ (MeshLab: File, Export mesh as)",
    },
    Kind {
        name: "OFF",
        endings: &["off"],
        begins: &[b"OFF\n", b"OFF\r", b"COFF", b"NOFF"],
        advice: "convert it to PLY or OBJ (MeshLab: File, Export mesh as)",
    },
];
