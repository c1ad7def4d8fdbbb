//! The second thread of a component: management over a Unix socket, signals, and the link to a
//! supervisor.
//!
//! The socket is `NAME.sock` in the network's run directory; [`rc_management::component::Request`]
//! lists the requests. If a supervisor has started the component, the environment has
//! `RC_SUPERVISED`, and the link is a socket at standard input. The component sends its state, its
//! readiness and twice a second a heartbeat over it, and ends when the supervisor closes it.

mod answers;

use crate::commands::{Command, CommandQueue};
use crate::component_info::ComponentInfo;
use crate::configuration::LoadedConfiguration;
use crate::description::Description;
use crate::error::StartError;
use crate::firing::FireServer;
use crate::hops::SharedHops;
use crate::lifecycle::{Lifecycle, LifecycleState};
use crate::lifecycle_server::LifecycleServer;
use crate::link::Link;
use crate::log::print_error;
use crate::losses::Tapping;
use crate::name_lock::NameLock;
use crate::parameter_server::{ParameterServer, Requester};
use crate::parameter_service::{BackendRequests, RequestQueue};
use crate::signals::Signals;
use crate::slots::SlotTable;
use crate::status::Shared;
use crate::tap::Taps;
use crate::tool_requests::ToolRequests;
use crate::waker::{Waker, Wakeup, Wakeups, waker};
use rc_management::component::{Done, Request, State};
use rc_management::rpc::{self, Error};
use rc_management::server::Received;
use rc_management::{Server as Socket, ServerSource};
use rc_middleware::Environment;
use rc_middleware::parameters::ParameterService;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use serde_json::{Map, Value};
use std::io;
use std::os::unix::net::UnixStream;
use std::sync::Arc;
use std::time::{Duration, Instant};

const HEARTBEAT: Duration = Duration::from_millis(500);
/// How often the thread checks whether its socket still exists.
const LOOK: Duration = Duration::from_secs(1);
/// How long the answer to a request about the emergency waits for the worker.
const EMERGENCY_LIMIT: Duration = Duration::from_secs(1);

/// Parts of the process that the management thread uses.
pub(crate) enum Attachment {
    /// Nothing.
    None,
    /// The signals, and the link at standard input if there is one: the component has the process
    /// for itself.
    Process,
    /// This link, in a process of several components.
    Link(UnixStream),
}

/// The management of one component, seen from its worker thread.
pub(crate) struct Management {
    shared: Arc<Shared>,
    info: Arc<ComponentInfo>,
    waker: Waker,
    queue: Arc<RequestQueue>,
    taps: Arc<Taps>,
    hops: Arc<SharedHops>,
    thread: Option<std::thread::JoinHandle<()>>,
    /// Released after everything else.
    _name_lock: Arc<NameLock>,
}

impl Management {
    /// Starts the thread.
    pub(crate) fn start(
        description: &'static Description,
        environment: &Environment,
        slots: &Arc<SlotTable>,
        shared: &Arc<Shared>,
        commands: &Arc<CommandQueue>,
        loaded: &LoadedConfiguration,
        attachment: Attachment,
    ) -> Result<Self, StartError> {
        let name_lock = Arc::new(NameLock::acquire(environment)?);
        // With the lock, a socket that is there belongs to a process that has ended.
        let _ = std::fs::remove_file(name_lock.socket());
        let socket = Socket::bind(name_lock.socket())
            .map_err(|e| StartError::cannot_create("the management socket", &e))?;
        let info = Arc::new(ComponentInfo::new(description, environment, slots));
        let (waker, wakeups) =
            waker().map_err(|e| StartError::cannot_create("a socket pair", &e))?;
        let capacity = SlotTable::capacity(description);
        let taps = Arc::new(Taps::new(capacity, Some(waker.clone())));
        let hops = Arc::new(SharedHops::default());
        let queue = Arc::new(RequestQueue::new(waker.clone()));
        commands.report_to(waker.clone());
        if let Some(lifecycle) = &shared.lifecycle {
            lifecycle.report_to(waker.clone());
        }
        let mut server = Server {
            info: info.clone(),
            parameters: ParameterServer::new(loaded, commands.clone(), waker.clone()),
            lifecycle: LifecycleServer::new(shared.lifecycle.clone(), waker.clone()),
            shared: shared.clone(),
            commands: commands.clone(),
            firing: FireServer::new(commands.clone(), waker.clone()),
            emergencies: Vec::new(),
            backends: BackendRequests::new(queue.clone()),
            tools: ToolRequests::new(
                slots.clone(),
                (taps.clone(), hops.clone()),
                commands.clone(),
                waker.clone(),
            ),
            socket,
            name_lock: name_lock.clone(),
            looked: Instant::now(),
            wakeups,
            link: None,
            restore: None,
            signals: None,
        };
        server
            .attach(attachment)
            .map_err(|e| StartError::System(format!("management cannot start: {e}")))?;
        let thread = std::thread::Builder::new().name("management".to_owned());
        // Its messages go to the log of the component.
        let log = tracing::dispatcher::get_default(Clone::clone);
        let thread = thread
            .spawn(move || tracing::dispatcher::with_default(&log, || server.run()))
            .map_err(|e| StartError::cannot_create("a thread", &e))?;
        Ok(Self {
            shared: shared.clone(),
            info,
            waker,
            queue,
            taps,
            hops,
            thread: Some(thread),
            _name_lock: name_lock,
        })
    }

    /// Sets the addresses of the slots from now on.
    pub(crate) fn set_open(&self) {
        self.info.set_open();
    }

    /// The taps of the slots.
    pub(crate) fn taps(&self) -> Arc<Taps> {
        self.taps.clone()
    }

    /// Notes about messages on chains.
    pub(crate) fn hops(&self) -> Arc<SharedHops> {
        self.hops.clone()
    }

    /// The requests about parameters, for the worker.
    pub(crate) fn requests(&self) -> Arc<RequestQueue> {
        self.queue.clone()
    }

    /// The parameters, for backends.
    pub(crate) fn parameters(&self) -> Arc<dyn ParameterService> {
        self.queue.clone()
    }

    /// Reports readiness: the worker is initialised, and the loop begins.
    pub(crate) fn ready(&self) {
        self.shared.status().state = State::Running;
        self.shared.turned(Instant::now());
        self.waker.ready();
    }
}

/// Ends the thread, however the component ends.
impl Drop for Management {
    fn drop(&mut self) {
        self.waker.end();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// A request about the emergency that the worker has not executed.
struct EmergencyRequest {
    requester: (u64, Option<Value>),
    /// Its number among all of them.
    number: u64,
    until: Instant,
}

/// The state of the thread.
struct Server {
    info: Arc<ComponentInfo>,
    shared: Arc<Shared>,
    commands: Arc<CommandQueue>,
    socket: Socket<Tapping>,
    name_lock: Arc<NameLock>,
    /// When it last looked whether its socket is there.
    looked: Instant,
    tools: ToolRequests,
    wakeups: Wakeups,
    parameters: ParameterServer,
    firing: FireServer,
    emergencies: Vec<EmergencyRequest>,
    backends: BackendRequests,
    lifecycle: LifecycleServer,
    link: Option<Link>,
    /// Parameters that an earlier run had not saved. They are set before the component reports
    /// readiness.
    restore: Option<Map<String, Value>>,
    signals: Option<Signals>,
}

/// Event source of the thread.
#[derive(Clone, Copy, Debug)]
enum Source {
    Wakeups,
    Signals,
    Link,
    Socket(ServerSource),
}

/// Whether a request only asks. Requests that control the component are served before it.
fn is_query(request: &Result<Request, Error>) -> bool {
    matches!(
        request,
        Ok(Request::Status
            | Request::Parameters { .. }
            | Request::Describe
            | Request::Clocks
            | Request::Follow { .. }
            | Request::Hops
            | Request::Tap { .. })
            | Err(_)
    )
}

/// The requests in the order in which they are served; each is of another client.
fn control_first<C, I>(
    mut requests: Vec<(C, I, Result<Request, Error>)>,
) -> Vec<(C, I, Result<Request, Error>)> {
    requests.sort_by_key(|(_, _, request)| is_query(request));
    requests
}

impl Server {
    fn attach(&mut self, attachment: Attachment) -> io::Result<()> {
        match attachment {
            Attachment::None => return Ok(()),
            Attachment::Process => {
                self.signals = Some(Signals::register()?);
                self.link = Link::inherited()?;
            }
            Attachment::Link(link) => self.link = Some(Link::new(link)?),
        }
        if let Some(supervisor) = self.link.as_ref().and_then(Link::supervisor) {
            self.socket.reserve(supervisor);
        }
        Ok(())
    }

    fn run(mut self) {
        let mut heartbeat = Instant::now();
        let mut ready = false;
        loop {
            self.report_state();
            let mut wakeup = Wakeup::default();
            for (source, events) in self.wait(heartbeat) {
                match source {
                    Source::Wakeups => wakeup = self.wakeups.take(),
                    Source::Signals => self.take_signals(),
                    // The supervisor sends what to restore before the process starts.
                    Source::Link => self.turn_link(events),
                    Source::Socket(source) => self.socket.turn(source, events),
                }
            }
            if wakeup.ready && !ready {
                ready = true;
                self.report_state();
                self.restore_and_report_ready();
            }
            if wakeup.end {
                self.backends.end();
                let mut answers = self.parameters.end();
                answers.extend(self.firing.end());
                answers.retain(|(requester, _)| !matches!(requester, Requester::Supervisor));
                self.answer(answers);
                self.answer_emergencies(true);
                let messages = self.tools.end();
                self.hand_over(messages);
                self.answer_transitions();
                self.report_state();
                return;
            }
            let now = Instant::now();
            if now >= heartbeat
                && let Some(link) = &mut self.link
                && link.is_free()
            {
                // The observations of a heartbeat accumulate until one can be written.
                heartbeat = now + HEARTBEAT;
                link.send_heartbeat(self.info.heartbeat(&self.shared));
            }
            self.serve();
            self.backends.turn(&mut self.parameters);
            let answers = self.parameters.turn(&self.shared);
            if let (Some(link), false) = (&mut self.link, answers.is_empty()) {
                link.set_unsaved(&self.parameters.unsaved());
            }
            self.answer(answers);
            self.answer_emergencies(false);
            let fired = self.firing.turn();
            let messages = self.tools.results();
            if !fired.is_empty() || !messages.is_empty() {
                self.report_changes();
            }
            self.answer(fired);
            self.hand_over(messages);
            self.tools.turn(&mut self.socket);
            self.answer_transitions();
            self.socket.check(Instant::now());
            self.restore_socket(now);
        }
    }

    /// Listens at its path again if the run directory or the socket was removed: a logout does that,
    /// and a cleaner of temporary files.
    fn restore_socket(&mut self, now: Instant) {
        if now < self.looked + LOOK {
            return;
        }
        self.looked = now;
        let restored = self.name_lock.restore(self.info.network());
        // Where that is not possible, the next look tries again; the supervisor reports it.
        let _ = restored.and_then(|()| self.socket.restore());
    }

    /// Waits for events, at most until the next heartbeat. Clients come last.
    fn wait(&self, heartbeat: Instant) -> Vec<(Source, PollFlags)> {
        let mut sources = vec![Source::Wakeups];
        let mut polled = vec![PollFd::new(&self.wakeups, PollFlags::IN)];
        if let Some(signals) = &self.signals {
            sources.push(Source::Signals);
            polled.push(PollFd::new(signals, PollFlags::IN));
        }
        let look = self.looked + LOOK;
        let mut deadline = self.socket.deadline().into_iter().chain([look]).min();
        if let Some(link) = &self.link {
            sources.push(Source::Link);
            polled.push(PollFd::new(link, link.flags()));
            if link.is_free() {
                deadline = deadline.into_iter().chain([heartbeat]).min();
            }
        }
        for (source, descriptor, flags) in self.socket.descriptors() {
            sources.push(Source::Socket(source));
            polled.push(PollFd::from_borrowed_fd(descriptor, flags));
        }
        let limit = deadline.map(|at| at.saturating_duration_since(Instant::now()));
        let limits = limit.into_iter().chain(self.parameters.time_left());
        let limits = limits.chain(self.firing.time_left());
        let emergencies = self.emergencies.iter().map(|one| one.until);
        let emergency = emergencies.min();
        let emergency = emergency.map(|at| at.saturating_duration_since(Instant::now()));
        let limits = limits.chain(emergency);
        let limits = limits.chain(self.lifecycle.time_left());
        let limit = limits.chain(self.tools.time_left()).min();
        let limit = limit.and_then(|limit| Timespec::try_from(limit).ok());
        match poll(&mut polled, limit.as_ref()) {
            Ok(_) => {
                let events = polled.iter().map(PollFd::revents);
                let ready = sources.into_iter().zip(events);
                ready.filter(|(_, events)| !events.is_empty()).collect()
            }
            Err(error) => {
                // If memory is short for a moment, this thread must not spin.
                if error != Errno::INTR {
                    std::thread::sleep(Duration::from_millis(10));
                }
                Vec::new()
            }
        }
    }

    /// The first signal stops in order, a later one at once.
    fn take_signals(&mut self) {
        if self.signals.as_mut().is_some_and(Signals::take) {
            let name = &self.info.name;
            print_error(&format!("{name}: ended at once by a second signal\n"));
            std::process::exit(3);
        }
        self.shared.wake_event.stop();
    }

    fn turn_link(&mut self, events: PollFlags) {
        let Some(link) = &mut self.link else { return };
        if events.contains(PollFlags::OUT) {
            link.write();
        }
        let input = link.receive();
        self.restore = input.restore.or(self.restore.take());
        if !input.ruled.is_empty() {
            self.parameters.set_ruled(input.ruled);
        }
        for (number, changes) in input.proposed {
            self.parameters.change(Requester::Proposal(number), changes);
        }
        for (number, keep) in input.settled {
            self.parameters.settle(number, keep);
        }
        if let (Some(lifecycle), Some(goal)) = (&self.shared.lifecycle, input.goal) {
            lifecycle.set_goal(goal);
        }
        if input.group.is_some() {
            self.shared.status().group = input.group;
        }
        if input.closed {
            self.link = None;
            self.shared.wake_event.stop();
        }
    }

    /// Restores parameters, if there are any, and reports readiness.
    fn restore_and_report_ready(&mut self) {
        let changes = self.restore.take().unwrap_or_default();
        if changes.is_empty() {
            self.link.iter_mut().for_each(Link::set_ready);
        } else {
            // The answer comes when the worker has decided.
            self.parameters.change(Requester::Supervisor, changes);
        }
    }

    fn report_state(&mut self) {
        let state = self.shared.status().state;
        if let Some(link) = &mut self.link {
            link.set_state(state);
            if let Some(lifecycle) = &self.shared.lifecycle {
                link.set_lifecycle(lifecycle.report());
            }
        }
    }

    /// Serves at most one request of each client, those first that control the component.
    fn serve(&mut self) {
        let requests = self.socket.requests().into_iter().map(decode).collect();
        for (client, id, request) in control_first(requests) {
            if let Some(result) = self.execute(client, id.as_ref(), request)
                && let Some(id) = id
            {
                self.socket.answer(client, &id, result);
            }
        }
    }

    /// Executes a request. A change of parameters, and saving, have no result yet: they wait for
    /// the worker.
    fn execute(
        &mut self,
        client: u64,
        id: Option<&Value>,
        request: Result<Request, Error>,
    ) -> Option<Result<Value, Error>> {
        let requester = Requester::Client {
            number: client,
            id: id.cloned(),
        };
        Some(match request {
            Ok(Request::Status) => rpc::result(&self.info.status(&self.shared)),
            Ok(Request::Parameters { paths }) => self
                .parameters
                .list(&paths.unwrap_or_default())
                .and_then(|parameters| rpc::result(&parameters)),
            Ok(Request::ParametersSet { changes }) => {
                self.socket.defer(client);
                self.parameters.change(requester, changes);
                return None;
            }
            Ok(Request::ParametersSave) => {
                self.socket.defer(client);
                self.parameters.save(requester);
                return None;
            }
            Ok(Request::Describe) => ToolRequests::describe(&self.info, &self.shared),
            Ok(Request::Clocks) => ToolRequests::clocks(),
            // Its connections, which have the senders, are not all open.
            Ok(Request::Follow { .. }) if self.shared.status().state == State::Starting => {
                let message = "starts, and is followed afterwards";
                Err(Error::new(Error::WORKER_REFUSES, message))
            }
            Ok(Request::Follow { pairs }) => self.tools.follow(&mut self.socket, client, &pairs),
            Ok(Request::Hops) => {
                let lifecycle = self.shared.lifecycle.as_deref();
                let is_active = |of: &Lifecycle| of.state() == LifecycleState::Active;
                let is_active = lifecycle.is_none_or(is_active);
                self.tools.hops(&mut self.socket, client, is_active)
            }
            Ok(Request::Tap { slot, on }) => self.tools.tap(&mut self.socket, client, &slot, on),
            Ok(Request::Call {
                slot,
                body,
                timeout_ms,
            }) => {
                let limit = Duration::from_millis(timeout_ms);
                let result = self.tools.call((client, id.cloned()), &slot, body, limit);
                return self.deferred(client, result);
            }
            Ok(Request::Sample {
                slot,
                operation,
                body,
            }) => {
                let requester = (client, id.cloned());
                let result = self.tools.sample(requester, &slot, &operation, body);
                return self.deferred(client, result);
            }
            Ok(Request::Period { .. }) if self.parameters.rules_period() => {
                let message = "the period is in a rule of the network; the configuration sets it at the next start";
                Err(Error::new(Error::RULED, message))
            }
            Ok(Request::Period { ms }) => {
                let period = Duration::from_secs_f64(ms / 1e3);
                self.commands.push(Command::Period(period));
                rpc::result(&Done {})
            }
            Ok(Request::Emergency { active }) => {
                self.commands.push(Command::Emergency(active));
                self.socket.defer(client);
                self.emergencies.push(EmergencyRequest {
                    requester: (client, id.cloned()),
                    number: self.commands.emergencies().0,
                    until: Instant::now() + EMERGENCY_LIMIT,
                });
                return None;
            }
            Ok(Request::Fire { event }) => {
                match self.firing.fire(requester, &event, &self.shared) {
                    Ok(()) => {
                        self.socket.defer(client);
                        return None;
                    }
                    Err(error) => Err(error),
                }
            }
            Ok(Request::Lifecycle { transition }) => {
                let begun = self.lifecycle.begin(client, id.cloned(), transition);
                return self.deferred(client, begun);
            }
            Ok(Request::Stop) => {
                self.shared.wake_event.stop();
                rpc::result(&Done {})
            }
            Err(error) => Err(error),
        })
    }
}

/// The client, the identifier and the request. A notification has no identifier and gets no answer.
fn decode(received: Received) -> (u64, Option<Value>, Result<Request, Error>) {
    let Received { client, call } = received;
    match call {
        Ok(call) => (client, call.id.clone(), Request::decode(call)),
        Err(error) => (client, Some(Value::Null), Err(error)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn control_requests_are_served_before_queries() {
        let paths = None;
        let requests = [
            Ok(Request::Status),
            Err(Error::new(-32600, "no request")),
            Ok(Request::Emergency { active: true }),
            Ok(Request::Parameters { paths }),
            Ok(Request::Stop),
        ];
        let requests = requests.into_iter().enumerate();
        let requests = requests.map(|(client, request)| (client, (), request));
        let served = control_first(requests.collect());
        let clients: Vec<usize> = served.iter().map(|(client, ..)| *client).collect();
        assert_eq!(clients, [2, 4, 0, 1, 3]);
    }
}
