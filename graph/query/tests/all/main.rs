//! Tests of queries and traversals.

mod bounds;
mod named;
mod prepared;
mod promotion;
mod random;
mod shared;
mod tck;
mod texts;
mod traversals;
mod units;
