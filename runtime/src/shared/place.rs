//! What a component has of the process that it shares, and tells it.

use crate::error::StartError;
use crate::log::ComponentOutput;
use crate::status::DoneBeside;
use crate::waker::Waker;
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use std::sync::mpsc::Sender;

/// What a component has of its process.
pub(crate) struct Place {
    pub(crate) program: PathBuf,
    pub(crate) link: Option<UnixStream>,
    pub(crate) output: ComponentOutput,
    pub(crate) reports: Reports,
    pub(crate) done: DoneBeside,
}

/// Tells the first thread of the process about one component.
#[derive(Clone)]
pub(crate) struct Reports {
    pub(super) member: usize,
    pub(super) sender: Sender<Report>,
    pub(super) waker: Waker,
}

pub(super) struct Report {
    pub(super) member: usize,
    pub(super) what: What,
}

pub(super) enum What {
    Ready,
    Ended(Result<(), StartError>),
}

impl Reports {
    pub(crate) fn ready(&self) {
        self.send(What::Ready);
    }

    pub(super) fn send(&self, what: What) {
        let member = self.member;
        // The process ends otherwise.
        let _ = self.sender.send(Report { member, what });
        self.waker.wake();
    }
}
