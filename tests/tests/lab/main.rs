//! The machine of a laboratory: what is installed there, set at boot, and run as a service.

mod installation;
mod machine;
mod service;
