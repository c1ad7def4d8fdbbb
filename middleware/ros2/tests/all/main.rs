//! All integration tests of the backend in one program, except those of a short lease, which other
//! participants of the same process would let expire.

mod arguments;
mod attacker;
mod clock;
mod conformance;
mod lifecycle;
mod mismatch;
mod parameters;
