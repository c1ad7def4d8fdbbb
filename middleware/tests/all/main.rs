//! Tests of the interface for backends and other crates, in one program.

mod calls;
mod publishers;
mod small;
