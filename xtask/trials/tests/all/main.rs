//! Short runs of benchmarks and long tests, in one program: most of their time is waiting.

mod chaos;
mod deny;
mod deploy;
mod experiment;
mod soak;
