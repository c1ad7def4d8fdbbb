//! The chains of a running network, as its supervisor measures them, and a text for people.

use rc_management::chains::{ChainStatus, HopStatus, Times, Trace};
use serde::Serialize;
use std::collections::VecDeque;
use std::fmt::{self, Write};

/// The measured chains of a network.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ChainsReport {
    /// The network.
    pub network: String,
    /// Its chains, in the order of its `.ddsl`.
    pub chains: Vec<ChainStatus>,
}

/// Joins what was recorded of one chain at several times.
#[derive(Clone, Debug, Default)]
pub struct RecordedChain {
    /// What was counted before the recording, by the supervisor that counts now.
    first: Option<ChainStatus>,
    last: ChainStatus,
    /// What earlier supervisors have counted during the recording.
    earlier: ChainStatus,
    traces: VecDeque<Trace>,
    /// The longest of all: the sum, then by component the sum and its parts.
    worst: f64,
    worst_hops: Vec<[f64; 4]>,
}

/// The most messages of a recorded chain that are kept: percentiles and exports are those of the
/// newest.
const MOST_RECORDED: usize = 1 << 20;

impl RecordedChain {
    /// Adds what was recorded next.
    pub fn add(&mut self, mut status: ChainStatus) {
        let path = |status: &ChainStatus| {
            let hops = status.hops.iter();
            let names = hops.map(|hop| (hop.component.clone(), hop.receives.clone()));
            names.collect::<Vec<_>>()
        };
        if self.first.is_some() && path(&status) != path(&self.last) {
            // The network was changed: what was before is another chain.
            *self = Self {
                first: Some(none_counted(&status)),
                ..Self::default()
            };
        }
        for trace in std::mem::take(&mut status.traces) {
            if trace.hops.len() != status.hops.len() {
                continue;
            }
            self.worst = self.worst.max(trace.total_ms());
            self.worst_hops.resize(trace.hops.len(), [0.0; 4]);
            for (worst, part) in self.worst_hops.iter_mut().zip(&trace.hops) {
                for (worst, time) in worst.iter_mut().zip(all_of(part)) {
                    *worst = time.max(*worst);
                }
            }
            if self.traces.len() == MOST_RECORDED {
                self.traces.pop_front();
            }
            self.traces.push_back(trace);
        }
        // What was counted before the recording began is not in it. A supervisor that was started
        // anew counts from zero.
        self.first.get_or_insert_with(|| status.clone());
        if status.begun < self.last.begun || status.complete < self.last.complete {
            self.earlier = self.counted();
            self.first = Some(none_counted(&status));
        }
        self.last = status;
    }

    /// What was counted during the recording.
    fn counted(&self) -> ChainStatus {
        let none = ChainStatus::default();
        let first = self.first.as_ref().unwrap_or(&none);
        let now = combined(&self.last, first, u64::saturating_sub);
        let all = combined(&now, &self.earlier, u64::saturating_add);
        let oldest = self.last.oldest_ms;
        let oldest = oldest.filter(|_| oldest > first.oldest_ms);
        ChainStatus {
            oldest_ms: match (oldest, self.earlier.oldest_ms) {
                (Some(one), Some(other)) => Some(one.max(other)),
                (one, other) => one.or(other),
            },
            ..all
        }
    }

    /// What happened to the chain during the recording.
    pub fn finish(self) -> ChainStatus {
        let counted = self.counted();
        let Self {
            traces,
            worst,
            worst_hops,
            ..
        } = self;
        let times =
            |worst: f64, of: &dyn Fn(&Trace) -> f64| Times::of(traces.iter().map(of), worst);
        let hops = counted.hops.iter().enumerate().map(|(at, hop)| {
            let worst = worst_hops.get(at).copied().unwrap_or_default();
            let of = |which: usize| times(worst[which], &|t| all_of(&t.hops[at])[which]);
            HopStatus {
                times: of(0),
                way: of(1),
                period: of(2),
                work: of(3),
                ..hop.clone()
            }
        });
        ChainStatus {
            hops: hops.collect(),
            times: times(worst, &Trace::total_ms),
            traces: traces.into(),
            ..counted
        }
    }
}

/// A chain of which nothing was counted yet.
fn none_counted(status: &ChainStatus) -> ChainStatus {
    ChainStatus {
        hops: vec![HopStatus::default(); status.hops.len()],
        ..ChainStatus::default()
    }
}

/// `one`, whose counts are combined with those of `other`.
fn combined(one: &ChainStatus, other: &ChainStatus, count: fn(u64, u64) -> u64) -> ChainStatus {
    let hops = one.hops.iter().enumerate().map(|(at, hop)| {
        let before = other.hops.get(at).cloned().unwrap_or_default();
        HopStatus {
            lost: count(hop.lost, before.lost),
            replaced: count(hop.replaced, before.replaced),
            ended: count(hop.ended, before.ended),
            swapped: count(hop.swapped, before.swapped),
            restarts: count(hop.restarts, before.restarts),
            restamped: count(hop.restamped, before.restamped),
            ..hop.clone()
        }
    });
    ChainStatus {
        hops: hops.collect(),
        begun: count(one.begun, other.begun),
        complete: count(one.complete, other.complete),
        late: count(one.late, other.late),
        old: count(one.old, other.old),
        ..one.clone()
    }
}

/// The sum of the parts at a component, and they.
fn all_of(part: &[f64; 3]) -> [f64; 4] {
    [part.iter().sum(), part[0], part[1], part[2]]
}

/// Milliseconds for people.
fn ms(value: f64) -> String {
    match value.abs() {
        large if large >= 100.0 => format!("{value:.0}"),
        middle if middle >= 1.0 => format!("{value:.1}"),
        _ => format!("{value:.3}"),
    }
}

/// The head of the columns.
const TITLES: [&str; 9] = [
    "hop",
    "p50",
    "p99",
    "worst",
    "way",
    "period",
    "work",
    "worst case",
    "",
];

impl fmt::Display for ChainsReport {
    /// Some lines for each chain, and one for each of its hops.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.chains.is_empty() {
            return writeln!(
                f,
                "network {} has no chains: declare one in its .ddsl, as `Chain brake {{ … }};`",
                self.network
            );
        }
        for (at, chain) in self.chains.iter().enumerate() {
            if at > 0 {
                writeln!(f)?;
            }
            write_chain(chain, f)?;
        }
        Ok(())
    }
}

fn write_chain(chain: &ChainStatus, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    writeln!(f, "chain {}: {} → {}", chain.name, chain.from, chain.to)?;
    let limit = |name: &str, limit: Option<f64>| {
        limit.map_or_else(String::new, |limit| format!(" ({name} {} ms)", ms(limit)))
    };
    match &chain.times {
        Some(Times {
            p50_ms,
            p99_ms,
            worst_ms,
        }) => {
            write!(
                f,
                "    p50 {} ms, p99 {} ms, worst {} ms{}",
                ms(*p50_ms),
                ms(*p99_ms),
                ms(*worst_ms),
                limit("within", chain.within_ms)
            )?;
            if chain.uncertainty_ms > 0.0 {
                write!(f, " ± {} ms", ms(chain.uncertainty_ms))?;
            }
            if let Some(oldest) = chain.oldest_ms {
                let age = limit("age", chain.age_ms);
                write!(f, "; data at most {} ms old{age}", ms(oldest))?;
            }
            writeln!(f)?;
        }
        None => writeln!(f, "    nothing has come to its end yet")?,
    }
    writeln!(
        f,
        "    {} begun, {} complete, {} late, {} old; {:.0} % followed",
        chain.begun,
        chain.complete,
        chain.late,
        chain.old,
        (chain.coverage * 100.0).floor()
    )?;
    for missing in &chain.missing {
        writeln!(f, "    not followed: {missing}")?;
    }
    for condition in &chain.conditions {
        writeln!(f, "    {condition}")?;
    }
    let mut rows = vec![TITLES.map(str::to_owned)];
    rows.extend(chain.hops.iter().map(row));
    let widths: Vec<usize> = (0..TITLES.len())
        .map(|column| {
            let cells = rows.iter().map(|row| row[column].chars().count());
            cells.max().unwrap_or(0)
        })
        .collect();
    for row in rows {
        let mut line = format!("    {:<width$}", row[0], width = widths[0]);
        for (cell, width) in row[1..8].iter().zip(&widths[1..]) {
            write!(line, "  {cell:>width$}")?;
        }
        write!(line, "  {}", row[8])?;
        writeln!(f, "{}", line.trim_end())?;
    }
    let usually = |hop: &&HopStatus| {
        let times = hop.times.as_ref();
        times.is_some_and(|times| hop.worst_case_ms.is_some_and(|worst| times.p50_ms > worst))
    };
    for hop in chain.hops.iter().filter(usually) {
        writeln!(
            f,
            "    {} usually takes more than its worst case: a budget of it, or `transport`, is too small",
            hop.component
        )?;
    }
    Ok(())
}

fn row(hop: &HopStatus) -> [String; 9] {
    let p50 = |times: Option<Times>| times.map_or_else(String::new, |times| ms(times.p50_ms));
    let counts = [
        (hop.lost, "lost"),
        (hop.replaced, "replaced"),
        (hop.ended, "ended"),
        (hop.swapped, "swapped"),
        (hop.restamped, "restamped"),
        (hop.restarts, "restarts"),
    ];
    let counts = counts.iter().filter(|(count, _)| *count > 0);
    let counts: Vec<String> = counts
        .map(|(count, what)| format!("{count} {what}"))
        .collect();
    let of = |which: fn(&Times) -> f64| hop.times.as_ref().map(which).map_or_else(String::new, ms);
    [
        format!("{}.{}", hop.component, hop.receives),
        p50(hop.times),
        of(|times| times.p99_ms),
        of(|times| times.worst_ms),
        p50(hop.way),
        p50(hop.period),
        p50(hop.work),
        hop.worst_case_ms.map_or_else(String::new, ms),
        counts.join(", "),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_recorded_chain_counts_from_the_begin_of_the_recording() {
        let status = |begun: u64, late: u64, lost: u64, ways: &[f64]| ChainStatus {
            begun,
            complete: begun,
            late,
            hops: vec![HopStatus {
                lost,
                ..HopStatus::default()
            }],
            traces: ways
                .iter()
                .map(|way| Trace {
                    hops: vec![[*way, 0.0, 1.0]],
                    ..Trace::default()
                })
                .collect(),
            ..ChainStatus::default()
        };
        let mut recorded = RecordedChain::default();
        recorded.add(status(1000, 7, 3, &[]));
        recorded.add(status(1003, 8, 5, &[4.0, 1.0, 2.0]));
        let chain = recorded.clone().finish();
        assert_eq!((chain.begun, chain.complete, chain.late), (3, 3, 1));
        assert_eq!((chain.hops[0].lost, chain.traces.len()), (2, 3));
        let times = chain.times.expect("times");
        assert_eq!((times.p50_ms, times.worst_ms), (3.0, 5.0));
        assert_eq!(chain.hops[0].way.expect("a way").worst_ms, 4.0);
        assert_eq!(chain.hops[0].work.expect("work").p50_ms, 1.0);
        // The supervisor was started anew: it counts from zero.
        recorded.add(status(2, 1, 0, &[9.0, 9.0]));
        let chain = recorded.clone().finish();
        assert_eq!((chain.begun, chain.late, chain.hops[0].lost), (5, 2, 2));
        assert_eq!(chain.traces.len(), 5);
        // Again, with more than at the begin of the recording.
        recorded.add(status(2000, 1, 1, &[]));
        recorded.add(status(1500, 0, 0, &[]));
        let chain = recorded.clone().finish();
        assert_eq!((chain.begun, chain.late, chain.hops[0].lost), (3503, 2, 3));
        // The network was changed: the chain has other components.
        let mut other = status(1, 0, 0, &[]);
        other.hops.push(HopStatus::default());
        recorded.add(other);
        let chain = recorded.finish();
        assert_eq!((chain.begun, chain.hops.len(), chain.times), (1, 2, None));
        // A message with other hops than the chain is no message of it.
        let mut strange = RecordedChain::default();
        let mut other = status(1, 0, 0, &[1.0]);
        other.traces[0].hops.clear();
        strange.add(other);
        assert_eq!(strange.finish().times, None);
    }

    #[test]
    fn a_chain_is_a_few_lines() {
        let times = |p50_ms, p99_ms, worst_ms| {
            Some(Times {
                p50_ms,
                p99_ms,
                worst_ms,
            })
        };
        let hop = |component: &str| HopStatus {
            component: component.to_owned(),
            receives: "LaserPub.newScan".to_owned(),
            ..HopStatus::default()
        };
        let chain = ChainStatus {
            name: "brake".to_owned(),
            from: "lidar.LaserPub.newScan".to_owned(),
            to: "base.Base.stop".to_owned(),
            within_ms: Some(80.0),
            begun: 100,
            complete: 97,
            late: 2,
            coverage: 0.999,
            times: times(21.25, 60.0, 131.4),
            oldest_ms: Some(140.0),
            uncertainty_ms: 0.25,
            hops: vec![
                HopStatus {
                    times: times(20.0, 58.0, 130.0),
                    way: times(0.1, 0.2, 0.3),
                    period: times(19.0, 50.0, 50.0),
                    work: times(0.9, 1.0, 80.0),
                    worst_case_ms: Some(52.0),
                    lost: 3,
                    restarts: 1,
                    ..hop("avoider")
                },
                hop("base"),
            ],
            missing: vec!["base does not run".to_owned()],
            conditions: vec!["chain-late".to_owned()],
            ..ChainStatus::default()
        };
        let mut report = ChainsReport {
            network: "robot".to_owned(),
            chains: vec![chain],
        };
        expect_test::expect![[r"
            chain brake: lidar.LaserPub.newScan → base.Base.stop
                p50 21.2 ms, p99 60.0 ms, worst 131 ms (within 80.0 ms) ± 0.250 ms; data at most 140 ms old
                100 begun, 97 complete, 2 late, 0 old; 99 % followed
                not followed: base does not run
                chain-late
                hop                        p50   p99  worst    way  period   work  worst case
                avoider.LaserPub.newScan  20.0  58.0    130  0.100    19.0  0.900        52.0  3 lost, 1 restarts
                base.LaserPub.newScan
        "]].assert_eq(&report.to_string());
        // What is usual is no worst case.
        report.chains[0].hops[0].worst_case_ms = Some(19.9);
        let text = report.to_string();
        assert!(
            text.contains("\n    avoider usually takes more than"),
            "{text}"
        );
        report.chains.clear();
        assert!(
            report
                .to_string()
                .starts_with("network robot has no chains")
        );
    }
}
