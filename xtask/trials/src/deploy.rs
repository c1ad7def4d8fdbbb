//! `cargo xtask bench deploy`: the time until many small programs run and have ended, and the
//! memory of their supervisor: rcdeploy compared with supervisord, with a shell script as the lower
//! bound. All three start the same executable with the same addresses. Then half of a network is
//! killed at once, see `mass_kill`.

mod mass_kill;

use crate::bench::machine;
use crate::figure::BUILD;
use crate::pair::quantile;
use crate::programs::{END, Failure, LOOK, Running, cargo, finish, root, target};
use crate::pypi;
use crate::usage::memory;
use rc_deploy_network::Profile;
use rustix::process::{Pid, Signal, kill_process};
use std::fmt::Write as _;
use std::io::{BufRead as _, BufReader};
use std::os::unix::net::UnixDatagram;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// The smallest component with an interface: no period.
const PROGRAM: &str = "speech_server";
/// How many programs run at once.
const SIZES: [usize; 2] = [20, 100];
const ROUNDS: usize = 7;
/// How many programs run at once in a few more rounds, without supervisord, and the limit for
/// starting and ending them, as a multiple of the time of the shell script.
const LARGE: (usize, f64) = (300, 1.5);
const LARGE_ROUNDS: usize = 3;
/// How many of how many are killed at once.
const KILLED: (usize, usize) = (100, 200);
/// The goal for so many components on two cores.
const GOAL: (usize, Duration) = (100, Duration::from_secs(3));
/// No start and no end of a network takes longer.
const LIMIT: Duration = Duration::from_mins(3);
/// The package of supervisord on `PyPI`.
const PACKAGE: &str = "supervisor==4.3.0";

/// A starter of programs.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Starter {
    Rcdeploy,
    Supervisord,
    Shell,
}

/// One start and one end.
struct Cycle {
    up: Duration,
    down: Duration,
    /// Memory of the starter without its programs, in MB.
    memory: f64,
}

/// Runs the benchmark. `smoke` is one round of a few programs, with the unoptimised executables
/// that the test run has built.
pub(crate) fn run(smoke: bool) -> Result<(), Failure> {
    let profile = if smoke {
        Profile::Dev
    } else {
        Profile::Release
    };
    if !smoke {
        build(profile)?;
    }
    let supervisord = pypi::install(PACKAGE, "supervisord");
    println!("{}\n", machine());
    let starters: &[Starter] = match &supervisord {
        Ok(_) => &[Starter::Rcdeploy, Starter::Supervisord, Starter::Shell],
        Err(error) => {
            println!("skipped: supervisord: {error}\n");
            &[Starter::Rcdeploy, Starter::Shell]
        }
    };
    let sizes = if smoke {
        vec![(5, 1, starters)]
    } else {
        let mut sizes: Vec<_> = SIZES.map(|size| (size, ROUNDS, starters)).into();
        sizes.push((LARGE.0, LARGE_ROUNDS, &[Starter::Rcdeploy, Starter::Shell]));
        sizes
    };
    println!(
        "| programs | started by | all running, s | all ended, s | memory of the starter, MB | the same a program, kB |"
    );
    println!("|---|---|---|---|---|---|");
    let (mut missed, mut first) = (Vec::new(), Duration::ZERO);
    for (count, rounds, starters) in sizes {
        let mut turns: Vec<Vec<Cycle>> = starters.iter().map(|_| Vec::new()).collect();
        // In turns, so that a slow minute of the machine slows all.
        for _ in 0..rounds {
            for (&starter, turns) in starters.iter().zip(&mut turns) {
                let place = Place::new(count, profile, supervisord.as_deref().ok())?;
                turns.push(place.turn(starter)?);
            }
        }
        let mut totals = Vec::new();
        for (&starter, turns) in starters.iter().zip(&turns) {
            let [up, down] = [|turn: &Cycle| turn.up, |turn: &Cycle| turn.down]
                .map(|of| quantile(&mut turns.iter().map(of).collect::<Vec<_>>(), 0.5));
            let mut memory: Vec<f64> = turns.iter().map(|turn| turn.memory).collect();
            let memory = quantile(&mut memory, 0.5);
            println!(
                "| {count} | {} | {} | {} | {memory:.1} | {:.0} |",
                starter.name(),
                spread(up, turns.iter().map(|turn| turn.up)),
                spread(down, turns.iter().map(|turn| turn.down)),
                memory * 1000.0 / count as f64,
            );
            totals.push((starter, (up + down).as_secs_f64()));
            if starter == Starter::Rcdeploy && (smoke || count == KILLED.0) {
                first = up;
            }
            if starter == Starter::Rcdeploy && count == GOAL.0 && up >= GOAL.1 {
                missed.push(format!("{count} components are not up within {:?}", GOAL.1));
            }
        }
        let total = |of| totals.iter().find(|(starter, _)| *starter == of);
        if count == LARGE.0
            && let (Some((_, ours)), Some((_, lowest))) =
                (total(Starter::Rcdeploy), total(Starter::Shell))
            && *ours > LARGE.1 * lowest
        {
            missed.push(format!(
                "{count} components take {ours:.2} s up and down, the shell script {lowest:.2} s"
            ));
        }
    }
    println!();
    let (killed, count) = if smoke { (20, 40) } else { KILLED };
    if !mass_kill::run(count, killed, profile, first)? && !smoke {
        missed.push(mass_kill::MISSED.to_owned());
    }
    for missed in missed {
        eprintln!("xtask: {missed}");
    }
    Ok(())
}

/// Measures the deaths of many alone, and the first start of as many.
pub(crate) fn deaths() -> Result<(), Failure> {
    let profile = Profile::Release;
    build(profile)?;
    println!("{}\n", machine());
    let mut firsts = Vec::new();
    for _ in 0..LARGE_ROUNDS {
        let place = Place::new(KILLED.0, profile, None)?;
        firsts.push(place.turn(Starter::Rcdeploy)?.up);
    }
    if !mass_kill::run(KILLED.1, KILLED.0, profile, quantile(&mut firsts, 0.5))? {
        eprintln!("xtask: {}", mass_kill::MISSED);
    }
    Ok(())
}

fn build(profile: Profile) -> Result<(), Failure> {
    let words = format!(
        "build --profile {} --workspace --bin speech_server --bin rcdeploy",
        profile.word()
    );
    finish(cargo(&words.split(' ').collect::<Vec<_>>())?, BUILD).map(drop)
}

/// A median, and the shortest and the longest.
fn spread(median: Duration, all: impl Iterator<Item = Duration> + Clone) -> String {
    let seconds = |time: Option<Duration>| time.unwrap_or_default().as_secs_f64();
    format!(
        "{:.2} ({:.2}–{:.2})",
        median.as_secs_f64(),
        seconds(all.clone().min()),
        seconds(all.max())
    )
}

impl Starter {
    fn name(self) -> String {
        match self {
            Self::Rcdeploy => "rcdeploy".to_owned(),
            Self::Supervisord => PACKAGE.replace("supervisor==", "supervisord "),
            Self::Shell => "sh".to_owned(),
        }
    }
}

/// The folder of one network.
struct Place<'s> {
    folder: TempDir,
    count: usize,
    profile: Profile,
    supervisord: Option<&'s Path>,
    /// More fields of each component, for rcdeploy.
    fields: String,
    /// The socket on which programs without a link report readiness (`sd_notify`).
    notified: UnixDatagram,
}

impl<'s> Place<'s> {
    fn new(count: usize, profile: Profile, supervisord: Option<&'s Path>) -> Result<Self, Failure> {
        let folder = tempfile::Builder::new()
            .prefix("rc-bench-")
            .tempdir_in("/dev/shm")?;
        for name in ["run", "state"] {
            std::fs::create_dir(folder.path().join(name))?;
        }
        let notified = UnixDatagram::bind(folder.path().join("notify"))?;
        Ok(Self {
            folder,
            count,
            profile,
            supervisord,
            fields: String::new(),
            notified,
        })
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Starts the starter, which prints errors to `starter.log`.
    fn command(&self, starter: Starter) -> Result<Command, Failure> {
        let mut command = match starter {
            Starter::Rcdeploy => self.rcdeploy()?,
            Starter::Supervisord => self.supervisord()?,
            Starter::Shell => self.shell()?,
        };
        let log = std::fs::File::create(self.path("starter.log"))?;
        command
            .env("CARGO_TARGET_DIR", target()?)
            .env("XDG_RUNTIME_DIR", self.path("run"))
            .env("XDG_STATE_HOME", self.path("state"))
            .stdin(Stdio::null())
            .stderr(log);
        Ok(command)
    }

    /// Starts all programs, waits until all run, stops all.
    fn turn(&self, starter: Starter) -> Result<Cycle, Failure> {
        let mut command = self.command(starter)?;
        if starter == Starter::Rcdeploy {
            command.stdout(Stdio::piped());
        } else {
            command
                .stdout(Stdio::null())
                .env("NOTIFY_SOCKET", self.path("notify"));
        }
        let start = Instant::now();
        let mut child = Running(command.spawn()?);
        let outcome = match starter {
            Starter::Rcdeploy => reported_up(&mut child.0),
            _ => self.notified(),
        };
        let up = start.elapsed();
        outcome.map_err(|error| {
            let log = std::fs::read_to_string(self.path("starter.log")).unwrap_or_default();
            format!("{}: {error}\n{log}", starter.name())
        })?;
        let pid = child.0.id();
        let memory = memory_of(pid, starter)?;
        let start = Instant::now();
        kill_process(Pid::from_child(&child.0), Signal::TERM)?;
        if !child.ended_within(LIMIT.max(END)) {
            return Err(format!("{} does not end", starter.name()).into());
        }
        Ok(Cycle {
            up,
            down: start.elapsed(),
            memory,
        })
    }

    /// An executable of the profile.
    fn executable(&self, name: &str) -> Result<PathBuf, Failure> {
        let path = target()?.join(self.profile.folder()).join(name);
        Ok(path.canonicalize()?)
    }

    fn program(&self) -> Result<String, Failure> {
        Ok(self.executable(PROGRAM)?.display().to_string())
    }

    /// Arguments with the names and addresses that rcdeploy gives.
    fn arguments(number: usize) -> String {
        format!("--network bench --name c{number} --bind Speech=bench/c{number}/Speech")
    }

    fn rcdeploy(&self) -> Result<Command, Failure> {
        let folder = root().canonicalize()?.join("components").join(PROGRAM);
        let cdsl = folder.join(PROGRAM).with_extension("cdsl");
        let mut text = "Deployment bench\n{\n".to_owned();
        for number in 0..self.count {
            let (cdsl, fields) = (cdsl.display(), &self.fields);
            writeln!(
                text,
                "    Component c{number} {{ cdsl \"{cdsl}\"; {fields}}};"
            )?;
        }
        let file = self.path("bench.ddsl");
        std::fs::write(&file, text + "};\n")?;
        let mut command = Command::new(self.executable("rcdeploy")?);
        command
            .args(["up", "--format", "json", "--profile", self.profile.word()])
            .arg(file);
        Ok(command)
    }

    fn supervisord(&self) -> Result<Command, Failure> {
        let folder = self.folder.path().display();
        let mut text = format!(
            "[supervisord]\nnodaemon=true\nlogfile={folder}/supervisord.log\npidfile={folder}/pid\nchildlogdir={folder}\n"
        );
        let program = self.program()?;
        for number in 0..self.count {
            let arguments = Self::arguments(number);
            // supervisord takes a program for running as soon as it is started.
            writeln!(
                text,
                "[program:c{number}]\ncommand={program} {arguments}\nstartsecs=0\nredirect_stderr=true"
            )?;
        }
        // supervisord stops one group after the other; one group makes it stop all programs
        // together.
        let all: Vec<String> = (0..self.count).map(|number| format!("c{number}")).collect();
        writeln!(text, "[group:all]\nprograms={}", all.join(","))?;
        let file = self.path("supervisord.conf");
        std::fs::write(&file, text)?;
        let mut command = Command::new(self.supervisord.ok_or("there is no supervisord")?);
        command.arg("-c").arg(file);
        Ok(command)
    }

    fn shell(&self) -> Result<Command, Failure> {
        let folder = self.folder.path().display();
        let program = self.program()?;
        let mut text = "trap 'kill $all' TERM\n".to_owned();
        for number in 0..self.count {
            let arguments = Self::arguments(number);
            writeln!(
                text,
                "{program} {arguments} >{folder}/c{number}.log 2>&1 & all=\"$all $!\""
            )?;
        }
        // The first `wait` ends with the signal, the second one with the last program.
        text += "wait\nwait\n";
        let file = self.path("start.sh");
        std::fs::write(&file, text)?;
        let mut command = Command::new("sh");
        command.arg(file);
        Ok(command)
    }

    /// Waits until every program has reported readiness.
    fn notified(&self) -> Result<(), Failure> {
        let end = Instant::now() + LIMIT;
        let mut ready = 0;
        while ready < self.count {
            let left = end.saturating_duration_since(Instant::now()).max(LOOK);
            self.notified.set_read_timeout(Some(left))?;
            let mut datagram = [0; 256];
            let length = self.notified.recv(&mut datagram).map_err(|error| {
                format!("{ready} of {} programs are ready: {error}", self.count)
            })?;
            ready += usize::from(datagram[..length].starts_with(b"READY=1"));
        }
        Ok(())
    }
}

/// Waits until rcdeploy reports that the network is up; a thread reads its further output.
fn reported_up(child: &mut Child) -> Result<(), Failure> {
    let output = BufReader::new(child.stdout.take().ok_or("no pipe")?);
    let (sender, up) = std::sync::mpsc::channel();
    std::thread::spawn(move || {
        for line in output.lines().map_while(Result::ok) {
            if line.contains("\"code\":\"up\"") && sender.send(()).is_err() {
                return;
            }
        }
    });
    up.recv_timeout(LIMIT)
        .map_err(|_| "the network does not get up".into())
}

/// Proportional memory of the starter and its helpers: rcdeploy has a guard.
fn memory_of(pid: u32, starter: Starter) -> Result<f64, Failure> {
    let mut total = memory(pid)?.0;
    if starter == Starter::Rcdeploy {
        let children = std::fs::read_to_string(format!("/proc/{pid}/task/{pid}/children"))?;
        for child in children.split_whitespace() {
            let name = std::fs::read_to_string(format!("/proc/{child}/comm"))?;
            if name.trim() == "rcdeploy" {
                total += memory(child.parse()?)?.0;
            }
        }
    }
    Ok(total)
}
