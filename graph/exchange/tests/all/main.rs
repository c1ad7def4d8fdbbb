//! Tests of files of graphs.

mod blocks;
mod composites;
mod faults;
mod files;
mod parts;
mod real;
mod reflection;
mod robots;
mod shacl;
