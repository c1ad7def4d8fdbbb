//! Holds a replica of the world, starts it and keeps it.

use crate::files;
use property_graph::Snapshot;
use rc_middleware::Reader;
use rc_world::Message;
use rc_world_member::{Driver, Interface, place};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;
use world_keeper_generated::interfaces::world::{ReceiveWorld, WorldPublisher};
use world_keeper_generated::interfaces::world_stream::{ReceiveWorldStream, WorldStreamPublisher};
use world_keeper_generated::network_time::Time;
use world_keeper_generated::tracing::{info, warn};
use world_keeper_generated::world::rights;
use world_keeper_generated::{Context, HandlerError, Worker, WorkerError};

/// The replica, and what of it is in the file.
pub struct SpecificWorker {
    world: Driver,
    /// The initial content of the world, until it has started.
    start: Option<(PathBuf, Arc<Snapshot>)>,
    /// The version that is in the file.
    kept: Option<u64>,
    next: Time,
    /// The last report about the world, and the time of the next one: peers decide how often it
    /// changes.
    said: String,
    silent_until: Time,
}

/// What to do with a kept file that cannot be read.
const MOVE_AWAY: &str =
    "\nthe world is kept in this file: fix it, or move it away, and the world begins again";

/// The shortest time between two warnings.
const SILENCE: Duration = Duration::from_secs(10);

impl Worker<Context> for SpecificWorker {
    fn initialize(ctx: &mut Context) -> Result<Self, WorkerError> {
        let schema = files::schema(&ctx.params.schema).map_err(WorkerError::Fatal)?;
        let schema = Arc::new(schema);
        let world = Driver::new(ctx, Arc::clone(&schema), rights());
        let (start, keep) = (&ctx.params.start, &ctx.params.keep);
        // The kept file is later than the start file.
        let is_kept = keep.is_file();
        let file = if is_kept { keep } else { start };
        let start = if file.as_os_str().is_empty() {
            None
        } else {
            let graph = files::graph(file, &schema).map_err(|error| {
                let what_to_do = if is_kept { MOVE_AWAY } else { "" };
                WorkerError::Fatal(error + what_to_do)
            })?;
            Some((file.clone(), graph))
        };
        Ok(Self {
            world,
            start,
            kept: None,
            next: ctx.now() + ctx.params.each,
            said: String::new(),
            silent_until: ctx.now(),
        })
    }

    fn compute(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        self.turn(ctx);
        if self.world.has_joined()
            && let Some((file, graph)) = self.start.take()
        {
            self.begin(&file, &graph)?;
            self.turn(ctx);
        }
        self.report(ctx.now());
        if ctx.now() >= self.next {
            self.next = ctx.now() + ctx.params.each;
            self.keep(&ctx.params.keep, &ctx.params.schema)?;
        }
        Ok(())
    }

    fn finalize(&mut self, ctx: &mut Context) {
        if let Err(error) = self.keep(&ctx.params.keep, &ctx.params.schema) {
            warn!("{error}");
        }
        let (state, stream) = (&mut ctx.world, &mut ctx.world_stream);
        self.world
            .leave(&mut |message| send(state, stream, message));
    }
}

impl SpecificWorker {
    fn turn(&mut self, ctx: &mut Context) {
        let now = ctx.now();
        let (state, stream) = (&mut ctx.world, &mut ctx.world_stream);
        self.world
            .turn(now, &mut |message| send(state, stream, message));
    }

    /// Starts the world, unless another replica has it already.
    fn begin(&mut self, file: &Path, graph: &Snapshot) -> Result<(), WorkerError> {
        if self.world.has_start() {
            info!(
                "the world has started already: {} is not read",
                file.display()
            );
            return Ok(());
        }
        let started = self.world.start_with(graph);
        started.map_err(|error| WorkerError::Fatal(error.to_string()))?;
        let (nodes, edges) = (graph.node_count(), graph.edge_count());
        info!("{}: {nodes} nodes, {edges} edges", file.display());
        Ok(())
    }

    /// Says what of the world is not shown, once.
    fn report(&mut self, now: Time) {
        if now < self.silent_until {
            return;
        }
        let state = self.world.state();
        let mut said = String::new();
        if let Some(fault) = &state.fault {
            said = format!("the newest changes are not shown: {fault}");
        } else if state.conflicts > 0 {
            said = format!("{} elements are in conflict and not shown", state.conflicts);
        }
        if said != self.said {
            if !said.is_empty() {
                warn!("{said}");
                self.silent_until = now + SILENCE;
            }
            self.said = said;
        }
    }

    /// Keeps the world, if it has changed. Before it has joined and started, the file has more.
    fn keep(&mut self, file: &Path, schema: &Path) -> Result<(), WorkerError> {
        let now = self.world.snapshot();
        let is_due = self.start.is_none() && self.kept != Some(now.version());
        if file.as_os_str().is_empty() || !is_due || !self.world.has_joined() {
            return Ok(());
        }
        files::keep(file, schema, &now).map_err(WorkerError::Failed)?;
        self.kept = Some(now.version());
        Ok(())
    }
}

fn send(
    state: &mut WorldPublisher,
    stream: &mut WorldStreamPublisher,
    message: &Message,
) -> Result<(), world_keeper_generated::SendError> {
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
