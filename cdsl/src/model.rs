//! The model of CDSL: a component with all names resolved.

use rc_diagnostics::Span;
use rc_idsl::Library;
use rc_idsl::model::InterfaceId;
use rc_syntax::Name;
use rc_vocabulary::qos::{Policies, Qos};
pub use rc_vocabulary::{Language, Middleware, Role};
use std::fmt;
use std::sync::Arc;
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
    /// The `.kdsl` files of robots, as written, each with the name that the worker calls it.
    pub kinematics: Vec<(Name, Name)>,
    /// The graph that it shares with other components of its network.
    pub world: Option<World>,
    /// The `statemachine` clause.
    pub state_machine: Option<StateMachine>,
    /// The dependencies of the worker.
    pub dependencies: Vec<Dependency>,
    /// The `python` clause of a component in Python.
    pub python: Option<Python>,
    /// The default period of `compute()`. The configuration can change it.
    pub period: Duration,
    /// The topics whose samples one handler gets together.
    pub collects: Vec<Collect>,
    /// The effects of causes. `None` without the clause: all outputs follow all inputs, through
    /// `compute()`.
    pub reactions: Option<Vec<Reaction>>,
    /// Whether the worker can advance the time of its network.
    pub simulates_time: bool,
    /// Whether it has the life cycle of a managed node of ROS 2.
    pub managed: bool,
    /// The `gui` clause: the worker is a window.
    pub window: Option<Window>,
    /// The option `InnerModelViewer`: the component shows its tree in a window.
    pub viewer: Option<Span>,
    /// The option `InnerModelSlots`: the members of its slot arrays are the devices of the scene
    /// that its parameter `inner_model` names.
    pub scene_slots: Option<Span>,
    /// All imported modules, directly or indirectly.
    pub library: Library,
    /// The `.dproto` files that it imports, as written.
    pub prototype_imports: Vec<Name>,
    /// The files with the prototypes of its values, once [`meanings`](crate::meanings) has read
    /// them.
    pub prototypes: Arc<rc_prototypes::model::Library>,
}

/// The window of a worker, over Qt.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// The class of Qt that the worker is.
    pub widget: &'static str,
}

/// The graph that a component shares with others. Whether its schema has the types is known once that
/// was read.
#[derive(Clone, Debug, PartialEq)]
pub struct World {
    /// The path of its schema, as written. `None` for `any`: the worker has slots by which replicas meet, and reads the
    /// schema of the network when it starts.
    pub schema: Option<Name>,
    /// The location of the path, or of `any`.
    pub span: Span,
    /// Its name in the worker, and that of the first slot.
    pub name: Name,
    /// What the component writes and reads. `None` is everything, shared with every other
    /// component.
    pub access: Option<Access>,
}

/// The access of a component to its world.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Access {
    /// The types and attributes that it sets.
    pub writes: Vec<Write>,
    /// The types of which it gets each change.
    pub reads: Vec<Name>,
}

/// `door`, `door.pose stream 50ms shared`
#[derive(Clone, Debug, PartialEq)]
pub struct Write {
    /// The type of nodes or edges.
    pub kind: Name,
    /// The attribute. `None` for all of them, and for adding and removing what has the type.
    pub attribute: Option<Name>,
    /// The least time between two values, if they are streamed: only the newest value counts.
    pub stream: Option<Duration>,
    /// Whether other components write it, too.
    pub shared: bool,
}

impl Write {
    /// The location of the whole path.
    pub fn span(&self) -> Span {
        let last = self.attribute.as_ref().unwrap_or(&self.kind);
        self.kind.span.to(last.span)
    }

    /// `TYPE`, or `TYPE.ATTRIBUTE`.
    pub fn path(&self) -> String {
        match &self.attribute {
            Some(attribute) => format!("{}.{}", self.kind.text, attribute.text),
            None => self.kind.text.clone(),
        }
    }
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
    /// Components of a package of cmake.
    pub components: Vec<Name>,
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

/// `collect LaserPub.newScan, pose.newFullPose within 20ms as view;`
#[derive(Clone, Debug, PartialEq)]
pub struct Collect {
    /// What the worker calls it.
    pub name: Name,
    /// The topics, each as the name of its slot and of its operation.
    pub topics: Vec<(String, String)>,
    /// The most time between the first and the last sample. Zero for samples of equal times.
    pub within: Duration,
}

/// A cause with its effects. A cause has one reaction.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Reaction {
    /// Its cause: a period, or a received message.
    pub cause: Step,
    /// The messages that are sent. `compute()` stands for what it sends with its next period.
    pub effects: Vec<Step>,
    /// The longest run of its handler, or of `compute()`, if the file says it.
    pub budget: Option<Duration>,
}

/// `compute()`, or an operation of a slot.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Step {
    /// A period.
    Compute,
    /// An operation.
    Operation {
        /// The slot, as [`Slot::name`]; the array for its members.
        slot: String,
        /// The name of the operation.
        operation: String,
    },
    /// Samples that one handler gets together, by the name of their `collect`.
    Collected(String),
}

impl fmt::Display for Step {
    /// `compute`, `SLOT.OPERATION`, or the name of a `collect`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Compute => f.write_str("compute"),
            Self::Collected(name) => f.write_str(name),
            Self::Operation { slot, operation } => write!(f, "{slot}.{operation}"),
        }
    }
}

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
    pub backend: Option<Middleware>,
    /// Whether the component works without a peer: its start and its readiness wait for none.
    pub optional: bool,
    /// Deviations from the default quality of service.
    pub qos: Policies,
    /// `in_place true;`: handlers receive samples, or write replies, in shared memory.
    pub in_place: bool,
    /// `asynchronous true;`: queries can also be started, and end later.
    pub asynchronous: bool,
    /// The states in which requests are served; in all states if there is none.
    pub available: Vec<Name>,
    /// Whether it is one by which the replicas of a world meet: no slot of the worker.
    pub of_world: bool,
    /// The location of its declaration.
    pub span: Span,
    /// The location of its interface's name.
    pub interface_span: Span,
    /// The location of its name after `as`. `None` if it has that of its interface.
    pub name_span: Option<Span>,
}

impl Slot {
    /// The name as a path, as in addresses and in rules of ROS 2: `Laser`, or `lasers/front` for
    /// the member `lasers.front` of an array.
    pub fn path(&self) -> String {
        self.name.replace('.', "/")
    }

    /// The whole quality of service.
    pub fn whole_qos(&self) -> Qos {
        self.qos.over(Qos::of(self.role))
    }
}
