//! The worker without processes. This file is yours: rcgen wrote it once and never touches it again.

use asker::SpecificWorker;
use asker_generated::testing::TestContext;
use asker_generated::{Worker, WorkerError};

#[test]
fn the_worker_runs_for_a_second() -> Result<(), WorkerError> {
    let mut test = TestContext::configured()?;
    // `test.other` answers the worker's calls of `BatteryStatus` and keeps them.
    // `test.far_other` answers the worker's calls of `BatteryStatus` and keeps them.
    test.answer_defaults();
    let mut worker = SpecificWorker::initialize(&mut test)?;
    test.run(&mut worker, std::time::Duration::from_secs(1))
}
