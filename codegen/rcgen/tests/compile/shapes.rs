//! Machines as users write them, generated and compiled: random events lead each to its end. Run by
//! `tests/compile.rs`, which puts the machines with their events into the list below.

use std::time::Duration;

macro_rules! run_to_its_end {
    ($($shape:ident: $($event:ident,)*;)*) => {$(
        #[test]
        fn $shape() {
            use shapes::$shape::machine::Event;
            use shapes::$shape::testing::TestContext;
            use shapes::$shape::{Context, StateMachine, Worker, WorkerError};

            struct Idle;

            impl Worker<Context> for Idle {
                fn initialize(_ctx: &mut Context) -> Result<Self, WorkerError> {
                    Ok(Self)
                }
            }

            impl StateMachine for Idle {}

            let events = [$(Event::$event),*];
            for seed in 1..=5_u64 {
                let mut test = TestContext::new();
                let mut worker: Idle = test.start().unwrap();
                let mut random = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
                let mut fired = 0;
                while !test.machine.has_ended() {
                    random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                    test.machine.fire(events[(random >> 33) as usize % events.len()]);
                    test.run(&mut worker, Duration::from_nanos(1)).unwrap();
                    fired += 1;
                    assert!(fired < 100_000, "seed {seed}: {:?}", test.machine.active());
                }
            }
        }
    )*};
}

run_to_its_end! {
    // MACHINES
}
