//! Tests of the property graph.

mod changes;
mod random;
mod threads;
mod transforms;
