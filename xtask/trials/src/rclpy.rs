//! A component compared with ROS 2 itself: rclpy on Fast DDS, of the wheels of ROS 2 Jazzy on
//! `PyPI`, with its default settings. `bench rclpy` compares round trips with those of rclpy alone
//! and counts images; `soak rclpy` publishes images while peers come and go.

use crate::pair::{Network, quantile};
use crate::programs::{Failure, Program, root};
use crate::usage::own_memory;
use crate::variant::build_interop;
use rc_deploy_network::Profile;
use rc_management::Client;
use rc_management::component::{Request, Status};
use rc_test_support::python;
use std::collections::BTreeMap;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

/// The domain of both.
const DOMAIN: &str = "92";
/// Sizes of round trips, in bytes.
const SIZES: [&str; 3] = ["64", "65536", "1048576"];
/// At p50 a round trip between rclpy and a component may take so much of one between rclpy and
/// rclpy.
const GOAL: f64 = 0.5;
/// The share of images that a best-effort subscriber has to receive, in percent.
const SEEN: u64 = 95;
/// The limit for a line of a program: a round of the largest size takes some ten milliseconds.
const LINE: Duration = Duration::from_mins(2);
/// The limit for the end of a program.
const END: Duration = Duration::from_secs(5);
/// The limit for an answer of management.
const ANSWER: Duration = Duration::from_secs(2);
/// The bytes of an image, and the pause between two in milliseconds.
const IMAGE: u64 = 1 << 20;
const PERIOD: u32 = 33;
/// Memory that may come between the second and the last quarter of a soak, in MB.
const GROWTH: f64 = 1.0;
/// The limit of growth in a short soak. Fast DDS counts a killed peer as alive for 20 s, so the
/// memory of such peers grows at first.
const EARLY_GROWTH: f64 = 8.0;
/// From this length on, in seconds, a soak is not short.
const LONG: u64 = 80;

/// Environment variables of a program with rclpy: the domain, this machine only, and Fast DDS.
pub(crate) fn variables(domain: &str) -> [(&'static str, &str); 3] {
    [
        ("ROS_DOMAIN_ID", domain),
        ("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST"),
        ("RMW_IMPLEMENTATION", "rmw_fastrtps_cpp"),
    ]
}

/// Starts a program of `middleware/ros2/tests/rclpy`.
fn rclpy(python: &Path, program: &str, network: &str, args: &[&str]) -> Result<Program, Failure> {
    let mut command = Command::new(python);
    // Names of ROS 2 have no `-`.
    let network = network.replace('-', "_");
    let path = root().join("middleware/ros2/tests/rclpy").join(program);
    command
        .arg("-B")
        .arg(path)
        .args([network.as_str(), DOMAIN])
        .args(args)
        .envs(variables(DOMAIN));
    Program::spawn(command)
}

/// Starts the component, and waits until it answers.
fn component(path: &Path, network: &Network) -> Result<Program, Failure> {
    let domain = format!("ros2.domain={DOMAIN}");
    let mut command = Command::new(path);
    // As for programs of rclpy: both then use the known ports of the domain instead of multicast.
    command
        .args(["--network", &network.name, "--log", "error"])
        .args(["--set-middleware", &domain])
        .env("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        .process_group(0);
    let program = Program::spawn(command)?;
    let end = Instant::now() + LINE;
    while Client::connect(&network.directory.socket("interop"), ANSWER).is_err() {
        if Instant::now() > end {
            return Err("the component does not start".into());
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    Ok(program)
}

/// Microseconds of round trips, by the kind of message.
type Times = BTreeMap<String, Vec<u64>>;

/// Measures all sizes with a partner that is there.
fn measure(python: &Path, network: &str, rounds: usize, times: &mut Times) -> Result<(), Failure> {
    let rounds = rounds.to_string();
    let args = [&[rounds.as_str()], &SIZES[..]].concat();
    let measuring = rclpy(python, "measure.py", network, &args)?;
    for _ in 0..2 * SIZES.len() {
        let line = measuring.read_line(LINE)?;
        let mut words = line.split(' ');
        let what = [words.next(), words.next()].map(Option::unwrap_or_default);
        let row = times.entry(what.join(" ")).or_default();
        for word in words {
            row.push(word.parse()?);
        }
    }
    measuring.stop(END)
}

/// Begins to publish `count` images at 30 Hz to a subscriber of rclpy, which prints how many it has
/// received at the end.
fn publish_images(
    python: &Path,
    network: &Network,
    reliability: &str,
    count: u64,
) -> Result<Program, Failure> {
    let args = [reliability, &count.to_string()];
    let images = rclpy(python, "images.py", &network.name, &args)?;
    while images.read_line(LINE)? != "met" {}
    let mut management = Client::connect(&network.directory.socket("interop"), ANSWER)?;
    // The component also has to find the subscriber.
    let end = Instant::now() + LINE;
    loop {
        let status: Status = management.call(&Request::Status, ANSWER)?;
        let mut slots = status.slots.iter();
        if slots.any(|slot| slot.name == "Images" && slot.peers > 0) {
            break;
        }
        if Instant::now() > end {
            return Err("the component does not find the subscriber".into());
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    let period = Request::Period { ms: PERIOD.into() };
    management.call::<serde_json::Value>(&period, ANSWER)?;
    let changes = [("images.bytes", IMAGE), ("images.count", count)];
    let changes = changes.map(|(path, value)| (path.to_owned(), value.into()));
    let changes = Request::ParametersSet {
        changes: changes.into_iter().collect(),
    };
    management.call::<serde_json::Value>(&changes, ANSWER)?;
    Ok(images)
}

/// Prints how many of `count` images arrive, repaired and not.
fn count_images(python: &Path, program: &Path, count: u64) -> Result<(), Failure> {
    println!("\n| images of 1 MiB at 30 Hz | received | of | goal |\n|---|---|---|---|");
    for (reliability, goal) in [("reliable", 100), ("best_effort", SEEN)] {
        let network = Network::new("images")?;
        let component = component(program, &network)?;
        let images = publish_images(python, &network, reliability, count)?;
        let line = images.read_line(LINE)?;
        images.stop(END)?;
        component.stop(END)?;
        let received = line.strip_prefix("received ").unwrap_or(&line);
        println!("| {reliability} | {received} | {count} | {goal} % |");
    }
    Ok(())
}

/// Prints how long the first calls of new clients take, which call as soon as they find the
/// service.
fn first_calls(python: &Path, program: &Path, count: usize) -> Result<(), Failure> {
    let network = Network::new("first")?;
    let component = component(program, &network)?;
    let calls = rclpy(python, "first.py", &network.name, &[&count.to_string()])?;
    let mut times: Vec<u64> = Vec::new();
    for _ in 0..count {
        let line = calls.read_line(LINE)?;
        times.push(line.strip_prefix("call ").unwrap_or_default().parse()?);
    }
    calls.stop(END)?;
    component.stop(END)?;
    let [median, longest] = [0.5, 1.0].map(|part| quantile(&mut times, part));
    println!(
        "\nFirst calls of {count} clients: p50 {median} ms, longest {longest} ms (goal: 200 ms)"
    );
    Ok(())
}

/// Prints round trips of rclpy with a component and those of rclpy with rclpy, measured in turns,
/// first calls, and how many images arrive.
pub(crate) fn bench(blocks: usize, rounds: usize) -> Result<(), Failure> {
    let Some(python) = python::ros("round trips with rclpy") else {
        return Ok(());
    };
    let program = build_interop(Profile::Release)?;
    let (mut ours, mut theirs) = (Times::new(), Times::new());
    for _ in 0..blocks {
        let network = Network::new("rclpy")?;
        let component = component(&program, &network)?;
        measure(python, &network.name, rounds, &mut ours)?;
        component.stop(END)?;
        let alone = format!("{}-alone", network.name);
        let echo = rclpy(python, "echo.py", &alone, &[])?;
        echo.read_line(LINE)?;
        measure(python, &alone, rounds, &mut theirs)?;
        echo.stop(END)?;
    }
    println!(
        "| round trip of rclpy, µs | with a component, p50 / p99 | with rclpy, p50 / p99 | p50 ratio | goal |"
    );
    println!("|---|---|---|---|---|");
    for (what, ours) in &mut ours {
        let theirs = theirs.get_mut(what).ok_or("a row is missing")?;
        let [ours, theirs] =
            [ours, theirs].map(|times| [0.5, 0.99].map(|part| quantile(times, part)));
        let ratio = ours[0] as f64 / theirs[0] as f64;
        println!(
            "| {what} B | {} / {} | {} / {} | {ratio:.2} | {GOAL:.2} |",
            ours[0], ours[1], theirs[0], theirs[1]
        );
    }
    first_calls(python, &program, 20)?;
    count_images(python, &program, 50 * blocks as u64)
}

/// A soak of `seconds`: images at 30 Hz to a reliable subscriber, while another node of rclpy comes
/// and goes, in turns by a clean end and killed. An error: an image was lost, or memory has grown
/// from the second to the last quarter.
pub(crate) fn soak(seconds: u64, profile: Profile) -> Result<(), Failure> {
    let Some(python) = python::ros("a soak beside rclpy") else {
        return Ok(());
    };
    let program: PathBuf = build_interop(profile)?;
    let network = Network::new("peers")?;
    let component = component(&program, &network)?;
    let count = seconds * 1000 / u64::from(PERIOD);
    let images = publish_images(python, &network, "reliable", count)?;
    let end = Instant::now() + Duration::from_secs(seconds);
    let mut samples = Vec::new();
    while Instant::now() < end {
        let peer = rclpy(python, "repeat.py", &network.name, &["64"])?;
        peer.read_line(LINE)?;
        if samples.len() % 2 == 0 {
            peer.stop(END)?;
        } else {
            peer.kill()?;
        }
        samples.push(own_memory(component.pid())?);
    }
    // On a busy machine, the component publishes less often.
    let received = images.read_line(LINE + Duration::from_secs(seconds));
    component.stop(END)?;
    let peers = samples.len();
    let median = |number: usize, of: usize| {
        let part = &samples[peers * number / of..peers * (number + 1) / of];
        quantile(&mut part.to_vec(), 0.5)
    };
    let (second, last) = (median(1, 4), median(3, 4));
    let each = (last - second) * 1000.0 / (peers as f64 / 2.0).max(1.0);
    let parts: Vec<String> = (0..8).map(|n| format!("{:.1}", median(n, 8))).collect();
    println!(
        "{seconds} s, {peers} peers came and went; MB in the second → last quarter: {second:.2} → {last:.2}, \
         {each:.1} kB for each peer; by eighths {}",
        parts.join(", ")
    );
    let received = received?;
    println!("images: {received} of {count}");
    if received != format!("received {count}") {
        return Err(format!("images were lost: {received} of {count}").into());
    }
    let growth = if seconds < LONG { EARLY_GROWTH } else { GROWTH };
    if last > second + growth {
        return Err(format!("memory grew from {second:.2} to {last:.2} MB").into());
    }
    Ok(())
}
