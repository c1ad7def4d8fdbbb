//! Requirements of the conformance suite between two hosts: network namespaces with a cable between
//! them. Each component is on the other host than the one before.
//!
//! Left out is what holds on one host only, where ends meet when they are opened: the first samples
//! and requests of an end that the other host does not know yet arrive, and a second server is
//! refused.

use rc_conformance::network::{Network, endpoint, header, keep_last, receive, sequences, until};
use rc_middleware::{Backend, Environment, OpenError, RunDirectory};
use rc_test_support::cable::Cable;
use rc_test_support::python::skipped;
use rc_vocabulary::Value;
use rustix::thread::{LinkNameSpaceType, move_into_link_name_space};
use std::fs::File;
use std::os::fd::AsFd;
use std::path::Path;
use std::sync::Once;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

/// The domain of each network. Nobody else is on its cable.
const DOMAIN: i64 = 19;

/// Two hosts, with a run directory each. Each test has its own.
struct Hosts {
    /// `None` where this machine has none: then all are on this one.
    cable: Option<Cable>,
    places: [tempfile::TempDir; 2],
    /// The components that there were.
    components: AtomicUsize,
}

impl Hosts {
    fn new() -> Self {
        static SKIPPED: Once = Once::new();
        let cable = Cable::lay().map_err(|reason| {
            SKIPPED.call_once(|| skipped("conformance between two hosts", &reason));
        });
        Self {
            cable: cable.ok(),
            places: [0, 1].map(|_| tempfile::tempdir().expect("a folder")),
            components: AtomicUsize::new(0),
        }
    }
}

/// Runs a function on another host: what it opens stays there.
fn on<R>(host: &str, run: impl FnOnce() -> R) -> R {
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

impl rc_conformance::Subject for Hosts {
    fn connect(&self, environment: &Environment) -> Result<Box<dyn Backend>, OpenError> {
        let side = self.components.fetch_add(1, Ordering::Relaxed) % 2;
        let mut environment = environment.clone();
        let mut set = |key, value| environment.settings.set("dds", key, value);
        set("domain", Value::Int(DOMAIN));
        // Sixty-four components in one process announce themselves slowly.
        set("lease", Value::Duration(Duration::from_secs(10)));
        let Some(cable) = &self.cable else {
            set("interfaces", Value::Texts(vec!["lo".to_owned()]));
            return rc_dds::connect(&environment);
        };
        let host = cable.name(side);
        set("interfaces", Value::Texts(vec![host.to_owned()]));
        environment.directory = RunDirectory::below(self.places[side].path(), &environment.network);
        std::fs::create_dir_all(environment.directory.path()).expect("a run directory");
        on(host, || rc_dds::connect(&environment))
    }

    /// Endpoints compare types when they find each other, not with every message.
    fn compares_each_message(&self) -> bool {
        false
    }

    /// A publisher has to offer what a subscriber requests.
    fn keeps_or_refuses(&self) -> bool {
        true
    }
}

rc_conformance::suite!(@of topics, Hosts::new(),
    publishing_without_a_subscriber_succeeds
    a_late_subscriber_gets_transient_local_samples
    publishers_and_subscribers_are_counted
);
rc_conformance::suite!(@of calls, Hosts::new(),
    commands_and_queries_keep_their_order
    each_client_gets_its_own_replies
    a_late_server_is_found
    a_server_survives_its_clients
    clients_are_served_round_robin
    requests_and_replies_may_be_large
    clients_and_servers_are_counted
    calls_of_different_types_refuse_each_other
);
rc_conformance::suite!(@of failures, Hosts::new(),
    without_a_server_a_call_fails_at_once
    an_expired_call_leaves_nothing_behind
    a_late_reply_is_not_taken_for_the_next_one
    a_full_queue_is_reported
    a_stop_ends_a_call
    a_wake_up_during_a_call_is_not_lost
    a_closing_server_ends_queued_calls
    a_closing_server_ends_accepted_calls
    a_polling_client_sleeps_in_the_end
);
rc_conformance::suite!(@of started, Hosts::new(),
    started_calls_get_their_own_replies
    the_number_of_started_calls_is_limited
    a_started_call_ends_at_its_deadline
    without_a_server_no_call_is_started
    a_closing_server_ends_started_calls
    a_forgotten_call_does_not_end
    started_calls_keep_their_order_with_others
    a_stop_ends_started_calls
);
rc_conformance::suite!(@of limits, Hosts::new(), sixty_four_clients_are_served);
rc_conformance::suite!(@of typed, Hosts::new(),
    queries_return_results_exceptions_and_errors
    started_queries_end_with_results_exceptions_and_errors
);
rc_conformance::suite!(@of in_place, Hosts::new(), replies_are_written_in_place);
rc_conformance::suite!(@of values, Hosts::new(), calls_carry_values);

/// Once both ends know each other, samples of all sizes arrive, each once and in their order.
#[test]
fn samples_reach_another_host_in_their_order() {
    let hosts = Hosts::new();
    let network = Network::new(&hosts);
    let topic = keep_last(100, &endpoint("default/Laser/scan"));
    let (here, there) = (network.join("publisher"), network.join("subscriber"));
    let mut publisher = here.publisher(&topic).expect("a publisher");
    let mut subscriber = there.subscriber(&topic).expect("a subscriber");
    until("both know each other", || {
        publisher.peers() == 1 && subscriber.peers() == 1
    });
    for (round, size) in [0, 1, 17, 4097, 1 << 16, (1 << 20) + 1]
        .into_iter()
        .enumerate()
    {
        let first = 10 * round as u64;
        for number in first + 1..=first + 10 {
            let body = vec![number as u8; size];
            publisher
                .publish(header(number), &body)
                .expect("to publish");
        }
        let came = receive(&mut *subscriber, 10);
        assert_eq!(
            sequences(&came),
            (first + 1..=first + 10).collect::<Vec<_>>()
        );
        for (header, body) in &came {
            assert_eq!(
                (body.len(), body.first()),
                (size, Some(&(header.sequence as u8)).filter(|_| size > 0))
            );
        }
    }
}
