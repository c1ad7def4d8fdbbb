//! Tests of queries and traversals.

mod named;
mod random;
mod texts;
mod traversals;
