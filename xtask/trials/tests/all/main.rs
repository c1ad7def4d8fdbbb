//! Short runs of benchmarks and long tests, in one program: most of their time is waiting.

mod chaos;
mod convert;
mod deny;
mod deploy;
mod editor;
mod experiment;
mod fresh;
mod manifests;
mod place;
mod python;
mod soak;

use std::sync::{PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard};

static LOAD: RwLock<()> = RwLock::new(());

/// Held by a test that loads the machine with many processes: it runs alone.
fn alone() -> RwLockWriteGuard<'static, ()> {
    LOAD.write().unwrap_or_else(PoisonError::into_inner)
}

/// Held by a test that measures, but loads the machine little.
fn quiet() -> RwLockReadGuard<'static, ()> {
    LOAD.read().unwrap_or_else(PoisonError::into_inner)
}
