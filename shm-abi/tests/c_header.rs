//! The committed C header is the one that the sources give.
//!
//! cbindgen translates the types; it can neither evaluate the layout hash nor check what a C compiler makes
//! of the types, so both are added here: the number, and an assertion for every size and offset that the
//! sources assert in `assert_layout!`.
//!
//! After an intended change: `PHANTOM3_BLESS=1 cargo test -p shm-abi --test c_header`.

use shm_abi::LAYOUT_HASH;
use std::fmt::Write;
use std::path::{Path, PathBuf};

const BLESS: &str = "PHANTOM3_BLESS";
const GUARD_END: &str = "#endif  /* PHANTOM3_SHM_H */\n";
/// The files with what crosses the border, in the order in which the header tells it.
const SOURCES: [&str; 6] = ["layout", "frame", "command", "handshake", "doorbell", "segment/description"];

#[test]
fn the_committed_header_is_what_the_sources_give() {
    let path = root().join("include/phantom3_shm.h");
    let made = header();
    if std::env::var_os(BLESS).is_some() {
        std::fs::write(&path, &made).unwrap();
    }
    let committed = std::fs::read_to_string(&path).unwrap_or_default();
    let difference = made.lines().zip(committed.lines()).position(|(made, committed)| made != committed);
    assert!(
        made == committed,
        "{} differs from the sources (first in line {:?}); if the change is meant, run \
         `{BLESS}=1 cargo test -p shm-abi --test c_header` and commit the result",
        path.display(),
        difference.map(|line| line + 1),
    );
}

#[test]
fn the_header_asserts_every_layout_that_the_sources_assert() {
    let header = header();
    let listed: Vec<Layout> = SOURCES.iter().flat_map(|name| layouts(&source(name))).collect();
    assert_eq!(listed.len(), 17, "fifteen hashed types and the two messages");
    for layout in listed {
        assert!(header.contains(&format!("sizeof(Phantom{}) == {}", layout.name, layout.size)));
        assert!(!layout.fields.is_empty(), "{} has no fields", layout.name);
    }
    for enumeration in
        ["DriverState", "FaultReason", "ReplyKind", "RequestKind", "Verdict", "ClockMode", "WaitMode"]
    {
        assert!(header.contains(&format!("enum Phantom{enumeration}")), "{enumeration} is missing");
    }
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).to_path_buf()
}

fn source(name: &str) -> String {
    std::fs::read_to_string(root().join(format!("src/{name}.rs"))).unwrap()
}

fn header() -> String {
    let config = cbindgen::Config::from_file(root().join("cbindgen.toml")).unwrap();
    let builder = SOURCES.iter().fold(cbindgen::Builder::new().with_config(config), |builder, name| {
        builder.with_src(root().join(format!("src/{name}.rs")))
    });
    let mut bytes = Vec::new();
    builder.generate().unwrap().write(&mut bytes);
    let translated = String::from_utf8(bytes).unwrap();
    let body = translated.strip_suffix(GUARD_END).expect("cbindgen ends with the include guard");
    format!("{body}{}{GUARD_END}", trailer())
}

fn trailer() -> String {
    let mut text = format!(
        "// Hash of every type, name, size and offset of the contract; both sides must agree on it.\n\
         #define PHANTOM_LAYOUT_HASH UINT64_C(0x{LAYOUT_HASH:016x})\n\n\
         #ifdef __cplusplus\n\
         #define PHANTOM_ASSERT(what) static_assert(what, #what)\n\
         #define PHANTOM_ALIGNOF(type) alignof(type)\n\
         #else\n\
         #define PHANTOM_ASSERT(what) _Static_assert(what, #what)\n\
         #define PHANTOM_ALIGNOF(type) _Alignof(type)\n\
         #endif\n"
    );
    for Layout { name, size, align, fields } in SOURCES.iter().flat_map(|name| layouts(&source(name))) {
        writeln!(text, "\nPHANTOM_ASSERT(sizeof(Phantom{name}) == {size});").unwrap();
        if align == "64" {
            // Only where the contract asks for more than the type's own alignment.
            writeln!(text, "PHANTOM_ASSERT(PHANTOM_ALIGNOF(Phantom{name}) == {align});").unwrap();
        }
        for (field, offset) in fields {
            writeln!(text, "PHANTOM_ASSERT(offsetof(Phantom{name}, {field}) == {offset});").unwrap();
        }
    }
    text.push('\n');
    text
}

struct Layout {
    name: String,
    size: String,
    align: String,
    fields: Vec<(String, String)>,
}

/// Reads the `assert_layout!` blocks of a source. What they say is true, or the crate would not compile.
fn layouts(source: &str) -> Vec<Layout> {
    let blocks = source.split("\nassert_layout!(").skip(1);
    blocks.map(|block| layout(block.split("});").next().unwrap())).collect()
}

/// `Name: size, align {` and then a line `field: type = offset,` each, or `field: ... => { ... },` for reserved
/// words that a minor version has filled: what is in the braces stands there now.
fn layout(block: &str) -> Layout {
    let (head, body) = block.split_once('{').unwrap();
    let (name, numbers) = head.split_once(':').unwrap();
    let (size, align) = numbers.split_once(',').unwrap();
    let body = body.replace("=> {", "=>\n").replace("},", "\n");
    let fields = body.lines().filter(|line| !line.ends_with("=>")).filter_map(|line| {
        let (field, rest) = line.trim().split_once(':')?;
        let (_, offset) = rest.trim_end_matches(',').rsplit_once('=')?;
        Some((field.to_string(), offset.trim().to_string()))
    });
    Layout {
        name: name.trim().into(),
        size: size.trim().into(),
        align: align.trim().into(),
        fields: fields.collect(),
    }
}
