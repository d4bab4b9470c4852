//! What a driver may do, and what others may do to it.

mod forbidden_call;
mod full_life;
mod rights;
mod strangers;
mod table;
