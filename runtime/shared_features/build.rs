//! Uses the crates that procedural macros and build scripts share with the tools; does nothing.

use cc as _;
use libc as _;
use memchr as _;
use syn3 as _;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
}
