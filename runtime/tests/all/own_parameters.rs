//! A worker that changes a parameter of its own in lockstep.

use crate::time::{FOLLOWER, end, network, note, script, source, until};
use rc_runtime::{Component, Core, Description, Ports, StartError, Values, WorkerError, embed};

static COUNTING: Description = Description {
    name: "counting",
    parameters: Some(
        r#"{"name":"counting","parameters":[
        {"name":"runs","kind":{"scalar":{"type":"int"}},"default":{"int":0},"editable":true}],"rules":[]}"#,
    ),
    slots: &[],
    ..FOLLOWER
};

/// Counts its computes, in a parameter too.
struct Counting {
    core: Core,
    runs: i64,
    parameter: i64,
}

impl Counting {
    #[expect(clippy::unnecessary_wraps, reason = "the runtime expects a `Result`")]
    fn start(core: Core, _: &Ports, values: &Values) -> Result<Self, StartError> {
        Ok(Self {
            core,
            runs: 0,
            parameter: values.int("runs"),
        })
    }
}

impl Component for Counting {
    fn core(&mut self) -> &mut Core {
        &mut self.core
    }

    fn compute(&mut self) -> Result<(), WorkerError> {
        self.runs += 1;
        note(
            &self.core,
            format!("{} after {}", self.runs, self.parameter),
        );
        self.core.set_parameter("runs", self.runs);
        Ok(())
    }

    fn set_parameters(&mut self, values: &Values) {
        self.parameter = values.int("runs");
    }
}

/// Ticks follow each other as fast as the workers are done.
#[test]
fn in_lockstep_a_requested_change_is_made_in_its_tick() {
    const RUNS: i64 = 50;
    let network = network("own");
    script(&network, |script| script.ticks = 100);
    let source = source(&network, "source", &["--followers", "counting"]);
    let args = ["--network", &network, "--clock", "simulated"];
    let counting = embed(&COUNTING, Counting::start, &args).expect("a follower");
    until(&network, |script| script.last_tick == 100);
    end([counting, source]);
    let trace = script(&network, |script| std::mem::take(&mut script.trace));
    let trace: Vec<String> = trace.into_iter().map(|(_, _, what)| what).collect();
    let expected: Vec<String> = (1..=RUNS)
        .map(|run| format!("{run} after {}", run - 1))
        .collect();
    assert_eq!(trace, expected);
}
