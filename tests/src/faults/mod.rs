//! What the fault tests share: the ring as a witness, processes to kill, a finger that is pressed into a
//! table, a driver whose devices the test itself makes up, and garbage that can be had again.

pub mod amplifiers;
pub mod campaign;
pub mod commander;
pub mod flood;
pub mod heal;
pub mod hog;
pub mod hosted;
pub mod knock;
pub mod liar;
pub mod madman;
pub mod plan;
pub mod press;
pub mod process;
pub mod puppet;
pub mod random;
pub mod ring;
pub mod saboteur;
pub mod scarcity;
pub mod stand;
pub mod stuck;
pub mod terminal;
