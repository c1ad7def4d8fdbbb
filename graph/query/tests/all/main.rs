//! Tests of queries and traversals.

mod named;
mod promotion;
mod random;
mod texts;
mod traversals;
