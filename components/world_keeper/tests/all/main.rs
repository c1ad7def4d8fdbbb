//! Worlds of real processes over shared memory.

mod agent;
mod replicas;
mod wire;
