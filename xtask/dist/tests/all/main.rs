//! What `cargo xtask dist` writes.

mod book;
mod crates;
mod packages;
