//! Tests of queries and traversals.

mod random;
mod texts;
mod traversals;
