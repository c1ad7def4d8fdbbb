//! A component whose optional peers are missing runs; run by `tests/compile.rs`.

use lone_generated::testing::embed_with_defaults;
use lone_generated::{CallError, Context, Worker, WorkerError, embed};

/// Calls both peers in each of three periods, then stops.
struct Alone {
    periods: usize,
}

impl Worker<Context> for Alone {
    fn initialize(ctx: &mut Context) -> Result<Self, WorkerError> {
        assert!(!ctx.laser.is_connected() && !ctx.base.is_connected());
        Ok(Self { periods: 0 })
    }

    fn compute(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        let scan = ctx.laser.get_laser_data();
        assert!(matches!(scan, Err(CallError::NoServer(_))), "{scan:?}");
        let stopped = ctx.base.stop_base();
        assert!(
            matches!(stopped, Err(CallError::NoServer(_))),
            "{stopped:?}"
        );
        self.periods += 1;
        if self.periods == 3 {
            ctx.stop("done");
        }
        Ok(())
    }
}

/// Gets default values in place of its peers, then stops.
struct Supplied;

impl Worker<Context> for Supplied {
    fn initialize(ctx: &mut Context) -> Result<Self, WorkerError> {
        assert!(ctx.laser.is_connected() && ctx.base.is_connected());
        Ok(Self)
    }

    fn compute(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        assert_eq!(ctx.laser.get_laser_data(), Ok(Vec::new()));
        assert_eq!(ctx.base.get_base_pose(), Ok((0, 0, 0.0)));
        assert_eq!(ctx.base.stop_base(), Ok(()));
        ctx.stop("done");
        Ok(())
    }
}

#[test]
fn operations_that_no_server_answers_have_default_values() {
    let network = format!("supplied-{}", std::process::id());
    let arguments = ["--network", network.as_str()];
    let supplied = embed_with_defaults::<Supplied>(&arguments).expect("a component that runs");
    supplied.join().expect("a period without a panic");
}

#[test]
fn it_runs_and_calls_fail_at_once() {
    let network = format!("lone-{}", std::process::id());
    let lone = embed::<Alone>(&["--network", &network]).expect("a component that runs");
    lone.join().expect("three periods without a panic");
}
