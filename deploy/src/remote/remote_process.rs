//! A process on another machine, as each of its components sees it: its requests go to the agent
//! there.

use super::SupervisorMessage;
use super::socket_proxy::ROOM;
use crate::process::launch::NewComponent;
use rc_management::Output;
use rc_management::agent::Exit;
use rc_management::lines;
use std::cell::RefCell;
use std::rc::Rc;

/// How many bytes may wait for a machine that does not read.
const WAITING: usize = 4 << 20;

/// The messages for an agent. Its host and the units there share them.
#[derive(Clone, Debug)]
pub(crate) struct Outbox(pub(super) Rc<RefCell<Output>>);

impl Outbox {
    pub(crate) fn new() -> Self {
        Self(Rc::new(RefCell::new(Output::up_to(WAITING))))
    }

    /// Takes the messages that wait.
    #[cfg(test)]
    pub(crate) fn take(&self) -> Vec<SupervisorMessage> {
        let mut text = Vec::new();
        self.0.borrow_mut().write(&mut text).expect("memory");
        let lines = text.split(|byte| *byte == b'\n');
        let lines = lines.filter(|line| !line.is_empty());
        lines
            .map(|line| serde_json::from_slice(line).expect("a message"))
            .collect()
    }

    pub(super) fn push(&self, message: &SupervisorMessage) {
        self.0.borrow_mut().push(&lines::encode(message));
    }

    /// Whether callers of components may add to it.
    pub(super) fn has_room(&self) -> bool {
        self.0.borrow().len() < ROOM
    }
}

/// A process on another machine, as one of its components has it.
#[derive(Debug)]
pub(crate) struct RemoteProcess {
    component: String,
    process: String,
    outbox: Outbox,
    pub(crate) pid: Option<i32>,
    /// Whether the link of the component is open.
    pub(crate) linked: bool,
    exit: Option<Exit>,
}

impl RemoteProcess {
    /// Asks the agent to start a process with these components. `run` names this start.
    pub(crate) fn start<'a>(
        components: &'a [NewComponent<'_>],
        run: &'a str,
        outbox: &'a Outbox,
    ) -> impl Iterator<Item = Self> + 'a {
        let follow = (0..components.len()).rev();
        components.iter().zip(follow).map(move |(new, follow)| {
            outbox.push(&SupervisorMessage::Start {
                component: Box::new(new.component.clone()),
                run: run.to_owned(),
                greeting: new.greeting.clone(),
                after: new.after.clone(),
                more: follow > 0,
            });
            Self {
                component: new.component.name.clone(),
                process: new.component.process().to_owned(),
                outbox: outbox.clone(),
                pid: None,
                linked: true,
                exit: None,
            }
        })
    }

    /// Writes a line on the link of the component.
    pub(crate) fn send_line(&self, line: &str) {
        self.outbox.push(&SupervisorMessage::LinkLine {
            name: self.component.clone(),
            line: line.to_owned(),
        });
    }

    /// Asks the process to end.
    pub(crate) fn terminate(&self) {
        let stop = SupervisorMessage::Stop(self.process.clone());
        self.outbox.push(&stop);
    }

    /// Ends the process and its group.
    pub(crate) fn kill(&self) {
        let kill = SupervisorMessage::Kill(self.process.clone());
        self.outbox.push(&kill);
    }

    /// Notes how it ended.
    pub(crate) fn ended(&mut self, exit: Exit) {
        self.exit = Some(exit);
    }

    /// How it ended.
    pub(crate) fn exit(&mut self) -> Exit {
        let unknown = || Exit::without_status("unknown".to_owned());
        self.exit.take().unwrap_or_else(unknown)
    }
}
