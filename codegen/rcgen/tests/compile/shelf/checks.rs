//! Slot arrays of managed components that meet in one process; run by `tests/compile.rs`.

use rc_middleware::RunDirectory;
use shelf_generated::{
    Context, FullPoseEuler, LaserConfData, Lasers, Member, TBaseState, TData, Tracks, Worker,
    WorkerError, embed,
};
use std::io::{BufRead, BufReader, Write};
use std::os::unix::net::UnixStream;
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// The records of the workers.
static SEEN: Mutex<Vec<String>> = Mutex::new(Vec::new());

fn see(what: String) {
    let mut seen = SEEN.lock().expect("the list");
    if !seen.contains(&what) {
        seen.push(what);
    }
}

fn await_all(expected: &[&str]) {
    let start = Instant::now();
    loop {
        let seen = SEEN.lock().expect("the list").clone();
        if expected
            .iter()
            .all(|what| seen.iter().any(|seen| seen == what))
        {
            return;
        }
        assert!(start.elapsed() < Duration::from_secs(30), "{seen:?}");
        std::thread::yield_now();
    }
}

/// Answers and publishes the number of the member, from 1.
struct Shelf;

impl Worker<Context> for Shelf {
    fn initialize(ctx: &mut Context) -> Result<Self, WorkerError> {
        ctx.lasers.open_listed()?;
        ctx.sources.open_listed()?;
        ctx.poses.open_listed()?;
        ctx.tracks.open_listed()?;
        Ok(Self)
    }

    fn configure(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        // The members stay through all states.
        let late = ctx.lasers.open("late").map(|_| ()).expect_err("too late");
        let names: Vec<&str> = ctx.lasers.members().iter().map(Member::name).collect();
        see(format!("{} configured with {names:?}: {late}", ctx.name()));
        Ok(())
    }

    fn compute(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        for (member, source) in ctx.sources.iter_mut() {
            let name = member.name();
            match source.get_laser_data() {
                Ok(scan) => see(format!("{name} measures {}", scan[0].dist)),
                Err(_) => see(format!("{name} is refused")),
            }
        }
        for (member, topic) in ctx.poses.iter_mut() {
            topic.new_full_pose(&FullPoseEuler {
                x: (member.index() + 1) as f32,
                ..FullPoseEuler::default()
            })?;
        }
        Ok(())
    }
}

impl Lasers<Context> for Shelf {
    fn get_laser_data(&mut self, _ctx: &mut Context, member: &Member) -> Vec<TData> {
        let dist = 1000.0 * (member.index() + 1) as f32;
        vec![TData { angle: 0.0, dist }]
    }

    fn get_laser_and_b_state_data(
        &mut self,
        ctx: &mut Context,
        member: &Member,
    ) -> (Vec<TData>, TBaseState) {
        (self.get_laser_data(ctx, member), TBaseState::default())
    }

    fn get_laser_conf_data(&mut self, _ctx: &mut Context, _member: &Member) -> LaserConfData {
        LaserConfData::default()
    }
}

impl Tracks<Context> for Shelf {
    fn new_full_pose(&mut self, _ctx: &mut Context, member: &Member, pose: FullPoseEuler) {
        see(format!("{} hears {}", member.name(), pose.x));
    }
}

/// Asks a component for a transition, and returns its reply.
fn change(network: &str, name: &str, transition: &str) -> String {
    let socket = RunDirectory::of(network).socket(name);
    let mut stream = UnixStream::connect(socket).expect("its socket");
    let request = format!(
        r#"{{"jsonrpc": "2.0", "id": 1, "method": "lifecycle", "params": {{"transition": "{transition}"}}}}"#
    );
    writeln!(stream, "{request}").expect("a request");
    let mut line = String::new();
    BufReader::new(stream)
        .read_line(&mut line)
        .expect("a reply");
    line
}

#[test]
fn members_live_and_rest_with_their_component() {
    let network = format!("shelf-{}", std::process::id());
    let head = [
        "--network",
        &network,
        "--name",
        "head",
        "--members",
        "lasers=left,right",
        "--members",
        "poses=left,right",
    ];
    let head = embed::<Shelf>(&head).expect("a component that runs");
    let binds = [
        format!("sources.a={network}/head/lasers/right"),
        format!("sources.b={network}/head/lasers/left"),
        format!("tracks.a={network}/head/poses/right"),
        format!("tracks.b={network}/head/poses/left"),
    ];
    let mut reader = vec!["--network", &network, "--name", "reader", "--active"];
    reader.extend(["--members", "sources=a,b", "--members", "tracks=a,b"]);
    binds
        .iter()
        .for_each(|bind| reader.extend(["--bind", bind.as_str()]));
    let reader = embed::<Shelf>(&reader).expect("a component that runs");

    let refused = ["a is refused", "b is refused"];
    let served = [
        "a measures 2000",
        "b measures 1000",
        "a hears 2",
        "b hears 1",
    ];
    await_all(&refused);
    for _ in 0..2 {
        let configured = change(&network, "head", "configure");
        assert!(configured.contains("\"inactive\""), "{configured}");
        let active = change(&network, "head", "activate");
        assert!(active.contains("\"active\""), "{active}");
        SEEN.lock()
            .expect("the list")
            .retain(|seen| seen.contains("configured"));
        await_all(&served);
        change(&network, "head", "deactivate");
        SEEN.lock()
            .expect("the list")
            .retain(|seen| seen.contains("configured"));
        await_all(&refused);
        change(&network, "head", "cleanup");
    }
    let of = |members: &str, name: &str| {
        format!(
            "{name} configured with {members}: `lasers.late` comes too late; open members in `initialize`"
        )
    };
    let seen = SEEN.lock().expect("the list").clone();
    let of_head = of(r#"["left", "right"]"#, "head");
    let is_told = |line: &&String| line.starts_with("head configured");
    let told: Vec<&String> = seen.iter().filter(is_told).collect();
    assert_eq!(told, [&of_head]);
    reader.stop();
    reader.join().expect("an orderly end");
    head.stop();
    head.join().expect("an orderly end");
}
