//! Simulated time over a middleware that takes a while to carry a sample.

use crate::time::{FOLLOWER, end, follower_of, network, script, source, until};
use rc_middleware::{
    Backend, Client, Endpoint, Environment, Header, Linked, OpenError, Publisher, SendError,
    Server, Subscriber,
};
use rc_runtime::Description;
use std::cell::RefCell;
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
    }))
}

type Port = Rc<RefCell<Box<dyn Publisher>>>;
/// Samples on their way, each with the port that it leaves through.
type Sent = Rc<RefCell<Vec<(Port, Header, Vec<u8>)>>>;

/// Its samples arrive only after the runtime has asked once whether they have.
struct Late {
    local: Box<dyn Backend>,
    sent: Sent,
}

impl Backend for Late {
    fn name(&self) -> &'static str {
        self.local.name()
    }

    fn publisher(&self, endpoint: &Endpoint) -> Result<Box<dyn Publisher>, OpenError> {
        Ok(Box::new(LatePublisher {
            port: Rc::new(RefCell::new(self.local.publisher(endpoint)?)),
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
        let sent = self.sent.take();
        let have_arrived = sent.is_empty();
        for (port, header, body) in sent {
            let arrived = port.borrow_mut().publish(header, &body);
            arrived.expect("to arrive");
        }
        have_arrived
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
