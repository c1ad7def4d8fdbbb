//! All integration tests of SMDSL in one program.

mod language;
mod page;
mod scxml;
mod shown;
