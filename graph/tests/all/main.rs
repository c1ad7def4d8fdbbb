//! Tests of the property graph.

mod changes;
mod large;
mod random;
mod threads;
mod transforms;
