//! Holds the shared-memory services of a network open, so that no process that is killed leaves one
//! half made, and cleans up after processes that die.

use crate::guard::guard_process::{HoldProgress, HoldTask};
use rc_deploy_network::services::Service;
use rc_iceoryx2::Holder;
use rc_middleware::{
    Address, Durability, Endpoint, Environment, OpenError, Qos, RunDirectory, Settings,
    TypeIdentity, WakeEvent,
};
use std::collections::VecDeque;
use std::fmt::Display;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, RecvTimeoutError, TryRecvError};
use std::time::{Duration, Instant};

/// How long a clean-up may take: a stopped process may delay it. A component that starts then
/// cleans up for itself.
const CLEAN_LIMIT: Duration = Duration::from_secs(30);
/// How often the guard checks whether its services still exist.
const LOOK: Duration = Duration::from_secs(1);
/// The time between two reports of a clean-up that goes on.
const CLEAN_REPORT: Duration = Duration::from_millis(500);

/// Creates and holds the services of `network` until `tasks` ends. A service that cannot be held is
/// reported on standard error, and the network starts without it.
pub fn hold(network: &str, tasks: &Receiver<HoldTask>, report: &dyn Fn(HoldProgress)) {
    let print_error = |what: &dyn Display| {
        rc_deploy_client::error::print_error(format_args!("guard of {network}: {what}"));
    };
    // A network without services on this middleware has no files of it.
    let mut holder = None;
    let mut tasks = Tasks::new(tasks);
    let mut look = Look::default();
    loop {
        let task = match tasks.next_within(LOOK) {
            Ok(task) => task,
            Err(RecvTimeoutError::Disconnected) => return,
            Err(RecvTimeoutError::Timeout) => {
                let missing = holder.as_ref().map(Holder::missing).unwrap_or_default();
                if let Some(missing) = look.again(missing) {
                    report(HoldProgress::Missing(missing));
                }
                continue;
            }
        };
        match task {
            HoldTask::Hold(service) => {
                if holder.is_none() {
                    holder = join(network).inspect_err(|e| print_error(&e)).ok();
                }
                if let Some(holder) = &mut holder
                    && let Err(error) = create(holder, *service)
                {
                    print_error(&error);
                }
                report(HoldProgress::Held);
            }
            HoldTask::CleanUp { mut deaths } => {
                while let Some(HoldTask::CleanUp { deaths: later }) = tasks.peek() {
                    deaths = *later;
                    tasks.waiting.pop_front();
                }
                if let Some(holder) = &holder {
                    clean_up(holder, &mut tasks, report);
                }
                report(HoldProgress::Cleaned(deaths));
            }
            HoldTask::Look => {
                // Whatever removes files may still be at work.
                for _ in 0..2 {
                    if !tasks.pause(LOOK) {
                        return;
                    }
                    let missing = holder.as_ref().map(Holder::missing).unwrap_or_default();
                    if let Some(missing) = look.again(missing) {
                        report(HoldProgress::Missing(missing));
                    }
                }
                report(HoldProgress::Looked);
            }
        }
    }
}

/// Looks for files that are missing at two looks in a row, until it has found some.
#[derive(Debug, Default)]
struct Look {
    before: Vec<PathBuf>,
    has_found: bool,
}

impl Look {
    fn again(&mut self, missing: Vec<PathBuf>) -> Option<Vec<PathBuf>> {
        let before = std::mem::replace(&mut self.before, missing);
        let now = self.before.iter();
        let both: Vec<PathBuf> = now.filter(|path| before.contains(path)).cloned().collect();
        if both.is_empty() || self.has_found {
            return None;
        }
        self.has_found = true;
        Some(both)
    }
}

/// Cleans up after all dead processes, unless the tasks end.
fn clean_up(holder: &Holder, tasks: &mut Tasks<'_>, report: &dyn Fn(HoldProgress)) {
    let end = Instant::now() + CLEAN_LIMIT;
    let mut told = Instant::now();
    holder.clean_while(&mut |removed| {
        if let Some(component) = removed {
            report(HoldProgress::Removed(component.to_owned()));
        } else if told.elapsed() >= CLEAN_REPORT {
            report(HoldProgress::Cleaning);
            told = Instant::now();
        }
        tasks.go_on() && Instant::now() < end
    });
}

/// The tasks, of which some can be looked at before it is their turn.
struct Tasks<'r> {
    tasks: &'r Receiver<HoldTask>,
    waiting: VecDeque<HoldTask>,
}

impl<'r> Tasks<'r> {
    fn new(tasks: &'r Receiver<HoldTask>) -> Self {
        Self {
            tasks,
            waiting: VecDeque::new(),
        }
    }

    /// Waits for the next one, at most for `limit`.
    fn next_within(&mut self, limit: Duration) -> Result<HoldTask, RecvTimeoutError> {
        match self.waiting.pop_front() {
            Some(task) => Ok(task),
            None => self.tasks.recv_timeout(limit),
        }
    }

    /// Keeps those that come within `limit` for later. Returns whether more may come.
    fn pause(&mut self, limit: Duration) -> bool {
        let end = Instant::now() + limit;
        loop {
            let left = end.saturating_duration_since(Instant::now());
            match self.tasks.recv_timeout(left) {
                Ok(task) => self.waiting.push_back(task),
                Err(error) => return error == RecvTimeoutError::Timeout,
            }
        }
    }

    /// The next one, if it is there.
    fn peek(&mut self) -> Option<&HoldTask> {
        self.go_on();
        self.waiting.front()
    }

    /// Takes those that have come. Returns whether more may come.
    fn go_on(&mut self) -> bool {
        loop {
            match self.tasks.try_recv() {
                Ok(task) => self.waiting.push_back(task),
                Err(TryRecvError::Empty) => return true,
                Err(TryRecvError::Disconnected) => return false,
            }
        }
    }
}

/// Joins the network.
fn join(network: &str) -> Result<Holder, String> {
    let environment = Environment {
        network: network.to_owned(),
        instance: "rcdeploy-guard".to_owned(),
        directory: RunDirectory::open(network).map_err(|e| e.to_string())?,
        wake_event: WakeEvent::new().map_err(|e| e.to_string())?,
        settings: Settings::default(),
    };
    Holder::new(&environment).map_err(|e| e.to_string())
}

fn create(holder: &mut Holder, service: Service) -> Result<(), OpenError> {
    let Ok(address) = Address::parse(&service.address) else {
        // The check of the network refuses such an address.
        return Ok(());
    };
    let durability = if service.keeps {
        Durability::TransientLocal
    } else {
        Durability::Volatile
    };
    let endpoint = Endpoint {
        address,
        types: TypeIdentity {
            name: service.types,
            hash: service.hash,
        },
        qos: Qos {
            depth: service.depth,
            durability,
            ..Qos::PUBLISHER
        },
        external_types: Vec::new(),
    };
    if service.topic {
        holder.hold_topic(&endpoint)
    } else {
        holder.hold_call(&endpoint)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::channel;

    fn deaths(task: Option<&HoldTask>) -> Option<u64> {
        match task {
            Some(HoldTask::CleanUp { deaths }) => Some(*deaths),
            _ => None,
        }
    }

    fn next(tasks: &mut Tasks<'_>) -> Option<HoldTask> {
        tasks.next_within(Duration::from_mins(1)).ok()
    }

    #[test]
    fn files_count_that_are_missing_at_two_looks() {
        let mut look = Look::default();
        let paths = |names: &[&str]| names.iter().map(PathBuf::from).collect::<Vec<_>>();
        assert_eq!(look.again(paths(&["a"])), None);
        assert_eq!(look.again(paths(&["b"])), None, "a was there again");
        assert_eq!(look.again(paths(&["b", "c"])), Some(paths(&["b"])));
        assert_eq!(look.again(paths(&["b", "c"])), None, "it is known");
    }

    #[test]
    fn tasks_are_looked_at_before_it_is_their_turn() {
        let (sender, receiver) = channel();
        let mut tasks = Tasks::new(&receiver);
        assert!(tasks.peek().is_none() && tasks.go_on());
        for deaths in 1..=3 {
            let task = HoldTask::CleanUp { deaths };
            sender.send(task).expect("a receiver");
        }
        assert!(matches!(
            tasks.peek(),
            Some(HoldTask::CleanUp { deaths: 1 })
        ));
        assert_eq!(deaths(next(&mut tasks).as_ref()), Some(1));
        drop(sender);
        assert!(!tasks.go_on(), "none comes any more");
        assert_eq!(deaths(next(&mut tasks).as_ref()), Some(2));
        assert_eq!(deaths(next(&mut tasks).as_ref()), Some(3));
        assert!(next(&mut tasks).is_none());
    }

    #[test]
    fn a_service_is_created_as_it_is_described() {
        let network = format!("services-{}", std::process::id());
        let directory = RunDirectory::of(&network);
        let service = |topic: bool, depth: u32, hash: u64| Service {
            address: if topic { "net/topic" } else { "net/call" }.to_owned(),
            types: "T".to_owned(),
            hash,
            topic,
            depth,
            keeps: false,
            users: Vec::new(),
        };
        let mut first = join(&network).expect("shared memory");
        create(&mut first, service(true, 100, 1)).expect("a topic");
        create(&mut first, service(false, 0, 1)).expect("a call");
        let mut second = join(&network).expect("shared memory");
        create(&mut second, service(true, 100, 1)).expect("the same topic");
        assert!(
            create(&mut second, service(true, 101, 1)).is_err(),
            "it holds less"
        );
        assert!(
            create(&mut second, service(true, 100, 2)).is_err(),
            "its types differ"
        );
        assert!(
            create(&mut second, service(false, 0, 2)).is_err(),
            "its types differ"
        );
        drop((first, second));
        directory.remove().expect("it is ours");
    }

    #[test]
    fn several_clean_ups_are_one() {
        let (sender, receiver) = channel();
        for deaths in 1..=3 {
            let task = HoldTask::CleanUp { deaths };
            sender.send(task).expect("a receiver");
        }
        drop(sender);
        let reports = std::cell::RefCell::new(Vec::new());
        let report = |progress| reports.borrow_mut().push(progress);
        hold("net", &receiver, &report);
        assert_eq!(reports.into_inner(), [HoldProgress::Cleaned(3)]);
    }
}
