//! The syntax tree of a `.ddsl` file. Names are not resolved.

use rc_diagnostics::Span;
use rc_syntax::{Literal, Name};

/// A file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct File {
    /// The imported paths as written.
    pub imports: Vec<Name>,
    /// The deployment. `None` after a syntax error.
    pub deployment: Option<Deployment>,
}

/// `Deployment NAME { … };`
#[derive(Clone, Debug, PartialEq)]
pub struct Deployment {
    /// The name as declared.
    pub name: Name,
    /// The lines of its documentation.
    pub doc: Vec<String>,
    /// Declarations in the network, in the order of the file.
    pub decls: Vec<Decl>,
    /// Its `}`.
    pub end: Span,
}

/// A declaration in a deployment or a group.
#[derive(Clone, Debug, PartialEq)]
pub enum Decl {
    /// `Host NAME { … };`
    Host(Host),
    /// `Component NAME { … };`
    Component(Component),
    /// `Process NAME { … };`
    Process(Process),
    /// `Group NAME { … };`
    Group(Group),
    /// `bind a.Laser -> b.Laser;` or `bind a.Laser -> b.Laser { convert; };`
    Bind(Bind),
    /// `external avoider.Laser at "robot/Laser";`
    External(External),
    /// `middleware dds { lease 500ms; };`
    Middleware(Middleware),
    /// `domain 7;`, with its keyword
    Domain(Name, Literal),
    /// `time simulated by sensors.simulator;`: the keyword, groups from outside to inside, then a
    /// component
    Time(Name, Vec<Name>),
    /// `record { ring 60s; };`: the keyword, and each field with its value. `exact`, a field of
    /// components, has none.
    Record(Name, Vec<(Name, Option<Literal>)>),
    /// `Chain NAME { … };`
    Chain(Chain),
    /// `World NAME { … };`
    World(World),
    /// `require filter.gain < base.gain "unstable";`
    Require(Box<rc_pdsl::ast::Rule>),
}

/// A declaration with fields in a block.
#[derive(Clone, Debug, PartialEq)]
pub struct FieldBlock<F> {
    /// The name as declared.
    pub name: Name,
    /// The lines of its documentation.
    pub doc: Vec<String>,
    /// Fields, each with its keyword.
    pub fields: Vec<(Name, F)>,
    /// Whether input was skipped, with an error.
    pub incomplete: bool,
}

/// `World NAME { schema "kitchen.gdsl"; start "home.graph"; keep "home.graph" 30s; };`
pub type World = FieldBlock<WorldField>;

/// A file, and the time of `keep`.
#[derive(Clone, Debug, PartialEq)]
pub struct WorldField {
    /// The path as written.
    pub file: Name,
    /// How often it is written.
    pub time: Option<Literal>,
}

/// `Chain NAME { from lidar.LaserPub.scan; to base.Motor.set; within 80ms; };`
pub type Chain = FieldBlock<ChainField>;

/// One field of a chain.
#[derive(Clone, Debug, PartialEq)]
pub enum ChainField {
    /// `from`, `through` and `to`: paths, each with groups, a component, and maybe a slot and an
    /// operation.
    Points(Vec<Vec<Name>>),
    /// `within`, `age` and `transport`.
    Time(Literal),
    /// `external`: each message that leaves the network, the one that comes back, and the time
    /// between them.
    Outside(Vec<(Vec<Name>, Vec<Name>, Literal)>),
    /// `late warn;`, `late stop base;` or `late fire avoider brake;`
    Late(Late),
}

/// The action if a chain is late.
#[derive(Clone, Debug, PartialEq)]
pub struct Late {
    /// `warn`, `event`, `stop`, `emergency` or `fire`.
    pub action: Name,
    /// Groups and a component.
    pub component: Vec<Name>,
    /// The event to fire.
    pub event: Option<Name>,
}

/// `middleware NAME;`, `middleware NAME { … };` or `middleware auto remote NAME;`
#[derive(Clone, Debug, PartialEq)]
pub struct Middleware {
    /// The middleware, or `auto`.
    pub name: Name,
    /// The middleware after `remote`.
    pub remote: Option<Name>,
    /// The settings, each with its values. `None` without a block.
    pub settings: Option<Vec<(Name, Vec<Literal>)>>,
}

/// `Host NAME { … };`
pub type Host = FieldBlock<HostField>;

/// One field of a host.
#[derive(Clone, Debug, PartialEq)]
pub enum HostField {
    /// `address`, `user` and `workspace`.
    Text(Name),
    /// `arch arm64;`
    Arch(Name),
    /// `build there jobs 2 nice 10;`
    Build(HostBuild),
}

/// Where the programs of a host are built.
#[derive(Clone, Debug, PartialEq)]
pub struct HostBuild {
    /// `here` or `there`.
    pub place: Name,
    /// The number of jobs of cargo.
    pub jobs: Option<Literal>,
    /// The niceness of cargo.
    pub nice: Option<Literal>,
}

/// `Component NAME { … };`
pub type Component = FieldBlock<Field>;

/// One field of a component.
#[derive(Clone, Debug, PartialEq)]
pub enum Field {
    /// `cdsl "../lidar/lidar.cdsl";`
    Cdsl(Name),
    /// `executable "bin/lidar";`
    Executable(Name),
    /// `config "lidar.toml";`
    Config(Name),
    /// `endpoint "10.0.0.2:7000";`
    Endpoint(Name),
    /// `host robot;`
    Host(Name),
    /// `process eyes;`
    Process(Name),
    /// `after simulator, arm;`
    After(Vec<Name>),
    /// `restart on_failure hung 5s max 3 within 1min backoff 500ms;`
    Restart(Box<Restart>),
    /// `ready 5s;`
    Ready(Literal),
    /// `stop 1s;`
    Stop(Literal),
    /// `env { RUST_LOG "debug"; };`
    Env(Vec<(Name, Name)>),
    /// `args "--log", "debug";`
    Args(Vec<Name>),
    /// `cpu 2, 3;`
    Cpu(Vec<Literal>),
    /// `priority 10;`
    Priority(Literal),
    /// `parameters { speed 300; };`
    Parameters(Vec<Parameter>),
    /// `slots { lasers "front", "back"; };`: arrays, each with its members.
    Slots(Slots),
    /// `middleware dds { lease 500ms; };`
    Middleware(Middleware),
    /// `domain 7;`
    Domain(Literal),
    /// `time system;`
    SystemTime,
    /// `record { exact; };`: its words.
    Record(Vec<Name>),
}

/// The content of the field `restart`.
#[derive(Clone, Debug, PartialEq)]
pub struct Restart {
    /// The name of the policy. May be unknown.
    pub policy: Name,
    /// `hung T`
    pub hung: Option<Literal>,
    /// `max N within T`
    pub limit: Option<(Literal, Literal)>,
    /// `backoff T`
    pub backoff: Option<Literal>,
}

/// `Process NAME { … };`
#[derive(Clone, Debug, PartialEq)]
pub struct Process {
    /// The name as declared.
    pub name: Name,
    /// The lines of its documentation.
    pub doc: Vec<String>,
    /// `host`, `restart`, `cpu` and `priority`, each with its keyword.
    pub fields: Vec<(Name, Field)>,
    /// The components in its block.
    pub components: Vec<Component>,
    /// Whether input was skipped, with an error.
    pub incomplete: bool,
}

/// `Group NAME { … };`
#[derive(Clone, Debug, PartialEq)]
pub struct Group {
    /// The name as declared.
    pub name: Name,
    /// The lines of its documentation.
    pub doc: Vec<String>,
    /// Declarations in the group, in the order of the file.
    pub decls: Vec<Decl>,
    /// Its `export` clauses: keyword and slots.
    pub exports: Vec<(Name, Vec<Name>)>,
    /// Its `proxy` clauses: the keyword, and the middleware outside.
    pub proxies: Vec<(Name, Option<Middleware>)>,
    /// Whether input was skipped, with an error.
    pub incomplete: bool,
    /// Its `}`.
    pub end: Span,
}

/// `bind avoider.Laser -> sensors.Laser;`
#[derive(Clone, Debug, PartialEq)]
pub struct Bind {
    /// The slot that requires or subscribes.
    pub consumer: SlotPath,
    /// The slot that implements or publishes.
    pub provider: SlotPath,
    /// The place of `convert;` in its block.
    pub convert: Option<Span>,
    /// The slots that `convert { frames SLOT; }` names.
    pub frames: Vec<Name>,
    /// The place of `via process`.
    pub process: Option<Span>,
}

/// `external avoider.Laser, arm.Motor at "robot/Laser";`
#[derive(Clone, Debug, PartialEq)]
pub struct External {
    /// The slots. Without [`External::peer`], they require or subscribe.
    pub slots: Vec<SlotPath>,
    /// The address of their peer.
    pub address: Option<Name>,
    /// The file about their peer.
    pub peer: Option<Peer>,
}

/// `{ cdsl "lidar.cdsl"; convert; }` of an external slot.
#[derive(Clone, Debug, PartialEq)]
pub struct Peer {
    /// The path of the `.cdsl` that describes the peer.
    pub cdsl: Name,
    /// The conversion of the connection.
    pub convert: Convert,
}

/// `convert via process { frames tree; }`, if present.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Convert {
    /// The place of `convert`.
    pub span: Option<Span>,
    /// The slots that `frames` names.
    pub frames: Vec<Name>,
    /// The place of `via process`.
    pub process: Option<Span>,
}

/// `motors[2].max 4;` or `gains [1, 2];`
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// The path of the parameter.
    pub path: Name,
    /// The value.
    pub value: ParameterValue,
}

/// The value of a parameter.
#[derive(Clone, Debug, PartialEq)]
pub enum ParameterValue {
    /// `300`, `20ms`, `"left"`
    One(Literal),
    /// `[1, 2]`
    Array(Vec<Literal>),
}

/// The path of a slot.
#[derive(Clone, Debug, PartialEq)]
pub struct SlotPath {
    /// Groups from outside to inside, then a component or a group. At least one name.
    pub path: Vec<Name>,
    /// The slot.
    pub slot: Name,
}

/// The members of slot arrays.
#[derive(Clone, Debug, PartialEq)]
pub struct Slots {
    /// Arrays, each with its members.
    pub lists: Vec<(Name, Vec<Name>)>,
    /// The place of `all;`: the members are those of the scene.
    pub all: Option<Span>,
}
