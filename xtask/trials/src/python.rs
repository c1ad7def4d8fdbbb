//! `cargo xtask bench python`: components in Python compared with hand-written programs with the
//! packages `iceoryx2` and `cyclonedds` of `PyPI` and with rclpy, and the start of a component
//! compared with that of Python with `NumPy`.

use crate::bench::{BLOCKS, machine};
use crate::compare::{Peer, Ratio, met};
use crate::figure::mark;
use crate::pair::{Network, Pair, Row, quantile};
use crate::programs::{Failure, Program, root};
use crate::rclpy;
use crate::variant::{self, DDS, ROS2};
use rc_cdsl::model::Middleware;
use rc_deploy_network::Profile;
use rc_test_support::python as environments;
use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

/// The packages of the programs by hand.
const PACKAGES: &str = "numpy==2.3.4\niceoryx2==0.10.0\ncyclonedds==11.0.1\n";
/// The components.
const COMPONENTS: &str = "bench_python";
/// The goal for the ratio at p50.
const GOAL: f64 = 1.3;
/// By how much 1 MiB in place may take longer than 64 B.
const SIZE_GOAL: f64 = 1.3;
/// How much longer than Python with `NumPy` a component may take to start, in milliseconds.
const START_GOAL: f64 = 250.0;
/// How often the start is measured.
const STARTS: usize = 20;
/// The domain of hand-written programs over DDS and ROS 2.
const BY_HAND: &str = "193";
/// The limit for a start.
const LIMIT: Duration = Duration::from_secs(30);

const KIB: usize = 1024;

fn row(name: &'static str, kind: &'static str, size: usize, count: usize) -> Row {
    Row {
        name: Cow::Borrowed(name),
        kind,
        size,
        count,
    }
}

/// Measures everything; `blocks` a row, each with a `share` of its messages. `smoke` measures a
/// moment of each with the programs of the test run.
pub(crate) fn run(smoke: bool) -> Result<(), Failure> {
    let (blocks, share, starts) = if smoke {
        (2, 0.1, 2)
    } else {
        (BLOCKS, 1.0, STARTS)
    };
    let test = "components in Python beside programs by hand";
    let Some(python) = environments::packages("bench-python", PACKAGES, test) else {
        return Ok(());
    };
    let programs = |middleware| {
        if smoke {
            variant::built(COMPONENTS, middleware, Profile::Dev)
        } else {
            variant::build(COMPONENTS, middleware, Profile::Release)
        }
    };
    let shared = programs(Middleware::Iceoryx2)?;
    let dds = programs(Middleware::Dds)?;
    let ros2 = programs(Middleware::Ros2)?;
    println!("{}\n", machine());
    let mut ratios = over_iceoryx2(python, &shared, blocks, share)?;
    over_dds(python, &dds, blocks.min(20), share)?;
    if let Some(python) = environments::ros("components in Python beside rclpy") {
        over_ros2(python, &ros2, blocks.min(20), share)?;
    }
    ratios.push(start(python, &shared[0], starts)?);
    let all = if met(&ratios) {
        "all goals are met"
    } else {
        "not all goals are met"
    };
    println!("\n{all}");
    Ok(())
}

fn over_iceoryx2(
    python: &Path,
    programs: &[PathBuf; 2],
    blocks: usize,
    share: f64,
) -> Result<Vec<Ratio>, Failure> {
    let rows = [
        row("publish 64 B, one way", "publish", 64, 300),
        row("publish 1 MiB copied, one way", "publish", KIB * KIB, 30),
        row("publish 1 MiB in place, one way", "place", KIB * KIB, 30),
        row("1 MiB lent, not written, one way", "lend", KIB * KIB, 30),
        row("query 64 B, round trip", "query", 64, 500),
    ];
    let network = Network::new("hand")?;
    let peer = root().join("xtask/bench/python/iceoryx2_peer.py");
    let (directory, prefix) = network.files()?;
    let arguments = ["pong", "ping"].map(|which| {
        let words = [peer.to_string_lossy().into_owned(), which.to_owned()];
        [&words[..], &[directory.clone(), prefix.clone()]].concat()
    });
    let mut ours = components(python, programs, &[])?;
    let mut theirs = by_hand(python, &arguments, Some(network))?;
    let name = "PyPI iceoryx2";
    let peer = Peer { name, goal: GOAL };
    let mut ratios = peer.table(&rows, &mut ours, &mut theirs, blocks, share)?;
    // From 64 KiB on, the pause before a value has the same length.
    let rows = [64 * KIB, KIB * KIB].map(|size| row("lend", "lend", size, 30));
    let mut medians = [Vec::new(), Vec::new()];
    for _ in 0..blocks {
        for (row, medians) in rows.iter().zip(&mut medians) {
            medians.push(quantile(&mut ours.block(row, 1.0)?, 0.5) as f64 / 1000.0);
        }
    }
    let [small, large] = medians.map(|mut all| quantile(&mut all, 0.5));
    let value = large / small;
    println!(
        "Lent without writing, p50: 64 KiB {small:.1} µs, 1 MiB {large:.1} µs, ratio {value:.2} {} (goal ≤ {SIZE_GOAL:.2})\n",
        mark(value <= SIZE_GOAL)
    );
    ratios.push(Ratio {
        what: "1 MiB in place beside 64 KiB".to_owned(),
        value,
        goal: SIZE_GOAL,
    });
    Ok(ratios)
}

/// Prints both over DDS. There is no goal: the package `cyclonedds` converts each byte.
fn over_dds(
    python: &Path,
    programs: &[PathBuf; 2],
    blocks: usize,
    share: f64,
) -> Result<(), Failure> {
    let rows = [
        row("publish 64 B, one way", "publish", 64, 200),
        row("publish 1 MiB, one way", "publish", KIB * KIB, 5),
        row("query 64 B, round trip", "query", 64, 200),
    ];
    let peer = root().join("xtask/bench/python/cyclonedds_peer.py");
    let peer = peer.to_string_lossy().into_owned();
    let arguments =
        ["pong", "ping"].map(|which| [peer.as_str(), which, BY_HAND].map(str::to_owned).to_vec());
    let mut ours = components(python, programs, &DDS)?;
    let mut theirs = by_hand(python, &arguments, None)?;
    let name = "PyPI cyclonedds";
    Peer { name, goal: GOAL }.table(&rows, &mut ours, &mut theirs, blocks, share.max(0.5))?;
    Ok(())
}

/// Prints both over ROS 2, on the same interpreter. There is no goal: the wheels of ROS 2 make no
/// types of a user's.
fn over_ros2(
    python: &Path,
    programs: &[PathBuf; 2],
    blocks: usize,
    share: f64,
) -> Result<(), Failure> {
    let rows = [
        row("publish 64 B, one way", "publish", 64, 200),
        row("publish 1 MiB, one way", "publish", KIB * KIB, 5),
        row("query 64 B, round trip", "query", 64, 200),
    ];
    let peer = root().join("xtask/bench/python/rclpy_peer.py");
    let peer = peer.to_string_lossy().into_owned();
    let arguments =
        ["pong", "ping"].map(|which| [peer.as_str(), which].map(str::to_owned).to_vec());
    let mut ours = components(python, programs, &ROS2)?;
    let mut theirs = by_hand(python, &arguments, None)?;
    let name = "rclpy on Fast DDS";
    Peer { name, goal: GOAL }.table(&rows, &mut ours, &mut theirs, blocks, share.max(0.5))?;
    Ok(())
}

/// The environment in which programs find their interpreter and the protocol.
fn environment(python: &Path) -> Result<[String; 4], Failure> {
    let place = python
        .parent()
        .and_then(Path::parent)
        .ok_or("no environment")?;
    let protocol = root().join("xtask/bench/python").canonicalize()?;
    Ok([
        "env".to_owned(),
        format!("VIRTUAL_ENV={}", place.display()),
        format!("PYTHONPATH={}", protocol.display()),
        "PYTHONDONTWRITEBYTECODE=".to_owned(),
    ])
}

/// The components of `bench_python`.
fn components(python: &Path, programs: &[PathBuf; 2], more: &[&str]) -> Result<Pair, Failure> {
    let environment = environment(python)?;
    let network = Network::new("python")?;
    let name = network.name.clone();
    let arguments = [&["--network", name.as_str(), "--log", "error"], more].concat();
    Pair::start(
        [&environment, &environment],
        programs,
        [&arguments, &arguments],
        Some(network),
    )
}

fn by_hand(
    python: &Path,
    arguments: &[Vec<String>; 2],
    network: Option<Network>,
) -> Result<Pair, Failure> {
    let rclpy = rclpy::variables(BY_HAND).map(|(name, value)| format!("{name}={value}"));
    let environment = [&environment(python)?[..], &rclpy].concat();
    let words = arguments
        .each_ref()
        .map(|words| words.iter().map(String::as_str));
    let [pong, ping] = words.map(Iterator::collect::<Vec<_>>);
    let programs = [python.to_owned(), python.to_owned()];
    Pair::start(
        [&environment, &environment],
        &programs,
        [&pong, &ping],
        network,
    )
}

/// Prints how long a component takes from its start until its worker is initialized, and Python
/// until `NumPy` is imported.
fn start(python: &Path, program: &Path, count: usize) -> Result<Ratio, Failure> {
    let environment = environment(python)?;
    let network = Network::new("start")?;
    let took = |program: &Path, arguments: &[&str]| -> Result<f64, Failure> {
        let mut command = Command::new(&environment[0]);
        command.args(&environment[1..]).arg(program).args(arguments);
        let start = Instant::now();
        let program = Program::spawn(command)?;
        program.read_line(LIMIT)?;
        let took = start.elapsed().as_secs_f64() * 1000.0;
        program.stop(LIMIT)?;
        Ok(took)
    };
    let bare = ["-c", "import numpy; print('ready')"];
    let component = ["--network", &network.name, "--log", "error"];
    let mut times = [Vec::new(), Vec::new()];
    // The first start compiles the modules.
    for _ in 0..=count {
        times[0].push(took(python, &bare)?);
        times[1].push(took(program, &component)?);
    }
    let [bare, component] = times.map(|mut all| quantile(&mut all[1..], 0.5));
    let more = component - bare;
    println!(
        "Start, p50 of {count}: component {component:.0} ms, `python -c \"import numpy\"` {bare:.0} ms, \
         {more:.0} ms more {} (goal ≤ {START_GOAL:.0} ms)",
        mark(more <= START_GOAL)
    );
    Ok(Ratio {
        what: "start, ms more".to_owned(),
        value: more,
        goal: START_GOAL,
    })
}
