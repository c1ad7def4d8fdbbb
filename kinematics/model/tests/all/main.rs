//! Tests of robots.

mod pinocchio;
mod real;
mod texts;
