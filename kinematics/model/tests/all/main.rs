//! Tests of robots.

mod mujoco;
mod pinocchio;
mod real;
mod texts;
