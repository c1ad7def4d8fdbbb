//! A network as its file describes it.

use rc_diagnostics::Span;
use rc_syntax::Name;
use std::time::Duration;

/// One deployment.
#[derive(Clone, Debug)]
pub struct Deployment {
    /// Its name, which is the network's.
    pub name: Name,
    /// The middleware of all components, where the file chooses one.
    pub middleware: Option<Name>,
    /// Its components, in the order of the file.
    pub components: Vec<Instance>,
    /// Connections that the file makes itself.
    pub binds: Vec<Bind>,
}

/// One component of a network.
#[derive(Clone, Debug)]
pub struct Instance {
    /// Its name in the network.
    pub name: Name,
    /// Its `.cdsl`, relative to the `.ddsl`.
    pub cdsl: Option<Name>,
    /// Its program, where it is not the one that cargo builds.
    pub executable: Option<Name>,
    /// Its configuration, where it is not the component's `etc/config.toml`.
    pub config: Option<Name>,
    /// Instances that must be ready first.
    pub after: Vec<Name>,
    /// How long it may take to become ready.
    pub ready: Duration,
    /// How long it may take to stop.
    pub stop: Duration,
    /// Environment variables.
    pub env: Vec<(Name, Name)>,
    /// Further arguments.
    pub args: Vec<Name>,
}

/// How long a component may take to become ready where the file does not say.
pub const READY: Duration = Duration::from_secs(10);
/// How long a component may take to stop where the file does not say.
pub const STOP: Duration = Duration::from_secs(3);

/// `bind avoider.Laser -> simulator.Laser;`
#[derive(Clone, Debug)]
pub struct Bind {
    /// The slot that requires or subscribes.
    pub consumer: SlotPath,
    /// The slot that implements or publishes.
    pub provider: SlotPath,
}

/// A slot of an instance.
#[derive(Clone, Debug)]
pub struct SlotPath {
    /// The instance.
    pub instance: Name,
    /// The slot.
    pub slot: Name,
}

impl SlotPath {
    /// The whole place.
    pub fn span(&self) -> Span {
        self.instance.span.to(self.slot.span)
    }
}
