//! Reads beside scipy and beside tf2's own `BufferCore`, and what `RobMoSys` D3.2, section 3.1.2, misses in tf: a test for each
//! of its eight complaints, in their order.

use crate::network::{CALM, Network, add, through_bytes};
use fastrand::Rng;
use property_graph::{Error, Keep, NodeId, Point, Pose, Time, Transform};
use rc_syntax::MemoryLoader;
use rc_world::{Rights, Setup, Topic, World};
use serde_json::{Value, json};
use std::fmt::Write;
use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// A world with frames whose clock the test moves, in nanoseconds.
fn world(text: &str) -> (World, Arc<AtomicU64>) {
    let mut sources = rc_diagnostics::SourceMap::new();
    let source = sources.add("test.gdsl", text);
    let loader = MemoryLoader::default();
    let (schema, found) = graph_language::load(&mut sources, &loader, source);
    assert!(!found.has_errors(), "{found:?}");
    let time = Arc::new(AtomicU64::new(0));
    let clock = Arc::clone(&time);
    let setup = Setup::new("agent", schema.expect("a schema").into())
        .with_writer(7)
        .with_clock(move || Time::from_nanos(clock.load(Ordering::Relaxed)));
    (World::new(setup), time)
}

const GEOMETRY: &str = "import \"geometry.gdsl\";\nDomain test { };\n";

/// Adds a frame below another one.
fn frame(world: &World, name: &str, above: Option<NodeId>, pose: [f64; 6]) -> NodeId {
    let made = world.change_with(|edit| {
        let node = edit.add_node("Frame")?;
        edit.set(node, "name", name)?;
        if let Some(above) = above {
            let edge = edit.add_edge("RT", above, node)?;
            edit.set(edge, "pose", pose)?;
        }
        Ok(node)
    });
    made.expect("a frame").0
}

/// Moves a frame.
fn place(world: &World, node: NodeId, pose: [f64; 6]) {
    let moved = world.change(|edit| {
        let edge = edit.snapshot().in_edges(node, None).next();
        let edge = edge.expect("an edge").edge_id();
        Ok(edit.set(edge, "pose", pose)?)
    });
    moved.expect("a change");
}

fn transform([x, y, z, rx, ry, rz]: [f64; 6]) -> Transform {
    Transform::of(&Pose::new(x, y, z, rx, ry, rz))
}

fn cells(of: &Transform) -> Vec<f64> {
    let turn = (0..9).map(|at| of.rotation[(at / 3, at % 3)]);
    turn.chain(of.translation.iter().copied()).collect()
}

/// What was told of frames, and what was read.
struct Told {
    /// The frames below the first one: the number of the parent, and poses by time in nanoseconds.
    frames: Vec<(usize, Vec<(u64, [f64; 6])>)>,
    /// To, from, time, and the cells of the transform.
    reads: Vec<(usize, usize, u64, Vec<f64>)>,
}

/// A tree of frames that move at random for two seconds, and random reads of all of that time.
fn moved(count: usize, seed: u64) -> Told {
    let mut random = Rng::with_seed(seed);
    let (world, time) = world(GEOMETRY);
    world.keep(Keep {
        versions: 100_000,
        duration: Duration::from_hours(1),
        gap: Duration::from_mins(1),
    });
    let pose = |random: &mut Rng| -> [f64; 6] {
        std::array::from_fn(|at| {
            let half = if at < 3 { 5.0 } else { 1.4 };
            (random.f64() * 2.0 - 1.0) * half
        })
    };
    let mut nodes = vec![frame(&world, "f0", None, [0.0; 6])];
    let mut told = Told {
        frames: Vec::new(),
        reads: Vec::new(),
    };
    for at in 1..24 {
        let (parent, first) = (random.usize(..at), pose(&mut random));
        nodes.push(frame(&world, &format!("f{at}"), Some(nodes[parent]), first));
        told.frames.push((parent, vec![(0, first)]));
    }
    for step in 1..=200_u64 {
        let now = step * 10_000_000;
        time.store(now, Ordering::Relaxed);
        for _ in 0..random.usize(1..6) {
            let at = random.usize(1..nodes.len());
            let next = pose(&mut random);
            let poses = &mut told.frames[at - 1].1;
            if poses.last().is_none_or(|(last, _)| *last < now) {
                place(&world, nodes[at], next);
                poses.push((now, next));
            }
        }
    }
    for _ in 0..count {
        let (to, from) = (random.usize(..nodes.len()), random.usize(..nodes.len()));
        let at = random.u64(..=2_000_000_000);
        let moment = world.at(Time::from_nanos(at)).expect("a moment");
        let frame = |node| moment.version().frame(node).expect("a frame");
        let found = moment.between(frame(nodes[to]), frame(nodes[from]));
        told.reads
            .push((to, from, at, cells(&found.expect("one tree"))));
    }
    told
}

#[test]
fn ten_thousand_reads_of_the_past_are_those_of_scipy() {
    let test = "ten_thousand_reads_of_the_past_are_those_of_scipy";
    let Some(python) = rc_test_support::python::interpreter("scipy==1.17.1", test) else {
        return;
    };
    let told = moved(10_000, 3);
    let name = |at: usize| format!("f{at}");
    let frames = told.frames.iter().enumerate();
    let poses: serde_json::Map<String, Value> = frames
        .clone()
        .map(|(at, (_, poses))| (name(at + 1), json!(poses)))
        .collect();
    let parents: serde_json::Map<String, Value> = frames
        .map(|(at, (parent, _))| (name(at + 1), json!(name(*parent))))
        .collect();
    let reads: Vec<Value> = told
        .reads
        .iter()
        .map(|(to, from, at, cells)| json!([name(*to), name(*from), at, cells]))
        .collect();
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("reads.json");
    let text = json!({ "poses": poses, "parents": parents, "reads": reads });
    std::fs::write(&file, text.to_string()).expect("a file");
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/all/tf.py");
    let output = Command::new(python).arg(script).arg(&file).output();
    let output = output.expect("python");
    let told = String::from_utf8_lossy(&output.stdout);
    assert!(
        output.status.success(),
        "{told}{}",
        String::from_utf8_lossy(&output.stderr)
    );
    print!("{told}");
}

/// Builds the program of `tf2.cpp` with the headers of the system, or of unpacked packages.
fn build(place: Option<&Path>, program: &Path) -> Option<String> {
    let root = place.map_or_else(|| "/usr".into(), |place| place.join("usr"));
    let libraries = root.join("lib/x86_64-linux-gnu");
    let source = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/all/tf2.cpp");
    let built = Command::new("g++")
        .args(["-O1", "-w", source, "-I"])
        .arg(root.join("include"))
        .arg("-L")
        .arg(&libraries)
        .args(["-ltf2", "-lrostime", "-Wl,--allow-shlib-undefined", "-o"])
        .arg(program)
        .output()
        .ok()?;
    built
        .status
        .success()
        .then(|| libraries.display().to_string())
}

/// Beyond the newest pose of any frame on the way, tf2 does not answer; the world has the last pose until its
/// newest change.
#[test]
fn reads_of_the_past_are_those_of_tf2() {
    let test = "reads_of_the_past_are_those_of_tf2";
    let folder = tempfile::tempdir().expect("a folder");
    let program = folder.path().join("tf2");
    let works = |place: Option<&Path>| build(place, &program).is_some();
    let place = match rc_test_support::debian::provided("libtf2-dev", &works) {
        Ok(place) => place,
        Err(reason) => {
            println!("skipped: {test}: {reason}");
            return;
        }
    };
    let libraries = build(place.as_deref(), &program).expect("it was built before");
    let told = moved(10_000, 5);
    let mut input = String::new();
    for (at, (parent, poses)) in told.frames.iter().enumerate() {
        for (time, pose) in poses {
            let turn = transform(*pose).isometry().rotation;
            let _ = writeln!(
                input,
                "set f{parent} f{} {} {} {} {} {} {} {} {}",
                at + 1,
                // tf2 takes a time of 0 for the newest one.
                time + 1_000_000_000,
                pose[0],
                pose[1],
                pose[2],
                turn.i,
                turn.j,
                turn.k,
                turn.w
            );
        }
    }
    for (to, from, time, _) in &told.reads {
        let _ = writeln!(input, "get f{to} f{from} {}", time + 1_000_000_000);
    }
    let mut child = Command::new(&program)
        .env("LD_LIBRARY_PATH", libraries)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("the program");
    let mut stdin = child.stdin.take().expect("a pipe");
    let writer = std::thread::spawn(move || stdin.write_all(input.as_bytes()));
    let output = child.wait_with_output().expect("the program");
    writer.join().expect("a thread").expect("it reads all");
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8(output.stdout).expect("a text");
    assert_eq!(text.lines().count(), told.reads.len());
    let (mut answered, mut worst) = (0, 0.0_f64);
    for (line, (to, from, time, cells)) in text.lines().zip(&told.reads) {
        if line == "none" {
            continue;
        }
        answered += 1;
        assert_eq!(line.split(' ').count(), cells.len(), "{line}");
        let numbers = line.split(' ').map(str::parse::<f64>);
        for (found, expected) in numbers.zip(cells) {
            let apart = (found.expect("a number") - expected).abs();
            worst = worst.max(apart);
            assert!(apart < 1e-6, "f{to} f{from} {time}: {line}, not {cells:?}");
        }
    }
    println!(
        "tf2 answered {answered} of {} reads, the greatest difference is {worst:.1e}",
        told.reads.len()
    );
    assert!(answered > 1000, "{answered}");
}

/// "Multiple assumptions in the numerical choice": the schema says which numbers a pose has, in which unit, and a
/// reader in another unit is told or gets a conversion.
#[test]
fn tf_1_the_numbers_of_a_pose_are_declared_with_their_units() {
    let text = r#"Domain test
{
    entity Frame { name string; };
    relation RT
    {
        parent Frame;
        child Frame;
        by float[3] unit "mm" -1000:1000;
        turn float[3] unit "rad";
        tree interpolated(by, turn);
    };
};
"#;
    let (world, _) = world(text);
    let refused = world.change(|edit| {
        let (a, b) = (edit.add_node("Frame")?, edit.add_node("Frame")?);
        edit.set(a, "name", "a")?;
        edit.set(b, "name", "b")?;
        let edge = edit.add_edge("RT", a, b)?;
        edit.set(edge, "turn", [0.0; 3])?;
        Ok(edit.set(edge, "by", [1500.0, 0.0, 0.0])?)
    });
    let reason = refused.expect_err("it is out of its range").to_string();
    assert!(reason.contains("-1000:1000 mm"), "{reason}");
    assert_eq!(world.snapshot().node_count(), 0);
    let made = world.change_with(|edit| {
        let (a, b) = (edit.add_node("Frame")?, edit.add_node("Frame")?);
        edit.set(a, "name", "a")?;
        edit.set(b, "name", "b")?;
        let edge = edit.add_edge("RT", a, b)?;
        edit.set(edge, "turn", [0.0; 3])?;
        edit.set(edge, "by", [500.0, 0.0, 0.0])?;
        Ok(())
    });
    made.expect("a change");
    // Those who draw it in another unit convert by what the schema says.
    let tree = graph_exchange::innermodel::tree(&world.snapshot());
    let below = tree.find("b").expect("a frame");
    assert_eq!(
        tree.nodes[below].pose.translation,
        [-0.0, 0.0, 500.0].map(|x: f64| x + 0.0)
    );
}

/// "Without symbolic reference to the relation between frames and their measurements": both are elements with types.
#[test]
fn tf_2_a_frame_has_a_type_and_relations_to_others() {
    let text = "import \"geometry.gdsl\";\nDomain test { entity door :Frame { }; relation leads_to { door door; where Frame; }; };\n";
    let (world, _) = world(text);
    let room = frame(&world, "room", None, [0.0; 6]);
    let made = world.change_with(|edit| {
        let door = edit.add_node("door")?;
        edit.set(door, "name", "front")?;
        let edge = edit.add_edge("RT", room, door)?;
        edit.set(edge, "pose", [1.0, 0.0, 0.0, 0.0, 0.0, 0.0])?;
        edit.add_edge("leads_to", door, room)?;
        Ok(door)
    });
    let (door, _) = made.expect("a door");
    let now = world.snapshot();
    assert!(
        now.schema()
            .is_a(now.node(door).expect("a node").type_name(), "Frame")
    );
    let leads = now.symbol("leads_to").expect("a relation");
    assert_eq!(now.out(door, leads).collect::<Vec<_>>(), [room]);
    assert_eq!(
        now.pose(room, door).expect("a pose").translation,
        [1.0, 0.0, 0.0]
    );
}

/// "Frames are only a small subset of the geometric primitives": vectors and polygons are in the same world, and their
/// points are transformed by it.
#[test]
fn tf_3_vectors_and_polygons_are_in_the_world() {
    let text = "import \"geometry.gdsl\";\nDomain test { entity area :Frame { x float[] unit \"m\"; y float[] unit \"m\"; }; };\n";
    let (world, _) = world(text);
    let room = frame(&world, "room", None, [0.0; 6]);
    let made = world.change_with(|edit| {
        let area = edit.add_node("area")?;
        edit.set(area, "name", "carpet")?;
        edit.set(area, "x", [0.0, 2.0, 2.0, 0.0])?;
        edit.set(area, "y", [0.0, 0.0, 1.0, 1.0])?;
        let edge = edit.add_edge("RT", room, area)?;
        edit.set(edge, "pose", [3.0, 0.0, 0.0, 0.0, 0.0, 0.0])?;
        let spot = edit.add_node("Position")?;
        edit.set(spot, "coordinates", [0.5, 0.5, 0.0])?;
        edit.add_edge("of", spot, area)?;
        edit.add_edge("with_respect_to", spot, room)?;
        Ok((area, spot))
    });
    let ((area, spot), _) = made.expect("a carpet");
    let now = world.snapshot();
    let numbers = |name: &str| {
        now.get(area, name)
            .and_then(property_graph::Value::numbers)
            .expect("numbers")
            .into_owned()
    };
    let (to, from) = (
        now.frame(room).expect("a frame"),
        now.frame(area).expect("a frame"),
    );
    let corners: Vec<f64> = numbers("x")
        .iter()
        .zip(numbers("y"))
        .map(|(x, y)| {
            now.transform(to, Point::new(*x, y, 0.0), from)
                .expect("one tree")
                .x
        })
        .collect();
    assert_eq!(corners, [3.0, 5.0, 5.0, 3.0]);
    assert!(now.get(spot, "coordinates").is_some());
}

/// "Only trees, with no loops": a second way to a frame is kept as it is, and its disagreement is known.
#[test]
fn tf_4_a_loop_is_kept() {
    let (world, _) = world(GEOMETRY);
    let a = frame(&world, "a", None, [0.0; 6]);
    let b = frame(&world, "b", Some(a), [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let c = frame(&world, "c", Some(b), [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let seen = world.change(|edit| {
        let edge = edit.add_edge("loop_closure", a, c)?;
        Ok(edit.set(edge, "pose", [2.25, 0.0, 0.0, 0.0, 0.0, 0.0])?)
    });
    seen.expect("a second way");
    let now = world.snapshot();
    let ways = now.other_chains(a, c).expect("chains").count();
    assert_eq!((now.loops().count(), ways), (1, 1));
    let other = World::new(Setup::new("other", Arc::clone(now.schema())));
    world.meet(&other).expect("one schema");
    assert_eq!(other.snapshot().loops().count(), 1);
}

/// "Other world model information cannot be referred to": a measurement refers to the edge with the pose it gave.
#[test]
fn tf_5_an_edge_can_be_referred_to() {
    let text = "import \"measurement.gdsl\";\nDomain test { };\n";
    let (world, _) = world(text);
    let a = frame(&world, "a", None, [0.0; 6]);
    let b = frame(&world, "b", Some(a), [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let made = world.change(|edit| {
        let edge = edit.snapshot().in_edges(b, None).next();
        let edge = edge.expect("an edge").edge_id();
        let pose = edit.node_of(edge)?;
        let measured = edit.add_node("Measurement")?;
        edit.set(measured, "time", 12.5)?;
        edit.add_edge("measured_by", pose, measured)?;
        Ok(())
    });
    made.expect("a reference");
    let other = World::new(Setup::new("other", Arc::clone(world.snapshot().schema())));
    world.meet(&other).expect("one schema");
    let now = other.snapshot();
    let edge = now.promoted().next().expect("an edge that is referred to");
    let pose = now.node_of(edge.edge_id()).expect("its node");
    let by = now.symbol("measured_by").expect("a relation");
    let measured = now.out(pose, by).next().expect("a measurement");
    assert_eq!(now.get(measured, "time"), Some(&12.5.into()));
}

/// "Each consumer needs to reconstruct the full tree", and static transforms are sent again and again: what does not
/// change is sent once, and one who joins late gets it once.
#[test]
fn tf_6_what_does_not_change_is_sent_once() {
    let mut network = Network::new(3, CALM, 1);
    network.turn = 20;
    add(network.at(0), "room", "kitchen");
    network.run(Duration::from_mins(1));
    assert_eq!(network.sent.get(&Topic::Change), Some(&1));
    let late = network.world(2, Rights::everything());
    network.worlds[2] = Some(late);
    network.converge(Duration::from_secs(10));
    assert!(network.at(2).snapshot().named("kitchen").next().is_some());
    assert_eq!(network.sent.get(&Topic::Change), Some(&1));
}

/// "Data consistency cannot be checked, as well as latencies, freshness": all of a change arrives together, a time of which
/// nothing is known is refused, and equal digests are equal worlds.
#[test]
fn tf_7_consistency_and_freshness_are_said() {
    let (world, time) = world(GEOMETRY);
    time.store(1_000_000_000, Ordering::Relaxed);
    let a = frame(&world, "a", None, [0.0; 6]);
    let b = frame(&world, "b", Some(a), [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let c = frame(&world, "c", Some(b), [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let other = World::new(Setup::new("other", Arc::clone(world.snapshot().schema())));
    let pump = || {
        world.turn(Duration::ZERO);
        while let Some(message) = world.take() {
            other.receive(Duration::ZERO, through_bytes(&message));
        }
    };
    pump();
    for step in 1..200 {
        time.fetch_add(1_000_000, Ordering::Relaxed);
        let x = f64::from(step);
        let moved = world.change(|edit| {
            for node in [b, c] {
                let edge = edit.snapshot().in_edges(node, None).next();
                let edge = edge.expect("an edge").edge_id();
                edit.set(edge, "pose", [x, 0.0, 0.0, 0.0, 0.0, 0.0])?;
            }
            Ok(())
        });
        let token = moved.expect("a change");
        pump();
        assert!(other.has(token));
        let now = other.snapshot();
        let node = |name: &str| now.named(name).next().expect("a frame");
        let both = now.pose(node("a"), node("c")).expect("a pose").translation;
        assert_eq!(both, [2.0 * x, 0.0, 0.0], "both moved in one version");
    }
    // What is not kept any more is not guessed.
    world.keep(Keep {
        duration: Duration::from_millis(100),
        ..Keep::default()
    });
    let early = world.at(Time::from_millis(1001)).map(|_| ());
    assert_eq!(early, Err(Error::TooEarly.into()));
    let status = |world: &World| world.status(Duration::ZERO).digest;
    assert_eq!(status(&world), status(&other));
}

/// "Every node can publish a transform frame, anytime": a component writes what its clause says, and names clash in a
/// way that all see alike.
#[test]
fn tf_8_only_who_may_write_a_pose_does() {
    let (world, _) = world(GEOMETRY);
    let a = frame(&world, "a", None, [0.0; 6]);
    frame(&world, "b", Some(a), [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let schema = Arc::clone(world.snapshot().schema());
    let rights = Rights::nothing().with_type("Frame");
    let reader = World::new(Setup::new("reader", schema).with_rights(rights));
    world.meet(&reader).expect("one schema");
    let refused = reader.change(|edit| {
        let edge = edit.snapshot().edges().next().expect("an edge").edge_id();
        Ok(edit.set(edge, "pose", [9.0, 0.0, 0.0, 0.0, 0.0, 0.0])?)
    });
    let reason = refused.expect_err("it is not its").to_string();
    assert!(
        reason.contains("does not write `RT`") || reason.contains("does not write `RT.pose`"),
        "{reason}"
    );
    // Nothing has left the replica.
    while let Some(message) = reader.take() {
        assert_ne!(message.topic(), Topic::Change);
    }
}
