//! `cargo xtask bench record exact`: the processor time that exact recording takes at a component.

use crate::bench::machine;
use crate::figure::BUILD;
use crate::pair::{Pair, ROWS, Row};
use crate::programs::{Failure, cargo, finish, target};
use crate::usage::processor_time;
use rc_deploy_network::Profile;
use std::borrow::Cow;
use std::time::Duration;

/// The limit for a block.
const BLOCK: Duration = Duration::from_secs(30);
/// The ends of a pair: the publisher and client, then the subscriber and server.
const ENDS: [[&str; 2]; 2] = [["publisher", "subscriber"], ["client", "server"]];

/// Compares two generated pairs, one of which records itself, in blocks that take turns; with
/// `smoke`, in a few.
pub(crate) fn run(smoke: bool) -> Result<(), Failure> {
    let words = "build --release --workspace --bin ping --bin pong";
    finish(cargo(&words.split(' ').collect::<Vec<_>>())?, BUILD)?;
    println!("{}\n", machine());
    let folder = tempfile::tempdir_in(target()?)?;
    let file = |name: &str| folder.path().join(name).display().to_string();
    let files = [file("pong.mcap"), file("ping.mcap")];
    let words = files.each_ref().map(|file| ["--record", file]);
    let mut recorded = Pair::generated_with(
        "recorded",
        Profile::Release,
        words.each_ref().map(|words| &words[..]),
    )?;
    let mut alone = Pair::generated_in("alone")?;
    let (blocks, share) = if smoke { (2, 0.1) } else { (20, 1.0) };
    let steady = Row {
        name: Cow::Borrowed("publish 64 B at 10 kHz"),
        kind: "steady",
        size: 64,
        count: 10_000,
    };
    println!("| | end | µs a message | recorded | ratio | bytes a message |");
    println!("|---|---|---:|---:|---:|---:|");
    for (row, ends) in [steady, ROWS[4].clone()].into_iter().zip(ENDS) {
        let row = Row {
            count: (row.count as f64 * share) as usize,
            ..row
        };
        let before = sizes(&files)?;
        let mut times = [[Duration::ZERO; 2]; 2];
        for _ in 0..blocks {
            for (pair, times) in [&mut recorded, &mut alone].into_iter().zip(&mut times) {
                let pids = pair.pids();
                let begin = [processor_time(pids[0])?, processor_time(pids[1])?];
                pair.counted_block(&row, BLOCK)?;
                for ((time, pid), begin) in times.iter_mut().zip(pids).zip(begin) {
                    *time += processor_time(pid)?.saturating_sub(begin);
                }
            }
        }
        // Data that wait for the disk are written after half a second.
        std::thread::sleep(Duration::from_secs(1));
        let after = sizes(&files)?;
        let messages = f64::from(blocks) * row.count as f64;
        for (end, name) in ends.into_iter().enumerate() {
            let each = times.map(|times| times[end].as_secs_f64() * 1e6 / messages);
            // The files are those of pong, then of ping.
            let bytes = (after[1 - end] - before[1 - end]) as f64 / messages;
            println!(
                "| {} | {name} | {:.2} | {:.2} | {:.2} | {bytes:.0} |",
                row.name,
                each[1],
                each[0],
                each[0] / each[1],
            );
            if bytes < 1.0 {
                return Err(format!("the {name} has recorded nothing").into());
            }
        }
    }
    Ok(())
}

fn sizes(files: &[String; 2]) -> Result<[u64; 2], Failure> {
    let [pong, ping] = files;
    Ok([
        std::fs::metadata(pong)?.len(),
        std::fs::metadata(ping)?.len(),
    ])
}
