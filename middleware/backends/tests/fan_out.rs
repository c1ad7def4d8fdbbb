//! The conformance suite for components with peers in their process and in others: each sample goes
//! over two backends, a server has a port of each, and every second subscriber and client is at the
//! other one. Once the first of them is at the one, once at the other.

use rc_middleware::{
    Backend, Client, Counter, Endpoint, Environment, Header, Message, OpenError, Publisher,
    ReceiveError, Reply, RunDirectory, Server, Subscriber, fan_out,
};
use rustix::event::epoll;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

/// The receiving ends of one test, which has a value of its own.
struct Places {
    /// The subscribers that there were.
    subscribers: Arc<AtomicUsize>,
    /// The clients that there were.
    clients: Arc<AtomicUsize>,
}

impl Places {
    /// The first of each is at this backend.
    fn beginning_with(backend: usize) -> Self {
        Self {
            subscribers: Arc::new(AtomicUsize::new(backend)),
            clients: Arc::new(AtomicUsize::new(backend)),
        }
    }
}

/// A component with peers in its process and in others.
struct Component {
    /// In shared memory, and inside the process.
    both: [Box<dyn Backend>; 2],
    subscribers: Arc<AtomicUsize>,
    clients: Arc<AtomicUsize>,
}

impl rc_conformance::Subject for Places {
    fn connect(&self, environment: &Environment) -> Result<Box<dyn Backend>, OpenError> {
        let both = [
            rc_iceoryx2::connect(environment)?,
            rc_local::connect(environment)?,
        ];
        Ok(Box::new(Component {
            both,
            subscribers: Arc::clone(&self.subscribers),
            clients: Arc::clone(&self.clients),
        }))
    }

    /// As of iceoryx2 alone.
    fn leftovers(&self, directory: &RunDirectory) -> Vec<PathBuf> {
        let mut left = rc_iceoryx2::leftovers(directory);
        left.retain(|path| !path.is_dir() && !path.to_string_lossy().ends_with("global_mgmt"));
        left
    }

    fn wipe(&self, directory: &RunDirectory) {
        let wiped = rc_iceoryx2::wipe(directory);
        // A second panic would end the program, and all tests with it.
        if !std::thread::panicking() {
            wiped.expect("to wipe");
        }
    }
}

impl Backend for Component {
    fn name(&self) -> &'static str {
        "both"
    }

    fn publisher(&self, endpoint: &Endpoint) -> Result<Box<dyn Publisher>, OpenError> {
        let ports = self.both.iter();
        let ports = ports.map(|backend| Ok((backend.publisher(endpoint)?, Counter::default())));
        Ok(fan_out::over(ports.collect::<Result<_, _>>()?))
    }

    fn subscriber(&self, endpoint: &Endpoint) -> Result<Box<dyn Subscriber>, OpenError> {
        let number = self.subscribers.fetch_add(1, Ordering::Relaxed);
        self.both[number % 2].subscriber(endpoint)
    }

    fn client(&self, endpoint: &Endpoint) -> Result<Box<dyn Client>, OpenError> {
        let number = self.clients.fetch_add(1, Ordering::Relaxed);
        self.both[number % 2].client(endpoint)
    }

    fn server(&self, endpoint: &Endpoint) -> Result<Box<dyn Server>, OpenError> {
        let ports = [
            self.both[0].server(endpoint)?,
            self.both[1].server(endpoint)?,
        ];
        let descriptor = epoll::create(epoll::CreateFlags::CLOEXEC).expect("a descriptor");
        for port in &ports {
            let data = epoll::EventData::new_u64(0);
            epoll::add(&descriptor, port.descriptor(), data, epoll::EventFlags::IN)
                .expect("to watch a port");
        }
        Ok(Box::new(Both {
            ports,
            descriptor,
            first: 0,
        }))
    }

    fn have_arrived(&self, limit: Duration) -> bool {
        let mut both = self.both.iter();
        both.all(|backend| backend.have_arrived(limit))
    }

    fn linger(&self, limit: Duration) {
        self.both.iter().for_each(|backend| backend.linger(limit));
    }
}

/// A server with two ports, which it serves in turns, as the event loop of a component does.
struct Both {
    ports: [Box<dyn Server>; 2],
    /// Readable when one of the ports is.
    descriptor: OwnedFd,
    first: usize,
}

impl Both {
    fn in_turn(
        &mut self,
        mut serve: impl FnMut(&mut dyn Server) -> Result<bool, ReceiveError>,
    ) -> Result<bool, ReceiveError> {
        for at in [self.first, 1 - self.first] {
            if serve(&mut *self.ports[at])? {
                self.first = 1 - at;
                return Ok(true);
            }
        }
        Ok(false)
    }
}

impl Server for Both {
    fn descriptor(&self) -> BorrowedFd<'_> {
        self.descriptor.as_fd()
    }

    fn acknowledge(&mut self, woken: bool) {
        for port in &mut self.ports {
            port.acknowledge(woken);
        }
    }

    fn serve(
        &mut self,
        handler: &mut dyn FnMut(Header, &[u8], &mut dyn Reply),
    ) -> Result<bool, ReceiveError> {
        self.in_turn(|port| port.serve(handler))
    }

    fn serve_message(
        &mut self,
        handler: &mut dyn FnMut(Header, Message<'_>, &mut dyn Reply),
    ) -> Result<bool, ReceiveError> {
        self.in_turn(|port| port.serve_message(handler))
    }

    fn peers(&self) -> usize {
        self.ports.iter().map(|port| port.peers()).sum()
    }
}

/// The first subscriber and the first client are in other processes.
mod outside_first {
    rc_conformance::suite!(super::Places::beginning_with(0));
}

/// They are in the process of the publisher and the server.
mod inside_first {
    rc_conformance::suite!(super::Places::beginning_with(1));
}
