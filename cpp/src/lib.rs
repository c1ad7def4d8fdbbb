//! The library `librobocomp_cpp.so`: it runs a worker in C++ over the same runtime as workers in
//! Rust. `include/robocomp/abi.h` declares its interface in C, which only the headers next to it
//! use.
//!
//! - Values cross as CDR from offset 0, which the headers read and write. Bounds, ranges and
//!   encodings of middlewares are checked here, by the types of the component's description.
//! - No panic leaves this library, and no exception enters it: both become a status with a text.
//! - Bytes that cross are valid until the next call in the same direction on the same thread.

pub mod border;
mod component;
mod context;
mod parameters;
mod status;
