//! Tests of the property graph.

mod adopt;
mod changes;
mod large;
mod loops;
mod names;
mod oracle;
mod promotion;
mod random;
mod threads;
mod transforms;
