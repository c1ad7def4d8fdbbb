//! An agent of the test process: a component whose worker hands its replica to the test.

use rc_middleware::Reader;
use rc_world::property_graph::Schema;
use rc_world::{Message, Rights, World};
use rc_world_member::{Driver, Interface, place};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};
use world_keeper_generated::interfaces::world::ReceiveWorld;
use world_keeper_generated::interfaces::world_stream::ReceiveWorldStream;
use world_keeper_generated::{Context, Embedded, HandlerError, SendError, Worker, WorkerError};

/// The replicas of the agents, by their names.
static WORLDS: Mutex<BTreeMap<String, Arc<World>>> = Mutex::new(BTreeMap::new());

struct Agent(Driver);

impl Agent {
    fn turn(&mut self, ctx: &mut Context) {
        let now = ctx.now();
        let (state, stream) = (&mut ctx.world, &mut ctx.world_stream);
        let mut send = |message: &Message| -> Result<(), SendError> {
            let topic = match place(message) {
                (Interface::World, at) => state.rc_topic(at),
                (Interface::WorldStream, at) => stream.rc_topic(at),
            };
            topic.map_or(Ok(()), |topic| {
                topic.publish_with(|writer| message.encode(writer))
            })
        };
        self.0.turn(now, &mut send);
    }
}

impl Worker<Context> for Agent {
    fn initialize(ctx: &mut Context) -> Result<Self, WorkerError> {
        let rights = Rights::everything();
        let driver = Driver::new(ctx, Arc::new(Schema::anything()), rights);
        let mut worlds = WORLDS.lock().expect("no panic");
        worlds.insert(ctx.name().to_owned(), driver.shared());
        Ok(Self(driver))
    }

    fn compute(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        self.turn(ctx);
        Ok(())
    }
}

impl ReceiveWorld<Context> for Agent {
    fn receive(
        &mut self,
        ctx: &mut Context,
        topic: usize,
        reader: &mut Reader<'_>,
    ) -> Result<(), HandlerError> {
        self.0.receive_state(topic, reader)?;
        self.turn(ctx);
        Ok(())
    }
}

impl ReceiveWorldStream<Context> for Agent {
    fn receive(
        &mut self,
        ctx: &mut Context,
        topic: usize,
        reader: &mut Reader<'_>,
    ) -> Result<(), HandlerError> {
        self.0.receive_stream(topic, reader)?;
        self.turn(ctx);
        Ok(())
    }
}

/// Starts an agent on a thread of this process.
pub fn start(network: &str, name: &str) -> (Embedded, Arc<World>) {
    let args = ["--network", network, "--name", name];
    let embedded = world_keeper_generated::embed::<Agent>(&args).expect("an agent");
    let worlds = WORLDS.lock().expect("no panic");
    (embedded, Arc::clone(&worlds[name]))
}
