//! A network with every name resolved and every value typed: one flat list of instances, whatever groups and
//! files they stand in.

use rc_cdsl::model::Backend;
use rc_diagnostics::Span;
use rc_syntax::Name;
use std::net::{IpAddr, SocketAddr};
use std::ops::Range;
use std::path::PathBuf;
use std::time::Duration;

/// One deployment, with all that it imports.
#[derive(Clone, Debug)]
pub struct Deployment {
    /// Its name, which is the network's.
    pub name: Name,
    /// Its documentation.
    pub doc: Vec<String>,
    /// The machines that it names.
    pub hosts: Vec<Host>,
    /// All components, in the order of the files; those of a group stand together.
    pub instances: Vec<Instance>,
    /// All groups, each before those inside it.
    pub groups: Vec<Group>,
    /// Connections that the files make themselves.
    pub binds: Vec<Bind>,
}

/// A machine.
#[derive(Clone, Debug)]
pub struct Host {
    /// Its name.
    pub name: Name,
    /// Its documentation.
    pub doc: Vec<String>,
    /// Its name or IP address in the network of machines.
    pub address: Name,
    /// Who runs components there, where the file says.
    pub user: Option<Name>,
    /// The folder for programs and files there, where the file says.
    pub workspace: Option<Name>,
}

/// One component of a network.
#[derive(Clone, Debug)]
pub struct Instance {
    /// Its own name.
    pub name: Name,
    /// Its name in the network, with the groups that it is in: `arm.left.motor`.
    pub path: String,
    /// Its documentation.
    pub doc: Vec<String>,
    /// The innermost group that it is in: an index into [`Deployment::groups`].
    pub group: Option<usize>,
    /// The folder of the file that it stands in, where its relative paths start.
    pub folder: PathBuf,
    /// Its `.cdsl`.
    pub cdsl: Option<Name>,
    /// Its program, where it is not the one that cargo builds.
    pub executable: Option<Name>,
    /// Its configuration, where it is not the component's `etc/config.toml`.
    pub config: Option<Name>,
    /// The machine that it runs on, where that is not this one: an index into [`Deployment::hosts`], and where the
    /// file says so.
    pub host: Option<(usize, Span)>,
    /// The TCP address of its management, where it has one, and where the file says so.
    pub endpoint: Option<(SocketAddr, Span)>,
    /// The middleware of its slots that do not choose one.
    pub middleware: Backend,
    /// What the files set of middlewares, each key of one of them once.
    pub settings: Vec<Setting>,
    /// What must be ready first, and where the file says so.
    pub after: Vec<(InstanceOrGroup, Span)>,
    /// Whether it is started again when it has ended.
    pub restart: Restart,
    /// How long it may take to become ready.
    pub ready: Duration,
    /// How long it may take to stop.
    pub stop: Duration,
    /// Environment variables.
    pub env: Vec<(Name, Name)>,
    /// Further arguments.
    pub args: Vec<Name>,
    /// The processors that it may run on; any where there is none.
    pub cpu: Vec<u16>,
    /// Where the file names these processors.
    pub cpu_span: Option<Span>,
    /// Its real-time priority, 1 to 99, where it has one, and where the file says so.
    pub priority: Option<(u8, Span)>,
}

/// What is set of a middleware.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Setting {
    /// Of which.
    pub middleware: Backend,
    /// What, as `rc_settings` knows it.
    pub key: &'static str,
    /// To what, each value in its usual form.
    pub values: Vec<String>,
    /// Where.
    pub span: Span,
}

impl Instance {
    /// What is set of a middleware.
    pub fn setting(&self, middleware: Backend, key: &str) -> Option<&Setting> {
        let mut settings = self.settings.iter();
        settings.find(|s| s.middleware == middleware && s.key == key)
    }
}

/// How long a component may take to become ready where the file does not say.
pub const READY: Duration = Duration::from_secs(10);
/// How long a component may take to stop where the file does not say.
pub const STOP: Duration = Duration::from_secs(3);
/// How long after its end a component is started for the first time again, where the file does not say.
pub const BACKOFF: Duration = Duration::from_millis(500);
/// The most characters that the name of a network, or of a component with its groups, may have: names of files and
/// sockets are made of them.
pub const LONGEST_NAME: usize = 64;

/// Whether a component is started again when it has ended by itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Restart {
    /// After which ends.
    pub policy: Policy,
    /// How often within which time at most; a further end stops the network.
    pub limit: Option<(u32, Duration)>,
    /// How long after its end it is started again; the time doubles from one short run to the next.
    pub backoff: Duration,
}

impl Default for Restart {
    fn default() -> Self {
        Self {
            policy: Policy::Never,
            limit: None,
            backoff: BACKOFF,
        }
    }
}

/// After which ends a component is started again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Policy {
    /// After none.
    Never,
    /// After those that are no success.
    OnFailure,
    /// After all.
    Always,
}

impl Policy {
    /// The words of the language.
    pub const WORDS: [(&'static str, Self); 3] = [
        ("never", Self::Never),
        ("on_failure", Self::OnFailure),
        ("always", Self::Always),
    ];
}

/// Components that belong together. What is inside can be named from outside only as far as it is exported.
#[derive(Clone, Debug)]
pub struct Group {
    /// Its own name.
    pub name: Name,
    /// Its name with the groups that it is in.
    pub path: String,
    /// Its documentation.
    pub doc: Vec<String>,
    /// The group that it is in: an index into [`Deployment::groups`].
    pub parent: Option<usize>,
    /// Its components and those of the groups inside it, in [`Deployment::instances`].
    pub instances: Range<usize>,
    /// The slots that it lets out, each by a name that one slot inside has.
    pub exports: Vec<Name>,
}

/// A component or a group.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum InstanceOrGroup {
    /// An index into [`Deployment::instances`].
    Instance(usize),
    /// An index into [`Deployment::groups`].
    Group(usize),
}

/// `bind avoider.Laser -> sensors.Laser;`
#[derive(Clone, Debug)]
pub struct Bind {
    /// The slot that requires or subscribes.
    pub consumer: SlotPath,
    /// The slot that implements or publishes; none where the file names nothing that can be reached, which has been
    /// reported.
    pub provider: Option<SlotPath>,
}

/// A slot of an instance, or one that a group exports.
#[derive(Clone, Debug)]
pub struct SlotPath {
    /// The instance or the group.
    pub place: InstanceOrGroup,
    /// The slot.
    pub slot: Name,
    /// The whole path.
    pub span: Span,
}

impl Deployment {
    /// The machine that an instance runs on, where that is not this one.
    pub fn remote_host(&self, instance: &Instance) -> Option<&Host> {
        let (host, _) = instance.host?;
        self.hosts.get(host).filter(|host| !host.is_local())
    }

    /// All instances that a place stands for, as indices into [`Deployment::instances`].
    pub fn instances_of(&self, place: InstanceOrGroup) -> Range<usize> {
        match place {
            InstanceOrGroup::Instance(at) => at..at + 1,
            InstanceOrGroup::Group(group) => self.groups[group].instances.clone(),
        }
    }

    /// A group and those that it is in, from inside to outside.
    pub fn enclosing(&self, group: Option<usize>) -> impl Iterator<Item = usize> + '_ {
        std::iter::successors(group, |at| self.groups[*at].parent)
    }

    /// Whether `inner` is `outer` or inside it; none is the deployment itself.
    pub fn is_inside(&self, inner: Option<usize>, outer: Option<usize>) -> bool {
        outer.is_none() || self.enclosing(inner).any(|group| Some(group) == outer)
    }
}

impl Group {
    /// The clause that lets `slot` out as well, as a proposal.
    pub(crate) fn export_with(&self, slot: &str) -> String {
        let names = self.exports.iter().map(|name| name.text.as_str());
        let names: Vec<&str> = names.chain([slot]).collect();
        format!(
            "`export {};` in group `{}` would let it out",
            names.join(", "),
            self.path
        )
    }
}

impl Host {
    /// Whether it is this machine, under whatever name.
    pub fn is_local(&self) -> bool {
        let address = self.address.text.as_str();
        address.eq_ignore_ascii_case("localhost")
            || address.parse().is_ok_and(|ip: IpAddr| ip.is_loopback())
    }

    /// Whether both are one machine, and one user there.
    pub fn is_same(&self, other: &Self) -> bool {
        let machine = |host: &Self| host.address.text.to_lowercase();
        let user = |host: &Self| host.user.as_ref().map(|user| user.text.clone());
        machine(self) == machine(other) && user(self) == user(other)
    }
}
