//! Agents and keepers: changes arrive, the killed one is missed by nobody, the late one catches up,
//! and what was kept is what the next run starts with.

use crate::agent;
use rc_test_site::site::{Site, rcdeploy};
use rc_world::{Status, World};
use std::path::Path;
use std::process::{Child, Command};
use std::time::{Duration, Instant};

/// A keeper in a process of its own. It is killed if the test fails.
struct Keeper(Child);

impl Drop for Keeper {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl Keeper {
    fn start(network: &str, name: &str, keep: &Path) -> Self {
        let mut command = Command::new(Site::executable("world_keeper"));
        command.args(["--network", network, "--name", name]);
        command.args([
            "--set",
            &format!("keep={}", keep.display()),
            "--set",
            "each=200ms",
        ]);
        Self(command.spawn().expect("a keeper"))
    }

    /// Ends it in order.
    fn end(mut self) {
        let pid = self.0.id().to_string();
        let sent = Command::new("kill").args(["-TERM", &pid]).status();
        assert!(sent.expect("kill").success());
        assert!(self.0.wait().expect("an end").success());
    }
}

/// The time of the driver counts from another zero: only what a replica has is asked here.
fn state(world: &World) -> Status {
    world.status(Duration::ZERO)
}

/// Waits until these replicas have told that they are equal to this one.
fn await_equal(world: &World, names: &[&str]) {
    let end = Instant::now() + Duration::from_secs(30);
    loop {
        let own = state(world);
        let live = |name: &&str| {
            let mut peers = own.peers.iter().filter(|peer| peer.is_live);
            peers.any(|peer| peer.name == **name && peer.digest == own.digest)
        };
        if names.iter().all(live) {
            return;
        }
        assert!(Instant::now() < end, "{own:#?}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

fn add(world: &World, names: std::ops::Range<u32>) {
    let added = world.change(|edit| {
        for at in names {
            let door = edit.add_node("door")?;
            edit.set(door, "name", format!("door {at}"))?;
            edit.set(door, "pose", [1.0, 2.0, f64::from(at)])?;
        }
        Ok(())
    });
    added.expect("a sound change");
}

/// `rcdeploy world` sees the replicas, and takes no part.
fn shown(network: &str, names: &[&str], elements: u64) {
    let mut command = Command::new(rcdeploy());
    command.args(["world", network, "--format", "json"]);
    let output = command.output().expect("rcdeploy");
    let text = String::from_utf8_lossy(&output.stdout);
    let shown: serde_json::Value = serde_json::from_str(&text).expect("a document");
    assert_eq!(shown["is_equal"], true, "{text}");
    let replicas = shown["replicas"].as_array().expect("replicas");
    let found = replicas
        .iter()
        .map(|own| own["name"].as_str().expect("a name"));
    assert_eq!(found.collect::<Vec<_>>(), names);
    for own in replicas {
        assert_eq!(own["elements"], elements, "{text}");
        assert_eq!(own["behind"], 0);
    }
}

#[test]
fn replicas_of_three_processes_are_equal_and_outlive_a_killed_one() {
    let folder = tempfile::tempdir().expect("a folder");
    let kept = |name: &str| folder.path().join(format!("{name}.graph"));
    let network = "worldkeeper-three";
    let (a, world) = agent::start(network, "a");
    let first = Keeper::start(network, "first", &kept("first"));
    let mut second = Keeper::start(network, "second", &kept("second"));
    add(&world, 0..100);
    await_equal(&world, &["first", "second"]);

    second.0.kill().expect("it runs");
    second.0.wait().expect("an end");
    add(&world, 100..110);
    // More than one message has: the late one gets it in chunks.
    add(&world, 110..2000);
    let third = Keeper::start(network, "third", &kept("third"));
    let (b, other) = agent::start(network, "b");
    await_equal(&world, &["first", "third", "b"]);
    assert_eq!(other.snapshot().node_count(), 2000);
    assert_eq!(state(&world).counts.refused, 0);
    let removed = other.change(|edit| {
        let door = edit.snapshot().named("door 7").next();
        door.map_or(Ok(()), |door| Ok(edit.remove_node(door)?))
    });
    let token = removed.expect("a sound change");
    let end = Instant::now() + Duration::from_secs(30);
    while !world.has(token) {
        assert!(Instant::now() < end, "{:#?}", state(&world));
        std::thread::sleep(Duration::from_millis(2));
    }
    assert_eq!(world.snapshot().named("door 7").count(), 0);
    await_equal(&world, &["first", "third", "b"]);
    shown(network, &["a", "b", "first", "third"], 1999);

    // All agents end before the keeper, which has kept everything.
    for agent in [a, b] {
        agent.stop();
        agent.join().expect("an end in order");
    }
    first.end();
    third.end();
    let text = std::fs::read_to_string(kept("first")).expect("what was kept");
    assert!(text.contains("\"door 1999\"") && !text.contains("\"door 7\""));

    // The next run starts with it.
    let network = "worldkeeper-again";
    let (agent, world) = agent::start(network, "c");
    let again = Keeper::start(network, "first", &kept("first"));
    await_equal(&world, &["first"]);
    let end = Instant::now() + Duration::from_secs(30);
    while world.snapshot().node_count() != 1999 {
        assert!(Instant::now() < end, "{:#?}", state(&world));
        std::thread::sleep(Duration::from_millis(20));
    }
    agent.stop();
    agent.join().expect("an end in order");
    again.end();
}

/// A keeper whose file lies on a disk of 64 KiB of its own, and its log.
fn on_a_small_disk(network: &str, folder: &Path) -> (Keeper, std::path::PathBuf) {
    let script = "mount -t tmpfs -o size=64k none \"$1\" || exit 77; shift; exec \"$@\"";
    let log = folder.join("keeper.log");
    let disk = folder.join("disk");
    std::fs::create_dir(&disk).expect("a folder");
    let output = std::fs::File::create(&log).expect("a log");
    let keep = format!("keep={}", disk.join("world.graph").display());
    let mut command = Command::new("unshare");
    command.args(["-m", "sh", "-c", script, "sh"]).arg(&disk);
    command.arg(Site::executable("world_keeper"));
    command.args(["--network", network, "--name", "keeper"]);
    command.args(["--set", &keep, "--set", "each=100ms"]);
    command
        .stderr(output.try_clone().expect("a log"))
        .stdout(output);
    (Keeper(command.spawn().expect("unshare")), log)
}

#[test]
fn a_full_disk_is_told_and_the_old_file_stays_whole() {
    let folder = tempfile::tempdir().expect("a folder");
    let network = "worldkeeper-full";
    let (mut keeper, log) = on_a_small_disk(network, folder.path());
    let disk = folder.path().join("disk/world.graph");
    // As the keeper sees it.
    let kept = format!("/proc/{}/root{}", keeper.0.id(), disk.display());
    let read = || std::fs::read_to_string(&kept).unwrap_or_default();
    let (agent, world) = agent::start(network, "a");
    add(&world, 0..20);
    let end = Instant::now() + Duration::from_secs(30);
    while !read().contains("\"door 19\"") {
        if keeper.0.try_wait().expect("a child").is_some() {
            println!(
                "skipped: a_full_disk_is_told_and_the_old_file_stays_whole: this user may not mount"
            );
            agent.stop();
            return agent.join().expect("an end in order");
        }
        assert!(Instant::now() < end, "{}", read());
        std::thread::sleep(Duration::from_millis(20));
    }
    let before = read();
    add(&world, 20..2000);
    let said = || std::fs::read_to_string(&log).unwrap_or_default();
    while !said().contains("cannot write") {
        assert!(Instant::now() < end, "{}", said());
        std::thread::sleep(Duration::from_millis(20));
    }
    assert_eq!(read(), before, "the old file");
    // With room again, it is kept.
    let removed = world.change(|edit| {
        for at in 20..2000 {
            let door = edit.snapshot().named(&format!("door {at}")).next();
            door.map_or(Ok(()), |door| edit.remove_node(door))?;
        }
        let door = edit.snapshot().named("door 0").next();
        door.map_or(Ok(()), |door| Ok(edit.set(door, "name", "the last")?))
    });
    removed.expect("a sound change");
    let end = Instant::now() + Duration::from_secs(30);
    while !read().contains("\"the last\"") {
        assert!(Instant::now() < end, "{}", said());
        std::thread::sleep(Duration::from_millis(20));
    }
    agent.stop();
    agent.join().expect("an end in order");
    keeper.end();
}
