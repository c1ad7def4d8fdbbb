//! The tables of generated code: which functions of a worker serve its slots, its state machine and
//! its life cycle.

use crate::collect::{Collect, Collected};
use crate::context::Core;
use crate::description::Description;
use crate::error::StartError;
use crate::lifecycle::{Hook, Transition};
use crate::machine::{MachineEvents, Parts};
use crate::ports::Ports;
use crate::worker::{ManagedWorker, Worker};
use crate::worker_error::WorkerError;
use rc_configuration::{ParamChange, Values};
use rc_middleware::typed::{Done, Ended, HandlerError, Request, TypedClient};
use rc_middleware::{Member, Reader};
use std::ops::DerefMut;

/// Lets a generated context dereference to the [`Core`] in its field `core`.
#[macro_export]
macro_rules! deref_to_core {
    ($context:ty) => {
        impl ::std::ops::Deref for $context {
            type Target = $crate::Core;

            fn deref(&self) -> &$crate::Core {
                &self.core
            }
        }

        impl ::std::ops::DerefMut for $context {
            fn deref_mut(&mut self) -> &mut $crate::Core {
                &mut self.core
            }
        }
    };
}

/// Names of this crate that a worker takes from its generated crate.
#[macro_export]
macro_rules! names_of_workers {
    () => {
        $crate::names_of_workers!(@"the state of the component is `ComponentState`");
    };
    (machine) => {
        $crate::names_of_workers!(@"the state of the component is `ComponentState`, that of its state machine `machine::MachineState`");
    };
    (@$note:literal) => {
        pub use $crate::middleware::typed::{HandlerError, Request};
        pub use $crate::middleware::{CallError, InPlace, SendError};
        pub use $crate::{
            ComponentState, Embedded, ParamChange, WorkerError, network_time, tracing,
        };

        // The name of earlier versions, which is also that of the state of a machine.
        #[doc(hidden)]
        #[deprecated(note = $note)]
        pub type State = $crate::ComponentState;
    };
}

/// Declares the functions that run a component, over its context and the trait of its handlers.
#[macro_export]
macro_rules! entry_points {
    ($context:ty, $handlers:ident) => {
        /// Runs the component with the command line of this process until it ends.
        pub fn run<W: $handlers>() -> ::std::process::ExitCode {
            $crate::adapter::run::<W, $context>()
        }

        /// Runs the component on a thread of this process, with a command line as for its binary:
        /// for tests.
        pub fn embed<W: $handlers>(
            args: &[&str],
        ) -> ::std::result::Result<$crate::Embedded, $crate::StartError> {
            $crate::adapter::embed::<W, $context>(args)
        }
    };
}

/// The context of a worker, which generated code declares: parameters, clients and publishers.
pub trait WorkerContext: DerefMut<Target = Core> + Sized {
    /// Opens the clients and publishers.
    fn open(core: Core, ports: &Ports, values: &Values) -> Result<Self, StartError>;

    /// Takes new values of the parameters.
    fn set_parameters(&mut self, values: &Values) {
        let _ = values;
    }

    /// Runs after the worker was initialized.
    fn initialized(&mut self) {}

    /// Runs after the worker was finalized: the last messages of the context.
    fn leave(&mut self) {}

    /// Why the context itself cannot take the last values of the parameters.
    fn refusal(&mut self) -> Option<String> {
        None
    }

    /// Writes the number of peers of each slot that requires or publishes into `peers`.
    fn sending_peers(&self, peers: &mut [usize]) {
        let _ = peers;
    }

    /// The state machine, if the component has one.
    fn machine(&mut self) -> Option<&mut Parts> {
        None
    }

    /// The client of an asynchronous slot, or of the member of an array of them.
    fn asynchronous(&mut self, slot: usize, member: Option<&Member>) -> Option<&mut TypedClient> {
        let _ = (slot, member);
        None
    }
}

/// Reads the result of a started call of a slot, or of a member of an array, for a handler of the
/// worker. `None` if the slot has no such operation.
pub type End<W, C> = fn(Ended<'_>, Option<&Member>) -> Option<Done<W, C>>;

/// The tables of a component whose worker is `W`. Generated code implements it for its context, for
/// workers that have the functions of the machine and those that handle the ends of calls.
pub trait Dispatch<W: 'static>: WorkerContext + 'static {
    /// The component.
    const DESCRIPTION: &'static Description;
    /// The functions of the worker.
    const WORKER: WorkerTable<W, Self>;
    /// The functions of the state machine.
    const MACHINE: MachineTable<W, Self> = MachineTable::NONE;
    /// The numbers of the asynchronous slots, and how their calls end.
    const ENDS: &'static [(usize, End<W, Self>)] = &[];
}

/// [`Dispatch`] for workers that have the handlers of all slots.
pub trait Serving<W: 'static>: Dispatch<W> {
    /// One entry for each slot, in the order of the description.
    const SLOTS: &'static [SlotEntry<W, Self>];
    /// Collections of samples.
    const COLLECTS: &'static [Collect] = &[];
    /// The handlers of what it collects, in the same order.
    const COLLECTED: &'static [CollectedHandler<W, Self>] = &[];
    /// Runs in each turn of the event loop, after handlers: the context's own work. Returns whether
    /// it did anything.
    const TURN: Option<fn(&mut W, &mut Self) -> bool> = None;
}

/// Lets the worker handle samples that were collected, one of each topic, in their order.
pub type CollectedHandler<W, C> = fn(&mut W, &mut C, &[Collected]) -> Result<(), HandlerError>;

type Fallible<W, C> = fn(&mut W, &mut C) -> Result<(), WorkerError>;
type Infallible<W, C> = fn(&mut W, &mut C);

/// The functions of a [`Worker`] or a [`ManagedWorker`].
pub struct WorkerTable<W, C> {
    pub(crate) initialize: fn(&mut C) -> Result<W, WorkerError>,
    pub(crate) compute: Fallible<W, C>,
    pub(crate) params_changed: fn(&mut W, &mut C, &[ParamChange]) -> Result<(), WorkerError>,
    pub(crate) emergency: Infallible<W, C>,
    pub(crate) restore: Infallible<W, C>,
    pub(crate) finalize: Infallible<W, C>,
    pub(crate) hook: fn(&mut W, &mut C, Hook<'_>) -> Result<(), WorkerError>,
}

impl<W, C> WorkerTable<W, C> {
    /// The functions of a worker.
    pub const fn plain() -> Self
    where
        W: Worker<C>,
    {
        Self {
            initialize: W::initialize,
            compute: W::compute,
            params_changed: W::params_changed,
            emergency: W::emergency,
            restore: W::restore,
            finalize: W::finalize,
            hook: |_, _, _| Ok(()),
        }
    }

    /// The functions of a managed worker.
    pub const fn managed() -> Self
    where
        W: ManagedWorker<C>,
    {
        Self {
            initialize: W::initialize,
            compute: W::compute,
            params_changed: W::params_changed,
            emergency: W::emergency,
            restore: W::restore,
            finalize: W::finalize,
            hook: hook::<W, C>,
        }
    }
}

fn hook<W: ManagedWorker<C>, C>(
    worker: &mut W,
    ctx: &mut C,
    hook: Hook<'_>,
) -> Result<(), WorkerError> {
    match hook {
        Hook::Transition(Transition::Configure) => worker.configure(ctx),
        Hook::Transition(Transition::Activate) => worker.activate(ctx),
        Hook::Transition(Transition::Deactivate) => worker.deactivate(ctx),
        Hook::Transition(Transition::Cleanup) => worker.cleanup(ctx),
        Hook::Transition(Transition::Shutdown) => worker.shutdown(ctx),
        Hook::Error(transition, reason) => worker.error(ctx, transition, reason),
    }
}

/// The function that serves a slot.
pub(crate) enum Handler<W, C> {
    None,
    Serve(fn(&mut W, &mut C, &mut Request<'_>) -> Result<(), HandlerError>),
    ServeMember(fn(&mut W, &mut C, &Member, &mut Request<'_>) -> Result<(), HandlerError>),
    Receive(fn(&mut W, &mut C, usize, &mut Reader<'_>) -> Result<(), HandlerError>),
    ReceiveMember(fn(&mut W, &mut C, &Member, usize, &mut Reader<'_>) -> Result<(), HandlerError>),
}

/// How a slot is served.
pub struct SlotEntry<W, C> {
    pub(crate) handler: Handler<W, C>,
    /// The states in which its requests are served; in all if there is none.
    pub(crate) states: &'static [u16],
}

impl<W, C> SlotEntry<W, C> {
    const fn new(handler: Handler<W, C>) -> Self {
        Self {
            handler,
            states: &[],
        }
    }

    /// A slot that receives nothing.
    pub const fn sends() -> Self {
        Self::new(Handler::None)
    }

    /// A slot whose requests `serve` answers.
    pub const fn serves(
        serve: fn(&mut W, &mut C, &mut Request<'_>) -> Result<(), HandlerError>,
    ) -> Self {
        Self::new(Handler::Serve(serve))
    }

    /// An array whose requests `serve` answers, by the member.
    pub const fn serves_members(
        serve: fn(&mut W, &mut C, &Member, &mut Request<'_>) -> Result<(), HandlerError>,
    ) -> Self {
        Self::new(Handler::ServeMember(serve))
    }

    /// A slot whose samples `receive` handles, by the number of the topic.
    pub const fn receives(
        receive: fn(&mut W, &mut C, usize, &mut Reader<'_>) -> Result<(), HandlerError>,
    ) -> Self {
        Self::new(Handler::Receive(receive))
    }

    /// An array whose samples `receive` handles, by the member and the number of the topic.
    pub const fn receives_members(
        receive: fn(&mut W, &mut C, &Member, usize, &mut Reader<'_>) -> Result<(), HandlerError>,
    ) -> Self {
        Self::new(Handler::ReceiveMember(receive))
    }

    /// The slot serves requests in these states of the machine only.
    #[must_use]
    pub const fn in_states(mut self, states: &'static [u16]) -> Self {
        self.states = states;
        self
    }
}

/// The functions of a state machine, by the numbers of the chart.
pub struct MachineTable<W: 'static, C: 'static> {
    /// The guards.
    pub guards: &'static [fn(&mut W, &mut C) -> bool],
    /// The actions.
    pub actions: &'static [Fallible<W, C>],
    /// The functions of the states.
    pub states: &'static [StateFunctions<W, C>],
    /// The events that the runtime fires itself.
    pub events: MachineEvents,
}

impl<W: 'static, C: 'static> MachineTable<W, C> {
    /// The dispatch of a component without a machine.
    pub const NONE: Self = Self {
        guards: &[],
        actions: &[],
        states: &[],
        events: MachineEvents::NONE,
    };
}

/// The functions of one state.
pub struct StateFunctions<W, C> {
    /// The number of the state.
    pub state: u16,
    /// Runs when the state is entered.
    pub entry: Fallible<W, C>,
    /// Runs when the state is left.
    pub exit: Fallible<W, C>,
    /// Runs once a period while the state is active.
    pub during: Fallible<W, C>,
}
