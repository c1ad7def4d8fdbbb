//! Operations bound to states, events from outside, and random events until the end; run by
//! `tests/compile.rs`.

use arm_generated::machine::{Event, State};
use arm_generated::testing::TestContext;
use arm_generated::{CallError, Context, Joint, StateMachine, Worker, WorkerError};
use std::io::{BufRead, BufReader, Write};
use std::os::unix::net::UnixStream;
use std::sync::Mutex;
use std::time::{Duration, Instant};

const LIMIT: Duration = Duration::from_secs(30);

/// Speeds that the handlers of the server received.
static SPEEDS: Mutex<Vec<f32>> = Mutex::new(Vec::new());
/// The last result of the caller.
static RESULT: Mutex<Option<Result<f32, CallError>>> = Mutex::new(None);

struct Server;

impl Worker<Context> for Server {
    fn initialize(_ctx: &mut Context) -> Result<Self, WorkerError> {
        Ok(Self)
    }
}

impl StateMachine for Server {}

impl Joint<Context> for Server {
    fn position(&mut self, ctx: &mut Context) -> f32 {
        let pose = ctx.limb.fk(&[0.0, 0.5]).pose_hand_in_base;
        pose[0][3] as f32
    }

    fn turn(&mut self, _ctx: &mut Context, speed: f32) {
        SPEEDS.lock().unwrap().push(speed);
    }
}

/// Sends a command and a query in each period.
struct Caller;

impl Worker<Context> for Caller {
    fn initialize(_ctx: &mut Context) -> Result<Self, WorkerError> {
        Ok(Self)
    }

    fn compute(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        ctx.other.turn(1.5)?;
        let result = ctx.other.position();
        *RESULT.lock().unwrap() = Some(result);
        Ok(())
    }
}

impl StateMachine for Caller {}

impl Joint<Context> for Caller {
    fn position(&mut self, _ctx: &mut Context) -> f32 {
        0.0
    }

    fn turn(&mut self, _ctx: &mut Context, _speed: f32) {}
}

/// Waits until the caller has this result.
fn wait_for(expected: &Result<f32, CallError>) {
    let end = Instant::now() + LIMIT;
    loop {
        let result = RESULT.lock().unwrap().clone();
        if result.as_ref() == Some(expected) {
            return;
        }
        assert!(Instant::now() < end, "{result:?}, and not {expected:?}");
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// Asks the server over its management socket.
fn ask(network: &str, method: &str, parameters: &str) -> String {
    let user = std::fs::metadata("/proc/self").map(|file| {
        use std::os::unix::fs::MetadataExt;
        file.uid()
    });
    let folder = match std::env::var("XDG_RUNTIME_DIR") {
        Ok(folder) if !folder.is_empty() => format!("{folder}/robocomp"),
        _ => format!("/dev/shm/robocomp-{}", user.unwrap()),
    };
    let mut socket = UnixStream::connect(format!("{folder}/{network}/server.sock")).unwrap();
    socket.set_read_timeout(Some(LIMIT)).unwrap();
    let request = format!(
        "{{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"{method}\",\"params\":{parameters}}}\n"
    );
    socket.write_all(request.as_bytes()).unwrap();
    let mut line = String::new();
    BufReader::new(socket).read_line(&mut line).unwrap();
    line
}

fn fire(network: &str, event: &str) -> String {
    ask(network, "fire", &format!("{{\"event\":\"{event}\"}}"))
}

#[test]
fn a_state_refuses_calls_and_events_change_it() {
    let network = "arm-states";
    let args = ["--network", network, "--name", "server"];
    let server = arm_generated::embed::<Server>(&args).unwrap();
    let own = format!("Joint={network}/caller");
    let args = ["--network", network, "--name", "caller", "--bind", &own];
    let caller = arm_generated::embed::<Caller>(&args).unwrap();
    let unavailable = |state: &str| {
        let state = state.to_owned();
        Err(CallError::Unavailable { state })
    };
    wait_for(&unavailable("compute"));
    assert_eq!(SPEEDS.lock().unwrap().len(), 0);
    let reply = fire(network, "ComputeToWorking");
    let states = r#"{"states":["working.joint.holding","working.hand.open"]}"#;
    assert!(reply.contains(states), "{reply}");
    wait_for(&Ok(0.5));
    let reply = fire(network, "HoldingToCompliant");
    assert!(reply.contains("working.joint.compliant"), "{reply}");
    wait_for(&unavailable("working.joint.compliant, working.hand.open"));
    let speeds = SPEEDS.lock().unwrap().len();
    assert!(speeds > 0);
    // Events without a transition, internal events, and events that do not exist.
    for (event, expected) in [
        (
            "HoldingToCompliant",
            "no transition takes `HoldingToCompliant` in `working.joint.compliant`, `working.hand.open`",
        ),
        (
            "OpenToClosing",
            "`OpenToClosing` may not be fired from outside",
        ),
        ("ComputeToWorkin", "did you mean `ComputeToWorking`?"),
    ] {
        let reply = fire(network, event);
        assert!(reply.contains(expected), "{reply}");
    }
    let status = ask(network, "status", "{}");
    let refused = status.split("\"refused\":").nth(1).unwrap();
    let refused = refused.split([',', '}']).next().unwrap();
    assert!(refused.parse::<u64>().unwrap() > 1, "{status}");
    assert!(status.contains(r#""errors":0"#), "{status}");
    fire(network, "CompliantToHolding");
    wait_for(&Ok(0.5));
    assert!(SPEEDS.lock().unwrap().len() > speeds);
    caller.stop();
    caller.join().unwrap();
    fire(network, "WorkingToFinalize");
    server.join().unwrap();
}

/// Counts how often it enters `compute`.
#[derive(Default)]
struct Counting(u32);

impl Worker<Context> for Counting {
    fn initialize(_ctx: &mut Context) -> Result<Self, WorkerError> {
        Ok(Self::default())
    }
}

impl StateMachine for Counting {
    fn entry_compute(&mut self, _ctx: &mut Context) -> Result<(), WorkerError> {
        self.0 += 1;
        Ok(())
    }
}

/// The context has the solvers of the robot, whose names and limits the tests see as well.
#[test]
fn a_context_has_the_solvers_of_a_robot() {
    let mut test = TestContext::new();
    let _worker: Counting = test.start().unwrap();
    let limb = test.limb;
    assert_eq!(limb.joints(), &["swing", "slide"]);
    let positions = [0.7, 0.3];
    let target = limb.fk(&positions).pose_hand_in_base;
    let answer = limb.reach(&target, &[0.0, 0.5]);
    assert!(answer.reached);
    for (found, wanted) in answer.positions.iter().zip(positions) {
        assert!((found - wanted).abs() < 1e-5);
    }
    let part = [1.5, 0.0, 0.0, 0.0, 0.1, 0.0, 0.0, 0.1, 0.0, 0.1];
    let rest = [0.0; 2];
    let held = limb.hold(&positions, &rest, &rest, &rest, &part);
    assert!(held.efforts.iter().all(|effort| effort.abs() < 1e-9));
    let pushed = limb.push(&positions, &[0.0; 6]);
    assert!(pushed.velocities.iter().all(|rate| rate.abs() < 1e-3));
    assert_eq!(arm_generated::kinematics::limb::UPPER, *limb.upper());
}

#[test]
fn the_machine_of_the_templates_fires_its_events_itself() {
    let mut test = TestContext::new();
    let mut worker: Counting = test.start().unwrap();
    test.run(&mut worker, Duration::from_millis(10)).unwrap();
    // After the start, and at the end of each period.
    assert_eq!(worker.0, 6);
}

#[test]
fn random_events_lead_to_the_end() {
    const EVENTS: [Event; 17] = [
        Event::InitializeToCompute,
        Event::ComputeToCompute,
        Event::ComputeToWorking,
        Event::ComputeToFinalize,
        Event::WorkingToWorking,
        Event::WorkingToResting,
        Event::WorkingToFinalize,
        Event::RestingToMoving,
        Event::RestingToCompute,
        Event::HoldingToMoving,
        Event::HoldingToCompliant,
        Event::MovingToMoving,
        Event::MovingToHolding,
        Event::CompliantToHolding,
        Event::OpenToClosing,
        Event::ClosingToOpen,
        Event::ClosingToBroken,
    ];
    for seed in 1..=20_u64 {
        let mut test = TestContext::new();
        let mut worker: Counting = test.start().unwrap();
        let mut random = seed;
        let mut steps = 0;
        while !test.machine.has_ended() {
            random = random
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            test.machine
                .fire(EVENTS[(random >> 33) as usize % EVENTS.len()]);
            test.run(&mut worker, Duration::from_nanos(1)).unwrap();
            let joint = test.machine.is_in(State::Joint);
            assert_eq!(joint, test.machine.is_in(State::Hand), "both regions");
            steps += 1;
            assert!(steps < 100_000, "seed {seed}");
        }
        assert!(test.is_stopping());
    }
}
