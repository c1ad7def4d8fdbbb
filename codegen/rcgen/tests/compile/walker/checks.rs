//! A worker with a state machine, run to its end; run by `tests/compile.rs`.

use std::sync::Mutex;
use std::time::Duration;
use walker_generated::lifecycle::{LifecycleState, Transition};
use walker_generated::machine::{MachineEvent, MachineState};
use walker_generated::testing::TestContext;
use walker_generated::{Context, StateMachine, Worker, WorkerError};

static LOG: Mutex<Vec<String>> = Mutex::new(Vec::new());

fn log(line: &str) {
    let mut lines = LOG.lock().unwrap();
    if lines.last().is_none_or(|last| last != line) {
        lines.push(line.to_owned());
    }
}

#[derive(Default)]
struct Walker {
    asked: u32,
    stepped: bool,
}

impl Worker<Context> for Walker {
    fn initialize(ctx: &mut Context) -> Result<Self, WorkerError> {
        assert!(!ctx.machine.is_in(MachineState::Idle));
        ctx.machine.fire(MachineEvent::Go);
        Ok(Self::default())
    }

    fn compute(&mut self, _ctx: &mut Context) -> Result<(), WorkerError> {
        log("compute");
        Ok(())
    }

    fn finalize(&mut self, ctx: &mut Context) {
        assert!(ctx.machine.has_ended());
        ctx.machine.fire(MachineEvent::Go);
        log("finalize");
    }
}

impl StateMachine for Walker {
    fn is_ready(&mut self, _ctx: &mut Context) -> bool {
        self.asked += 1;
        self.asked > 2
    }

    fn brake(&mut self, _ctx: &mut Context) -> Result<(), WorkerError> {
        log("brake");
        Ok(())
    }

    fn fall(&mut self, _ctx: &mut Context) -> Result<(), WorkerError> {
        log("fall");
        Err(WorkerError::Failed("it fell".to_owned()))
    }

    fn entry_idle(&mut self, _ctx: &mut Context) -> Result<(), WorkerError> {
        log("entry of idle");
        Ok(())
    }

    fn during_idle(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        log("idle");
        ctx.machine.fire(MachineEvent::Go);
        Ok(())
    }

    fn during_walking(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        if !self.stepped {
            log(&format!("walking in {}", ctx.machine.active().join(" ")));
        }
        Ok(())
    }

    fn during_left(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        log("left");
        self.stepped = true;
        ctx.machine.fire(MachineEvent::Step);
        Ok(())
    }

    fn entry_shut(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        assert!(ctx.machine.is_in(MachineState::Right) && ctx.machine.is_in(MachineState::Walking));
        log(&format!("entry of {}", MachineState::Shut));
        Ok(())
    }

    fn exit_walking(&mut self, _ctx: &mut Context) -> Result<(), WorkerError> {
        log("exit of walking");
        Ok(())
    }

    fn entry_self(&mut self, _ctx: &mut Context) -> Result<(), WorkerError> {
        log("entry of self");
        Ok(())
    }
}

#[test]
fn a_machine_runs_to_its_end() {
    let args = ["--network", "walker-test", "--name", "walker", "--active"];
    let walker = walker_generated::embed::<Walker>(&args).unwrap();
    walker.join().unwrap();
    let expected = [
        "entry of idle",
        "idle",
        "walking in walking.legs.left walking.eyes.open",
        "left",
        "entry of walking.eyes.shut",
        // The states that are active now have no `during` but that of `walking`.
        "exit of walking",
        "brake",
        "fall",
        "entry of self",
        "finalize",
    ];
    assert_eq!(*LOG.lock().unwrap(), expected);
}

/// A guard that panics.
struct Panicking;

impl Worker<Context> for Panicking {
    fn initialize(ctx: &mut Context) -> Result<Self, WorkerError> {
        ctx.machine.fire(MachineEvent::Go);
        Ok(Self)
    }
}

impl StateMachine for Panicking {
    fn is_ready(&mut self, _ctx: &mut Context) -> bool {
        panic!("not at all");
    }

    fn brake(&mut self, _ctx: &mut Context) -> Result<(), WorkerError> {
        Ok(())
    }

    fn fall(&mut self, _ctx: &mut Context) -> Result<(), WorkerError> {
        Ok(())
    }
}

#[test]
fn a_guard_that_panics_ends_the_component() {
    let args = ["--network", "walker-panic", "--name", "walker", "--active"];
    // The component may end before it is seen to run.
    let ended = walker_generated::embed::<Panicking>(&args).and_then(|walker| walker.join());
    assert!(ended.unwrap_err().to_string().contains("panicked"));
}

/// Writes down what runs in `idle`, and fails where the test wants it.
#[derive(Default)]
struct Tested {
    fails: bool,
    idled: bool,
}

impl Worker<Context> for Tested {
    fn initialize(_ctx: &mut Context) -> Result<Self, WorkerError> {
        Ok(Self::default())
    }
}

impl StateMachine for Tested {
    fn is_ready(&mut self, _ctx: &mut Context) -> bool {
        true
    }

    fn brake(&mut self, _ctx: &mut Context) -> Result<(), WorkerError> {
        Ok(())
    }

    fn fall(&mut self, _ctx: &mut Context) -> Result<(), WorkerError> {
        Ok(())
    }

    fn during_idle(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        self.idled = true;
        if self.fails {
            ctx.machine.fire(MachineEvent::Go);
            return Err(WorkerError::Failed("it slipped".to_owned()));
        }
        Ok(())
    }

    fn entry_walking(&mut self, _ctx: &mut Context) -> Result<(), WorkerError> {
        if self.fails {
            return Err(WorkerError::Fatal("it broke".to_owned()));
        }
        Ok(())
    }
}

/// A worker that is active. Its machine starts with its activation, and takes no step before.
fn started<W: Worker<Context> + StateMachine + 'static>(test: &mut TestContext) -> W {
    let mut worker = W::initialize(test).unwrap();
    test.run(&mut worker, MOMENT).unwrap();
    test.transition(&mut worker, Transition::Configure).unwrap();
    assert!(!test.machine.has_started());
    let state = test.transition(&mut worker, Transition::Activate);
    assert_eq!(state, Ok(LifecycleState::Active));
    assert!(test.machine.has_started());
    worker
}

/// Workers that were written for earlier versions compile; `expect` fails without the warning.
#[expect(deprecated, reason = "the name of earlier versions")]
fn earlier() -> walker_generated::State {
    walker_generated::State::Running
}

#[test]
fn the_state_of_the_component_has_a_name_of_its_own() {
    assert_eq!(earlier(), walker_generated::ComponentState::Running);
}

const MOMENT: Duration = Duration::from_nanos(1);

#[test]
fn a_run_handles_the_events_that_wait_before_the_first_period() {
    for state in [
        walker_generated::ComponentState::Running,
        walker_generated::ComponentState::Emergency,
    ] {
        let mut test = TestContext::new();
        let mut worker: Tested = started(&mut test);
        test.machine.fire(MachineEvent::Go);
        test.set_state(state);
        test.run(&mut worker, MOMENT).unwrap();
        assert!(test.machine.is_in(MachineState::Walking), "{state:?}");
        assert!(!worker.idled);
    }
}

#[test]
fn a_fatal_error_of_an_entry_outweighs_a_failed_period() {
    let mut test = TestContext::new();
    let mut worker: Tested = started(&mut test);
    worker.fails = true;
    let result = test.run(&mut worker, MOMENT);
    assert!(matches!(result, Err(WorkerError::Fatal(_))), "{result:?}");
}
