//! The process of a unit, on this machine or on another one: the one place that distinguishes them.

use crate::process::launch::LocalProcess;
use crate::remote::RemoteProcess;
use rc_management::agent::Exit;
use rc_management::lines::Line;
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;

/// A process that runs.
#[derive(Debug)]
pub(crate) enum ProcessHandle {
    /// On this machine: it is waited for by its descriptors.
    Local(LocalProcess),
    /// On another one: an agent there reports it.
    Remote(RemoteProcess),
}

impl ProcessHandle {
    /// Becomes readable when the process ends.
    pub(crate) fn descriptor(&self) -> Option<&OwnedFd> {
        match self {
            Self::Local(process) => Some(process.descriptor()),
            Self::Remote(_) => None,
        }
    }

    /// Socket over which the component and its supervisor exchange messages.
    pub(crate) fn link(&self) -> Option<&UnixStream> {
        match self {
            Self::Local(process) => process.link(),
            Self::Remote(_) => None,
        }
    }

    /// Whether the component can still speak.
    pub(crate) fn is_linked(&self) -> bool {
        match self {
            Self::Local(process) => process.link().is_some(),
            Self::Remote(process) => process.linked,
        }
    }

    pub(crate) fn pid(&self) -> Option<i32> {
        match self {
            Self::Local(process) => Some(process.pid()),
            Self::Remote(process) => process.pid,
        }
    }

    /// Writes a line on the link without waiting: a line without room is lost.
    pub(crate) fn send_line(&self, line: &str) {
        match self {
            Self::Local(process) => process.send_line(line),
            Self::Remote(process) => process.send_line(line),
        }
    }

    /// Takes one read from the link.
    pub(crate) fn read_link(&mut self) -> Vec<Line> {
        match self {
            Self::Local(process) => process.read_link(),
            Self::Remote(_) => Vec::new(),
        }
    }

    /// Last lines of a process that has ended.
    pub(crate) fn remaining_lines(&mut self) -> Vec<Line> {
        match self {
            Self::Local(process) => process.remaining_lines(),
            Self::Remote(_) => Vec::new(),
        }
    }

    /// Asks the process to end.
    pub(crate) fn terminate(&self) {
        match self {
            Self::Local(process) => process.terminate(),
            Self::Remote(process) => process.terminate(),
        }
    }

    /// Ends the process and its group.
    pub(crate) fn kill(&self) {
        match self {
            Self::Local(process) => process.kill(),
            Self::Remote(process) => process.kill(),
        }
    }

    /// The process has ended: how.
    pub(crate) fn reap(&mut self) -> Exit {
        match self {
            Self::Local(process) => process.reap(),
            Self::Remote(process) => process.exit(),
        }
    }
}
