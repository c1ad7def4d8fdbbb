//! All integration tests of rcdeploy in one program, except those in `tests/dds`.

mod bad;
mod bench;
mod command_line;
mod commands;
mod descriptors;
mod events;
mod explain;
mod export;
mod interpreters;
mod killed;
mod lifecycle;
mod logs;
mod network;
mod orphans;
mod printing;
mod pty;
mod realtime;
mod remote;
mod removed;
mod restart;
mod ros_names;
mod secret;
mod start;
mod stop;
mod target_folder;
mod watch;
