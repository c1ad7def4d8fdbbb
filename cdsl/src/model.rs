//! A component with every name resolved.

use rc_diagnostics::Span;
use rc_idsl::Library;
use rc_idsl::model::{InterfaceId, Pattern};
use rc_syntax::Name;
use std::time::Duration;

/// One component.
#[derive(Clone, Debug)]
pub struct Component {
    /// Its name.
    pub name: Name,
    /// Its documentation.
    pub doc: Vec<String>,
    /// The language of its user's code, as written.
    pub language: Name,
    /// What it communicates, in the order of the file.
    pub slots: Vec<Slot>,
    /// Its `.pdsl` file, as written.
    pub parameters: Option<Name>,
    /// Its states.
    pub state_machine: Option<StateMachine>,
    /// Crates and libraries of its user's code, with their versions.
    pub dependencies: Vec<(Name, Name)>,
    /// How often `compute()` runs where the configuration does not say.
    pub period: Duration,
    /// Interfaces and types that its imports reach.
    pub library: Library,
}

/// `statemachine "file.smdsl" visual;`
#[derive(Clone, Debug, PartialEq)]
pub struct StateMachine {
    /// Its `.smdsl` or `.scxml` file, as written.
    pub file: Name,
    /// Whether `visual` stands behind it.
    pub visual: bool,
}

/// The period of a component that does not say.
pub const DEFAULT_PERIOD: Duration = Duration::from_millis(100);

/// One end of a connection.
#[derive(Clone, Debug)]
pub struct Slot {
    /// Its name, unique in the component.
    pub name: String,
    /// Which end.
    pub role: Role,
    /// What is said.
    pub interface: InterfaceId,
    /// The middleware of this connection, where the file chooses it.
    pub backend: Option<Backend>,
    /// Deviations from the default quality of service.
    pub qos: Qos,
    /// Where the file names it.
    pub span: Span,
}

/// The four ends of connections.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Role {
    /// Answers calls.
    Implements,
    /// Calls.
    Requires,
    /// Sends to a topic.
    Publishes,
    /// Receives from a topic.
    SubscribesTo,
}

impl Role {
    /// Every word that begins a communication clause; `request` is the paper's word.
    pub const WORDS: [(&'static str, Role); 5] = [
        ("implements", Role::Implements),
        ("requires", Role::Requires),
        ("request", Role::Requires),
        ("publishes", Role::Publishes),
        ("subscribesTo", Role::SubscribesTo),
    ];

    /// The word of the language.
    pub fn word(self) -> &'static str {
        match self {
            Self::Implements => "implements",
            Self::Requires => "requires",
            Self::Publishes => "publishes",
            Self::SubscribesTo => "subscribesTo",
        }
    }

    /// Whether it is an end of a topic.
    pub fn is_topic(self) -> bool {
        matches!(self, Self::Publishes | Self::SubscribesTo)
    }

    /// Whether an operation of this pattern can be used so.
    pub fn allows(self, pattern: Pattern) -> bool {
        self.is_topic() == (pattern == Pattern::Publish)
    }
}

/// A middleware that a connection can be bound to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Backend {
    /// Shared memory on one machine.
    Iceoryx2,
    /// A network, Cyclone DDS.
    Dds,
    /// A network, ROS 2 nodes on the other side.
    Ros2,
    /// Inside one process, for tests; only on the command line, never in a file.
    Local,
}

impl Backend {
    /// The words that a file may use. `ros` is read as `ros2`.
    pub const WORDS: [(&'static str, Backend); 4] = [
        ("iceoryx2", Self::Iceoryx2),
        ("dds", Self::Dds),
        ("ros2", Self::Ros2),
        ("ros", Self::Ros2),
    ];

    /// The word of files and command lines.
    pub fn word(self) -> &'static str {
        match self {
            Self::Iceoryx2 => "iceoryx2",
            Self::Dds => "dds",
            Self::Ros2 => "ros2",
            Self::Local => "local",
        }
    }
}

/// Deviations from the defaults; none where the file is silent.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Qos {
    /// `reliability reliable;` (true) or `best_effort` (false)
    pub reliable: Option<bool>,
    /// `durability transient_local;` (true) or `volatile` (false)
    pub transient_local: Option<bool>,
    /// `depth 5;`
    pub depth: Option<u32>,
    /// `timeout 500ms;` of a call
    pub timeout: Option<Duration>,
    /// `in_place true;`: what comes, or the answer, is in memory that is shared with the other end
    pub in_place: bool,
    /// `deadline 100ms;`
    pub deadline: Option<Duration>,
    /// `lifespan 1s;`
    pub lifespan: Option<Duration>,
    /// `liveliness 1s;`
    pub liveliness: Option<Duration>,
    /// `wake spin 50us;`: how long one who waits stays awake before it sleeps
    pub spin: Option<Duration>,
}

/// The shortest and the longest time of `wake spin`.
pub const SPIN: std::ops::RangeInclusive<Duration> =
    Duration::from_micros(1)..=Duration::from_millis(10);
