//! Messages between a supervisor and its agent on another machine, over the standard streams
//! of ssh.
//!
//! The supervisor starts with [`SupervisorMessage::Network`]. The agent answers
//! [`AgentMessage::Missing`], receives the bytes of those files one after the other, and answers
//! [`AgentMessage::Ready`]. From then on both sides send at any time. Both are the same program, so
//! the protocol has no version.

use crate::lines::LIMIT;
use rc_vocabulary::foreign;
use rustix::process::Signal;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// The longest line after [`AgentMessage::Ready`], in bytes: it holds a line of a link, however
/// much of that JSON escapes.
pub const LONGEST: usize = 16 * LIMIT;

/// Message of the supervisor. `C` describes a component, `E` the virtual environment of one in
/// Python.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SupervisorMessage<C, E> {
    /// The first line.
    Network {
        /// The network's name.
        name: String,
        /// The files that the components need.
        files: Vec<File>,
        /// The environments of those in Python, whose packages are among the files.
        environments: Vec<E>,
        /// The shared-memory services that the guard keeps open, as JSON.
        services: String,
        /// The pause between two readings of the memory of a component, in milliseconds.
        memory_pause_ms: u64,
    },
    /// Start a process. For a process of several components, one message is sent for each of them,
    /// to bound the length of a line.
    Start {
        /// The component, with the paths of the agent's machine.
        component: Box<C>,
        /// Identifies this run of the process.
        run: String,
        /// The first line of the component's link.
        greeting: Option<String>,
        /// The components of the process that must be ready before it, by their names of processes.
        after: Vec<String>,
        /// Whether more components of the process follow, before it starts.
        more: bool,
    },
    /// Write a line on the link of a component.
    #[serde(rename = "say")]
    LinkLine {
        /// The component.
        name: String,
        /// The line, with its end.
        line: String,
    },
    /// Ask this process to end. A process of one component has its name.
    Stop(String),
    /// Kill this process and its group.
    Kill(String),
    /// A client has connected to the management socket of a component.
    #[serde(rename = "call")]
    Connect {
        /// Identifies the connection.
        wire: u64,
        /// The component.
        name: String,
    },
    /// Bytes from that client.
    #[serde(rename = "tell")]
    Data {
        /// The connection.
        wire: u64,
        /// The bytes.
        text: String,
    },
    /// That client has closed this connection.
    #[serde(rename = "shut")]
    Close(u64),
    /// The supervisor lives.
    #[serde(rename = "beat")]
    Heartbeat,
    /// All components have ended; clean up and exit.
    Farewell,
}

/// Message of an agent.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum AgentMessage {
    /// The indices of the files that the agent lacks, or has with another content.
    #[serde(rename = "wants")]
    Missing(Vec<usize>),
    /// The agent has all files and holds the network on its machine.
    #[serde(rename = "there")]
    Ready {
        /// The folder of the copies.
        root: PathBuf,
        /// How many processes of an earlier run the agent killed; none if there was no such run.
        recovered: Option<usize>,
    },
    /// The agent cannot do its work and exits.
    Refused(#[serde(deserialize_with = "foreign::lines")] String),
    /// A process was started.
    Started {
        /// Its name.
        name: String,
        /// Its number there.
        pid: i32,
    },
    /// A process could not be started.
    NotStarted {
        /// Its name.
        name: String,
        /// Why.
        #[serde(deserialize_with = "foreign::lines")]
        reason: String,
    },
    /// A line of a component's link.
    #[serde(rename = "said")]
    LinkLine {
        /// The component.
        name: String,
        /// The line; none if it was too long.
        line: Option<String>,
    },
    /// This component has closed its link.
    #[serde(rename = "closed")]
    LinkClosed(String),
    /// Output of a component, or of a process of several ones, from its log.
    Printed {
        /// The component or the process.
        name: String,
        /// The output.
        text: String,
    },
    /// Bytes from the management socket of a component.
    #[serde(rename = "tell")]
    Data {
        /// The connection.
        wire: u64,
        /// The bytes.
        text: String,
    },
    /// The component has closed this connection, or refuses it.
    #[serde(rename = "shut")]
    Close(u64),
    /// A process has ended, with all that it left.
    Ended {
        /// Its name.
        name: String,
        /// How it ended.
        exit: Exit,
        /// How many orphans of it the agent killed.
        left: usize,
    },
    /// The resident memory of a process, in bytes.
    Memory {
        /// Its name.
        name: String,
        /// Its memory.
        bytes: u64,
    },
    /// A condition of the machine holds, from now on. The codes are those of events.
    Trouble {
        /// Which one.
        #[serde(deserialize_with = "foreign::text")]
        code: String,
        /// The condition, for people.
        #[serde(deserialize_with = "foreign::lines")]
        text: String,
    },
    /// This condition has ended.
    #[serde(rename = "over")]
    TroubleOver {
        /// Which one.
        #[serde(deserialize_with = "foreign::text")]
        code: String,
        /// The present condition.
        #[serde(deserialize_with = "foreign::lines")]
        text: String,
    },
    /// These files of the shared memory were removed: all components of this machine have to end
    /// before one starts.
    MemoryLost(#[serde(deserialize_with = "foreign::lines")] String),
    /// A message of the agent, for people.
    Note(#[serde(deserialize_with = "foreign::lines")] String),
    /// The agent lives.
    #[serde(rename = "beat")]
    Heartbeat,
    /// All processes have ended.
    #[serde(rename = "gone")]
    Finished {
        /// How many orphans of components the agent killed.
        left: usize,
    },
}

/// A file that an agent needs.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct File {
    /// The path on the supervisor's machine, without `.` and `..`. The copy has it below the folder
    /// of the copies.
    pub path: PathBuf,
    /// SHA-256 of the content, in hexadecimal.
    pub hash: String,
    /// The length in bytes.
    pub size: u64,
    /// Whether it is executable.
    pub executable: bool,
}

/// How a process ended.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Exit {
    /// Whether the exit code was 0.
    pub success: bool,
    /// The signal that killed it.
    pub signal: Option<i32>,
    /// `exit status 1`, `signal 11 (SIGSEGV)`.
    #[serde(deserialize_with = "foreign::text")]
    pub text: String,
}

impl Exit {
    /// The end of a process whose exit status is unknown.
    pub fn without_status(text: String) -> Self {
        Self {
            success: false,
            signal: None,
            text,
        }
    }

    /// Whether the process ended as it should: with exit code 0, or by SIGTERM if it was `asked` to
    /// end.
    pub fn is_done(&self, asked: bool) -> bool {
        self.success || (asked && self.signal == Some(Signal::TERM.as_raw()))
    }
}
