//! Makes changes at random until there is a file `stop`. It writes down all that it sends before it
//! sends it, and at the end what it has.

use rc_middleware::{Reader, Writer};
use rc_world::property_graph::{EdgeId, Edit, Element, Error as GraphError, Id, NodeId, Value};
use rc_world::{Message, Topic};
use rc_world_member::{Driver, Interface, place};
use std::fmt::Write as _;
use std::fs::File;
use std::io::Write as _;
use std::path::PathBuf;
use std::time::Duration;
use world_agent_generated::interfaces::world::{ReceiveWorld, WorldPublisher};
use world_agent_generated::interfaces::world_stream::{ReceiveWorldStream, WorldStreamPublisher};
use world_agent_generated::tracing::warn;
use world_agent_generated::world::rights;
use world_agent_generated::{Context, HandlerError, Worker, WorkerError};

/// How many elements a world of these agents has at most, about.
const MOST: usize = 600;

pub struct SpecificWorker {
    world: Driver,
    log: Log,
    folder: PathBuf,
    /// How many elements it has made, for their names.
    made: u64,
    /// Changes that are due, in thousandths.
    due: i64,
    moved: i64,
}

/// Its report.
struct Log {
    file: File,
    /// The last digest that it sent.
    digest: Vec<u8>,
}

impl Log {
    /// A part: its kind, its length, and its bytes.
    fn put(&mut self, kind: u8, bytes: &[u8]) {
        let mut part = vec![kind];
        part.extend((bytes.len() as u32).to_le_bytes());
        part.extend(bytes);
        if let Err(error) = self.file.write_all(&part) {
            warn!("the log cannot be written: {error}");
        }
    }

    fn sent(&mut self, message: &Message) {
        let mut writer = Writer::default();
        message.encode(&mut writer);
        match message.topic() {
            Topic::Change => self.put(b'C', &writer.into_bytes()),
            Topic::Digest => self.digest = writer.into_bytes(),
            Topic::Ask | Topic::Chunk | Topic::Samples => {}
        }
    }
}

impl Worker<Context> for SpecificWorker {
    fn initialize(ctx: &mut Context) -> Result<Self, WorkerError> {
        let files = [("things.gdsl", include_str!("../things.gdsl"))];
        let schema = rc_world_typed::schema(ctx, &files).map_err(WorkerError::Fatal)?;
        let world = Driver::new(ctx, schema, rights());
        let folder = ctx.params.folder.clone();
        let writer = world.state().writer;
        let file = File::create(folder.join(format!("{writer}.log")));
        let file = file.map_err(|error| WorkerError::Fatal(format!("its log: {error}")))?;
        Ok(Self {
            world,
            log: Log {
                file,
                digest: Vec::new(),
            },
            folder,
            made: 0,
            due: 0,
            moved: 0,
        })
    }

    fn compute(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        let is_busy = self.world.has_joined() && !self.folder.join("stop").exists();
        if is_busy {
            self.due += i64::from(ctx.params.rate) * ctx.period().as_millis() as i64;
        }
        while self.due >= 1000 {
            self.due -= 1000;
            self.change(ctx);
        }
        self.turn(ctx);
        Ok(())
    }

    fn finalize(&mut self, ctx: &mut Context) {
        let (state, stream) = (&mut ctx.g, &mut ctx.g_stream);
        self.world
            .leave(&mut |message| send(state, stream, message));
        if !self.folder.join("stop").exists() {
            return;
        }
        let text = self.state();
        let file = self
            .folder
            .join(format!("{}.end", self.world.state().writer));
        if let Err(error) = std::fs::write(file, text) {
            warn!("its end cannot be written: {error}");
        }
    }
}

impl SpecificWorker {
    fn turn(&mut self, ctx: &mut Context) {
        let now = ctx.now();
        let (state, stream) = (&mut ctx.g, &mut ctx.g_stream);
        let log = &mut self.log;
        self.world.turn(now, &mut |message| {
            log.sent(message);
            send(state, stream, message)
        });
    }

    /// One change of one to four steps.
    fn change(&mut self, ctx: &mut Context) {
        let world = self.world.shared();
        let now = world.snapshot();
        let nodes: Vec<NodeId> = now.nodes().map(|node| node.node_id()).collect();
        let edges: Vec<EdgeId> = now.edges().map(|edge| edge.edge_id()).collect();
        let own = world.status(Duration::ZERO).writer;
        let steps = ctx.random().usize(1..=4);
        let random = ctx.random();
        let choices = (0..steps).map(|_| {
            let (one, other) = (random.usize(..), random.usize(..));
            (random.u32(..100), one, other, random.i64(0..1_000_000))
        });
        let choices: Vec<_> = choices.collect();
        let mut streamed: Vec<(Id, i64)> = Vec::new();
        let (made, moved) = (&mut self.made, &mut self.moved);
        let changed = world.change(|edit| {
            for (what, one, other, value) in choices {
                let node = nodes.get(one % nodes.len().max(1)).copied();
                let second = nodes.get(other % nodes.len().max(1)).copied();
                let edge = edges.get(one % edges.len().max(1)).copied();
                let is_full = nodes.len() + edges.len() > MOST;
                let done = match what {
                    0..25 if !is_full => add(edit, own, made, value).map(|()| None),
                    25..40 if !is_full => near(edit, node, second).map(|()| None),
                    40..44 => remove(edit, node.map(Element::from)).map(|()| None),
                    44..47 => remove(edit, edge.map(Element::from)).map(|()| None),
                    47..52 => unset(edit, node).map(|()| None),
                    52..65 => step(edit, node, own, moved),
                    _ => set(edit, node, value).map(|()| None),
                };
                match done {
                    // An element that an earlier step has removed.
                    Err(GraphError::Removed) => {}
                    other => streamed.extend(other?),
                }
            }
            Ok(())
        });
        if let Err(error) = changed {
            warn!("a change was refused: {error}");
            return;
        }
        for (of, at) in streamed {
            let numbers = [of.writer(), of.count(), at.cast_unsigned()];
            let bytes: Vec<u8> = numbers.iter().flat_map(|n| n.to_le_bytes()).collect();
            self.log.put(b'S', &bytes);
        }
    }

    /// Its content, line by line.
    fn state(&self) -> String {
        let now = self.world.snapshot();
        let status = self.world.state();
        let mut text = format!("D {:016x} {:016x}\n", status.digest, status.streams);
        let counts = &status.counts;
        let _ = writeln!(
            text,
            "I refused={} gaps={} asked={} answered={} dropped={} conflicts={} last={}",
            counts.refused,
            counts.gaps,
            counts.asked,
            counts.answered,
            counts.dropped,
            status.conflicts,
            counts.last_refusal
        );
        let mut digest = String::new();
        for byte in &self.log.digest {
            let _ = write!(digest, "{byte:02x}");
        }
        let _ = writeln!(text, "H {digest}");
        for node in now.nodes() {
            let values = values(node.attributes());
            let _ = writeln!(text, "N {} {}{values}", id(node.id()), node.type_name());
        }
        for edge in now.edges() {
            let end = |node| {
                now.node(node)
                    .map_or_else(|_| "?".to_owned(), |n| id(n.id()))
            };
            let (from, to) = (end(edge.from()), end(edge.to()));
            let values = values(edge.attributes());
            let kind = edge.type_name();
            let _ = writeln!(text, "E {} {kind} {from} {to}{values}", id(edge.id()));
        }
        text
    }
}

fn id(id: Id) -> String {
    format!("{}:{}", id.writer(), id.count())
}

fn values<'v>(all: impl Iterator<Item = (&'v str, &'v Value)>) -> String {
    let mut all: Vec<String> = all
        .map(|(name, value)| match value {
            Value::Int(number) => format!(" {name}={number}"),
            Value::Text(text) => format!(" {name}={text}"),
            other => format!(" {name}={other:?}"),
        })
        .collect();
    all.sort();
    all.concat()
}

type Done = Result<(), GraphError>;

fn add(edit: &mut Edit, own: u64, made: &mut u64, value: i64) -> Done {
    let node = edit.add_node("thing")?;
    edit.set(node, "name", format!("{own}-{made}"))?;
    edit.set(node, "x", value)?;
    *made += 1;
    Ok(())
}

fn near(edit: &mut Edit, from: Option<NodeId>, to: Option<NodeId>) -> Done {
    if let (Some(from), Some(to)) = (from, to) {
        edit.add_edge("near", from, to)?;
    }
    Ok(())
}

fn remove(edit: &mut Edit, element: Option<Element>) -> Done {
    match element {
        Some(Element::Node(node)) => edit.remove_node(node),
        Some(Element::Edge(edge)) => edit.remove_edge(edge),
        None => Ok(()),
    }
}

fn set(edit: &mut Edit, node: Option<NodeId>, value: i64) -> Done {
    let Some(node) = node else { return Ok(()) };
    edit.set(node, if value % 2 == 0 { "x" } else { "y" }, value)
}

fn unset(edit: &mut Edit, node: Option<NodeId>) -> Done {
    let Some(node) = node else { return Ok(()) };
    edit.unset(node, "y")
}

/// The next value of the stream of a node of its own.
fn step(
    edit: &mut Edit,
    node: Option<NodeId>,
    own: u64,
    moved: &mut i64,
) -> Result<Option<(Id, i64)>, GraphError> {
    let Some(node) = node else { return Ok(None) };
    let of = edit.snapshot().node(node)?.id();
    if of.writer() != own {
        return Ok(None);
    }
    *moved += 1;
    edit.set(node, "at", *moved)?;
    Ok(Some((of, *moved)))
}

fn send(
    state: &mut WorldPublisher,
    stream: &mut WorldStreamPublisher,
    message: &Message,
) -> Result<(), world_agent_generated::SendError> {
    let topic = match place(message) {
        (Interface::World, at) => state.rc_topic(at),
        (Interface::WorldStream, at) => stream.rc_topic(at),
    };
    topic.map_or(Ok(()), |topic| {
        topic.publish_with(|writer| message.encode(writer))
    })
}

impl ReceiveWorld<Context> for SpecificWorker {
    fn receive(
        &mut self,
        ctx: &mut Context,
        topic: usize,
        reader: &mut Reader<'_>,
    ) -> Result<(), HandlerError> {
        self.world.receive_state(topic, reader)?;
        self.turn(ctx);
        Ok(())
    }
}

impl ReceiveWorldStream<Context> for SpecificWorker {
    fn receive(
        &mut self,
        ctx: &mut Context,
        topic: usize,
        reader: &mut Reader<'_>,
    ) -> Result<(), HandlerError> {
        self.world.receive_stream(topic, reader)?;
        self.turn(ctx);
        Ok(())
    }
}
