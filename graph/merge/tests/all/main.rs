//! Tests of replicas: they converge, as a plain log says.

mod dsr;
mod histories;
mod schema;
