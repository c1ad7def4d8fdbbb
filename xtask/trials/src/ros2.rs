//! `cargo xtask bench ros2`: generated components over ROS 2 beside the same by hand on
//! ros2-client.

use crate::bench::{BUILD, machine};
use crate::compare::{Peer, met};
use crate::dds::rows;
use crate::pair::{Pair, Row};
use crate::programs::{Failure, cargo, finish};
use crate::variant::{self, ROS2};
use rc_cdsl::model::Backend;
use rc_deploy_network::Profile;

/// The goal for the ratio at p50.
const GOAL: f64 = 1.10;
/// The size of a query.
const SMALL: usize = 64;
/// The domain of the hand-written program.
const BY_HAND: &str = "91";

/// Builds both and measures them in turns.
pub(crate) fn run(blocks: usize, share: f64) -> Result<(), Failure> {
    let generated = variant::build("bench", Backend::Ros2, Profile::Release)?;
    let words = [
        "build",
        "--release",
        "--workspace",
        "--bin",
        "bench_ros_peer",
    ];
    finish(cargo(&words)?, BUILD)?;
    println!("{}\n", machine());
    let peer = Peer {
        name: "by hand",
        goal: GOAL,
    };
    let mut ours = Pair::components(&generated, &ROS2)?;
    let mut theirs = Pair::by_hand_over("bench_ros_peer", BY_HAND)?;
    // The hand-written server cannot send replies above one packet: `rustdds` writes fragments with a
    // related request in an unreadable form, and ros2-client has no other one.
    let is_possible = |row: &Row| !row.is_query() || row.size == SMALL;
    let rows: Vec<Row> = rows().into_iter().flatten().filter(is_possible).collect();
    if !met(&peer.table(&rows, &mut ours, &mut theirs, blocks, share)?) {
        eprintln!("xtask: a goal was missed");
    }
    Ok(())
}
