//! The model of DDSL: a network with all names resolved and all values typed. The components of all
//! groups and files are in one list of instances.

pub use crate::ast::{Convert, Parameter, ParameterValue};
pub use crate::processor::Processor;
use rc_cdsl::model::Middleware;
use rc_diagnostics::{SourceId, Span};
use rc_syntax::Name;
use rc_vocabulary::Value;
pub use rc_vocabulary::{Restart, RestartPolicy};
use std::net::{IpAddr, SocketAddr};
use std::ops::Range;
use std::path::PathBuf;
use std::time::Duration;

/// A deployment, including its imports.
#[derive(Clone, Debug)]
pub struct Deployment {
    /// The name of the network.
    pub name: Name,
    /// The lines of its documentation.
    pub doc: Vec<String>,
    /// The `}` of its block.
    pub end: Span,
    /// All hosts.
    pub hosts: Vec<Host>,
    /// All components, in the order of the files. Components of a group are adjacent.
    pub instances: Vec<Instance>,
    /// All processes that a file names. A component outside of them has one of its own.
    pub processes: Vec<Process>,
    /// All groups. Each group is before the groups inside it.
    pub groups: Vec<Group>,
    /// Explicit connections.
    pub binds: Vec<Bind>,
    /// The component that publishes the time of the network: an index into
    /// [`Deployment::instances`], and the location of its name. `None` for the clock of the system.
    pub time: Option<(usize, Span)>,
    /// The time over which the last messages of the network are kept in memory. `None` if nothing
    /// is kept.
    pub ring: Option<Duration>,
    /// The slots whose peers are not part of the network.
    pub externals: Vec<External>,
    /// Where the files name components and groups.
    pub references: Vec<(Span, InstanceOrGroup)>,
    /// Where the files name imported files.
    pub imports: Vec<(Span, SourceId)>,
    /// The chains: paths of messages with time limits.
    pub chains: Vec<Chain>,
    /// The graph that its components share.
    pub world: Option<World>,
    /// The rules between parameters of components.
    pub rules: Vec<Require>,
}

/// `require filter.gain < base.gain "unstable";`
#[derive(Clone, Debug)]
pub struct Require {
    /// The groups around it, the outermost first.
    pub scope: Vec<String>,
    /// The condition, whose paths begin with a group or a component in one of them, and the message.
    pub rule: rc_pdsl::ast::Rule,
}

/// A machine.
#[derive(Clone, Debug)]
pub struct Host {
    /// The name as declared.
    pub name: Name,
    /// The lines of its documentation.
    pub doc: Vec<String>,
    /// Host name or IP address.
    pub address: Name,
    /// The user that runs components there. `None` for ssh's default.
    pub user: Option<Name>,
    /// The folder for programs and files there. `None` for the default.
    pub workspace: Option<Name>,
    /// The capacity of its link to other hosts: as written, and in bits a second in each direction.
    pub link: Option<(Name, f64)>,
    /// The processor, as the file says. `None`: as the host says of itself.
    pub arch: Option<(Processor, Span)>,
    /// Where its programs are built.
    pub build: HostBuild,
}

/// Where the programs of a host are built, and with what part of its processors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct HostBuild {
    /// `build here;` or `build there;`. `None`: here if this machine can, otherwise there.
    pub place: Option<BuildPlace>,
    /// The number of jobs of cargo. `None`: as many as the host has processors.
    pub jobs: Option<u16>,
    /// The niceness of cargo, 0 to 19.
    pub nice: u8,
}

/// The machine that builds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BuildPlace {
    /// This machine.
    Here,
    /// The host itself.
    There,
}

/// One component of a network.
#[derive(Clone, Debug)]
pub struct Instance {
    /// Name without groups.
    pub name: Name,
    /// Full name in the network: `arm.left.motor`.
    pub path: String,
    /// The lines of its documentation.
    pub doc: Vec<String>,
    /// The innermost group around it: an index into [`Deployment::groups`].
    pub group: Option<usize>,
    /// For a proxy, its group: an index into [`Deployment::groups`]. A proxy has no `.cdsl`;
    /// [`crate::proxied`] computes what it forwards.
    pub proxy: Option<usize>,
    /// The process whose thread it is: the full name of one of [`Deployment::processes`], where
    /// this component names it. `None` for one of its own.
    pub process: Option<Name>,
    /// The folder of the file that declares it, the base of its relative paths.
    pub folder: PathBuf,
    /// The path of its `.cdsl` file, as written.
    pub cdsl: Option<Name>,
    /// The path of its executable. `None` for the one that cargo builds.
    pub executable: Option<Name>,
    /// The path of its configuration. `None` for the component's `etc/config.toml`.
    pub config: Option<Name>,
    /// Host: an index into [`Deployment::hosts`], and the location of the field. `None` for
    /// this machine.
    pub host: Option<(usize, Span)>,
    /// The TCP address of its management, and the location of the field.
    pub endpoint: Option<(SocketAddr, Span)>,
    /// The middleware of its slots, unless a slot sets its own. With `auto`, that of its slots
    /// without connections.
    pub middleware: Middleware,
    /// For `middleware auto;`, which holds without a clause, the middleware between hosts: each
    /// connection has the fastest middleware that reaches, see [`crate::Network::middlewares`].
    pub auto: Option<Middleware>,
    /// The settings of middlewares. Each key of a middleware occurs once.
    pub settings: Vec<Setting>,
    /// The components and groups that must be ready first, and the location of each name.
    pub after: Vec<(InstanceOrGroup, Span)>,
    /// The restart policy.
    pub restart: Restart,
    /// The timeout for becoming ready.
    pub ready: Duration,
    /// The timeout for stopping.
    pub stop: Duration,
    /// Environment variables: name and value.
    pub env: Vec<(Name, Name)>,
    /// Additional command line arguments.
    pub args: Vec<Name>,
    /// The processors it may run on. Empty for any.
    pub cpu: Vec<u16>,
    /// The location of the field `cpu`.
    pub cpu_span: Option<Span>,
    /// Real-time priority, 1 to 99, and the location of the field.
    pub priority: Option<(u8, Span)>,
    /// The location of `time system;`: it has the clock of the system, whatever the network has.
    pub system_time: Option<Span>,
    /// The location of `exact` in its `record`: everything that decides its life is recorded.
    pub exact: Option<Span>,
    /// Values of parameters that take precedence over its configuration.
    pub parameters: Vec<Parameter>,
    /// The members of slot arrays, as listed. After [`crate::expand`], all arrays of its component.
    pub arrays: Vec<Array>,
    /// The place of `slots { all; }`: the members are those that its component opens.
    pub all_members: Option<Span>,
    /// For an adaptor, which [`crate::add_adaptors`] adds: the place of `via process`. `None` for a
    /// component of the file.
    pub adaptor: Option<Span>,
}

/// The members of a slot array.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Array {
    /// The array.
    pub name: Name,
    /// Members, in the order of the file.
    pub members: Vec<Name>,
}

/// The setting that names the node of one component.
pub const NODE: &str = "node";

/// A setting of a middleware.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Setting {
    /// The middleware.
    pub middleware: Middleware,
    /// The key, one of `rc_vocabulary`.
    pub key: &'static str,
    /// The value.
    pub value: Value,
    /// Where.
    pub span: Span,
}

impl Instance {
    /// Looks up a setting of a middleware.
    pub fn setting(&self, middleware: Middleware, key: &str) -> Option<&Setting> {
        let mut settings = self.settings.iter();
        settings.find(|s| s.middleware == middleware && s.key == key)
    }
}

/// The default of [`Instance::ready`].
pub const READY: Duration = Duration::from_secs(10);
/// The default of [`Instance::stop`].
pub const STOP: Duration = Duration::from_secs(3);
/// The least of [`Restart::hung`]: a component counts as hung when its loop has not turned for so
/// long.
pub const HUNG: Duration = Duration::from_secs(2);
/// The maximum length in bytes of a network's name and of a component's full name: they become
/// names of files and sockets.
pub const LONGEST_NAME: usize = 64;

/// A group of components. Only exported slots are visible outside the group.
#[derive(Clone, Debug)]
pub struct Group {
    /// Name without enclosing groups.
    pub name: Name,
    /// Full name in the network.
    pub path: String,
    /// The lines of its documentation.
    pub doc: Vec<String>,
    /// The enclosing group: an index into [`Deployment::groups`].
    pub parent: Option<usize>,
    /// Components, including those of inner groups: indices into [`Deployment::instances`].
    pub instances: Range<usize>,
    /// The exported slots. Each name matches one slot inside.
    pub exports: Vec<Name>,
    /// The proxy, which represents the group outside.
    pub proxy: Option<Proxy>,
    /// The `}` of its block.
    pub end: Span,
}

/// The component that is a group for everybody outside: `proxy;` or `proxy ros2;`
#[derive(Clone, Debug)]
pub struct Proxy {
    /// An index into [`Deployment::instances`]. It comes before the components of the group.
    pub instance: usize,
    /// The location of the clause.
    pub span: Span,
}

/// A process that runs components as its threads.
#[derive(Clone, Debug)]
pub struct Process {
    /// Name without enclosing groups, at its first place.
    pub name: Name,
    /// Full name in the network.
    pub path: String,
    /// The lines of its documentation.
    pub doc: Vec<String>,
    /// The group in which it is named.
    pub group: Option<usize>,
    /// Its components: indices into [`Deployment::instances`]. They all have its host and its
    /// restart policy; those without `cpu` or `priority` of their own have those of the process.
    pub instances: Vec<usize>,
}

/// A component or a group.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum InstanceOrGroup {
    /// An index into [`Deployment::instances`].
    Instance(usize),
    /// An index into [`Deployment::groups`].
    Group(usize),
}

/// The graph that the components of a network share. Paths are relative to `folder`.
#[derive(Clone, Debug)]
pub struct World {
    /// The name as declared.
    pub name: Name,
    /// The lines of its documentation.
    pub doc: Vec<String>,
    /// The folder of the file that declares it.
    pub folder: PathBuf,
    /// The path of its `.gdsl`, as written. `None` after an error.
    pub schema: Option<Name>,
    /// The file with its initial content.
    pub start: Option<Name>,
    /// The file that keeps it, and how often it is written.
    pub keep: Option<(Name, Duration)>,
}

/// A path of messages from one message to another one, with time limits.
#[derive(Clone, Debug)]
pub struct Chain {
    /// Name without enclosing groups.
    pub name: Name,
    /// Full name in the network.
    pub path: String,
    /// The lines of its documentation.
    pub doc: Vec<String>,
    /// The message that begins it.
    pub from: ChainPoint,
    /// Points that it passes, in this order. There may be others between them.
    pub through: Vec<ChainPoint>,
    /// The message that ends it.
    pub to: ChainPoint,
    /// What programs outside of the network do.
    pub outside: Vec<Outside>,
    /// The most time from sending the first message to the effect of the last one.
    pub within: Option<Duration>,
    /// The most time from sending the first message to any effect that is made of it.
    pub age: Option<Duration>,
    /// The most time that a message needs from one component to the next one.
    pub transport: Option<Duration>,
    /// The action if it is late.
    pub late: Late,
}

/// Programs outside of the network that send one message for another one, with the same stamp.
#[derive(Clone, Debug)]
pub struct Outside {
    /// The message that they receive.
    pub from: ChainPoint,
    /// The message that they send.
    pub to: ChainPoint,
    /// The most time from sending the one to receiving the other.
    pub within: Duration,
}

/// The action if a chain is late. Instances are indices into [`Deployment::instances`].
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Late {
    /// A warning.
    #[default]
    Warn,
    /// An event that is not a warning.
    Event,
    /// The component is stopped.
    Stop(usize),
    /// The component enters its emergency.
    Emergency(usize),
    /// The state machine of the component gets the event.
    Fire(usize, Name),
}

/// A component of a chain, or an operation of one of its slots.
#[derive(Clone, Debug)]
pub struct ChainPoint {
    /// The component: an index into [`Deployment::instances`].
    pub instance: usize,
    /// The slot, `ARRAY.MEMBER` for a member of an array, and the operation. `None`: any.
    pub operation: Option<(Name, Name)>,
    /// The location of the whole path.
    pub span: Span,
}

/// `bind avoider.Laser -> sensors.Laser;`
#[derive(Clone, Debug)]
pub struct Bind {
    /// The slot that requires or subscribes.
    pub consumer: SlotPath,
    /// The slot that implements or publishes. `None` after an error.
    pub provider: Option<SlotPath>,
    /// The place of `convert;`: the consumer converts units that differ.
    pub convert: Option<Span>,
    /// The slots of the consumer that know where frames are: `convert { frames SLOT; }`.
    pub frames: Vec<Name>,
    /// The place of `via process`: an adaptor converts. [`crate::add_adaptors`] adds it.
    pub process: Option<Span>,
}

/// A slot in `external avoider.Laser at "robot/Laser";`
#[derive(Clone, Debug)]
pub struct External {
    /// The slot. It requires or subscribes, unless [`External::peer`] describes the peer, or it is
    /// that of an adaptor.
    pub slot: SlotPath,
    /// The address of its peer, as written. `None` for the default address.
    pub address: Option<Name>,
    /// The file about the peer.
    pub peer: Option<Peer>,
}

/// A program that is not part of the network: `{ cdsl "lidar.cdsl"; convert; }`
#[derive(Clone, Debug)]
pub struct Peer {
    /// The folder of the file that names it, the base of its relative paths.
    pub folder: PathBuf,
    /// The path of the `.cdsl` file that describes it, as written.
    pub cdsl: Name,
    /// The conversion of the connection.
    pub convert: Convert,
}

/// A slot of an instance, or one that a group exports.
#[derive(Clone, Debug)]
pub struct SlotPath {
    /// The instance or the group that has the slot.
    pub place: InstanceOrGroup,
    /// The name of the slot; `ARRAY.MEMBER` for a member of a slot array.
    pub slot: Name,
    /// The location of the whole path.
    pub span: Span,
}

impl Deployment {
    /// The host of an instance, if it is not this machine.
    pub fn remote_host(&self, instance: &Instance) -> Option<&Host> {
        let (host, _) = instance.host?;
        self.hosts.get(host).filter(|host| !host.is_local())
    }

    /// Whether two instances are on different machines.
    pub fn are_apart(&self, one: &Instance, other: &Instance) -> bool {
        match (self.remote_host(one), self.remote_host(other)) {
            (Some(one), Some(other)) => !one.is_same(other),
            (one, other) => one.is_some() || other.is_some(),
        }
    }

    /// The fastest middleware that connects two instances: in their process, on their host, or the
    /// one that `one` has between hosts.
    pub fn fastest(&self, one: &Instance, other: &Instance) -> Middleware {
        let process = |instance: &Instance| instance.process.as_ref().map(|name| name.text.clone());
        let shared = process(one).filter(|own| process(other).as_ref() == Some(own));
        if shared.is_some() {
            Middleware::IN_PROCESS
        } else if self.are_apart(one, other) {
            one.auto.unwrap_or(Middleware::BETWEEN_HOSTS)
        } else {
            Middleware::DEFAULT
        }
    }

    /// The indices into [`Deployment::instances`] of an instance, or of all instances of a group
    /// with its proxy.
    pub fn instances_of(&self, place: InstanceOrGroup) -> Range<usize> {
        match place {
            InstanceOrGroup::Instance(at) => at..at + 1,
            InstanceOrGroup::Group(group) => {
                let group = &self.groups[group];
                let proxy = group.proxy.as_ref().map(|proxy| proxy.instance);
                proxy.unwrap_or(group.instances.start)..group.instances.end
            }
        }
    }

    /// The indices into [`Deployment::instances`] of what has to be ready for those that start after an
    /// instance or a group: also the adaptors of a group.
    pub fn awaited(&self, place: InstanceOrGroup) -> Vec<usize> {
        let mut all: Vec<usize> = self.instances_of(place).collect();
        if let InstanceOrGroup::Group(group) = place {
            let instances = self.instances.iter().enumerate();
            let adaptors = instances.filter(|(_, instance)| {
                instance.adaptor.is_some() && self.is_inside(instance.group, Some(group))
            });
            all.extend(adaptors.map(|(at, _)| at));
        }
        all
    }

    /// A group and its enclosing groups, from inside to outside.
    pub fn enclosing(&self, group: Option<usize>) -> impl Iterator<Item = usize> + '_ {
        std::iter::successors(group, |at| self.groups[*at].parent)
    }

    /// Whether `inner` is `outer` or inside it. `None` is the deployment itself.
    pub fn is_inside(&self, inner: Option<usize>, outer: Option<usize>) -> bool {
        outer.is_none() || self.enclosing(inner).any(|group| Some(group) == outer)
    }
}

impl Group {
    /// A help text with the `export` clause that adds `slot`.
    pub(crate) fn export_with(&self, slot: &str) -> String {
        let names = self.exports.iter().map(|name| name.text.as_str());
        let names: Vec<&str> = names.chain([slot]).collect();
        format!(
            "write `export {};` in group `{}`",
            names.join(", "),
            self.path
        )
    }
}

impl Host {
    /// Whether it is this machine, by loopback name or address.
    pub fn is_local(&self) -> bool {
        let address = self.address.text.as_str();
        address.eq_ignore_ascii_case("localhost")
            || address.parse().is_ok_and(|ip: IpAddr| ip.is_loopback())
    }

    /// Whether both have the same address and the same user.
    pub fn is_same(&self, other: &Self) -> bool {
        let machine = |host: &Self| host.address.text.to_lowercase();
        let user = |host: &Self| host.user.as_ref().map(|user| user.text.clone());
        machine(self) == machine(other) && user(self) == user(other)
    }
}
