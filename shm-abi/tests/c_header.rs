#[test]
fn t() {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let config = cbindgen::Config::from_file(root.join("cbindgen.toml")).unwrap();
    let mut b = cbindgen::Builder::new().with_config(config);
    for s in ["layout", "frame", "command", "handshake", "doorbell", "segment"] {
        b = b.with_src(root.join(format!("src/{s}.rs")));
    }
    let mut out = Vec::new();
    b.generate().unwrap().write(&mut out);
    println!("{}", String::from_utf8(out).unwrap());
}
