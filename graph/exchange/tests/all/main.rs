//! Tests of files of graphs.

mod faults;
mod files;
mod parts;
mod real;
