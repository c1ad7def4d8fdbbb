//! Agents of one world that change it at random, over each middleware and between two hosts, while
//! some of them are killed, paused and cut off. In the end all have the same, which is what a plain
//! replay of all their changes has.

use crate::remote::Robot;
use fastrand::Rng;
use rc_test_site::site::Site;
use rc_test_support::cable::{ADDRESSES, Cable, cable, install, run};
use rc_test_support::python::{self, skipped};
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;
use std::collections::BTreeSet;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

const REPLAY: &str = include_str!("world_replay.py");
const STRANGER: &str = include_str!("world_stranger.py");
const CYCLONE: &str = "cyclonedds==11.0.1";
pub(crate) const AGENT: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/tests/programs/world_agent/world_agent.cdsl"
);

/// How much happens.
#[derive(Clone, Copy)]
pub(crate) struct Size {
    pub(crate) agents: usize,
    /// Changes a second of each.
    pub(crate) rate: u32,
    pub(crate) lasts: Duration,
    pub(crate) kills: usize,
    pub(crate) pauses: usize,
    /// How often the hosts are cut off from each other for five seconds.
    pub(crate) cuts: usize,
    /// How long it may take until all are equal after the last change.
    pub(crate) settles: Duration,
}

/// That of every test run.
const SMALL: Size = Size {
    agents: 6,
    rate: 20,
    lasts: Duration::from_secs(8),
    kills: 4,
    pauses: 2,
    cuts: 0,
    settles: Duration::from_mins(1),
};

#[derive(Clone, Copy, PartialEq, Debug)]
enum Trouble {
    Kill,
    Pause,
    Cut,
}

pub(crate) struct Agents<'c> {
    site: Site,
    size: Size,
    cable: Option<&'c Cable>,
    pub(crate) up: Vec<String>,
    /// Where a stranger takes part.
    pub(crate) stranger: Option<Place>,
}

/// A place in a network over DDS: the domain, and the agents whose addresses the other ones hear and send to.
#[derive(Clone, Copy)]
pub(crate) struct Place {
    pub(crate) domain: u32,
    pub(crate) tells: usize,
    pub(crate) hears: usize,
}

impl Place {
    /// Among agents that all hear each other: they share the addresses of the first one.
    fn among_all(domain: u32) -> Self {
        Self {
            domain,
            tells: 0,
            hears: 0,
        }
    }
}

/// A replica in plain Python, until its input ends.
struct Stranger(Child);

impl Stranger {
    /// Starts it with an interpreter that has the package `cyclonedds`.
    fn start(agents: &Agents<'_>, python: &Path, place: Place) -> Self {
        let script = agents.site.path("world_stranger.py");
        std::fs::write(&script, STRANGER).expect("to write");
        let mut command = agents.site.command(python);
        command.arg(script);
        for at in [place.tells, place.hears] {
            for slot in ["g", "g_stream"] {
                let (network, agent) = (&agents.site.network, Agents::name(at));
                command.arg(format!("{network}/{agent}/{slot}"));
            }
        }
        command.arg(place.domain.to_string());
        command.arg(agents.site.path("agents"));
        command.arg(agents.size.rate.to_string());
        command.stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut child = command.spawn().expect("the interpreter");
        let mut said = String::new();
        let out = child.stdout.as_mut().expect("an output");
        BufReader::new(out).read_line(&mut said).expect("a line");
        assert_eq!(said, "ready\n");
        Self(child)
    }

    /// Lets it write down what it has.
    fn end(mut self) {
        drop(self.0.stdin.take());
        assert!(self.0.wait().expect("the end").success());
    }
}

impl Drop for Stranger {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl Agents<'_> {
    pub(crate) fn name(at: usize) -> String {
        format!("agent{at}")
    }

    /// A network of agents. `head` says which middleware and hosts it has, `of` the component of each
    /// agent, and what it adds.
    pub(crate) fn new<'c>(
        site: Site,
        size: Size,
        cable: Option<&'c Cable>,
        head: &str,
        of: impl Fn(usize) -> (&'static str, String),
    ) -> Agents<'c> {
        let folder = site.path("agents");
        std::fs::create_dir_all(&folder).expect("a folder");
        let mut text = format!("Deployment patrol\n{{\n    {head}\n");
        for at in 0..size.agents {
            let (name, (cdsl, more)) = (Self::name(at), of(at));
            text += &format!(
                "    Component {name} {{ cdsl \"{cdsl}\"; restart always backoff 100ms; {more}\n        \
                parameters {{ folder \"{}\"; rate {}; }}; }};\n",
                folder.display(),
                size.rate
            );
        }
        text += "};\n";
        site.write_ddsl(&text);
        Agents {
            site,
            size,
            cable,
            up: Vec::new(),
            stranger: None,
        }
    }

    fn rcdeploy(&self, args: &[&str]) -> Command {
        let mut command = self.site.command(Path::new(env!("CARGO_BIN_EXE_rcdeploy")));
        command.args(args);
        command.env("CARGO_NET_OFFLINE", "true");
        for name in ["VIRTUAL_ENV", "PYTHONPATH"] {
            command.env_remove(name);
        }
        command
    }

    fn start(&mut self) {
        let file = self.site.ddsl();
        let mut up = self.rcdeploy(&["up", "--build", "--detach", "--profile", "dev"]);
        up.arg(file);
        up.envs(self.up.iter().filter_map(|text| text.split_once('=')));
        let up = self.site.run(up);
        assert_eq!(up.code, 0, "{up:?}");
    }

    /// The graphs of the agents, by their reports. `None` if an agent has not reported.
    fn told(&self) -> Option<Value> {
        let mut world = self.rcdeploy(&["world", &self.site.network, "--format", "json"]);
        let output = world.output().expect("rcdeploy");
        let told: Value = serde_json::from_slice(&output.stdout).ok()?;
        let all = told["replicas"].as_array()?.len() == self.count();
        all.then_some(told)
    }

    /// How many agents have made a change.
    fn changing(&self) -> usize {
        let files = std::fs::read_dir(self.site.path("agents")).expect("a folder");
        let files = files.flatten().filter_map(|file| file.metadata().ok());
        files.filter(|file| file.len() > 0).count()
    }

    /// How many replicas there are.
    fn count(&self) -> usize {
        self.size.agents + usize::from(self.stranger.is_some())
    }

    /// The process of an agent. The supervisor of many agents may answer late.
    fn pid(&self, at: usize) -> Option<Pid> {
        let arguments = ["status", "--format", "json", &self.site.network];
        let status = (0..5).find_map(|_| {
            let ran = self.site.rcdeploy(&arguments, false);
            serde_json::from_str::<Value>(&ran.stdout).ok()
        })?;
        let components = status["components"].as_array()?.clone();
        let name = Self::name(at);
        let own = components.iter().find(|own| own["name"] == name.as_str())?;
        Pid::from_raw(i32::try_from(own["pid"].as_i64()?).ok()?)
    }

    /// One trouble. `killed` are the processes that were killed.
    fn make(&self, trouble: Trouble, killed: &mut BTreeSet<i32>, random: &mut Rng) {
        match trouble {
            Trouble::Kill => {
                let pid = self.signal(Signal::KILL, killed, random);
                killed.insert(pid.as_raw_nonzero().get());
            }
            Trouble::Pause => {
                let pid = self.signal(Signal::STOP, killed, random);
                std::thread::sleep(Duration::from_millis(500));
                let _ = kill_process(pid, Signal::CONT);
            }
            Trouble::Cut => cut(self.cable.expect("a cable")),
        }
    }

    /// Sends a signal to an agent at random that runs: one that was killed may not have started again yet.
    /// Returns its process.
    fn signal(&self, signal: Signal, killed: &BTreeSet<i32>, random: &mut Rng) -> Pid {
        let mut reached = None;
        Site::until_within(self.size.settles, "an agent runs", || {
            let pid = self.pid(random.usize(..self.size.agents));
            let pid = pid.filter(|pid| !killed.contains(&pid.as_raw_nonzero().get()));
            reached = pid.filter(|pid| kill_process(*pid, signal).is_ok());
            reached.is_some()
        });
        reached.expect("an agent")
    }

    /// Everything, and what the replay says.
    pub(crate) fn run(mut self) {
        build();
        let test = "a stranger shares the world";
        let python = self
            .stranger
            .and_then(|_| python::interpreter(CYCLONE, test));
        self.stranger = self.stranger.filter(|_| python.is_some());
        self.start();
        let stranger = self.stranger.zip(python);
        let stranger = stranger.map(|(place, python)| Stranger::start(&self, python, place));
        if let Some(cable) = self.cable {
            lose(cable).expect("to lose packets");
        }
        Site::until_within(self.size.settles, "all agents change the world", || {
            self.changing() >= self.count()
        });
        let seed = std::env::var("RC_WORLD_SEED").ok();
        let seed = seed.and_then(|text| text.parse().ok()).unwrap_or(41);
        let mut random = Rng::with_seed(seed);
        let kinds = [
            (Trouble::Kill, self.size.kills),
            (Trouble::Pause, self.size.pauses),
            (Trouble::Cut, self.size.cuts),
        ];
        let all = kinds
            .iter()
            .flat_map(|(trouble, count)| vec![*trouble; *count]);
        let mut all: Vec<Trouble> = all.collect();
        random.shuffle(&mut all);
        let (start, count) = (Instant::now(), all.len() as u32);
        let mut killed = BTreeSet::new();
        for (number, trouble) in (0_u32..).zip(all) {
            let at = self.size.lasts * number / count.max(1);
            std::thread::sleep(at.saturating_sub(start.elapsed()));
            self.make(trouble, &mut killed, &mut random);
        }
        std::thread::sleep(self.size.lasts.saturating_sub(start.elapsed()));
        std::fs::write(self.site.path("agents/stop"), "").expect("to write");
        // The digests of which the agents write down the last one have all of it.
        Site::until_within(self.size.settles, "all agents are equal", || {
            self.told().is_some_and(|told| are_equal(&told))
        });
        let memory = self.memory();
        self.forget_ends();
        if let Some(stranger) = stranger {
            stranger.end();
        }
        let down = self.site.rcdeploy(&["down", &self.site.network], false);
        assert_eq!(down.code, 0, "{down:?}");
        let script = self.site.path("world_replay.py");
        std::fs::write(&script, REPLAY).expect("to write");
        let replayed = Command::new("python3")
            .arg(script)
            .arg(self.site.path("agents"))
            .arg(self.count().to_string())
            .output()
            .expect("python3");
        let text = String::from_utf8_lossy(&replayed.stdout).into_owned();
        let errors = String::from_utf8_lossy(&replayed.stderr).into_owned();
        let (pauses, cuts) = (self.size.pauses, self.size.cuts);
        let kills = killed.len();
        println!(
            "{text}{kills} kills, {pauses} pauses, {cuts} cuts, at most {memory} kB a process"
        );
        assert_eq!(kills, self.size.kills);
        assert!(replayed.status.success(), "{text}{errors}");
        assert!(memory < 256 << 10, "{memory} kB");
        self.site.assert_nothing_left();
    }

    /// Removes what agents wrote that have ended before. `rcdeploy` ends those of a host and starts them again
    /// if their link is silent for long, which it may be on a busy machine that loses packets.
    fn forget_ends(&self) {
        for file in std::fs::read_dir(self.site.path("agents")).expect("a folder") {
            let path = file.expect("a file").path();
            if path.extension().is_some_and(|ending| ending == "end") {
                std::fs::remove_file(path).expect("to remove");
            }
        }
    }

    /// The memory of the largest agent, in kB.
    fn memory(&self) -> u64 {
        let all = (0..self.size.agents).filter_map(|at| self.pid(at));
        let all = all.filter_map(|pid| {
            let status = format!("/proc/{}/status", pid.as_raw_nonzero());
            let text = std::fs::read_to_string(status).ok()?;
            let line = text.lines().find(|line| line.starts_with("RssAnon:"))?;
            line.split_whitespace().nth(1)?.parse().ok()
        });
        all.max().unwrap_or_default()
    }
}

/// Whether all replicas have announced the same, with the last values of streams, and none of them has edges
/// to remove: those of agents that have ended are removed later.
fn are_equal(told: &Value) -> bool {
    let all: Vec<&Value> = told["replicas"].as_array().into_iter().flatten().collect();
    let same = |name: &str| all.windows(2).all(|pair| pair[0][name] == pair[1][name]);
    let is_tidy = all.iter().all(|own| own["conflicts"] == 0);
    all.len() > 1 && is_tidy && same("digest") && same("streams")
}

/// An agent in Rust that adds nothing.
fn plain(_: usize) -> (&'static str, String) {
    (AGENT, String::new())
}

/// Builds the agents, so that no test of this program runs beside the compiler.
pub(crate) fn build() {
    static BUILT: OnceLock<()> = OnceLock::new();
    let size = Size { agents: 1, ..SMALL };
    BUILT.get_or_init(|| {
        for name in ["iceoryx2", "dds", "ros2"] {
            let head = format!("middleware {name};");
            let site = Site::new(&format!("world_build_{name}"));
            let mut agents = Agents::new(site, size, None, &head, plain);
            agents.up = vec!["ROS_DOMAIN_ID=215".to_owned()];
            agents.start();
            let site = &agents.site;
            assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
        }
    });
}

#[test]
fn agents_over_shared_memory_end_equal() {
    let site = Site::new("world_ice");
    Agents::new(site, SMALL, None, "middleware iceoryx2;", plain).run();
}

#[test]
fn agents_over_dds_end_equal() {
    let site = Site::new("world_dds");
    let head = "middleware dds { domain 211; };";
    let mut agents = Agents::new(site, SMALL, None, head, plain);
    agents.stranger = Some(Place::among_all(211));
    agents.run();
}

#[test]
fn agents_over_ros_2_end_equal() {
    let site = Site::new("world_ros");
    let mut agents = Agents::new(site, SMALL, None, "middleware ros2;", plain);
    agents.up = vec![
        "ROS_DOMAIN_ID=212".to_owned(),
        "ROS_LOCALHOST_ONLY=1".to_owned(),
    ];
    agents.run();
}

/// Agents of three middlewares on one host. Each hears its neighbours alone, over adaptors where these have
/// another middleware, and gets what the others have changed from them.
#[test]
fn agents_over_three_middlewares_end_equal() {
    let site = Site::new("world_mixed");
    let middlewares = ["iceoryx2", "iceoryx2", "dds", "dds", "ros2"];
    let mut head =
        "middleware iceoryx2; middleware dds { domain 217; }; middleware ros2 { domain 218; };"
            .to_owned();
    for (first, second) in [(0, 1), (1, 2), (2, 3), (2, 4)] {
        let convert = if middlewares[first] == middlewares[second] {
            ";"
        } else {
            " { convert via process; };"
        };
        for (one, other) in [(first, second), (second, first)] {
            let (one, other) = (Agents::name(one), Agents::name(other));
            head += &format!("\n    bind {one}.g_peers -> {other}.g{convert}");
            head += &format!("\n    bind {one}.g_streams -> {other}.g_stream{convert}");
        }
    }
    let size = Size {
        agents: middlewares.len(),
        kills: 3,
        ..SMALL
    };
    Agents::new(site, size, None, &head, |at| {
        (AGENT, format!("middleware {};", middlewares[at]))
    })
    .run();
}

/// Filters what arrives at both ends of the cable from the other one.
fn filter(cable: &Cable, name: &str, rule: &str) -> Result<(), String> {
    let [here, there] = ADDRESSES;
    for (host, other) in [(cable.name(0), there), (cable.name(1), here)] {
        let text = format!(
            "add table inet {name}; \
             add chain inet {name} input {{ type filter hook input priority 0; }}; \
             add rule inet {name} input ip saddr {other} {rule}"
        );
        run("ip", &["netns", "exec", host, "nft", &text])?;
    }
    Ok(())
}

/// Makes sure that packets can be filtered.
pub(crate) fn filters() -> Result<(), String> {
    if run("nft", &["--version"]).is_ok() {
        return Ok(());
    }
    install(&["nftables"])
}

/// Lets the cable lose a tenth of the packets: by netem, or by a filter where the system has no netem.
fn lose(cable: &Cable) -> Result<(), String> {
    let by_netem = [cable.name(0), cable.name(1)].map(|host| {
        let within = ["netns", "exec", host, "tc", "qdisc", "add", "dev", host];
        let how = ["root", "netem", "loss", "10%", "delay", "2ms", "1ms"];
        run("ip", &[&within[..], &how].concat())
    });
    if by_netem.iter().all(Result::is_ok) {
        return Ok(());
    }
    filter(cable, "loss", "numgen random mod 10 == 0 drop")
}

/// Cuts off what the agents say for five seconds. The link of `rcdeploy` stays, which would end the agents
/// of a host that it has lost.
fn cut(cable: &Cable) {
    filter(cable, "cut", "meta l4proto udp drop").expect("a filter");
    std::thread::sleep(Duration::from_secs(5));
    for host in [cable.name(0), cable.name(1)] {
        let delete = ["netns", "exec", host, "nft", "delete table inet cut"];
        run("ip", &delete).expect("to remove a filter");
    }
}

/// Half of the agents on another host: within a host over shared memory where that reaches all, else
/// over DDS. The cable loses a tenth of the packets once the programs are on the other host.
fn on_two_hosts(test: &str, size: Size, domain: u32) {
    let Some(cable) = cable(test) else { return };
    if let Err(reason) = filters() {
        return skipped(test, &reason);
    }
    let mut site = Site::new("world_hosts");
    let robot = match Robot::start(&site, &cable) {
        Ok(robot) => robot,
        Err(reason) => return skipped(test, &reason),
    };
    site.within = ["ip", "netns", "exec", cable.name(0)]
        .map(str::to_owned)
        .to_vec();
    let head = format!(
        "middleware auto;\n    middleware dds {{ domain {domain}; }};\n    Host robot {{ address \"10.77.0.2\"; user \"root\"; }};"
    );
    let host = |at: usize| (at % 2 == 1).then(|| "host robot;".to_owned());
    let mut agents = Agents::new(site, size, Some(&cable), &head, |at| {
        (AGENT, host(at).unwrap_or_default())
    });
    agents.up = vec![format!("RC_SSH={}", robot.ssh())];
    agents.stranger = Some(Place::among_all(domain));
    agents.run();
}

#[test]
fn agents_on_two_hosts_end_equal() {
    let test = "agents_on_two_hosts_end_equal";
    on_two_hosts(test, Size { cuts: 1, ..SMALL }, 213);
}
