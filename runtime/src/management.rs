//! The second thread of a component: management over a Unix socket, signals, and the link to a supervisor.
//!
//! The socket is `NAME.sock` in the network's run directory and speaks JSON-RPC 2.0, one object a line:
//! `status`, `parameters {"paths": ["speed"]}`, `parameters_set {"changes": {"speed": 300}}`, `parameters_save`,
//! `period {"ms": 50}`, `emergency {"active": true}`, `stop`. A component whose environment has `RC_SUPERVISED` has its
//! supervisor at its standard input, a socket: it tells `state`, `ready`, `parameters` and, twice a second, `heartbeat`
//! (ARCHITECTURE.md), takes `restore`, and ends when the other side closes.

use crate::component::{Description, Role};
use crate::link::Link;
use crate::name_lock::NameLock;
use crate::parameter_service::{self, BackendRequests, RequestQueue};
use crate::parameters::{Answer, ParameterServer, Refusal, Requester};
use crate::process::{LoadedConfiguration, StartError, print_error};
use crate::status::{Command, Shared, State};
use rc_middleware::parameters::ParameterService;
use rc_middleware::{Address, Environment};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use serde_json::{Map, Value, json};
use std::io::{self, Read, Write};
use std::os::fd::AsFd;
use std::os::unix::net::{UnixListener, UnixStream};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

const HEARTBEAT: Duration = Duration::from_millis(500);
/// Signals within this time are one.
const SIGNAL_BURST: Duration = Duration::from_millis(300);
/// A longer request is refused.
const LONGEST_LINE: usize = 64 * 1024;
/// The client that is the supervisor; those of the socket are counted from 1.
const SUPERVISOR: u64 = 0;
/// More clients than this at once are turned away.
const MOST_CLIENTS: usize = 32;

/// The management of one component, seen from its worker thread.
pub(crate) struct Management {
    shared: Arc<Shared>,
    info: Arc<ComponentInfo>,
    end: Arc<UnixStream>,
    queue: Arc<RequestQueue>,
    thread: Option<std::thread::JoinHandle<()>>,
    /// Given back after everything else.
    _name_lock: NameLock,
}

/// What does not change while the component runs.
struct ComponentInfo {
    description: &'static Description,
    name: String,
    network: String,
    addresses: Mutex<Vec<String>>,
}

impl Management {
    pub(crate) fn start(
        description: &'static Description,
        environment: &Environment,
        shared: &Arc<Shared>,
        loaded: &LoadedConfiguration,
        whole_process: bool,
    ) -> Result<Self, StartError> {
        let Environment {
            network, instance, ..
        } = environment;
        let refuse = |what: &str, error: &dyn std::fmt::Display| {
            StartError::System(format!("{what}: {error}"))
        };
        let name = NameLock::acquire(environment)?;
        // The name is ours, so a socket that is there belongs to a process that is gone.
        let _ = std::fs::remove_file(name.socket());
        let listener = UnixListener::bind(name.socket())
            .map_err(|e| refuse("the management socket cannot be made", &e))?;
        let info = Arc::new(ComponentInfo {
            description,
            name: instance.clone(),
            network: network.clone(),
            addresses: Mutex::new(Vec::new()),
        });
        let (end, ended) =
            UnixStream::pair().map_err(|e| refuse("a socket pair cannot be made", &e))?;
        let end = Arc::new(end);
        let queue = Arc::new(RequestQueue::new(end.clone()));
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
                end.clone(),
            ),
            shared: shared.clone(),
            backends: BackendRequests::new(queue.clone()),
            listener,
            ended,
            clients: Vec::new(),
            accepted: 0,
            link: None,
            restore: None,
            signals: None,
            notified: None,
            signalled: None,
        };
        server
            .attach(whole_process)
            .map_err(|e| refuse("management cannot start", &e))?;
        let thread = std::thread::Builder::new().name("management".to_owned());
        let thread = thread
            .spawn(move || server.run())
            .map_err(|e| refuse("a thread cannot be made", &e))?;
        Ok(Self {
            shared: shared.clone(),
            info,
            end,
            queue,
            thread: Some(thread),
            _name_lock: name,
        })
    }

    /// Tells where the slots meet their other ends.
    pub(crate) fn addresses(&self, addresses: &[Address]) {
        let mut known = self
            .info
            .addresses
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        *known = addresses.iter().map(ToString::to_string).collect();
    }

    /// The parameters, for others than the worker.
    pub(crate) fn parameters(&self) -> Arc<dyn ParameterService> {
        self.queue.clone()
    }

    /// The worker is initialised; the loop begins.
    pub(crate) fn ready(&self) {
        self.shared.status().state = State::Running;
        self.shared.turned(std::time::Instant::now());
        let _ = (&*self.end).write_all(b"r");
    }
}

/// Ends the thread, however the component ends.
impl Drop for Management {
    fn drop(&mut self) {
        let _ = (&*self.end).write_all(b"e");
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// The thread's own state.
struct Server {
    info: Arc<ComponentInfo>,
    shared: Arc<Shared>,
    listener: UnixListener,
    ended: UnixStream,
    parameters: ParameterServer,
    backends: BackendRequests,
    clients: Vec<Client>,
    /// How many clients there have been.
    accepted: u64,
    link: Option<Link>,
    /// What an earlier run had changed and not saved. It is set again before the supervisor hears that this one is ready.
    restore: Option<Map<String, Value>>,
    signals: Option<UnixStream>,
    notified: Option<State>,
    signalled: Option<Instant>,
}

struct Client {
    number: u64,
    stream: UnixStream,
    read: Vec<u8>,
    /// The rest of a request that is too long is passed over.
    too_long: bool,
}

impl Server {
    fn attach(&mut self, whole_process: bool) -> io::Result<()> {
        self.listener.set_nonblocking(true)?;
        self.ended.set_nonblocking(true)?;
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
        let mut beat = Instant::now();
        let mut ready = false;
        loop {
            self.notify_state();
            let wait = HEARTBEAT.saturating_sub(beat.elapsed());
            let wait = if self.link.is_some() {
                wait
            } else {
                Duration::from_secs(10)
            };
            let wait = self
                .parameters
                .time_left()
                .map_or(wait, |limit| wait.min(limit));
            let events = self.wait(wait);
            // What is to be restored was notified before the process began.
            if events.get(3) == Some(&true) {
                self.link_readable();
            }
            if events.first() == Some(&true) {
                let mut bytes = [0_u8; 8];
                let count = (&self.ended).read(&mut bytes).unwrap_or(0);
                if bytes[..count].contains(&b'r') && !ready {
                    ready = true;
                    self.notify_state();
                    self.be_ready();
                }
                if bytes[..count].contains(&b'e') || count == 0 {
                    self.backends.end();
                    let mut answers = self.parameters.end();
                    answers.retain(|(requester, _)| requester.client != SUPERVISOR);
                    self.send(answers);
                    self.notify_state();
                    return;
                }
            }
            if events.get(1) == Some(&true) {
                self.accept();
            }
            if events.get(2) == Some(&true) {
                self.signalled();
            }
            self.serve(events.get(4..).unwrap_or_default());
            self.backends.turn(&mut self.parameters);
            let answers = self.parameters.turn(&self.shared);
            if let (Some(link), false) = (&mut self.link, answers.is_empty()) {
                link.notify_changes(&self.parameters.unsaved());
            }
            self.send(answers);
            if beat.elapsed() >= HEARTBEAT {
                beat = Instant::now();
                self.notify("heartbeat", &self.info.heartbeat(&self.shared));
            }
        }
    }

    /// Which are readable: end, listener, signals, link, clients.
    fn wait(&self, limit: Duration) -> Vec<bool> {
        let fixed = [Some(self.ended.as_fd()), Some(self.listener.as_fd())];
        let optional = [
            self.signals.as_ref().map(AsFd::as_fd),
            self.link.as_ref().map(Link::descriptor),
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
        if poll(&mut polled, Some(&limit)).is_err() {
            return Vec::new();
        }
        let mut readable = polled.iter().map(|p| !p.revents().is_empty());
        all.iter()
            .map(|fd| fd.is_some() && readable.next().unwrap_or(false))
            .collect()
    }

    fn accept(&mut self) {
        loop {
            let stream = match self.listener.accept() {
                Ok((stream, _)) => stream,
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => return,
                Err(_) => {
                    // The process has no descriptors left; who waits must not make this thread spin.
                    std::thread::sleep(Duration::from_millis(20));
                    return;
                }
            };
            // It is read only where something is there, so the first limit is for what must not happen.
            let limit = Some(Duration::from_millis(200));
            if self.clients.len() < MOST_CLIENTS
                && stream.set_read_timeout(limit).is_ok()
                && stream.set_write_timeout(limit).is_ok()
            {
                self.accepted += 1;
                self.clients.push(Client {
                    number: self.accepted,
                    stream,
                    read: Vec::new(),
                    too_long: false,
                });
            }
        }
    }

    /// The first signal stops in order, a later one at once. Signals that come together are one wish: a terminal
    /// that closes, or a tool that signals a process and then its group, sends several.
    fn signalled(&mut self) {
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

    /// The supervisor has said something, or is gone.
    fn link_readable(&mut self) {
        let Some(input) = self.link.as_mut().map(Link::receive) else {
            return;
        };
        self.restore = input.restore.or(self.restore.take());
        if input.closed {
            self.link = None;
            self.shared.wake_event.stop();
        }
    }

    /// Tells that the component is ready, after what is to be restored.
    fn be_ready(&mut self) {
        let changes = self.restore.take().unwrap_or_default();
        if changes.is_empty() {
            return self.notify("ready", &json!({}));
        }
        let requester = Requester {
            client: SUPERVISOR,
            id: None,
        };
        let changes = json!({ "changes": changes });
        let answer = self.parameters.set(requester, &changes);
        self.send(answer.into_iter().collect());
    }

    fn restored(&self, result: Result<Value, Refusal>) {
        match result {
            Ok(_) => self.notify("restored", &json!({})),
            Err(refusal) => self.notify("restored", &json!({ "refused": refusal.message })),
        }
        self.notify("ready", &json!({}));
    }

    fn notify_state(&mut self) {
        let state = self.shared.status().state;
        if self.notified != Some(state) {
            self.notified = Some(state);
            self.notify("state", &json!({ "state": state.word() }));
        }
    }

    fn notify(&self, method: &str, params: &Value) {
        if let Some(link) = &self.link {
            link.notify(method, params);
        }
    }

    fn serve(&mut self, readable: &[bool]) {
        let mut at = 0;
        let Self {
            clients,
            info,
            shared,
            parameters,
            ..
        } = self;
        clients.retain_mut(|client| {
            let ready = readable.get(at).copied().unwrap_or(false);
            at += 1;
            !ready || client.serve(info, shared, parameters)
        });
    }

    /// Answers those who have waited, if they are still there.
    fn send(&mut self, answers: Vec<Answer>) {
        for (requester, result) in answers {
            if requester.client == SUPERVISOR {
                self.restored(result);
                continue;
            }
            let Some(id) = requester.id else { continue };
            if requester.client == parameter_service::BACKENDS {
                self.backends.answer(&id, result);
                continue;
            }
            let answer = envelope(&id, result);
            self.clients
                .retain_mut(|c| c.number != requester.client || c.send(&answer).is_ok());
        }
    }
}

impl Client {
    /// Answers the lines that have come; false when the client is gone.
    fn serve(
        &mut self,
        info: &ComponentInfo,
        shared: &Shared,
        parameters: &mut ParameterServer,
    ) -> bool {
        let mut bytes = [0_u8; 4096];
        match self.stream.read(&mut bytes) {
            Ok(0) => return false,
            Ok(count) => self.read.extend_from_slice(&bytes[..count]),
            Err(error) => return error.kind() == io::ErrorKind::WouldBlock,
        }
        while let Some(end) = self.read.iter().position(|b| *b == b'\n') {
            let line: Vec<u8> = self.read.drain(..=end).collect();
            if std::mem::take(&mut self.too_long) {
                continue;
            }
            if let Some(answer) = info.answer(&line, self.number, shared, parameters)
                && self.send(&answer).is_err()
            {
                return false;
            }
        }
        if self.too_long {
            self.read.clear();
        } else if self.read.len() > LONGEST_LINE {
            // It is read to its end, since who still sends it does not read the answer.
            self.too_long = true;
            self.read.clear();
            let message = format!("a request has at most {} KiB", LONGEST_LINE / 1024);
            let refusal = Err(Refusal::new(Refusal::INPUT, message));
            return self.send(&envelope(&Value::Null, refusal)).is_ok();
        }
        true
    }

    fn send(&mut self, answer: &Value) -> io::Result<()> {
        self.stream.write_all(format!("{answer}\n").as_bytes())
    }
}

impl ComponentInfo {
    /// The answer to one line; none to a notification, and none yet to what waits for the worker: a change of parameters,
    /// and the saving of them, which comes after the changes before it.
    fn answer(
        &self,
        line: &[u8],
        client: u64,
        shared: &Shared,
        parameters: &mut ParameterServer,
    ) -> Option<Value> {
        let Ok(mut request) = serde_json::from_slice::<Value>(line) else {
            let refusal = Refusal::new(-32700, "this is not JSON");
            return Some(envelope(&Value::Null, Err(refusal)));
        };
        let id = request.get("id").cloned();
        let params = request.get_mut("params").map(Value::take);
        let params = params.unwrap_or_default();
        let wrong = |message: &str| Refusal::new(Refusal::INPUT, message);
        let result = match request.get("method").and_then(Value::as_str) {
            Some("status") => Ok(self.status(shared)),
            Some("parameters") => parameters.list(&params),
            Some("parameters_set") => {
                let (requester, result) = parameters.set(Requester { client, id }, &params)?;
                return Some(envelope(&requester.id?, result));
            }
            Some("parameters_save") => {
                parameters.save(Requester { client, id });
                return None;
            }
            Some("period") => period(&params).map(|period| {
                shared.command(Command::Period(period));
                json!({})
            }),
            Some("emergency") => match params.get("active").and_then(Value::as_bool) {
                Some(active) => {
                    shared.command(Command::Emergency(active));
                    Ok(json!({}))
                }
                None => Err(wrong("`emergency` takes {\"active\": true|false}")),
            },
            Some("stop") => {
                shared.wake_event.stop();
                Ok(json!({}))
            }
            _ => Err(Refusal::new(
                -32601,
                "there are `status`, `parameters`, `parameters_set`, `parameters_save`, `period`, `emergency` and `stop`",
            )),
        };
        Some(envelope(&id?, result))
    }

    /// How old the last turn of the loop is, what the slots that need somebody have, and what was noticed since the
    /// last time.
    fn heartbeat(&self, shared: &Shared) -> Value {
        let mut status = shared.status();
        let delta = std::mem::take(&mut status.delta);
        let slots = self.description.slots.iter().zip(&status.slots);
        // Slots that lost none are left out.
        let lost = slots.clone().filter(|(_, counted)| counted.lost > 0);
        let lost: Map<String, Value> = lost
            .map(|(slot, counted)| (slot.name.to_owned(), counted.lost.into()))
            .collect();
        let needing =
            slots.filter(|(slot, _)| matches!(slot.role, Role::Requires | Role::SubscribesTo));
        let peers: Map<String, Value> = needing
            .map(|(slot, counted)| (slot.name.to_owned(), counted.peers.into()))
            .collect();
        let mut beat = json!({
            "age_ms": shared.age_ms(),
            "lost": lost,
            "peers": peers,
            "silent": delta.silences(self.description.slots),
            "mismatches": delta.mismatches,
        });
        if let Some(mut overruns) = delta.overruns(self.description.slots) {
            overruns["period_ms"] = (status.period.as_secs_f64() * 1e3).into();
            beat["overruns"] = overruns;
        }
        beat
    }

    fn status(&self, shared: &Shared) -> Value {
        let status = shared.status();
        let addresses = self
            .addresses
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        let slots: Vec<Value> = self
            .description
            .slots
            .iter()
            .zip(&status.slots)
            .enumerate()
            .map(|(at, (slot, counted))| {
                json!({
                    "name": slot.name,
                    "role": slot.role.word(),
                    "interface": slot.type_name,
                    "middleware": slot.backend,
                    "address": addresses.get(at),
                    "peers": counted.peers,
                    "handlers": counted.work.to_json(),
                    "sent": status.sent(at),
                    "lost": counted.lost,
                })
            })
            .collect();
        json!({
            "component": self.description.name,
            "name": self.name,
            "network": self.network,
            "pid": std::process::id(),
            "state": status.state.word(),
            "uptime_s": shared.uptime().as_secs_f64(),
            "age_ms": shared.age_ms(),
            "model": format!("{:016x}", self.description.model_hash),
            "middleware": self.description.middleware,
            "period_ms": status.period.as_secs_f64() * 1e3,
            "overruns": status.overruns,
            "compute": status.compute.to_json(),
            "last_error": status.last_error,
            "slots": slots,
        })
    }
}

fn period(params: &Value) -> Result<Duration, Refusal> {
    let ms = params
        .get("ms")
        .and_then(Value::as_f64)
        .filter(|ms| (0.1..=3.6e6).contains(ms));
    ms.map(|ms| Duration::from_secs_f64(ms / 1e3))
        .ok_or_else(|| Refusal::new(Refusal::INPUT, "`period` takes {\"ms\": 0.1 … 3600000}"))
}

fn envelope(id: &Value, result: Result<Value, Refusal>) -> Value {
    match result {
        Ok(result) => json!({ "jsonrpc": "2.0", "id": id, "result": result }),
        Err(refusal) => {
            let mut error = json!({ "code": refusal.code, "message": refusal.message });
            if let Some(data) = refusal.data {
                error["data"] = data;
            }
            json!({ "jsonrpc": "2.0", "id": id, "error": error })
        }
    }
}
