//! The cases in which replicas of DSR stay different: three agents, thirty changes, a thousand runs.

use graph_merge::{Delta, Replica, Vector, unique_writer};
use property_graph::Value;

/// In how many of a thousand runs three agents end with different values.
fn different(loses: bool, reorders: bool, writers: impl Fn() -> [u64; 3]) -> usize {
    let runs = (0..1000).filter(|seed| {
        let mut random = fastrand::Rng::with_seed(*seed);
        let writers = writers();
        let mut agents = writers.map(|writer| Replica::new(writer, writers));
        let robot = agents[0].add_node("robot").expect("a stamp");
        let whole = agents[0].delta_since(&Vector::new());
        agents[1].merge(&whole).expect("a sound delta");
        agents[2].merge(&whole).expect("a sound delta");
        let mut mail: Vec<(usize, Delta)> = Vec::new();
        for change in 0..30 {
            let at = random.usize(0..3);
            let before = agents[at].seen().clone();
            assert_eq!(
                agents[at].set(robot, "x", Some(Value::Int(change))),
                Ok(true)
            );
            let delta = agents[at].delta_since(&before);
            for other in (0..3).filter(|other| *other != at) {
                if !loses || random.u32(0..20) > 0 {
                    mail.push((other, delta.clone()));
                }
            }
            while !mail.is_empty() && random.bool() {
                let next = if reorders {
                    random.usize(0..mail.len())
                } else {
                    0
                };
                let (to, delta) = mail.remove(next);
                agents[to].merge(&delta).expect("a sound delta");
            }
        }
        for (to, delta) in mail {
            agents[to].merge(&delta).expect("a sound delta");
        }
        // An agent tells what it has seen from time to time; who has more answers.
        for (to, from) in [(0, 1), (0, 2), (1, 0), (2, 0)] {
            let missing = agents[from].delta_since(&agents[to].seen().clone());
            agents[to].merge(&missing).expect("a sound delta");
        }
        let values = agents.each_ref().map(|agent| agent.get(robot, "x"));
        values[0].is_none() || values[0] != values[1] || values[1] != values[2]
    });
    runs.count()
}

#[test]
fn five_percent_lost_leaves_no_difference() {
    assert_eq!(different(true, false, || [1, 2, 3]), 0);
}

#[test]
fn any_order_leaves_no_difference() {
    assert_eq!(different(false, true, || [1, 2, 3]), 0);
}

/// All three agents have the number 0 in their configuration. It is not a part of a writer.
#[test]
fn equal_agents_leave_no_difference() {
    assert_eq!(
        different(true, true, || [(); 3].map(|()| unique_writer())),
        0
    );
}
