//! Units, rotations, axes and motions, beside packages of Python.

mod axes;
mod motions;
mod oracle;
mod rotations;
