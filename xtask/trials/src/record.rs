//! `cargo xtask bench record`: the losses and costs of `rcdeploy record` at ten topics of 1 kHz and
//! two of 30 images a second, compared with `cat` of the same bytes.

use crate::bench::machine;
use crate::figure::BUILD;
use crate::pair::Network;
use crate::programs::{Failure, Program, cargo, finish, output, target};
use crate::usage::processor_time;
use bench_protocol::soak::WITHOUT_IMAGES;
use rc_deploy_network::Profile;
use rc_record::bag::Info;
use rustix::process::{Pid, Signal, kill_process};
use std::io::Read as _;
use std::os::unix::process::CommandExt as _;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

/// The number of publishers of ticks, and how many of them publish images, too.
const SOURCES: usize = 10;
const WITH_IMAGES: usize = 2;
/// The limit until a component prints its first counts.
const START: Duration = Duration::from_secs(20);
/// The limit until the recorder has written something, and for its end.
const RECORDER: Duration = Duration::from_secs(30);
/// The pause between two looks.
const LOOK: Duration = Duration::from_millis(50);
/// Unit in which the kernel counts processor time of ended processes.
const TICKS_A_SECOND: f64 = 100.0;

/// Measures for half a minute; with `smoke`, for a moment with few sources and the programs of the
/// test run.
pub(crate) fn run(smoke: bool) -> Result<(), Failure> {
    let (profile, sources, time) = if smoke {
        (Profile::Dev, 2, Duration::from_secs(2))
    } else {
        let words = "build --release --workspace --bin soak_source --bin rcdeploy";
        finish(cargo(&words.split(' ').collect::<Vec<_>>())?, BUILD)?;
        (Profile::Release, SOURCES, Duration::from_secs(30))
    };
    println!("{}\n", machine());
    let folder = tempfile::tempdir()?;
    let network = Network::new("record")?;
    let programs = target()?.join(profile.folder());
    let running = publishers(&network, &programs, sources)?;
    let file = folder.path().join("x.mcap");
    let recorded = record(&network, &programs.join("rcdeploy"), &file, time)?;
    drop(running);
    let info = Info::read(&file)?;
    let bytes: u64 = info.topics.values().map(|topic| topic.bytes).sum();
    let copied = cat(folder.path(), bytes)?;
    let topic = |end: &str| {
        let all = info.topics.iter().filter(|(name, _)| name.ends_with(end));
        let topics: Vec<_> = all.map(|(_, topic)| topic).collect();
        let count: u64 = topics.iter().map(|topic| topic.count).sum();
        let size: u64 = topics.iter().map(|topic| topic.bytes).sum();
        (topics.len(), count, size.checked_div(count).unwrap_or(0))
    };
    println!("| topics | messages a second, each | bytes a message |");
    println!("|---:|---:|---:|");
    for (topics, count, size) in [topic("/tick"), topic("/image")] {
        let rate = count as f64 / topics.max(1) as f64 / recorded.time.as_secs_f64();
        println!("| {topics} | {rate:.0} | {size} |");
    }
    let lost = &info.metadata["recording"]["lost"];
    let seconds = recorded.time.as_secs_f64();
    println!(
        "\nlost {lost}; {:.1} MB of messages a second; processor {:.1} % of one; for {:.1} MB the recorder takes {:.2} s of it, `cat` of as many bytes {:.2} s",
        bytes as f64 / 1e6 / seconds,
        recorded.processor.as_secs_f64() / seconds * 100.0,
        bytes as f64 / 1e6,
        recorded.processor.as_secs_f64(),
        copied.as_secs_f64(),
    );
    if info.messages() == 0 {
        return Err("nothing was recorded".into());
    }
    if !smoke && lost != "0" {
        eprintln!("xtask: a goal was missed: {lost} messages were lost");
    }
    Ok(())
}

/// Starts the publishers, each with topics of its own.
fn publishers(network: &Network, programs: &Path, count: usize) -> Result<Vec<Program>, Failure> {
    let mut running = Vec::new();
    for number in 0..count {
        let name = format!("source{number}");
        let mut command = Command::new(programs.join("soak_source"));
        command.args([
            "--network",
            &network.name,
            "--name",
            &name,
            "--log",
            "error",
        ]);
        for slot in ["Ticks", "Images", "Echo"] {
            let address = format!("{slot}={}/{name}/{slot}", network.name);
            command.args(["--bind", &address]);
        }
        if number >= WITH_IMAGES {
            command.env(WITHOUT_IMAGES, "1");
        }
        command.process_group(0);
        let program = Program::spawn(command)?;
        program.read_line(START)?;
        running.push(program);
    }
    Ok(running)
}

/// A recording, from its first chunk on.
struct Recorded {
    time: Duration,
    processor: Duration,
}

fn record(
    network: &Network,
    rcdeploy: &Path,
    file: &Path,
    time: Duration,
) -> Result<Recorded, Failure> {
    let mut command = Command::new(rcdeploy);
    command
        .args(["record", &network.name, "--no-calls", "-o"])
        .arg(file);
    let recorder = Program::spawn(command)?;
    let begin = Instant::now();
    while !std::fs::metadata(file).is_ok_and(|about| about.len() > 1 << 10) {
        if begin.elapsed() > RECORDER {
            return Err("the recorder writes nothing".into());
        }
        std::thread::sleep(LOOK);
    }
    std::thread::sleep(time);
    let recorded = Recorded {
        time: begin.elapsed(),
        processor: processor_time(recorder.pid())?,
    };
    let pid = i32::try_from(recorder.pid()).ok().and_then(Pid::from_raw);
    kill_process(pid.ok_or("no process")?, Signal::INT)?;
    let end = Instant::now() + RECORDER;
    // Its last line has the counts.
    while !recorder
        .read_line(end.saturating_duration_since(Instant::now()))?
        .contains("lost")
    {}
    Ok(recorded)
}

/// The processor time of `cat` of a file with so many bytes into another one.
fn cat(folder: &Path, bytes: u64) -> Result<Duration, Failure> {
    let (from, to) = (folder.join("from"), folder.join("to"));
    let mut file = std::fs::File::create(&from)?;
    std::io::copy(&mut std::io::repeat(7).take(bytes), &mut file)?;
    let script = "cat \"$1\" > \"$2\"; cat /proc/$$/stat";
    let mut command = Command::new("sh");
    command.args(["-c", script, "sh"]).args([from, to]);
    let stat = output(command, RECORDER)?;
    // After the name: the times of children are the 14th and the 15th.
    let rest = stat.rsplit_once(')').map_or("", |(_, rest)| rest);
    let times = rest.split_whitespace().skip(13).take(2);
    let ticks: u64 = times.filter_map(|time| time.parse::<u64>().ok()).sum();
    Ok(Duration::from_secs_f64(ticks as f64 / TICKS_A_SECOND))
}
