//! `cargo xtask bench parameters`: how long a change of a parameter is on its way to the worker, and how long a
//! configuration is checked.

use crate::bench::Figure;
use crate::pair::{Pair, ROWS, Times, quantile};
use crate::programs::{Failure, finish, target};
use bench_protocol::{now, pause};
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Write};
use std::os::unix::net::UnixStream;
use std::process::Command;
use std::time::Duration;

/// Blocks of each side.
const BLOCKS: usize = 20;
/// Changes of a block.
const CHANGES: usize = 200;
/// No answer may take longer.
const LIMIT: Duration = Duration::from_secs(5);
/// Parameters of the large configuration.
const PARAMETERS: usize = 1000;
/// How often it is checked.
const CHECKS: usize = 20;

/// Measures both.
pub(crate) fn figures() -> Result<[Figure; 2], Failure> {
    Ok([change()?, check()?])
}

/// From before the request is written to the management socket until `params_changed()` of the worker runs, against a query
/// between the same two processes, in turns.
fn change() -> Result<Figure, Failure> {
    let query = ROWS
        .iter()
        .find(|row| row.is_query())
        .ok_or("no query is measured")?;
    let mut pair = Pair::generated()?;
    let mut management = Management::of(&pair)?;
    let (mut changes, mut queries) = (Times::default(), Times::default());
    // The first block warms up.
    for block in 0..=BLOCKS {
        let asked = pair.block(query, 0.5)?;
        for _ in 0..CHANGES {
            // As long as a receiver needs to go to sleep again.
            pause(0);
            management.set(now())?;
        }
        management.set(0)?;
        let changed = pair.times_of_pong()?;
        if changed.len() != CHANGES {
            return Err(format!("{} changes of {CHANGES} have arrived", changed.len()).into());
        }
        if block > 0 {
            queries.add(asked);
            changes.add(changed);
        }
    }
    let (change, query) = (changes.quantile(0.5), queries.quantile(0.5));
    Ok(Figure {
        what: "a change of a parameter until the worker has it, against a query's round trip between two processes, at p50",
        goal: "< 2 times",
        measured: format!(
            "{:.2} times: {change:.1} µs (p99 {:.1} µs) against {query:.1} µs",
            change / query,
            changes.quantile(0.99)
        ),
        met: change < 2.0 * query,
    })
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
        let changes = json!({ "changes": { "sent": sent } });
        let request =
            json!({ "jsonrpc": "2.0", "id": 1, "method": "parameters_set", "params": changes });
        self.0
            .get_mut()
            .write_all(format!("{request}\n").as_bytes())?;
        let mut line = String::new();
        self.0.read_line(&mut line)?;
        let answer: Value = serde_json::from_str(&line)?;
        if answer["result"].is_object() {
            Ok(())
        } else {
            Err(format!("pong refuses: {line}").into())
        }
    }
}

/// A configuration that gives every one of a thousand parameters, checked by a whole process, which first reads what they
/// are.
fn check() -> Result<Figure, Failure> {
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
    let mut times = Vec::new();
    for _ in 0..CHECKS {
        let mut command = Command::new(target()?.join("release/rcgen"));
        command.current_dir(folder.path());
        command.args(["check", "etc/config.toml"]);
        times.push(finish(command, LIMIT)?.0);
    }
    let took = quantile(&mut times, 0.5);
    Ok(Figure {
        what: "`rcgen check` of a configuration of 1,000 parameters with 100 rules, whole process, median of 20",
        goal: "< 10 ms",
        measured: format!("{:.1} ms", took.as_secs_f64() * 1000.0),
        met: took < Duration::from_millis(10),
    })
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
