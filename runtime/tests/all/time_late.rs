//! Simulated time over a middleware that takes a while to carry a sample.

use crate::time::{FOLLOWER, end, follower_of, network, script, slot, source, until};
use rc_middleware::typed::TypedPublisher;
use rc_middleware::{
    Backend, Client, Endpoint, Environment, Header, Linked, OpenError, Publisher, Qos, SendError,
    Server, Subscriber,
};
use rc_runtime::{
    Component, Core, Description, Ports, Role, Slot, StartError, TimeSource, Values, WorkerError,
    embed,
};
use std::cell::{Cell, RefCell};
use std::rc::Rc;
use std::time::Duration;

static LATE: Description = Description {
    backends: &[Linked::new("local", late)],
    ..FOLLOWER
};

fn late(environment: &Environment) -> Result<Box<dyn Backend>, OpenError> {
    Ok(Box::new(Late {
        local: rc_local::connect(environment)?,
        sent: Sent::default(),
        was_asked: Cell::default(),
    }))
}

type Port = Rc<RefCell<Box<dyn Publisher>>>;
/// Samples on their way, each with the port that it leaves through.
type Sent = Rc<RefCell<Vec<(Port, Header, Vec<u8>)>>>;

/// Its samples, but not its ticks, arrive when the runtime asks the second time whether they have.
struct Late {
    local: Box<dyn Backend>,
    sent: Sent,
    was_asked: Cell<bool>,
}

impl Backend for Late {
    fn name(&self) -> &'static str {
        self.local.name()
    }

    fn publisher(&self, endpoint: &Endpoint) -> Result<Box<dyn Publisher>, OpenError> {
        let port = self.local.publisher(endpoint)?;
        if endpoint.address.as_str().contains("/rc-time/") {
            return Ok(port);
        }
        Ok(Box::new(LatePublisher {
            port: Rc::new(RefCell::new(port)),
            sent: Rc::clone(&self.sent),
        }))
    }

    fn subscriber(&self, endpoint: &Endpoint) -> Result<Box<dyn Subscriber>, OpenError> {
        self.local.subscriber(endpoint)
    }

    fn client(&self, endpoint: &Endpoint) -> Result<Box<dyn Client>, OpenError> {
        self.local.client(endpoint)
    }

    fn server(&self, endpoint: &Endpoint) -> Result<Box<dyn Server>, OpenError> {
        self.local.server(endpoint)
    }

    fn have_arrived(&self, _limit: Duration) -> bool {
        let is_first = !self.sent.borrow().is_empty() && !self.was_asked.replace(true);
        if is_first {
            return false;
        }
        self.was_asked.set(false);
        for (port, header, body) in self.sent.take() {
            let arrived = port.borrow_mut().publish(header, &body);
            arrived.expect("to arrive");
        }
        true
    }

    fn linger(&self, limit: Duration) {
        self.local.linger(limit);
    }
}

struct LatePublisher {
    port: Port,
    sent: Sent,
}

impl Publisher for LatePublisher {
    fn publish(&mut self, header: Header, body: &[u8]) -> Result<(), SendError> {
        let port = Rc::clone(&self.port);
        self.sent.borrow_mut().push((port, header, body.to_vec()));
        Ok(())
    }

    fn senders(&self) -> Vec<u128> {
        self.port.borrow().senders()
    }

    fn peers(&self) -> usize {
        self.port.borrow().peers()
    }
}

const OUT: Slot = slot("Out", Role::Publishes, Qos::PUBLISHER);

static SOURCE: Description = Description {
    name: "source",
    period: Duration::from_millis(1),
    slots: &[OUT],
    simulates_time: true,
    ..FOLLOWER
};

static LATE_SOURCE: Description = Description {
    name: "source",
    period: Duration::from_millis(1),
    slots: &[OUT],
    simulates_time: true,
    ..LATE
};

/// A source that publishes a number in each tick.
struct Source {
    core: Core,
    time: TimeSource,
    out: TypedPublisher,
}

impl Source {
    fn start(core: Core, ports: &Ports, _: &Values) -> Result<Self, StartError> {
        let (mut time, out) = (ports.time_source(), ports.publisher(0, 0)?);
        time.wait_for_all(Duration::from_secs(20));
        time.set_paced(false);
        Ok(Self { core, time, out })
    }
}

impl Component for Source {
    fn core(&mut self) -> &mut Core {
        &mut self.core
    }

    fn compute(&mut self) -> Result<(), WorkerError> {
        let tick = self.time.tick();
        let is_over = script(self.core.network(), |script| {
            script.last_tick = tick;
            tick == script.ticks
        });
        if !is_over {
            let number = 100 + tick as u32;
            self.out.publish_with(|writer| writer.put(&number))?;
            self.time.advance(Duration::from_millis(10))?;
        }
        Ok(())
    }
}

/// Six ticks of a source that publishes, and a follower. Gives the steps of the follower.
fn run_of_source(test: &str, of: &'static Description) -> Vec<(u64, String, String)> {
    let network = network(test);
    script(&network, |script| script.ticks = 6);
    let args = [
        "--network",
        &network,
        "--name",
        "source",
        "--followers",
        "a",
    ];
    let source = embed(of, Source::start, &args).expect("a source");
    let follower = follower_of(&FOLLOWER, &network, "a");
    until(&network, |script| script.last_tick == 6);
    end([follower, source]);
    script(&network, |script| std::mem::take(&mut script.trace))
}

#[test]
fn a_source_sends_its_tick_when_its_samples_have_arrived() {
    let at_once = run_of_source("source_at_once", &SOURCE);
    assert_eq!(at_once[0], (10, "a".to_owned(), "sample 100".to_owned()));
    assert_eq!(run_of_source("source_late", &LATE_SOURCE), at_once);
}

/// Ten ticks of two followers. Gives the steps of both.
fn run(test: &str, of: &'static Description) -> Vec<(u64, String, String)> {
    let network = network(test);
    script(&network, |script| script.ticks = 10);
    let source = source(&network, "source", &["--followers", "b,a"]);
    let followers = ["a", "b"].map(|name| follower_of(of, &network, name));
    until(&network, |script| script.last_tick == 10);
    end(followers.into_iter().chain([source]));
    script(&network, |script| std::mem::take(&mut script.trace))
}

#[test]
fn a_tick_ends_when_its_samples_have_arrived() {
    let at_once = run("arrive_at_once", &FOLLOWER);
    // `a` has its turn after `b`, and hears it in the same tick.
    assert_eq!(at_once[1], (10, "a".to_owned(), "sample 1".to_owned()));
    assert_eq!(run("arrive_late", &LATE), at_once);
}
