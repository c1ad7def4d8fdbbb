//! `cargo xtask bench convert`: printed functions compared with hand-written ones, the programs of
//! connections with printed functions, the check of a network that converts, connections that
//! convert with plain ones and with a relay of ROS 2, and the size of the linked code.

use crate::figure::{BUILD, mark};
use crate::pair::{Pair, Row, Times};
use crate::programs::{Failure, Program, cargo, finish, output, root, target};
use crate::rclpy::variables;
use crate::variant::check_built;
use object::{Object as _, ObjectSymbol as _};
use rc_deploy_network::Profile;
use rc_management::Client;
use rc_management::component::{Request, Status};
use rc_test_support::python;
use std::borrow::Cow;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

/// The limit for a build and a run.
const LIMIT: Duration = Duration::from_mins(15);
/// The limit for an answer of management.
const ANSWER: Duration = Duration::from_secs(2);
/// The limit for a line of a program of rclpy.
const LINE: Duration = Duration::from_mins(2);
/// The limit for its end.
const END: Duration = Duration::from_secs(5);
/// Blocks of each row, for each of both pairs.
const BLOCKS: usize = 40;
/// Points in millimetres (right, ahead, up) become metres (ahead, left, up).
const PLAN: &str = "Clouds=0i:q[{3f!|d@1&1e3;n@0;d$1&1e3;d@2&1e3;=$0&$2&$3}]";
/// The expression of a relay of ROS 2.
const EXPRESSION: &str =
    "Polygon(points=[Point32(x=p.y / 1000, y=-p.x / 1000, z=p.z / 1000) for p in m.points])";
const DOMAIN: &str = "93";
/// A part of the symbols of the code that converts.
const CODE: &str = "rc_conversion";

/// Measures everything; with `smoke`, few messages of the programs of the tests, and not what has a build
/// of its own.
pub(crate) fn run(smoke: bool) -> Result<(), Failure> {
    let profile = if smoke {
        Profile::Dev
    } else {
        Profile::Release
    };
    let folder = target()?.join(profile.folder());
    if smoke {
        for program in ["ping", "pong", "speech_server"] {
            check_built(&folder.join(program))?;
        }
        println!("| ratio | goal | measured | |\n|---|---|---|---|");
    } else {
        // A workspace of its own: its build script prints the functions.
        let words = "run --release --quiet --manifest-path xtask/bench/convert/Cargo.toml";
        let words: Vec<&str> = words.split(' ').collect();
        print!("{}", output(cargo(&words)?, LIMIT)?);
        let words = "build --release --workspace --bin ping --bin pong --bin speech_server";
        finish(cargo(&words.split(' ').collect::<Vec<_>>())?, BUILD)?;
    }
    let (blocks, share) = if smoke { (3, 0.2) } else { (BLOCKS, 1.0) };
    let small = connection(profile, (64, 500), blocks, share)?;
    row("connection of 64 B that converts / plain, p50", 1.25, small);
    let large = connection(profile, (1024 * 1024, 50), blocks, share)?;
    let what = "connection of 1 MiB of points that converts / plain, p50";
    row(what, 1.3, large);
    if let Some(python) = python::ros("a relay of rclpy") {
        let relay = relay(python, if smoke { 20 } else { 2000 })?;
        let what = "connection of 64 B that converts / the same by a relay in rclpy, p50";
        row(what, 0.05, [small[0], relay]);
    }
    let linked = code(&folder.join("speech_server"))?;
    let other = code(&folder.join("pong"))?;
    println!(
        "| code of conversions in a component that gets no values, bytes | 0 | {linked}; {other} in one that does | {} |",
        mark(linked == 0)
    );
    Ok(())
}

fn row(what: &str, goal: f64, [ours, theirs]: [f64; 2]) {
    let ratio = ours / theirs;
    println!(
        "| {what} | ≤ {goal} | {ratio:.2}: {ours:.1} µs and {theirs:.1} µs | {} |",
        mark(ratio <= goal)
    );
}

/// The medians of a connection that converts and of a plain one, in microseconds. They take turns.
fn connection(
    profile: Profile,
    (size, count): (usize, usize),
    blocks: usize,
    share: f64,
) -> Result<[f64; 2], Failure> {
    let row = Row {
        name: Cow::Borrowed("points"),
        kind: "cloud",
        size,
        count,
    };
    let mut pairs = [
        Pair::generated_with("converting", profile, [&["--convert", PLAN], &[]])?,
        Pair::generated_with("plain", profile, [&[], &[]])?,
    ];
    let mut times = [Times::default(), Times::default()];
    for block in 0..blocks {
        for turn in 0..2 {
            let at = (block + turn) % 2;
            times[at].add(pairs[at].block(&row, share)?);
        }
    }
    let directory = pairs[0].directory().ok_or("no network")?;
    let mut management = Client::connect(&directory.socket("pong"), ANSWER)?;
    let status: Status = management.call(&Request::Status, ANSWER)?;
    let mut slots = status.slots.iter();
    let slot = slots.find(|slot| slot.name == "Clouds");
    let converted = slot.and_then(|slot| slot.converted.as_ref());
    let converted = converted.map_or(0, |converted| converted.messages);
    if converted < times[0].len() as u64 {
        return Err(format!("{converted} of {} messages were converted", times[0].len()).into());
    }
    Ok(times.each_mut().map(|times| times.quantile(0.5)))
}

/// The median from publishing in rclpy until a subscriber has the relayed message, in microseconds.
fn relay(python: &Path, count: usize) -> Result<f64, Failure> {
    let network = format!("relay_{}", std::process::id());
    let start = |program: &str, args: &[&str]| {
        let mut command = Command::new(python);
        let path = root().join("middleware/ros2/tests/rclpy").join(program);
        command
            .arg("-B")
            .arg(path)
            .args([&network, DOMAIN])
            .args(args);
        Program::spawn({
            command.envs(variables(DOMAIN));
            command
        })
    };
    let relay = start("relay.py", &["points", "others", EXPRESSION])?;
    relay.read_line(LINE)?;
    let sender = start("relayed.py", &["points", "others", &count.to_string()])?;
    let mut times = Times::default();
    times.add(crate::pair::times(&sender.read_line(LINE)?)?);
    sender.stop(END)?;
    relay.stop(END)?;
    Ok(times.quantile(0.5))
}

/// The bytes of the functions of a program that convert.
fn code(program: &Path) -> Result<u64, Failure> {
    let bytes = std::fs::read(program)?;
    let file = object::File::parse(&*bytes)?;
    let own = file.symbols().filter(|symbol| {
        let name = symbol.name().unwrap_or_default();
        name.contains(CODE)
    });
    Ok(own.map(|symbol| symbol.size()).sum())
}
