//! phantom3
fn main() {}
