//! Tests of replicas of a world, in virtual time.

mod dsr_files;
mod dsr_programs;
mod floods;
mod frames;
mod gaps;
mod joining;
mod network;
mod news;
mod partitions;
mod questions;
mod tf;
mod threads;
mod wrong;
