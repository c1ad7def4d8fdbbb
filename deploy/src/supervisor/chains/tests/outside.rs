//! Chains through programs outside of the network, which are followed by stamps.

use super::*;
use rc_deploy_network::planned_chain::PlannedOutside;
use rc_vocabulary::{Stamp, StampOf};

/// What c0 sends reaches c1 through a program outside, which copies stamps or not. Each message is
/// the time when it is sent, in ms, and the stamps that c0 sends and c1 receives.
fn through_outside(messages: &[(u64, u64, u64)]) -> (ChainStatus, Vec<Change>) {
    let mut plan = plan();
    let stamp = Stamp {
        before: Vec::new(),
        of: StampOf::Nanoseconds,
    };
    let chain = &mut plan.chains[0];
    chain.hops.truncate(1);
    chain.hops[0].output = None;
    chain.hops[0].outside = Some(PlannedOutside {
        sent: message(0, "out"),
        stamps: [stamp.clone(), stamp],
    });
    let mut collector = Collector::new(&plan, &Arc::default());
    let mut changes = Vec::new();
    let mut ask = |now: u64, following: Option<[Following; 2]>| {
        let until = |at: u64| at <= now;
        let [mut sent, mut received] = [Vec::new(), Vec::new()];
        for (number, (at, stamp, copied)) in (1..).zip(messages) {
            let left = BEGIN + at * MS;
            let hop = |pair, sent, left| Hop {
                sender: 0,
                pair,
                kind: Kind::Sent,
                input: 0,
                output: number,
                sent,
                begun: left,
                used: left,
                left,
            };
            if following.is_none() && until(left) && !until(left + 250 * MS) {
                sent.extend([hop(0, 0, left), hop(1, *stamp, left)]);
                received.push(Hop {
                    // Nobody knows the programs outside, and their numbers are their own.
                    sender: 9,
                    kind: Kind::Ended,
                    input: 70 + number,
                    ..hop(0, *copied, left + 20 * MS)
                });
            }
        }
        let mut following = following
            .map(|all| all.map(Some))
            .unwrap_or_default()
            .into_iter();
        let answers = [sent, received].map(|hops| {
            Ok(Answer {
                following: following.next().flatten().map(|of| (now, of)),
                taken: HopReport {
                    active: true,
                    overwritten: 0,
                    hops,
                },
                ahead: (0, 0),
            })
        });
        for news in collector.round(now as i64, answers.into()) {
            if let News::Changed(_, change) = news {
                changes.push(change);
            }
        }
    };
    let senders = |count: usize| Following {
        senders: vec![vec![100]; count],
    };
    ask(BEGIN - SECOND, Some([senders(2), senders(1)]));
    for round in 1..40 {
        ask(BEGIN + round * 250 * MS, None);
    }
    (collector.status(None).chains.remove(0), changes)
}

#[test]
fn messages_are_followed_through_programs_outside_by_their_stamps() {
    let copied: Vec<_> = (1..20)
        .map(|number| (number * 50, number, number))
        .collect();
    let (status, changes) = through_outside(&copied);
    assert_eq!((status.begun, status.complete), (19, 19));
    assert_eq!(status.times.map(|times| times.p50_ms), Some(20.0));
    assert_eq!(status.hops[0].restamped, 0);
    assert_eq!(changes, []);
}

#[test]
fn a_program_outside_that_stamps_anew_is_found() {
    // Its stamps are those of the time when it sends.
    let anew: Vec<_> = (1..20)
        .map(|number| (number * 50, number * 50, number * 50 + 7))
        .collect();
    let (status, changes) = through_outside(&anew);
    assert_eq!((status.complete, status.hops[0].restamped), (0, 19));
    let [Change::Begun { code, text }, ..] = &changes[..] else {
        panic!("{changes:?}");
    };
    assert_eq!(*code, join::BROKEN_CODE);
    assert!(text.contains("does not copy the stamp"), "{text}");
    // Messages of others, which are older, are none of it.
    let others: Vec<_> = (1..20)
        .map(|number| (number * 50, number * 50, 1))
        .collect();
    assert_eq!(through_outside(&others).0.hops[0].restamped, 0);
}

/// Messages whose stamps nobody sets are not taken for each other, and the chain says who sets
/// none.
#[test]
fn stamps_that_are_not_set_break_the_chain() {
    let broken = |stamp: u64, copied: u64| {
        let all: Vec<_> = (1..40).map(|n| (n * 50, stamp * n, copied * n)).collect();
        let (status, changes) = through_outside(&all);
        assert_eq!((status.complete, status.hops[0].restamped), (0, 0));
        let Some(Change::Begun { code, text }) = changes.first() else {
            panic!("{changes:?}");
        };
        assert_eq!(*code, join::BROKEN_CODE);
        text.clone()
    };
    let unset = "`c0.Slot.out` is sent with the stamp 0, which its sender has to set";
    let text = broken(0, 0);
    assert!(text.contains(unset), "{text}");
    let text = broken(50, 0);
    let lost = "c1 receives Slot.in with the stamp 0: a program outside does not copy the stamp";
    assert!(text.contains(lost), "{text}");
}
