//! `rcdeploy world tree`: the frames of the world as an InnerModel file.

use super::follow::{Follower, Turn};
use super::replica::Listener;
use crate::cli::output::{Failure, print_data, print_line, system};
use std::path::Path;
use std::time::{Duration, Instant};

/// The shortest time between two trees that follow each other.
const PAUSE: Duration = Duration::from_millis(100);

pub(super) fn tree(network: &str, output: Option<&Path>, follow: bool) -> Result<u8, Failure> {
    if follow {
        return self::follow(network);
    }
    let Some(listener) = Listener::joined(network, None)? else {
        return Ok(0);
    };
    match output {
        Some(file) => {
            let written = rc_files::write(file, text(&listener));
            written.map_err(|error| system(&format_args!("{}: {error}", file.display())))?;
        }
        None => print_data(&text(&listener)),
    }
    Ok(0)
}

fn text(listener: &Listener) -> String {
    let tree = graph_exchange::innermodel::tree(&listener.world.snapshot());
    innermodel_language::print(&tree)
}

fn follow(network: &str) -> Result<u8, Failure> {
    let Some(mut follower) = Follower::begin(network)? else {
        return Ok(0);
    };
    let (mut shown, mut version) = (String::new(), None);
    let mut next = Instant::now();
    loop {
        let now = Some(follower.listener.world.snapshot().version());
        if now != version && Instant::now() >= next {
            (version, next) = (now, Instant::now() + PAUSE);
            let tree = text(&follower.listener);
            if tree != shown {
                let line = serde_json::to_string(&tree).map_err(|error| system(&error))?;
                print_line(format_args!("{line}"));
                shown = tree;
            }
        }
        match follower.turn()? {
            Turn::Same => {}
            Turn::Restarted => version = None,
            Turn::Interrupted => return Ok(0),
        }
    }
}
