//! The process behind a unit, on this machine or on another one: the one place where that makes a difference.

use crate::client::lines::Line;
use crate::process::launch::{Exit, Launched};
use crate::remote::Distant;
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;

/// A process that runs.
#[derive(Debug)]
pub(crate) enum Body {
    /// On this machine: it is waited for by its descriptors.
    Here(Launched),
    /// On another one: an agent there tells of it.
    There(Distant),
}

impl Body {
    /// Becomes readable when the process ends.
    pub(crate) fn descriptor(&self) -> Option<&OwnedFd> {
        match self {
            Self::Here(process) => Some(process.descriptor()),
            Self::There(_) => None,
        }
    }

    /// What the component speaks over.
    pub(crate) fn link(&self) -> Option<&UnixStream> {
        match self {
            Self::Here(process) => process.link(),
            Self::There(_) => None,
        }
    }

    /// Whether the component can still speak.
    pub(crate) fn is_linked(&self) -> bool {
        match self {
            Self::Here(process) => process.link().is_some(),
            Self::There(process) => process.linked,
        }
    }

    pub(crate) fn pid(&self) -> Option<i32> {
        match self {
            Self::Here(process) => Some(process.pid()),
            Self::There(process) => process.pid,
        }
    }

    /// Takes one read from the link.
    pub(crate) fn read_link(&mut self) -> Vec<Line> {
        match self {
            Self::Here(process) => process.read_link(),
            Self::There(_) => Vec::new(),
        }
    }

    /// What a process that has ended said last.
    pub(crate) fn last_words(&mut self) -> Vec<Line> {
        match self {
            Self::Here(process) => process.last_words(),
            Self::There(_) => Vec::new(),
        }
    }

    /// Asks the process to end.
    pub(crate) fn terminate(&self) {
        match self {
            Self::Here(process) => process.terminate(),
            Self::There(process) => process.terminate(),
        }
    }

    /// Ends the process and its group.
    pub(crate) fn kill(&self) {
        match self {
            Self::Here(process) => process.kill(),
            Self::There(process) => process.kill(),
        }
    }

    /// The process has ended: how.
    pub(crate) fn reap(&mut self) -> Exit {
        match self {
            Self::Here(process) => process.reap(),
            Self::There(process) => process.exit(),
        }
    }
}
