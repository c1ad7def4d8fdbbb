//! The chains of a running network, as its supervisor measures them, and a text for people.

use rc_management::chains::{ChainStatus, HopStatus, Times};
use serde::Serialize;
use std::fmt::{self, Write};

/// The measured chains of a network.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ChainsReport {
    /// The network.
    pub network: String,
    /// Its chains, in the order of its `.ddsl`.
    pub chains: Vec<ChainStatus>,
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
    Ok(())
}

fn row(hop: &HopStatus) -> [String; 9] {
    let p50 = |times: Option<Times>| times.map_or_else(String::new, |times| ms(times.p50_ms));
    let counts = [
        (hop.lost, "lost"),
        (hop.replaced, "replaced"),
        (hop.ended, "ended"),
        (hop.swapped, "swapped"),
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
        report.chains.clear();
        assert!(
            report
                .to_string()
                .starts_with("network robot has no chains")
        );
    }
}
