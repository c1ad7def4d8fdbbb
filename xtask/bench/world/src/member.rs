//! One process: a replica, or a component whose topics carry the same bytes.

use crate::linked::Linked;
use rc_middleware::{Reader, Writer};
use rc_world::property_graph::{NodeId, Schema, Value};
use rc_world::{Message, Rights, Setup, Topic, World};
use rc_world_member::{Driver, Interface, place};
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, OnceLock};
use std::time::{Duration, Instant, SystemTime};
use world_agent_generated::interfaces::world::{ReceiveWorld, WorldPublisher};
use world_agent_generated::interfaces::world_stream::{ReceiveWorldStream, WorldStreamPublisher};
use world_agent_generated::types::{self as interface, Change, Key, Step};
use world_agent_generated::{HandlerError, SendError, Worker, WorkerError};

/// Until then, replicas join and nothing is measured.
const WARM: Duration = Duration::from_secs(4);
/// Marks the place of the time in messages.
const MARK: i64 = 0x0123_4567_89ab_cdef;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Mode {
    World,
    Topic,
}

/// The task of a process.
#[derive(Clone, Debug)]
pub(crate) struct Role {
    pub(crate) mode: Mode,
    /// Changes a second.
    pub(crate) rate: u64,
    pub(crate) receives: bool,
    /// The values are those of a stream.
    pub(crate) stream: bool,
    /// How many nodes the world has; of a topic, one sample has all of them.
    pub(crate) nodes: usize,
    /// It begins after the others.
    pub(crate) late: bool,
    pub(crate) seconds: u64,
}

impl Role {
    /// This member with topics.
    pub(crate) fn as_topic(&self) -> Self {
        let mut topic = self.clone();
        topic.mode = Mode::Topic;
        // The sample is sent without a request, and in time also by a process that starts late.
        if self.nodes > 1 && !self.receives {
            topic.rate = 2;
        }
        topic
    }

    pub(crate) fn text(&self) -> String {
        let number = u64::from;
        let all = [
            number(self.mode == Mode::World),
            self.rate,
            number(self.receives),
            number(self.stream),
            self.nodes as u64,
            number(self.late),
            self.seconds,
        ];
        all.map(|number| number.to_string()).join(",")
    }

    fn read(text: &str) -> Option<Self> {
        let all: Result<Vec<u64>, _> = text.split(',').map(str::parse).collect();
        let [mode, rate, receives, stream, nodes, late, seconds] = all.ok()?[..] else {
            return None;
        };
        Some(Self {
            mode: if mode == 1 { Mode::World } else { Mode::Topic },
            rate,
            receives: receives == 1,
            stream: stream == 1,
            nodes: nodes as usize,
            late: late == 1,
            seconds,
        })
    }
}

/// The measurements of a process.
pub(crate) struct Done {
    pub(crate) count: u64,
    pub(crate) median_us: f64,
    /// The first of them, before which nothing was measured.
    pub(crate) first_us: f64,
    /// Milliseconds of processor time a second.
    pub(crate) processor: f64,
    pub(crate) memory_kb: f64,
}

impl Done {
    pub(crate) fn read(line: &str) -> Option<Self> {
        let read: serde_json::Value = serde_json::from_str(line).ok()?;
        let number = |name: &str| read[name].as_f64();
        Some(Self {
            count: read["count"].as_u64()?,
            median_us: number("median_us").unwrap_or(f64::NAN),
            first_us: number("first_us").unwrap_or(f64::NAN),
            processor: number("processor")?,
            memory_kb: number("memory_kb")?,
        })
    }
}

/// The nanoseconds of the processors that each thread of this process has taken.
fn processor_times() -> BTreeMap<OsString, u64> {
    let tasks = std::fs::read_dir("/proc/self/task").into_iter().flatten();
    let times = tasks.flatten().filter_map(|task| {
        let text = std::fs::read_to_string(task.path().join("schedstat")).ok()?;
        let time = text.split_whitespace().next()?.parse().ok()?;
        Some((task.file_name(), time))
    });
    times.collect()
}

fn memory_kb() -> u64 {
    let text = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = text.lines().find(|line| line.starts_with("RssAnon:"));
    let number = line.and_then(|line| line.split_whitespace().nth(1)?.parse().ok());
    number.unwrap_or_default()
}

fn nanos() -> i64 {
    let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
    now.map_or(0, |now| now.as_nanos() as i64)
}

/// The variable with the role of a process.
pub(crate) const ROLE_OF: &str = "RC_BENCH_WORLD";

static IS_OVER: AtomicBool = AtomicBool::new(false);
static ROLE: OnceLock<Role> = OnceLock::new();
static DELAYS: Mutex<Vec<i64>> = Mutex::new(Vec::new());

fn note(delay: i64) {
    if let Ok(mut delays) = DELAYS.lock() {
        delays.push(delay);
    }
}

struct Member {
    role: Role,
    world: Driver,
    stone: Option<NodeId>,
    began: Instant,
    due: u64,
    last: i64,
    /// When it first asked, of one that is late.
    asked: Option<i64>,
    /// The bytes of a sample, and where its time is.
    sample: (Vec<u8>, usize),
    /// The world of many nodes as one sample.
    whole: Change,
}

/// The world before anything is measured.
fn fill(world: &World, role: &Role, name: &str) -> Result<(), rc_world::Error> {
    let made = world.change(|edit| {
        for number in 0..role.nodes {
            let stone = edit.add_node("stone")?;
            edit.set(stone, "name", format!("{name}-{number}"))?;
            edit.set(stone, "at", 0_i64)?;
        }
        Ok(())
    });
    made.map(|_| ())
}

/// The node that changes, which a worker that moves it knows.
fn first(world: &World, name: &str) -> Option<NodeId> {
    let now = world.snapshot();
    now.named(&format!("{name}-0")).next()
}

fn put(world: &World, stone: Option<NodeId>, value: i64) {
    let set = world.change(|edit| stone.map_or(Ok(()), |stone| Ok(edit.set(stone, "at", value)?)));
    if let Err(error) = set {
        eprintln!("{error}");
    }
}

fn rights(role: &Role) -> Rights {
    let rights = Rights::everything();
    if role.stream {
        rights.with_stream("stone", "at", Duration::ZERO)
    } else {
        rights
    }
}

fn bytes(message: &Message) -> Vec<u8> {
    let mut writer = Writer::default();
    message.encode(&mut writer);
    writer.into_bytes()
}

/// The nodes of [`fill`] as the steps that a late joiner gets.
fn whole(nodes: usize, name: &str) -> Change {
    let mut steps = Vec::with_capacity(3 * nodes);
    for number in 0..nodes as u64 {
        let of = Key {
            writer: u64::MAX,
            count: number + 1,
        };
        let step = |what: u8, sequence: u64, name: &str, value: interface::Value| Step {
            what,
            count: sequence,
            writer: of.writer,
            sequence,
            name: name.to_owned(),
            of: if what == 0 {
                Key::default()
            } else {
                of.clone()
            },
            value,
            ..Step::default()
        };
        let attribute = nodes as u64 + 2 * number + 1;
        let called = interface::Value {
            kind: 4,
            texts: vec![format!("{name}-{number}")],
            ..interface::Value::default()
        };
        let at = interface::Value {
            kind: 2,
            ints: vec![0],
            ..interface::Value::default()
        };
        steps.push(step(0, of.count, "stone", interface::Value::default()));
        steps.push(step(2, attribute + 1, "at", at));
        steps.push(step(2, attribute, "name", called));
    }
    Change {
        steps,
        ..Change::default()
    }
}

/// The message that a replica sends for a change.
fn sample(role: &Role, name: &str) -> (Vec<u8>, usize) {
    let setup = Setup::new(name, Schema::anything().into());
    let world = World::new(setup.with_rights(rights(role)));
    let filled = fill(
        &world,
        &Role {
            nodes: 1,
            ..role.clone()
        },
        name,
    );
    debug_assert!(filled.is_ok());
    put(&world, first(&world, name), MARK);
    world.turn(Duration::ZERO);
    let wanted = if role.stream {
        Topic::Samples
    } else {
        Topic::Change
    };
    let messages = std::iter::from_fn(|| world.take());
    let last = messages.filter(|message| message.topic() == wanted).last();
    let bytes = last.as_ref().map(bytes).unwrap_or_default();
    let mark = MARK.to_le_bytes();
    let at = bytes.windows(8).position(|part| part == mark);
    (bytes, at.unwrap_or_default())
}

impl Worker<Linked> for Member {
    fn initialize(ctx: &mut Linked) -> Result<Self, WorkerError> {
        let role = ROLE.get().cloned();
        let role = role.ok_or_else(|| WorkerError::Fatal("no role".to_owned()))?;
        if role.rate > 100 {
            ctx.set_period(Duration::from_millis(1));
        }
        let world = Driver::new(ctx, Schema::anything().into(), rights(&role));
        let name = ctx.name().to_owned();
        if role.mode == Mode::World && (role.rate > 0 || role.nodes > 1) && !role.late {
            fill(&world, &role, &name)?;
        }
        let sample = sample(&role, &name);
        let whole = whole(role.nodes, &name);
        let stone = first(&world, &name);
        Ok(Self {
            role,
            world,
            stone,
            began: Instant::now(),
            due: 0,
            last: 0,
            asked: None,
            sample,
            whole,
        })
    }

    fn compute(&mut self, ctx: &mut Linked) -> Result<(), WorkerError> {
        if IS_OVER.load(Ordering::Relaxed) {
            ctx.stop("everything is measured");
        }
        if self.began.elapsed() > WARM {
            self.due += self.role.rate * ctx.period().as_millis() as u64;
        }
        while self.due >= 1000 {
            self.due -= 1000;
            match self.role.mode {
                Mode::World => put(&self.world, self.stone, nanos()),
                Mode::Topic => self.publish(ctx)?,
            }
        }
        self.turn(ctx);
        Ok(())
    }
}

impl Member {
    fn publish(&mut self, ctx: &mut Linked) -> Result<(), WorkerError> {
        if self.role.nodes > 1 {
            self.whole.time = nanos();
            let sent = ctx.0.g.change(&self.whole);
            return sent.map_err(|error| WorkerError::Failed(error.to_string()));
        }
        let (bytes, at) = &mut self.sample;
        bytes[*at..*at + 8].copy_from_slice(&nanos().to_le_bytes());
        let topic = if self.role.stream {
            ctx.0.g_stream.rc_topic(0)
        } else {
            ctx.0.g.rc_topic(0)
        };
        let sent = topic.map_or(Ok(()), |topic| {
            topic.publish_with(|writer| writer.raw(bytes))
        });
        sent.map_err(|error| WorkerError::Failed(error.to_string()))
    }

    fn turn(&mut self, ctx: &mut Linked) {
        if self.role.mode == Mode::Topic {
            return;
        }
        let now = ctx.now();
        let (state, stream) = (&mut ctx.0.g, &mut ctx.0.g_stream);
        let asked = &mut self.asked;
        self.world.turn(now, &mut |message| {
            if message.topic() == Topic::Ask {
                // A repeated question is part of the time.
                asked.get_or_insert_with(nanos);
            }
            send(state, stream, message)
        });
    }

    /// The handler of a change.
    fn look(&mut self) {
        let now = self.world.snapshot();
        if self.role.late {
            if let Some(asked) = self.asked.filter(|_| now.node_count() >= self.role.nodes) {
                note(nanos() - asked);
                self.role.receives = false;
            }
            return;
        }
        let Some(news) = self.world.news() else {
            return;
        };
        for (element, _) in news.of("stone").changed {
            let rc_world::property_graph::Element::Node(node) = element else {
                continue;
            };
            let at = news.after.node(node).ok();
            let at = at.and_then(|node| match node.get("at") {
                Some(Value::Int(at)) => Some(*at),
                _ => None,
            });
            if let Some(at) = at.filter(|at| *at > self.last) {
                self.last = at;
                note(nanos() - at);
            }
        }
    }

    fn take(
        &mut self,
        ctx: &mut Linked,
        topic: (bool, usize),
        reader: &mut Reader<'_>,
    ) -> Result<(), HandlerError> {
        if self.role.mode == Mode::Topic && self.role.nodes > 1 {
            let whole: Change = reader.get()?;
            if self.role.receives {
                note(nanos() - std::hint::black_box(whole).time);
            }
            return Ok(());
        }
        if self.role.mode == Mode::Topic {
            let (bytes, at) = (reader.rest(), self.sample.1);
            let time = bytes.get(at..at + 8).and_then(|time| time.try_into().ok());
            let of = if topic.0 {
                Topic::Samples
            } else {
                Topic::Change
            };
            Message::decode(of, reader)?;
            if let Some(time) = time.filter(|_| self.role.receives) {
                note(nanos() - i64::from_le_bytes(time));
            }
            return Ok(());
        }
        if topic.0 {
            self.world.receive_stream(topic.1, reader)?;
        } else {
            self.world.receive_state(topic.1, reader)?;
        }
        self.turn(ctx);
        if self.role.receives {
            self.look();
        }
        Ok(())
    }
}

fn send(
    state: &mut WorldPublisher,
    stream: &mut WorldStreamPublisher,
    message: &Message,
) -> Result<(), SendError> {
    let topic = match place(message) {
        (Interface::World, at) => state.rc_topic(at),
        (Interface::WorldStream, at) => stream.rc_topic(at),
    };
    topic.map_or(Ok(()), |topic| {
        topic.publish_with(|writer| message.encode(writer))
    })
}

impl ReceiveWorld<Linked> for Member {
    fn receive(
        &mut self,
        ctx: &mut Linked,
        topic: usize,
        reader: &mut Reader<'_>,
    ) -> Result<(), HandlerError> {
        self.take(ctx, (false, topic), reader)
    }
}

impl ReceiveWorldStream<Linked> for Member {
    fn receive(
        &mut self,
        ctx: &mut Linked,
        topic: usize,
        reader: &mut Reader<'_>,
    ) -> Result<(), HandlerError> {
        self.take(ctx, (true, topic), reader)
    }
}

/// Runs a process, and prints its measurements. As in any component, the worker has the first thread:
/// the memory of another one grows page by page.
pub(crate) fn run(role: &str) -> Result<(), String> {
    let role = Role::read(role).ok_or("no such role")?;
    let measured = Duration::from_secs(role.seconds);
    let _ = ROLE.set(role.clone());
    if role.late && role.mode == Mode::World {
        std::thread::sleep(WARM);
    }
    let measuring = std::thread::spawn(move || {
        std::thread::sleep(WARM);
        let before = processor_times();
        std::thread::sleep(measured);
        // The time of a thread that has ended since is not known.
        let taken = processor_times().into_iter().map(|(thread, time)| {
            time.saturating_sub(before.get(&thread).copied().unwrap_or_default())
        });
        let taken = taken.sum::<u64>() as f64 / 1e6 / measured.as_secs_f64();
        let memory = memory_kb();
        // The others have measured, too.
        std::thread::sleep(Duration::from_millis(500));
        IS_OVER.store(true, Ordering::Relaxed);
        (taken, memory)
    });
    if rc_runtime::adapter::run::<Member, Linked>() != ExitCode::SUCCESS {
        return Err(format!("the process {role:?} failed"));
    }
    let measured = measuring.join();
    let (taken, memory) = measured.map_err(|_| "nothing was measured".to_owned())?;
    let mut delays = DELAYS.lock().map_err(|error| error.to_string())?;
    let first = delays.first().map(|delay| *delay as f64 / 1e3);
    delays.sort_unstable();
    let median = delays
        .get(delays.len() / 2)
        .map(|delay| *delay as f64 / 1e3);
    let line = serde_json::json!({
        "count": delays.len(),
        "median_us": median,
        "first_us": first,
        "processor": taken,
        "memory_kb": memory,
    });
    println!("{line}");
    Ok(())
}
