//! The component of the benchmark: the slots of `world_agent`, over each middleware that is measured.

use rc_runtime::{
    Core, Description, Dispatch, Ports, Serving, SlotEntry, StartError, Values, WorkerContext,
    WorkerTable,
};
use std::ops::{Deref, DerefMut};
use world_agent_generated::interfaces::world::ReceiveWorld;
use world_agent_generated::interfaces::world_stream::ReceiveWorldStream;
use world_agent_generated::{Context, Worker};

/// The context of `world_agent`.
pub(crate) struct Linked(pub(crate) Context);

struct Nobody;

impl Worker<Context> for Nobody {
    fn initialize(_ctx: &mut Context) -> Result<Self, world_agent_generated::WorkerError> {
        Ok(Self)
    }
}

static DESCRIPTION: Description = Description {
    backends: &[rc_iceoryx2::LINKED, rc_dds::LINKED],
    ..*<Context as Dispatch<Nobody>>::DESCRIPTION
};

impl Deref for Linked {
    type Target = Core;

    fn deref(&self) -> &Core {
        &self.0
    }
}

impl DerefMut for Linked {
    fn deref_mut(&mut self) -> &mut Core {
        &mut self.0
    }
}

impl WorkerContext for Linked {
    fn open(core: Core, ports: &Ports, values: &Values) -> Result<Self, StartError> {
        Context::open(core, ports, values).map(Self)
    }

    fn sending_peers(&self, peers: &mut [usize]) {
        self.0.sending_peers(peers);
    }
}

impl<W: Worker<Linked> + 'static> Dispatch<W> for Linked {
    const DESCRIPTION: &'static Description = &DESCRIPTION;
    const WORKER: WorkerTable<W, Self> = WorkerTable::plain();
}

impl<W> Serving<W> for Linked
where
    W: Worker<Linked> + ReceiveWorld<Linked> + ReceiveWorldStream<Linked> + 'static,
{
    const SLOTS: &'static [SlotEntry<W, Self>] = &[
        SlotEntry::sends(),
        SlotEntry::sends(),
        SlotEntry::receives(<W as ReceiveWorld<Linked>>::receive),
        SlotEntry::receives(<W as ReceiveWorldStream<Linked>>::receive),
    ];
}
