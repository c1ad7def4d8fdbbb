//! All integration tests of the SMDSL, in one program.

mod language;
mod page;
mod scxml;
mod shown;
