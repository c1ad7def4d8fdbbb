//! All integration tests of the backend in one program, except those that need their own process or
//! domain.

mod attacker;
mod conformance;
mod qos;
