//! Tests of the property graph.

mod changes;
mod large;
mod loops;
mod oracle;
mod random;
mod threads;
mod transforms;
