//! The library `librobocomp_cpp.so`: it runs a worker in C++ over the same runtime as workers in
//! Rust. `include/robocomp/abi.h` declares its interface in C, which only the headers next to it
//! use.
//!
//! - Values cross as CDR from offset 0, which the headers read and write. Bounds, ranges and
//!   encodings of middlewares are checked here, by the types of the component's description.
//! - No panic leaves this library, and no exception enters it: both become a status with a text.
//! - Bytes that cross are valid until the next call in the same direction on the same thread. Those of a
//!   sample in place have a number, and are valid until the program drops it.

mod bench;
pub mod border;
mod call;
mod component;
mod context;
mod handles;
mod parameters;
mod status;
