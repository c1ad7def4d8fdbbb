//! Tests of robots.

mod kdl;
mod mujoco;
mod pinocchio;
mod real;
mod texts;
