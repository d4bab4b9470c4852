//! Privileges of a running driver, and of others against it.

mod forbidden_call;
mod full_life;
mod rights;
mod strangers;
mod table;
