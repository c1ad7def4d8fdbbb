//! The connection between a component and the process that it shares.

use crate::error::StartError;
use crate::log::ComponentOutput;
use crate::status::DoneBeside;
use crate::waker::Waker;
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use std::sync::mpsc::Sender;

/// Parts of a process that a component uses.
pub(crate) struct Place {
    pub(crate) program: PathBuf,
    pub(crate) link: Option<UnixStream>,
    pub(crate) output: ComponentOutput,
    pub(crate) reports: Reports,
    pub(crate) done: DoneBeside,
}

/// Reports one component to the first thread of the process.
#[derive(Clone)]
pub(crate) struct Reports {
    pub(super) member: usize,
    pub(super) sender: Sender<Report>,
    pub(super) waker: Waker,
}

pub(super) struct Report {
    pub(super) member: usize,
    pub(super) state: MemberState,
}

pub(super) enum MemberState {
    Ready,
    Ended(Result<(), StartError>),
}

impl Reports {
    pub(crate) fn ready(&self) {
        self.send(MemberState::Ready);
    }

    pub(super) fn send(&self, state: MemberState) {
        let member = self.member;
        // The process ends otherwise.
        let _ = self.sender.send(Report { member, state });
        self.waker.wake();
    }
}
