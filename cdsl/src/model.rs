//! The model of CDSL: a component with all names resolved.

use rc_diagnostics::Span;
use rc_idsl::Library;
use rc_idsl::model::{InterfaceId, Pattern};
use rc_syntax::Name;
use std::time::Duration;

/// One component.
#[derive(Clone, Debug)]
pub struct Component {
    /// The name as declared.
    pub name: Name,
    /// The lines of its documentation.
    pub doc: Vec<String>,
    /// The programming language of the worker, in lower case.
    pub language: Name,
    /// The slots, in the order of the file.
    pub slots: Vec<Slot>,
    /// The path of its `.pdsl` file, as written.
    pub parameters: Option<Name>,
    /// The `statemachine` clause.
    pub state_machine: Option<StateMachine>,
    /// The dependencies of the worker.
    pub dependencies: Vec<Dependency>,
    /// The `python` clause of a component in Python.
    pub python: Option<Python>,
    /// The default period of `compute()`. The configuration can change it.
    pub period: Duration,
    /// Whether the worker can advance the time of its network.
    pub simulates_time: bool,
    /// Whether it has the life cycle of a managed node of ROS 2.
    pub managed: bool,
    /// The option `InnerModelViewer`: the component shows its tree in a window.
    pub viewer: Option<Span>,
    /// All imported modules, directly or indirectly.
    pub library: Library,
}

/// A crate that the worker uses.
#[derive(Clone, Debug)]
pub struct Dependency {
    /// The name of the package.
    pub package: Name,
    /// The version requirement, if one is given.
    pub version: Option<Name>,
    /// The path from the folder of the `.cdsl`, if one is given.
    pub path: Option<Name>,
    /// Cargo features that the component turns on.
    pub features: Vec<Name>,
    /// Whether its default features are on.
    pub default_features: bool,
}

/// The oldest version of Python that components run on: major and minor.
pub const OLDEST_PYTHON: (u32, u32) = (3, 11);

/// `python "3.12" venv;`
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Python {
    /// The oldest version that the component runs on: major and minor.
    pub oldest: (u32, u32),
    /// Whether `rcdeploy up --build` makes `.venv`, a virtual environment in the component's folder.
    pub venv: bool,
}

/// `statemachine "file.smdsl" visual { external go; }`
#[derive(Clone, Debug, PartialEq)]
pub struct StateMachine {
    /// The path of the `.smdsl` or `.scxml` file, as written.
    pub file: Name,
    /// Whether `visual` is after the path.
    pub visual: bool,
    /// The events that may be fired from outside of the component.
    pub external: Vec<Name>,
}

/// The period of a component without a `period` clause.
pub const DEFAULT_PERIOD: Duration = Duration::from_millis(100);

/// An interface that a component implements, requires, publishes or subscribes to.
#[derive(Clone, Debug)]
pub struct Slot {
    /// The name, unique in the component. In a network, a member of an array is a slot
    /// `ARRAY.MEMBER`.
    pub name: String,
    /// The role of the component in the connection.
    pub role: Role,
    /// The interface, in [`Component::library`].
    pub interface: InterfaceId,
    /// Whether it is an array, whose members are named at start.
    pub is_array: bool,
    /// The middleware, if the file sets one for this slot.
    pub backend: Option<Backend>,
    /// Whether the component works without a peer: its start and its readiness wait for none.
    pub optional: bool,
    /// Deviations from the default quality of service.
    pub qos: Qos,
    /// The states in which requests are served; in all states if there is none.
    pub available: Vec<Name>,
    /// The location of its declaration.
    pub span: Span,
}

impl Slot {
    /// The name as a path, as it stands in addresses and in rules of ROS 2: `Laser`, or
    /// `lasers/front` for the member `lasers.front` of an array.
    pub fn path(&self) -> String {
        self.name.replace('.', "/")
    }
}

/// The role of a component in a connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Role {
    /// Server of calls.
    Implements,
    /// Client of calls.
    Requires,
    /// Publisher of topics.
    Publishes,
    /// Subscriber of topics.
    SubscribesTo,
}

impl Role {
    /// The keywords of communication clauses. The paper on RoboComp's CDSL uses `request`.
    pub const WORDS: [(&'static str, Role); 5] = [
        ("implements", Role::Implements),
        ("requires", Role::Requires),
        ("request", Role::Requires),
        ("publishes", Role::Publishes),
        ("subscribesTo", Role::SubscribesTo),
    ];

    /// The keyword.
    pub fn word(self) -> &'static str {
        match self {
            Self::Implements => "implements",
            Self::Requires => "requires",
            Self::Publishes => "publishes",
            Self::SubscribesTo => "subscribesTo",
        }
    }

    /// Whether the slot belongs to topics, not to calls.
    pub fn is_topic(self) -> bool {
        matches!(self, Self::Publishes | Self::SubscribesTo)
    }

    /// Whether an operation with this pattern is valid in this role.
    pub fn allows(self, pattern: Pattern) -> bool {
        self.is_topic() == (pattern == Pattern::Publish)
    }
}

/// A middleware.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Backend {
    /// iceoryx2: shared memory on one machine.
    Iceoryx2,
    /// Cyclone DDS: a network of machines.
    Dds,
    /// ROS 2: a network of machines, with ROS 2 nodes as peers.
    Ros2,
    /// Inside one process, for tests. Only the command line can select it, not a file.
    Local,
}

impl Backend {
    /// The names valid in files. `ros` is an alias of `ros2`.
    pub const WORDS: [(&'static str, Backend); 4] = [
        ("iceoryx2", Self::Iceoryx2),
        ("dds", Self::Dds),
        ("ros2", Self::Ros2),
        ("ros", Self::Ros2),
    ];

    /// The name in files and on command lines.
    pub fn word(self) -> &'static str {
        match self {
            Self::Iceoryx2 => "iceoryx2",
            Self::Dds => "dds",
            Self::Ros2 => "ros2",
            Self::Local => "local",
        }
    }
}

/// Deviations from the default quality of service. `None` means the default.
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
    /// `in_place true;`: handlers receive samples, or write replies, in shared memory.
    pub in_place: bool,
    /// `deadline 100ms;`
    pub deadline: Option<Duration>,
    /// `lifespan 1s;`
    pub lifespan: Option<Duration>,
    /// `liveliness 1s;`
    pub liveliness: Option<Duration>,
    /// `wake spin 50us;`: how long a waiting thread polls before it sleeps.
    pub spin: Option<Duration>,
}

/// The limits of `wake spin`.
pub const SPIN: std::ops::RangeInclusive<Duration> =
    Duration::from_micros(1)..=Duration::from_millis(10);
