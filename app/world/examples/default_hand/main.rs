//! Prints the hand file of the default scene:
//! `cargo run -p world --example default_hand > config/hands/default.csv`.

mod script;

fn main() {
    print!("{}", script::csv());
}
