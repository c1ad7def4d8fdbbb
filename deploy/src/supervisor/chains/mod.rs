//! The chains of a network: the supervisor takes what components note of their messages, joins it,
//! and reports messages that are late, old, or do not come.
//!
//! A thread asks the components four times a second, another one notes when the machine stood
//! still. The supervisor's loop takes what has changed.

mod actions;
mod collector;
mod join;
mod report;
mod stage;
mod stalls;
#[cfg(test)]
mod tests;

pub(super) use actions::LateContext;
use collector::Collector;
use join::Change;
use rc_deploy_network::plan::Plan;
use rc_management::chains::Chains;
use rc_management::event::Event;
use rc_middleware::{RunDirectory, WakeEvent};
use std::os::fd::{AsFd, BorrowedFd};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};

/// The conditions of a chain.
const CONDITIONS: [&str; 3] = [join::LATE, join::OLD, join::BROKEN_CODE];

/// The thread that measures the chains, and its results.
#[derive(Debug)]
pub(super) struct ChainWatch {
    collector: Arc<Mutex<Collector>>,
    news: Receiver<News>,
    reporter: NewsSender,
    /// The thread ends when this is dropped.
    _stop: Sender<()>,
}

/// A report to the loop of the supervisor.
#[derive(Debug)]
enum News {
    /// A condition of the chain with this number begins or ends.
    Changed(usize, Change),
    /// The action against a late chain.
    Done(Event),
}

/// Reports to the loop of the supervisor.
#[derive(Clone, Debug)]
struct NewsSender {
    queue: Sender<News>,
    wake: WakeEvent,
}

impl NewsSender {
    fn send(&self, news: News) {
        // The receiver is gone if the network has ended.
        if self.queue.send(news).is_ok() {
            self.wake.wake();
        }
    }
}

impl ChainWatch {
    /// Starts measuring the chains of a plan; `None` if it has none.
    pub(super) fn start(plan: &Plan, directory: &RunDirectory) -> std::io::Result<Option<Self>> {
        if plan.chains.is_empty() {
            return Ok(None);
        }
        let (queue, news) = channel();
        let reporter = NewsSender {
            queue,
            wake: WakeEvent::new()?,
        };
        let (stop, stopped) = channel();
        let collector = collector::start(plan, directory, reporter.clone(), stopped)?;
        Ok(Some(Self {
            collector,
            news,
            reporter,
            _stop: stop,
        }))
    }

    /// Readable when something has changed.
    pub(super) fn descriptor(&self) -> BorrowedFd<'_> {
        self.reporter.wake.as_fd()
    }

    /// Reports that a chain is late.
    #[cfg(test)]
    pub(super) fn pretend_late(&self, chain: usize) {
        let code = join::LATE;
        let text = format!("chain {chain} is late");
        self.reporter
            .send(News::Changed(chain, Change::Begun { code, text }));
    }

    /// The measurements of all chains. With `known`, also the messages that came to the end: for
    /// each chain, those after the first `known` ones.
    pub(super) fn status(&self, known: Option<&[u64]>) -> Chains {
        let collector = self.collector.lock();
        let collector = collector.unwrap_or_else(PoisonError::into_inner);
        collector.status(known)
    }
}
