//! Tests of replicas: they converge, as a plain log says.

mod digests;
mod dsr;
mod hidden;
mod histories;
mod hostile;
mod loading;
mod removals;
mod repair;
mod schema;
mod shared_values;
