//! All integration tests of the backend but those that need a process or a domain for themselves, in one program.

mod conformance;
mod qos;
