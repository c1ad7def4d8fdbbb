//! The requirements of backends, as one suite of tests.
//!
//! A backend implements [`Subject`] and instantiates the suite in a file of its `tests/`:
//!
//! ```ignore
//! struct Local;
//! impl rc_conformance::Subject for Local {
//!     fn connect(&self, environment: &Environment) -> Result<Box<dyn Backend>, OpenError> {
//!         rc_local::connect(environment)
//!     }
//! }
//! rc_conformance::suite!(Local);
//! ```
//!
//! Each test has a network of its own. Peers run in threads, and each joins the network by itself.
//! Tests wait for events, with a generous limit; they never sleep for a fixed time.
#![expect(
    clippy::missing_panics_doc,
    reason = "every function is a test, and a test that fails panics"
)]

pub mod calls;
mod envelope;
pub mod failures;
pub mod in_place;
pub mod limits;
pub mod network;
pub mod started;
pub mod topics;
pub mod typed;
pub mod values;

pub use network::domain;

use rc_middleware::{Backend, Environment, OpenError, RunDirectory};
use std::path::PathBuf;

/// A backend under test.
pub trait Subject: Sync {
    /// Joins the network of `environment`.
    fn connect(&self, environment: &Environment) -> Result<Box<dyn Backend>, OpenError>;

    /// Remains of the network on the system after all endpoints were closed. Anything left
    /// fails the test.
    fn leftovers(&self, _directory: &RunDirectory) -> Vec<PathBuf> {
        Vec::new()
    }

    /// Whether the type hash travels with every message; else it is compared once for a connection.
    fn compares_each_message(&self) -> bool {
        true
    }

    /// Whether a subscriber that requests kept samples receives nothing from a publisher that keeps
    /// none.
    fn keeps_or_refuses(&self) -> bool {
        false
    }

    /// Whether ends know each other as soon as they are open. Else, as between hosts, a message from an
    /// end that the receiver does not know yet may not arrive, and tests wait until both know each other.
    fn meets_at_once(&self) -> bool {
        true
    }

    /// Removes the files that the network may leave.
    fn wipe(&self, _directory: &RunDirectory) {}
}

/// Defines one `#[test]` for each requirement. The argument is an expression that gives a
/// [`Subject`].
#[macro_export]
macro_rules! suite {
    ($subject:expr) => {
        $crate::suite!(@of topics, $subject,
            a_sample_reaches_every_subscriber
            many_publishers_reach_one_subscriber_in_order
            samples_of_every_size_arrive
            publishing_without_a_subscriber_succeeds
            a_late_subscriber_gets_no_volatile_samples
            a_late_subscriber_gets_transient_local_samples
            a_transient_local_publisher_reaches_all_subscribers
            a_slow_subscriber_keeps_the_newest_and_delays_nobody
            lost_samples_are_counted
            samples_that_have_arrived_are_received_at_once
            a_subscriber_outlives_its_publishers
            publishers_and_subscribers_are_counted
            a_sample_wakes_its_subscriber
            topics_of_different_types_refuse_each_other
        );
        $crate::suite!(@of in_place, $subject, samples_are_written_in_place);
        $crate::suite!(@of values, $subject, values_reach_every_subscriber);
        $crate::suite!(@of calls, $subject,
            commands_and_queries_keep_their_order
            commands_that_have_arrived_are_served_at_once
            each_client_gets_its_own_replies
            a_late_server_is_found
            a_client_survives_its_servers
            a_server_survives_its_clients
            clients_are_served_round_robin
            requests_and_replies_may_be_large
            clients_and_servers_are_counted
            a_second_server_is_refused
            calls_of_different_types_refuse_each_other
            networks_are_separate
        );
        $crate::suite!(@of failures, $subject,
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
        $crate::suite!(@of started, $subject,
            started_calls_get_their_own_replies
            the_number_of_started_calls_is_limited
            a_started_call_ends_at_its_deadline
            late_replies_take_no_place_of_others
            without_a_server_no_call_is_started
            a_closing_server_ends_started_calls
            a_forgotten_call_does_not_end
            started_calls_keep_their_order_with_others
            a_stop_ends_started_calls
        );
        $crate::suite!(@of limits, $subject,
            sixty_four_clients_are_served
            a_thousand_requests_get_their_own_replies
            sixteen_publishers_reach_sixty_four_subscribers
            sixty_four_publishers_share_a_topic_of_that_depth
        );
        $crate::suite!(@of typed, $subject,
            topics_carry_values
            queries_return_results_exceptions_and_errors
            started_queries_end_with_results_exceptions_and_errors
            replies_may_come_later
            replies_say_how_old_their_values_are
        );
        $crate::suite!(@of in_place, $subject,
            replies_are_written_in_place
        );
        $crate::suite!(@of values, $subject, calls_carry_values);
    };
    (@of $module:ident, $subject:expr, $($name:ident)*) => {
        $(
            #[test]
            fn $name() {
                $crate::$module::$name(&$subject);
            }
        )*
    };
}
