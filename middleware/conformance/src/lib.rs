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
pub mod topics;
pub mod typed;

use rc_middleware::qos::MAX_READERS;
use rc_middleware::{Backend, Environment, OpenError, RunDirectory};
use std::path::PathBuf;
use std::sync::MutexGuard;

/// A backend under test.
pub trait Subject: Sync {
    /// Joins the network of `environment`.
    fn connect(&self, environment: &Environment) -> Result<Box<dyn Backend>, OpenError>;

    /// What the network has left on the system although all endpoints were closed. Anything left
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

    /// Whether more samples than requested may be kept for a while.
    fn keeps_more(&self) -> bool {
        false
    }

    /// Number of clients, each a component, that call one server at once.
    fn clients(&self) -> usize {
        MAX_READERS
    }

    /// Size of the largest sample that arrives whatever load the receiving machine has.
    fn largest(&self) -> usize {
        usize::MAX
    }

    /// Whether a descriptor may become readable without a sample.
    fn rings_for_less(&self) -> bool {
        false
    }

    /// Whether zeros may follow a body that was sent without them.
    fn pads(&self) -> bool {
        false
    }

    /// The lock that each test holds, for a subject whose tests have to run one at a time.
    fn alone(&self) -> Option<MutexGuard<'static, ()>> {
        None
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
            a_value_reaches_every_subscriber
            many_publishers_reach_one_subscriber_in_order
            every_size_travels
            no_subscriber_is_no_error
            a_late_subscriber_gets_nothing_old
            a_late_subscriber_gets_what_was_kept
            a_publisher_that_keeps_values_reaches_all
            a_slow_subscriber_keeps_the_newest_and_delays_nobody
            what_was_lost_is_counted
            publishers_come_and_go
            ends_are_counted
            a_value_wakes
            topics_of_different_types_refuse_each_other
        );
        $crate::suite!(@of calls, $subject,
            commands_and_queries_keep_their_order
            each_client_gets_its_own_answers
            a_late_server_is_found
            a_server_comes_back
            a_client_comes_back
            clients_are_served_in_turn
            requests_and_answers_may_be_large
            sides_are_counted
            a_second_server_is_refused
            calls_of_different_types_refuse_each_other
            networks_are_apart
        );
        $crate::suite!(@of failures, $subject,
            without_a_server_a_call_fails_at_once
            a_deadline_leaves_nothing_behind
            a_late_answer_is_not_taken_for_the_next
            a_full_queue_is_told
            a_stop_ends_a_call
            a_wake_up_ends_no_call_and_stays
            a_server_that_leaves_ends_the_call
            a_server_that_leaves_ends_the_calls_it_holds
            a_call_that_stays_awake_sleeps_in_the_end
        );
        $crate::suite!(@of limits, $subject,
            sixty_four_clients_are_served
            a_thousand_requests_get_their_own_answers
            sixteen_publishers_reach_sixty_four_subscribers
        );
        $crate::suite!(@of typed, $subject,
            topics_carry_values
            queries_bring_results_exceptions_and_refusals
        );
        $crate::suite!(@of in_place, $subject,
            topics_carry_values_in_place
            answers_may_be_in_place
        );
    };
    (@of $module:ident, $subject:expr, $($name:ident)*) => {
        $(
            #[test]
            fn $name() {
                let _alone = $crate::Subject::alone(&$subject);
                $crate::$module::$name(&$subject);
            }
        )*
    };
}
