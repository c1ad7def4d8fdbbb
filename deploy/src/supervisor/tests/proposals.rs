//! Changes of parameters of two components: kept by both, or by none.

use super::{Bench, component, exit};
use crate::supervisor::control::ClientRequest;
use crate::supervisor::proposals::Proposals;
use crate::supervisor::unit::Unit;
use rc_deploy_network::NetworkRules;
use rc_management::component::{Changed, ParameterChange};
use rc_management::link::{ComponentMessage, SupervisorMessage};
use rc_management::supervisor::{ParametersChanged, Request};
use serde_json::{Map, json};
use std::collections::BTreeMap;

/// Two ready components, and the changes of their network.
struct Pair {
    proposals: Proposals,
    benches: [Bench; 2],
}

type Results = Vec<Result<ParametersChanged, String>>;

impl Pair {
    fn new() -> Self {
        Self {
            proposals: Proposals::new(NetworkRules::default()),
            benches: ["a", "b"].map(|name| Bench::ready(component(name))),
        }
    }

    /// Asks for a change of both.
    fn ask(&mut self) {
        let one = Map::from_iter([("speed".to_owned(), json!(2))]);
        let names = ["a", "b"].map(str::to_owned);
        let changes = names.map(|name| (name, one.clone())).into();
        let request = ClientRequest::of(1, Request::ParametersSet { changes });
        assert!(self.proposals.take(request).is_none());
    }

    /// The results of changes, and the reasons for those that were taken back.
    fn advance(&mut self, ends: bool) -> (Results, Vec<String>) {
        let units = self.benches.each_mut().map(|bench| {
            let empty = Unit::new(component("empty"), "/nowhere/empty.log".into());
            std::mem::replace(&mut bench.unit, empty)
        });
        let mut units = Vec::from(units);
        let (outcomes, undone) = self.proposals.advance(&mut units, ends);
        for (bench, unit) in self.benches.iter_mut().zip(units) {
            bench.unit = unit;
        }
        let results = outcomes.into_iter().map(|(_, result)| result);
        (results.collect(), undone)
    }

    /// The number of the proposal that each has got.
    fn proposed(&self) -> u64 {
        let numbers = self
            .benches
            .each_ref()
            .map(|bench| match bench.told().as_slice() {
                [SupervisorMessage::Propose { number, changes }] => {
                    assert_eq!(changes.get("speed"), Some(&json!(2)));
                    *number
                }
                other => panic!("{other:?}"),
            });
        assert_eq!(numbers[0], numbers[1]);
        numbers[0]
    }

    fn accept(&mut self, at: usize, number: u64) {
        self.benches[at].say(&ComponentMessage::Proposed {
            number,
            changes: changed(),
            refused: None,
        });
    }

    fn settle(&mut self, at: usize, number: u64) {
        self.benches[at].say(&ComponentMessage::Settled { number });
    }

    fn told_to_settle(&self, at: usize, number: u64) -> bool {
        match self.benches[at].told().as_slice() {
            [SupervisorMessage::Settle { number: of, keep }] => {
                assert_eq!(*of, number);
                *keep
            }
            other => panic!("{other:?}"),
        }
    }

    /// The values that the next run of each restores.
    fn restored(&self) -> [bool; 2] {
        self.benches.each_ref().map(|bench| {
            let line = bench.unit.changes.line(&[]);
            line.is_some_and(|line| line.contains("speed"))
        })
    }
}

fn changed() -> Changed {
    Changed {
        changed: vec![ParameterChange {
            path: "speed".to_owned(),
            old: json!(1),
            new: json!(2),
        }],
        pending: Vec::new(),
    }
}

#[test]
fn a_change_that_all_accept_is_kept_by_all_and_by_their_next_runs() {
    let mut pair = Pair::new();
    pair.ask();
    assert_eq!(pair.advance(false), (Vec::new(), Vec::new()));
    let number = pair.proposed();
    pair.accept(0, number);
    pair.advance(false);
    assert!(pair.benches.iter().all(|bench| bench.told().is_empty()));
    assert_eq!(pair.restored(), [false, false]);
    pair.accept(1, number);
    pair.advance(false);
    // A component that ends from here on starts with it again.
    assert_eq!(pair.restored(), [true, true]);
    assert!(pair.told_to_settle(0, number) && pair.told_to_settle(1, number));
    pair.settle(0, number);
    assert_eq!(pair.advance(false), (Vec::new(), Vec::new()));
    pair.settle(1, number);
    let components = ["a", "b"].map(|name| (name.to_owned(), changed()));
    let components = BTreeMap::from(components);
    let both = ParametersChanged { components };
    assert_eq!(pair.advance(false), (vec![Ok(both)], Vec::new()));
}

#[test]
fn what_one_refuses_is_taken_back_by_the_other() {
    let mut pair = Pair::new();
    pair.ask();
    pair.advance(false);
    let number = pair.proposed();
    pair.accept(0, number);
    pair.benches[1].say(&ComponentMessage::Proposed {
        number,
        changes: Changed::default(),
        refused: Some("too fast".to_owned()),
    });
    let (results, undone) = pair.advance(false);
    assert_eq!(results, []);
    assert_eq!(undone, ["`b` refuses: too fast"]);
    assert!(!pair.told_to_settle(0, number));
    assert_eq!(pair.benches[1].told(), []);
    pair.settle(0, number);
    let refused = "`b` refuses: too fast; nothing has changed".to_owned();
    assert_eq!(pair.advance(false), (vec![Err(refused)], Vec::new()));
    assert_eq!(pair.restored(), [false, false]);
}

#[test]
fn a_component_that_ends_before_all_have_accepted_ends_the_change() {
    let mut pair = Pair::new();
    pair.ask();
    pair.advance(false);
    let number = pair.proposed();
    pair.accept(0, number);
    pair.benches[1].end(exit(9));
    let (_, undone) = pair.advance(false);
    assert_eq!(undone, ["`b` has ended"]);
    assert!(!pair.told_to_settle(0, number));
    pair.settle(0, number);
    let (results, _) = pair.advance(false);
    let refused = "`b` has ended; nothing has changed".to_owned();
    assert_eq!(results, [Err(refused)]);
    // An answer that comes late belongs to nothing.
    pair.accept(0, number);
    assert_eq!(pair.advance(false), (Vec::new(), Vec::new()));
    assert_eq!(pair.restored(), [false, false]);
}

#[test]
fn one_change_is_under_way_at_a_time() {
    let mut pair = Pair::new();
    pair.ask();
    pair.ask();
    pair.advance(false);
    let first = pair.proposed();
    let (results, _) = pair.advance(true);
    let ends = |what: &str| Err(format!("the network stops{what}"));
    assert_eq!(results.len(), 2, "{results:?}");
    assert_eq!(results[1], ends(""));
    assert!(!pair.told_to_settle(0, first));
}

#[test]
fn a_part_that_was_taken_back_before_all_have_accepted_ends_the_change() {
    let mut pair = Pair::new();
    pair.ask();
    pair.advance(false);
    let number = pair.proposed();
    // The supervisor was stopped for longer than a component holds its part.
    pair.accept(0, number);
    pair.settle(0, number);
    pair.accept(1, number);
    let (results, undone) = pair.advance(false);
    assert_eq!(results, []);
    assert_eq!(undone, ["`a` has taken its part back"]);
    assert!(!pair.told_to_settle(1, number));
    assert_eq!(pair.restored(), [false, false]);
}
