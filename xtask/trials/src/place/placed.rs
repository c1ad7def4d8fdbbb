//! Both components in one placement.

use crate::pair::{Network, Pair, Row, times};
use crate::programs::{Failure, Program};
use crate::usage::processor_time;
use rc_test_support::cable::Cable;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// The limit for the start.
const START: Duration = Duration::from_secs(10);
/// The limit for one block.
const BLOCK: Duration = Duration::from_secs(10);
/// The slots of `ping`, and the first ones of `pong`.
pub(super) const SLOTS: [&str; 5] = ["Echo", "awake", "Sample", "Clouds", "Pictures"];
/// The slots of `pong`.
pub(super) const SLOTS_OF_PONG: [&str; 6] =
    ["Echo", "awake", "Sample", "Clouds", "Pictures", "onward"];
/// The domain of DDS between the two hosts. Nobody else is in their network.
const ON_CABLE: [&str; 4] = [
    "--set-middleware",
    "dds.domain=97",
    "--set-middleware",
    "dds.lease=10s",
];

/// Both components in one placement.
pub(super) enum Placed {
    One {
        program: Program,
        /// Removed after the end of the program.
        _network: Network,
    },
    Two(Pair),
    /// On two hosts. The pair ends before its cable is removed.
    Hosts {
        pair: Pair,
        _places: [tempfile::TempDir; 2],
        _cable: Cable,
    },
}

impl Placed {
    pub(super) fn in_one(program: &Path) -> Result<Self, Failure> {
        let network = Network::new("one")?;
        let pong = arguments(&network.name, "local", &SLOTS_OF_PONG, &[]);
        let ping = arguments(&network.name, "local", &SLOTS, &[]);
        let begin = ["--member", "pong"].map(str::to_owned);
        let then = ["--member", "ping", "--after", "pong"].map(str::to_owned);
        let all = [&begin[..], &pong, &then, &ping].concat();
        let all: Vec<&str> = all.iter().map(String::as_str).collect();
        let program = Program::start(program, &all)?;
        for _ in 0..2 {
            let line = program.read_line(START)?;
            if line != "ready" {
                return Err(format!("`{line}` instead of `ready`").into());
            }
        }
        Ok(Self::One {
            program,
            _network: network,
        })
    }

    pub(super) fn in_two(program: &Path) -> Result<Self, Failure> {
        let pair = Pair::members_in(Network::new("two")?, program, &[])?;
        Ok(Self::Two(pair))
    }

    /// On two hosts with a cable, a network namespace each, over DDS.
    pub(super) fn on_hosts(cable: Cable, programs: &[PathBuf; 2]) -> Result<Self, Failure> {
        let places = [tempfile::tempdir()?, tempfile::tempdir()?];
        // That of ping, then that of pong. Each host has run directories of its own.
        let tools = [0, 1].map(|side| {
            let place = places[side].path().display();
            [
                "ip".to_owned(),
                "netns".to_owned(),
                "exec".to_owned(),
                cable.name(side).to_owned(),
                "env".to_owned(),
                format!("XDG_RUNTIME_DIR={place}"),
            ]
        });
        let mut pair = Pair::components_under([&tools[0], &tools[1]], programs, &ON_CABLE)?;
        // A query is answered once both know each other.
        let warm = Row {
            name: "".into(),
            kind: "query",
            size: 64,
            count: 10,
        };
        pair.block(&warm, 1.0)?;
        Ok(Self::Hosts {
            pair,
            _places: places,
            _cable: cable,
        })
    }

    pub(super) fn processor_time(&self) -> Result<Duration, Failure> {
        match self {
            Self::One { program, .. } => processor_time(program.pid()),
            Self::Two(pair) | Self::Hosts { pair, .. } => pair.processor_time(),
        }
    }

    pub(super) fn block(&mut self, row: &Row, share: f64) -> Result<Vec<i64>, Failure> {
        let program = match self {
            Self::One { program, .. } => program,
            Self::Two(pair) | Self::Hosts { pair, .. } => return pair.block(row, share),
        };
        let count = (row.count as f64 * share) as usize;
        program.write_line(&format!("{} {} {count}", row.kind, row.size))?;
        let first = times(&program.read_line(BLOCK)?)?;
        if row.is_query() {
            return Ok(first);
        }
        // The line of the sender is empty. Either may come first.
        let second = times(&program.read_line(BLOCK)?)?;
        Ok(if first.is_empty() { second } else { first })
    }
}

/// The arguments of a component with these slots, whose connections all go over one middleware.
/// `own` are slots with addresses that others have not.
pub(super) fn arguments(
    network: &str,
    middleware: &str,
    slots: &[&str],
    own: &[(&str, String)],
) -> Vec<String> {
    let mut all = ["--network", network, "--log", "error"]
        .map(str::to_owned)
        .to_vec();
    // Of two slots of one interface, the second one needs an address of its own.
    let usual = [("awake", "Awake"), ("onward", "Onward")];
    let usual = usual.map(|(slot, address)| (slot, address.to_owned()));
    let is_usual = |slot: &str| slots.contains(&slot) && own.iter().all(|(own, _)| *own != slot);
    let usual = usual.iter().filter(|(slot, _)| is_usual(slot));
    for (slot, address) in usual.chain(own) {
        all.extend(["--bind".to_owned(), format!("{slot}={network}/{address}")]);
    }
    for slot in slots {
        all.extend(["--transport".to_owned(), format!("{slot}={middleware}")]);
    }
    all
}
