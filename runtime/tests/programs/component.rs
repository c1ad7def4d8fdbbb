//! A component without connections, with the process that generated components have; and clients of
//! it.
//!
//! `idle SOCKET COUNT` connects so often, one after the other, asks on the last connection for the
//! status, prints the name in it, and keeps all connections until its standard input ends. Anything
//! else is a component's command line. With `RC_TEST_GUARD`, the component has a state machine
//! whose guard panics. With `RC_TEST_PRINTS`, it prints half a line when it ends.

mod charts;
mod guarded;

use rc_management::{Client, component};
use rc_runtime::{Component, Core, Description, Ports, StartError, Values, WorkerError};
use std::io::Read;
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::process::ExitCode;
use std::time::Duration;

const LIMIT: Duration = Duration::from_secs(10);
/// How many parameters it has. The list of all takes about 50 kB.
const PARAMETERS: usize = 100;

struct Worker(Core);

impl Component for Worker {
    fn core(&mut self) -> &mut Core {
        &mut self.0
    }

    fn compute(&mut self) -> Result<(), WorkerError> {
        Ok(())
    }

    fn finalize(&mut self) {
        if std::env::var_os("RC_TEST_PRINTS").is_some() {
            print!("half a line");
        }
    }
}

#[expect(clippy::unnecessary_wraps, reason = "the runtime expects a `Result`")]
fn start(core: Core, _: &Ports, _: &Values) -> Result<Worker, StartError> {
    Ok(Worker(core))
}

fn parameters() -> String {
    let doc = "What it means. ".repeat(30);
    let parameters: Vec<String> = (0..PARAMETERS)
        .map(|at| {
            format!(
                r#"{{"name":"p{at}","doc":["{doc}"],"kind":{{"scalar":{{"type":"float"}}}},"default":{{"float":1.0}},"editable":true}}"#
            )
        })
        .collect();
    format!(
        r#"{{"name":"quiet","parameters":[{}],"rules":[]}}"#,
        parameters.join(",")
    )
}

fn idle(socket: &Path, count: usize) {
    let connections: Vec<UnixStream> = (1..count)
        .map(|_| UnixStream::connect(socket).expect("a connection"))
        .collect();
    let mut last = Client::connect(socket, LIMIT).expect("a connection");
    let status: component::Status = last
        .call(&component::Request::Status, LIMIT)
        .expect("a status");
    println!("{}", status.name);
    let _ = std::io::stdin().read_to_end(&mut Vec::new());
    drop(connections);
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if let [mode, socket, count] = &arguments[..]
        && mode == "idle"
    {
        idle(Path::new(socket), count.parse().expect("a number"));
        return ExitCode::SUCCESS;
    }
    let description = Description {
        name: "quiet",
        model_hash: 1,
        middleware: "none",
        period: Duration::from_millis(5),
        parameters: Some(parameters().leak()),
        folder: "/nowhere",
        slots: &[],
        backends: &[],
        types: &[],
        simulates_time: false,
        managed: false,
        converter: None,
        note: b"",
    };
    let description = Box::leak(Box::new(description));
    if std::env::var_os("RC_TEST_GUARD").is_some() {
        return rc_runtime::run(description, guarded::start);
    }
    rc_runtime::run(description, start)
}
