//! The conformance suite between two hosts: network namespaces with a cable between them.
//!
//! Ends on two hosts do not know each other when they are opened. So the tests wait until they do
//! (`meets_at_once`); the rules hold from then on. A second server is refused by then, too.

use rc_middleware::{
    Backend, Client, Endpoint, Environment, OpenError, Publisher, RunDirectory, Server, Subscriber,
};
use rc_test_support::cable::Cable;
use rc_test_support::python::skipped;
use rc_vocabulary::Value;
use rustix::thread::{LinkNameSpaceType, move_into_link_name_space};
use std::cell::OnceCell;
use std::fs::File;
use std::os::fd::AsFd;
use std::path::Path;
use std::sync::Once;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

/// Which ends are on which of the two hosts.
#[derive(Clone, Copy)]
enum Split {
    /// Each component is on the other host than the one before.
    Components,
    /// Publishers and servers are on the first one, subscribers and clients on the second one.
    Ends,
}

/// Two hosts, with a run directory each. Each test has its own.
struct Hosts {
    /// `None` where this machine has none: then all are on this one.
    cable: Option<Cable>,
    places: [tempfile::TempDir; 2],
    split: Split,
    /// The components that there were.
    components: AtomicUsize,
}

impl Hosts {
    fn new(split: Split) -> Self {
        static SKIPPED: Once = Once::new();
        let cable = Cable::lay().map_err(|reason| {
            SKIPPED.call_once(|| skipped("conformance between two hosts", &reason));
        });
        Self {
            cable: cable.ok(),
            places: [0, 1].map(|_| tempfile::tempdir().expect("a folder")),
            split,
            components: AtomicUsize::new(0),
        }
    }

    /// The network namespace of a host; `None` for this machine.
    fn host(&self, side: usize) -> Option<&str> {
        self.cable.as_ref().map(|cable| cable.name(side))
    }

    /// Environment of a component on this host.
    fn environment(&self, side: usize, environment: &Environment) -> Environment {
        let mut environment = environment.clone();
        let domain = rc_conformance::domain(&environment.network);
        let mut set = |key, value| environment.settings.set("dds", key, value);
        set("domain", Value::Int(domain));
        // Sixty-four components in one process announce themselves slowly.
        set("lease", Value::Duration(Duration::from_secs(10)));
        let interface = self.host(side).unwrap_or("lo").to_owned();
        set("interfaces", Value::Texts(vec![interface]));
        if self.cable.is_some() {
            let place = self.places[side].path();
            environment.directory = RunDirectory::below(place, &environment.network);
            std::fs::create_dir_all(environment.directory.path()).expect("a run directory");
        }
        environment
    }
}

/// Runs a function on a host: what it opens stays there.
fn on<R>(host: Option<&str>, run: impl FnOnce() -> R) -> R {
    let Some(host) = host else { return run() };
    let open = |path: &Path| File::open(path).expect("a network namespace");
    let enter = |space: &File| {
        let kind = Some(LinkNameSpaceType::Network);
        move_into_link_name_space(space.as_fd(), kind).expect("to enter a network namespace");
    };
    let own = open(Path::new("/proc/thread-self/ns/net"));
    enter(&open(&Path::new("/run/netns").join(host)));
    let result = run();
    enter(&own);
    result
}

/// The half of a component on one host.
struct Half {
    host: Option<String>,
    environment: Environment,
    backend: OnceCell<Box<dyn Backend>>,
}

impl Half {
    /// Joins the network with the first end.
    fn open<E>(
        &self,
        open: impl FnOnce(&dyn Backend) -> Result<E, OpenError>,
    ) -> Result<E, OpenError> {
        on(self.host.as_deref(), || {
            if self.backend.get().is_none() {
                let _ = self.backend.set(rc_dds::connect(&self.environment)?);
            }
            open(&**self.backend.get().expect("it has joined"))
        })
    }
}

/// A component whose publishers and servers are on one host, its other ends on another one.
struct Parted([Half; 2]);

impl Backend for Parted {
    fn name(&self) -> &'static str {
        "dds"
    }

    fn publisher(&self, endpoint: &Endpoint) -> Result<Box<dyn Publisher>, OpenError> {
        self.0[0].open(|backend| backend.publisher(endpoint))
    }

    fn subscriber(&self, endpoint: &Endpoint) -> Result<Box<dyn Subscriber>, OpenError> {
        self.0[1].open(|backend| backend.subscriber(endpoint))
    }

    fn client(&self, endpoint: &Endpoint) -> Result<Box<dyn Client>, OpenError> {
        self.0[1].open(|backend| backend.client(endpoint))
    }

    fn server(&self, endpoint: &Endpoint) -> Result<Box<dyn Server>, OpenError> {
        self.0[0].open(|backend| backend.server(endpoint))
    }

    fn have_arrived(&self, limit: Duration) -> bool {
        let mut joined = self.0.iter().filter_map(|half| half.backend.get());
        joined.all(|backend| backend.have_arrived(limit))
    }

    fn linger(&self, limit: Duration) {
        let joined = self.0.iter().filter_map(|half| half.backend.get());
        joined.for_each(|backend| backend.linger(limit));
    }
}

impl rc_conformance::Subject for Hosts {
    fn connect(&self, environment: &Environment) -> Result<Box<dyn Backend>, OpenError> {
        if matches!(self.split, Split::Ends) {
            return Ok(Box::new(Parted([0, 1].map(|side| Half {
                host: self.host(side).map(str::to_owned),
                environment: self.environment(side, environment),
                backend: OnceCell::new(),
            }))));
        }
        let side = self.components.fetch_add(1, Ordering::Relaxed) % 2;
        let environment = self.environment(side, environment);
        on(self.host(side), || rc_dds::connect(&environment))
    }

    /// Endpoints compare types when they find each other, not with every message.
    fn compares_each_message(&self) -> bool {
        false
    }

    /// A publisher has to offer what a subscriber requests.
    fn keeps_or_refuses(&self) -> bool {
        true
    }

    fn meets_at_once(&self) -> bool {
        false
    }
}

/// Each component is on another host than the one before.
mod components_apart {
    rc_conformance::suite!(super::Hosts::new(super::Split::Components));
}

/// Each message goes to the other host.
mod ends_apart {
    rc_conformance::suite!(super::Hosts::new(super::Split::Ends));
}
