//! All integration tests of rcgen in one program, except the random texts in `tests/languages`.

mod compile;
mod config;
mod edits;
mod export;
mod fmt;
mod folders;
mod graphs;
mod idlc;
mod layout;
mod mend;
mod mistakes;
mod printing;
mod python_checkers;
mod python_environment;
mod python_worker;
mod rcgen;
mod ros;
mod ros_component;
mod rosidl;
mod shared;
mod standard_types;
mod start;
mod stubs;
mod view;
mod wire;
mod workspace;
