//! What happens when processes are really killed. The other processes are this test binary again, started for the
//! one test `role` with the role in an environment variable.

use rc_conformance::network::{LIMIT, StopOnDrop, endpoint, header, receive, serve_until, until};
use rc_middleware::qos::Durability;
use rc_middleware::{
    Backend, CallError, Client, Endpoint, Environment, Interrupt, OpenError, RunDirectory, wait,
};
use std::io::{BufRead, BufReader};
use std::process::{Child, ChildStdout, Command, Stdio};
use std::time::{Duration, Instant};

const ROLE: &str = "RC_TEST_ROLE";
const NETWORK: &str = "RC_TEST_NETWORK";

/// A network of processes; wiped when it goes.
struct Network(String);

impl Network {
    fn new(name: &str) -> Self {
        Self(format!("{name}-{}", std::process::id()))
    }

    fn environment(&self, instance: &str) -> Environment {
        Environment {
            network: self.0.clone(),
            instance: instance.to_owned(),
            directory: RunDirectory::open(&self.0).expect("a run directory"),
            interrupt: Interrupt::new().expect("an interrupt"),
        }
    }

    fn join(&self, instance: &str) -> Box<dyn Backend> {
        rc_iceoryx2::connect(&self.environment(instance)).expect("the network")
    }

    /// A process in `role` that says it is ready.
    fn start(&self, role: &str) -> Process {
        let mut process = self.begin(role);
        process.says("ready");
        process
    }

    /// A process in `role` that has just begun.
    fn begin(&self, role: &str) -> Process {
        let mut child = Command::new(std::env::current_exe().expect("this binary"))
            .args(["role", "--exact", "--nocapture", "--test-threads=1"])
            .env(ROLE, role)
            .env(NETWORK, &self.0)
            .stdout(Stdio::piped())
            .spawn()
            .expect("a process");
        let output = BufReader::new(child.stdout.take().expect("a pipe"));
        Process { child, output }
    }
}

impl Drop for Network {
    fn drop(&mut self) {
        let directory = RunDirectory::of(&self.0);
        rc_iceoryx2::wipe(&directory).expect("to wipe");
        directory.remove().expect("to remove");
    }
}

/// A process that is killed at the latest when the test ends.
struct Process {
    child: Child,
    output: BufReader<ChildStdout>,
}

impl Process {
    /// Waits until it has said `word`.
    fn says(&mut self, word: &str) {
        let mut lines = (&mut self.output).lines();
        let said = lines.any(|line| line.expect("a line").ends_with(word));
        assert!(said, "it ended before it was {word}");
    }

    fn kill(&mut self) {
        self.child.kill().expect("to kill");
        self.child.wait().expect("to reap");
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        self.kill();
    }
}

fn map() -> Endpoint {
    let mut map = endpoint("default/Map/map");
    map.qos.durability = Durability::TransientLocal;
    map
}

/// Not a test: what the other processes do.
#[test]
fn role() {
    let (Ok(role), Ok(network)) = (std::env::var(ROLE), std::env::var(NETWORK)) else {
        return;
    };
    let network = Network(network);
    let backend = network.join(&role);
    let motor = endpoint("default/Motor");
    let stop = Interrupt::new().expect("an interrupt");
    match role.as_str() {
        "server" => {
            let mut server = backend.server(&motor).expect("a server");
            println!("ready");
            serve_until(&mut *server, &stop, &|_, request, reply| {
                if request == b"hold" {
                    println!("holding");
                    wait(&[], LIMIT);
                }
                reply.extend_from_slice(request);
            });
        }
        "publisher" => {
            let mut scan = backend
                .publisher(&endpoint("default/Laser/scan"))
                .expect("a publisher");
            let mut map = backend.publisher(&map()).expect("a publisher");
            println!("ready");
            for sequence in 1.. {
                scan.publish(header(sequence), &[1; 500])
                    .expect("to publish");
                map.publish(header(sequence), &[2; 500])
                    .expect("to publish");
                wait(&[], Duration::from_millis(1));
            }
        }
        "subscriber" => {
            let mut scan = backend
                .subscriber(&endpoint("default/Laser/scan"))
                .expect("a subscriber");
            println!("ready");
            loop {
                receive(&mut *scan, 1);
            }
        }
        "client" => {
            let mut client = backend.client(&motor).expect("a client");
            println!("ready");
            loop {
                let _ = client.call(header(1), b"again", LIMIT, &mut |_, _| {});
            }
        }
        other => panic!("no role `{other}`"),
    }
    std::mem::forget(network);
}

fn ask(client: &mut dyn Client, request: &[u8]) -> Result<Vec<u8>, CallError> {
    let mut reply = Vec::new();
    client
        .call(header(1), request, LIMIT, &mut |_, body| {
            body.clone_into(&mut reply)
        })
        .map(|()| reply)
}

#[test]
fn a_killed_server_ends_the_call_and_is_replaced() {
    let network = Network::new("ks");
    let backend = network.join("client");
    let motor = endpoint("default/Motor");
    let mut client = backend.client(&motor).expect("a client");
    for _ in 0..3 {
        let mut server = network.start("server");
        assert_eq!(ask(&mut *client, b"here"), Ok(b"here".to_vec()));
        let refused = backend.server(&motor).err();
        let holder = format!("pid {} (server)", server.child.id());
        assert!(
            matches!(&refused, Some(OpenError::AddressTaken { holder: told, .. }) if *told == holder),
            "{refused:?}"
        );

        // Killed while it holds the call.
        let (died, late) = std::thread::scope(|scope| {
            let killer = scope.spawn(|| {
                server.says("holding");
                server.kill();
                Instant::now()
            });
            let died = ask(&mut *client, b"hold");
            let noticed = Instant::now();
            let killed = killer.join().expect("a killer");
            (died, noticed.saturating_duration_since(killed))
        });
        assert_eq!(died, Err(CallError::ServerDied("default/Motor".to_owned())));
        assert!(late < LIMIT / 10, "noticed after {late:?}");
        let nobody = Err(CallError::NoServer("default/Motor".to_owned()));
        assert_eq!(ask(&mut *client, b"still?"), nobody);
        assert_eq!(client.peers(), 0);

        // Killed while nobody looks.
        let mut server = network.start("server");
        assert_eq!(ask(&mut *client, b"here"), Ok(b"here".to_vec()));
        server.kill();
        assert_eq!(
            client.send(header(1), b"command"),
            Err(CallError::NoServer("default/Motor".to_owned()))
        );
    }
    // The place of a dead server is free for one in a process that has the service open.
    let mut server = network.start("server");
    assert_eq!(ask(&mut *client, b"here"), Ok(b"here".to_vec()));
    server.kill();
    let own = backend
        .server(&motor)
        .expect("the place of the dead server");
    assert_eq!(own.peers(), 1);
}

#[test]
fn a_killed_publisher_is_replaced() {
    let network = Network::new("kp");
    let backend = network.join("subscriber");
    let mut scan = backend
        .subscriber(&endpoint("default/Laser/scan"))
        .expect("a subscriber");
    let mut late = backend.subscriber(&map()).expect("a subscriber");
    for _ in 0..5 {
        let mut publisher = network.start("publisher");
        receive(&mut *scan, 20);
        receive(&mut *late, 20);
        publisher.kill();
    }
    let holder = rc_iceoryx2::Holder::new(&network.environment("holder")).expect("a holder");
    holder.clean();
    until("the dead publishers are gone", || {
        scan.peers() + late.peers() == 0
    });
}

#[test]
fn killed_subscribers_and_clients_are_forgotten() {
    let network = Network::new("kc");
    let backend = network.join("all");
    let mut publisher = backend
        .publisher(&endpoint("default/Laser/scan"))
        .expect("a publisher");
    let stop = Interrupt::new().expect("an interrupt");
    std::thread::scope(|scope| {
        let (network, stop) = (&network, &stop);
        scope.spawn(move || {
            let backend = network.join("server");
            let mut server = backend
                .server(&endpoint("default/Motor"))
                .expect("a server");
            serve_until(&mut *server, stop, &|_, request, reply| {
                reply.extend_from_slice(request);
            });
        });
        let _stop = StopOnDrop(stop);
        let mut client = backend
            .client(&endpoint("default/Motor"))
            .expect("a client");
        until("the server is there", || client.peers() == 1);
        // More than there may be at a time.
        for _ in 0..20 {
            let mut killed: Vec<_> = (0..4).map(|_| network.start("client")).collect();
            killed.push(network.start("subscriber"));
            publisher.publish(header(1), b"x").expect("to publish");
            assert_eq!(ask(&mut *client, b"here"), Ok(b"here".to_vec()));
            killed.iter_mut().for_each(Process::kill);
            publisher.publish(header(2), b"x").expect("to publish");
            assert_eq!(ask(&mut *client, b"here"), Ok(b"here".to_vec()));
        }
    });
}

#[test]
fn a_holder_keeps_and_a_wipe_removes() {
    let network = Network::new(&format!("a-network-with-a-name-of-{}", "x".repeat(60)));
    let environment = network.environment("holder");
    let mut holder = rc_iceoryx2::Holder::new(&environment).expect("a holder");
    holder
        .hold_topic(&endpoint("default/Laser/scan"))
        .expect("to hold");
    holder.hold_topic(&map()).expect("to hold");
    holder
        .hold_call(&endpoint("default/Motor"))
        .expect("to hold");
    let mut server = network.start("server");
    let backend = network.join("client");
    let mut client = backend
        .client(&endpoint("default/Motor"))
        .expect("a client");
    assert_eq!(ask(&mut *client, b"here"), Ok(b"here".to_vec()));
    server.kill();
    assert_eq!(holder.clean(), 1);
    assert_eq!(client.peers(), 0);
    // The last one out leaves nothing.
    assert!(!rc_iceoryx2::leftovers(&environment.directory).is_empty());
    drop((client, backend, holder));
    assert!(rc_iceoryx2::leftovers(&environment.directory).is_empty());
    // One that is killed cannot tidy up: the deployer does.
    network.start("server").kill();
    assert!(!rc_iceoryx2::leftovers(&environment.directory).is_empty());
    assert!(rc_iceoryx2::wipe(&environment.directory).expect("to wipe") > 0);
    assert!(rc_iceoryx2::leftovers(&environment.directory).is_empty());
}

/// Kills at every moment of a start, while somebody holds the services: whoever comes next is not harmed. (Without a
/// holder a kill can leave a service half made; then an opening fails after its time limit, see the README.)
#[test]
fn a_start_that_is_killed_harms_nobody() {
    let network = Network::new("st");
    let mut holder = rc_iceoryx2::Holder::new(&network.environment("holder")).expect("a holder");
    holder
        .hold_topic(&endpoint("default/Laser/scan"))
        .expect("to hold");
    holder.hold_topic(&map()).expect("to hold");
    holder
        .hold_call(&endpoint("default/Motor"))
        .expect("to hold");
    for step in 0..40 {
        for role in ["server", "publisher", "subscriber"] {
            let mut killed = network.begin(role);
            wait(&[], Duration::from_micros(2000 + 250 * step));
            killed.kill();
        }
        if step % 10 == 9 {
            let backend = network.join("client");
            let motor = endpoint("default/Motor");
            let mut client = backend.client(&motor).expect("a client");
            let mut scan = backend
                .subscriber(&endpoint("default/Laser/scan"))
                .expect("a subscriber");
            let _server = network.start("server");
            let _publisher = network.start("publisher");
            assert_eq!(ask(&mut *client, b"here"), Ok(b"here".to_vec()));
            receive(&mut *scan, 5);
        }
    }
}
