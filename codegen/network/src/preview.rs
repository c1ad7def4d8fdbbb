//! The output of `rcdeploy plan`: everything that `rcdeploy up` would do.

use crate::chains::ChainReport;
use crate::error::{Error, refused};
use crate::model::{ClockPlan, Network};
use crate::plan;
use crate::plan::{Policy, Restart};
use crate::process_name::process_name;
use crate::profile::Profile;
use crate::topology::{Connection, End, Host, Kind};
use crate::world_report::WorldReport;
use rc_middleware::RunDirectory;
use rc_vocabulary::duration;
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// The length of a line, if the names permit it.
const LINE: usize = 100;

/// The preview of an `up`.
#[derive(Clone, Debug, Serialize)]
pub struct Preview {
    /// The name of the network.
    pub network: String,
    /// The absolute path of its description.
    pub ddsl: PathBuf,
    /// The machines with components. This machine is `localhost` unless it has a name.
    pub hosts: Vec<Host>,
    /// Components that may start at the same time, in the order of their start. A component does
    /// not wait for a whole wave, only for what it needs itself.
    pub waves: Vec<Vec<String>>,
    /// The processes, in the order of the file.
    pub components: Vec<Process>,
    /// The connections.
    pub connections: Vec<Connection>,
    /// The chains, with their worst cases.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub chains: Vec<ChainReport>,
    /// The graph that its components share.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub world: Option<WorldReport>,
    /// The time over which the last messages are kept in memory, in milliseconds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ring_ms: Option<u64>,
}

/// One process.
#[derive(Clone, Debug, Serialize)]
pub struct Process {
    /// The full name of the component.
    pub name: String,
    /// Name in its `.cdsl`.
    pub component: Option<String>,
    /// The name of its host.
    pub host: String,
    /// The middleware of its slots that name none.
    pub middleware: String,
    /// Clock of the component.
    pub clock: ClockPlan,
    /// Number in `waves`, from 1.
    pub wave: usize,
    /// The components that must be ready before it starts.
    pub starts_after: Vec<String>,
    /// Whether its life cycle is managed.
    pub managed: bool,
    /// The process whose thread it is. `None` for one of its own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub process: Option<String>,
    /// The absolute path of its executable. `None` for a component outside of a cargo workspace.
    pub executable: Option<PathBuf>,
    /// The absolute path of its configuration. `None` if all parameters have their defaults.
    pub configuration: Option<PathBuf>,
    /// Working directory.
    pub directory: PathBuf,
    /// The values of parameters that the network sets, as JSON, by path.
    pub parameters: BTreeMap<String, serde_json::Value>,
    /// All its arguments.
    pub arguments: Vec<String>,
    /// Environment, in addition to that of rcdeploy.
    pub environment: BTreeMap<String, String>,
    /// Management socket.
    pub management: PathBuf,
    /// The TCP address of its management, if it has one.
    pub endpoint: Option<SocketAddr>,
    /// The limit until it is ready, in milliseconds.
    pub ready_ms: u64,
    /// The limit for its end, in milliseconds.
    pub stop_ms: u64,
    /// When it is started again.
    pub restart: RestartRule,
    /// The processors that it may run on. Empty: any.
    pub cpu: Vec<u16>,
    /// Real-time priority.
    pub priority: Option<u8>,
}

/// A restart policy.
#[derive(Clone, Debug, Serialize)]
pub struct RestartRule {
    /// `never`, `on_failure` or `always`.
    pub policy: Policy,
    /// How long it may hang before it is stopped, in milliseconds. `None`: no limit.
    pub hung_ms: Option<u64>,
    /// The number of restarts allowed within `within_ms`. `None`: no limit.
    pub max: Option<u32>,
    /// The time in which `max` counts, in milliseconds.
    pub within_ms: Option<u64>,
    /// The pause before the first restart, in milliseconds. It doubles.
    pub backoff_ms: u64,
}

fn milliseconds(time: Duration) -> u64 {
    time.as_millis().try_into().unwrap_or(u64::MAX)
}

impl From<&Restart> for RestartRule {
    fn from(restart: &Restart) -> Self {
        Self {
            policy: restart.policy,
            hung_ms: restart.hung.map(milliseconds),
            max: restart.limit.map(|(max, _)| max),
            within_ms: restart.limit.map(|(_, within)| milliseconds(within)),
            backoff_ms: milliseconds(restart.backoff),
        }
    }
}

impl Preview {
    /// The preview of a network without errors.
    ///
    /// # Errors
    /// As [`Network::plan`].
    pub fn of(network: &Network, profile: Profile) -> Result<Self, Error> {
        let plan = network.plan(profile)?;
        let needs = plan.needs();
        let waves = plan::waves(&needs);
        let run = RunDirectory::of(network.name());
        let mut components = Vec::new();
        for (at, planned) in plan.components.into_iter().enumerate() {
            let instance = &network.deployment.instances[at];
            let project = network.projects[at].as_ref();
            let mut options = planned.args.windows(2);
            let configuration = options.find(|option| option[0] == "--config");
            let configuration = configuration.map(|option| Path::new(&option[1]));
            let needed = needs[at].iter();
            let needed = needed.map(|other| network.deployment.instances[*other].path.clone());
            components.push(Process {
                component: project.map(|p| p.component.name.text.clone()),
                host: Host::name_of(network, at).to_owned(),
                middleware: planned.middleware,
                clock: network.clocks[at].clone(),
                wave: waves[at] + 1,
                starts_after: needed.collect(),
                managed: planned.managed,
                process: planned.thread.map(|thread| thread.process),
                executable: Some(planned.executable).filter(|p| !p.as_os_str().is_empty()),
                configuration: configuration
                    .map(Path::canonicalize)
                    .transpose()
                    .map_err(refused("open a configuration"))?,
                directory: planned.directory,
                parameters: network.parameters[at].set.iter().cloned().collect(),
                arguments: planned.args,
                environment: planned.env,
                management: run.socket(&process_name(&planned.name)),
                endpoint: instance.endpoint.map(|(address, _)| address),
                ready_ms: milliseconds(planned.ready),
                stop_ms: milliseconds(planned.stop),
                restart: RestartRule::from(&instance.restart),
                cpu: instance.cpu.clone(),
                priority: instance.priority.map(|(priority, _)| priority),
                name: planned.name,
            });
        }
        let count = waves.iter().max().map_or(0, |last| last + 1);
        let in_wave = |wave| {
            let members = components.iter().filter(move |c| c.wave == wave + 1);
            members.map(|c| c.name.clone()).collect()
        };
        Ok(Self {
            network: plan.network,
            ddsl: plan.ddsl,
            hosts: Host::all(network),
            waves: (0..count).map(in_wave).collect(),
            components,
            connections: Connection::between(network)
                .into_iter()
                .map(|(_, c)| c)
                .chain(Connection::outside(network))
                .collect(),
            chains: ChainReport::all(network),
            world: WorldReport::of(network),
            ring_ms: plan.ring.map(milliseconds),
        })
    }
}

/// A time as people write it.
fn time(milliseconds: u64) -> String {
    duration::text(milliseconds.saturating_mul(1_000_000))
}

impl fmt::Display for RestartRule {
    /// The policy as in a `.ddsl`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.policy.word())?;
        if self.policy == Policy::Never {
            return Ok(());
        }
        if let Some(hung) = self.hung_ms {
            write!(f, " hung {}", time(hung))?;
        }
        if let (Some(max), Some(within)) = (self.max, self.within_ms) {
            write!(f, " max {max} within {}", time(within))?;
        }
        write!(f, " backoff {}", time(self.backoff_ms))
    }
}

/// A path relative to the working directory, if it is below it.
fn short(path: &Path) -> String {
    let here = std::env::current_dir().unwrap_or_default();
    path.strip_prefix(here)
        .unwrap_or(path)
        .display()
        .to_string()
}

/// Words, wrapped at [`LINE`] and indented by `indent`.
fn listed(words: &[String], indent: usize) -> String {
    let mut out = String::new();
    let mut column = indent;
    for (number, word) in words.iter().enumerate() {
        let last = number + 1 == words.len();
        let length = word.chars().count() + usize::from(!last);
        if number > 0 && column + 1 + length > LINE {
            out += &format!("\n{:indent$}", "");
            column = indent;
        } else if number > 0 {
            out.push(' ');
            column += 1;
        }
        out += word;
        if !last {
            out.push(',');
        }
        column += length;
    }
    out
}

/// The width of a column, which one long text does not exceed: a width is a `u16` for the formatter.
fn widest<'a>(all: impl Iterator<Item = &'a str>, title: &str) -> usize {
    let widths = all.map(|text| text.chars().count().min(LINE));
    widths.max().unwrap_or(0).max(title.len())
}

impl fmt::Display for Preview {
    /// Tables for people.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let count = |number: usize, what: &str| match number {
            1 => format!("1 {what}"),
            more => format!("{more} {what}s"),
        };
        writeln!(
            f,
            "{}: {}, {}, {}; {}",
            self.network,
            count(self.components.len(), "component"),
            count(self.connections.len(), "connection"),
            count(self.hosts.len(), "host"),
            short(&self.ddsl)
        )?;
        for host in &self.hosts {
            if let Some(build) = &host.build {
                writeln!(f, "host {}: {build}", host.name)?;
            }
        }
        self.order(f)?;
        self.connections(f)?;
        for chain in &self.chains {
            write!(f, "\n{chain}")?;
        }
        if let Some(world) = &self.world {
            write!(f, "\n{world}")?;
        }
        self.processes(f)?;
        if let Some(ms) = self.ring_ms {
            writeln!(f, "\na ring keeps the messages of the last {}", time(ms))?;
        }
        Ok(())
    }
}

impl Preview {
    fn order(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = widest(self.components.iter().map(|c| c.name.as_str()), "component");
        let host = widest(self.components.iter().map(|c| c.host.as_str()), "host");
        writeln!(
            f,
            "\nwave  {:name$}  {:host$}  {:>6}  {:>6}  starts when these are ready",
            "component", "host", "ready", "stop"
        )?;
        let mut order: Vec<&Process> = self.components.iter().collect();
        order.sort_by_key(|c| c.wave);
        for c in order {
            let line = format!(
                "{:4}  {:name$}  {:host$}  {:>6}  {:>6}  {}",
                c.wave,
                c.name,
                c.host,
                time(c.ready_ms),
                time(c.stop_ms),
                listed(&c.starts_after, 4 + 2 + name + 2 + host + 2 + 6 + 2 + 6 + 2)
            );
            writeln!(f, "{}", line.trim_end())?;
        }
        Ok(())
    }

    fn connections(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.connections.is_empty() {
            return Ok(());
        }
        let rows: Vec<[String; 5]> = self
            .connections
            .iter()
            .map(|c| {
                let end = |end: &End| {
                    if end.external {
                        format!("external {}", end.slot)
                    } else {
                        format!("{}.{}", end.component, end.slot)
                    }
                };
                let kind = match c.kind {
                    Kind::Call => "call",
                    Kind::Topic => "topic",
                };
                let address = c.address.clone().unwrap_or_default();
                [
                    end(&c.from),
                    end(&c.to),
                    kind.into(),
                    c.middleware.into(),
                    address,
                ]
            })
            .collect();
        let titles = ["from", "to", "what", "over", "address"];
        let width = |at: usize| widest(rows.iter().map(|r| r[at].as_str()), titles[at]);
        let widths: [usize; 5] = std::array::from_fn(width);
        // If a line is too long, addresses are below.
        let beside = widths.iter().sum::<usize>() + 8 <= LINE;
        writeln!(f)?;
        let none: &[String] = &[];
        let converts = self.connections.iter().map(|c| c.converts.as_slice());
        let converts = std::iter::once(none).chain(converts);
        let rows = std::iter::once(titles.map(str::to_owned)).chain(rows);
        for (row, converts) in rows.zip(converts) {
            let [from, to, what, over, address] = row;
            let gap = if beside {
                "  ".to_owned()
            } else {
                "\n    ".to_owned()
            };
            let line = format!(
                "{from:0$}  {to:1$}  {what:2$}  {over:3$}",
                widths[0], widths[1], widths[2], widths[3]
            );
            writeln!(
                f,
                "{}{gap}{address}",
                if beside { &line } else { line.trim_end() }
            )?;
            for member in converts {
                writeln!(f, "    converts {member}")?;
            }
        }
        Ok(())
    }

    fn processes(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for c in &self.components {
            writeln!(f, "\n{}", c.name)?;
            let mut row = |what: &str, text: &str| writeln!(f, "    {what:13}  {text}");
            let path =
                |path: &Option<PathBuf>, none: &str| path.as_deref().map_or(none.to_owned(), short);
            if let Some(process) = &c.process {
                row("process", process)?;
            }
            row(
                "executable",
                &path(&c.executable, "none: it is in no cargo workspace"),
            )?;
            row("configuration", &path(&c.configuration, "defaults"))?;
            if !c.parameters.is_empty() {
                let all = c.parameters.iter();
                let all = all.map(|(path, value)| format!("{path} = {value}"));
                row("parameters", &listed(&all.collect::<Vec<_>>(), 19))?;
            }
            row("management", &short(&c.management))?;
            if let Some(endpoint) = c.endpoint {
                row("endpoint", &endpoint.to_string())?;
            }
            if c.managed {
                let needs: Vec<String> = c.starts_after.clone();
                let after = if needs.is_empty() {
                    "activated when all managed components are configured".to_owned()
                } else {
                    format!("activated after {}", listed(&needs, 19 + 16))
                };
                row("life cycle", &after)?;
            }
            row("middleware", &c.middleware)?;
            if c.clock.kind != "system" {
                row("clock", &c.clock.to_string())?;
            }
            row("restart", &c.restart.to_string())?;
            if !c.environment.is_empty() {
                let all = c
                    .environment
                    .iter()
                    .map(|(name, value)| format!("{name}={value}"));
                row("environment", &listed(&all.collect::<Vec<_>>(), 19))?;
            }
            let cpu: Vec<String> = c.cpu.iter().map(ToString::to_string).collect();
            let numbers = [
                ("cpu", Some(cpu.join(", ")).filter(|cpu| !cpu.is_empty())),
                ("priority", c.priority.map(|p| p.to_string())),
            ];
            for (what, number) in numbers {
                if let Some(number) = number {
                    row(what, &number)?;
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn a_wave_follows_its_dependencies() {
        let set = |all: &[usize]| all.iter().copied().collect::<BTreeSet<usize>>();
        let needs = [set(&[2]), set(&[]), set(&[1]), set(&[1])];
        assert_eq!(plan::waves(&needs), [2, 0, 1, 1]);
    }

    #[test]
    fn long_lists_continue_on_the_next_line() {
        let words: Vec<String> = (0..30).map(|n| format!("component{n}")).collect();
        let text = listed(&words, 40);
        assert!(
            text.lines()
                .skip(1)
                .all(|l| l.starts_with(&" ".repeat(40)) && l.len() <= LINE)
        );
        assert!(
            text.lines().next().is_some_and(|l| l.len() <= LINE - 40),
            "{text}"
        );
        assert!(text.ends_with("component28, component29"), "{text}");
    }

    #[test]
    fn one_long_name_does_not_widen_a_column_beyond_a_line() {
        let long = "h".repeat(70_000);
        let width = widest(["robot", long.as_str()].into_iter(), "host");
        assert_eq!(width, LINE);
        assert!(
            format!("{long:width$}|{:width$}|", "robot")
                .ends_with(&format!("{}|", " ".repeat(LINE - 5)))
        );
        assert_eq!(widest(["robot"].into_iter(), "component"), 9);
    }
}
