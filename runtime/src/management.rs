//! The second thread of a component: management over a Unix socket, signals, and the link to a supervisor.
//!
//! The socket is `NAME.sock` in the network's run directory; [`rc_management::component::Request`] lists the requests.
//! If a supervisor has started the component, the environment has `RC_SUPERVISED`, and the link is a socket at standard
//! input. The component sends its state, its readiness and twice a second a heartbeat over it, and ends when the
//! supervisor closes it.

use crate::commands::{Command, CommandQueue};
use crate::component_info::ComponentInfo;
use crate::configuration::LoadedConfiguration;
use crate::description::Description;
use crate::error::StartError;
use crate::link::Link;
use crate::log::print_error;
use crate::name_lock::NameLock;
use crate::parameter_server::{Answer, ParameterServer, Requester};
use crate::parameter_service::{BackendRequests, RequestQueue};
use crate::status::Shared;
use crate::waker::{Waker, Wakeups, waker};
use rc_management::component::{Done, Request, State};
use rc_management::lines::{LIMIT, Line, Lines, Overlong};
use rc_management::link::ComponentMessage;
use rc_management::rpc::{self, Call, Error};
use rc_middleware::parameters::ParameterService;
use rc_middleware::{Address, Environment};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use serde_json::{Map, Value};
use std::io::{self, Read, Write};
use std::os::fd::AsFd;
use std::os::unix::net::{UnixListener, UnixStream};
use std::sync::Arc;
use std::time::{Duration, Instant};

const HEARTBEAT: Duration = Duration::from_millis(500);
/// Signals within this time count as one.
const SIGNAL_BURST: Duration = Duration::from_millis(300);
/// The most clients at once; the listener turns away others.
const MAX_CLIENTS: usize = 32;
/// The limit for a client to take an answer.
const CLIENT_LIMIT: Duration = Duration::from_millis(200);

/// The management of one component, seen from its worker thread.
pub(crate) struct Management {
    shared: Arc<Shared>,
    info: Arc<ComponentInfo>,
    waker: Waker,
    queue: Arc<RequestQueue>,
    thread: Option<std::thread::JoinHandle<()>>,
    /// Released after everything else.
    _name_lock: NameLock,
}

impl Management {
    /// Starts the thread. It takes signals and the link only if the component has its process for itself.
    pub(crate) fn start(
        description: &'static Description,
        environment: &Environment,
        shared: &Arc<Shared>,
        commands: &Arc<CommandQueue>,
        loaded: &LoadedConfiguration,
        whole_process: bool,
    ) -> Result<Self, StartError> {
        let Environment {
            network, instance, ..
        } = environment;
        let name_lock = NameLock::acquire(environment)?;
        // With the lock, a socket that is there belongs to a process that has ended.
        let _ = std::fs::remove_file(name_lock.socket());
        let listener = UnixListener::bind(name_lock.socket())
            .map_err(|e| StartError::cannot_create("the management socket", &e))?;
        let info = Arc::new(ComponentInfo::new(description, instance, network));
        let (waker, wakeups) =
            waker().map_err(|e| StartError::cannot_create("a socket pair", &e))?;
        let queue = Arc::new(RequestQueue::new(waker.clone()));
        let LoadedConfiguration {
            parameters,
            configuration,
            file,
        } = loaded;
        let mut server = Server {
            info: info.clone(),
            parameters: ParameterServer::new(
                parameters.clone().unwrap_or_default(),
                &configuration.parameters,
                file.clone(),
                commands.clone(),
                waker.clone(),
            ),
            shared: shared.clone(),
            commands: commands.clone(),
            backends: BackendRequests::new(queue.clone()),
            listener,
            wakeups,
            clients: Vec::new(),
            accepted: 0,
            link: None,
            restore: None,
            signals: None,
            reported: None,
            signalled: None,
        };
        server
            .attach(whole_process)
            .map_err(|e| StartError::System(format!("management cannot start: {e}")))?;
        let thread = std::thread::Builder::new().name("management".to_owned());
        let thread = thread
            .spawn(move || server.run())
            .map_err(|e| StartError::cannot_create("a thread", &e))?;
        Ok(Self {
            shared: shared.clone(),
            info,
            waker,
            queue,
            thread: Some(thread),
            _name_lock: name_lock,
        })
    }

    /// Sets the addresses of the slots.
    pub(crate) fn set_addresses(&self, addresses: &[Address]) {
        self.info.set_addresses(addresses);
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

/// The state of the thread.
struct Server {
    info: Arc<ComponentInfo>,
    shared: Arc<Shared>,
    commands: Arc<CommandQueue>,
    listener: UnixListener,
    wakeups: Wakeups,
    parameters: ParameterServer,
    backends: BackendRequests,
    clients: Vec<Client>,
    /// How many clients have connected so far.
    accepted: u64,
    link: Option<Link>,
    /// Parameters that an earlier run had not saved. They are set before the component reports readiness.
    restore: Option<Map<String, Value>>,
    signals: Option<UnixStream>,
    /// The state that the supervisor knows.
    reported: Option<State>,
    /// When the first signal came.
    signalled: Option<Instant>,
}

struct Client {
    number: u64,
    stream: UnixStream,
    lines: Lines,
}

/// What there is to do after a wait.
struct Readable {
    wakeups: bool,
    listener: bool,
    signals: bool,
    link: bool,
    /// By client.
    clients: Vec<bool>,
}

impl Server {
    fn attach(&mut self, whole_process: bool) -> io::Result<()> {
        self.listener.set_nonblocking(true)?;
        if !whole_process {
            return Ok(());
        }
        let (read, write) = UnixStream::pair()?;
        read.set_nonblocking(true)?;
        for signal in [
            signal_hook::consts::SIGINT,
            signal_hook::consts::SIGTERM,
            signal_hook::consts::SIGHUP,
        ] {
            signal_hook::low_level::pipe::register(signal, write.try_clone()?)?;
        }
        self.signals = Some(read);
        self.link = Link::inherited()?;
        Ok(())
    }

    fn run(mut self) {
        let mut heartbeat = Instant::now();
        let mut ready = false;
        loop {
            self.report_state();
            let wait = if self.link.is_some() {
                HEARTBEAT.saturating_sub(heartbeat.elapsed())
            } else {
                Duration::from_secs(10)
            };
            let limit = self.parameters.time_left();
            let readable = self.wait(limit.map_or(wait, |limit| wait.min(limit)));
            // The supervisor sends what to restore before the process starts.
            if readable.link {
                self.read_link();
            }
            if readable.wakeups {
                let wakeup = self.wakeups.take();
                if wakeup.ready && !ready {
                    ready = true;
                    self.report_state();
                    self.restore_and_report_ready();
                }
                if wakeup.end {
                    self.backends.end();
                    let mut answers = self.parameters.end();
                    answers.retain(|(requester, _)| !matches!(requester, Requester::Supervisor));
                    self.answer(answers);
                    self.report_state();
                    return;
                }
            }
            if readable.listener {
                self.accept();
            }
            if readable.signals {
                self.take_signals();
            }
            self.serve(&readable.clients);
            self.backends.turn(&mut self.parameters);
            let answers = self.parameters.turn(&self.shared);
            if let (Some(link), false) = (&mut self.link, answers.is_empty()) {
                link.send_unsaved(&self.parameters.unsaved());
            }
            self.answer(answers);
            if heartbeat.elapsed() >= HEARTBEAT {
                heartbeat = Instant::now();
                let message = ComponentMessage::Heartbeat(self.info.heartbeat(&self.shared));
                self.notify(&message);
            }
        }
    }

    fn wait(&self, limit: Duration) -> Readable {
        let fixed = [Some(self.wakeups.as_fd()), Some(self.listener.as_fd())];
        let optional = [
            self.signals.as_ref().map(AsFd::as_fd),
            self.link.as_ref().map(AsFd::as_fd),
        ];
        let clients = self.clients.iter().map(|c| Some(c.stream.as_fd()));
        let all: Vec<_> = fixed.into_iter().chain(optional).chain(clients).collect();
        let mut polled: Vec<PollFd<'_>> = all
            .iter()
            .flatten()
            .map(|fd| PollFd::from_borrowed_fd(*fd, PollFlags::IN))
            .collect();
        let limit = Timespec {
            tv_sec: limit.as_secs() as i64,
            tv_nsec: i64::from(limit.subsec_nanos()),
        };
        let failed = poll(&mut polled, Some(&limit)).is_err();
        let mut events = polled.iter().map(|p| !failed && !p.revents().is_empty());
        let mut next = |fd: &Option<_>| fd.is_some() && events.next().unwrap_or(false);
        Readable {
            wakeups: next(&all[0]),
            listener: next(&all[1]),
            signals: next(&all[2]),
            link: next(&all[3]),
            clients: all[4..].iter().map(next).collect(),
        }
    }

    fn accept(&mut self) {
        loop {
            let stream = match self.listener.accept() {
                Ok((stream, _)) => stream,
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => return,
                Err(_) => {
                    // The process has no descriptors left, and the waiting client must not make this thread spin.
                    std::thread::sleep(Duration::from_millis(20));
                    return;
                }
            };
            // It is read only when it is readable, so the first limit is for what must not happen.
            if self.clients.len() < MAX_CLIENTS
                && stream.set_read_timeout(Some(CLIENT_LIMIT)).is_ok()
                && stream.set_write_timeout(Some(CLIENT_LIMIT)).is_ok()
            {
                self.accepted += 1;
                self.clients.push(Client {
                    number: self.accepted,
                    stream,
                    lines: Lines::new(Overlong::Skip),
                });
            }
        }
    }

    /// The first signal stops in order, a later one at once. Signals that come together count as one: a terminal that
    /// closes, or a tool that signals a process and then its group, sends several.
    fn take_signals(&mut self) {
        let mut bytes = [0_u8; 16];
        let _ = self.signals.as_ref().map(|mut s| s.read(&mut bytes));
        let first = *self.signalled.get_or_insert_with(Instant::now);
        if first.elapsed() > SIGNAL_BURST {
            let name = &self.info.name;
            print_error(&format!("{name}: ended at once by a second signal\n"));
            std::process::exit(3);
        }
        self.shared.wake_event.stop();
    }

    fn read_link(&mut self) {
        let Some(input) = self.link.as_mut().map(Link::receive) else {
            return;
        };
        self.restore = input.restore.or(self.restore.take());
        if input.closed {
            self.link = None;
            self.shared.wake_event.stop();
        }
    }

    /// Restores parameters, if there are any, and reports readiness.
    fn restore_and_report_ready(&mut self) {
        let changes = self.restore.take().unwrap_or_default();
        if changes.is_empty() {
            self.notify(&ComponentMessage::Ready);
        } else {
            // The answer comes when the worker has decided.
            self.parameters.change(Requester::Supervisor, changes);
        }
    }

    fn report_state(&mut self) {
        let state = self.shared.status().state;
        if self.reported != Some(state) {
            self.reported = Some(state);
            self.notify(&ComponentMessage::State { state });
        }
    }

    fn notify(&self, message: &ComponentMessage) {
        if let Some(link) = &self.link {
            link.send(message);
        }
    }

    fn serve(&mut self, readable: &[bool]) {
        // Clients that were accepted since the wait are not readable yet.
        let mut readable = readable.iter().copied().chain(std::iter::repeat(false));
        let mut clients = std::mem::take(&mut self.clients);
        clients.retain_mut(|client| !readable.next().unwrap_or(false) || self.serve_client(client));
        self.clients = clients;
    }

    /// Reads once and answers requests; false if the client has left.
    fn serve_client(&mut self, client: &mut Client) -> bool {
        let (lines, ended) = client.lines.read(&client.stream);
        // A request without an end of line is not complete.
        !ended
            && lines.iter().all(|line| {
                let answer = self.execute(line, client.number);
                answer.is_none_or(|answer| client.send(&answer))
            })
    }

    /// Executes a request. The result is the answer; none for a notification, and none yet for a change of parameters
    /// and for saving, which wait for the worker.
    fn execute(&mut self, line: &Line, client: u64) -> Option<Vec<u8>> {
        let call = match line {
            Line::Complete(line) => Call::parse(line),
            Line::TooLong => {
                let message = format!("a request has at most {} KiB", LIMIT / 1024);
                Err(Error::new(Error::INVALID_PARAMS, message))
            }
        };
        let call = match call {
            Ok(call) => call,
            Err(error) => return Some(rpc::answer(&Value::Null, Err(error))),
        };
        let id = call.id.clone();
        let requester = |id| Requester::Client { number: client, id };
        let result = match Request::decode(call) {
            Ok(Request::Status) => rpc::result(&self.info.status(&self.shared)),
            Ok(Request::Parameters { paths }) => self
                .parameters
                .list(&paths.unwrap_or_default())
                .and_then(|parameters| rpc::result(&parameters)),
            Ok(Request::ParametersSet { changes }) => {
                self.parameters.change(requester(id), changes);
                return None;
            }
            Ok(Request::ParametersSave) => {
                self.parameters.save(requester(id));
                return None;
            }
            Ok(Request::Period { ms }) => {
                let period = Duration::from_secs_f64(ms / 1e3);
                self.commands.push(Command::Period(period));
                rpc::result(&Done {})
            }
            Ok(Request::Emergency { active }) => {
                self.commands.push(Command::Emergency(active));
                rpc::result(&Done {})
            }
            Ok(Request::Stop) => {
                self.shared.wake_event.stop();
                rpc::result(&Done {})
            }
            Err(error) => Err(error),
        };
        Some(rpc::answer(&id?, result))
    }

    /// Hands results of changes to their requesters, if they are still there.
    fn answer(&mut self, answers: Vec<Answer>) {
        for (requester, result) in answers {
            match requester {
                Requester::Supervisor => {
                    let refused = result.err().map(|error| error.message);
                    self.notify(&ComponentMessage::Restored { refused });
                    self.notify(&ComponentMessage::Ready);
                }
                Requester::Backend(number) => self.backends.answer(number, result.map(drop)),
                Requester::Client { number, id } => {
                    let Some(id) = id else { continue };
                    let answer = rpc::answer(&id, result);
                    self.clients
                        .retain_mut(|c| c.number != number || c.send(&answer));
                }
            }
        }
    }
}

impl Client {
    /// Sends an answer; false if the client does not take it.
    fn send(&mut self, answer: &[u8]) -> bool {
        self.stream.write_all(answer).is_ok()
    }
}
