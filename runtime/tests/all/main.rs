//! All integration tests of the runtime in one program, except those that Miri runs (`in_place`).

mod aged;
mod busy;
mod ends;
mod followed;
mod life;
mod lifecycle;
mod log;
mod machine;
mod own_parameters;
mod parameter_requests;
mod parameters;
mod process;
mod settings;
mod time;
mod time_late;
mod time_peers;
mod wake;
