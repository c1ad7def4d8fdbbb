//! Threads that share a replica.

use crate::network::{CALM, Network, add};
use rc_world::{Token, World};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

const SOON: Duration = Duration::from_secs(20);

/// Sets both numbers of the door to the same value.
fn move_door(world: &World, value: f64) -> Token {
    let changed = world.change(|edit| {
        let door = edit.snapshot().named("front").next().expect("a door");
        edit.set(door, "width", value)?;
        edit.set(door, "height", value)?;
        Ok(())
    });
    changed.expect("a sound change")
}

/// Both numbers of the door.
fn read(world: &World) -> (Option<f64>, Option<f64>) {
    let now = world.snapshot();
    let door = now.named("front").next().expect("a door");
    let door = now.node(door).expect("it is there");
    let number = |name: &str| match door.get(name) {
        Some(property_graph::Value::Float(number)) => Some(*number),
        _ => None,
    };
    (number("width"), number("height"))
}

/// How many reads each of eight readers makes at least. `RC_WORLD_READS` has another number.
fn reads() -> u64 {
    let wanted = std::env::var("RC_WORLD_READS").ok();
    wanted.and_then(|text| text.parse().ok()).unwrap_or(10_000)
}

#[test]
fn no_reader_sees_half_of_a_change() {
    let mut network = Network::new(2, CALM, 1);
    add(network.at(0), "door", "front");
    move_door(network.at(0), 0.0);
    network.run(Duration::from_secs(1));
    let (writer, reader) = (network.at(0), network.at(1));
    let (is_over, done) = (AtomicBool::new(false), AtomicU64::new(0));
    let (wanted, made) = (reads(), AtomicU64::new(0));
    std::thread::scope(|scope| {
        for _ in 0..8 {
            scope.spawn(|| {
                let mut last = 0.0;
                let mut count = 0;
                while count < wanted || made.load(Ordering::Relaxed) < 100 {
                    let (width, height) = read(reader);
                    assert!(width.is_some() && width == height, "{width:?} {height:?}");
                    assert!(width >= Some(last), "{width:?} after {last}");
                    last = width.unwrap_or_default();
                    count += 1;
                }
                if done.fetch_add(1, Ordering::Relaxed) == 7 {
                    is_over.store(true, Ordering::Relaxed);
                }
            });
        }
        // Changes at 1 kHz, each a message to the other replica.
        let mut now = Duration::from_secs(2);
        while !is_over.load(Ordering::Relaxed) {
            let value = made.fetch_add(1, Ordering::Relaxed) as f64;
            let token = move_door(writer, value);
            while let Some(message) = writer.take() {
                reader.receive(now, message);
            }
            assert!(reader.has(token));
            now += Duration::from_millis(1);
            std::thread::sleep(Duration::from_millis(1));
        }
    });
}

#[test]
fn a_thread_waits_for_what_another_one_hands_in() {
    let network = Network::new(2, CALM, 1);
    let (writer, reader) = (network.at(0), network.at(1));
    let token = add(writer, "door", "front");
    // Nobody hands it in.
    assert!(!reader.wait_for(token, Duration::from_millis(5)));
    assert!(writer.wait_for(token, Duration::ZERO));
    std::thread::scope(|scope| {
        let waiting = scope.spawn(|| reader.wait_for(token, SOON));
        while let Some(message) = writer.take() {
            reader.receive(Duration::from_secs(1), message);
        }
        assert!(waiting.join().expect("no panic"));
    });
    assert_eq!(reader.snapshot().named("front").count(), 1);
    // Each of many tokens, in turn, with the newest change at least.
    for value in 0..200 {
        std::thread::scope(|scope| {
            let token = move_door(writer, f64::from(value));
            let waiting = scope.spawn(move || {
                assert!(reader.wait_for(token, SOON));
                read(reader)
            });
            while let Some(message) = writer.take() {
                reader.receive(Duration::from_secs(1), message);
            }
            let value = Some(f64::from(value));
            assert_eq!(waiting.join().expect("no panic"), (value, value));
        });
    }
}
