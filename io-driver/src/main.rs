//! io-driver
fn main() {}
