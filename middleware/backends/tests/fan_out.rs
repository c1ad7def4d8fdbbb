//! The conformance suite for a publisher with subscribers in its process and in others: each sample
//! goes over two backends, and every second subscriber hears it over the other one.

use rc_middleware::{
    Backend, Client, Counter, Endpoint, Environment, OpenError, Publisher, RunDirectory, Server,
    Subscriber, fan_out,
};
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

struct Places;

/// A component with peers in its process and in others.
struct Component {
    /// In shared memory, and inside the process.
    both: [Box<dyn Backend>; 2],
}

/// The subscribers that there were.
static SUBSCRIBERS: AtomicUsize = AtomicUsize::new(0);

impl rc_conformance::Subject for Places {
    fn connect(&self, environment: &Environment) -> Result<Box<dyn Backend>, OpenError> {
        let both = [
            rc_iceoryx2::connect(environment)?,
            rc_local::connect(environment)?,
        ];
        Ok(Box::new(Component { both }))
    }

    /// As of iceoryx2 alone.
    fn leftovers(&self, directory: &RunDirectory) -> Vec<PathBuf> {
        let mut left = rc_iceoryx2::leftovers(directory);
        left.retain(|path| !path.is_dir() && !path.to_string_lossy().ends_with("global_mgmt"));
        left
    }

    fn wipe(&self, directory: &RunDirectory) {
        rc_iceoryx2::wipe(directory).expect("to wipe");
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
        let number = SUBSCRIBERS.fetch_add(1, Ordering::Relaxed);
        self.both[number % 2].subscriber(endpoint)
    }

    fn client(&self, endpoint: &Endpoint) -> Result<Box<dyn Client>, OpenError> {
        self.both[0].client(endpoint)
    }

    fn server(&self, endpoint: &Endpoint) -> Result<Box<dyn Server>, OpenError> {
        self.both[0].server(endpoint)
    }

    fn linger(&self, limit: Duration) {
        self.both.iter().for_each(|backend| backend.linger(limit));
    }
}

rc_conformance::topics!(Places);
