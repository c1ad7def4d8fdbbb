//! Recordings: written and read, cut, split, and opened by the libraries of others.

mod damaged;
mod files;
mod full;
mod hostile;
mod latched;
mod strangers;
mod types;
