//! Tests of replicas of a world, in virtual time.

mod gaps;
mod network;
mod news;
mod partitions;
mod threads;
mod wrong;
