//! What backends, and the code of other crates, use of this crate, in one program.

mod calls;
mod publishers;
mod small;
