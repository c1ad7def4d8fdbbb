//! A follower holds tick 0 until it has found the servers that it calls.

use super::time::{end, network, note, script, slot, source, until, until_status};
use rc_middleware::Qos;
use rc_middleware::typed::TypedClient;
use rc_runtime::{
    Component, Core, Description, Embedded, Ports, Role, Slot, StartError, Values, WorkerError,
    embed,
};
use std::time::Duration;

const fn described(name: &'static str, slots: &'static [Slot]) -> Description {
    Description {
        name,
        model_hash: 3,
        middleware: "local",
        period: Duration::from_millis(10),
        parameters: None,
        folder: "/nowhere",
        slots,
        backends: &[("local", rc_local::connect)],
        types: &[],
        simulates_time: false,
        managed: false,
        note: b"",
    }
}

static CALLER: Description = described("caller", &[slot("Values", Role::Requires, Qos::CALL)]);
static SERVER: Description = described("server", &[slot("Values", Role::Implements, Qos::CALL)]);

/// Notes in each `compute()` how many servers it sees.
struct Worker {
    core: Core,
    client: Option<TypedClient>,
}

impl Worker {
    fn caller(core: Core, ports: &Ports, _: &Values) -> Result<Self, StartError> {
        let client = Some(ports.client(0)?);
        Ok(Self { core, client })
    }

    #[expect(clippy::unnecessary_wraps, reason = "the runtime wants it so")]
    fn server(core: Core, _: &Ports, _: &Values) -> Result<Self, StartError> {
        Ok(Self { core, client: None })
    }
}

impl Component for Worker {
    fn core(&mut self) -> &mut Core {
        &mut self.core
    }

    fn compute(&mut self) -> Result<(), WorkerError> {
        if let Some(client) = &self.client {
            note(&self.core, format!("{} servers", client.peers()));
        }
        Ok(())
    }

    fn emergency(&mut self) {}
    fn restore(&mut self) {}
    fn finalize(&mut self) {}

    fn sending_peers(&self, peers: &mut [usize]) {
        if let Some(client) = &self.client {
            peers[0] = client.peers();
        }
    }
}

fn caller(network: &str) -> Embedded {
    let args = ["--network", network, "--clock", "simulated"];
    embed(&CALLER, Worker::caller, &args).expect("a caller")
}

#[test]
fn time_begins_when_the_servers_are_found() {
    let network = network("peers");
    script(&network, |script| script.ticks = 3);
    let source = source(&network, "source", &["--followers", "caller"]);
    let caller = caller(&network);
    until_status(&network, "caller", |status| {
        status["uptime_s"].as_f64() > Some(0.3)
    });
    let ticked = script(&network, |script| script.last_tick);
    let args = ["--network", &network];
    let server = embed(&SERVER, Worker::server, &args).expect("a server");
    until(&network, |script| script.last_tick == 3);
    end([caller, server, source]);
    let trace = script(&network, |script| std::mem::take(&mut script.trace));
    let seen: Vec<&str> = trace.iter().map(|(_, _, what)| what.as_str()).collect();
    assert_eq!((ticked, seen), (0, vec!["1 servers"; 3]));
}

#[test]
fn time_begins_without_a_server_that_does_not_come() {
    let network = network("no_peers");
    script(&network, |script| script.ticks = 3);
    let source = source(&network, "source", &["--followers", "caller"]);
    let caller = caller(&network);
    until(&network, |script| script.last_tick == 3);
    end([caller, source]);
    let trace = script(&network, |script| std::mem::take(&mut script.trace));
    assert!(
        trace.iter().all(|(_, _, what)| what == "0 servers"),
        "{trace:?}"
    );
    assert_eq!(trace.len(), 3);
}
