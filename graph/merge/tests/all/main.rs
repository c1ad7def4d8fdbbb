//! Tests of replicas: they converge, as a plain log says.

mod digests;
mod dsr;
mod histories;
mod removals;
mod repair;
mod schema;
mod shared_values;
