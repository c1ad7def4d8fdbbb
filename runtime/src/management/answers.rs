//! Answers that come later than their requests: the worker or the life cycle decides them.

use super::{EmergencyRequest, Server};
use crate::parameter_server::{Answer, Requester};
use rc_management::component::Done;
use rc_management::rpc::{self, Error};
use serde_json::Value;
use std::time::Instant;

impl Server {
    /// Answers the requests about the emergency that the worker has executed, or that it will when
    /// its turn comes: a loop that hangs has a limit.
    pub(super) fn answer_emergencies(&mut self, ends: bool) {
        let (_, executed) = self.commands.emergencies();
        let now = Instant::now();
        let is_due = |one: &EmergencyRequest| ends || executed >= one.number || now >= one.until;
        let due: Vec<_> = self.emergencies.extract_if(.., |one| is_due(one)).collect();
        if !due.is_empty() {
            self.report_state();
        }
        for EmergencyRequest { requester, .. } in due {
            let (client, id) = requester;
            self.socket.settle(client);
            if let Some(id) = id {
                self.socket.answer(client, &id, rpc::result(&Done {}));
            }
        }
    }

    /// Reports the changes of a request before the request is answered, so that they are in the
    /// next status of the supervisor.
    pub(super) fn report_changes(&mut self) {
        self.report_state();
        if let Some(link) = &mut self.link
            && link.is_free()
        {
            link.send_heartbeat(self.info.heartbeat(&self.shared));
        }
    }

    /// Notes that the answer to a request comes later, or returns the error.
    pub(super) fn deferred(
        &mut self,
        client: u64,
        result: Result<(), Error>,
    ) -> Option<Result<Value, Error>> {
        match result {
            Ok(()) => {
                self.socket.defer(client);
                None
            }
            Err(error) => Some(Err(error)),
        }
    }

    /// Hands results of transitions to their requesters.
    pub(super) fn answer_transitions(&mut self) {
        let answers = self.lifecycle.turn();
        self.hand_over(answers);
    }

    /// Hands results to clients, if they are still there.
    pub(super) fn hand_over(&mut self, results: Vec<(u64, Option<Value>, Result<Value, Error>)>) {
        for (client, id, result) in results {
            self.socket.settle(client);
            if let Some(id) = id {
                self.socket.answer(client, &id, result);
            }
        }
    }

    /// Hands results of changes to their requesters, if they are still there.
    pub(super) fn answer(&mut self, answers: Vec<Answer>) {
        for (requester, result) in answers {
            match requester {
                Requester::Supervisor => {
                    let refused = result.err().map(|error| error.message);
                    if let Some(link) = &mut self.link {
                        link.set_restored(refused.as_deref());
                        link.set_ready();
                    }
                }
                Requester::Proposal(number) => {
                    self.link
                        .iter_mut()
                        .for_each(|link| link.set_proposed(number, result.clone()));
                }
                Requester::Settlement(number) => {
                    self.link
                        .iter_mut()
                        .for_each(|link| link.set_settled(number));
                }
                Requester::Worker(path) => {
                    if let Err(error) = result {
                        self.shared.refuse_own_change(&path, &error.message);
                    }
                    self.backends.own_change_ended();
                    self.shared.wake_event.wake();
                }
                Requester::Backend(number) => self.backends.answer(number, result.map(drop)),
                Requester::Client { number, id } => {
                    self.socket.settle(number);
                    if let Some(id) = id {
                        self.socket.answer(number, &id, result);
                    }
                }
            }
        }
    }
}
