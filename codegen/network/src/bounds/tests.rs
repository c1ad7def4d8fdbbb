//! Loads without a bound. `deploy/tests/all/network/bounds.rs` compares bounds with a simulation.

use super::*;

const US: u64 = 1_000;
const MS: u64 = 1_000_000;

#[test]
fn more_work_than_time_is_told() {
    let source = Component {
        period: MS,
        compute: 10 * US,
        handlers: Vec::new(),
    };
    let arrival = Arrival {
        rate: Rate::Compute(0),
        transport: 0,
    };
    let sink = Component {
        period: 10 * MS,
        compute: MS,
        handlers: vec![Handler {
            budget: 2 * MS,
            depth: 10,
            arrivals: vec![arrival],
        }],
    };
    let of = loads(&[source, sink]);
    assert!(!of[0].is_overloaded && of[1].is_overloaded);
    // Ten rounds of 2 ms, a run that has begun, and the periods in between.
    assert_eq!(of[1].handled, [Some(25 * MS)]);
}

/// A component whose `compute()` takes its whole period never gets to its messages.
#[test]
fn a_compute_without_end_has_no_bound() {
    let busy = Component {
        period: MS,
        compute: MS,
        handlers: vec![Handler::default()],
    };
    let of = loads(&[busy]);
    assert_eq!((of[0].handled[0], of[0].computed), (None, None));
}
