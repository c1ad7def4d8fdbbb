//! Events for clients of the supervisor's socket, and for the user at a terminal.

use crate::bench::{Bench, LIMIT, component, well};
use crate::pty::{SETSID, Terminal};
use rustix::process::Signal;
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Write};
use std::os::unix::net::UnixStream;
use std::process::Command;

/// A client of the supervisor.
struct Client(BufReader<UnixStream>);

impl Client {
    fn connect(bench: &Bench) -> Self {
        let socket = bench.run_directory().join("rcdeploy.sock");
        let stream = UnixStream::connect(socket).expect("a supervisor");
        stream.set_read_timeout(Some(LIMIT)).expect("a limit");
        Self(BufReader::new(stream))
    }

    fn ask(&mut self, method: &str) {
        let request = json!({"jsonrpc": "2.0", "id": 7, "method": method});
        let line = format!("{request}\n");
        self.0.get_mut().write_all(line.as_bytes()).expect("to ask");
    }

    /// The next message. `None` when the supervisor has closed the connection.
    fn next(&mut self) -> Option<Value> {
        let mut line = String::new();
        self.0.read_line(&mut line).expect("a message in time");
        (!line.is_empty()).then(|| serde_json::from_str(&line).expect("JSON"))
    }
}

#[test]
fn a_follower_gets_earlier_events_and_all_until_the_end() {
    let bench = Bench::new();
    let up = bench.start_well();
    let mut client = Client::connect(&bench);
    client.ask("events");
    let answer = client.next().expect("an answer");
    assert_eq!(answer["id"], 7);
    assert!(answer["result"]["kept"].as_u64() > Some(5), "{answer}");
    // A client that sends requests and never reads blocks no other client.
    let mut idle = Client::connect(&bench);
    idle.ask("events");
    // The connection serves other requests, too.
    client.ask("status");
    up.signal(Signal::TERM);
    let (code, printed) = up.end();
    assert_eq!(code, Some(0));
    let messages: Vec<Value> = std::iter::from_fn(|| client.next()).collect();
    assert!(
        messages
            .iter()
            .any(|m| m["result"]["network"] == bench.network.as_str())
    );
    let output = messages.iter().filter(|m| m["method"] == "event");
    let output: Vec<&Value> = output.map(|message| &message["params"]).collect();
    assert_eq!(output, printed.iter().collect::<Vec<_>>());
    bench.assert_nothing_left();
}

/// The driver in a terminal, with its view.
fn screen(bench: &Bench, components: Vec<rc_deploy::Component>) -> Terminal {
    let plan = bench.write(components);
    let driver = bench.driver(&["up", &plan, "--terminal"]);
    let [setsid, argument] = SETSID;
    let mut command = Command::new(setsid);
    command
        .arg(argument)
        .arg(driver.get_program())
        .args(driver.get_args())
        .env("RC_TEST_PANIC", bench.path("panic"));
    for (name, value) in driver.get_envs() {
        command.env(name, value.unwrap_or_default());
    }
    Terminal::start(command, (100, 30))
}

#[test]
fn a_panic_restores_the_terminal_and_is_readable() {
    let bench = Bench::new();
    let mut terminal = screen(&bench, vec![well("a")]);
    terminal.until_text("1 running");
    assert!(terminal.is_raw());
    std::fs::write(bench.path("panic"), "").expect("written");
    terminal.until_text("a panic was asked for");
    terminal.until("the usual screen", |screen| !screen.alternate_screen());
    // The network continues, and Ctrl-C is a signal again.
    assert!(!terminal.is_raw());
    assert_eq!(
        bench.status().components[0].state,
        rc_deploy::ComponentState::Running
    );
    terminal.press("\u{3}");
    let (code, screen) = terminal.end();
    assert_eq!(code, Some(0), "{screen}");
    assert!(screen.contains("is down"), "{screen}");
    bench.assert_nothing_left();
}

#[test]
fn a_second_control_c_kills_components_that_do_not_stop() {
    let bench = Bench::new();
    let mut deaf = component("deaf", "deaf", &[]);
    deaf.stop = LIMIT * 10;
    let mut terminal = screen(&bench, vec![deaf]);
    terminal.until_text("1 running");
    terminal.press("\u{3}");
    terminal.until_text("STOPPING");
    terminal.until_text("1 stopping");
    // `q` during a stop is not a second Ctrl-C.
    terminal.press("q");
    terminal.until_text("it is stopping");
    terminal.press("\u{3}");
    let (_, screen) = terminal.end();
    assert!(screen.contains("interrupted again: killing"), "{screen}");
    assert!(screen.contains("is down"), "{screen}");
    bench.assert_nothing_left();
}

#[test]
fn a_failed_start_is_printed_after_the_view() {
    let bench = Bench::new();
    let terminal = screen(&bench, vec![well("a"), component("bad", "exit 7", &["a"])]);
    let (code, screen) = terminal.end();
    assert_eq!(code, Some(3), "{screen}");
    assert!(
        screen.contains("ended before it was ready: exit status 7"),
        "{screen}"
    );
    bench.assert_nothing_left();
}
