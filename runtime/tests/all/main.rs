//! All integration tests of the runtime but those that Miri runs (`in_place`), in one program.

mod life;
mod parameters;
mod process;
mod ros_arguments;
mod settings;
mod wake;
