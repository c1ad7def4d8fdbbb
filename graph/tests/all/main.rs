//! Tests of the property graph.

mod changes;
mod large;
mod oracle;
mod random;
mod threads;
mod transforms;
