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

/// A source, and a component that receives from it with handlers of these budgets, each with the rate of
/// its messages.
fn receiver(period: u64, handlers: &[(u64, Rate)]) -> [Component; 2] {
    let source = Component {
        period: 30 * MS,
        compute: MS,
        handlers: Vec::new(),
    };
    let handlers = handlers.iter().map(|(budget, rate)| Handler {
        budget: *budget,
        depth: 10,
        arrivals: vec![Arrival {
            rate: *rate,
            transport: 200 * US,
        }],
    });
    let receiver = Component {
        period,
        compute: MS,
        handlers: handlers.collect(),
    };
    [source, receiver]
}

/// Messages from outside may come all the time. Only the end of a turn lets others in.
#[test]
fn beside_messages_of_unknown_rate_a_turn_is_the_bound() {
    let handlers = [(MS, Rate::Compute(0)), (3 * MS, Rate::Unknown)];
    let of = loads(&receiver(20 * MS, &handlers));
    // A turn of 103 ms and its `compute()`, then five rounds, because as many messages came meanwhile.
    assert_eq!(of[1].handled[0], Some((103 + 1 + 5 * 4) * MS));
    // A turn, and the one that computes.
    assert_eq!(of[1].computed, Some(2 * (103 + 1) * MS));
    assert_eq!(of[1].waiting(0), None);
}

#[test]
fn data_are_as_old_as_the_next_message_is_late() {
    let [source, relay] = receiver(100 * MS, &[(MS, Rate::Compute(0))]);
    let [_, sink] = receiver(20 * MS, &[(MS, Rate::Handler(1, 0))]);
    let components = [source, relay, sink];
    let of = loads(&components);
    let hop = |component, way| Hop {
        component,
        handler: 0,
        way,
        transport: 200 * US,
        collected: 0,
    };
    let hops = [hop(1, Way::Handler), hop(2, Way::Compute)];
    let first = gap(Rate::Compute(0), &components, &of);
    assert_eq!(first, Some(31 * MS));
    // The gap at the source, the way of the next message to the sink, and the turn there.
    let expected = 31 * MS + (200 * US + 2 * MS + 200 * US) + 2 * MS;
    assert_eq!(age(&hops, first, &components, &of), Some(expected));
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
