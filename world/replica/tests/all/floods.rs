//! Strangers that send as much as they can, and clocks that jump.

use crate::network::{add, flat};
use crate::wrong::{StepOf, digest, schema_of, steps};
use property_graph::{Id, Schema, Time};
use rc_world::{Setup, World};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

const SECOND: Duration = Duration::from_secs(1);

/// How many nodes a stranger makes. `RC_WORLD_NODES` has another number: `cargo xtask soak world` makes more
/// than components do.
fn nodes() -> usize {
    let set = std::env::var("RC_WORLD_NODES").ok();
    set.and_then(|set| set.parse().ok()).unwrap_or(20_000)
}

#[test]
fn a_million_nodes_of_a_stranger_leave_a_replica_that_goes_on() {
    let setup = Setup::new("mapper", Schema::anything().into());
    let world = World::new(setup.with_writer(7));
    let schema = schema_of(&world);
    add(&world, "room", "kitchen");
    let none = Id::new(0, 0);
    let node: StepOf<'_> = (0, "stone", none, none, None);
    let (part, mut made) = (vec![node; 1000], 0);
    while made < nodes() {
        world.receive(SECOND, steps(schema, made as u64, &part));
        made += part.len();
    }
    world.turn(2 * SECOND);
    let shown = world.snapshot().node_count();
    assert_eq!(shown, made + 1);
    // A component adds nothing to a world that has too much.
    let kitchen = world.change(|edit| {
        let kitchen = edit.snapshot().named("kitchen").next();
        let kitchen = kitchen.ok_or(property_graph::Error::Removed)?;
        Ok(edit.set(kitchen, "width", 3.0)?)
    });
    let is_full = made > 1 << 20;
    assert!(kitchen.is_ok() || is_full, "{kitchen:?}");
    let status = world.status(2 * SECOND);
    assert!(
        status.queued < 17 << 20 && status.waiting == 0,
        "{status:?}"
    );
}

/// More replicas than can be real are not noted, and those that were known are still heard.
#[test]
fn a_flood_of_strangers_displaces_no_replica() {
    let world = World::new(Setup::new("mapper", flat()).with_writer(7));
    let schema = schema_of(&world);
    world.receive(SECOND, digest(schema, 200, 1));
    for sender in 0..5000 {
        world.receive(SECOND, digest(schema, 1000 + sender, 1));
    }
    let status = world.status(SECOND);
    assert_eq!(status.peers.len(), 1024);
    assert_eq!(status.counts.refused, 5001 - 1024);
    world.receive(3 * SECOND, digest(schema, 200, 2));
    let status = world.status(3 * SECOND);
    let known = status.peers.iter().find(|peer| peer.writer == 200);
    assert_eq!(known.map(|peer| peer.silent), Some(Duration::ZERO));
    add(&world, "room", "kitchen");
    assert_eq!(world.snapshot().node_count(), 1);
}

/// The clock of one jumps a day ahead, and back again.
#[test]
fn replicas_go_on_while_the_clock_of_one_jumps() {
    let second = |number: u64| Duration::from_secs(number);
    let clocks = [(); 2].map(|()| Arc::new(AtomicU64::new(1000)));
    let worlds = [0, 1].map(|at| {
        let clock = Arc::clone(&clocks[at]);
        let setup = Setup::new("mapper", flat()).with_writer(7 + at as u64);
        World::new(setup.with_clock(move || second(clock.load(Ordering::Relaxed))))
    });
    let mut now = Duration::ZERO;
    let day = 86_400;
    for (round, jump) in [0, day, 0].into_iter().enumerate() {
        clocks[0].store(1000 + jump + 10 * round as u64, Ordering::Relaxed);
        clocks[1].store(1000 + 10 * round as u64, Ordering::Relaxed);
        add(&worlds[0], "room", &format!("first {round}"));
        add(&worlds[1], "room", &format!("second {round}"));
        for _ in 0..200 {
            now += Duration::from_millis(10);
            for (from, to) in [(0, 1), (1, 0)] {
                worlds[from].turn(now);
                while let Some(message) = worlds[from].take() {
                    worlds[to].receive(now, message);
                }
            }
        }
        let rooms = 2 * (round + 1);
        for (at, world) in worlds.iter().enumerate() {
            let own: Time = second(clocks[at].load(Ordering::Relaxed));
            let version = world.snapshot();
            assert_eq!(version.node_count(), rooms, "round {round}");
            assert!(
                version.time() <= own + SECOND,
                "round {round}: {:?}",
                version.time()
            );
        }
    }
}
