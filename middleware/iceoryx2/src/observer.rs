//! Ports of tools that look at a running network. They open only existing services, have places in
//! addition to those of components, and are not counted as peers. A tool polls for samples each
//! millisecond, so that a publisher need not wake it.

use crate::names;
use crate::ports::TopicService;
use crate::publisher::SharedPublisher;
use crate::service::existing_topic;
use crate::session::Session;
use crate::subscriber::Source;
use crate::tool_ports::observers;
use crate::{NAME, opening};
use rc_middleware::qos::MAX_OBSERVERS;
use rc_middleware::{
    Backend, Client, Durability, Endpoint, Header, OpenError, Publisher, ReceiveError, Server,
    Subscriber,
};
use rustix::time::{
    Itimerspec, TimerfdClockId, TimerfdFlags, TimerfdTimerFlags, Timespec, timerfd_create,
    timerfd_settime,
};
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How often an observer polls for samples.
const LOOK_NS: i64 = 1_000_000;
/// How often an observer polls for a service that does not exist yet.
const RETRY: Duration = Duration::from_millis(250);

/// The backend of a tool.
pub(crate) struct Observing {
    session: Arc<Session>,
    timer: Arc<OwnedFd>,
}

impl Observing {
    pub(crate) fn new(session: Arc<Session>) -> Result<Self, OpenError> {
        let failed = |error: rustix::io::Errno| OpenError::Backend {
            address: session.environment.network.clone(),
            reason: error.to_string(),
        };
        let flags = TimerfdFlags::CLOEXEC | TimerfdFlags::NONBLOCK;
        let timer = timerfd_create(TimerfdClockId::Monotonic, flags).map_err(failed)?;
        let look = Timespec {
            tv_sec: 0,
            tv_nsec: LOOK_NS,
        };
        let interval = Itimerspec {
            it_interval: look,
            it_value: look,
        };
        timerfd_settime(&timer, TimerfdTimerFlags::empty(), &interval).map_err(failed)?;
        Ok(Self {
            session,
            timer: Arc::new(timer),
        })
    }
}

impl Backend for Observing {
    fn name(&self) -> &'static str {
        NAME
    }

    fn publisher(&self, endpoint: &Endpoint) -> Result<Box<dyn Publisher>, OpenError> {
        let port = opening::open(&self.session, endpoint, SharedPublisher::of_tool)?;
        Ok(Box::new(port))
    }

    fn subscriber(&self, endpoint: &Endpoint) -> Result<Box<dyn Subscriber>, OpenError> {
        let (volatile, transient_local) = opening::open(&self.session, endpoint, sources)?;
        Ok(Box::new(Observer {
            volatile,
            transient_local,
            endpoint: endpoint.clone(),
            tried: Instant::now(),
            timer: Arc::clone(&self.timer),
            session: Arc::clone(&self.session),
        }))
    }

    fn client(&self, endpoint: &Endpoint) -> Result<Box<dyn Client>, OpenError> {
        Err(no_calls(endpoint))
    }

    fn server(&self, endpoint: &Endpoint) -> Result<Box<dyn Server>, OpenError> {
        Err(no_calls(endpoint))
    }

    fn linger(&self, limit: Duration) {
        self.session.linger(limit);
    }
}

fn no_calls(endpoint: &Endpoint) -> OpenError {
    OpenError::Backend {
        address: endpoint.address.to_string(),
        reason: "a tool calls over the management socket of the component".to_owned(),
    }
}

/// The subscriber of a tool.
struct Observer {
    volatile: Option<Source>,
    transient_local: Option<Source>,
    endpoint: Endpoint,
    /// When it last looked for a missing service.
    tried: Instant,
    timer: Arc<OwnedFd>,
    /// Dropped after everything above.
    session: Arc<Session>,
}

type Sources = (Option<Source>, Option<Source>);

/// Subscribes to the services of a topic that exist.
fn sources(session: &Arc<Session>, endpoint: &Endpoint) -> Result<Sources, OpenError> {
    let source = |topic: Option<TopicService>, history| match topic {
        Some(topic) => open(endpoint, topic, history).map(Some),
        None => Ok(None),
    };
    let (address, types) = (&endpoint.address, &endpoint.types);
    let volatile = existing_topic(session, &names::topic(address), types)?;
    let name = names::transient_local(address);
    let transient_local = existing_topic(session, &name, types)?;
    let wants_history = endpoint.qos.durability == Durability::TransientLocal;
    // The newest sample is enough to show what a publisher has sent once.
    let history = usize::from(wants_history);
    Ok((source(volatile, 0)?, source(transient_local, history)?))
}

fn open(endpoint: &Endpoint, topic: TopicService, history: usize) -> Result<Source, OpenError> {
    let too_many = || OpenError::Backend {
        address: endpoint.address.to_string(),
        reason: format!("{MAX_OBSERVERS} tools observe it already; end one of them"),
    };
    if observers(&topic) >= MAX_OBSERVERS {
        return Err(too_many());
    }
    let source = Source::of_tool(endpoint, topic, history)?;
    // Two tools may have come at once.
    if observers(source.topic()) > MAX_OBSERVERS {
        return Err(too_many());
    }
    Ok(source)
}

impl Observer {
    /// Subscribes to a service that has come into being since.
    fn join(&mut self) -> Result<(), OpenError> {
        let is_complete = self.volatile.is_some() && self.transient_local.is_some();
        if is_complete || self.tried.elapsed() < RETRY {
            return Ok(());
        }
        self.tried = Instant::now();
        let (address, types) = (&self.endpoint.address, &self.endpoint.types);
        if self.volatile.is_none()
            && let Some(topic) = existing_topic(&self.session, &names::topic(address), types)?
        {
            self.volatile = Some(open(&self.endpoint, topic, 0)?);
        }
        let name = names::transient_local(address);
        if self.transient_local.is_none()
            && let Some(topic) = existing_topic(&self.session, &name, types)?
        {
            self.transient_local = Some(open(&self.endpoint, topic, 0)?);
        }
        Ok(())
    }
}

impl Subscriber for Observer {
    fn descriptor(&self) -> BorrowedFd<'_> {
        self.timer.as_fd()
    }

    fn acknowledge(&mut self, _woken: bool) {
        let mut expirations = [0_u8; 8];
        // Another observer of this process may have read it.
        let _ = rustix::io::read(&*self.timer, &mut expirations);
    }

    fn receive(&mut self, take: &mut dyn FnMut(Header, &[u8])) -> Result<bool, ReceiveError> {
        let address = self.endpoint.address.to_string();
        self.join().map_err(|error| ReceiveError {
            address: address.clone(),
            reason: error.to_string(),
        })?;
        for source in [&mut self.volatile, &mut self.transient_local] {
            if let Some(source) = source
                && source.receive(&address, &mut |header, sample, _| {
                    take(header, sample.payload());
                })?
            {
                return Ok(true);
            }
        }
        Ok(false)
    }

    fn peers(&self) -> usize {
        let sources = [&self.volatile, &self.transient_local];
        sources.into_iter().flatten().map(Source::peers).sum()
    }
}
