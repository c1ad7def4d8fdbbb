//! Starts the process of a component on its processors and with its real-time priority.
//!
//! Both are set for a temporary thread that starts the process. The process inherits them from this
//! thread, so that they hold from its first instruction.

use rustix::io::Errno;
use std::fmt::Display;
use std::io;
use std::process::{Child, Command};

/// Starts a process on these processors (empty: any) with this `SCHED_FIFO` priority.
pub(crate) fn spawn(
    command: &mut Command,
    cpu: &[u16],
    priority: Option<u8>,
) -> Result<Child, String> {
    let spawn = |command: &mut Command| {
        let child = command.spawn();
        child.map_err(|e| {
            let program = command.get_program().display();
            format!("cannot run {program}: {e}{}", remedy(&program, &e))
        })
    };
    if cpu.is_empty() && priority.is_none() {
        return spawn(command);
    }
    rc_scheduling::on_a_thread(|| {
        rc_scheduling::set(cpu, priority)?;
        spawn(command)
    })
}

/// Advice about a program that the system does not run.
fn remedy(program: &dyn Display, error: &io::Error) -> String {
    match error.raw_os_error().map(Errno::from_raw_os_error) {
        Some(Errno::NOENT) => "; `rcdeploy up --build` builds the program of a workspace; install an installed one again, by its package or `rcgen install`".to_owned(),
        Some(Errno::ACCESS) => {
            format!("; `chmod +x {program}` lets it run, unless its disk is mounted with `noexec`")
        }
        Some(Errno::NOEXEC) => "; it is not a program for this machine: build it again".to_owned(),
        Some(Errno::TXTBSY) => "; it is being written, try again when that is done".to_owned(),
        _ => String::new(),
    }
}
