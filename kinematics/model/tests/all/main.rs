//! Tests of robots.

mod pinocchio;
mod texts;
