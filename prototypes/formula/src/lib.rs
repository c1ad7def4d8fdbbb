//! Formulas: numbers for numbers, in straight lines.
//!
//! An algorithm over [`Real`](rc_quantity::Real) that runs over [`Term`]s of a [`Recorder`] records its operations
//! instead of computing. Equal operations are recorded once; what is known beforehand is computed at
//! once. [`Recorder::program`] keeps what the results need: a [`Program`], which [`Program::run`]
//! computes and [`rust`], [`c`] and [`python`] print. An [`Interpreter`] computes it without allocation.
//!
//! ```
//! use rc_formula::{Recorder, rust};
//! use rc_quantity::Real;
//! use rc_vocabulary::Primitive;
//!
//! fn height<T: Real>(angle: T, length: f64) -> T {
//!     T::constant(length) * angle.sine()
//! }
//!
//! let recorder = Recorder::new(1);
//! let angle = recorder.input(0, Primitive::F64);
//! let program = recorder.program(&[height(angle, 2.0)]);
//! assert_eq!(program.run(&[0.5]).unwrap(), [height(0.5, 2.0)]);
//! let text = rust::statements(&program, |_| "angle".to_owned());
//! assert!(text.contains("let v1: f64 = f64::sin(v0);"), "{text}");
//! ```

mod interpreter;
mod print;
mod program;
mod recorder;

pub use interpreter::Interpreter;
pub use print::{c, is_reserved, python, results, rust};
pub use program::{NOT_NEGATIVE, Node, Operand, Operation, Program, Rejected, fits};
pub use recorder::{Recorder, Term};
