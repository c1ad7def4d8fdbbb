//! `cargo xtask bench parameters`: the latency of a change of a parameter, and the duration of a
//! check of a configuration.

use crate::figure::{BUILD, Figure};
use crate::pair::{Pair, Row, Times, quantile};
use crate::programs::{Failure, Program, cargo, finish, target};
use bench_protocol::{now, pause};
use std::io::{BufRead, BufReader, Write};
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

/// Blocks of each row.
const BLOCKS: usize = 20;
/// Changes or queries in a block.
const COUNT: usize = 200;
/// The limit for a reply.
const LIMIT: Duration = Duration::from_secs(5);
/// Parameters of the large configuration.
const PARAMETERS: usize = 1000;
/// The number of checks.
const CHECKS: usize = 20;

/// Measures both.
pub(crate) fn figures() -> Result<Vec<Figure>, Failure> {
    let mut figures = changes()?;
    figures.extend(checks()?);
    Ok(figures)
}

/// Measures from before the request is written to the management socket until `params_changed()` of
/// the worker runs, in turns with a query between the same two processes. Both are measured without
/// a pause after the previous reply, and after a pause in which all threads go to sleep.
fn changes() -> Result<Vec<Figure>, Failure> {
    let row = |kind: &'static str| Row {
        name: kind.into(),
        kind,
        size: 64,
        count: COUNT,
    };
    let mut ways = [
        (
            "a change of a parameter until the worker has it, against a query's round trip, each as soon as the one before is answered, p50",
            row("query"),
            [Times::default(), Times::default()],
        ),
        (
            "the same, each after a pause of 200 µs",
            row("rested"),
            [Times::default(), Times::default()],
        ),
    ];
    let mut pair = Pair::generated()?;
    let mut management = Management::of(&pair)?;
    // The first block warms up.
    for block in 0..=BLOCKS {
        for (_, row, [changes, queries]) in &mut ways {
            let asked = pair.block(row, 1.0)?;
            for _ in 0..COUNT {
                if row.kind == "rested" {
                    pause(row.size);
                }
                management.set(now())?;
            }
            management.set(0)?;
            let changed = pair.times_of_pong()?;
            if changed.len() != COUNT {
                return Err(format!("{} changes of {COUNT} have arrived", changed.len()).into());
            }
            if block > 0 {
                queries.add(asked);
                changes.add(changed);
            }
        }
    }
    let figure = |(what, _, [mut changes, mut queries]): (_, _, [Times; 2])| {
        let (change, query) = (changes.quantile(0.5), queries.quantile(0.5));
        Figure {
            what,
            goal: "< 2 times",
            measured: format!(
                "{:.2} times: {change:.1} µs (p99 {:.1} µs) against {query:.1} µs (p99 {:.1} µs)",
                change / query,
                changes.quantile(0.99),
                queries.quantile(0.99)
            ),
            met: change < 2.0 * query,
        }
    };
    Ok(ways.into_iter().map(figure).collect())
}

/// The management socket of pong.
struct Management(BufReader<UnixStream>);

impl Management {
    fn of(pair: &Pair) -> Result<Self, Failure> {
        let directory = pair.directory().ok_or("no run directory")?;
        let stream = UnixStream::connect(directory.socket("pong"))?;
        stream.set_read_timeout(Some(LIMIT))?;
        Ok(Self(BufReader::new(stream)))
    }

    fn set(&mut self, sent: i64) -> Result<(), Failure> {
        // One text and one write: the work of this end is not measured.
        let request = format!(
            "{{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"parameters_set\",\"params\":{{\"changes\":{{\"sent\":{sent}}}}}}}\n"
        );
        self.0.get_mut().write_all(request.as_bytes())?;
        let mut line = String::new();
        self.0.read_line(&mut line)?;
        if line.contains("\"result\"") {
            Ok(())
        } else {
            Err(format!("pong refuses: {line}").into())
        }
    }
}

/// Checks a configuration of a thousand parameters: by the checker alone, as a component does at
/// its start, and by an `rcgen` process, which first reads the `.pdsl`.
fn checks() -> Result<[Figure; 2], Failure> {
    let (pdsl, toml) = large();
    let folder = tempfile::tempdir()?;
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text);
    write("large.pdsl", &pdsl)?;
    write(
        "large.cdsl",
        "Component large { Communications {}; language rust; parameters \"large.pdsl\"; };\n",
    )?;
    std::fs::create_dir(folder.path().join("etc"))?;
    write("etc/config.toml", &toml)?;
    Ok([check_alone(folder.path())?, check_process(folder.path())?])
}

/// The checker alone, in this process.
fn check_alone(folder: &Path) -> Result<Figure, Failure> {
    let words = "build --release -p rc-configuration --features tools --example check_time";
    finish(cargo(&words.split(' ').collect::<Vec<_>>())?, BUILD)?;
    let path = |name: &str| folder.join(name).to_string_lossy().into_owned();
    let (pdsl, toml) = (path("large.pdsl"), path("etc/config.toml"));
    let arguments = [pdsl.as_str(), toml.as_str(), &CHECKS.to_string()];
    let program = Program::start(&target()?.join("release/examples/check_time"), &arguments)?;
    let times: Result<Vec<u64>, Failure> = (0..CHECKS)
        .map(|_| Ok(program.read_line(LIMIT)?.parse()?))
        .collect();
    let mut times = times?;
    let took = Duration::from_nanos(quantile(&mut times, 0.5));
    Ok(in_time(
        "checking a configuration of 1,000 parameters with 100 rules, the call of the checker, median of 20",
        took,
    ))
}

fn check_process(folder: &Path) -> Result<Figure, Failure> {
    let mut times = Vec::new();
    for _ in 0..CHECKS {
        let mut command = Command::new(target()?.join("release/rcgen"));
        command.current_dir(folder);
        command.args(["check", "etc/config.toml"]);
        times.push(finish(command, LIMIT)?.0);
    }
    Ok(in_time(
        "`rcgen check` of it, whole process, which first reads the .pdsl, median of 20",
        quantile(&mut times, 0.5),
    ))
}

fn in_time(what: &'static str, took: Duration) -> Figure {
    Figure {
        what,
        goal: "< 10 ms",
        measured: format!("{:.1} ms", took.as_secs_f64() * 1000.0),
        met: took < Duration::from_millis(10),
    }
}

/// Parameters of all types, and a configuration that gives a value to each.
fn large() -> (String, String) {
    let mut pdsl = "ComponentParams large {\n".to_owned();
    let mut toml = "[parameters]\n".to_owned();
    for number in 0..PARAMETERS {
        let (ty, value) = match number % 5 {
            0 => ("int 3 0:100", "7"),
            1 => ("double 0.5 0:1 T unit \"m\"", "0.25"),
            2 => ("string fast {slow, fast} T", "\"slow\""),
            3 => ("duration 50ms 1ms:2s", "\"20ms\""),
            _ => ("double[1:4] [1, 2] 0:9", "[1.5, 2.5, 3.5]"),
        };
        pdsl.push_str(&format!("/// The parameter {number}.\np{number} {ty};\n"));
        toml.push_str(&format!("# What it is.\np{number} = {value}\n"));
        if number % 10 == 5 {
            let other = number - 5;
            pdsl.push_str(&format!(
                "require p{number} >= p{other} - 1 \"too small\";\n"
            ));
        }
    }
    pdsl.push_str("};\n");
    (pdsl, toml)
}
