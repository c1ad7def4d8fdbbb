//! Strangers that send as much as they can, clocks that jump, and readers that sleep.

use crate::network::{add, flat, through_bytes};
use crate::wrong::{StepOf, digest, schema_of, steps};
use property_graph::{Id, Schema, Time};
use rc_world::{Setup, World};
use std::collections::VecDeque;
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

/// A process that stands still for a minute makes no turn, and its queues keep the last messages: it wakes with
/// old ones, at a much later time.
#[test]
fn a_reader_that_sleeps_for_a_minute_wakes_with_old_messages_and_catches_up() {
    let worlds =
        [7, 8, 9].map(|writer| World::new(Setup::new("agent", flat()).with_writer(writer)));
    let mut queues = [(); 3].map(|()| VecDeque::new());
    let mut now = SECOND;
    let mut step = |awake: &[usize], now: Duration| {
        for at in awake {
            while let Some(message) = queues[*at].pop_front() {
                worlds[*at].receive(now, message);
            }
            worlds[*at].turn(now);
            while let Some(message) = worlds[*at].take() {
                for (to, queue) in queues.iter_mut().enumerate().filter(|(to, _)| to != at) {
                    queue.push_back(through_bytes(&message));
                    if queue.len() > 32 && to == 2 {
                        queue.pop_front();
                    }
                }
            }
        }
    };
    let equal = |now: Duration| {
        let digests = worlds.each_ref().map(|world| world.status(now).digest);
        digests[0] == digests[1] && digests[1] == digests[2]
    };
    for _ in 0..400 {
        now += Duration::from_millis(10);
        step(&[0, 1, 2], now);
    }
    assert!(worlds[2].has_joined());
    for number in 0..6000 {
        now += Duration::from_millis(10);
        if number % 10 == 0 {
            let name = |number: usize| format!("room {number}");
            add(&worlds[number / 10 % 2], "room", &name(number));
            let removed = worlds[0].change(|edit| {
                let old = number.checked_sub(100).map(name).unwrap_or_default();
                let room = edit.snapshot().named(&old).next();
                room.map_or(Ok(()), |room| Ok(edit.remove_node(room)?))
            });
            removed.expect("a sound change");
        }
        step(&[0, 1], now);
    }
    // Nobody waits for it: removals are forgotten.
    assert!(worlds[0].status(now).tombstones < 30);
    assert!(!equal(now));
    for _ in 0..500 {
        now += Duration::from_millis(10);
        step(&[0, 1, 2], now);
    }
    assert!(equal(now));
    assert!((9..13).contains(&worlds[2].snapshot().node_count()));
    assert!(!worlds[2].status(now).is_behind);
}
