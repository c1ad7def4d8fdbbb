//! All integration tests of rcdeploy in one program, except those in `tests/dds`.

mod bad;
mod bench;
mod command_line;
mod commands;
#[path = "../../../codegen/tests/all/debian.rs"]
mod debian;
mod descriptors;
mod events;
mod explain;
mod export;
mod interpreters;
mod killed;
mod lifecycle;
mod logs;
mod network;
mod printing;
mod pty;
mod python;
mod realtime;
mod remote;
mod removed;
mod restart;
mod ros_names;
mod secret;
#[path = "../../../codegen/tests/all/shared_builds.rs"]
mod shared_builds;
mod start;
mod stop;
mod target_folder;
mod watch;
