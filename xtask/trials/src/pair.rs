//! Two programs that exchange messages, and their latencies.

use crate::programs::{Failure, Program, target};
use crate::usage::processor_time;
use rc_deploy_network::Profile;
use rc_middleware::RunDirectory;
use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Duration;

/// The limit for the start of a pair.
const START: Duration = Duration::from_secs(10);
/// The limit for the start under a tool that slows the programs down.
const TOOL_START: Duration = Duration::from_mins(2);
/// The limit for one block.
const BLOCK: Duration = Duration::from_secs(10);

/// One row of the table.
#[derive(Clone)]
pub(crate) struct Row {
    pub(crate) name: Cow<'static, str>,
    /// The first word of the command to `ping`.
    pub(crate) kind: &'static str,
    pub(crate) size: usize,
    /// The number of messages of a block in a full run.
    pub(crate) count: usize,
}

impl Row {
    /// Whether the time is that of a round trip.
    pub(crate) fn is_query(&self) -> bool {
        matches!(self.kind, "query" | "rested" | "awake")
    }
}

/// The measured rows.
pub(crate) const ROWS: [Row; 6] = [
    Row {
        name: Cow::Borrowed("publish 64 B, one way"),
        kind: "publish",
        size: 64,
        count: 500,
    },
    Row {
        name: Cow::Borrowed("publish 4 KiB, one way"),
        kind: "publish",
        size: 4096,
        count: 500,
    },
    Row {
        name: Cow::Borrowed("publish 1 MiB copied, one way"),
        kind: "publish",
        size: 1024 * 1024,
        count: 50,
    },
    Row {
        name: Cow::Borrowed("publish 1 MiB in place, one way"),
        kind: "place",
        size: 1024 * 1024,
        count: 50,
    },
    Row {
        name: Cow::Borrowed("query 64 B, round trip"),
        kind: "query",
        size: 64,
        count: 1000,
    },
    Row {
        name: Cow::Borrowed("the same with `wake spin 200us` at both generated ends"),
        kind: "awake",
        size: 64,
        count: 1000,
    },
];

/// A network whose shared memory and run directory are removed on drop.
pub(crate) struct Network {
    pub(crate) name: String,
    pub(crate) directory: RunDirectory,
}

impl Network {
    /// A network with a name of its own.
    pub(crate) fn new(what: &str) -> Result<Self, Failure> {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let number = COUNT.fetch_add(1, Ordering::Relaxed);
        let name = format!("bench-{what}-{}-{number}", std::process::id());
        let directory = RunDirectory::open(&name)?;
        Ok(Self { name, directory })
    }

    /// The root path and the prefix for programs that use iceoryx2 directly.
    pub(crate) fn files(&self) -> Result<(String, String), Failure> {
        let root = self.directory.middleware(rc_iceoryx2::NAME);
        std::fs::create_dir_all(&root)?;
        let prefix = rc_iceoryx2::prefix(&self.directory)?;
        Ok((root.to_string_lossy().into_owned(), prefix))
    }
}

impl Drop for Network {
    fn drop(&mut self) {
        // A file that cannot be removed is harmless.
        let _ = rc_iceoryx2::wipe(&self.directory);
        let _ = self.directory.remove();
    }
}

/// Of two slots of one interface, the second one has an address of its own: `awake` of both, and
/// `onward` of pong.
fn binds(network: &Network) -> [String; 2] {
    let name = &network.name;
    [
        format!("awake={name}/Awake"),
        format!("onward={name}/Onward"),
    ]
}

/// Two programs. On drop, `ping` ends first, the network last.
pub(crate) struct Pair {
    ping: Program,
    pong: Program,
    network: Option<Network>,
}

impl Pair {
    /// The generated components.
    pub(crate) fn generated() -> Result<Self, Failure> {
        Self::generated_under([&[], &[]])
    }

    /// The generated components in a network of their own, next to others.
    pub(crate) fn generated_in(what: &str) -> Result<Self, Failure> {
        Self::generated_with(what, Profile::Release, [&[], &[]])
    }

    /// The root path and the prefix of its network, for programs that use iceoryx2 directly.
    pub(crate) fn files(&self) -> Result<(String, String), Failure> {
        self.network.as_ref().ok_or("no network")?.files()
    }

    /// The name of its network.
    pub(crate) fn network(&self) -> Option<&str> {
        self.network.as_ref().map(|network| network.name.as_str())
    }

    /// The generated components in a network of their own, each with further arguments: the
    /// subscriber and server, then the publisher and client.
    pub(crate) fn generated_with(
        what: &str,
        profile: Profile,
        [pong, ping]: [&[&str]; 2],
    ) -> Result<Self, Failure> {
        let network = Network::new(what)?;
        let [awake, onward] = binds(&network);
        let name = network.name.clone();
        let own = ["--network", &name, "--log", "error", "--bind", &awake];
        let onward = ["--bind", &onward];
        let arguments = [[&own[..], &onward, pong].concat(), [&own, ping].concat()];
        let arguments = arguments.each_ref().map(|words| &words[..]);
        let folder = target()?.join(profile.folder());
        let programs = [folder.join("pong"), folder.join("ping")];
        Self::start([&[], &[]], &programs, arguments, Some(network))
    }

    /// The generated components under tools, with their command lines: that of the publisher and
    /// client, then that of the subscriber and server.
    pub(crate) fn generated_under(tools: [&[String]; 2]) -> Result<Self, Failure> {
        let folder = target()?.join("release");
        Self::components_under(tools, &[folder.join("pong"), folder.join("ping")], &[])
    }

    /// A pong and a ping with further arguments.
    pub(crate) fn components(programs: &[PathBuf; 2], more: &[&str]) -> Result<Self, Failure> {
        Self::components_under([&[], &[]], programs, more)
    }

    /// A pong and a ping, each on one processor, with further arguments.
    pub(crate) fn at(
        [pong, ping]: [usize; 2],
        programs: &[PathBuf; 2],
        more: &[&str],
    ) -> Result<Self, Failure> {
        let tools = [ping, pong].map(|at| ["taskset", "-c", &at.to_string()].map(str::to_owned));
        Self::components_under([&tools[0], &tools[1]], programs, more)
    }

    /// A pong and a ping under tools, as [`Pair::generated_under`], with further arguments.
    pub(crate) fn components_under(
        tools: [&[String]; 2],
        programs: &[PathBuf; 2],
        more: &[&str],
    ) -> Result<Self, Failure> {
        Self::components_in(Network::new("gen")?, tools, programs, more)
    }

    fn components_in(
        network: Network,
        tools: [&[String]; 2],
        programs: &[PathBuf; 2],
        more: &[&str],
    ) -> Result<Self, Failure> {
        let [awake, onward] = binds(&network);
        let name = network.name.clone();
        let own = ["--network", &name, "--log", "error", "--bind", &awake];
        let onward = ["--bind", &onward];
        let (pong, ping) = ([&own[..], &onward, more].concat(), [&own, more].concat());
        Self::start(tools, programs, [&pong, &ping], Some(network))
    }

    /// Starts both, each under a tool, with its command line.
    pub(crate) fn start(
        [of_ping, of_pong]: [&[String]; 2],
        [pong, ping]: &[PathBuf; 2],
        [answering, asking]: [&[&str]; 2],
        network: Option<Network>,
    ) -> Result<Self, Failure> {
        let start = |path: &Path, arguments: &[&str], tool: &[String]| {
            let mut words = tool.iter();
            let mut command = match words.next() {
                Some(program) => {
                    let mut command = Command::new(program);
                    command.args(words).arg(path);
                    command
                }
                None => Command::new(path),
            };
            command.args(arguments);
            let limit = if tool.is_empty() { START } else { TOOL_START };
            ready(Program::spawn(command)?, limit)
        };
        let pong = start(pong, answering, of_pong)?;
        let ping = start(ping, asking, of_ping)?;
        Ok(Self {
            ping,
            pong,
            network,
        })
    }

    /// The hand-written programs.
    pub(crate) fn by_hand() -> Result<Self, Failure> {
        Self::by_hand_under([&[], &[]])
    }

    /// The hand-written programs under tools, as generated ones.
    pub(crate) fn by_hand_under(tools: [&[String]; 2]) -> Result<Self, Failure> {
        let network = Network::new("hand")?;
        let path = target()?.join("release/bench_peer");
        let (root, prefix) = network.files()?;
        let arguments = ["pong", "ping"].map(|which| [which, &root, &prefix]);
        let arguments = arguments.each_ref().map(|words| &words[..]);
        Self::start(tools, &[path.clone(), path], arguments, Some(network))
    }

    /// The hand-written programs over a network, with a DDS domain.
    pub(crate) fn by_hand_over(program: &str, domain: &str) -> Result<Self, Failure> {
        let path = target()?.join("release").join(program);
        let arguments: [&[&str]; 2] = [&["pong", domain], &["ping", domain]];
        Self::start([&[], &[]], &[path.clone(), path], arguments, None)
    }

    /// The program of `xtask/bench/ice` as both ends.
    pub(crate) fn ice(path: &Path) -> Result<Self, Failure> {
        let pong = Program::start(path, &["server"])?;
        let line = pong.read_line(START)?;
        let address = line.strip_prefix("ready ").ok_or("no address")?;
        let ping = ready(Program::start(path, &["client", address])?, START)?;
        Ok(Self {
            ping,
            pong,
            network: None,
        })
    }

    /// The processor time of both since their start.
    pub(crate) fn processor_time(&self) -> Result<Duration, Failure> {
        Ok(processor_time(self.ping.pid())? + processor_time(self.pong.pid())?)
    }

    /// Measures one block.
    pub(crate) fn block(&mut self, row: &Row, share: f64) -> Result<Vec<i64>, Failure> {
        let count = (row.count as f64 * share) as usize;
        let Row { kind, size, .. } = row;
        self.ping.write_line(&format!("{kind} {size} {count}"))?;
        let asked = times(&self.ping.read_line(BLOCK)?)?;
        if row.is_query() {
            return Ok(asked);
        }
        self.times_of_pong()
    }

    /// Runs one block under a tool. Returns how many messages the receiver has handled.
    pub(crate) fn counted_block(&mut self, row: &Row, limit: Duration) -> Result<usize, Failure> {
        let Row {
            kind, size, count, ..
        } = row;
        self.ping.write_line(&format!("{kind} {size} {count}"))?;
        let mut came = times(&self.ping.read_line(limit)?)?;
        if !row.is_query() {
            came = times(&self.pong.read_line(limit)?)?;
        }
        Ok(came.len())
    }

    /// The processes: the publisher and client, then the subscriber and server.
    pub(crate) fn pids(&self) -> [u32; 2] {
        [self.ping.pid(), self.pong.pid()]
    }

    /// Ends both programs, so that a tool can write its result.
    pub(crate) fn stop(self, limit: Duration) -> Result<(), Failure> {
        let Self {
            ping,
            pong,
            network,
        } = self;
        ping.stop(limit)?;
        pong.stop(limit)?;
        drop(network);
        Ok(())
    }

    /// The next report of pong.
    pub(crate) fn times_of_pong(&self) -> Result<Vec<i64>, Failure> {
        times(&self.pong.read_line(BLOCK)?)
    }

    /// Measures one block at full speed.
    pub(crate) fn flood(&mut self, size: usize, count: usize) -> Result<Flood, Failure> {
        self.ping.write_line(&format!("flood {size} {count}"))?;
        let took = times(&self.ping.read_line(BLOCK)?)?;
        let took = *took.first().ok_or("no time")?;
        let came = times(&self.pong.read_line(BLOCK)?)?;
        // The last value is never lost.
        let last = *came.last().ok_or("nothing came")?;
        Ok(Flood {
            sent: count,
            sending: took as f64 / 1e9,
            came: came.len(),
            coming: (took + last) as f64 / 1e9,
        })
    }

    /// The run directory of the network; `None` for a domain of DDS.
    pub(crate) fn directory(&self) -> Option<&RunDirectory> {
        self.network.as_ref().map(|network| &network.directory)
    }
}

/// The result of a block at full speed.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Flood {
    /// The number of sent values, and the seconds.
    pub(crate) sent: usize,
    pub(crate) sending: f64,
    /// The number of received values, and the seconds from the first send to the last receive.
    pub(crate) came: usize,
    pub(crate) coming: f64,
}

fn ready(program: Program, limit: Duration) -> Result<Program, Failure> {
    match program.read_line(limit)?.as_str() {
        "ready" => Ok(program),
        other => Err(format!("`{other}` instead of `ready`").into()),
    }
}

pub(crate) fn times(line: &str) -> Result<Vec<i64>, Failure> {
    let words = line.strip_prefix("times").ok_or("no times")?;
    Ok(words
        .split_whitespace()
        .map(str::parse)
        .collect::<Result<_, _>>()?)
}

/// The latencies of one pair.
#[derive(Default)]
pub(crate) struct Times(Vec<i64>);

impl Times {
    /// Adds a block.
    pub(crate) fn add(&mut self, block: Vec<i64>) {
        self.0.extend(block);
    }

    /// The quantile `part`, in microseconds.
    pub(crate) fn quantile(&mut self, part: f64) -> f64 {
        quantile(&mut self.0, part) as f64 / 1000.0
    }

    /// The mean, in microseconds.
    pub(crate) fn mean(&self) -> f64 {
        self.0.iter().sum::<i64>() as f64 / self.0.len() as f64 / 1000.0
    }

    /// The number of messages.
    pub(crate) fn len(&self) -> usize {
        self.0.len()
    }
}

/// The quantile `part` of values; the default if there are none.
pub(crate) fn quantile<T: PartialOrd + Copy + Default>(values: &mut [T], part: f64) -> T {
    values.sort_by(|a, b| a.partial_cmp(b).unwrap_or(std::cmp::Ordering::Equal));
    let at = (values.len().saturating_sub(1) as f64 * part).round() as usize;
    values.get(at).copied().unwrap_or_default()
}
