//! `cargo xtask bench ros2`: generated components over ROS 2 compared with hand-written programs on
//! ros2-client, and with the same components over DDS.

use crate::bench::machine;
use crate::compare::{Peer, met};
use crate::dds;
use crate::figure::BUILD;
use crate::pair::{Pair, Row};
use crate::programs::{Failure, cargo, finish};
use crate::variant::{self, DDS, ROS2};
use rc_cdsl::model::Middleware;
use rc_deploy_network::Profile;

/// The limit of a generated component at p50, as a multiple of the hand-written program, or of the
/// same component over DDS.
const GOAL: f64 = 1.10;
/// The size of a query.
const SMALL: usize = 64;
/// The hand-written program, and tests in which clients over ros2-client call a component.
const BY_HAND_MANIFEST: &str = "xtask/bench/ros_peer/Cargo.toml";
/// The domain of the hand-written program.
const BY_HAND: &str = "91";

/// Builds both, runs the tests of the hand-written program, and measures both in turns.
pub(crate) fn run(blocks: usize, share: f64) -> Result<(), Failure> {
    let generated = variant::build("bench", Middleware::Ros2, Profile::Release)?;
    let over_dds = variant::build("bench", Middleware::Dds, Profile::Release)?;
    for task in ["build", "test"] {
        let words = [task, "--release", "--manifest-path", BY_HAND_MANIFEST];
        finish(cargo(&words)?, BUILD)?;
    }
    println!("{}\n", machine());
    let peer = Peer {
        name: "by hand",
        goal: GOAL,
    };
    let mut ours = Pair::components(&generated, &ROS2)?;
    let mut theirs = Pair::by_hand_over("bench_ros_peer", BY_HAND)?;
    // The hand-written server cannot send replies above one packet: `rustdds` writes fragments with
    // a related request in an unreadable form, and ros2-client has no other one.
    let is_possible = |row: &Row| !row.is_query() || row.size == SMALL;
    let rows: Vec<Row> = dds::rows()
        .into_iter()
        .flatten()
        .filter(is_possible)
        .collect();
    let mut is_met = met(&peer.table(&rows, &mut ours, &mut theirs, blocks, share)?);
    drop(theirs);
    let mut over_dds = Pair::components(&over_dds, &DDS)?;
    let peer = Peer {
        name: "over DDS",
        goal: GOAL,
    };
    let rows: Vec<Row> = dds::rows().into_iter().flatten().collect();
    println!();
    is_met &= met(&peer.table(&rows, &mut ours, &mut over_dds, blocks, share)?);
    if !is_met {
        eprintln!("xtask: a goal was missed");
    }
    Ok(())
}
