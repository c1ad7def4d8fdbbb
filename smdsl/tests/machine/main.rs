//! The interpreter of state machines: charts for the W3C's tests of processors, and random charts
//! beside an interpreter that follows the text of the standard.

mod allocation;
mod loading;
mod random;
mod reference;
mod shapes;
mod tables;
mod w3c;
